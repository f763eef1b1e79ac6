//! The extruder side: what to command the extruder so that the flow at the
//! nozzle is what the robot is about to need. Like the width controller it
//! keeps no clock and opens nothing.
