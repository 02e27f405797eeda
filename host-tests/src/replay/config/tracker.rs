//! The tracker in TOML.
//!
//! ```toml
//! [tracker]
//! state = "cv-2d"              # (x, vx, y, vy); "ca-2d" (x, vx, ax, y, vy, ay); "cv-3d" (x, vx, y, vy, z, vz)
//! sensors = ["radar"]          # those whose scans it takes in
//! jump = [[0.95, 0.05], [0.05, 0.95]]   # π: row = mode before a scan, column = mode after it
//! initial = [0.5, 0.5]         # mode probabilities of a new track
//! gate = { probability = 0.99 }         # P_G, or { threshold = 9.21 }, the largest normalised innovation squared
//!
//! [[tracker.modes]]            # one to three
//! model = "constant-velocity"
//! acceleration_density = 0.05  # m²/s³, white acceleration noise in every axis
//!
//! [tracker.initiation]
//! rule = "two-point"           # or "one-point": at rest, ± max_speed / 2
//! max_speed = 15.0             # m/s
//! max_gap = 4.0                # s, how long a detection waits for its partner
//! acceleration_std = 1.0       # m/s², "ca-2d" only: that of a new track
//!
//! [tracker.life]               # confirmed by `hits` in `window` scans, deleted after `misses` in a row
//! hits = 6
//! window = 8
//! misses = 5
//! position_limit = 60.0        # m, deleted where the standard deviation of a coordinate exceeds it
//! duplicate_distance = 1.0     # in standard deviations: of two tracks nearer than this the younger is deleted; 0: none
//! min_travel = 25.0            # m: a confirmed track counts as moving once it was so far from where it was born
//! ```
//!
//! | model | parameters | state |
//! |---|---|---|
//! | `constant-velocity` | `acceleration_density` \[m²/s³\] or `acceleration_std` \[m/s²\] (one value a step) | any |
//! | `turn` | `turn_rate` \[rad/s\], positive from x to y, and one of the above | `cv-2d`, `cv-3d` |
//! | `constant-acceleration` | `jerk_density` \[m²/s⁵\] or `acceleration_std` \[m/s²\] (increment a step) | `ca-2d` |
//! | `singer` | `time_constant` \[s\] and `acceleration_std` \[m/s²\] | `ca-2d` |
//!
//! Defaults: as above, with the modes of [`TrackerConfig::default`]; `sensors` all of the recording; `state` by what
//! they measure; `jump` stays with 0.95 and else goes to any other mode alike; `initial` all modes alike.

use super::{not_negative, positive};
use crate::Failure;
use crate::metrics::chi_square_quantile;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Most modes of a tracker.
pub const MOST_MODES: usize = 3;

/// The tracker.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TrackerConfig {
    /// The states of a track; `None` for what the sensors can see.
    pub state: Option<StateKind>,
    /// The sensors whose scans it takes in; `None` for all.
    pub sensors: Option<Vec<String>>,
    /// The ways a target moves, one to three.
    pub modes: Vec<ModeConfig>,
    jump: Option<Vec<Vec<f64>>>,
    initial: Option<Vec<f64>>,
    /// The validation gate.
    pub gate: GateConfig,
    /// How tracks are started.
    pub initiation: InitiationConfig,
    /// How tracks are confirmed and deleted.
    pub life: LifeConfig,
}

/// What the states of a track are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StateKind {
    /// (x, vx, y, vy)
    #[serde(rename = "cv-2d")]
    Velocity2d,
    /// (x, vx, ax, y, vy, ay)
    #[serde(rename = "ca-2d")]
    Acceleration2d,
    /// (x, vx, y, vy, z, vz)
    #[serde(rename = "cv-3d")]
    Velocity3d,
}

/// A kinematic model, by its name in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Model {
    /// Straight, with random accelerations.
    ConstantVelocity,
    /// A turn at a known rate.
    Turn,
    /// Constant acceleration, with random jerks.
    ConstantAcceleration,
    /// An acceleration that fades.
    Singer,
}

