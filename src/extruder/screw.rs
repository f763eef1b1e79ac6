//! Control of a screw that is filled through its feed (Diagne et al. 2015). Between feed and plug
//! the material is conveyed along the screw, so that the feed reaches the plug after a delay that
//! depends on time and on the plug's length.
//!
//! [`Screw`] is the model, [`feasible`] checks that every feed reaches the plug, [`feedback`] is
//! the feed for a length of the plug, [`exact`] and [`euler`] predict the plug when the feed
//! arrives, and [`control`] combines them.

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
