//! [`Recording`]: recorded plots in memory, whatever file they came from.
//!
//! Scans in order of time; a scan is one look of one sensor, with all its detections (perhaps none). A
//! detection has some of the components below, never Cartesian and polar ones together:
//!
//! | component | meaning | unit |
//! |---|---|---|
//! | `x`, `y`, `z` | position relative to the sensor, axes of the local frame (not turned with the carrier) | m |
//! | `range` | distance, >= 0 | m |
//! | `azimuth` | atan2(y, x) | rad |
//! | `elevation` | atan2(z, hypot(x, y)) | rad |
//! | `range_rate` | d range / dt, positive when opening | m/s |
//!
//! `own` is the position of a moving sensor in the frame of the truth: own + detection is a position in
//! that frame. Planar data have z = 0. Time is in integer microseconds.

use super::{csv, json};
use crate::{Failure, output};
use std::path::Path;

/// A component of a detection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Component {
    /// East or north, as the file has it \[m\].
    X,
    /// The other horizontal axis \[m\].
    Y,
    /// Up \[m\].
    Z,
    /// Distance \[m\].
    Range,
    /// atan2(y, x) \[rad\].
    Azimuth,
    /// atan2(z, hypot(x, y)) \[rad\].
    Elevation,
    /// d range / dt \[m/s\].
    RangeRate,
}

impl Component {
    /// All of them, Cartesian ones first.
    pub const ALL: [Self; 7] = [Self::X, Self::Y, Self::Z, Self::Range, Self::Azimuth, Self::Elevation, Self::RangeRate];

    /// The name in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::Range => "range",
            Self::Azimuth => "azimuth",
            Self::Elevation => "elevation",
            Self::RangeRate => "range_rate",
        }
    }

    /// The component of that name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|component| component.name() == name)
    }

    /// Whether it is x, y or z.
    #[must_use]
    pub fn is_cartesian(self) -> bool {
        matches!(self, Self::X | Self::Y | Self::Z)
    }

    /// Why `value` cannot be one of these, if so. An angle beyond a turn was recorded in degrees.
    #[must_use]
    pub fn objection(self, value: f64) -> Option<&'static str> {
        use std::f64::consts::{FRAC_PI_2, TAU};
        match self {
            _ if !value.is_finite() => Some("not finite"),
            Self::Range if value < 0.0 => Some("negative"),
            Self::Azimuth if value.abs() > TAU => Some("beyond a full turn; radians are wanted"),
            Self::Elevation if value.abs() > FRAC_PI_2 => Some("beyond the vertical; radians are wanted"),
            _ => None,
        }
    }
}

/// A value for some of the components.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Components([Option<f64>; Component::ALL.len()]);

impl Components {
    /// The value of a component, if there is one.
    #[must_use]
    pub fn get(&self, component: Component) -> Option<f64> {
        self.0[component as usize]
    }

    /// Sets the value of a component.
    pub fn set(&mut self, component: Component, value: f64) {
        self.0[component as usize] = Some(value);
    }

    /// The components that have a value, with it.
    pub fn iter(&self) -> impl Iterator<Item = (Component, f64)> {
        Component::ALL.into_iter().filter_map(|component| Some((component, self.get(component)?)))
    }

    /// Whether no component has a value.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.iter().next().is_none()
    }
}

/// One detection.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Plot {
    /// What was measured.
    pub values: Components,
    /// Standard deviations, where the file gives them; > 0.
    pub sigma: Components,
    /// Strength in whatever unit the sensor has.
    pub amplitude: Option<f64>,
}

impl Plot {
    /// The position relative to the sensor \[m\], if the components determine one in the plane:
    /// x and y, or range and azimuth (with elevation 0 unless given).
    #[must_use]
    pub fn relative_position(&self) -> Option<[f64; 3]> {
        use Component::{Azimuth, Elevation, Range, X, Y, Z};
        let get = |component| self.values.get(component);
        if let (Some(x), Some(y)) = (get(X), get(Y)) {
            return Some([x, y, get(Z).unwrap_or(0.0)]);
        }
        let (range, azimuth) = (get(Range)?, get(Azimuth)?);
        let (up, flat) = get(Elevation).unwrap_or(0.0).sin_cos();
        let (sin, cos) = azimuth.sin_cos();
        Some([range * flat * cos, range * flat * sin, range * up])
    }
}

