//! Rates and latencies of a cell.

use serde::Serialize;

use super::Log;
use crate::core::Stamp;
use crate::numeric::rank;

/// Rates and latencies of a cell \[s\]: medians, and 99th percentiles where late events matter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CellTiming {
    /// From a frame's capture to its width's arrival at the controller.
    pub latency_s: f64,
    /// 99th percentile of that latency.
    pub latency_p99_s: f64,
    /// Period of the measured frames.
    pub frame_s: f64,
    /// Period of the reports.
    pub report_s: f64,
    /// 99th percentile of that period.
    pub report_p99_s: f64,
    /// Period of the setpoints.
    pub setpoint_s: f64,
}

/// Rates and latencies of a run; 0 for a period without two events.
pub fn timing(log: &Log) -> CellTiming {
    let frames: Vec<Stamp> = log.widths.iter().map(|width| width.at).collect();
    let reports: Vec<Stamp> = log.states.iter().map(|(at, _)| *at).collect();
    let setpoints: Vec<Stamp> = log.setpoints.iter().map(|(at, _)| *at).collect();
    let mut latencies = log.latencies_s.clone();
    let mut between = periods(&reports);
    let quantile = |values: &mut [f64], fraction| rank::quantile(values, fraction).unwrap_or(0.0);
    CellTiming {
        latency_s: quantile(&mut latencies, 0.5),
        latency_p99_s: quantile(&mut latencies, 0.99),
        frame_s: quantile(&mut periods(&frames), 0.5),
        report_s: quantile(&mut between, 0.5),
        report_p99_s: quantile(&mut between, 0.99),
        setpoint_s: quantile(&mut periods(&setpoints), 0.5),
    }
}

fn periods(times: &[Stamp]) -> Vec<f64> {
    let pairs = times.iter().zip(times.iter().skip(1));
    pairs.map(|(before, after)| (*after - *before).secs()).collect()
}
