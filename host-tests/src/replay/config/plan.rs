//! The complete tracker: what the file says, what follows from the recording where it says nothing, all checked.
//!
//! Boats in a harbour and aircraft over a country want other numbers, and a recording tells which it is:
//!
//! ```text
//! reach L          the farthest detection (or `max_range`) of the sensors in use            500 m where none tells
//! max_speed v      L / 50 s, at most 300 m/s: a target stays in sight for long
//! max_gap          5/2 of the longest median time between two scans of one sensor             4 s where none tells
//! modes            constant velocity with densities v² 1e-4/s (steady) and v² 5e-3/s (manoeuvring)
//! acceleration_std v / 10 s
//! position_limit   6 % of L,   min_travel  2 % of L
//! misses           scans of all these sensors within 8 s, but 5 to 32: one target may hide another for so long
//! ```
//!
//! At a reach of 500 m: 10 m/s, densities 0.01 and 0.5 m²/s³, 1 m/s², 30 m and 10 m.

use super::mode::ModeConfig;
use super::tracker::{AssociationKind, GateConfig, InitiationRule, LifePolicy, StateKind, TrackerConfig};
use super::{Config, not_negative, positive};
use crate::Failure;
use crate::metrics::chi_square_quantile;
use crate::replay::recording::{Component, Recording};
use serde::Serialize;

/// Most modes of a tracker.
pub const MOST_MODES: usize = 3;

/// Time in which a target crosses the reach at most \[s\].
const CROSSING: f64 = 50.0;
/// No default is faster \[m/s\].
const FASTEST: f64 = 300.0;
/// The reach where no sensor tells one \[m\].
const USUAL_REACH: f64 = 500.0;
/// The gap where no sensor tells one \[s\].
const USUAL_GAP: f64 = 4.0;

/// How long a confirmed track may go unseen \[s\].
const HIDDEN: f64 = 8.0;

/// All that makes up a tracker. The names are those of the file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrackerPlan {
    /// How detections are given to tracks.
    pub association: AssociationKind,
    /// The states of a track.
    pub state: StateKind,
    /// The sensors whose scans it takes in.
    pub sensors: Vec<String>,
    /// The ways a target moves, one to three.
    pub modes: Vec<ModeConfig>,
    /// π, a row for every mode.
    pub jump: Vec<Vec<f64>>,
    /// The mode probabilities of a new track.
    pub initial: Vec<f64>,
    /// The validation gate.
    pub gate: GateConfig,
    /// How tracks are started.
    pub initiation: InitiationPlan,
    /// How tracks are confirmed and deleted.
    pub life: LifePlan,
}

/// How tracks are started.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct InitiationPlan {
    /// By how many detections.
    pub rule: InitiationRule,
    /// The largest speed of a target \[m/s\].
    pub max_speed: f64,
    /// How long a detection waits for its partner \[s\].
    pub max_gap: f64,
    /// Standard deviation of the acceleration of a new track, per axis \[m/s²\].
    pub acceleration_std: f64,
}

/// How tracks are confirmed and deleted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LifePlan {
    /// How a target is told from clutter.
    pub policy: LifePolicy,
    /// Probability that the target of a new track exists.
    pub birth: f64,
    /// How long targets stay on average \[s\].
    pub lifetime: f64,
    /// The probability above which a track is confirmed.
    pub confirm: f64,
    /// The probability below which a track is deleted.
    pub delete: f64,
    /// M: detections that confirm a track ..
    pub hits: u8,
    /// .. within N scans.
    pub window: u8,
    /// Scans in a row without a detection that delete a track.
    pub misses: u8,
    /// Largest standard deviation of a coordinate \[m\].
    pub position_limit: f64,
    /// Distance of two tracks on one target, in standard deviations; 0 deletes none.
    pub duplicate_distance: f64,
    /// Distance from its place of birth at which a confirmed track counts as moving \[m\].
    pub min_travel: f64,
}

