//! Full trackers: what does not fit is counted, and what is kept is what should be.
//!
//! ```text
//! detections  offered = taken in + dropped
//! births      attempted = started + refused           one per unclaimed detection, starting from one point
//! tracks      after = before + started − evicted − deleted − duplicates ≤ TRACKS
//! ```

use crate::{TrackerState, balance, joint_tracker, positions, tracker, two_points};
use boresight::association::Jpda;
use boresight::initiation::Rule;
use boresight::scalar::Real;
use boresight::scan::{Detection, Scan};
use boresight::time::Instant;
use boresight::track::{Existence, Logic, Status};
use boresight::tracker::Tracker;
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestCaseResult};

/// Scans of plots on a coarse grid, so that some fall on tracks; some with an amplitude.
type Scans = Vec<Vec<((i8, i8), Option<f64>)>>;

fn scans() -> impl Strategy<Value = Scans> {
    let plot = ((-3..3i8, -3..3i8), prop::option::of(0.0..10.0f64));
    prop::collection::vec(prop::collection::vec(plot, 0..8), 1..20)
}

fn plots<T: Real>(scan: &[((i8, i8), Option<f64>)]) -> Vec<Detection<T, 2>> {
    let plot = |((x, y), amplitude): &((i8, i8), Option<f64>)| {
        let detection = Detection::new([x, y].map(|v| T::lit(2000.0 * f64::from(*v))));
        amplitude.map_or(detection, |a| detection.with_amplitude(T::lit(a)))
    };
    scan.iter().map(plot).collect()
}

fn accounts<T: Real, K: Tracker<T, 6, 2>>(tracker: &K, [slots, room]: [usize; 2], scans: &Scans, rule: Rule<T>) -> TestCaseResult {
    let (sensor, mut state) = (positions::<T>(0.9)?, K::State::default());
    let alive = |state: &K::State| tracker.tracks(state).count();
    for (k, scan) in scans.iter().enumerate() {
        let before = alive(&state);
        let plots = plots::<T>(scan);
        let report = tracker.step(&mut state, &sensor, &Scan::new(Instant::from_millis(1000 * k as u64), &plots))?;
        prop_assert_eq!(usize::from(report.detections), plots.len().min(room));
        prop_assert_eq!(usize::from(report.detections) + usize::from(report.detections_dropped), plots.len());
        prop_assert!(report.detections_unclaimed <= report.detections);
        prop_assert_eq!(alive(&state) as i64, balance(before, &report));
        prop_assert!(alive(&state) <= slots);
        prop_assert!(report.tracks_evicted <= report.births);
        match rule {
            Rule::Off => prop_assert_eq!(report.births + report.births_refused, 0),
            Rule::OnePoint => prop_assert_eq!(report.births + report.births_refused, report.detections_unclaimed),
            // One birth for every partner, and room for so many of those.
            Rule::TwoPoint { .. } => {
                prop_assert!(usize::from(report.births + report.births_refused) <= usize::from(report.detections_unclaimed) * room);
            }
        }
        let complete = report.detections_dropped + report.seeds_dropped + report.births_refused + report.tracks_evicted == 0;
        let exact = report.clusters_bounded + report.clusters_approximated + report.clusters_infeasible == 0;
        prop_assert_eq!(report.is_complete(), complete && exact && report.numeric_resets == 0);
    }
    Ok(())
}

fn both_trackers<T: Real, const TRACKS: usize, const DETS: usize>(scans: &Scans) -> TestCaseResult {
    let [birth, lifetime, confirm, delete] = [0.1, 10.0, 0.5, 0.05].map(T::lit);
    let existence = Existence { birth, lifetime, confirm, delete };
    for rule in [Rule::Off, Rule::OnePoint, two_points()] {
        for logic in [Logic::new(2, 3, 2)?, Logic::existence(existence)?] {
            accounts(&tracker::<T, TRACKS, DETS>(logic, rule)?, [TRACKS, DETS], scans, rule)?;
            accounts(&joint_tracker::<T, _, TRACKS, DETS>(logic, rule, Jpda::<64>::new())?, [TRACKS, DETS], scans, rule)?;
        }
    }
    Ok(())
}

fn every_capacity<T: Real>(scans: &Scans) -> TestCaseResult {
    both_trackers::<T, 1, 1>(scans)?;
    both_trackers::<T, 1, 5>(scans)?;
    both_trackers::<T, 5, 1>(scans)?;
    both_trackers::<T, 3, 4>(scans)?;
    both_trackers::<T, 16, 8>(scans)
}

