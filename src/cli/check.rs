//! `truebead check`: whether a cell file is valid, and for which commands it is ready.

mod calibration_map;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use nalgebra::Point3;

use super::arguments::{Written, WrongArguments, check_writable};
use super::live_cell::simulated_camera;
use super::print::warn;
use super::schema;
use crate::assembly::{ExtruderSide, LoadedCell, range_warning, read_cell, steady_state};
use crate::calibration::Calibration;
use crate::cell::file::{ImageSource, Purpose, RunPart};
use crate::core::{Mm, Size, Span};
use crate::drivers::Devices;
use crate::extruder::start_stop::Pause;
use crate::width_control::strategy::distance::DistanceStrategy;

/// Ratio of the speed limits above which one of them probably has a wrong unit.
const MAX_SPEED_RATIO: f64 = 200.0;
/// Offset of the camera below which it probably has a wrong unit.
const MIN_CAMERA_OFFSET: Mm = Mm::constant(0.5);

/// Validates a cell file and all it refers to.
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  truebead check cells/barjuei2022.toml

Every violation is reported at once, with its line. Exit status 2 if there is
one.

  truebead check my-cell.toml --report calibration.html

draws the uncertainty of a width by the calibration, over the image, with the
gauge.

  truebead check --schema > cell.schema.json

is for an editor: `#:schema cell.schema.json` in the first line of a cell file.")]
pub struct CheckArgs {
    /// Cell file
    #[arg(required_unless_present = "schema")]
    cell: Option<PathBuf>,
    /// Page to write: the uncertainty of a width by the calibration, over the image, with
    /// the gauge
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Print the JSON Schema of cell files instead, for editors that complete TOML by one
    #[arg(long, exclusive = true)]
    schema: bool,
}