impl TrackerPlan {
    /// Completes the tracker of `config` for `recording`.
    pub fn new(config: &Config, recording: &Recording) -> Result<Self, Failure> {
        Self::complete(config, recording).map_err(|failure| failure.within("tracker"))
    }

    fn complete(config: &Config, recording: &Recording) -> Result<Self, Failure> {
        let text = &config.tracker;
        let sensors = sensors(text, recording)?;
        let reach = |name: &String| config.sensor(name).max_range.or_else(|| recording.farthest(name));
        let reach = largest(sensors.iter().filter_map(reach)).unwrap_or(USUAL_REACH);
        let intervals: Vec<f64> = sensors.iter().filter_map(|name| recording.median_interval_s(name)).collect();
        let interval = largest(intervals.iter().copied());
        let scans_hidden = intervals.iter().filter(|interval| **interval > 0.0).map(|interval| HIDDEN / interval).sum();
        let initiation = InitiationPlan::complete(text, reach, interval.map_or(USUAL_GAP, |interval| 2.5 * interval));
        let usual_modes = || [1e-4, 5e-3].map(|rate| ModeConfig::straight(rate * initiation.max_speed.powi(2))).to_vec();
        let modes = text.modes.clone().unwrap_or_else(usual_modes);
        let count = modes.len();
        let plan = Self {
            association: text.association.unwrap_or_default(),
            state: match text.state {
                Some(state) => state,
                None => seen_by(&sensors, recording)?,
            },
            jump: text.jump.clone().unwrap_or_else(|| (0..count).map(|from| usual_jump(from, count)).collect()),
            initial: text.initial.clone().unwrap_or_else(|| vec![1.0 / count as f64; count]),
            modes,
            gate: text.gate.unwrap_or(GateConfig::Probability(0.99)),
            initiation,
            life: LifePlan::complete(text, reach, scans_hidden),
            sensors,
        };
        plan.check()?;
        Ok(plan)
    }

    fn check(&self) -> Result<(), Failure> {
        let count = self.modes.len();
        if !(1..=MOST_MODES).contains(&count) {
            return Err(Failure::at_field("modes", format!("{count} of them, not 1 to {MOST_MODES}")));
        }
        for (index, mode) in self.modes.iter().enumerate() {
            mode.check().map_err(|failure| failure.within(format!("modes[{index}]")))?;
        }
        if self.jump.len() != count {
            return Err(Failure::at_field("jump", format!("{} rows for {count} modes", self.jump.len())));
        }
        for (from, row) in self.jump.iter().enumerate() {
            distribution(&format!("jump[{from}]"), row, count)?;
        }
        distribution("initial", &self.initial, count)?;
        self.gate.check().map_err(|failure| failure.within("gate"))?;
        self.initiation.check().map_err(|failure| failure.within("initiation"))?;
        self.life.check().map_err(|failure| failure.within("life"))
    }
}

/// The sensors whose scans are taken in.
fn sensors(text: &TrackerConfig, recording: &Recording) -> Result<Vec<String>, Failure> {
    let known = recording.sensors();
    let Some(chosen) = &text.sensors else { return Ok(known.into_iter().map(str::to_owned).collect()) };
    if chosen.is_empty() {
        return Err(Failure::at_field("sensors", "empty"));
    }
    match chosen.iter().find(|name| !known.contains(&name.as_str())) {
        Some(name) => Err(Failure::unknown("sensor", name, known).within("sensors")),
        None => Ok(chosen.clone()),
    }
}

/// Space where all of these sensors measure it, else the plane.
fn seen_by(sensors: &[String], recording: &Recording) -> Result<StateKind, Failure> {
    for name in sensors {
        let measured = recording.components(name)?;
        let has = |component| measured.contains(&component);
        if !(has(Component::Z) || (has(Component::Range) && has(Component::Elevation))) {
            return Ok(StateKind::Velocity2d);
        }
    }
    Ok(StateKind::Velocity3d)
}

