//! A recorded sensor as the library sees it: model, range limits, clutter and gate put together at run time.
//!
//! ```text
//! P_D(x)  = p_detect where min_range <= |p - o| <= max_range, else 0      o the sensor's place in this scan
//! x,y[,z] -> Position, a part of range, azimuth, elevation, range_rate -> Radar, in that order of components
//! R       = diag(σ²); a plot that brings standard deviations of its own has those in their places
//! ```

use super::config::{GateConfig, SensorConfig};
use super::recording::{Component, Components, Plot, Recording};
use crate::Failure;
use boresight::association::Gate;
use boresight::error::ConfigError;
use boresight::model::position::Position;
use boresight::model::radar::{self, Mount, Radar};
use boresight::model::resolution::Resolution;
use boresight::model::{Layout, MeasurementModel};
use boresight::scalar::Real;
use boresight::scan::Detection;
use boresight::sensor::{Clutter, Sensor};
use boresight::symmetric::Symmetric;
use nalgebra::SVector;

/// Usual density of false detections of a sensor that reports x and y \[1/m²\].
const USUAL_DENSITY: f64 = 4e-6;

/// What is known of a recorded sensor before the first scan.
#[derive(Debug, Clone)]
pub(super) struct Instrument {
    /// Its name.
    pub name: String,
    /// What it measures, in the order of the measurement vector.
    pub components: Vec<Component>,
    /// Whether its detections start tracks.
    pub initiates: bool,
    position: [f64; 3],
    sigma: Components,
    p_detect: f64,
    clutter_density: Option<f64>,
    range: [f64; 2],
    gate: GateConfig,
    cells: Option<Components>,
}

impl Instrument {
    /// The sensor `name` of `recording` for tracks in `axes` dimensions.
    pub fn new(name: &str, recording: &Recording, config: &SensorConfig, gate: GateConfig, axes: usize) -> Result<Self, Failure> {
        let mut components = recording.components(name)?;
        if components.is_empty() {
            components = vec![Component::X, Component::Y, Component::Z];
        }
        if components.contains(&Component::X) {
            if axes == 3 && !components.contains(&Component::Z) {
                return Err(Failure::input("measures no z, which the state \"cv-3d\" wants").within(format!("sensor {name}")));
            }
            components.truncate(axes);
        }
        let clutter_density = config.clutter_density.or((components == [Component::X, Component::Y]).then_some(USUAL_DENSITY));
        let max_range = config.max_range.or_else(|| recording.farthest(name)).unwrap_or(f64::INFINITY);
        Ok(Self {
            name: name.to_owned(),
            components,
            initiates: config.initiates,
            position: config.position,
            sigma: config.sigma(name),
            p_detect: config.p_detect,
            clutter_density,
            range: [config.min_range, max_range],
            gate,
            cells: config.cells(),
        })
    }

    /// Its place in a scan \[m\].
    pub fn origin(&self, own: Option<[f64; 3]>) -> [f64; 3] {
        own.unwrap_or(self.position)
    }

    /// As a position sensor at `origin`.
    pub fn position_sensor<T: Real, const AXES: usize, const STRIDE: usize>(
        &self,
        origin: [f64; 3],
    ) -> Result<Look<T, Position<T, AXES, STRIDE>, AXES>, Failure> {
        let model = Position::new(self.noise(&Components::default())).map_err(|error| self.refused(error))?;
        self.look::<T, _, AXES>(model.at(SVector::from_fn(|a, _| T::lit(origin[a]))), origin)
    }

    /// As a radar at `origin`.
    pub fn radar<T: Real, const NZ: usize, const AXES: usize, const STRIDE: usize>(
        &self,
        origin: [f64; 3],
    ) -> Result<Look<T, Radar<T, NZ, AXES, STRIDE>, NZ>, Failure> {
        let mut components = [radar::Component::Range; NZ];
        for (to, from) in components.iter_mut().zip(&self.components) {
            *to = match from {
                Component::Azimuth => radar::Component::Azimuth,
                Component::Elevation => radar::Component::Elevation,
                Component::RangeRate => radar::Component::RangeRate,
                Component::Range | Component::X | Component::Y | Component::Z => radar::Component::Range,
            };
        }
        let model = Radar::new(components, self.noise(&Components::default())).map_err(|error| self.refused(error))?;
        self.look::<T, _, NZ>(model.on(Mount::at(origin.map(T::lit))), origin)
    }

    fn look<T: Real, M, const NZ: usize>(&self, model: M, origin: [f64; 3]) -> Result<Look<T, M, NZ>, Failure> {
        let gate = Gate::new::<NZ>(T::lit(self.gate.threshold(NZ))).map_err(|error| self.refused(error))?;
        let square = |range: f64| T::lit(range * range);
        let cell = |cells: &Components, k: usize| self.components.get(k).and_then(|component| cells.get(*component)).unwrap_or(f64::NAN);
        let resolution = self.cells.as_ref().map(|cells| Resolution::new(std::array::from_fn(|k| T::lit(cell(cells, k)))));
        Ok(Look {
            model,
            origin: origin.map(T::lit),
            range_squared: self.range.map(square),
            p_detect: T::lit(self.p_detect),
            clutter: self.clutter_density.map_or(Clutter::Diffuse, |density| Clutter::Poisson(T::lit(density))),
            gate,
            resolution: resolution.transpose().map_err(|error| self.refused(error))?,
        })
    }

