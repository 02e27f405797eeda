//! The life of a track against its rules written out, the identities it is given, duplicates and cues.

use crate::{SIGMA, Tracker, TrackerState, alive, balance, positions, tracker};
use boresight::association::Gate;
use boresight::error::ConfigError;
use boresight::gaussian::Gaussian;
use boresight::initiation::Rule;
use boresight::model::position::Position;
use boresight::scalar::Real;
use boresight::scan::{Detection, Scan};
use boresight::sensor::{Clutter, Sensor};
use boresight::symmetric::Symmetric;
use boresight::time::Instant;
use boresight::track::{Logic, Status, TrackId};
use nalgebra::SVector;
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestCaseResult};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn seconds(k: usize) -> Instant {
    Instant::from_millis(1000 * k as u64)
}

/// What the rules make of a track whose scans so far, the birth first, saw it or not.
fn rules(seen: &[bool], confirmed: bool, [hits, window, misses]: [usize; 3]) -> Option<Status> {
    let recent = &seen[seen.len().saturating_sub(window)..];
    let count = recent.iter().filter(|seen| **seen).count();
    let in_a_row = seen.iter().rev().take_while(|seen| !**seen).count();
    let confirmed = confirmed || count >= hits;
    // M of N can no more be reached, or are lost, when more than N − M of the window are misses.
    let hopeless = !confirmed && recent.len() - count > window - hits;
    match (hopeless || in_a_row >= misses, confirmed, in_a_row) {
        (true, ..) => None,
        (false, false, _) => Some(Status::Tentative),
        (false, true, 0) => Some(Status::Confirmed),
        (false, true, _) => Some(Status::Coasting),
    }
}

/// A target at rest that is seen or not, by a pattern.
fn life<T: Real>(pattern: &[bool], [hits, window, misses]: [usize; 3]) -> TestCaseResult {
    let logic = Logic::new(hits as u8, window as u8, misses as u8)?;
    let tracker = tracker::<T, 1, 1>(logic, Rule::OnePoint)?;
    let (sensor, mut state) = (positions::<T>(0.9)?, TrackerState::new());
    let plot = [Detection::new([T::lit(500.0), T::lit(-300.0)])];
    let (mut seen, mut confirmed) = (vec![], false);
    for (k, hit) in [&true].into_iter().chain(pattern).enumerate() {
        let before = alive(&state);
        let report = tracker.step(&mut state, &sensor, &Scan::new(seconds(k), if *hit { &plot } else { &[] }))?;
        seen.push(*hit);
        let want = rules(&seen, confirmed, [hits, window, misses]);
        let got = state.tracks().next().map(|t| t.status());
        prop_assert_eq!(got, want, "after {:?}", seen);
        prop_assert_eq!(alive(&state) as i64, balance(before, &report));
        let confirmed_now = !confirmed && want.is_some_and(|status| status != Status::Tentative);
        prop_assert_eq!(report.tracks_confirmed, u16::from(confirmed_now));
        confirmed |= confirmed_now;
        if want.is_none() {
            return Ok(());
        }
    }
    Ok(())
}

fn windows() -> impl Strategy<Value = [usize; 3]> {
    (1..=32usize).prop_flat_map(|window| (1..=window, 1..=8usize).prop_map(move |(hits, misses)| [hits, window, misses]))
}

proptest! {
    #[test]
    fn tracks_live_by_the_rules(pattern in prop::collection::vec(prop::bool::weighted(0.8), 40), logic in windows()) {
        life::<f32>(&pattern, logic)?;
        life::<f64>(&pattern, logic)?;
    }
}

/// Thousands of births among random detections: identities count up without gaps, and none comes back.
fn identities_are_given_once<T: Real>() -> TestCaseResult {
    let tracker = tracker::<T, 8, 8>(Logic::new(2, 2, 1)?, Rule::OnePoint)?;
    let (sensor, mut state) = (positions::<T>(0.9)?, TrackerState::new());
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut last = 0;
    let mut living: Vec<TrackId> = vec![];
    for k in 0..2000 {
        let plots: Vec<_> =
            (0..rng.random_range(0..12)).map(|_| Detection::new([0; 2].map(|_| T::lit(rng.random_range(-1e5..1e5))))).collect();
        let before = alive(&state);
        let report = tracker.step(&mut state, &sensor, &Scan::new(seconds(k), &plots))?;
        let ids: Vec<_> = state.tracks().filter_map(|t| t.id()).collect();
        let mut born: Vec<_> = ids.iter().filter(|id| !living.contains(id)).map(|id| id.number()).collect();
        born.sort_unstable();
        // A birth may fall to its own first judgement, never to another birth of the scan.
        prop_assert_eq!(born, (last + 1..=last + u32::from(report.births)).collect::<Vec<_>>());
        prop_assert_eq!(ids.len() as i64, balance(before, &report));
        last += u32::from(report.births);
        living = ids;
    }
    prop_assert!(last > 5000, "{last} births");
    Ok(())
}