/// Stays with 0.95 and else goes to any other mode alike.
fn usual_jump(from: usize, count: usize) -> Vec<f64> {
    let elsewhere = if count > 1 { 0.05 / (count - 1) as f64 } else { 0.0 };
    (0..count).map(|to| if to == from { 1.0 - elsewhere * (count - 1) as f64 } else { elsewhere }).collect()
}

fn largest(values: impl Iterator<Item = f64>) -> Option<f64> {
    values.reduce(f64::max).filter(|largest| *largest > 0.0)
}

/// That `row` holds `count` probabilities that sum to one.
fn distribution(field: &str, row: &[f64], count: usize) -> Result<(), Failure> {
    if row.len() != count {
        return Err(Failure::at_field(field, format!("{} probabilities for {count} modes", row.len())));
    }
    if let Some(p) = row.iter().find(|p| !(0.0..=1.0).contains(*p)) {
        return Err(Failure::at_field(field, format!("{p} is not a probability")));
    }
    let sum: f64 = row.iter().sum();
    if (sum - 1.0).abs() > 1e-6 { Err(Failure::at_field(field, format!("sums to {sum}, not to 1"))) } else { Ok(()) }
}

impl InitiationPlan {
    fn complete(text: &TrackerConfig, reach: f64, max_gap: f64) -> Self {
        let text = &text.initiation;
        let max_speed = text.max_speed.unwrap_or((reach / CROSSING).min(FASTEST));
        Self {
            rule: text.rule.unwrap_or(InitiationRule::TwoPoint),
            max_speed,
            max_gap: text.max_gap.unwrap_or(max_gap),
            acceleration_std: text.acceleration_std.unwrap_or(max_speed / 10.0),
        }
    }

    fn check(&self) -> Result<(), Failure> {
        positive("max_speed", self.max_speed)?;
        positive("max_gap", self.max_gap)?;
        positive("acceleration_std", self.acceleration_std)
    }
}

impl LifePlan {
    fn complete(text: &TrackerConfig, reach: f64, scans_hidden: f64) -> Self {
        let text = &text.life;
        Self {
            policy: text.policy.unwrap_or_default(),
            birth: text.birth.unwrap_or(0.2),
            lifetime: text.lifetime.unwrap_or(60.0),
            confirm: text.confirm.unwrap_or(0.99),
            delete: text.delete.unwrap_or(0.01),
            hits: text.hits.unwrap_or(7),
            window: text.window.unwrap_or(9),
            misses: text.misses.unwrap_or(scans_hidden.clamp(5.0, 32.0).ceil() as u8),
            position_limit: text.position_limit.unwrap_or(0.06 * reach),
            duplicate_distance: text.duplicate_distance.unwrap_or(2.0),
            min_travel: text.min_travel.unwrap_or(0.02 * reach),
        }
    }

    fn check(&self) -> Result<(), Failure> {
        if self.hits == 0 || self.hits > self.window || self.window > 32 {
            return Err(Failure::at_field("hits", format!("{} of {}: 1 <= hits <= window <= 32 is wanted", self.hits, self.window)));
        }
        if !(1..=32).contains(&self.misses) {
            return Err(Failure::at_field("misses", format!("{} is not 1 to 32", self.misses)));
        }
        positive("lifetime", self.lifetime)?;
        for (name, p) in [("birth", self.birth), ("confirm", self.confirm), ("delete", self.delete)] {
            if !(p > 0.0 && p < 1.0) {
                return Err(Failure::at_field(name, format!("{p} is not between 0 and 1")));
            }
        }
        positive("position_limit", self.position_limit)?;
        not_negative("duplicate_distance", self.duplicate_distance)?;
        not_negative("min_travel", self.min_travel)
    }
}

