//! One mode of the tracker in TOML: how a target moves.
//!
//! ```toml
//! [[tracker.modes]]
//! model = "constant-velocity"
//! acceleration_density = 0.01
//! ```
//!
//! | `model` | parameters | state |
//! |---|---|---|
//! | `constant-velocity` | `acceleration_density` \[m²/s³\] or `acceleration_std` \[m/s²\] (one value a step) | any |
//! | `turn` | `turn_rate` \[rad/s\], positive from x to y, and one of the above | `cv-2d`, `cv-3d` |
//! | `constant-acceleration` | `jerk_density` \[m²/s⁵\] or `acceleration_std` \[m/s²\] (increment a step) | `ca-2d` |
//! | `singer` | `time_constant` \[s\] and `acceleration_std` \[m/s²\] | `ca-2d` |
//!
//! A density is the power of white noise and keeps its meaning when scans come at irregular times; a standard deviation
//! belongs to one length of step. The equations stand with the library's models.

use super::{not_negative, positive};
use crate::Failure;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// A kinematic model, by its name in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
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
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModeConfig {
    /// Which model.
    pub model: Model,
    #[serde(skip_serializing_if = "Option::is_none")]
    acceleration_density: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    acceleration_std: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    jerk_density: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    time_constant: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
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

impl ModeConfig {
    /// Constant velocity with white acceleration of the power spectral density `acceleration_density` \[m²/s³\].
    #[must_use]
    pub fn straight(acceleration_density: f64) -> Self {
        Self {
            model: Model::ConstantVelocity,
            acceleration_density: Some(acceleration_density),
            acceleration_std: None,
            jerk_density: None,
            time_constant: None,
            turn_rate: None,
        }
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

    /// Refuses parameters that are missing, not the model's, or senseless.
    pub(super) fn check(&self) -> Result<(), Failure> {
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
            Some(rate) if rate.is_nan() || rate.abs() > PI => {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(text: &str) -> Option<String> {
        let mode: Result<ModeConfig, _> = toml::from_str(text);
        mode.map_or_else(|error| Some(error.to_string()), |mode| mode.check().err().map(|failure| failure.to_string()))
    }

    #[test]
    fn parameters_belong_to_their_model() {
        for (told, expected) in [
            (refused("model = \"constant-velocity\""), "acceleration_density or acceleration_std: missing"),
            (
                refused("model = \"constant-velocity\"\nacceleration_std = 1\nacceleration_density = 1"),
                "acceleration_density or acceleration_std: both given",
            ),
            (refused("model = \"constant-velocity\"\nacceleration_std = -1"), "acceleration_std: -1 is negative or not finite"),
            (refused("model = \"turn\"\nacceleration_std = 1"), "turn_rate: missing"),
            (
                refused("model = \"turn\"\nacceleration_std = 1\nturn_rate = 5"),
                "turn_rate: 5 is beyond half a turn a second; radians per second are wanted",
            ),
            (refused("model = \"singer\"\nacceleration_std = 1"), "time_constant: missing"),
            (refused("model = \"singer\"\ntime_constant = 9\njerk_density = 1"), "jerk_density: not a parameter of this model"),
        ] {
            assert_eq!(told.as_deref(), Some(expected));
        }
        assert_eq!(refused("model = \"constant-acceleration\"\njerk_density = 0.1"), None);
        assert_eq!(refused("model = \"singer\"\nacceleration_std = 3\ntime_constant = 20"), None);
        assert_eq!(refused("model = \"turn\"\nacceleration_density = 0.1\nturn_rate = -0.05"), None);
    }
}
