//! A rotating radar: two seconds a turn, each detection made when the antenna points there, up to a second before or after
//! the time of its scan.
//!
//! What is known: a scan cut into sectors with a time each, every detection a scan of its own, is the same evidence.

use crate::tracking::{Target, measure, normal, on_target, radar};
use crate::{Tracker, TrackerState, positions, tracker, two_points};
use boresight::error::ScanError;
use boresight::gaussian::Gaussian;
use boresight::initiation::Rule;
use boresight::model::radar::Component::{self, Azimuth, Range, RangeRate};
use boresight::model::radar::Mount;
use boresight::scalar::Real;
use boresight::scan::{Detection, Scan};
use boresight::symmetric::Symmetric;
use boresight::time::{Duration, Instant};
use boresight::track::Logic;
use nalgebra::{SVector, Vector2};
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestCaseResult};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;

/// One turn of the antenna \[ms\].
const TURN: u64 = 2000;

/// When the antenna, at azimuth zero at the time `seconds` of the scan, passes over the target: microseconds from there.
/// None where the target hops over the seam while the antenna does.
fn passes_over(target: &Target, place: impl Fn(f64) -> Vector2<f64>, seconds: f64) -> Option<i64> {
    let pointed = |offset: f64| {
        let d = target.at(seconds + offset) - place(seconds + offset);
        d.y.atan2(d.x) / PI
    };
    let offset = (0..20).fold(0.0, |offset, _| pointed(offset));
    ((pointed(offset) - offset).abs() < 1e-6).then_some((offset * 1e6) as i64)
}

/// Flying past in the west, from −127° over the seam to 127°: seen from 0.7 to 1 second late, or early.
const WEST: Target = Target { start: Vector2::new(-6000.0, -8000.0), velocity: Vector2::new(0.0, 200.0) };
const SCANS: u64 = 36;

/// How the tracker is told of the times.
#[derive(Clone, Copy, PartialEq)]
enum Told {
    /// By the offset of each detection
    Offsets,
    /// By a scan for each detection
    Scans,
    /// Not at all
    Nothing,
}

/// The sum of squared errors of position at the times of the scans, of a track that was there from the beginning.
fn squared_error<T: Real>(target: &Target, scans: std::ops::Range<u64>, told: Told, seed: u64) -> Result<f64, TestCaseError> {
    let tracker: Tracker<T, 1, 1> = tracker(Logic::new(2, 3, 5)?, Rule::Off)?;
    let sensor = radar::<T, 2>([Range, Azimuth], Mount::at([T::ZERO; 3]))?;
    let mut state = TrackerState::new();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (first, v) = (scans.start, target.velocity);
    let begin = target.at(2.0 * first as f64);
    let mean = SVector::from([begin.x, v.x, 0.0, begin.y, v.y, 0.0]).map(T::lit);
    let cov = Symmetric::from_diagonal([400.0, 100.0, 1.0, 400.0, 100.0, 1.0].map(T::lit));
    tracker.start(&mut state, Gaussian::new(mean, cov), Instant::from_millis(first * TURN));
    let mut sum = 0.0;
    for k in scans.skip(1) {
        let (millis, seconds) = (k * TURN, 2.0 * k as f64);
        let Some(offset) = passes_over(target, |_| Vector2::zeros(), seconds) else { continue };
        let late = offset as f64 * 1e-6;
        let plot = measure::<T, 2>([Range, Azimuth], Vector2::zeros(), target, seconds + late, &mut rng);
        let at = millis.saturating_mul(1000).saturating_add_signed(offset);
        let (time, plot, ahead) = match told {
            Told::Offsets => (Instant::from_millis(millis), plot.with_offset(Duration::from_micros(offset)), 0.0),
            Told::Scans => (Instant::from_micros(at), plot, -late),
            Told::Nothing => (Instant::from_millis(millis), plot, 0.0),
        };
        tracker.step(&mut state, &sensor, &Scan::new(time, &[plot]))?;
        let x = state.estimates().next().map(|e| e.state.mean.map(Real::to_f64));
        let x = x.ok_or_else(|| TestCaseError::fail(format!("seed {seed}: lost in scan {k}")))?;
        let estimate = Vector2::new(x[0] + ahead * x[1], x[3] + ahead * x[4]);
        sum += (estimate - target.at(seconds)).norm_squared();
    }
    Ok(sum)
}

/// Offsets are as good as scans of their own, within a twentieth; without either the track lags by what the target flies.
fn as_good_as_scans<T: Real>(scans: std::ops::Range<u64>) -> TestCaseResult {
    let count = 40.0 * (scans.end - scans.start - 1) as f64;
    let rms = |told: Told| -> Result<f64, TestCaseError> {
        let sums: Result<Vec<f64>, _> = (0..40).map(|seed| squared_error::<T>(&WEST, scans.clone(), told, seed)).collect();
        Ok((sums?.iter().sum::<f64>() / count).sqrt())
    };
    let (offsets, own, nothing) = (rms(Told::Offsets)?, rms(Told::Scans)?, rms(Told::Nothing)?);
    prop_assert!(offsets < 1.05 * own, "{offsets} m with offsets, {own} m by scans of their own");
    prop_assert!(nothing > 5.0 * own, "{nothing} m without, {own} m by scans of their own");
    Ok(())
}

