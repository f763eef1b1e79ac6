//! A simulated extruder from the speed of the screw to the pressure at the nozzle: lag and dead
//! time, a drifting gain, a load at the input, a screw with a limited speed and stiction, and a
//! sensor with noise, resolution, outliers and lost readings. Either of them may stop to follow.

use std::collections::VecDeque;
use std::f64::consts::TAU;

use super::hash::{mix, normal_pair, unit};
use crate::core::{MPa, Rpm};
use crate::extruder::pressure::{Fopdt, InitialState};
use crate::numeric::number::to_count;

/// Step of the plant \[s\]: papers.md, "002", 5 ms.
pub const TICK_S: f64 = 0.005;

/// Random stream of the sensor's faults. Derived: the bytes of "flts".
const FAULT_STREAM: u64 = 0x666c_7473;

/// A sinusoidal variation of the gain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GainWave {
    /// Amplitude, relative to the gain.
    pub amplitude: f64,
    /// Period \[s\].
    pub period_s: f64,
}

/// A step of the load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadChange {
    /// Time of the step \[s\].
    pub at_s: f64,
    /// Size of the step, at the input of the lag \[rpm\].
    pub rpm: f64,
}

/// What a sensor does to the pressure, besides its noise. All zero: nothing.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SensorFaults {
    /// Distance of two neighbouring readings \[MPa\]; 0 for a continuous sensor.
    pub resolution_mpa: f64,
    /// Fraction of readings that are an outlier, anywhere between 0 and `outlier_up_to_mpa`.
    pub outlier_fraction: f64,
    /// Largest outlier \[MPa\].
    pub outlier_up_to_mpa: f64,
    /// Fraction of readings that are lost.
    pub lost_fraction: f64,
}

/// What does not follow any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stuck {
    /// The sensor: it gives the same reading again and again.
    Sensor,
    /// The material: whatever the screw turns at, it conveys what it did before.
    Material,
}

/// Disturbances of the process.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Disturbances {
    /// Variations of the gain.
    pub gain_waves: Vec<GainWave>,
    /// A step of the load.
    pub load: Option<LoadChange>,
    /// The screw keeps its speed until the command is farther from it than this \[rpm\].
    pub stiction_rpm: f64,
    /// Variance of the sensor's noise \[MPa²\].
    pub noise_mpa2: f64,
    /// Other faults of the sensor.
    pub sensor: SensorFaults,
    /// Seed of the noise.
    pub seed: u64,
}

/// The plant with its state.
#[derive(Debug, Clone)]
pub struct SimPressure {
    process: Fopdt,
    disturbances: Disturbances,
    fastest_rpm: f64,
    /// Speeds within the dead time, newest first.
    delayed_speeds: VecDeque<f64>,
    /// Dead time in whole ticks, and its remaining fraction of a tick.
    ticks: usize,
    fractional_tick: f64,
    speed_rpm: f64,
    pressure: f64,
    tick: u64,
    /// The reading of a sensor that is stuck.
    held_reading: Option<MPa>,
    /// The speed \[rpm\] at which the screw has conveyed what it conveys, where the material is stuck.
    held_rpm: Option<f64>,
}

impl SimPressure {
    /// A plant in its steady state.
    pub fn new(
        process: Fopdt,
        disturbed: Disturbances,
        fastest: Rpm,
        running: InitialState,
    ) -> Self {
        let ticks = process.dead_time_s() / TICK_S;
        // Rounding must not shorten a dead time of whole ticks by one.
        let whole = (ticks + 1e-9).floor();
        let speed_rpm = running.speed.get();
        let count = to_count(whole);
        Self {
            process,
            disturbances: disturbed,
            fastest_rpm: fastest.get(),
            delayed_speeds: VecDeque::from(vec![speed_rpm; count + 2]),
            ticks: count,
            fractional_tick: (ticks - whole).max(0.0),
            speed_rpm,
            pressure: running.pressure.get(),
            tick: 0,
            held_reading: None,
            held_rpm: None,
        }
    }

    /// From now on something does not follow any more.
    pub fn stick(&mut self, what: Stuck) {
        match what {
            Stuck::Sensor => self.held_reading = self.read(),
            Stuck::Material => self.held_rpm = Some(self.speed_rpm),
        }
    }

    /// Simulated time \[s\].
    #[expect(clippy::cast_precision_loss, reason = "ticks of some minutes")]
    pub fn now_s(&self) -> f64 {
        self.tick as f64 * TICK_S
    }

    /// The true pressure \[MPa\].
    pub const fn pressure(&self) -> f64 {
        self.pressure
    }

    /// Speed of the screw \[rpm\].
    pub const fn speed_rpm(&self) -> f64 {
        self.speed_rpm
    }

    /// Reading of the sensor; none where it is lost.
    pub fn read(&self) -> Option<MPa> {
        if self.held_reading.is_some() {
            return self.held_reading;
        }
        let Disturbances { noise_mpa2, seed, sensor, .. } = &self.disturbances;
        let [chance, place, lost] =
            [1, 2, 3].map(|draw| unit(mix(&[FAULT_STREAM, *seed, self.tick, draw])));
        if lost < sensor.lost_fraction {
            return None;
        }
        let [normal, _] = normal_pair(mix(&[0x7072_6573, *seed, self.tick]));
        let mut reading = self.pressure + noise_mpa2.sqrt() * normal;
        if chance < sensor.outlier_fraction {
            reading = place * sensor.outlier_up_to_mpa;
        }
        if sensor.resolution_mpa > 0.0 {
            reading = (reading / sensor.resolution_mpa).round() * sensor.resolution_mpa;
        }
        MPa::new(reading).ok()
    }