/// One mode: a model and the parameters of the module's table that it wants.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModeConfig {
    /// Which model.
    pub model: Model,
    acceleration_density: Option<f64>,
    acceleration_std: Option<f64>,
    jerk_density: Option<f64>,
    time_constant: Option<f64>,
    turn_rate: Option<f64>,
}

/// The process noise of a mode: the standard deviation of one step or a power spectral density.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Noise {
    /// One random value a step, of this standard deviation \[m/s²\].
    Step(f64),
    /// White noise of this density \[m²/s³\] (acceleration) or \[m²/s⁵\] (jerk).
    Density(f64),
}

/// The validation gate.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GateConfig {
    /// P_G: the probability that a target's own detection is in the gate.
    Probability(f64),
    /// γ: the largest normalised innovation squared in the gate.
    Threshold(f64),
}

/// How tracks are started.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct InitiationConfig {
    /// By how many detections.
    pub rule: InitiationRule,
    /// The largest speed of a target \[m/s\].
    pub max_speed: f64,
    /// How long a detection waits for its partner \[s\].
    pub max_gap: f64,
    /// Standard deviation of the acceleration of a new track, per axis \[m/s²\].
    pub acceleration_std: f64,
}

/// By how many detections tracks are started.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InitiationRule {
    /// By one.
    OnePoint,
    /// By two of successive scans.
    TwoPoint,
}

/// How tracks are confirmed and deleted.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LifeConfig {
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

impl Default for TrackerConfig {
    /// Boats: mostly straight on, now and then a manoeuvre.
    fn default() -> Self {
        let straight = |density| ModeConfig { acceleration_density: Some(density), ..ModeConfig::of(Model::ConstantVelocity) };
        Self {
            state: None,
            sensors: None,
            modes: vec![straight(0.01), straight(0.5)],
            jump: None,
            initial: None,
            gate: GateConfig::Probability(0.99),
            initiation: InitiationConfig::default(),
            life: LifeConfig::default(),
        }
    }
}

impl Default for InitiationConfig {
    fn default() -> Self {
        Self { rule: InitiationRule::TwoPoint, max_speed: 15.0, max_gap: 4.0, acceleration_std: 1.0 }
    }
}