/// Where a target truly was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TruthPoint {
    /// Which target.
    pub id: u64,
    /// Position \[m\].
    pub position: [f64; 3],
}

/// One look of one sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanRecord {
    /// Time \[us\] since the recording's zero.
    pub time_us: u64,
    /// Name of the sensor.
    pub sensor: String,
    /// Position of a moving sensor \[m\].
    pub own: Option<[f64; 3]>,
    /// What it saw, in the order of the file.
    pub detections: Vec<Plot>,
    /// The targets at that time, where known.
    pub truth: Vec<TruthPoint>,
}

/// Which way the axes of a recording point, and so how it is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Frame {
    /// x to the right, y upwards.
    #[default]
    XRight,
    /// x north, y east: north upwards, east to the right.
    NorthEast,
}

/// A recording: scans in order of time, at least one.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// The axes of all positions in it.
    pub frame: Frame,
    /// The scans.
    pub scans: Vec<ScanRecord>,
}

impl Recording {
    /// Reads a file: `.csv` or `.json` by its name, any other by whether it begins like JSON.
    pub fn read(file: &Path) -> Result<Self, Failure> {
        let text = output::read_text(file)?;
        let ending = file.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
        let is_json = match ending.to_ascii_lowercase().as_str() {
            "json" => true,
            "csv" => false,
            _ => text.trim_start().starts_with('{'),
        };
        if is_json { json::parse(file, &text) } else { csv::parse(file, &text) }
    }

    /// The names of the sensors, in order of their first scan.
    #[must_use]
    pub fn sensors(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for scan in &self.scans {
            if !names.contains(&scan.sensor.as_str()) {
                names.push(&scan.sensor);
            }
        }
        names
    }

    /// Whether any scan says where the targets truly were.
    #[must_use]
    pub fn has_truth(&self) -> bool {
        self.scans.iter().any(|scan| !scan.truth.is_empty())
    }

    /// The components that the detections of a sensor have, in the order of [`Component::ALL`]; none without detections.
    ///
    /// # Errors
    /// Where two of its detections measure different components: no one measurement model fits both.
    pub fn components(&self, sensor: &str) -> Result<Vec<Component>, Failure> {
        let of = |plot: &Plot| plot.values.iter().map(|(component, _)| component).collect::<Vec<_>>();
        let mut found: Option<Vec<Component>> = None;
        for scan in self.scans.iter().filter(|scan| scan.sensor == sensor) {
            for plot in &scan.detections {
                let components = of(plot);
                if found.as_ref().is_some_and(|found| *found != components) {
                    let names = |list: &[Component]| list.iter().map(|c| c.name()).collect::<Vec<_>>().join(",");
                    let (before, here) = (names(found.as_deref().unwrap_or_default()), names(&components));
                    let reason = format!("{here} at t = {} us, {before} before; one sensor measures one set", scan.time_us);
                    return Err(Failure::input(reason).within(format!("sensor {sensor}")));
                }
                found = Some(components);
            }
        }
        Ok(found.unwrap_or_default())
    }

    /// The range of the farthest detection of a sensor \[m\]; `None` where a detection tells no range, or there is none.
    #[must_use]
    pub fn farthest(&self, sensor: &str) -> Option<f64> {
        let plots = self.scans.iter().filter(|scan| scan.sensor == sensor).flat_map(|scan| &scan.detections);
        let length = |[x, y, z]: [f64; 3]| x.hypot(y).hypot(z);
        let range = |plot: &Plot| plot.values.get(Component::Range).or_else(|| plot.relative_position().map(length));
        plots.map(range).try_fold(0.0, |most: f64, range| Some(most.max(range?))).filter(|most| *most > 0.0)
    }

