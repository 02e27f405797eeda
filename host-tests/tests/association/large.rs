//! Clusters of more tracks than a mask can name, and weights that leave the range of the precision on the way.

use boresight::association::{AssociationMatrix, Associator, ClutterPrior, Completeness, Domain, Jpda};
use boresight::scalar::Real;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn associate<T: Real, const TRACKS: usize, const DETS: usize, const NODES: usize>(
    matrix: &mut AssociationMatrix<T, TRACKS, DETS>,
) -> Completeness {
    Jpda::<NODES>::new().associate(matrix, &mut Box::new(<Jpda<NODES> as Associator<T, TRACKS, DETS>>::MEMORY))
}

/// Marginals of tracks that share `shared` detections and may have private ones, event by event over the shared ones: for
/// each the track that has it, or none. Weights are those of a row: none or private together, and each shared detection.
fn listed(rows: &[(f64, Vec<f64>)]) -> Vec<(f64, Vec<f64>)> {
    let shared = rows[0].1.len();
    let mut sums: Vec<(f64, Vec<f64>)> = rows.iter().map(|_| (0.0, vec![0.0; shared])).collect();
    let mut total = 0.0;
    let mut takers = vec![0; shared];
    for event in 0..(rows.len() + 1).pow(shared as u32) {
        let mut rest = event;
        takers.iter_mut().for_each(|taker| (*taker, rest) = (rest % (rows.len() + 1), rest / (rows.len() + 1)));
        let taken = |t: usize| takers.iter().filter(|taker| **taker == t).count();
        if (0..rows.len()).any(|t| taken(t) > 1) {
            continue;
        }
        let mut weight = 1.0;
        for (t, (none, hit)) in rows.iter().enumerate() {
            weight *= takers.iter().position(|taker| *taker == t).map_or(*none, |j| hit[j]);
        }
        total += weight;
        for (t, (none, hit)) in sums.iter_mut().enumerate() {
            *takers.iter().position(|taker| *taker == t).map_or(none, |j| &mut hit[j]) += weight;
        }
    }
    sums.into_iter().map(|(none, hit)| (none / total, hit.into_iter().map(|h| h / total).collect())).collect()
}

#[test]
fn crowds_around_few_detections_are_exact() {
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    for run in 0..20 {
        let (tracks, shared) = (33 + run % 8, 1 + run % 2);
        let mut matrix = AssociationMatrix::<f64, 40, 64>::new();
        matrix.reset(64, ClutterPrior::Poisson, Domain::Linear);
        let mut rows = Vec::new();
        for t in 0..tracks {
            let (miss, private) = (rng.random_range(0.05..0.5), if rng.random_bool(0.5) { rng.random_range(0.1..2.0) } else { 0.0 });
            let hit: Vec<f64> = (0..shared).map(|_| rng.random_range(0.01..1.0)).collect();
            if let Some((m, h)) = matrix.row_mut(t) {
                *m = miss;
                h[..shared].copy_from_slice(&hit);
                h[10 + t] = private;
            }
            rows.push((miss, private, hit));
        }
        let completeness = associate::<f64, 40, 64, 16384>(&mut matrix);
        assert!(completeness.is_exact(), "{completeness:?}");
        let whole: Vec<(f64, Vec<f64>)> = rows.iter().map(|(miss, private, hit)| (miss + private, hit.clone())).collect();
        for (t, ((none, hit), (miss, private, _))) in listed(&whole).into_iter().zip(&rows).enumerate() {
            let Some((m, h)) = matrix.row(t) else { continue };
            assert!((m - none * miss / (miss + private)).abs() < 1e-12);
            assert!((h[10 + t] - none * private / (miss + private)).abs() < 1e-12);
            assert!(h.iter().zip(&hit).all(|(got, want)| (got - want).abs() < 1e-12));
        }
    }
}

#[test]
fn more_events_than_single_precision_can_count_are_no_overflow() {
    let mut matrix = Box::new(AssociationMatrix::<f32, 32, 128>::new());
    matrix.reset(128, ClutterPrior::Poisson, Domain::Logarithmic);
    for t in 0..32 {
        if let Some((miss, hit)) = matrix.row_mut(t) {
            *miss = 0.0;
            hit.iter_mut().enumerate().filter(|(j, _)| j.abs_diff(4 * t) <= 16).for_each(|(_, h)| *h = 0.0);
        }
    }
    associate::<f32, 32, 128, 65536>(&mut matrix);
    for t in 0..32 {
        let sum = matrix.row(t).map_or(0.0, |(m, h)| m + h.iter().sum::<f32>());
        assert!((sum - 1.0).abs() < 1e-3, "row {t} sums to {sum}");
    }
}

/// Two tracks for one detection, in logarithms: the first detection of both, the second of each its own.
fn contested(ln_shared: f32, ln_own: [f32; 2]) -> (Completeness, Vec<f32>) {
    let mut matrix = AssociationMatrix::<f32, 2, 3>::new();
    matrix.reset(3, ClutterPrior::Poisson, Domain::Logarithmic);
    for (t, own) in ln_own.into_iter().enumerate() {
        if let Some((miss, hit)) = matrix.row_mut(t) {
            (*miss, hit[0], hit[1 + t]) = (0.0, ln_shared, own);
        }
    }
    let completeness = associate::<f32, 2, 3, 64>(&mut matrix);
    (completeness, (0..2).filter_map(|t| matrix.row(t)).flat_map(|(m, h)| [&[m], h].concat()).collect())
}

#[test]
fn what_is_no_logarithm_of_a_weight_counts_as_none() {
    let (_, beta) = contested(2e30, [0.5, 0.7]);
    let alone = |own: f32| [1.0 / (1.0 + own.exp()), own.exp() / (1.0 + own.exp())];
    let ([a, b], [c, d]) = (alone(0.5), alone(0.7));
    let want = [a, 0.0, b, 0.0, c, 0.0, 0.0, d];
    assert!(beta.iter().zip(want).all(|(got, want)| (got - want).abs() < 1e-5), "{beta:?}");
}

#[test]
fn logarithms_too_large_for_the_precision_are_told() {
    let (completeness, _) = contested(1e8, [0.5, 0.7]);
    assert!(completeness.bounded == 1 && completeness.error_bound > 0.02, "{completeness:?}");
    assert!(contested(40.0, [0.5, 0.7]).0.is_exact());
}
