//! A tracker, its radar, its state and the plots of one scan, behind one interface for all configurations: all of it safe.

use crate::types::{self, BORESIGHT_AMPLITUDE, BORESIGHT_SIGMA, Density, Trust};
use boresight::error::{ConfigError, ScanError};
use boresight::log::{LogError, Recorder};
use boresight::model::MeasurementModel;
use boresight::plots::Plots;
use boresight::ready::Parameters;
use boresight::scan::{Detection, Report};
use boresight::sensor::Sensor;
use boresight::symmetric::Symmetric;
use boresight::time::{Duration, Instant};
use boresight::track::{Status, Track};
use boresight::tracker::Tracker;

/// A configuration for C: which tracker, which sensor, and how both are made from the numbers that C gives.
pub trait Configuration<const NX: usize, const MODES: usize, const NZ: usize> {
    /// The tracker.
    type Tracker: Tracker<f32, NX, MODES>;
    /// The sensor.
    type Sensor: Sensor<f32, NX, NZ>;
    /// How a log names it. The desk can replay those of [`boresight::ready`].
    const LOG: [u8; 4];

    /// The numbers to start from.
    fn defaults() -> Parameters;

    /// Both, of these numbers.
    ///
    /// # Errors
    /// Where the numbers make none.
    fn build(parameters: &Parameters) -> Result<(Self::Tracker, Self::Sensor), ConfigError>;
}

/// What C can do with a tracker of any configuration.
pub trait Tracking {
    /// Other numbers from now on; the tracks stay.
    ///
    /// # Errors
    /// Where the numbers make no tracker; it stays as it was.
    fn configure(&mut self, parameters: &Parameters) -> Result<(), ConfigError>;

    /// Takes in one scan.
    ///
    /// # Errors
    /// Where the scan is refused; the state stays as it was.
    fn step(&mut self, time_us: u64, detections: &[types::Detection]) -> Result<types::Report, ScanError>;

    /// Writes the record of the last scan to `out` and returns its length, once.
    ///
    /// # Errors
    /// Where there is no scan without a record, or no room.
    fn record(&mut self, out: &mut [u8]) -> Result<usize, types::Status>;

    /// Hands every live track to `to`.
    fn tracks(&self, to: &mut dyn FnMut(types::Track));

    /// All that is known of the track `id`, if it lives.
    fn density(&self, id: u32) -> Option<Density>;
}

/// What the tracker of a configuration remembers.
pub(crate) type State<C, const NX: usize, const MODES: usize, const NZ: usize> =
    <<C as Configuration<NX, MODES, NZ>>::Tracker as Tracker<f32, NX, MODES>>::State;

/// One tracker with all of its memory.
pub(crate) struct Instance<C, const NX: usize, const MODES: usize, const NZ: usize, const TRACKS: usize, const DETS: usize>
where
    C: Configuration<NX, MODES, NZ>,
{
    pub tracker: C::Tracker,
    pub sensor: C::Sensor,
    pub state: State<C, NX, MODES, NZ>,
    pub plots: Plots<f32, NZ, DETS>,
    pub log: Recorder<NX, MODES, NZ, TRACKS, DETS>,
    /// The last scan, while it has no record
    pub last: Option<(Instant, Result<Report, ScanError>)>,
}

/// What a log begins with: see [`Recorder::header`].
pub(crate) fn header<C, const NX: usize, const MODES: usize, const NZ: usize, const TRACKS: usize, const DETS: usize>(
    parameters: &Parameters,
    out: &mut [u8],
) -> Result<usize, LogError>
where
    C: Configuration<NX, MODES, NZ>,
{
    Recorder::<NX, MODES, NZ, TRACKS, DETS>::new().header(C::LOG, &parameters.words(), out)
}

impl<C, const NX: usize, const MODES: usize, const NZ: usize, const TRACKS: usize, const DETS: usize> Tracking
    for Instance<C, NX, MODES, NZ, TRACKS, DETS>