impl Default for LifeConfig {
    fn default() -> Self {
        Self { hits: 6, window: 8, misses: 5, position_limit: 60.0, duplicate_distance: 1.0, min_travel: 25.0 }
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

impl ModeConfig {
    fn of(model: Model) -> Self {
        Self { model, acceleration_density: None, acceleration_std: None, jerk_density: None, time_constant: None, turn_rate: None }
    }

    /// The process noise; for Singer the standard deviation of the acceleration.
    pub fn noise(&self) -> Result<Noise, Failure> {
        let (name, density) = match self.model {
            Model::ConstantVelocity | Model::Turn => ("acceleration_density or acceleration_std", self.acceleration_density),
            Model::ConstantAcceleration => ("jerk_density or acceleration_std", self.jerk_density),
            Model::Singer => ("acceleration_std", None),
        };
        match (density, self.acceleration_std) {
            (Some(density), None) => Ok(Noise::Density(density)),
            (None, Some(std)) => Ok(Noise::Step(std)),
            (None, None) => Err(Failure::at_field(name, "missing")),
            (Some(_), Some(_)) => Err(Failure::at_field(name, "both given")),
        }
    }

    /// The turn rate \[rad/s\].
    pub fn turn_rate(&self) -> Result<f64, Failure> {
        self.turn_rate.ok_or_else(|| Failure::at_field("turn_rate", "missing"))
    }

    /// The time constant of the acceleration \[s\].
    pub fn time_constant(&self) -> Result<f64, Failure> {
        self.time_constant.ok_or_else(|| Failure::at_field("time_constant", "missing"))
    }

    fn check(&self) -> Result<(), Failure> {
        use Model::{ConstantAcceleration, ConstantVelocity, Singer, Turn};
        let given = [
            ("acceleration_density", self.acceleration_density, [ConstantVelocity, Turn].as_slice()),
            ("acceleration_std", self.acceleration_std, &[ConstantVelocity, Turn, ConstantAcceleration, Singer]),
            ("jerk_density", self.jerk_density, &[ConstantAcceleration]),
            ("time_constant", self.time_constant, &[Singer]),
        ];
        for (field, value, models) in given {
            let Some(value) = value else { continue };
            if !models.contains(&self.model) {
                return Err(Failure::at_field(field, "not a parameter of this model"));
            }
            if field == "time_constant" { positive(field, value)? } else { not_negative(field, value)? }
        }
        match self.turn_rate {
            Some(_) if self.model != Turn => return Err(Failure::at_field("turn_rate", "not a parameter of this model")),
            Some(rate) if !(rate.abs() <= PI) => {
                return Err(Failure::at_field(
                    "turn_rate",
                    format!("{rate} is beyond half a turn a second; radians per second are wanted"),
                ));
            }
            Some(_) => {}
            None if self.model == Turn => return self.turn_rate().map(drop),
            None => {}
        }
        if self.model == Singer {
            self.time_constant()?;
        }
        self.noise().map(drop)
    }
}

impl TrackerConfig {
    /// π, a row for every mode.
    #[must_use]
    pub fn jump(&self) -> Vec<Vec<f64>> {
        let count = self.modes.len();
        let usual = |from: usize| {
            (0..count).map(move |to| {
                if count == 1 {
                    1.0
                } else if from == to {
                    0.95
                } else {
                    0.05 / (count - 1) as f64
                }
            })
        };
        self.jump.clone().unwrap_or_else(|| (0..count).map(|from| usual(from).collect()).collect())
    }

    /// The mode probabilities of a new track.
    #[must_use]
    pub fn initial(&self) -> Vec<f64> {
        let count = self.modes.len();
        self.initial.clone().unwrap_or_else(|| vec![1.0 / count as f64; count])
    }

    /// Refuses what no tracker can be; `known` are the sensors of the recording.
    pub(super) fn check(&self, known: &[&str]) -> Result<(), Failure> {
        for name in self.sensors.iter().flatten() {
            if !known.contains(&name.as_str()) {
                return Err(Failure::unknown("sensor", name, known.iter().copied()).within("sensors"));
            }
        }
        if self.sensors.as_ref().is_some_and(Vec::is_empty) {
            return Err(Failure::at_field("sensors", "empty"));
        }
        if !(1..=MOST_MODES).contains(&self.modes.len()) {
            return Err(Failure::at_field("modes", format!("{} of them, not 1 to {MOST_MODES}", self.modes.len())));
        }
        for (index, mode) in self.modes.iter().enumerate() {
            mode.check().map_err(|failure| failure.within(format!("modes[{index}]")))?;
        }
        let count = self.modes.len();
        let jump = self.jump();
        if jump.len() != count {
            return Err(Failure::at_field("jump", format!("{} rows for {count} modes", jump.len())));
        }
        for (from, row) in jump.iter().enumerate() {
            distribution(&format!("jump[{from}]"), row, count)?;
        }
        distribution("initial", &self.initial(), count)?;
        self.gate.check().map_err(|failure| failure.within("gate"))?;
        self.initiation.check().map_err(|failure| failure.within("initiation"))?;
        self.life.check().map_err(|failure| failure.within("life"))
    }
}

impl InitiationConfig {
    fn check(&self) -> Result<(), Failure> {
        positive("max_speed", self.max_speed)?;
        positive("max_gap", self.max_gap)?;
        positive("acceleration_std", self.acceleration_std)
    }
}

impl LifeConfig {
    fn check(&self) -> Result<(), Failure> {
        if self.hits == 0 || self.hits > self.window || self.window > 32 {
            return Err(Failure::at_field("hits", format!("{} of {}: 1 <= hits <= window <= 32 is wanted", self.hits, self.window)));
        }
        if !(1..=32).contains(&self.misses) {
            return Err(Failure::at_field("misses", format!("{} is not 1 to 32", self.misses)));
        }
        positive("position_limit", self.position_limit)?;
        not_negative("duplicate_distance", self.duplicate_distance)?;
        not_negative("min_travel", self.min_travel)
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(text: &str) -> Option<String> {
        let config: Result<TrackerConfig, _> = toml::from_str(text);
        config.map_or_else(|error| Some(error.to_string()), |config| config.check(&["radar"]).err().map(|failure| failure.to_string()))
    }

    #[test]
    fn defaults_depend_on_the_number_of_modes() {
        let mut config = TrackerConfig::default();
        assert_eq!((config.jump(), config.initial()), (vec![vec![0.95, 0.05], vec![0.05, 0.95]], vec![0.5, 0.5]));
        config.modes.truncate(1);
        assert_eq!((config.jump(), config.initial()), (vec![vec![1.0]], vec![1.0]));
        assert!((GateConfig::Probability(0.99).threshold(2) - 9.210_340).abs() < 1e-5);
        assert_eq!(refused(""), None);
    }

    #[test]
    fn contradictions_are_named() {
        let mode = |parameters: &str| refused(&format!("[[modes]]\n{parameters}\n"));
        for (told, expected) in [
            (mode("model = \"constant-velocity\""), "modes[0]: acceleration_density or acceleration_std: missing"),
            (
                mode("model = \"constant-velocity\"\nacceleration_std = 1\nacceleration_density = 1"),
                "modes[0]: acceleration_density or acceleration_std: both given",
            ),
            (mode("model = \"constant-velocity\"\nacceleration_std = -1"), "modes[0]: acceleration_std: -1 is negative or not finite"),
            (mode("model = \"turn\"\nacceleration_std = 1"), "modes[0]: turn_rate: missing"),
            (
                mode("model = \"turn\"\nacceleration_std = 1\nturn_rate = 5"),
                "modes[0]: turn_rate: 5 is beyond half a turn a second; radians per second are wanted",
            ),
            (mode("model = \"singer\"\nacceleration_std = 1"), "modes[0]: time_constant: missing"),
            (mode("model = \"singer\"\ntime_constant = 9\njerk_density = 1"), "modes[0]: jerk_density: not a parameter of this model"),
            (refused("modes = []"), "modes: 0 of them, not 1 to 3"),
            (refused("jump = [[1.0]]"), "jump: 1 rows for 2 modes"),
            (refused("jump = [[0.9, 0.1], [0.2, 0.7]]"), "jump[1]: sums to 0.8999999999999999, not to 1"),
            (refused("jump = [[0.9, 0.1], [1.2, -0.2]]"), "jump[1]: 1.2 is not a probability"),
            (refused("initial = [1]"), "initial: 1 probabilities for 2 modes"),
            (refused("sensors = [\"sonar\"]"), "sensors: unknown sensor \"sonar\"; known: radar"),
            (refused("sensors = []"), "sensors: empty"),
            (refused("gate = { probability = 99 }"), "gate: probability: 99 is not between 0 and 1"),
            (refused("gate = { threshold = 0 }"), "gate: threshold: 0 is not positive and finite"),
            (refused("[initiation]\nmax_speed = -3"), "initiation: max_speed: -3 is not positive and finite"),
            (refused("[life]\nhits = 9\nwindow = 8"), "life: hits: 9 of 8: 1 <= hits <= window <= 32 is wanted"),
            (refused("[life]\nmisses = 0"), "life: misses: 0 is not 1 to 32"),
            (refused("[life]\nmin_travel = -1"), "life: min_travel: -1 is negative or not finite"),
        ] {
            assert_eq!(told.as_deref(), Some(expected));
        }
    }
}
