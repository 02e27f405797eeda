//! The command `telemetry`: records of a target, as `boresight::telemetry` writes them, in words.
//!
//! ```text
//! 12.000000 s  cost 98211  3 tracks, 14 detections: detections_unclaimed 9, births 1
//!     7  Confirmed      5123.4    310.9      0.0 m     -41.2     12.0      0.0 m/s
//! ```
//!
//! A line for every scan with all counts of its report that are not zero, and one for every track. Where a line has lost bytes, the
//! checksum shows it: reading goes on at the next record that is whole, and what was passed over is told.

use crate::{Failure, output};
use boresight::scan::Report;
use boresight::telemetry::{Brief, Telemetry};
use std::fmt::Write;
use std::path::Path;

/// More tracks than any target tells of.
const TRACKS: usize = 256;

/// Prints the records of `file`.
///
/// # Errors
/// Where it cannot be read or holds none.
pub fn run(file: &Path) -> Result<(), Failure> {
    let bytes = output::read_bytes(file)?;
    output::print(&describe(&bytes).map_err(|failure| failure.in_file(file))?)
}

/// All records of `bytes`, in words.
///
/// # Errors
/// Where there are none.
pub fn describe(bytes: &[u8]) -> Result<String, Failure> {
    let (mut text, mut records, mut passed, mut rest) = (String::new(), 0, 0, bytes);
    while let Some((_, behind)) = rest.split_first() {
        match Telemetry::<TRACKS>::decode(rest) {
            Ok((record, after)) => {
                describe_one(&record, &mut text);
                records += 1;
                rest = after;
            }
            Err(_) => {
                passed += 1;
                rest = behind;
            }
        }
    }
    let _ = writeln!(text, "{records} records, {passed} bytes of none");
    if records == 0 { Err(Failure::input("no record of telemetry")) } else { Ok(text) }
}

fn describe_one(record: &Telemetry<TRACKS>, text: &mut String) {
    let Telemetry { time, cost, report, tracks } = record;
    let counts: Vec<String> = counts(report).into_iter().filter(|(_, n)| *n > 0).map(|(name, n)| format!("{name} {n}")).collect();
    let seconds = time.as_micros() as f64 / 1e6;
    let _ = write!(text, "{seconds:.6} s  cost {cost}  {} tracks, {} detections: {}", tracks.len(), report.detections, counts.join(", "));
    for (name, bound) in [("association_error_bound", report.association_error_bound), ("truncated_mass", report.truncated_mass)] {
        if bound != 0.0 {
            let _ = write!(text, ", {name} {bound:.1e}");
        }
    }
    text.push('\n');
    for Brief { id, status, position: [x, y, z], velocity: [u, v, w] } in tracks {
        let status = format!("{status:?}");
        let _ = writeln!(text, "{:>6}  {status:<9} {x:11.1} {y:11.1} {z:11.1} m {u:9.1} {v:9.1} {w:9.1} m/s", id.number());
    }
}

/// What was given up, and what happened, by the names of the report.
fn counts(report: &Report) -> [(&'static str, u16); 14] {
    [
        ("detections_dropped", report.detections_dropped),
        ("detections_unclaimed", report.detections_unclaimed),
        ("seeds_dropped", report.seeds_dropped),
        ("births", report.births),
        ("births_refused", report.births_refused),
        ("tracks_evicted", report.tracks_evicted),
        ("tracks_confirmed", report.tracks_confirmed),
        ("tracks_deleted", report.tracks_deleted),
        ("duplicates_deleted", report.duplicates_deleted),
        ("numeric_resets", report.numeric_resets),
        ("clusters_bounded", report.clusters_bounded),
        ("clusters_approximated", report.clusters_approximated),
        ("clusters_infeasible", report.clusters_infeasible),
        ("pairs_refused", report.pairs_refused),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use boresight::model::Layout;
    use boresight::scan::Scan;
    use boresight::time::Instant;
    use twin::data::{PERIOD_MILLIS, SCANS};
    use twin::radar::{self, State};

    /// The records that the demo tells of its scans.
    fn records() -> Vec<Vec<u8>> {
        let (tracker, sensor) = (radar::tracker().unwrap(), radar::sensor::<3>().unwrap());
        let mut state = Box::new(State::new());
        let scan = |k: usize| {
            let time = Instant::from_millis(PERIOD_MILLIS * k as u64);
            let plots: Vec<_> = SCANS[k].iter().map(|plot| boresight::scan::Detection::new(*plot)).collect();
            let report = tracker.step(&mut state, &sensor, &Scan::new(time, &plots)).unwrap();
            let record = Telemetry::<{ radar::TRACKS }>::new(time, k as u32, report, Layout { axes: 2, stride: 3 }, state.estimates());
            let mut bytes = vec![0; Telemetry::<{ radar::TRACKS }>::SIZE];
            bytes.truncate(record.encode(&mut bytes).unwrap());
            bytes
        };
        (0..SCANS.len()).map(scan).collect()
    }

    #[test]
    fn what_the_target_tells_is_read_and_what_the_line_loses_is_passed_over() {
        let records = records();
        let whole = describe(&records.concat()).unwrap();
        assert!(whole.ends_with(&format!("{} records, 0 bytes of none\n", SCANS.len())), "{whole}");
        assert!(whole.contains(" Confirmed ") && whole.contains("tracks_confirmed 1") && whole.contains(" cost 59 "), "{whole}");
        // The line begins in the middle of a record, and loses a byte of another.
        let mut cut = records.concat()[10..].to_vec();
        cut.remove(records[0].len() + records[1].len() + 20 - 10);
        let text = describe(&cut).unwrap();
        let passed = records[0].len() - 10 + records[2].len() - 1;
        assert!(text.ends_with(&format!("{} records, {passed} bytes of none\n", SCANS.len() - 2)), "{text}");
        assert!(describe(b"nothing of the kind").is_err());
    }
}