#[test]
fn no_identity_is_given_twice() -> Result<(), TestCaseError> {
    identities_are_given_once::<f32>()?;
    identities_are_given_once::<f64>()
}

/// A density at (x, y) with velocity (vx, 0) and the variances of a settled track.
fn settled<T: Real>(x: f64, vx: f64, y: f64) -> Gaussian<T, 6> {
    let variance = [SIGMA * SIGMA, 25.0, 1.0].map(T::lit);
    let mean = [x, vx, 0.0, y, 0.0, 0.0].map(T::lit);
    Gaussian::new(SVector::from(mean), Symmetric::from_diagonal([0, 1, 2, 0, 1, 2].map(|i| variance[i])))
}

fn cue<T: Real, const TRACKS: usize, const DETS: usize>(
    tracker: &Tracker<T, TRACKS, DETS>,
    state: &mut TrackerState<T, TRACKS, DETS>,
    g: Gaussian<T, 6>,
) -> Result<TrackId, TestCaseError> {
    tracker.start(state, g, seconds(0)).ok_or_else(|| TestCaseError::fail("not started"))
}

/// Of tracks on one target the elder survives, and the confirmed before the elder; tracks that differ in position or
/// velocity are left alone.
fn duplicates_go<T: Real>() -> TestCaseResult {
    let logic = Logic::new(2, 3, 3)?.with_duplicate_distance(T::lit(0.5))?;
    let tracker = tracker::<T, 6, 8>(logic, Rule::Off)?;
    let mut state = TrackerState::new();
    let elder = cue(&tracker, &mut state, settled(0.0, 50.0, 0.0))?;
    // The same but for a part of a standard deviation, twice; elsewhere; and as fast the other way.
    let copies = [(3.0, 50.5, -3.0), (-2.0, 49.0, 1.0)].map(|(x, vx, y)| cue(&tracker, &mut state, settled(x, vx, y)));
    let others = [(0.0, 50.0, 300.0), (0.0, -50.0, 0.0)].map(|(x, vx, y)| cue(&tracker, &mut state, settled(x, vx, y)));
    let report = tracker.step(&mut state, &positions(0.9)?, &Scan::new(seconds(1), &[]))?;
    prop_assert_eq!((report.duplicates_deleted, alive(&state)), (2, 3));
    prop_assert!(state.track(elder).is_some());
    for (id, lives) in copies.into_iter().map(|id| (id, false)).chain(others.map(|id| (id, true))) {
        prop_assert_eq!(state.track(id?).is_some(), lives);
    }
    Ok(())
}

#[test]
fn duplicates_are_deleted() -> Result<(), TestCaseError> {
    duplicates_go::<f32>()?;
    duplicates_go::<f64>()
}

#[test]
fn a_confirmed_duplicate_outlives_an_older_tentative_one() -> Result<(), TestCaseError> {
    let logic = Logic::new(3, 3, 3)?.with_duplicate_distance(5.0)?;
    let tracker = tracker::<f32, 2, 2>(logic, Rule::OnePoint)?;
    let (sensor, mut state) = (positions(0.9)?, TrackerState::new());
    tracker.step(&mut state, &sensor, &Scan::new(seconds(0), &[Detection::new([0.0, 0.0])]))?;
    let cued = cue(&tracker, &mut state, settled(1.0, 0.0, 0.0))?;
    let report = tracker.step(&mut state, &sensor, &Scan::new(seconds(1), &[Detection::new([0.5, 0.0])]))?;
    prop_assert_eq!((report.duplicates_deleted, state.tracks().next().and_then(|t| t.id())), (1, Some(cued)));
    Ok(())
}

#[test]
fn tracks_without_detections_coast_and_go_when_too_uncertain() -> Result<(), TestCaseError> {
    let limit = 200.0;
    let tracker = tracker::<f64, 1, 1>(Logic::new(1, 1, 30)?.with_position_limit(limit)?, Rule::Off)?;
    let (sensor, mut state) = (positions(0.9)?, TrackerState::new());
    cue(&tracker, &mut state, settled(0.0, 0.0, 0.0))?;
    for k in 1..30 {
        let report = tracker.step(&mut state, &sensor, &Scan::new(seconds(k), &[]))?;
        let Some(track) = state.tracks().next() else {
            // Sixty seconds of 5 m/s would do it without any manoeuvre.
            prop_assert!(report.tracks_deleted == 1 && k > 1);
            return Ok(());
        };
        prop_assert_eq!(track.status(), Status::Coasting);
        let likely = &track.bank().modes[track.bank().most_probable()].cov;
        prop_assert!(likely.get(0, 0).is_some_and(|v| v <= limit * limit));
    }
    Err(TestCaseError::fail("a track coasted for half a minute of manoeuvre noise"))
}

