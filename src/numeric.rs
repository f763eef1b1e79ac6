//! Numerical methods: statistics, filters, linear systems, fits.

#![expect(
    clippy::inline_always,
    reason = "a loop takes part in the choice of vectors only where it is inlined into it"
)]

pub mod average;
pub mod blurred_step;
pub mod estimate;
pub mod gauss_legendre;
pub mod hampel;
pub mod levenberg_marquardt;
pub mod linear;
pub mod lti;
pub mod normal_distribution;
pub mod normal_equations;
pub mod number;
pub mod rank;
pub mod root;
pub mod row;
pub mod savgol;
pub mod statistics;
