//! Laws that are tried on a cell as it was found.

use std::sync::Arc;

use super::propose::{DistanceProposal, Proposal};
use crate::cell::file::RunPart;
use crate::width_control::pi::PiGains;
use crate::width_control::strategy::WidthStrategy;
use crate::width_control::strategy::distance::DistanceStrategy;
use crate::width_control::strategy::pi::PiStrategy;

/// A law that is tried.
#[derive(Debug, Clone)]
pub struct ControllerCandidate {
    /// What it is called.
    pub name: String,
    /// Its width controller.
    pub strategy: Arc<dyn WidthStrategy>,
    /// Gains of the PI law.
    pub gains: Option<PiGains>,
    /// The camera's distance that it is told \[mm\].
    pub offset_mm: f64,
    /// Its standard deviation \[mm\].
    pub offset_sigma_mm: f64,
}

impl ControllerCandidate {
    /// As the cell has it now; none where its law holds no width.
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

    /// The proposed PI law.
    pub fn pi(proposal: &Proposal) -> Self {
        Self {
            name: "proposed PI".to_owned(),
            strategy: Arc::new(PiStrategy),
            gains: Some(proposal.pi.gains),
            offset_mm: proposal.distance.offset_mm,
            offset_sigma_mm: proposal.distance.offset_sigma_mm,
        }
    }

    /// The proposed law by distance.
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
            }),
            gains: None,
            offset_mm: settings.offset_mm,
            offset_sigma_mm: settings.offset_sigma_mm,
        }
    }

    /// The law by distance as it is proposed, and with what it is told wrong.
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
