//! Pressure and screw speed for a print speed: the bead's section ([`super::demand::section`])
//! gives the flow, the nozzle's power law the pressure, and the screw's drag flow its speed. Both
//! laws are also inverted. Ma et al. 2026, eqs. (1) to (5).

use crate::core::{MPa, Mm3PerS, Rpm};

/// A parameter or a quantity out of range.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum RheologyError {
    /// Not positive.
    #[error("{what} is {found}: it must be finite and above 0")]
    NotPositive {
        /// Name of the quantity, with its unit.
        what: &'static str,
        /// The value.
        found: f64,
    },
    /// A flow or a pressure below zero.
    #[error("{what} is {found}: it must not be negative")]
    Negative {
        /// Name of the quantity, with its unit.
        what: &'static str,
        /// The value.
        found: f64,
    },
    /// The result overflows. Name of the quantity, with its unit.
    #[error("{0} is beyond any machine: check the units of the power law and of the request")]
    TooLarge(&'static str),
}

/// The melt in the nozzle: mass flow = k·P^α. Ma et al. 2026, eq. (4).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PowerLaw {
    k: f64,
    exponent: f64,
    density: f64,
}

impl PowerLaw {
    /// Polypropylene with 28 % of glass fibres through a nozzle of 3 mm (Ma et
    /// al. 2026, figure 5 and table 1).
    pub const PP_GF28: Self = Self { k: 26.5, exponent: 1.58, density: 1.11 };

    /// From the flow at 1 MPa \[g/min\], the exponent and the melt's density
    /// \[g/cm³\]; fails on what is not finite and positive.
    pub fn new(g_per_min: f64, exponent: f64, g_per_cm3: f64) -> Result<Self, RheologyError> {
        positive("the flow at 1 MPa [g/min]", g_per_min)?;
        positive("the exponent of the power law", exponent)?;
        positive("the density [g/cm³]", g_per_cm3)?;
        Ok(Self { k: g_per_min, exponent, density: g_per_cm3 })
    }

    /// Mass that leaves the nozzle at a pressure \[g/min\].
    pub fn mass_g_per_min(&self, pressure: MPa) -> Result<f64, RheologyError> {
        not_negative("the pressure [MPa]", pressure.get())?;
        let mass = self.k * libm::pow(pressure.get(), self.exponent);
        let error = RheologyError::TooLarge("the mass flow [g/min]");
        if mass.is_finite() { Ok(mass) } else { Err(error) }
    }

    /// Volume that leaves the nozzle at a pressure.
    pub fn flow(&self, pressure: MPa) -> Result<Mm3PerS, RheologyError> {
        let cm3_per_min = self.mass_g_per_min(pressure)? / self.density;
        Mm3PerS::new(cm3_per_min * MM3_PER_S)
            .map_err(|_| RheologyError::TooLarge("the flow [mm³/s]"))
    }

    /// Pressure for a flow. Ma et al. 2026, eq. (5).
    pub fn pressure(&self, flow: Mm3PerS) -> Result<MPa, RheologyError> {
        not_negative("the flow [mm³/s]", flow.get())?;
        let mass = flow.get() / MM3_PER_S * self.density;
        MPa::new(libm::pow(mass / self.k, 1.0 / self.exponent))
            .map_err(|_| RheologyError::TooLarge("the pressure [MPa]"))
    }
}

/// mm³/s in a cm³/min. By definition 1000 mm³ over 60 s.
const MM3_PER_S: f64 = 1000.0 / 60.0;

/// A screw that carries the same volume with every turn. Ma et al. 2026, eq. (1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DragFlow {
    mm3_per_turn: f64,
}

impl DragFlow {
    /// From the volume of a turn \[mm³\], as found by weighing.
    pub fn new(mm3_per_turn: f64) -> Result<Self, RheologyError> {
        positive("the volume of a turn [mm³]", mm3_per_turn)?;
        Ok(Self { mm3_per_turn })
    }

    /// Speed of the screw that carries a flow.
    pub fn speed(&self, flow: Mm3PerS) -> Result<Rpm, RheologyError> {
        not_negative("the flow [mm³/s]", flow.get())?;
        Rpm::new(flow.get() * 60.0 / self.mm3_per_turn)
            .map_err(|_| RheologyError::TooLarge("the screw's speed [rpm]"))
    }

    /// Flow that a speed of the screw carries.
    pub fn flow(&self, speed: Rpm) -> Result<Mm3PerS, RheologyError> {
        not_negative("the screw's speed [rpm]", speed.get())?;
        Mm3PerS::new(speed.get() / 60.0 * self.mm3_per_turn)
            .map_err(|_| RheologyError::TooLarge("the flow [mm³/s]"))
    }
}

fn positive(what: &'static str, found: f64) -> Result<(), RheologyError> {
    let is_valid = found.is_finite() && found > 0.0;
    if is_valid { Ok(()) } else { Err(RheologyError::NotPositive { what, found }) }
}

fn not_negative(what: &'static str, found: f64) -> Result<(), RheologyError> {
    if found >= 0.0 { Ok(()) } else { Err(RheologyError::Negative { what, found }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::{Mm, MmPerS};
    use crate::extruder::demand;
    use proptest::prelude::*;

    const WIDTH: Mm = Mm::constant(3.0);
    const HEIGHT: Mm = Mm::constant(1.5);

    #[test]
    fn the_papers_speeds_need_pressures_within_its_experiments() {
        let section = demand::section(WIDTH, HEIGHT).unwrap();
        // By hand: 1.11·4.017·v·60/1000 g/min, divided by 26.5, to the power 1/1.58.
        for (speed, expected) in [(30.0, 0.469_557), (40.0, 0.563_330), (50.0, 0.648_782)] {
            let flow = MmPerS::constant(speed) * section;
            let pressure = PowerLaw::PP_GF28.pressure(flow).unwrap();
            assert!((pressure.get() - expected).abs() < 1e-6, "{speed}: {pressure}");
        }
        let mass = PowerLaw::PP_GF28.mass_g_per_min(MPa::constant(1.0)).unwrap();
        assert_eq!(mass, 26.5);
    }

    #[test]
    fn parameters_out_of_range_are_refused() {
        assert!(PowerLaw::new(26.5, 0.0, 1.11).is_err());
        assert!(PowerLaw::new(26.5, f64::NAN, 1.11).is_err());
        assert!(PowerLaw::PP_GF28.flow(MPa::constant(-0.1)).is_err());
        assert!(PowerLaw::PP_GF28.flow(MPa::constant(1e300)).is_err());
        assert!(DragFlow::new(-0.3).is_err());
    }

    proptest! {
        #[test]
        fn flow_and_pressure_are_inverse_functions(
            pressure in 1e-6..50.0_f64, k in 0.1..1e3_f64, exponent in 0.3..4.0_f64,
            turn in 1.0..1e5_f64,
        ) {
            let nozzle = PowerLaw::new(k, exponent, 1.11).unwrap();
            let flow = nozzle.flow(MPa::constant(pressure)).unwrap();
            prop_assert!((nozzle.pressure(flow).unwrap().get() / pressure - 1.0).abs() < 1e-9);
            let screw = DragFlow::new(turn).unwrap();
            let back = screw.flow(screw.speed(flow).unwrap()).unwrap();
            prop_assert!((back.get() - flow.get()).abs() <= 1e-12 * flow.get());
        }
    }
}
