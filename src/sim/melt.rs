//! The melt between screw and nozzle of an extruder that is started after pauses and
//! stopped again: more than the model of [`crate::extruder::start_stop`] knows.
//!
//! ```text
//! command ─dead time─▶ screw ─▶ void (opens in two parts while it stands) ─▶ melt under
//!                                pressure ─power law─▶ flow, which drifts
//! ```

use std::collections::VecDeque;

use crate::sim::hash::{mix, normal_pair};

/// Step while anything moves \[s\].
const STEP_S: f64 = 0.002;
/// Step of a pump that has stood for a while \[s\].
const IDLE_STEP_S: f64 = 0.02;
/// What a pump stands until then moves slowly \[s\].
const RESTS_AFTER_S: f64 = 5.0;
/// Keeps random numbers of the flow and of the void apart.
const FLOW: u64 = 0x666c_6f77;
const VOID: u64 = 0x766f_6964;

/// What a simulated extruder is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Machine {
    /// From a command until the drive acts \[s\].
    pub dead_time_s: f64,
    /// Time constant of the screw \[s\].
    pub screw_s: f64,
    /// Melt that is stored under pressure at the reference flow, over that flow
    /// \[s\].
    pub stored_s: f64,
    /// Reference flow \[mm³/s\].
    pub flow_mm3_per_s: f64,
    /// n of the power law: pressure goes with flowⁿ, so that little pressure
    /// drools for long.
    pub shear_thinning: f64,
    /// Time constant with which pressure is lost up the screw \[s\].
    pub leak_s: f64,
    /// Volumes that recede from the nozzle while the screw stands \[mm³\], and
    /// how fast each \[s\].
    pub voids: [(f64, f64); 2],
    /// Share of the receding melt that drips from the nozzle; the rest goes back
    /// up the screw.
    pub drips: f64,
    /// A void that is closed but for this lets part of the melt pass \[mm³\].
    pub passes_mm3: f64,
    /// Standard deviation of the void from pause to pause, as a share.
    pub void_scatter: f64,
    /// Standard deviation of the flow, as a share, and how long that hangs
    /// together \[s\].
    pub wander: (f64, f64),
}

impl Machine {
    /// Of a bead of 10 mm² at 40 mm/s.
    pub const USUAL: Self = Self {
        dead_time_s: 0.12,
        screw_s: 0.07,
        stored_s: 0.3,
        flow_mm3_per_s: 400.0,
        shear_thinning: 0.6,
        leak_s: 2.0,
        voids: [(520.0, 18.0), (130.0, 70.0)],
        drips: 0.04,
        passes_mm3: 15.0,
        void_scatter: 0.03,
        wander: (0.01, 0.15),
    };
}

/// The extruder in simulated time.
#[derive(Debug, Clone)]
pub struct Melt {
    machine: Machine,
    seed: u64,
    now_s: f64,
    /// Commands on their way: when they act \[s\], and what flow they give.
    orders: VecDeque<(f64, f64)>,
    /// What the drive is told \[mm³/s\], and what the screw conveys.
    told: f64,
    conveyed: f64,
    /// Since the drive was told to stand \[s\].
    stands_s: f64,
    pauses: u64,
    steps: u64,
    voids: [f64; 2],
    stored_mm3: f64,
    wanders: f64,
}

impl Melt {
    /// Flowing evenly at its reference flow.
    pub fn flowing(machine: Machine, seed: u64) -> Self {
        let flow = machine.flow_mm3_per_s;
        Self {
            machine,
            seed,
            now_s: 0.0,
            orders: VecDeque::new(),
            told: flow,
            conveyed: flow,
            stands_s: 0.0,
            pauses: 0,
            steps: 0,
            voids: [0.0; 2],
            stored_mm3: flow * machine.stored_s,
            wanders: 0.0,
        }
    }

    /// Having stood for so long that all has receded that can.
    pub fn stood(machine: Machine, seed: u64) -> Self {
        let [first, second] = machine.voids;
        Self {
            told: 0.0,
            conveyed: 0.0,
            stands_s: f64::INFINITY,
            voids: [first.0, second.0],
            stored_mm3: 0.0,
            ..Self::flowing(machine, seed)
        }
    }

