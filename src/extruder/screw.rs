//! A screw that is filled through its feed: Diagne et al. 2015. Between feed
//! and plug the material rides along the screw, so that what is fed now
//! reaches the plug after a delay that depends on time and on the plug itself.
//!
//! [`Screw`] is the model, [`feasible`] says whether a feed can always reach
//! the plug, [`feedback`] what to feed at a length of the plug, [`exact`] and
//! [`euler`] where the plug will be when the feed arrives, and [`control`] all
//! of it together.

pub mod control;
pub mod design;
pub mod error;
pub mod euler;
pub mod exact;
pub mod feasible;
pub mod feed_history;
pub mod feedback;
pub mod model;

pub use control::{ScrewControl, ScrewFault, ScrewStep};
pub use design::{ScrewDesign, TurnUnit};
pub use error::ScrewError;
pub use feedback::{FillFeedback, PiecewiseExponential, SaturatedLinear};
pub use model::{Conveying, Screw, SpeedPulsation};
