//! `truebead lab`: how well it measures and controls.

mod accuracy;
mod case_rows;
mod control;
mod live;
mod render;
mod reproduce;

use std::process::ExitCode;

use clap::Subcommand;

use super::print::Verbosity;

/// Experiments of papers, accuracy, and frames with their truth
#[derive(Debug, Subcommand)]
pub enum LabGroup {
    Reproduce(reproduce::ReproduceArgs),
    Accuracy(accuracy::AccuracyArgs),
    Control(control::ControlArgs),
    Live(live::LiveArgs),
    Render(render::RenderArgs),
}

/// Runs a command of the group.
pub fn run(command: &LabGroup, voice: Verbosity) -> anyhow::Result<ExitCode> {
    match command {
        LabGroup::Reproduce(args) => reproduce::run(args, voice),
        LabGroup::Accuracy(args) => accuracy::run(args, voice),
        LabGroup::Control(args) => control::run(args, voice),
        LabGroup::Live(args) => live::run(args, voice),
        LabGroup::Render(args) => render::run(args, voice).map(|()| ExitCode::SUCCESS),
    }
}