    /// The median time between two scans of a sensor \[s\]; `None` for fewer than two.
    #[must_use]
    pub fn median_interval_s(&self, sensor: &str) -> Option<f64> {
        let times: Vec<u64> = self.scans.iter().filter(|scan| scan.sensor == sensor).map(|scan| scan.time_us).collect();
        let mut intervals: Vec<u64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        intervals.sort_unstable();
        intervals.get(intervals.len() / 2).map(|us| *us as f64 * 1e-6)
    }

    /// From the first scan to the last \[s\].
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        match (self.scans.first(), self.scans.last()) {
            (Some(first), Some(last)) => (last.time_us - first.time_us) as f64 * 1e-6,
            _ => 0.0,
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A recording written as CSV.
    pub fn recording(text: &str) -> Result<Recording, Failure> {
        csv::parse(Path::new("p.csv"), text)
    }

    fn plot(values: &[(Component, f64)]) -> Plot {
        let mut plot = Plot::default();
        values.iter().for_each(|&(component, value)| plot.values.set(component, value));
        plot
    }

    #[test]
    fn names_lead_back_to_their_components() {
        for component in Component::ALL {
            assert_eq!(Component::named(component.name()), Some(component));
            assert_eq!(Component::ALL[component as usize], component);
        }
        assert_eq!(Component::named("doppler"), None);
    }

    #[test]
    fn position_from_what_was_measured() {
        use Component::{Azimuth, Elevation, Range, X, Y, Z};
        let cartesian = plot(&[(X, 1.0), (Y, 2.0), (Z, 3.0)]);
        assert_eq!(cartesian.relative_position(), Some([1.0, 2.0, 3.0]));
        let north = std::f64::consts::FRAC_PI_2;
        let polar = plot(&[(Range, 100.0), (Azimuth, north), (Elevation, 0.3)]).relative_position();
        let expected = [0.0, 100.0 * f64::cos(0.3), 100.0 * f64::sin(0.3)];
        let near = |p: [f64; 3]| p.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(polar.is_some_and(near), "{polar:?}");
        assert_eq!(plot(&[(Azimuth, 1.0), (Elevation, 0.1)]).relative_position(), None);
    }

    #[test]
    fn impossible_values_are_objected_to() {
        use Component::{Azimuth, Elevation, Range, RangeRate, X};
        assert_eq!(X.objection(f64::NAN), Some("not finite"));
        assert_eq!(Range.objection(-1.0), Some("negative"));
        assert!(Azimuth.objection(270.0).is_some_and(|reason| reason.contains("radians")));
        assert!(Elevation.objection(1.6).is_some());
        assert_eq!((RangeRate.objection(-300.0), Azimuth.objection(-3.1)), (None, None));
    }

    #[test]
    fn a_recording_tells_reach_and_pace() -> Result<(), Failure> {
        let polar = recording("t_us,sensor,range,azimuth\n0,a,50,0.1\n0,b,,0.3\n1000000,a,70,0.2\n1500000,a,,\n4000000,a,60,0\n")?;
        assert_eq!((polar.farthest("a"), polar.farthest("b"), polar.farthest("c")), (Some(70.0), None, None));
        assert_eq!((polar.median_interval_s("a"), polar.median_interval_s("b")), (Some(1.0), None));
        assert_eq!(recording("t_us,sensor,x,y\n0,a,30,-40\n")?.farthest("a"), Some(50.0));
        Ok(())
    }

    #[test]
    fn a_sensor_measures_one_set_of_components() -> Result<(), Failure> {
        let two = recording("t_us,sensor,range,azimuth\n0,a,50,0.1\n0,b,,0.3\n7,a,50,\n")?;
        assert_eq!(two.components("b")?, [Component::Azimuth]);
        assert_eq!(two.components("c")?, []);
        let told = two.components("a").err().map(|failure| failure.to_string());
        assert_eq!(told.as_deref(), Some("sensor a: range at t = 7 us, range,azimuth before; one sensor measures one set"));
        Ok(())
    }
}