    /// A plot as the library's detection.
    pub fn detection<T: Real, const NZ: usize>(&self, plot: &Plot) -> Detection<T, NZ> {
        let value = |k: usize| self.components.get(k).and_then(|c| plot.values.get(*c)).unwrap_or(f64::NAN);
        let detection = Detection::new(std::array::from_fn(|k| T::lit(value(k))));
        let noise = if plot.sigma.is_empty() { None } else { Some(self.noise(&plot.sigma)) };
        Detection { noise, amplitude: plot.amplitude.map(T::lit), ..detection }
    }

    /// R, with the standard deviations in `own` before the sensor's.
    fn noise<T: Real, const NZ: usize>(&self, own: &Components) -> Symmetric<T, NZ> {
        let sigma = |k: usize| self.components.get(k).and_then(|c| own.get(*c).or(self.sigma.get(*c))).unwrap_or(1.0);
        Symmetric::from_fn(|i, j| if i == j { T::lit(sigma(i) * sigma(i)) } else { T::ZERO })
    }

    fn refused(&self, error: ConfigError) -> Failure {
        Failure::input(error).within(format!("sensor {}", self.name))
    }
}

/// A sensor in one scan.
#[derive(Debug, Clone, Copy)]
pub(super) struct Look<T, M, const NZ: usize> {
    model: M,
    origin: [T; 3],
    range_squared: [T; 2],
    p_detect: T,
    clutter: Clutter<T>,
    gate: Gate<T>,
    resolution: Option<Resolution<T, NZ>>,
}

impl<T: Real, M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize> Sensor<T, NX, NZ> for Look<T, M, NZ> {
    type Model = M;

    fn model(&self) -> &M {
        &self.model
    }
    fn p_detect(&self, x: &SVector<T, NX>) -> T {
        let Layout { axes, stride } = M::LAYOUT;
        let mut distance = T::ZERO;
        for (a, origin) in self.origin.iter().enumerate().take(axes) {
            let d = x.get(a * stride).map_or(T::ZERO, |p| *p - *origin);
            distance += d * d;
        }
        let [nearest, farthest] = self.range_squared;
        if distance >= nearest && distance <= farthest { self.p_detect } else { T::ZERO }
    }
    fn clutter(&self, _z: &SVector<T, NZ>) -> Clutter<T> {
        self.clutter
    }
    fn gate(&self) -> &Gate<T> {
        &self.gate
    }
    fn resolution(&self) -> Option<&Resolution<T, NZ>> {
        self.resolution.as_ref()
    }
}

#[cfg(test)]
mod tests {
    use super::super::config::Config;
    use super::super::recording::tests::recording;
    use super::*;

    fn instrument(csv: &str, toml: &str, axes: usize) -> Result<(Instrument, Recording), Failure> {
        let recording = recording(csv)?;
        let config = Config::parse(toml, &recording).map_err(|(_, failure)| failure)?;
        let sensor = Instrument::new("r", &recording, &config.sensor("r"), GateConfig::Probability(0.99), axes)?;
        Ok((sensor, recording))
    }

    #[test]
    fn detection_needs_the_target_in_range() -> Result<(), Failure> {
        let text = "[sensors.r]\nmin_range = 10\np_detect = 0.75\nposition = [100, 0, 0]\n";
        let (sensor, _) = instrument("t_us,sensor,x,y\n0,r,30,40\n", text, 2)?;
        let look = sensor.position_sensor::<f64, 2, 2>(sensor.origin(None))?;
        let p_detect = |x: f64| Sensor::<f64, 4, 2>::p_detect(&look, &SVector::from([x, 0.0, 0.0, 0.0]));
        assert_eq!([50.0, 51.0, 91.0, 100.0, 149.0, 151.0].map(p_detect), [0.75, 0.75, 0.0, 0.0, 0.75, 0.0]);
        assert_eq!(sensor.origin(Some([1.0, 2.0, 3.0])), [1.0, 2.0, 3.0]);
        Ok(())
    }

    #[test]
    fn a_plot_brings_what_it_measured_and_how_well() -> Result<(), Failure> {
        let csv = "t_us,sensor,range_rate,azimuth,range,sigma_azimuth,amplitude\n0,r,-5,0.5,200,0.125,9\n0,r,-5,0.5,200,,\n";
        let (sensor, recording) = instrument(csv, "[sensors.r]\nsigma = { range = 3 }\n", 2)?;
        assert_eq!(sensor.components, [Component::Range, Component::Azimuth, Component::RangeRate]);
        let detections: Vec<Detection<f64, 3>> = recording.scans[0].detections.iter().map(|plot| sensor.detection(plot)).collect();
        assert_eq!(detections[0].z, SVector::from([200.0, 0.5, -5.0]));
        assert_eq!(detections[0].noise, Some(Symmetric::from_diagonal([9.0, 0.015625, 1.0])));
        assert_eq!((detections[0].amplitude, detections[1].amplitude, detections[1].noise), (Some(9.0), None, None));
        let look = sensor.radar::<f64, 3, 2, 2>([0.0; 3])?;
        let fix = MeasurementModel::<f64, 4, 3>::locate(&look.model, &detections[0].z, &sensor.noise(&Components::default()));
        assert!(fix.is_some_and(|fix| (fix.position[0] - 200.0 * 0.5_f64.cos()).abs() < 0.1));
        Ok(())
    }

    #[test]
    fn space_needs_a_height() -> Result<(), Failure> {
        let told = instrument("t_us,sensor,x,y\n0,r,30,40\n", "", 3).err().map(|failure| failure.to_string());
        assert_eq!(told.as_deref(), Some("sensor r: measures no z, which the state \"cv-3d\" wants"));
        let (plane, _) = instrument("t_us,sensor,x,y,z\n0,r,30,40,5\n", "", 2)?;
        assert_eq!(plane.components, [Component::X, Component::Y]);
        Ok(())
    }
}