/// The numbers of the detections that make tracks in an empty tracker with room for `DETS`, in order of birth.
fn kept<const DETS: usize>(amplitudes: &[Option<f32>]) -> Result<Vec<usize>, TestCaseError> {
    let tracker = tracker::<f32, 16, DETS>(Logic::new(1, 1, 1)?, Rule::OnePoint)?;
    let mut state = TrackerState::new();
    let plot = |(k, a): (usize, &Option<f32>)| Detection { amplitude: *a, ..Detection::new([1e4 * k as f32, 0.0]) };
    let plots: Vec<_> = amplitudes.iter().enumerate().map(plot).collect();
    tracker.step(&mut state, &positions(0.9)?, &Scan::new(Instant::ZERO, &plots))?;
    let mut estimates: Vec<_> = state.estimates().collect();
    estimates.sort_by_key(|e| e.id);
    Ok(estimates.iter().map(|e| (e.state.mean[0] / 1e4).round() as usize).collect())
}

/// The strongest, none being weaker than any, and of equals the first; in order of arrival.
fn strongest(amplitudes: &[Option<f32>], room: usize) -> Vec<usize> {
    let mut numbers: Vec<usize> = (0..amplitudes.len()).collect();
    // `None` is the least of options; the sort is stable.
    numbers.sort_by(|a, b| amplitudes[*b].partial_cmp(&amplitudes[*a]).unwrap_or(std::cmp::Ordering::Equal));
    numbers.truncate(room);
    numbers.sort_unstable();
    numbers
}

proptest! {
    #[test]
    fn everything_is_accounted_for(scans in scans()) {
        every_capacity::<f32>(&scans)?;
        every_capacity::<f64>(&scans)?;
    }

    #[test]
    fn the_strongest_detections_are_kept(amplitudes in prop::collection::vec(-1e3..1e3f32, 0..14), without in 0..14usize) {
        // At most one without an amplitude: all are different.
        let amplitudes: Vec<_> = amplitudes.iter().enumerate().map(|(k, a)| (k != without).then_some(*a)).collect();
        prop_assert_eq!(kept::<1>(&amplitudes)?, strongest(&amplitudes, 1));
        prop_assert_eq!(kept::<4>(&amplitudes)?, strongest(&amplitudes, 4));
        prop_assert_eq!(kept::<14>(&amplitudes)?, strongest(&amplitudes, 14));
    }

    #[test]
    fn of_equally_strong_detections_the_first_are_kept(
        amplitudes in prop::collection::vec(prop::option::of((0..3u8).prop_map(f32::from)), 0..14),
    ) {
        prop_assert_eq!(kept::<4>(&amplitudes)?, strongest(&amplitudes, 4));
    }
}

/// One slot: a tentative track that was seen in every scan keeps it, one that was missed gives way, a confirmed one never.
#[test]
fn births_displace_missed_tentative_tracks_only() -> Result<(), TestCaseError> {
    let (here, there) = (Detection::new([0.0f32, 0.0]), Detection::new([1e5, 0.0]));
    let tracker = tracker::<f32, 1, 2>(Logic::new(3, 8, 8)?, Rule::OnePoint)?;
    let (sensor, mut state) = (positions(0.9)?, TrackerState::new());
    let mut time = 0;
    let mut step = |plots: &[Detection<f32, 2>]| {
        time += 1;
        let report = tracker.step(&mut state, &sensor, &Scan::new(Instant::from_millis(1000 * time), plots));
        let track = state.tracks().next().and_then(|t| Some((t.id()?.number(), t.status())));
        report.map(|r| ((r.births, r.births_refused, r.tracks_evicted), track))
    };
    prop_assert_eq!(step(&[here])?, ((1, 0, 0), Some((1, Status::Tentative))));
    prop_assert_eq!(step(&[here, there])?, ((0, 1, 0), Some((1, Status::Tentative))));
    prop_assert_eq!(step(&[there])?, ((1, 0, 1), Some((2, Status::Tentative))));
    prop_assert_eq!(step(&[there])?, ((0, 0, 0), Some((2, Status::Tentative))));
    prop_assert_eq!(step(&[there])?, ((0, 0, 0), Some((2, Status::Confirmed))));
    prop_assert_eq!(step(&[here])?, ((0, 1, 0), Some((2, Status::Coasting))));
    Ok(())
}

/// Counters stop at their end instead of starting anew.
#[test]
fn counters_saturate() -> Result<(), TestCaseError> {
    let tracker = tracker::<f32, 1, 1>(Logic::new(1, 1, 1)?, Rule::Off)?;
    let plots = vec![Detection::new([0.0f32, 0.0]); 70_000];
    let report = tracker.step(&mut TrackerState::new(), &positions(0.9)?, &Scan::new(Instant::ZERO, &plots))?;
    prop_assert_eq!((report.detections, report.detections_dropped), (1, u16::MAX));
    Ok(())
}
