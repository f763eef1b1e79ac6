//! What a person types: one file a command.

pub mod calibrate;
pub mod render;
pub mod robot_sim;

/// Arguments that cannot be followed; ends with exit status 2.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct WrongArguments(String);

impl WrongArguments {
    /// With what was found and what was expected.
    pub fn new(what: impl ToString) -> Self {
        Self(what.to_string())
    }
}
