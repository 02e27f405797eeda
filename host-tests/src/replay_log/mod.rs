//! The command `replay-log`: a log that a target has written, done again on the desk.
//!
//! | file | holds |
//! |---|---|
//! | `desk.rs` | the tracker of the log, made again in single or double precision |
//! | `divergence.rs` | the first difference between what was recorded and what comes out here |
//! | `shadow.rs` | where single precision lost accuracy against double |
//!
//! Single precision must give the same bits: scan by scan, track by track, field by field. A log that is damaged is bad input
//! (exit status 2), one that this library does not reproduce a failed check (1).

pub(crate) mod desk;
mod divergence;
mod shadow;

pub use divergence::Divergence;

use crate::{Failure, output};
use boresight::log::{Header, LogError, Record, VERSION};
use boresight::ready::{ACCELERATING, DETS, MODES, Parameters, TRACKS, TURNING};
use desk::{Accelerates, Desk, Motion, Turns};
use shadow::Shadow;
use std::fmt::Write;
use std::path::Path;

/// Replays the log `file` and prints what it holds.
pub fn run(file: &Path) -> Result<(), Failure> {
    let log = output::read_bytes(file)?;
    let (text, divergence) = replay(&log).map_err(|failure| failure.in_file(file))?;
    output::print(&text)?;
    divergence.map_or(Ok(()), |divergence| Err(Failure::check(divergence).in_file(file)))
}

/// The summary of a log, and where it first differs from what this library makes of its scans.
pub fn replay(log: &[u8]) -> Result<(String, Option<Divergence>), Failure> {
    let (header, records) = Header::decode(log).map_err(|error| Failure::input(error).within("header"))?;
    let follow = match (header.kind, header.shape, header.capacity == [TRACKS as u16, DETS as u16]) {
        (TURNING, [4, 3, 2], true) => follow::<Turns, 4, 2, 2>,
        (TURNING, [4, 3, 3], true) => follow::<Turns, 4, 3, 2>,
        (ACCELERATING, [6, 3, 2], true) => follow::<Accelerates, 6, 2, 3>,
        (ACCELERATING, [6, 3, 3], true) => follow::<Accelerates, 6, 3, 3>,
        _ => return Err(unknown(&header)),
    };
    let dotted = |[major, minor, patch]: [u16; 3]| format!("{major}.{minor}.{patch}");
    let mut text = format!("configuration {:#010x}, written by version {}", header.configuration, dotted(header.version));
    if header.version != VERSION {
        let _ = write!(text, "; this is {}: other bits are no surprise", dotted(VERSION));
    }
    let (summary, divergence) = follow(&header, records)?;
    Ok((format!("{text}\n{summary}"), divergence))
}

/// The numbers of a header.
fn numbers(header: &Header<'_>) -> Result<Parameters, Failure> {
    Ok(Parameters::from_words(&header.numbers().ok_or_else(|| unknown(header))?))
}

fn unknown(header: &Header<'_>) -> Failure {
    let kind = String::from_utf8_lossy(&header.kind);
    Failure::input(format!("configuration \"{kind}\" of shape {:?} and room {:?} is not ready-made", header.shape, header.capacity))
}

/// All records, beside the same tracker in single and in double precision.
fn follow<D: Motion<NX, STRIDE>, const NX: usize, const NZ: usize, const STRIDE: usize>(
    first: &Header<'_>,
    mut bytes: &[u8],
) -> Result<(String, Option<Divergence>), Failure> {
    let wrong = |error| Failure::input(error).within("configuration");
    let parameters = numbers(first)?;
    let mut desk = Desk::<f32, D, NX, NZ, STRIDE>::new(&parameters).map_err(wrong)?;
    let mut wide = Desk::<f64, D, NX, NZ, STRIDE>::new(&parameters).map_err(wrong)?;
    let (mut scans, mut refused, mut detections) = (0u32, 0u32, 0usize);
    let (mut divergence, mut shadow) = (None, Shadow::default());
    while !bytes.is_empty() {
        let place = || format!("record {scans}");
        match Header::decode(bytes) {
            // Other numbers from here on, of the same tracker.
            Ok((header, rest)) => {
                if (header.kind, header.shape, header.capacity) != (first.kind, first.shape, first.capacity) {
                    return Err(Failure::input("a header of another tracker").within(place()));
                }
                let parameters = numbers(&header)?;
                desk.configure(&parameters).map_err(wrong)?;
                wide.configure(&parameters).map_err(wrong)?;
                bytes = rest;
                continue;
            }
            Err(LogError::Magic | LogError::Length) => {}
            Err(error) => return Err(Failure::input(error).within(place())),
        }
        let (record, rest) = Record::<NX, MODES, NZ, TRACKS, DETS>::decode(bytes).map_err(|error| Failure::input(error).within(place()))?;
        if record.number != scans {
            return Err(Failure::input(format!("scan {} where {scans} belongs: records are missing", record.number)).within(place()));
        }
        if record.refused {
            refused += 1;
        } else {
            let outcome = (desk.step(&record), wide.step(&record));
            divergence = divergence.or_else(|| Divergence::of_outcome(&record, outcome.0.err()));
            detections += record.plots.as_slice().len();
            shadow.take(scans, &desk.state, &wide.state);
        }
        divergence = divergence.or_else(|| Divergence::find(&record, &desk.state));
        (bytes, scans) = (rest, scans.saturating_add(1));
    }
    let same = if divergence.is_none() { "replayed to the same bits" } else { "other bits come out here" };
    Ok((format!("{scans} scans, {refused} of them refused, {detections} detections: {same}\n{shadow}"), divergence))
}
