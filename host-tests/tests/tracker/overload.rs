//! Far too much at once: sixty-four tracks and as many detections in one place, with the least and with plenty of room.

use crate::joint::{cue, sensor, settled};
use crate::{JointTrackerState, joint_tracker};
use boresight::association::{Associator, Jpda};
use boresight::initiation::Rule;
use boresight::scan::{Detection, Scan};
use boresight::sensor::Clutter;
use boresight::time::Instant;
use boresight::track::Logic;
use proptest::test_runner::TestCaseError;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const CROWD: usize = 64;

/// Ten scans of a crowd within one gate. How many clusters were bounded, and how many approximated.
fn crowd<A: Associator<f32, CROWD, CROWD>>(associator: A, clutter: Clutter<f32>) -> Result<[u16; 2], TestCaseError> {
    let mut rng = ChaCha8Rng::seed_from_u64(17);
    let tracker = joint_tracker(Logic::unmanaged(), Rule::Off, associator)?;
    let mut state = Box::new(JointTrackerState::<f32, CROWD, CROWD, A>::new());
    for _ in 0..CROWD {
        let g = settled(rng.random_range(-5.0..5.0), 0.0, rng.random_range(-5.0..5.0), 0.0);
        cue(&tracker, &mut state, g)?;
    }
    let sensor = sensor(clutter)?;
    let mut given_up = [0, 0];
    for k in 1..=10 {
        let plots: [Detection<f32, 2>; CROWD] =
            core::array::from_fn(|_| Detection::new([rng.random_range(-20.0..20.0), rng.random_range(-20.0..20.0)]));
        let report = tracker.step(&mut state, &sensor, &Scan::new(Instant::from_millis(1000 * k), &plots))?;
        assert_eq!((usize::from(report.detections), report.detections_dropped, report.numeric_resets), (CROWD, 0, 0));
        assert!(!report.is_complete() && report.clusters_bounded + report.clusters_approximated == 1, "{report:?}");
        assert!(report.clusters_bounded == 0 || report.association_error_bound > 0.0);
        given_up = [given_up[0] + report.clusters_bounded, given_up[1] + report.clusters_approximated];
        assert_eq!(state.tracks().count(), CROWD);
        for estimate in state.estimates() {
            assert!(estimate.state.mean.iter().all(|v| v.is_finite()) && estimate.state.cov.cholesky().is_some(), "{estimate:?}");
        }
    }
    Ok(given_up)
}

#[test]
fn a_crowd_in_one_gate_is_tracked_and_told() -> Result<(), TestCaseError> {
    for clutter in [Clutter::Poisson(1e-4), Clutter::Diffuse] {
        println!("least room: {:?} clusters bounded and approximated", crowd(Jpda::<65>::new(), clutter)?);
        println!("any bound taken: {:?}", crowd(Jpda::<65>::new().with_tolerance(1.0)?, clutter)?);
        println!("plenty: {:?}", crowd(Jpda::<16384>::new(), clutter)?);
    }
    Ok(())
}
