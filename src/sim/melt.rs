//! The melt between screw and nozzle of an extruder that starts after pauses and stops again. It
//! has effects that the model of [`crate::extruder::start_stop`] does not know.
//!
//! ```text
//! command ─dead time─▶ screw ─▶ void (opens in two parts while it stands) ─▶ melt under
//!                                pressure ─power law─▶ flow, which drifts
//! ```

use std::collections::VecDeque;

use crate::sim::hash::{mix, normal_pair};

/// Step while pump or melt move \[s\]: a thirty-fifth of the shortest time constant.
const STEP_S: f64 = 0.002;
/// Step while the pump is at rest \[s\].
const IDLE_STEP_S: f64 = 0.02;
/// Time after a stop from which the long step is used \[s\]: two and a half time constants of the
/// leak.
const IDLE_AFTER_S: f64 = 5.0;
/// Random stream of the flow. Derived: the bytes of "flow".
const FLOW_STREAM: u64 = 0x666c_6f77;
/// Random stream of the void. Derived: the bytes of "void".
const VOID_STREAM: u64 = 0x766f_6964;

/// Parameters of the simulated extruder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeltParameters {
    /// Delay from a command until the drive acts \[s\].
    pub dead_time_s: f64,
    /// Time constant of the screw \[s\].
    pub screw_s: f64,
    /// Volume that is stored under pressure at the reference flow, over that flow \[s\].
    pub stored_s: f64,
    /// Reference flow \[mm³/s\].
    pub flow_mm3_per_s: f64,
    /// Exponent n of the power law: pressure is proportional to flowⁿ, so that a low pressure
    /// drools for a long time.
    pub shear_thinning: f64,
    /// Time constant of the pressure loss backwards through the screw \[s\].
    pub leak_s: f64,
    /// Volumes that recede from the nozzle while the screw stands \[mm³\], and the time constant
    /// of each \[s\].
    pub voids: [(f64, f64); 2],
    /// Fraction of the receding melt that drips from the nozzle; the rest flows back into the
    /// screw.
    pub drip_fraction: f64,
    /// Size of the void below which part of the melt passes it \[mm³\].
    pub bypass_mm3: f64,
    /// Standard deviation of the void from pause to pause, relative.
    pub void_sigma: f64,
    /// Standard deviation of the flow, relative, and its correlation time \[s\].
    pub flow_noise: (f64, f64),
}

impl MeltParameters {
    /// Typical values for a bead of 10 mm² at 40 mm/s.
    pub const TYPICAL: Self = Self {
        dead_time_s: 0.12,
        screw_s: 0.07,
        stored_s: 0.3,
        flow_mm3_per_s: 400.0,
        shear_thinning: 0.6,
        leak_s: 2.0,
        voids: [(520.0, 18.0), (130.0, 70.0)],
        drip_fraction: 0.04,
        bypass_mm3: 15.0,
        void_sigma: 0.03,
        flow_noise: (0.01, 0.15),
    };
}

/// The extruder in simulated time.
#[derive(Debug, Clone)]
pub struct Melt {
    parameters: MeltParameters,
    seed: u64,
    now_s: f64,
    /// Commands that do not act yet: time of action \[s\] and flow \[mm³/s\].
    pending_commands: VecDeque<(f64, f64)>,
    /// Flow that the drive demands, and flow that the screw conveys \[mm³/s\].
    commanded_mm3_per_s: f64,
    conveyed: f64,
    /// Time since the drive was stopped \[s\].
    stopped_s: f64,
    pauses: u64,
    steps: u64,
    voids: [f64; 2],
    stored_mm3: f64,
    flow_deviation: f64,
}

impl Melt {
    /// An extruder in the steady state at its reference flow.
    pub fn steady(parameters: MeltParameters, seed: u64) -> Self {
        let flow = parameters.flow_mm3_per_s;
        Self {
            parameters,
            seed,
            now_s: 0.0,
            pending_commands: VecDeque::new(),
            commanded_mm3_per_s: flow,
            conveyed: flow,
            stopped_s: 0.0,
            pauses: 0,
            steps: 0,
            voids: [0.0; 2],
            stored_mm3: flow * parameters.stored_s,
            flow_deviation: 0.0,
        }
    }

    /// An extruder after a pause so long that all melt that can recede has receded.
    pub fn fully_receded(parameters: MeltParameters, seed: u64) -> Self {
        let [first, second] = parameters.voids;
        Self {
            commanded_mm3_per_s: 0.0,
            conveyed: 0.0,
            stopped_s: f64::INFINITY,
            voids: [first.0, second.0],
            stored_mm3: 0.0,
            ..Self::steady(parameters, seed)
        }
    }

