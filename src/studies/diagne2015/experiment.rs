//! All runs at one conveying speed.

use super::response::{Cycle, PlugResponse};
use super::run::{FeedMethod, RunError, RunPlan, follow};
use super::{
    CYCLE_S, PulsationCase, SETPOINT, SETTLING_BAND_MM, START, paper_controller, saturated,
};
use crate::extruder::screw::control::Scheme;
use crate::extruder::screw::{FillFeedback, Screw, TurnUnit};
use crate::numeric::number::to_count;
use crate::sim::screw::delay_free;

/// Millimetres in a metre. By definition.
const MM_PER_M: f64 = 1000.0;
/// Length of the runs that settle late or never \[s\]: papers.md, "over the last part of 60 s".
const LONG_S: f64 = 60.0;
/// Length of the other runs \[s\]: twice the time in which they settle.
const SHORT_S: f64 = 4.0;
/// Step of the paper's runs \[s\]: papers.md, "state and control at 1 ms".
const STEP_S: f64 = 0.001;
/// Slopes at the setpoint of the saturated controller \[1/m\]; other tables use the first one.
/// Steeper ones settle sooner but amplify noise.
pub const SLOPES_PER_M: [f64; 3] = [60.0, 100.0, 200.0];

/// Responses with a predictor: the paper's scheme on the paper's plant, and our scheme on a plant
/// that is integrated to high order.
#[derive(Debug, Clone, PartialEq)]
pub struct PredictorPair {
    /// Integrated by Euler steps.
    pub paper: PlugResponse,
    /// Integrated to high order.
    pub exact: PlugResponse,
}

/// Responses at one conveying speed.
#[derive(Debug, Clone, PartialEq)]
pub struct Examined {
    /// The conveying speed.
    pub case: PulsationCase,
    /// Time of the control's first effect on the plug, σ0 \[s\].
    pub first_effect_s: f64,
    /// Open loop: constantly the fill that holds the setpoint.
    pub open: PlugResponse,
    /// Feedback without a predictor.
    pub uncompensated: PlugResponse,
    /// A predictor that knows how the speed pulsates.
    pub informed: PredictorPair,
    /// A predictor that assumes a steady speed.
    pub uninformed: PredictorPair,
    /// The saturated controller with the predictor that knows the pulsation, for each of
    /// [`SLOPES_PER_M`].
    pub straight: Vec<PlugResponse>,
    /// The delay-free loop, from the first effect on: time \[s\] and plug \[mm\].
    pub oracle: Vec<(f64, f64)>,
    /// Largest deviation of the two informed loops from the delay-free one \[mm\].
    pub max_deviation_mm: [f64; 2],
    /// Time at which the largest feed, given from the start, brings the plug into the settling
    /// band \[s\]: no controller settles sooner.
    pub soonest_s: f64,
}

impl Examined {
    /// Runs all experiments at one conveying speed.
    pub fn run(case: PulsationCase) -> Result<Self, RunError> {
        let screw = case.screw(TurnUnit::RadPerS)?;
        let controller = FillFeedback::Exponential(paper_controller(&screw)?);
        let paper = |until_s: f64, method| follow(&RunPlan::paper(screw, until_s), &method);
        let exact = |method| follow(&RunPlan::exact(screw, SHORT_S), &method);
        let with = |controller, scheme, known| FeedMethod::Predictor { controller, scheme, known };
        let pair = |known: Screw| -> Result<PredictorPair, RunError> {
            Ok(PredictorPair {
                paper: paper(SHORT_S, with(controller, Scheme::Paper, known))?,
                exact: exact(with(controller, Scheme::Exact, known))?,
            })
        };
        let informed = pair(screw)?;
        let mut straight = Vec::new();
        for slope in SLOPES_PER_M {
            straight.push(exact(with(saturated(&screw, slope)?, Scheme::Exact, screw))?);
        }
        let first_effect_s = screw.arrival(0.0, START.get() / MM_PER_M);
        let (first, oracle) = oracle(&screw, first_effect_s, &controller);
        let max_deviation_mm = [&informed.paper, &informed.exact]
            .map(|response| response.max_deviation(first, oracle.iter().map(|(_, plug)| *plug)));
        Ok(Self {
            case,
            first_effect_s,
            open: paper(LONG_S, FeedMethod::OpenLoop)?,
            uncompensated: paper(LONG_S, FeedMethod::Uncompensated(controller))?,
            uninformed: pair(screw.steady())?,
            informed,
            straight,
            oracle,
            max_deviation_mm,
            soonest_s: soonest(&screw, first_effect_s),
        })
    }