/// Runs the command; the results go to standard output.
pub fn run(args: &CheckArgs) -> anyhow::Result<ExitCode> {
    let Some(cell) = &args.cell else {
        say!("{:#}", schema::of_a_cell());
        return Ok(ExitCode::SUCCESS);
    };
    if let Some(report) = &args.report {
        check_writable("report", report, Written::Page)?;
    }
    let loaded = LoadedCell::read(cell, Purpose::Measure)?;
    check_height(&loaded)?;
    let run = read_cell(cell, &loaded.text, Purpose::Run);
    let run = run.map(|(cell, devices)| LoadedCell { cell, devices, ..loaded.clone() });
    // All files of the extruder's strategy are checked before the cell is called valid.
    let side = run.as_ref().map_or(Ok(None), LoadedCell::extruder)?;
    if let Some(side) = &side {
        warn(&side.warnings);
    }
    run.as_ref().map_or(Ok(()), LoadedCell::check_camera_offset)?;
    check_gauge(&loaded)?;
    say!("{}: sound", cell.display());
    say!("  calibration  {}", loaded.calibration_words());
    if let Calibration::Full { image_size_px: [width, height], .. } = loaded.calibration {
        say!("  images       {width}x{height} px");
    }
    about_surface(&loaded);
    calibration_map::tell(&loaded, args.report.as_deref())?;
    say!("  ready for process, lab render");
    match run {
        Ok(loaded) => {
            let Some(run) = &loaded.cell.run else { return Ok(ExitCode::SUCCESS) };
            about_purposes(run, &loaded.devices);
            about_robot(&loaded.devices);
            about_camera(run, &loaded.devices);
            about_run(run);
            about_controller(&loaded, run);
            about_extruder(&loaded, run, side.as_ref())?;
        }
        Err(missing) => {
            say!("  not for run, simulate; missing:");
            for problem in &missing.list {
                say!("    {}: {}", problem.key, problem.expected);
            }
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Height of the camera above the measured surface \[mm\]; `None` for a single scale.
fn above_surface_mm(loaded: &LoadedCell) -> Option<f64> {
    let Calibration::Full { bed, .. } = &loaded.calibration else { return None };
    Some(bed.apply_inverse(Point3::origin()).z - loaded.cell.surface_height.get())
}

/// Refuses a surface on which the camera does not look down.
fn check_height(loaded: &LoadedCell) -> Result<(), WrongArguments> {
    let height = loaded.cell.surface_height;
    match above_surface_mm(loaded) {
        Some(above) if above <= 0.0 => Err(wrong!(
            "{}: calibration.surface_height_mm: found {height}, expected less than the camera's \
             {:.1} mm above the bed",
            loaded.path.display(),
            above + height.get()
        )),
        _ => Ok(()),
    }
}

/// Warns if a cell uses a calibration outside the range of its boards.
fn about_surface(loaded: &LoadedCell) {
    let (height, roi) = (loaded.cell.surface_height, loaded.cell.gauge.roi);
    let has_sigma = loaded.cell.surface_height_sigma > Mm::ZERO;
    let Some(above) = above_surface_mm(loaded) else {
        if has_sigma {
            say!(
                "  WARNING      surface_height_sigma_mm has no effect beside mm_per_px, which\n               \
                 knows no height"
            );
        }
        return;
    };
    say!(
        "  height       1 mm of error in surface_height_mm makes {:.3} % of error in a width",
        100.0 / above
    );
    if !has_sigma {
        say!("               (surface_height_sigma_mm puts it into sigma_mm)");
    }
    let Calibration::Full { quality: Some(quality), .. } = &loaded.calibration else { return };
    if let Some([low, high]) = quality.heights_mm
        && !(low..=high).contains(&height.get())
    {
        say!(
            "  WARNING      surface_height_mm: {height} lies outside the {low} to {high} mm above\n               \
             the bed at which boards were seen"
        );
    }
    let Some([left, top, right, bottom]) = quality.seen_px else { return };
    let ends = [roi.x, roi.y, roi.x + roi.width - 1, roi.y + roi.height - 1];
    let [first_x, first_y, last_x, last_y] =
        ends.map(|px| u32::try_from(px).map_or(f64::MAX, f64::from));
    if first_x < left || first_y < top || last_x > right || last_y > bottom {
        let effect = if quality.uncertainty.is_some() {
            "sigma_mm there is\n               extrapolated by the model of the lens"
        } else {
            "a width there is known\n               less well than sigma_mm says"
        };
        say!(
            "  WARNING      gauge.roi_px reaches beyond where boards were seen, columns {left:.0}\n               \
             to {right:.0} and rows {top:.0} to {bottom:.0}; {effect}"
        );
    }
}

/// Prints the commands for which a cell with a complete robot part is ready, and what its extruder
/// part lacks for the others.
fn about_purposes(run: &RunPart, devices: &Devices) {
    let part = run.extruder.as_ref();
    let has_link = part.is_none_or(|_| devices.extruder.is_some());
    let has_plant = part.is_none_or(|part| part.plant.is_some());
    let needs = [
        ("run", has_link, "extruder.driver, address: \"line\" and host:port"),
        ("simulate", has_plant, "extruder_plant: what answers the extruder's commands"),
    ];
    for (purpose, ..) in needs.iter().filter(|(_, is_met, _)| *is_met) {
        say!("  ready for {purpose}");
    }
    for (purpose, _, missing) in needs.iter().filter(|(_, is_met, _)| !*is_met) {
        say!("  not for {purpose}; missing:\n    {missing}");
    }
}

/// Prints the extruder side and its files.
fn about_extruder(
    loaded: &LoadedCell,
    run: &RunPart,
    side: Option<&ExtruderSide>,
) -> anyhow::Result<()> {
    let Some(part) = &run.extruder else { return Ok(()) };
    let (extruder, unit) = (&part.extruder, part.extruder.drive.unit_word());
    let (low, high) = extruder.limits.range();
    say!(
        "  extruder     commands {low} to {high} {unit}, {:.1} mm³/s wanted",
        part.demand.nominal().get()
    );
    if let Some(steady) = side.map_or(Ok(None), |side| steady_state(part, side))? {
        let pressure = steady.pressure.map_or(String::new(), |pressure| {
            format!(" and {:.3} MPa at the nozzle", pressure.get())
        });
        say!("               which take {:.4} {unit}{pressure} for long", steady.command);
    }
    if let Some(side) = side {
        about_starts_and_plan(side);
    }
    if let Some(side) = side
        && let Some(words) = range_warning(part, side)?
    {
        say!("  WARNING      {words}");
    }
    if let Some(Err(why)) = run.counted_pulses() {
        say!("  WARNING      extruder.pulses_per_turn has no effect:\n               {why}");
    }
    if part.plant.is_some() {
        let _ = loaded.plant(part)?;
    }
    if let Some(device) = &loaded.devices.extruder {
        let (address, valid_ms) = (device.driver.address(), extruder.valid_ms);
        say!("               reached at {address}, a command holds for {valid_ms} ms");
    }
    Ok(())
}

/// Prints the data that are known ahead: starts, stops and the plan of a job.
fn about_starts_and_plan(side: &ExtruderSide) {
    if let Some(timing) = &side.setup.timing {
        let pause = Pause { idle: Span::from_secs(300.0), flow_before: timing.conditions().flow };
        say!(
            "  starts       the flow comes {:.2} s after the command where the pump stood for 5 min;\n               \
             it stops {:.1} before a bead ends whose length is known",
            timing.start(&pause).first_flow().secs(),
            timing.stop().distance()
        );
    }
    if let Some(plan) = &side.setup.plan {
        let (slow, fast) = plan.speeds();
        let length: f64 = plan.beads().iter().map(|bead| bead.end().get()).sum();
        let count = plan.beads().len();
        let beads = if count == 1 { "bead" } else { "beads" };
        say!("  plan         {count} {beads}, {length:.1} mm, at {slow:.1} to {fast:.1} mm/s");
    }
}

/// Refuses a gauge outside the calibrated images: no frame could be measured.
fn check_gauge(loaded: &LoadedCell) -> Result<(), WrongArguments> {
    let Calibration::Full { image_size_px: [width, height], .. } = loaded.calibration else {
        return Ok(());
    };
    let roi = loaded.cell.gauge.roi;
    if roi.fits(Size::new(width as usize, height as usize)) {
        return Ok(());
    }
    Err(wrong!(
        "{}: gauge.roi_px: found columns to {} and rows to {}, expected a gauge within the \
         {width}x{height} px that were calibrated",
        loaded.path.display(),
        roi.x + roi.width,
        roi.y + roi.height
    ))
}

/// Prints the strategy, unless it is PI control.
fn about_controller(loaded: &LoadedCell, run: &RunPart) {
    if let Some(steps) = loaded.cell.steps(run, &loaded.calibration) {
        let (slow, fast) = steps.speeds();
        say!(
            "  strategy     none: steps between {:.1} and {:.1} mm/s, over {:.2} m",
            slow.get(),
            fast.get(),
            steps.length().get() / 1e3
        );
    }
    let Some(given) = run.control.strategy.as_kind::<DistanceStrategy>() else { return };
    let learnt = if given.learns_exponent { ", learnt as the bead is laid" } else { "" };
    say!("  strategy     by distance, b = {}{learnt}", given.exponent);
    let gauge = loaded.cell.gauge_length(&loaded.calibration);
    say!(
        "               gauge {:.1} mm long, {:.1} ± {:.1} mm behind the nozzle",
        gauge.get(),
        run.camera.offset.get(),
        run.camera.offset_sigma.get()
    );
    if gauge > run.camera.offset * 0.5 {
        say!(
            "  WARNING      gauge.roi_px is more than half as long as offset_mm: a shorter one\n               \
             shows changes of the bead sooner"
        );
    }
}

/// Prints the robot's address and the capabilities of its driver.
fn about_robot(devices: &Devices) {
    let Some(robot) = &devices.robot else { return };
    let (name, can) = (robot.registration.name, robot.registration.capabilities);
    say!("  robot        {name}, {}: {can}", robot.driver.address());
    if !can.setpoints_expire {
        say!("  WARNING      a setpoint never expires at this robot: it does not stop by itself");
        say!("               where it loses the PC");
    }
}

fn about_camera(run: &RunPart, devices: &Devices) {
    say!("  camera       {}, {} frames a second", run.camera.source_name, run.camera.rate_hz);
    if let ImageSource::Path(path) = &run.camera.source
        && !path.exists()
    {
        say!("  WARNING      camera.source: {} is not there now", path.display());
    }
    let robot = devices.robot.as_ref().map(|robot| robot.driver.address());
    if let Some(words) = robot.and_then(|robot| simulated_camera(run, &robot)) {
        say!("  WARNING      {words}");
    }
}

fn about_run(run: &RunPart) {
    let seconds = run.robot.start_length.get() / run.robot.start_speed.get();
    say!(
        "  control      begins {:.0} mm into the bead, after {seconds:.1} s at {}",
        run.robot.start_length.get(),
        run.robot.start_speed
    );
    let (slowest, fastest) = (run.limits.min_speed, run.limits.max_speed);
    if fastest > slowest * MAX_SPEED_RATIO {
        say!("  WARNING      [limits] go from {slowest} to {fastest}: are both mm/s?");
    }
    if run.camera.offset < MIN_CAMERA_OFFSET {
        say!("  WARNING      camera.offset_mm: {} is hardly a nozzle's width;", run.camera.offset);
        say!("               is it mm?");
    }
    let delay = run.camera.offset.get() / run.robot.start_speed.get();
    say!("  dead time    {delay:.2} s at that speed, from nozzle to gauge");
}
