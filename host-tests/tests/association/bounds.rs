//! Where it does not fit, the true error never exceeds the bound.

use crate::problems::{KINDS, problem};
use crate::{associate, difference};
use boresight::association::Jpda;
use boresight::scalar::Real;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Problems with a bound, the mean bound, and the mean true error.
#[derive(Debug, Default)]
struct Tally {
    bounded: usize,
    bound: f64,
    error: f64,
}

fn hold<T: Real, const NODES: usize>(seed: u64, count: usize) -> Tally {
    let jpda = Jpda::<NODES>::new().with_tolerance(1.0).unwrap_or_default();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut tally = Tally::default();
    for i in 0..count {
        let kind = KINDS[i % KINDS.len()];
        let p = problem(kind, rng.random_range(3..=5), rng.random_range(3..=7), i % 5 == 0, &mut rng);
        let Some(truth) = p.marginals() else { continue };
        let (completeness, got) = associate::<T, _>(&jpda, &p);
        let error = difference(&got, &truth);
        let bound = f64::from(completeness.error_bound);
        if completeness.bounded > 0 && completeness.approximated == 0 {
            assert!(error <= bound, "{kind:?} {NODES} nodes: error {error:e} beyond the bound {bound:e}: {p:?}");
            tally.bounded += 1;
            tally.bound += bound;
            tally.error += error;
        }
    }
    tally.bound /= tally.bounded.max(1) as f64;
    tally.error /= tally.bounded.max(1) as f64;
    tally
}

#[test]
fn the_error_bound_holds_and_shrinks_with_room() {
    let mut last = f64::INFINITY;
    let tallies = [hold::<f64, 13>(3, 30_000), hold::<f64, 20>(3, 30_000), hold::<f64, 32>(3, 30_000), hold::<f64, 64>(3, 30_000)];
    for tally in &tallies {
        println!("{tally:?}");
        assert!(tally.bounded > 1000 && tally.bound < last, "{tallies:?}");
        last = tally.bound;
    }
    for tally in [hold::<f32, 13>(4, 30_000), hold::<f32, 24>(4, 30_000), hold::<f32, 48>(4, 30_000)] {
        println!("{tally:?}");
        assert!(tally.bounded > 1000);
    }
}