impl GateConfig {
    /// γ for measurements of `dimension` components.
    #[must_use]
    pub fn threshold(self, dimension: usize) -> f64 {
        match self {
            Self::Probability(p) => chi_square_quantile(dimension as f64, p).unwrap_or(f64::NAN),
            Self::Threshold(threshold) => threshold,
        }
    }

    fn check(self) -> Result<(), Failure> {
        match self {
            Self::Probability(p) if p > 0.0 && p < 1.0 => Ok(()),
            Self::Probability(p) => Err(Failure::at_field("probability", format!("{p} is not between 0 and 1"))),
            Self::Threshold(threshold) => positive("threshold", threshold),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::replay::recording::tests::recording;

    fn planned(text: &str) -> Result<TrackerPlan, String> {
        let tracker = toml::from_str(text).map_err(|error| error.to_string())?;
        let recording = recording("t_us,sensor,x,y\n0,radar,300,400\n2000000,radar,300,390\n4000000,radar,,\n");
        let recording = recording.map_err(|failure| failure.to_string())?;
        TrackerPlan::new(&Config { tracker, ..Config::default() }, &recording).map_err(|failure| failure.to_string())
    }

    #[test]
    fn defaults_follow_from_the_recording() -> Result<(), String> {
        let plan = planned("")?;
        assert_eq!((plan.initiation.max_speed, plan.initiation.max_gap), (10.0, 5.0));
        assert_eq!((plan.life.position_limit, plan.life.min_travel, plan.state), (30.0, 10.0, StateKind::Velocity2d));
        assert_eq!(plan.modes, [ModeConfig::straight(0.01), ModeConfig::straight(0.5)]);
        assert_eq!((plan.jump, plan.initial), (vec![vec![0.95, 0.05], vec![0.05, 0.95]], vec![0.5, 0.5]));
        assert!((plan.gate.threshold(2) - 9.210_340).abs() < 1e-5);
        let faster = planned("[initiation]\nmax_speed = 100")?;
        assert_eq!(faster.modes, [ModeConfig::straight(1.0), ModeConfig::straight(50.0)]);
        let single = planned("[[modes]]\nmodel = \"constant-velocity\"\nacceleration_std = 1")?;
        assert_eq!((single.jump, single.initial), (vec![vec![1.0]], vec![1.0]));
        Ok(())
    }

    #[test]
    fn contradictions_are_named() {
        for (text, expected) in [
            ("modes = []", "modes: 0 of them, not 1 to 3"),
            ("[[modes]]\nmodel = \"turn\"\nacceleration_std = 1", "modes[0]: turn_rate: missing"),
            ("jump = [[1.0]]", "jump: 1 rows for 2 modes"),
            ("jump = [[0.9, 0.1], [0.25, 0.5]]", "jump[1]: sums to 0.75, not to 1"),
            ("jump = [[0.9, 0.1], [1.2, -0.2]]", "jump[1]: 1.2 is not a probability"),
            ("initial = [1]", "initial: 1 probabilities for 2 modes"),
            ("sensors = [\"sonar\"]", "sensors: unknown sensor \"sonar\"; known: radar"),
            ("sensors = []", "sensors: empty"),
            ("gate = { probability = 99 }", "gate: probability: 99 is not between 0 and 1"),
            ("gate = { threshold = 0 }", "gate: threshold: 0 is not positive and finite"),
            ("[initiation]\nmax_speed = -3", "initiation: max_speed: -3 is not positive and finite"),
            ("[life]\nhits = 9\nwindow = 8", "life: hits: 9 of 8: 1 <= hits <= window <= 32 is wanted"),
            ("[life]\nmisses = 0", "life: misses: 0 is not 1 to 32"),
            ("[life]\nmin_travel = -1", "life: min_travel: -1 is negative or not finite"),
        ] {
            assert_eq!(planned(text).err(), Some(format!("tracker: {expected}")), "{text}");
        }
    }
}
