//! Linear models of an extruder: transfer functions in continuous time with
//! dead time, what they are on a grid of samples, and their simulation.
