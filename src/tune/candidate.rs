//! Controllers that are compared on an identified cell.

use std::sync::Arc;

use super::propose::{DistanceProposal, Proposal};
use crate::cell::file::RunPart;
use crate::width_control::pi::PiGains;
use crate::width_control::strategy::WidthStrategy;
use crate::width_control::strategy::distance::DistanceStrategy;
use crate::width_control::strategy::pi::PiStrategy;

/// A controller that is compared.
#[derive(Debug, Clone)]
pub struct ControllerCandidate {
    /// Its name.
    pub name: String,
    /// Its width controller.
    pub strategy: Arc<dyn WidthStrategy>,
    /// Gains of the PI controller.
    pub gains: Option<PiGains>,
    /// Distance of the camera that it assumes \[mm\].
    pub offset_mm: f64,
    /// Standard deviation of that distance \[mm\].
    pub offset_sigma_mm: f64,
}

impl ControllerCandidate {
    /// The controller of the cell file; `None` if its strategy does not control the width.
    pub fn now(run: &RunPart) -> Option<Self> {
        let strategy = &run.control.strategy;
        let name = if strategy.as_kind::<PiStrategy>().is_some() {
            "as it is now (PI)"
        } else if strategy.as_kind::<DistanceStrategy>().is_some() {
            "as it is now (by distance)"
        } else {
            return None;
        };
        Some(Self {
            name: name.to_owned(),
            strategy: Arc::clone(strategy),
            gains: run.control.gains,
            offset_mm: run.camera.offset.get(),
            offset_sigma_mm: run.camera.offset_sigma.get(),
        })
    }

    /// The proposed PI controller.
    pub fn pi(proposal: &Proposal) -> Self {
        let gains = Some(proposal.pi.gains);
        let strategy = Arc::new(PiStrategy);
        Self { strategy, gains, ..Self::of("proposed PI", &proposal.distance) }
    }

    /// The proposed distance controller.
    pub fn distance(proposal: &Proposal) -> Self {
        Self::of("proposed, by distance", &proposal.distance)
    }

    fn of(name: &str, settings: &DistanceProposal) -> Self {
        Self {
            name: name.to_owned(),
            strategy: Arc::new(DistanceStrategy {
                exponent: settings.exponent,
                learns_exponent: settings.learns,
                drift_per_root_m: settings.drift_per_root_m,
                cancels_pulsation: true,
            }),
            gains: None,
            offset_mm: settings.offset_mm,
            offset_sigma_mm: settings.offset_sigma_mm,
        }
    }

    /// The distance controller as proposed, and with mismatched settings.
    pub fn mismatched(proposal: &Proposal) -> Vec<Self> {
        let settings = proposal.distance;
        let cases: [(&str, f64, f64); 5] = [
            ("as proposed", 1.0, 1.0),
            ("offset_mm 20 % too small", 0.8, 1.0),
            ("offset_mm 20 % too large", 1.2, 1.0),
            ("exponent half as large", 1.0, 0.5),
            ("exponent half as large again", 1.0, 1.5),
        ];
        let case = |(name, offset, exponent): (&str, f64, f64)| {
            let settings = DistanceProposal {
                offset_mm: settings.offset_mm * offset,
                exponent: settings.exponent * exponent,
                ..settings
            };
            Self::of(name, &settings)
        };
        cases.map(case).to_vec()
    }
}