    /// Time since the start \[s\].
    pub const fn now_s(&self) -> f64 {
        self.now_s
    }

    /// Commands a flow \[mm³/s\] to the drive; zero stops it.
    pub fn command(&mut self, flow_mm3_per_s: f64) {
        self.pending_commands.push_back((self.now_s + self.parameters.dead_time_s, flow_mm3_per_s));
    }

    /// Volume of the void before the nozzle \[mm³\].
    pub fn void_mm3(&self) -> f64 {
        self.voids.iter().sum()
    }

    /// Advances by one step; returns its length \[s\] and the volume at the nozzle \[mm³\].
    pub fn advance(&mut self) -> (f64, f64) {
        let rests = self.stopped_s > IDLE_AFTER_S && self.pending_commands.is_empty();
        let dt_s = if rests { IDLE_STEP_S } else { STEP_S };
        self.now_s += dt_s;
        self.apply_commands(dt_s);
        let kept = libm::exp(-dt_s / self.parameters.screw_s);
        self.conveyed =
            self.commanded_mm3_per_s + (self.conveyed - self.commanded_mm3_per_s) * kept;
        let dripped_mm3 = self.recede(dt_s);
        let arriving_mm3 = self.fill(self.conveyed * dt_s);
        let flow = self.pressed_out(arriving_mm3, dt_s) * (1.0 + self.flow_noise(dt_s));
        (dt_s, flow.max(0.0) * dt_s + dripped_mm3)
    }

    fn apply_commands(&mut self, dt_s: f64) {
        while let Some(&(_, flow)) =
            self.pending_commands.front().filter(|(at_s, _)| *at_s <= self.now_s)
        {
            self.pending_commands.pop_front();
            if flow <= 0.0 && self.commanded_mm3_per_s > 0.0 {
                self.pauses += 1;
            }
            self.commanded_mm3_per_s = flow;
        }
        self.stopped_s = if self.commanded_mm3_per_s > 0.0 { 0.0 } else { self.stopped_s + dt_s };
    }

    /// Opens the void as the pressure falls; its final size is random for each pause. Returns the
    /// volume that drips \[mm³\].
    fn recede(&mut self, dt_s: f64) -> f64 {
        if self.commanded_mm3_per_s > 0.0 {
            return 0.0;
        }
        let [fresh, _] = normal_pair(mix(&[self.seed, VOID_STREAM, self.pauses]));
        let size = (1.0 + self.parameters.void_sigma * fresh).max(0.0);
        let pressure = self.pressure_fraction().min(1.0);
        let mut receded = 0.0;
        for (void, (max_void, slow_s)) in self.voids.iter_mut().zip(self.parameters.voids) {
            let opened = (max_void * size - *void).max(0.0) * (1.0 - pressure) * dt_s / slow_s;
            *void += opened;
            receded += opened;
        }
        receded * self.parameters.drip_fraction
    }

    /// Fills the void and returns the volume that passes it \[mm³\].
    fn fill(&mut self, conveyed_mm3: f64) -> f64 {
        let void = self.void_mm3();
        if void <= 0.0 {
            return conveyed_mm3;
        }
        let filled = (-conveyed_mm3 * libm::expm1(-void / self.parameters.bypass_mm3)).min(void);
        for part in &mut self.voids {
            *part *= 1.0 - filled / void;
        }
        conveyed_mm3 - filled
    }

    /// Stored volume over that at the reference flow.
    fn pressure_fraction(&self) -> f64 {
        self.stored_mm3 / (self.parameters.flow_mm3_per_s * self.parameters.stored_s)
    }

    /// Advances the stored volume; returns the flow through the nozzle \[mm³/s\].
    fn pressed_out(&mut self, arriving_mm3: f64, dt_s: f64) -> f64 {
        let machine = &self.parameters;
        let fraction = self.pressure_fraction().max(0.0);
        let flow = machine.flow_mm3_per_s * libm::pow(fraction, 1.0 / machine.shear_thinning);
        let leaks =
            if self.commanded_mm3_per_s > 0.0 { 0.0 } else { self.stored_mm3 / machine.leak_s };
        self.stored_mm3 = (self.stored_mm3 + arriving_mm3 - (flow + leaks) * dt_s).max(0.0);
        flow
    }

    fn flow_noise(&mut self, dt_s: f64) -> f64 {
        let (size, correlation_s) = self.parameters.flow_noise;
        let kept = libm::exp(-dt_s / correlation_s);
        let [fresh, _] = normal_pair(mix(&[self.seed, FLOW_STREAM, self.steps]));
        self.steps += 1;
        self.flow_deviation =
            kept * self.flow_deviation + size * (1.0 - kept * kept).sqrt() * fresh;
        self.flow_deviation
    }
}
