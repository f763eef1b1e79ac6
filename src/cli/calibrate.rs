//! Finds the calibration.
