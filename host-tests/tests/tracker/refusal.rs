//! Malformed scans are refused and leave every bit of the state as it was, scratch included; scans at the time of the last
//! one are taken in without any motion.

use crate::{Positions, Tracker, TrackerState, positions, tracker, two_points};
use boresight::error::ScanError;
use boresight::initiation::Rule;
use boresight::scalar::Real;
use boresight::scan::{Detection, Scan};
use boresight::symmetric::Symmetric;
use boresight::time::Instant;
use boresight::track::Logic;
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestCaseResult};

const TRACKS: usize = 4;
const DETS: usize = 8;

/// A tracker with tracks, seeds and a history, at three seconds.
/// A tracker, its sensor and its state.
type Started<T> = (Tracker<T, TRACKS, DETS>, Positions<T>, TrackerState<T, TRACKS, DETS>);

fn started<T: Real>() -> Result<Started<T>, TestCaseError> {
    let tracker = tracker(Logic::new(2, 3, 3)?, two_points())?;
    let (sensor, mut state) = (positions(0.9)?, TrackerState::new());
    for k in 0..4u32 {
        let t = 10.0 * f64::from(k);
        let plots = [[1000.0 + t, 2000.0], [-500.0, 30.0 - t], [9000.0 * t, -4000.0]].map(|z| Detection::new(z.map(T::lit)));
        tracker.step(&mut state, &sensor, &Scan::new(Instant::from_millis(1000 * u64::from(k)), &plots))?;
    }
    prop_assert!(state.tracks().count() >= 2);
    Ok((tracker, sensor, state))
}

/// Steps with `bad` among good detections; returns the error, and fails if anything in the state has changed.
fn refused<T: Real>(time: Instant, bad: &[Detection<T, 2>], place: usize) -> Result<Option<ScanError>, TestCaseError> {
    let (tracker, sensor, mut state) = started::<T>()?;
    let before = format!("{state:?}");
    let mut plots = vec![Detection::new([T::lit(1040.0), T::lit(2000.0)]); 3];
    plots.splice(place..place, bad.iter().copied());
    let error = tracker.step(&mut state, &sensor, &Scan::new(time, &plots)).err();
    if error.is_some() {
        prop_assert_eq!(format!("{state:?}"), before);
    }
    Ok(error)
}

const LATER: Instant = Instant::from_millis(4000);

fn numbers_that_are_none<T: Real>(place: usize) -> TestCaseResult {
    let good = Detection::new([T::ONE, T::ONE]);
    let noise = |a: T, b: T, c: T| Symmetric::from_fn(|i, j| [[a, b], [T::ZERO, c]][i][j]);
    for broken in [T::lit(f64::NAN), T::lit(f64::INFINITY), T::lit(f64::NEG_INFINITY)] {
        let not_finite = [
            Detection::new([broken, T::ONE]),
            Detection::new([T::ONE, broken]),
            good.with_amplitude(broken),
            good.with_noise(noise(broken, T::ZERO, T::ONE)),
            good.with_noise(noise(T::ONE, broken, T::ONE)),
            good.with_noise(noise(T::ONE, T::ZERO, broken)),
        ];
        for bad in not_finite {
            prop_assert_eq!(refused(LATER, &[bad], place)?, Some(ScanError::DetectionNotFinite), "{:?}", bad);
        }
    }
    let (o, l, ll) = (T::ZERO, T::ONE, T::lit(2.0));
    for bad in [noise(o, o, o), noise(-l, o, l), noise(l, o, -l), noise(-l, o, -l), noise(l, ll, l), noise(l, l, l)] {
        prop_assert_eq!(refused(LATER, &[good.with_noise(bad)], place)?, Some(ScanError::NoiseNotDefinite), "{:?}", bad);
    }
    prop_assert_eq!(refused(LATER, &[good.with_noise(noise(l, o, l)).with_amplitude(-l)], place)?, None);
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn time_does_not_go_backward(micros in 0..3_000_000u64) {
        prop_assert_eq!(refused::<f32>(Instant::from_micros(micros), &[], 0)?, Some(ScanError::TimeReversed));
        prop_assert_eq!(refused::<f64>(Instant::from_micros(micros), &[], 0)?, Some(ScanError::TimeReversed));
    }

    /// An empty scan at the time of the last one: a second look that saw nothing. Nothing moves.
    #[test]
    fn no_time_moves_nothing(looks in 1..3usize) {
        let (tracker, sensor, mut state) = started::<f32>()?;
        let banks = |state: &TrackerState<f32, TRACKS, DETS>| state.tracks().map(|t| (t.id(), *t.bank())).collect::<Vec<_>>();
        let before = banks(&state);
        let time = state.time().ok_or_else(|| TestCaseError::fail("no time"))?;
        for _ in 0..looks {
            let report = tracker.step(&mut state, &sensor, &Scan::new(time, &[]))?;
            prop_assert_eq!(report.tracks_deleted, 0);
        }
        prop_assert_eq!(banks(&state), before);
        prop_assert!(state.tracks().all(|t| t.misses() >= looks as u32));
    }
}

#[test]
fn broken_detections_are_refused_wherever_they_stand() -> Result<(), TestCaseError> {
    for place in 0..=3 {
        numbers_that_are_none::<f32>(place)?;
        numbers_that_are_none::<f64>(place)?;
    }
    Ok(())
}

/// A sensor that sees the same target twice at one time pairs no seeds (there is no speed without time), but corrects.
#[test]
fn two_scans_at_one_time_are_two_looks() -> Result<(), TestCaseError> {
    let (tracker, sensor, mut state) = started::<f64>()?;
    let time = state.time().ok_or_else(|| TestCaseError::fail("no time"))?;
    let variance = |state: &TrackerState<f64, TRACKS, DETS>| state.estimates().next().and_then(|e| e.state.cov.get(0, 0)).unwrap_or(0.0);
    let before = variance(&state);
    let births =
        tracker.step(&mut state, &sensor, &Scan::new(time, &[Detection::new([1030.0, 2000.0]), Detection::new([5e4, 5e4])]))?.births;
    prop_assert!(variance(&state) < before && births == 0);
    Ok(())
}

/// The refusal does not depend on what the tracker holds: the first scan of all is checked too.
#[test]
fn an_empty_tracker_refuses_as_well() -> Result<(), TestCaseError> {
    let tracker = tracker::<f32, TRACKS, DETS>(Logic::new(1, 1, 1)?, Rule::OnePoint)?;
    let mut state = TrackerState::new();
    let scan = [Detection::new([f32::NAN, 0.0])];
    let got = tracker.step(&mut state, &positions(0.9)?, &Scan::new(Instant::ZERO, &scan));
    prop_assert_eq!(got.err(), Some(ScanError::DetectionNotFinite));
    prop_assert_eq!(state.time(), None);
    Ok(())
}
