//! Targets west of a radar, where azimuth jumps from π to −π: found by either initiation with one detection on each side,
//! held across, measured by range and azimuth, with range-rate and with range-rate that folds.

use crate::tracking::{P_DETECT, Target, measure, on_target, radar};
use crate::{Tracker, TrackerState, tracker, two_points};
use boresight::initiation::Rule;
use boresight::model::radar::Component::{self, Azimuth, Range, RangeRate};
use boresight::model::radar::Mount;
use boresight::scalar::{Real, fold};
use boresight::scan::Scan;
use boresight::sensor::{Clutter, Sensor, UniformSensor};
use boresight::time::Instant;
use boresight::track::Logic;
use nalgebra::Vector2;
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestCaseResult};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A radar, how it starts tracks, and its unambiguous speed where range-rate folds.
#[derive(Clone, Copy, Debug)]
struct Setting<T, const NZ: usize> {
    components: [Component; NZ],
    rule: Rule<T>,
    unambiguous: Option<f64>,
}

/// Thirty scans of one target that crosses the seam: one track, on the target and of its velocity.
fn held_across<T: Real, const NZ: usize>(setting: Setting<T, NZ>, target: &Target, seed: u64) -> TestCaseResult {
    let Setting { components, rule, unambiguous } = setting;
    let tracker: Tracker<T, 4, 4> = tracker(Logic::new(2, 3, 5)?, rule)?;
    let mut state = TrackerState::new();
    let whole = radar::<T, NZ>(components, Mount::at([T::ZERO; 3]))?;
    let model = match unambiguous {
        Some(speed) => whole.model.with_unambiguous_speed(T::lit(speed))?,
        None => whole.model,
    };
    // There is no clutter: where a velocity is not known yet, the gate is wide.
    let sensor = UniformSensor::new(model, T::lit(P_DETECT), Clutter::Poisson(T::lit(1e-9)), *Sensor::<T, 6, NZ>::gate(&whole))?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut id = None;
    let mut sides = [false; 2];
    for k in 0..30u64 {
        let seconds = k as f64;
        let mut plot = measure::<T, NZ>(components, Vector2::zeros(), target, seconds, &mut rng);
        for (z, c) in plot.z.iter_mut().zip(components) {
            if c == RangeRate {
                *z = unambiguous.map_or(*z, |v| fold(*z, T::lit(v)));
            }
        }
        sides[usize::from(target.at(seconds).y > 0.0)] = true;
        let seen = k < 2 || rng.random_bool(P_DETECT);
        let plots = if seen { &[plot][..] } else { &[] };
        tracker.step(&mut state, &sensor, &Scan::new(Instant::from_millis(1000 * k), plots))?;
        if k >= 3 {
            let now = on_target(&state, target.at(seconds));
            prop_assert!(now.is_some() && (id.is_none() || id == now), "{setting:?}, seed {seed}: {id:?} became {now:?} in scan {k}");
            id = now;
            prop_assert_eq!(state.tracks().count(), 1, "{:?}, seed {}, scan {}", setting, seed, k);
        }
    }
    prop_assert_eq!(sides, [true; 2]);
    // A track that took a wrong fold for its speed would be off by 50 m/s, the least interval here; this is half of it.
    let mean = state.estimates().next().map(|e| e.state.mean.map(Real::to_f64)).ok_or_else(|| TestCaseError::fail("no track"))?;
    let error = (Vector2::new(mean[1], mean[4]) - target.velocity).norm();
    prop_assert!(error < 25.0, "seed {seed}: velocity {error} m/s off");
    Ok(())
}

fn every_setting<T: Real>(target: &Target, seed: u64) -> TestCaseResult {
    for rule in [two_points(), Rule::OnePoint] {
        let unambiguous = None;
        held_across(Setting::<T, 2> { components: [Range, Azimuth], rule, unambiguous }, target, seed)?;
        for unambiguous in [None, Some(60.0), Some(25.0)] {
            held_across(Setting::<T, 3> { components: [Azimuth, RangeRate, Range], rule, unambiguous }, target, seed)?;
        }
    }
    Ok(())
}

#[test]
fn targets_are_found_and_held_on_the_seam() -> Result<(), TestCaseError> {
    for seed in 0..10 {
        // Between the first two scans, which initiate, and in the midst of a track; northward, southward, and along the seam,
        // where the errors of azimuth put every other detection on the far side of the prediction.
        for scan in [0.5, 15.5] {
            for north in [100.0, -100.0, 2.0] {
                for east in [20.0, 80.0, -90.0] {
                    let velocity = Vector2::new(east, north);
                    let target = Target { start: Vector2::new(-5000.0, 0.0) - velocity * scan, velocity };
                    every_setting::<f32>(&target, seed)?;
                    every_setting::<f64>(&target, seed)?;
                }
            }
        }
    }
    Ok(())
}
