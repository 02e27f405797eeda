//! The tracker in TOML.
//!
//! ```toml
//! [tracker]
//! association = "jpda"         # all tracks together; "gnn": the one best event; "pda": every track alone
//! state = "cv-2d"              # (x, vx, y, vy); "ca-2d" (x, vx, ax, y, vy, ay); "cv-3d" (x, vx, y, vy, z, vz)
//! sensors = ["radar"]          # those whose scans it takes in
//! jump = [[0.95, 0.05], [0.05, 0.95]]   # π: row = mode before a scan, column = mode after it
//! initial = [0.5, 0.5]         # mode probabilities of a new track
//! gate = { probability = 0.99 }         # P_G, or { threshold = 9.21 }, the largest normalised innovation squared
//!
//! [[tracker.modes]]            # one to three, see `mode`
//! model = "constant-velocity"
//! acceleration_density = 0.01  # m²/s³
//!
//! [[tracker.modes]]
//! model = "constant-velocity"
//! acceleration_density = 0.5
//!
//! [tracker.initiation]
//! rule = "two-point"           # or "one-point": at rest, ± max_speed / 2
//! max_speed = 10.0             # m/s
//! max_gap = 4.0                # s, how long a detection waits for its partner
//! acceleration_std = 1.0       # m/s², "ca-2d" only: that of a new track
//!
//! [tracker.life]
//! policy = "count"             # confirmed by `hits` in `window` scans, deleted after `misses` in a row
//! hits = 7
//! window = 9
//! misses = 5
//! # policy = "existence": by the probability that the target exists; the defaults are these
//! # birth = 0.2                # of a new track
//! # lifetime = 60.0            # s, how long targets stay on average
//! # confirm = 0.99             # confirmed above
//! # delete = 0.01              # deleted below
//! position_limit = 30.0        # m, deleted where the standard deviation of a coordinate exceeds it
//! duplicate_distance = 2.0     # in standard deviations: of two tracks nearer than this the younger is deleted; 0: none
//! min_travel = 10.0            # m: a confirmed track counts as moving once it was so far from where it was born
//! ```
//!
//! Defaults: as above, but `sensors` all of the recording and `state` what they can see (space where all measure it,
//! else the plane); modes, speeds, gap, misses and lengths follow from the recording (see `plan`) and stand here as for a reach
//! of 500 m; `jump` for any number of modes stays with 0.95 and else goes to the others alike; `initial` all alike.

use super::mode::ModeConfig;
use serde::{Deserialize, Serialize};

/// The tracker as the file describes it; what it leaves open is `None`.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TrackerConfig {
    pub(super) association: Option<AssociationKind>,
    pub(super) state: Option<StateKind>,
    pub(super) sensors: Option<Vec<String>>,
    pub(super) modes: Option<Vec<ModeConfig>>,
    pub(super) jump: Option<Vec<Vec<f64>>>,
    pub(super) initial: Option<Vec<f64>>,
    pub(super) gate: Option<GateConfig>,
    pub(super) initiation: InitiationConfig,
    pub(super) life: LifeConfig,
}

/// How detections are given to tracks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AssociationKind {
    /// Every track alone: IMM-PDAF.
    Pda,
    /// All together: IMM-JPDAF.
    #[default]
    Jpda,
    /// The most probable joint event, for certain.
    Gnn,
}

/// What the states of a track are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
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

/// The validation gate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GateConfig {
    /// P_G: the probability that a target's own detection is in the gate.
    Probability(f64),
    /// γ: the largest normalised innovation squared in the gate.
    Threshold(f64),
}

/// How tracks are started.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct InitiationConfig {
    pub rule: Option<InitiationRule>,
    pub max_speed: Option<f64>,
    pub max_gap: Option<f64>,
    pub acceleration_std: Option<f64>,
}

/// By how many detections tracks are started.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InitiationRule {
    /// By one.
    OnePoint,
    /// By two of successive scans.
    TwoPoint,
}

/// How a target is told from clutter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LifePolicy {
    /// By counting hits and misses.
    #[default]
    Count,
    /// By the probability that it exists.
    Existence,
}

/// How tracks are confirmed and deleted.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct LifeConfig {
    pub policy: Option<LifePolicy>,
    pub birth: Option<f64>,
    pub lifetime: Option<f64>,
    pub confirm: Option<f64>,
    pub delete: Option<f64>,
    pub hits: Option<u8>,
    pub window: Option<u8>,
    pub misses: Option<u8>,
    pub position_limit: Option<f64>,
    pub duplicate_distance: Option<f64>,
    pub min_travel: Option<f64>,
}