    /// Commands a speed; the screw has it from the next tick on.
    pub fn command(&mut self, speed: Rpm) {
        let speed = speed.get().clamp(0.0, self.fastest_rpm);
        if (speed - self.speed_rpm).abs() >= self.disturbances.stiction_rpm {
            self.speed_rpm = speed;
        }
    }

    /// Sets the largest speed of the screw; it slows down to it at once.
    pub fn limit(&mut self, fastest: Rpm) {
        self.fastest_rpm = fastest.get();
        self.speed_rpm = self.speed_rpm.min(self.fastest_rpm);
    }

    /// Advances by one tick. The speed that is commanded now acts on the pressure one dead time
    /// after the end of this tick.
    pub fn advance(&mut self) {
        let at_s = self.now_s();
        let drift: f64 = self.disturbances.gain_waves.iter().map(|wave| wave.at(at_s)).sum();
        let load = self.disturbances.load.filter(|load| at_s >= load.at_s - 1e-9);
        let load = load.map_or(0.0, |load| load.rpm);
        let old = |back: usize| self.delayed_speeds.get(back).copied().unwrap_or(self.speed_rpm);
        // The remaining fraction belongs to the speed of one tick earlier.
        for (speed, fraction) in [
            (old(self.ticks + 1), self.fractional_tick),
            (old(self.ticks), 1.0 - self.fractional_tick),
        ] {
            let settled = self.process.gain() * (1.0 + drift) * (speed + load);
            let kept = libm::exp(-fraction * TICK_S / self.process.lag_s());
            self.pressure = settled + (self.pressure - settled) * kept;
        }
        self.delayed_speeds.pop_back();
        self.delayed_speeds.push_front(self.held_rpm.unwrap_or(self.speed_rpm));
        self.tick += 1;
    }
}

impl GainWave {
    fn at(&self, at_s: f64) -> f64 {
        self.amplitude * libm::sin(TAU * at_s / self.period_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn still() -> InitialState {
        InitialState { pressure: MPa::ZERO, target: MPa::ZERO, speed: Rpm::ZERO }
    }

    #[test]
    fn a_step_arrives_after_a_dead_time_that_is_no_multiple_of_a_tick() {
        for dead in [0.41, 0.4137, 0.0, 0.492] {
            let process = Fopdt::new(2.0, 0.84, dead).unwrap();
            let fastest = Rpm::constant(3.0);
            let mut plant = SimPressure::new(process, Disturbances::default(), fastest, still());
            plant.command(Rpm::constant(0.3));
            for _ in 0..400 {
                plant.advance();
                let since = (plant.now_s() - TICK_S - dead).max(0.0);
                let expected = 0.6 * (1.0 - f64::exp(-since / 0.84));
                assert!((plant.pressure() - expected).abs() < 1e-12, "{dead} {since}");
            }
        }
    }

    #[test]
    fn the_screw_keeps_what_it_can_turn() {
        let process = Fopdt::new(1.0, 0.1, 0.0).unwrap();
        let fastest = Rpm::constant(3.0);
        let mut plant = SimPressure::new(process, Disturbances::default(), fastest, still());
        plant.command(Rpm::constant(50.0));
        for _ in 0..2000 {
            plant.advance();
        }
        assert!((plant.pressure() - 3.0).abs() < 1e-9);
    }

    #[test]
    fn what_is_stuck_stays_as_it_was() {
        let process = Fopdt::new(1.0, 0.1, 0.2).unwrap();
        let disturbed = Disturbances { noise_mpa2: 5e-5, ..Disturbances::default() };
        let speed = Rpm::constant(0.5);
        let pressure = MPa::constant(0.5);
        let running = InitialState { pressure, target: pressure, speed };
        let plant = SimPressure::new(process, disturbed, Rpm::constant(3.0), running);
        for stuck in [Stuck::Sensor, Stuck::Material] {
            let mut plant = plant.clone();
            let before = plant.read();
            plant.stick(stuck);
            plant.command(Rpm::constant(1.0));
            for _ in 0..400 {
                plant.advance();
            }
            let follows = stuck == Stuck::Sensor;
            assert_eq!(plant.read() == before, follows, "{stuck:?}");
            let expected = if follows { 1.0 } else { 0.5 };
            assert!((plant.pressure() - expected).abs() < 1e-6, "{stuck:?}: {plant:?}");
            assert!((plant.speed_rpm() - 1.0).abs() < 1e-12, "{stuck:?}");
        }
    }

    #[test]
    fn a_load_and_a_drift_do_what_they_say() {
        let process = Fopdt::new(1.0, 0.05, 0.41).unwrap();
        let disturbed = Disturbances {
            gain_waves: vec![GainWave { amplitude: 0.1, period_s: 1e4 }],
            load: Some(LoadChange { at_s: 1.0, rpm: 0.1 }),
            ..Disturbances::default()
        };
        let running = InitialState {
            pressure: MPa::constant(0.6),
            target: MPa::ZERO,
            speed: Rpm::constant(0.6),
        };
        let mut plant = SimPressure::new(process, disturbed, Rpm::constant(3.0), running);
        for _ in 0..200 {
            plant.advance();
        }
        assert!((plant.pressure() - 0.6).abs() < 1e-3);
        for _ in 0..200 {
            plant.advance();
        }
        assert!((plant.pressure() - 0.7).abs() < 1e-3);
        for _ in 0..499_600 {
            plant.advance();
        }
        // After a quarter of the drift's period.
        assert!((plant.pressure() - 0.77).abs() < 1e-3, "{}", plant.pressure());
    }
}
