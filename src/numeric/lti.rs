//! Linear models: transfer functions in continuous time with dead time, their discretisation
//! and simulation.
//!
//! ```text
//! process::{FirstOrder, SecondOrder} → TransferFunction
//!   → discretise(dt, method) → DiscreteTransfer
//!   → Simulator::new(tf, dt, between) → step(u) → y      (exact, any dead time)
//!   → margins(loop)
//! ```
//!
//! Coefficients are given with the highest power first, times in seconds.

mod discrete;
mod margins;
pub mod polynomial;
mod process;
mod simulate;
mod state;
mod transfer;

pub use discrete::{DiscreteTransfer, DiscretisationMethod};
pub use margins::{StabilityMargins, margins};
pub use process::{FirstOrder, SecondOrder};
pub use simulate::{Between, Simulator, simulate};
pub use state::{Advance, StateSpace};
pub use transfer::{ModelError, TransferFunction};
