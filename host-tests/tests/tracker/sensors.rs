//! Sensors of every dimension, rate, place, P_D and clutter feed one picture of targets that cross, at irregular times.
//!
//! | sensor | measures | P_D | clutter |
//! |---|---|---|---|
//! | surveyor | range, azimuth from the west | 0.9 | known |
//! | finder | azimuth from the south | 0.8 | known |
//! | doppler | range-rate, range, azimuth from the north | 0.7 | unknown density |
//! | camera | position | 0.6 | unknown density |

use crate::enumeration::Enumeration;
use crate::tracking::{Target, measure, normal, on_target, radar};
use crate::{SIGMA, joint_tracker, positions, two_points};
use boresight::association::Gate;
use boresight::model::radar::Component::{Azimuth, Range, RangeRate};
use boresight::model::radar::{Mount, Radar};
use boresight::scalar::Real;
use boresight::scan::{Detection, Report, Scan};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::time::Instant;
use boresight::track::{Existence, Logic};
use nalgebra::Vector2;
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestCaseResult};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const WEST: [f64; 2] = [-4000.0, 0.0];
const SOUTH: [f64; 2] = [500.0, -5000.0];
const NORTH: [f64; 2] = [1000.0, 6000.0];

/// Both cross the middle after twenty seconds, at 53°.
const TARGETS: [Target; 2] = [
    Target { start: Vector2::new(-1600.0, -800.0), velocity: Vector2::new(80.0, 40.0) },
    Target { start: Vector2::new(-1600.0, 800.0), velocity: Vector2::new(80.0, -40.0) },
];

fn mount<T: Real>(place: [f64; 2]) -> Mount<T> {
    Mount::at([place[0], place[1], 0.0].map(T::lit))
}

/// The same radar with another P_D and clutter.
fn another<T: Real, const NZ: usize>(
    sensor: &UniformSensor<Radar<T, NZ, 2, 3>, T>,
    p_detect: f64,
    clutter: Clutter<T>,
) -> Result<UniformSensor<Radar<T, NZ, 2, 3>, T>, TestCaseError> {
    Ok(UniformSensor::new(sensor.model, T::lit(p_detect), clutter, Gate::new::<NZ>(T::lit(20.0))?)?)
}

/// Forty seconds of looks; both targets are found within five and keep one track each.
fn one_picture<T: Real>(logic: Logic<T>, seed: u64) -> TestCaseResult {
    let tracker = joint_tracker::<T, _, 8, 8>(logic, two_points(), Enumeration)?;
    let mut state = Box::new(crate::JointTrackerState::new());
    let surveyor = radar([Range, Azimuth], mount(WEST))?;
    let finder = another(&radar([Azimuth], mount(SOUTH))?, 0.8, Clutter::Poisson(T::lit(0.05)))?;
    let doppler = another(&radar([RangeRate, Range, Azimuth], mount(NORTH))?, 0.7, Clutter::Diffuse)?;
    let camera = UniformSensor::new(positions::<T>(0.6)?.model, T::lit(0.6), Clutter::Diffuse, Gate::new::<2>(T::lit(20.0))?)?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut ids, mut millis, mut looks) = ([None; 2], 0u64, 0);
    while millis < 40_000 {
        let start = looks < 4;
        // The first scans come from the surveyor, a second apart; then anybody may look at any time, or twice at once.
        let gap = if start { [0, 1000, 0, 1000][looks] } else { [0, 70, 300, 900][rng.random_range(0..4)] };
        let who = if start { 0 } else { rng.random_range(0..4) };
        millis += gap;
        looks += 1;
        let (time, t) = (Instant::from_millis(millis), millis as f64 / 1000.0);
        let p_detect = [0.9, 0.8, 0.7, 0.6][who];
        let nothing = !start && rng.random_bool(0.05);
        let seen: Vec<_> = TARGETS.iter().filter(|_| !nothing && (start || rng.random_bool(p_detect))).collect();
        let report: Report = match who {
            0 => {
                let plots: Vec<_> = seen.iter().map(|s| measure([Range, Azimuth], WEST.into(), s, t, &mut rng)).collect();
                tracker.step(&mut state, &surveyor, &Scan::new(time, &plots))?
            }
            1 => {
                let plots: Vec<_> = seen.iter().map(|s| measure([Azimuth], SOUTH.into(), s, t, &mut rng)).collect();
                tracker.step(&mut state, &finder, &Scan::new(time, &plots))?
            }
            2 => {
                let plots: Vec<_> = seen.iter().map(|s| measure([RangeRate, Range, Azimuth], NORTH.into(), s, t, &mut rng)).collect();
                tracker.step(&mut state, &doppler, &Scan::new(time, &plots))?
            }
            _ => {
                let mut plot = |s: &&Target| Detection::new(s.at(t).map(|v| T::lit(v + SIGMA * normal(&mut rng))).into());
                let plots: Vec<_> = seen.iter().map(&mut plot).collect();
                tracker.step(&mut state, &camera, &Scan::new(time, &plots))?
            }
        };
        prop_assert!(report.numeric_resets == 0 && report.clusters_infeasible == 0, "{report:?}");
        if millis >= 5000 {
            let now = TARGETS.each_ref().map(|s| on_target(&state, s.at(t)));
            for (id, now) in ids.iter_mut().zip(now) {
                prop_assert!(
                    now.is_some() && (id.is_none() || *id == now || near_the_crossing(t)),
                    "seed {seed}: {id:?} became {now:?} at {t} s"
                );
                if !near_the_crossing(t) {
                    *id = now;
                }
            }
        }
    }
    prop_assert!(ids[0] != ids[1] && looks > 60);
    Ok(())
}

/// While the targets are within two seconds of the crossing, both tracks are on either.
fn near_the_crossing(seconds: f64) -> bool {
    (seconds - 20.0).abs() < 2.0
}

fn by_either_rule<T: Real>() -> TestCaseResult {
    let [birth, lifetime, confirm, delete] = [0.1, 100.0, 0.95, 1e-3].map(T::lit);
    for seed in 0..20 {
        one_picture::<T>(Logic::new(3, 6, 12)?, seed)?;
        one_picture::<T>(Logic::existence(Existence { birth, lifetime, confirm, delete })?, seed)?;
    }
    Ok(())
}

#[test]
fn sensors_of_every_kind_feed_one_picture() -> Result<(), TestCaseError> {
    by_either_rule::<f32>()?;
    by_either_rule::<f64>()
}
