//! `truebead lab`: how well it measures and controls.

mod accuracy;
mod render;
mod reproduce;

use std::process::ExitCode;

use clap::Subcommand;

use super::print::Verbosity;

/// Experiments of papers, accuracy, and frames with their truth
#[derive(Debug, Subcommand)]
pub enum LabCommand {
    Reproduce(reproduce::ReproduceArgs),
    Accuracy(accuracy::AccuracyArgs),
    Render(render::RenderArgs),
}

/// Runs one of them.
pub fn run(command: &LabCommand, voice: Verbosity) -> anyhow::Result<ExitCode> {
    match command {
        LabCommand::Reproduce(args) => reproduce::run(args, voice),
        LabCommand::Accuracy(args) => accuracy::run(args, voice),
        LabCommand::Render(args) => render::run(args, voice).map(|()| ExitCode::SUCCESS),
    }
}