    /// The limit cycle of feedback without a predictor.
    pub fn cycle(&self) -> Option<Cycle> {
        self.uncompensated.cycle(SETPOINT.plug.get(), LONG_S - CYCLE_S)
    }
}

/// Settling time of a response \[s\]; `None` if it does not settle.
pub fn settles(response: &PlugResponse) -> Option<f64> {
    response.settles(SETPOINT.plug.get(), SETTLING_BAND_MM)
}

/// Index of the first sample after the first effect, and the delay-free loop from that sample on.
fn oracle(
    screw: &Screw,
    first_effect_s: f64,
    controller: &FillFeedback,
) -> (usize, Vec<(f64, f64)>) {
    let first = (first_effect_s / STEP_S).ceil();
    let fill = |plug: f64| controller.fill(plug);
    let start_m = START.get() / MM_PER_M;
    let lead = first * STEP_S - first_effect_s;
    let plug = delay_free(screw, start_m, first_effect_s, lead, fill).nth(1).unwrap_or(start_m);
    let lengths = delay_free(screw, plug, first * STEP_S, STEP_S, fill);
    let times = (0_u32..).map(|tick| (first + f64::from(tick)) * STEP_S);
    let points = times.zip(lengths.map(|length| length * MM_PER_M));
    let points = points.take_while(|(at_s, _)| *at_s <= SHORT_S).collect();
    (to_count(first), points)
}

fn soonest(screw: &Screw, first_effect_s: f64) -> f64 {
    let band = (SETPOINT.plug.get() - SETTLING_BAND_MM) / MM_PER_M;
    let start_m = START.get() / MM_PER_M;
    let plugs = delay_free(screw, start_m, first_effect_s, 1e-4, |_| SETPOINT.max_fill);
    let times = (0_u32..).map(|tick| first_effect_s + 1e-4 * f64::from(tick));
    times.zip(plugs).find(|(_, plug)| *plug >= band).map_or(f64::INFINITY, |(at_s, _)| at_s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::studies::diagne2015::CASES;

    /// σ0, open loop, limit cycle and its period, informed and uninformed predictor (papers.md).
    const KNOWN: [[f64; 6]; 3] = [
        [1.061, 26.71, 8.8, 1.66, 1.706, 1.706],
        [1.137, 26.78, 9.8, 1.67, 1.763, 1.968],
        [0.768, 27.72, 10.3, 1.46, 1.237, 1.839],
    ];

    fn near(found: f64, known: f64, tolerance: f64) {
        assert!((found / known - 1.0).abs() < tolerance, "{found} is not {known}");
    }

    #[test]
    fn the_runs_give_the_figures_of_an_independent_simulation() {
        for (case, known) in CASES.into_iter().zip(KNOWN) {
            let found = Examined::run(case).unwrap();
            let [first, open, peak_to_peak, period, informed, uninformed] = known;
            near(found.first_effect_s, first, 0.001);
            near(settles(&found.open).unwrap(), open, 0.001);
            let cycle = found.cycle().unwrap();
            near(cycle.peak_to_peak_mm, peak_to_peak, 0.02);
            near(cycle.period_s, period, 0.02);
            near(settles(&found.informed.paper).unwrap(), informed, 0.001);
            near(settles(&found.uninformed.paper).unwrap(), uninformed, 0.001);
            // With samples every 1 ms the exact loop is that of a perfect predictor.
            assert!(found.max_deviation_mm[1] < 0.05, "{:?}", found.max_deviation_mm);
            assert!(
                (0.4..0.7).contains(&found.max_deviation_mm[0]),
                "{:?}",
                found.max_deviation_mm
            );
            near(settles(&found.informed.exact).unwrap(), informed, 0.01);
            // Steeper slopes settle sooner, down to what the largest feed allows.
            let mut before = settles(&found.informed.exact).unwrap();
            for response in &found.straight {
                let settled = settles(response).unwrap();
                assert!(settled < before && settled > found.soonest_s);
                before = settled;
            }
            near(before, found.soonest_s, 0.02);
            assert!(found.informed.paper.overshoot_mm(160.0) < 1e-3);
            if case.pulsation.relative_amplitude > 0.3 {
                near(found.uninformed.paper.overshoot_mm(160.0), 8.8, 0.02);
            }
        }
    }
}