where
    C: Configuration<NX, MODES, NZ>,
{
    fn configure(&mut self, parameters: &Parameters) -> Result<(), ConfigError> {
        (self.tracker, self.sensor) = C::build(parameters)?;
        Ok(())
    }

    fn step(&mut self, time_us: u64, detections: &[types::Detection]) -> Result<types::Report, ScanError> {
        let Self { tracker, sensor, state, plots, log, last } = self;
        if last.is_some() {
            log.skip();
        }
        plots.clear();
        detections.iter().for_each(|detection| plots.push(plot(detection)));
        let time = Instant::from_micros(time_us);
        let outcome = tracker.step(state, sensor, &plots.scan(time)).map(|report| plots.counted(report));
        *last = Some((time, outcome));
        Ok(outcome?.into())
    }

    fn record(&mut self, out: &mut [u8]) -> Result<usize, types::Status> {
        let Self { tracker, state, plots, log, last, .. } = self;
        let (time, outcome) = last.as_ref().ok_or(types::Status::NoScan)?;
        let length = log.record(&plots.scan(*time), outcome, tracker, state, out)?;
        *last = None;
        Ok(length)
    }

    fn tracks(&self, to: &mut dyn FnMut(types::Track)) {
        self.tracker.tracks(&self.state).filter_map(summary::<<C::Sensor as Sensor<f32, NX, NZ>>::Model, NX, MODES, NZ>).for_each(to);
    }

    fn density(&self, id: u32) -> Option<Density> {
        let track = self.tracker.tracks(&self.state).find(|track| track.id().is_some_and(|own| own.number() == id))?;
        let g = track.bank().combined();
        let upper = g.cov.upper().iter().enumerate().flat_map(|(i, row)| row.iter().skip(i));
        Some(Density {
            states: NX as u32,
            modes: MODES as u32,
            mean: filled(g.mean.iter()),
            covariance: filled(upper),
            mode_probability: filled(track.bank().prob.iter()),
        })
    }
}

/// The first of `N` numbers, the others zero.
fn filled<'a, const N: usize>(mut numbers: impl Iterator<Item = &'a f32>) -> [f32; N] {
    core::array::from_fn(|_| numbers.next().copied().unwrap_or_default())
}

fn plot<const NZ: usize>(detection: &types::Detection) -> Detection<f32, NZ> {
    let types::Detection { z, sigma, amplitude, offset_us, given } = detection;
    let mut plot = Detection::new(filled(z.iter())).with_offset(Duration::from_micros((*offset_us).into()));
    if given & BORESIGHT_SIGMA != 0 {
        plot = plot.with_noise(Symmetric::from_diagonal(filled::<NZ>(sigma.iter()).map(|sigma| sigma * sigma)));
    }
    if given & BORESIGHT_AMPLITUDE != 0 {
        plot = plot.with_amplitude(*amplitude);
    }
    plot
}

/// A track by its position and velocity, which stand where the model of the sensor says.
fn summary<M: MeasurementModel<f32, NX, NZ>, const NX: usize, const MODES: usize, const NZ: usize>(
    track: &Track<f32, NX, MODES>,
) -> Option<types::Track> {
    let (estimate, layout) = (track.estimate()?, M::LAYOUT);
    let trust = match estimate.status {
        Status::Tentative => Trust::Tentative,
        Status::Confirmed => Trust::Confirmed,
        Status::Coasting => Trust::Coasting,
    };
    let place = |axis: usize| (axis < layout.axes).then_some(axis * layout.stride);
    let state = |k: Option<usize>| k.and_then(|k| estimate.state.mean.get(k).copied()).unwrap_or_default();
    let entry = |a: usize, b: usize| estimate.state.cov.get(place(a)?, place(b)?);
    let pairs = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
    Some(types::Track {
        id: estimate.id.number(),
        trust,
        existence: estimate.existence,
        position: [0, 1, 2].map(|axis| state(place(axis))),
        velocity: [0, 1, 2].map(|axis| state(place(axis).map(|k| k + 1))),
        covariance: pairs.map(|(a, b)| entry(a, b).unwrap_or_default()),
    })
}
