//! Step response and frequency response of a fitted model with their standard deviations,
//! propagated to first order from the covariance of the parameters.

use crate::numeric::lti::{FirstOrder, ModelError, SecondOrder, TransferFunction, simulate};

use super::fit::{DeadTime, Fit, Structure};

/// Step of the difference quotients in standard errors of a parameter. A choice: small against
/// the curvature, large against rounding.
const RELATIVE_STEP: f64 = 1e-3;

/// A curve with its standard deviation.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Band {
    /// Time \[s\] or frequency \[Hz\].
    pub at: Vec<f64>,
    /// The curve.
    pub value: Vec<f64>,
    /// Its standard deviation.
    pub sigma: Vec<f64>,
}

/// Response to a unit step of the input at 0 s, every `step_s` for `count` samples, in units of
/// the output.
pub fn step_response(fit: &Fit, step_s: f64, count: u32) -> Result<Band, ModelError> {
    let ones = vec![1.0; count as usize];
    let at = (0..count).map(|k| f64::from(k) * step_s).collect();
    with_sigma(fit, at, |model| simulate(model, &ones, step_s))
}

/// Gain \[dB\] and phase \[°\] at frequencies \[Hz\]; the phase is continuous for growing
/// frequencies.
pub fn frequency_response(fit: &Fit, hz: &[f64]) -> Result<[Band; 2], ModelError> {
    let gain = with_sigma(fit, hz.to_vec(), |model| {
        Ok(hz.iter().map(|f| 20.0 * libm::log10(model.at_frequency(radians(*f)).norm())).collect())
    })?;
    let phase = with_sigma(fit, hz.to_vec(), |model| phase(model, hz))?;
    Ok([gain, phase])
}

fn radians(hz: f64) -> f64 {
    hz * std::f64::consts::TAU
}

fn phase(model: &TransferFunction, hz: &[f64]) -> Result<Vec<f64>, ModelError> {
    let rational = model.with_dead_time(0.0)?;
    let mut before = 0.0;
    let mut next = |f: &f64| {
        let now = rational.at_frequency(radians(*f)).arg();
        let turns = ((before - now) / std::f64::consts::TAU).round();
        before = now + turns * std::f64::consts::TAU;
        (before - radians(*f) * model.dead_time_s()).to_degrees()
    };
    Ok(hz.iter().map(&mut next).collect())
}

fn with_sigma(
    fit: &Fit,
    at: Vec<f64>,
    answer: impl Fn(&TransferFunction) -> Result<Vec<f64>, ModelError>,
) -> Result<Band, ModelError> {
    let value = answer(&fit.model)?;
    let slopes = (0..fit.parameters.len()).map(|number| {
        let nudge = RELATIVE_STEP * fit.parameters.get(number).map_or(0.0, |one| one.sigma);
        if !(nudge > 0.0 && nudge.is_finite()) {
            return Ok(vec![0.0; value.len()]);
        }
        let up = answer(&moved(fit, number, nudge)?)?;
        let down = answer(&moved(fit, number, -nudge)?)?;
        Ok(up.iter().zip(down).map(|(up, down)| (up - down) / (2.0 * nudge)).collect())
    });
    let slopes: Vec<Vec<f64>> = slopes.collect::<Result<_, ModelError>>()?;
    let sigma = (0..value.len()).map(|k| {
        let slope: Vec<f64> = slopes.iter().map(|row| row.get(k).copied().unwrap_or(0.0)).collect();
        let slope = nalgebra::DVector::from_vec(slope);
        (slope.transpose() * &fit.covariance * &slope).sum().max(0.0).sqrt()
    });
    Ok(Band { at, sigma: sigma.collect(), value })
}