#[test]
fn offsets_are_as_good_as_scans_of_their_own() -> Result<(), TestCaseError> {
    // Before the seam, where every detection is early, and behind it, where every one is late.
    for scans in [0..18, 22..SCANS] {
        as_good_as_scans::<f32>(scans.clone())?;
        as_good_as_scans::<f64>(scans)?;
    }
    Ok(())
}

/// A target is found, whatever its velocity, and held over the seam, where it is seen a second early after a second late.
fn found_and_held<T: Real, const NZ: usize>(components: [Component; NZ], rule: Rule<T>, own: Vector2<f64>, seed: u64) -> TestCaseResult {
    let tracker: Tracker<T, 4, 4> = tracker(Logic::new(2, 3, 5)?, rule)?;
    let mut state = TrackerState::new();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let angle = 2.0 * PI * rng.random::<f64>();
    let velocity = Vector2::new(angle.cos(), angle.sin()) * 150.0;
    // Nine kilometres west of the sensor after thirty seconds.
    let start = Vector2::new(-9000.0, 300.0 * normal(&mut rng)) + (own - velocity) * 30.0;
    let target = Target { start, velocity };
    let place = |seconds: f64| own * seconds;
    let mut id = None;
    for k in 0..30u64 {
        let seconds = 2.0 * k as f64;
        let [p, v] = [place(seconds), own].map(|v| [T::lit(v.x), T::lit(v.y), T::ZERO]);
        let sensor = radar::<T, NZ>(components, Mount::at(p).moving(v))?;
        let plot = passes_over(&target, place, seconds).map(|offset| {
            let late = offset as f64 * 1e-6;
            // The range-rate is that of the closing velocity.
            let closing = Target { start: target.at(seconds + late) - place(seconds + late), velocity: velocity - own };
            measure::<T, NZ>(components, Vector2::zeros(), &closing, 0.0, &mut rng).with_offset(Duration::from_micros(offset))
        });
        tracker.step(&mut state, &sensor, &Scan::new(Instant::from_millis(10_000 + k * TURN), plot.as_slice()))?;
        if k >= 4 {
            let now = on_target(&state, target.at(seconds));
            prop_assert!(now.is_some() && (id.is_none() || id == now), "seed {seed}: {id:?} became {now:?} in scan {k}");
            id = now;
        }
    }
    Ok(())
}

#[test]
fn targets_seen_at_their_own_times_are_found_and_held() -> Result<(), TestCaseError> {
    for seed in 0..20 {
        for own in [Vector2::zeros(), Vector2::new(120.0, -90.0)] {
            found_and_held::<f32, 2>([Range, Azimuth], two_points(), own, seed)?;
            found_and_held::<f64, 2>([Range, Azimuth], two_points(), own, seed)?;
            found_and_held::<f32, 2>([Range, Azimuth], Rule::OnePoint, own, seed)?;
            found_and_held::<f64, 2>([Range, Azimuth], Rule::OnePoint, own, seed)?;
            found_and_held::<f32, 3>([Range, Azimuth, RangeRate], Rule::OnePoint, own, seed)?;
            found_and_held::<f64, 3>([Range, Azimuth, RangeRate], Rule::OnePoint, own, seed)?;
        }
    }
    Ok(())
}

#[test]
fn a_detection_belongs_to_a_scan_within_a_minute() -> Result<(), TestCaseError> {
    let tracker = tracker::<f32, 2, 2>(Logic::new(2, 3, 3)?, two_points())?;
    let sensor = positions(0.9)?;
    let minute = 60_000_000;
    for (micros, error) in [
        (0, None),
        (minute, None),
        (-minute, None),
        (minute + 1, Some(ScanError::OffsetTooLarge)),
        (-minute - 1, Some(ScanError::OffsetTooLarge)),
        (i64::MAX, Some(ScanError::OffsetTooLarge)),
        (i64::MIN, Some(ScanError::OffsetTooLarge)),
    ] {
        let mut state = TrackerState::new();
        let before = format!("{state:?}");
        let plots = [Detection::new([0.0, 0.0]), Detection::new([1.0, 2.0]).with_offset(Duration::from_micros(micros))];
        prop_assert_eq!(tracker.step(&mut state, &sensor, &Scan::new(Instant::ZERO, &plots)).err(), error, "{} µs", micros);
        prop_assert_eq!(format!("{state:?}") == before, error.is_some());
    }
    Ok(())
}