    /// Time since it began \[s\].
    pub const fn now_s(&self) -> f64 {
        self.now_s
    }

    /// Tells the drive what flow to give \[mm³/s\]; zero stops it.
    pub fn command(&mut self, flow_mm3_per_s: f64) {
        self.orders.push_back((self.now_s + self.machine.dead_time_s, flow_mm3_per_s));
    }

    /// What is empty before the nozzle \[mm³\].
    pub fn void_mm3(&self) -> f64 {
        self.voids.iter().sum()
    }

    /// Goes on by one step and returns how long it was \[s\] and what came out of
    /// the nozzle in it \[mm³\].
    pub fn advance(&mut self) -> (f64, f64) {
        let rests = self.stands_s > RESTS_AFTER_S && self.orders.is_empty();
        let dt_s = if rests { IDLE_STEP_S } else { STEP_S };
        self.now_s += dt_s;
        self.obey(dt_s);
        let kept = libm::exp(-dt_s / self.machine.screw_s);
        self.conveyed = self.told + (self.conveyed - self.told) * kept;
        let dripped_mm3 = self.recede(dt_s);
        let arriving_mm3 = self.fill(self.conveyed * dt_s);
        let flow = self.pressed_out(arriving_mm3, dt_s) * (1.0 + self.wander(dt_s));
        (dt_s, flow.max(0.0) * dt_s + dripped_mm3)
    }

    fn obey(&mut self, dt_s: f64) {
        while let Some(&(_, flow)) = self.orders.front().filter(|(at_s, _)| *at_s <= self.now_s) {
            self.orders.pop_front();
            if flow <= 0.0 && self.told > 0.0 {
                self.pauses += 1;
            }
            self.told = flow;
        }
        self.stands_s = if self.told > 0.0 { 0.0 } else { self.stands_s + dt_s };
    }

    /// The void opens as far as pressure has gone, to another size each time.
    fn recede(&mut self, dt_s: f64) -> f64 {
        if self.told > 0.0 {
            return 0.0;
        }
        let [fresh, _] = normal_pair(mix(&[self.seed, VOID, self.pauses]));
        let size = (1.0 + self.machine.void_scatter * fresh).max(0.0);
        let pressure = self.pressure_share().min(1.0);
        let mut receded = 0.0;
        for (void, (most, slow_s)) in self.voids.iter_mut().zip(self.machine.voids) {
            let opened = (most * size - *void).max(0.0) * (1.0 - pressure) * dt_s / slow_s;
            *void += opened;
            receded += opened;
        }
        receded * self.machine.drips
    }

    /// Fills the void and returns what passes it \[mm³\].
    fn fill(&mut self, conveyed_mm3: f64) -> f64 {
        let void = self.void_mm3();
        if void <= 0.0 {
            return conveyed_mm3;
        }
        let filled = (-conveyed_mm3 * libm::expm1(-void / self.machine.passes_mm3)).min(void);
        for part in &mut self.voids {
            *part *= 1.0 - filled / void;
        }
        conveyed_mm3 - filled
    }

    /// Stored melt over that at the reference flow.
    fn pressure_share(&self) -> f64 {
        self.stored_mm3 / (self.machine.flow_mm3_per_s * self.machine.stored_s)
    }

    /// Flow through the nozzle \[mm³/s\].
    fn pressed_out(&mut self, arriving_mm3: f64, dt_s: f64) -> f64 {
        let machine = &self.machine;
        let share = self.pressure_share().max(0.0);
        let flow = machine.flow_mm3_per_s * libm::pow(share, 1.0 / machine.shear_thinning);
        let leaks = if self.told > 0.0 { 0.0 } else { self.stored_mm3 / machine.leak_s };
        self.stored_mm3 = (self.stored_mm3 + arriving_mm3 - (flow + leaks) * dt_s).max(0.0);
        flow
    }

    fn wander(&mut self, dt_s: f64) -> f64 {
        let (size, memory_s) = self.machine.wander;
        let kept = libm::exp(-dt_s / memory_s);
        let [fresh, _] = normal_pair(mix(&[self.seed, FLOW, self.steps]));
        self.steps += 1;
        self.wanders = kept * self.wanders + size * (1.0 - kept * kept).sqrt() * fresh;
        self.wanders
    }
}