/// The model with one parameter changed; a dead time does not become negative.
fn moved(fit: &Fit, number: usize, by: f64) -> Result<TransferFunction, ModelError> {
    let value = |name: &str| {
        let found = fit.parameters.iter().enumerate().find(|(_, one)| one.name == name);
        found.map(|(at, one)| if at == number { one.value + by } else { one.value })
    };
    let of = |name: &str| value(name).unwrap_or(0.0);
    let (gain, zero_s) = (of("gain"), of("zero_s"));
    let given = match fit.settings.dead_time {
        DeadTime::Known(given) => given,
        DeadTime::Estimated { .. } => 0.0,
    };
    let dead_time_s = value("dead_time_s").unwrap_or(given).max(0.0);
    match fit.settings.structure {
        Structure::FirstOrder { .. } => {
            let time_constant_s = of("time_constant_s");
            FirstOrder { gain, time_constant_s, zero_s, dead_time_s }.transfer()
        }
        Structure::SecondOrderReal { .. } => {
            let time_constants_s = [of("time_constant_1_s"), of("time_constant_2_s")];
            SecondOrder::Real { gain, time_constants_s, zero_s, dead_time_s }.transfer()
        }
        Structure::SecondOrderOscillating { .. } => {
            let (period_s, damping) = (of("period_s"), of("damping"));
            SecondOrder::Oscillating { gain, period_s, damping, zero_s, dead_time_s }.transfer()
        }
        Structure::Transfer { poles, zeros } => {
            let row = |letter: &str, highest: usize| -> Vec<f64> {
                (0..=highest).rev().map(|power| of(&format!("{letter}{power}"))).collect()
            };
            let mut den = row("a", poles);
            if let Some(leading) = den.first_mut() {
                *leading = 1.0;
            }
            TransferFunction::new(&row("b", zeros), &den, dead_time_s)
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;
    use crate::identify::fit::{FitSettings, Samples, fit};
    use crate::identify::prbs::Prbs;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    const DT_S: f64 = 0.05;

    fn truth() -> TransferFunction {
        let model = FirstOrder { gain: 2.0, time_constant_s: 0.8, zero_s: 0.0, dead_time_s: 0.4 };
        model.transfer().unwrap()
    }

    fn fitted(structure: Structure, seed: u64) -> Fit {
        let bits = Prbs::new(7).unwrap().flat_map(|one| [if one { 1.0 } else { 0.0 }; 12]);
        // At rest first, as the fit takes it.
        let input: Vec<f64> = [0.0; 20].into_iter().chain(bits).take(1000).collect();
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut noise = || -> f64 { StandardNormal.sample(&mut random) };
        let answer = simulate(&truth(), &input, DT_S).unwrap();
        let output = answer.iter().map(|y| y + 0.1 * noise()).collect();
        let samples = Samples::new(input, output, DT_S).unwrap();
        let dead_time = DeadTime::Estimated { min_s: 0.0, max_s: 2.0 };
        let settings = FitSettings::new(structure, dead_time);
        fit(&samples, &FitSettings { accept_undetermined: true, ..settings }).unwrap()
    }

    #[test]
    fn the_band_of_a_step_response_holds_the_truth() {
        let wanted = simulate(&truth(), &[1.0; 100], DT_S).unwrap();
        let (mut squares, mut count) = (0.0, 0.0);
        for seed in 0..6 {
            let band =
                step_response(&fitted(Structure::FirstOrder { zero: false }, seed), DT_S, 100);
            let band = band.unwrap();
            for k in [14, 20, 30, 60, 99] {
                let off = (band.value[k] - wanted[k]) / band.sigma[k];
                assert!(off.abs() < 4.5, "seed {seed}, sample {k}: {off}");
                squares += off * off;
                count += 1.0;
            }
        }
        let size: f64 = (squares / count).sqrt();
        assert!((0.5..1.6).contains(&size), "{size}");
    }

    #[test]
    fn every_form_is_built_again_from_its_parameters() {
        for structure in [
            Structure::FirstOrder { zero: true },
            Structure::SecondOrderOscillating { zero: false },
            Structure::Transfer { poles: 2, zeros: 1 },
        ] {
            let fit = fitted(structure, 1);
            let again = moved(&fit, usize::MAX, 0.0).unwrap();
            for w in [0.1, 1.0, 5.0] {
                let off = (again.at_frequency(w) - fit.model.at_frequency(w)).norm();
                assert!(off < 1e-9 * fit.model.dc_gain(), "{structure:?}: {off}");
            }
        }
    }

    #[test]
    fn the_phase_runs_without_jumps() {
        let fit = fitted(Structure::FirstOrder { zero: false }, 1);
        let hz: Vec<f64> = (1..200).map(|k| 0.01 * f64::from(k)).collect();
        let [gain, phase] = frequency_response(&fit, &hz).unwrap();
        assert!(phase.value.windows(2).all(|pair| pair[1] < pair[0] && pair[1] > pair[0] - 20.0));
        let (at, expected) = (99, -(0.8 * radians(1.0)).atan() - 0.4 * radians(1.0));
        assert!((phase.value[at] - expected.to_degrees()).abs() < 3.0, "{}", phase.value[at]);
        assert!((gain.value[0] - 20.0 * 2.0_f64.log10()).abs() < 0.2);
        assert!(gain.sigma.iter().all(|sigma| *sigma > 0.0 && *sigma < 1.0));
    }
}
