//! One sensor in TOML.
//!
//! ```toml
//! [sensors.radar]
//! position = [0.0, 0.0, 0.0]   # m, where the recording has no own position
//! sigma = { x = 6.0, y = 6.0 } # standard deviations by component: m, rad, m/s; a plot's own take precedence
//! p_detect = 0.9               # P_D: probability that a target is detected in a scan, above 0 and at most 1
//! clutter_density = 4e-6       # λ: false detections per scan and unit volume of the measurement space, above 0
//! min_range = 0.0              # m: nearer than this it sees nothing
//! max_range = 500.0            # m: farther than this it sees nothing
//! initiates = true             # whether its detections start tracks
//! resolution = { x = 15.0, y = 15.0 }   # cells by component: two targets within them may give one detection between them
//! ```
//!
//! Defaults: as above, with 10 mrad for angles, 1 m/s for range rates, and 2 m instead of 6 m for a sensor named
//! `lidar`; without `clutter_density` 4 false detections per km² for a sensor that reports x and y, and for any other a
//! density estimated in each gate; without `max_range` the range of the farthest detection recorded of that sensor.
//! A sensor without `resolution` gives every target a detection of its own; where it has one, components that are not named resolve
//! nothing, and tracks that are associated together are handled as pairs while they are within the cells.
//! Outside its ranges P_D is zero, and a track there is not counted as missed.

use super::super::recording::{Component, Components};
use super::{not_negative, positive};
use crate::Failure;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// The cell of a component that resolves nothing.
const UNRESOLVED: f64 = 1e9;

/// One sensor.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SensorConfig {
    /// Position of a resting sensor \[m\].
    pub position: [f64; 3],
    /// Standard deviations by component name \[m, rad, m/s\]; a plot's own take precedence.
    sigma: BTreeMap<String, f64>,
    /// Probability that a target is detected in a scan, above 0 and at most 1.
    pub p_detect: f64,
    /// False detections per scan and unit volume of the measurement space, above 0; `None` for the usual.
    pub clutter_density: Option<f64>,
    /// Nearer than this it sees nothing \[m\].
    pub min_range: f64,
    /// Farther than this it sees nothing \[m\]; `None` for the range of its farthest detection.
    pub max_range: Option<f64>,
    /// Whether its detections start tracks.
    pub initiates: bool,
    /// Sizes of its cells by component name \[m, rad, m/s\]; empty where every target gives a detection of its own.
    resolution: BTreeMap<String, f64>,
}

impl Default for SensorConfig {
    /// A coastal radar that reports x and y: nine of ten detected.
    fn default() -> Self {
        Self {
            position: [0.0; 3],
            sigma: BTreeMap::new(),
            p_detect: 0.9,
            clutter_density: None,
            min_range: 0.0,
            max_range: None,
            initiates: true,
            resolution: BTreeMap::new(),
        }
    }
}

impl SensorConfig {
    /// Standard deviation of every component of the sensor `name`; those not described have the usual ones.
    #[must_use]
    pub fn sigma(&self, name: &str) -> Components {
        let metres = if name == "lidar" { 2.0 } else { 6.0 };
        let mut sigma = Components::default();
        for component in Component::ALL {
            let usual = match component {
                Component::X | Component::Y | Component::Z | Component::Range => metres,
                Component::Azimuth | Component::Elevation => 0.01,
                Component::RangeRate => 1.0,
            };
            sigma.set(component, self.sigma.get(component.name()).copied().unwrap_or(usual));
        }
        sigma
    }

    /// The size of its cells in every component; `None` where it has none.
    #[must_use]
    pub fn cells(&self) -> Option<Components> {
        let mut cells = Components::default();
        for component in Component::ALL {
            cells.set(component, self.resolution.get(component.name()).copied().unwrap_or(UNRESOLVED));
        }
        (!self.resolution.is_empty()).then_some(cells)
    }

    /// Refuses what no sensor can be.
    pub(super) fn check(&self) -> Result<(), Failure> {
        for (name, &cell) in &self.resolution {
            if Component::named(name).is_none() {
                return Err(Failure::unknown("component", name, Component::ALL.map(Component::name)).within("resolution"));
            }
            positive(format!("resolution.{name}"), cell)?;
        }
        if !self.position.iter().all(|x| x.is_finite()) {
            return Err(Failure::at_field("position", "not finite"));
        }
        for (name, &sigma) in &self.sigma {
            let field = format!("sigma.{name}");
            let Some(component) = Component::named(name) else {
                let known = Component::ALL.map(Component::name);
                return Err(Failure::unknown("component", name, known).within("sigma"));
            };
            positive(&field, sigma)?;
            if matches!(component, Component::Azimuth | Component::Elevation) && sigma > PI {
                return Err(Failure::at_field(field, format!("{sigma} is more than half a turn; radians are wanted")));
            }
        }
        if !(self.p_detect > 0.0 && self.p_detect <= 1.0) {
            return Err(Failure::at_field("p_detect", format!("{} is not above 0 and at most 1", self.p_detect)));
        }
        self.clutter_density.map_or(Ok(()), |density| positive("clutter_density", density))?;
        not_negative("min_range", self.min_range)?;
        match self.max_range {
            Some(max) if !max.is_finite() => Err(Failure::at_field("max_range", format!("{max} is not finite"))),
            Some(max) if max <= self.min_range => Err(Failure::at_field("max_range", format!("{max} is not beyond min_range"))),
            _ => Ok(()),
        }
    }
}
