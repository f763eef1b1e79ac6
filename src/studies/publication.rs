//! The papers whose experiments are reproduced.

/// A paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Publication {
    /// Shojaei Barjuei et al. 2022: width by robot speed.
    Barjuei2022,
    /// Bead characterisation thesis: models of the extruder, and speed from flow.
    BcsThesis,
    /// Diagne et al. 2015: a screw with a delay that depends on time and state.
    Diagne2015,
    /// Ma et al. 2026: pressure at the nozzle.
    Ma2026,
    /// Mohammadi Looey et al. 2026: adaptive control of nozzle and plate.
    Looey2026,
}

impl Publication {
    /// All of them, in the order of the page.
    pub const ALL: [Self; 5] =
        [Self::Barjuei2022, Self::BcsThesis, Self::Diagne2015, Self::Ma2026, Self::Looey2026];

    /// The name that `reproduce.json` and the command line have.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Barjuei2022 => "barjuei2022",
            Self::BcsThesis => "bcs-thesis",
            Self::Diagne2015 => "diagne2015",
            Self::Ma2026 => "ma2026",
            Self::Looey2026 => "looey2026",
        }
    }

    /// Its subject, in one line.
    pub const fn about(self) -> &'static str {
        match self {
            Self::Barjuei2022 => "Shojaei Barjuei et al. 2022: width by robot speed",
            Self::BcsThesis => {
                "bead characterisation thesis: extruder models, speed by flow, starts and stops"
            }
            Self::Diagne2015 => "Diagne et al. 2015: screw with a delay of time and state",
            Self::Ma2026 => "Ma et al. 2026: pressure at the nozzle",
            Self::Looey2026 => "Mohammadi Looey et al. 2026: adaptive control of nozzle and plate",
        }
    }
}
