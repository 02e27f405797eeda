//! The tracker of a log, made again in either precision from the numbers of its header.

use boresight::error::{ConfigError, ScanError};
use boresight::log::Record;
use boresight::mode::ModeSet;
use boresight::plots::Plots;
use boresight::ready::{Accelerating, DETS, MODES, Parameters, Sensor, State, TRACKS, Tracker, Turning};
use boresight::scalar::Real;
use boresight::scan::Detection;
use boresight::symmetric::Symmetric;

/// The kind of targets: which modes, in any precision.
pub trait Motion<const NX: usize, const STRIDE: usize> {
    /// The modes.
    type Modes<T: Real>: ModeSet<T, NX, MODES>;

    /// The tracker of these numbers.
    fn tracker<T: Real>(parameters: &Parameters) -> Result<Tracker<T, Self::Modes<T>, NX>, ConfigError>;
}

/// Targets that turn.
pub struct Turns;
/// Targets that accelerate.
pub struct Accelerates;

impl Motion<4, 2> for Turns {
    type Modes<T: Real> = Turning<T>;

    fn tracker<T: Real>(parameters: &Parameters) -> Result<Tracker<T, Turning<T>, 4>, ConfigError> {
        parameters.turning_tracker()
    }
}

impl Motion<6, 3> for Accelerates {
    type Modes<T: Real> = Accelerating<T>;

    fn tracker<T: Real>(parameters: &Parameters) -> Result<Tracker<T, Accelerating<T>, 6>, ConfigError> {
        parameters.accelerating_tracker()
    }
}

/// Tracker, radar and state.
pub struct Desk<T: Real, D: Motion<NX, STRIDE>, const NX: usize, const NZ: usize, const STRIDE: usize> {
    tracker: Tracker<T, D::Modes<T>, NX>,
    sensor: Sensor<T, NZ, STRIDE>,
    /// What the tracker remembers
    pub state: Box<State<T, NX>>,
}

impl<T: Real, D: Motion<NX, STRIDE>, const NX: usize, const NZ: usize, const STRIDE: usize> Desk<T, D, NX, NZ, STRIDE> {
    /// Without tracks.
    pub fn new(parameters: &Parameters) -> Result<Self, ConfigError> {
        Ok(Self { tracker: D::tracker(parameters)?, sensor: parameters.sensor()?, state: Box::default() })
    }

    /// Other numbers from now on.
    pub fn configure(&mut self, parameters: &Parameters) -> Result<(), ConfigError> {
        (self.tracker, self.sensor) = (D::tracker(parameters)?, parameters.sensor()?);
        Ok(())
    }

    /// Takes in the scan of `record`.
    pub fn step(&mut self, record: &Record<NX, MODES, NZ, TRACKS, DETS>) -> Result<(), ScanError> {
        let mut plots = Plots::<T, NZ, DETS>::new();
        record.plots.as_slice().iter().for_each(|detection| plots.push(widened(detection)));
        self.tracker.step(&mut self.state, &self.sensor, &plots.scan(record.time)).map(|_| ())
    }
}

fn widened<T: Real, const NZ: usize>(detection: &Detection<f32, NZ>) -> Detection<T, NZ> {
    let wide = |x: f32| T::lit(x.into());
    let mut plot = Detection::new(core::array::from_fn(|k| wide(detection.z[k]))).with_offset(detection.offset);
    if let Some(noise) = &detection.noise {
        plot = plot.with_noise(Symmetric::from_fn(|i, j| wide(noise.upper()[i][j])));
    }
    detection.amplitude.map_or(plot, |amplitude| plot.with_amplitude(wide(amplitude)))
}
