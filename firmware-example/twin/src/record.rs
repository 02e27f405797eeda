//! The recorded scans once more, now written to a log: what the image `record` sends to the desk.
//!
//! Two scans among them must be refused: one that goes back in time, and one with a plot that is no number.

use crate::{Fault, data};
use boresight::log::{Header, Recorder};
use boresight::ready::{ACCELERATING, DETS, MODES, Parameters, Sensor, State, TRACKS, Tracker, WORDS};
use boresight::scan::{Detection, Scan};
use boresight::time::Instant;

const NX: usize = 6;
const NZ: usize = 2;
type Log = Recorder<NX, MODES, NZ, TRACKS, DETS>;

/// The tracker's memory
pub type Memory = State<f32, NX>;
/// Bytes that the largest part of the log takes
pub const MOST: usize = if Log::MOST > Header::size(WORDS) { Log::MOST } else { Header::size(WORDS) };

/// Tracks all scans and hands the log to `to`, part by part.
///
/// # Errors
/// Where a configuration here is wrong, or `buffer` too short.
pub fn run(state: &mut Memory, buffer: &mut [u8; MOST], mut to: impl FnMut(&[u8])) -> Result<(), Fault> {
    let parameters = Parameters::accelerating();
    let (tracker, sensor): (Tracker<f32, _, NX>, Sensor<f32, NZ, 3>) = (parameters.accelerating_tracker()?, parameters.sensor()?);
    let mut log = Log::new();
    let length = log.header(ACCELERATING, &parameters.words(), buffer)?;
    to(buffer.get(..length).unwrap_or_default());
    let mut offer = |millis: u64, plots: &[[f32; 2]]| {
        let mut detections = [Detection::new([0.0; 2]); DETS];
        detections.iter_mut().zip(plots).for_each(|(slot, plot)| *slot = Detection::new(*plot));
        let scan = Scan::new(Instant::from_millis(millis), detections.get(..plots.len()).unwrap_or(&detections));
        let outcome = tracker.step(state, &sensor, &scan);
        let length = log.record(&scan, &outcome, &tracker, state, buffer)?;
        to(buffer.get(..length).unwrap_or_default());
        Ok::<(), Fault>(())
    };
    for (k, plots) in data::SCANS.iter().enumerate() {
        let now = data::PERIOD_MILLIS * k as u64;
        offer(now, plots)?;
        match k {
            20 => offer(now - 1, plots)?,
            40 => offer(now + 1, &[[f32::NAN, 0.0]])?,
            _ => {}
        }
    }
    Ok(())
}
