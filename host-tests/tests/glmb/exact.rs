//! With room for everything, the filter is the enumeration: sets, existence, densities, modes.

use super::enumeration::Enumeration;
use super::{Outcome, Problem, ample, l1, sets};
use boresight::scalar::Real;

fn compare<T: Real>(seed: u64, tolerance: f64) -> Outcome {
    let problem = Problem::draw(seed);
    let scans = problem.scans.len();
    let (state, truth) = (ample::<T>(&problem, scans)?, Enumeration::new(&problem, scans));
    let apart = l1(&sets(&state), &truth.sets());
    assert!(apart < tolerance, "seed {seed}: sets differ by {apart:e}");
    for n in 0..=6 {
        let probability: f64 = truth.hypotheses.iter().filter(|(tracks, _)| tracks.len() == n).map(|(_, weight)| weight).sum();
        assert!((state.cardinality(n).to_f64() - probability).abs() < tolerance, "seed {seed}: cardinality {n}");
    }
    for target in state.labels::<4, 2>() {
        let known = truth.marginal(target.label).ok_or("a label that is none")?;
        let (mean, cov) = (target.state.mean.map(|x| x.to_f64()), target.state.cov.to_matrix().map(|p| p.to_f64()));
        assert!((target.existence.to_f64() - known.existence).abs() < tolerance, "seed {seed}: existence of {:?}", target.label);
        assert!((mean - known.mean).abs().max() < 100.0 * tolerance, "seed {seed}: mean of {:?}", target.label);
        assert!((cov - known.cov).abs().max() < 1e4 * tolerance, "seed {seed}: covariance of {:?}", target.label);
        assert!((0..2).all(|r| (target.modes[r].to_f64() - known.modes[r]).abs() < tolerance), "seed {seed}: modes");
    }
    Ok(())
}

#[test]
fn all_that_is_known_is_what_listing_everything_gives() -> Outcome {
    (0..60).try_for_each(|seed| compare::<f64>(seed, 1e-10))
}

#[test]
fn and_in_single_precision() -> Outcome {
    (0..60).try_for_each(|seed| compare::<f32>(seed, 1e-4))
}