/// Positions of the half plane x < 0 only.
struct LeftHalf(Position<f64, 2, 3>, Gate<f64>);

impl Sensor<f64, 6, 2> for LeftHalf {
    type Model = Position<f64, 2, 3>;

    fn model(&self) -> &Self::Model {
        &self.0
    }
    fn p_detect(&self, x: &SVector<f64, 6>) -> f64 {
        if x[0] < 0.0 { 0.9 } else { 0.0 }
    }
    fn clutter(&self, _z: &SVector<f64, 2>) -> Clutter<f64> {
        Clutter::Diffuse
    }
    fn gate(&self) -> &Gate<f64> {
        &self.1
    }
}

#[test]
fn a_sensor_that_does_not_look_counts_no_misses() -> Result<(), TestCaseError> {
    let tracker = tracker::<f64, 2, 1>(Logic::new(1, 1, 3)?, Rule::Off)?;
    let sensor = LeftHalf(Position::new(Symmetric::from_diagonal([400.0; 2]))?, Gate::new::<2>(16.0)?);
    let mut state = TrackerState::new();
    let seen = cue(&tracker, &mut state, settled(-1e4, 0.0, 0.0))?;
    let hidden = cue(&tracker, &mut state, settled(1e4, 0.0, 0.0))?;
    for k in 1..=10 {
        tracker.step(&mut state, &sensor, &Scan::new(seconds(k), &[]))?;
        prop_assert_eq!(state.track(seen).map(|t| t.misses()), (k < 3).then_some(k as u32));
        prop_assert_eq!(state.track(hidden).map(|t| (t.misses(), t.status())), Some((0, Status::Confirmed)));
    }
    Ok(())
}

#[test]
fn a_cue_is_a_confirmed_track_whatever_the_window() -> Result<(), TestCaseError> {
    for window in 1..=32 {
        let tracker = tracker::<f32, 1, 1>(Logic::new(window, window, 1)?, Rule::Off)?;
        let mut state = TrackerState::new();
        let id = cue(&tracker, &mut state, settled(0.0, 0.0, 0.0))?;
        prop_assert_eq!(state.track(id).map(|t| t.status()), Some(Status::Confirmed), "M = N = {}", window);
    }
    Ok(())
}

#[test]
fn cues_are_refused_when_there_is_no_room_or_no_sense() -> Result<(), TestCaseError> {
    let tracker = tracker::<f32, 1, 1>(Logic::unmanaged(), Rule::Off)?;
    let mut state = TrackerState::new();
    for broken in [f64::NAN, f64::INFINITY] {
        prop_assert_eq!(tracker.start(&mut state, settled(broken, 0.0, 0.0), seconds(0)), None);
    }
    let id = cue(&tracker, &mut state, settled(0.0, 0.0, 0.0))?;
    prop_assert_eq!(id.number(), 1);
    prop_assert_eq!(tracker.start(&mut state, settled(0.0, 0.0, 0.0), seconds(0)), None);
    // At the time of the last scan only: the tracks of a state are all at one time.
    prop_assert!(state.remove(id) && !state.remove(id) && alive(&state) == 0);
    for time in [Instant::from_micros(1), seconds(1)] {
        prop_assert_eq!(tracker.start(&mut state, settled(0.0, 0.0, 0.0), time), None);
    }
    prop_assert_eq!(cue(&tracker, &mut state, settled(0.0, 0.0, 0.0))?.number(), 2);
    Ok(())
}

#[test]
fn impossible_rules_are_refused() {
    for (hits, window, misses) in [(0, 1, 1), (2, 1, 1), (1, 33, 1), (1, 1, 0), (1, 1, 33)] {
        assert_eq!(Logic::<f32>::new(hits, window, misses).err(), Some(ConfigError::BadWindow));
    }
    assert_eq!(Logic::<f32>::unmanaged().with_position_limit(0.0).err(), Some(ConfigError::NotPositive));
    assert_eq!(Logic::<f32>::unmanaged().with_duplicate_distance(f32::NAN).err(), Some(ConfigError::NotFinite));
}
