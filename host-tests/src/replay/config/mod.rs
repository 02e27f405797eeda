//! The description of sensors and tracker in TOML.
//!
//! ```toml
//! [sensors.radar]              # the name in the recording; see `sensor`
//! sigma = { range = 10.0, azimuth = 0.01 }
//!
//! [tracker]                    # see `tracker`
//! state = "cv-2d"
//! ```
//!
//! All numbers are in SI units and radians. Everything has a default; an unknown key, a value that makes no sense and
//! a sensor that the recording does not have are mistakes, told in one line with file, line or field, and reason.

mod mode;
mod plan;
mod sensor;
mod tracker;

use super::recording::Recording;
use crate::{Failure, output};
pub use mode::{ModeConfig, Model, Noise};
pub use plan::{InitiationPlan, LifePlan, MOST_MODES, TrackerPlan};
pub use sensor::SensorConfig;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::Path;
pub use tracker::{AssociationKind, GateConfig, InitiationRule, LifePolicy, StateKind, TrackerConfig};

/// Most characters of a quoted line.
const QUOTED: usize = 60;

/// The whole description.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// Sensors by name.
    pub sensors: BTreeMap<String, SensorConfig>,
    /// The tracker.
    pub tracker: TrackerConfig,
}

impl Config {
    /// Reads the description of the tracker and of the sensors of `recording`.
    pub fn read(file: &Path, recording: &Recording) -> Result<Self, Failure> {
        let text = output::read_text(file)?;
        Self::parse(&text, recording).map_err(|(line, failure)| match line {
            Some(line) => failure.on_line(file, line),
            None => failure.in_file(file),
        })
    }

    /// The description of a sensor of the recording.
    #[must_use]
    pub fn sensor(&self, name: &str) -> SensorConfig {
        self.sensors.get(name).cloned().unwrap_or_default()
    }

    /// A failure comes with its line where the parser knows it.
    pub(super) fn parse(text: &str, recording: &Recording) -> Result<Self, (Option<u64>, Failure)> {
        let config: Self = toml::from_str(text)
            .map_err(|error| {
                let start = error.span().map(|span| span.start.min(text.len()));
                let line = start.map(|start| text.bytes().take(start).filter(|&b| b == b'\n').count());
                let reason = Failure::input(error.message());
                // The parser's message says what is wrong with a value, but not whose value it is.
                match line.and_then(|line| text.lines().nth(line)).map(str::trim).filter(|quote| !quote.is_empty()) {
                    Some(quote) => (line, reason.within(quote.chars().take(QUOTED).collect::<String>())),
                    None => (line, reason),
                }
            })
            .map_err(|(line, failure)| (line.map(|line| line as u64 + 1), failure))?;
        config.check(recording).map_err(|failure| (None, failure))?;
        Ok(config)
    }

    fn check(&self, recording: &Recording) -> Result<(), Failure> {
        let known = recording.sensors();
        for (name, sensor) in &self.sensors {
            if !known.contains(&name.as_str()) {
                return Err(Failure::unknown("sensor", name, known).within("sensors"));
            }
            sensor.check().map_err(|failure| failure.within(format!("sensors.{name}")))?;
        }
        Ok(())
    }
}

/// That the value of `field` is finite and above zero.
fn positive(field: impl Display, value: f64) -> Result<(), Failure> {
    if value > 0.0 && value.is_finite() { Ok(()) } else { Err(Failure::at_field(field, format!("{value} is not positive and finite"))) }
}

/// That the value of `field` is finite and not below zero.
fn not_negative(field: impl Display, value: f64) -> Result<(), Failure> {
    if value >= 0.0 && value.is_finite() { Ok(()) } else { Err(Failure::at_field(field, format!("{value} is negative or not finite"))) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::replay::recording::Component;
    use crate::replay::recording::tests::recording;

    fn parsed(text: &str) -> Result<Config, (Option<u64>, String)> {
        let recording = recording("t_us,sensor,x,y\n0,radar,1,2\n").map_err(|failure| (None, failure.to_string()))?;
        Config::parse(text, &recording).map_err(|(line, failure)| (line, failure.to_string()))
    }

    #[test]
    fn what_is_not_said_has_a_default() {
        let config = parsed("[sensors.radar]\nsigma = { azimuth = 0.002 }\np_detect = 0.95\n");
        let radar = config.map(|config| config.sensor("radar"));
        assert!(radar.is_ok_and(|radar| radar.p_detect == 0.95
            && radar.min_range == 0.0
            && radar.sigma("radar").get(Component::Azimuth) == Some(0.002)
            && radar.sigma("radar").get(Component::Range) == Some(6.0)));
        assert_eq!(parsed(""), Ok(Config::default()));
    }

    #[test]
    fn complaints_name_the_place_and_the_reason() {
        let told = |text: &str| parsed(text).err();
        let in_radar = |line: &str| told(&format!("[sensors.radar]\n{line}\n")).map(|(_, message)| message);
        for (line, expected) in [
            ("p_detect = 1.5", "p_detect: 1.5 is not above 0 and at most 1"),
            ("p_detect = -0.5", "p_detect: -0.5 is not above 0 and at most 1"),
            ("sigma = { y = -1 }", "sigma.y: -1 is not positive and finite"),
            ("sigma = { azimuth = 4 }", "sigma.azimuth: 4 is more than half a turn; radians are wanted"),
            ("clutter_density = nan", "clutter_density: NaN is not positive and finite"),
            ("min_range = -3.0", "min_range: -3 is negative or not finite"),
            ("min_range = 30\nmax_range = 20", "max_range: 20 is not beyond min_range"),
            ("position = [0, inf, 0]", "position: not finite"),
        ] {
            assert_eq!(in_radar(line), Some(format!("sensors.radar: {expected}")), "{line}");
        }
        assert!(in_radar("sigma = { doppler = 1 }").is_some_and(|m| m.contains("range_rate")));
        assert_eq!(told("[sensors.sonar]"), Some((None, "sensors: unknown sensor \"sonar\"; known: radar".into())));
    }

    #[test]
    fn what_the_parser_finds_has_its_line() {
        let at = |text: &str, line: u64, words: [&str; 2]| {
            let told = parsed(text).err();
            let fits = told.as_ref().is_some_and(|(at, m)| *at == Some(line) && words.iter().all(|word| m.contains(word)));
            assert!(fits, "{text}: {told:?}");
        };
        at("[sensors.radar]\ngain = 3\n", 2, ["gain", "unknown field"]);
        at("[sensors.radar]\np_detect = \n", 2, ["p_detect", ""]);
        at("[sensors.radar]\np_detect = \"high\"\n", 2, ["p_detect", "f64"]);
        at("[tracker]\n\nstates = \"cv-2d\"\n", 3, ["states", "unknown field"]);
        at("[tracker]\nstate = \"cv-4d\"\n", 2, ["cv-4d", "cv-3d"]);
        at("[[tracker.modes]]\nmodel = \"turn\"\nrate_deg = 3\n", 3, ["rate_deg", "turn_rate"]);
        at("[tracker.gate]\nprobability = true\n", 2, ["probability", "f64"]);
        at("[tracker.life]\nhits = 3.5\n", 2, ["hits", "3.5"]);
        at("[tracker]\nmodes = 3\n", 2, ["modes", "sequence"]);
        at("[tracked]\n", 1, ["tracked", "unknown field"]);
    }
}
