//! Joint association with an unresolved pair against the list of all events.

use boresight::association::{AssociationMatrix, Associator, ClutterPrior, Domain, Jpda, MergingJpda, UnresolvedPair};
use boresight::scalar::Real;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const TRACKS: usize = 4;
const DETS: usize = 5;
type Merging = MergingJpda<512, 2>;

/// Weights of rows, miss first, and of the pair of the first two.
#[derive(Clone, Debug)]
struct Problem {
    rows: Vec<Vec<f64>>,
    pair: Vec<f64>,
    resolved: f64,
    diffuse: bool,
}

fn problem(seed: u64) -> Problem {
    let rng = &mut ChaCha8Rng::seed_from_u64(seed);
    let (tracks, dets) = (rng.random_range(2..=TRACKS), rng.random_range(0..=DETS));
    let weight = |rng: &mut ChaCha8Rng, p: f64| if rng.random_bool(p) { (6.0 * rng.random::<f64>() - 2.0).exp() } else { 0.0 };
    let row = |rng: &mut ChaCha8Rng| -> Vec<f64> {
        std::iter::once(0.02 + 0.3 * rng.random::<f64>()).chain((0..dets).map(|_| weight(rng, 0.7))).collect()
    };
    let mut rows: Vec<_> = (0..tracks).map(|_| row(rng)).collect();
    // Where clutter is diffuse every detection is somebody's, so that all events count as many.
    let diffuse = rng.random_bool(0.4);
    if diffuse {
        rows[0].iter_mut().skip(1).for_each(|w| *w += 0.1);
    }
    Problem { rows, pair: row(rng), resolved: rng.random_range(0.05..0.95), diffuse }
}

/// The probabilities of all rows, resolved ones of the pair, and of the pair as one.
fn enumerate(p: &Problem) -> (Vec<Vec<f64>>, Vec<f64>) {
    let width = p.pair.len();
    let (mut rows, mut pair, mut total) = (vec![vec![0.0; width]; p.rows.len()], vec![0.0; width], 0.0);
    let m = (width - 1) as f64;
    let mut visit = |list: &[&[f64]], prior: f64, sink: &mut dyn FnMut(&[usize], f64)| {
        let count = list.len();
        for code in 0..width.pow(count as u32) {
            let chosen: Vec<usize> = (0..count).map(|k| code / width.pow(k as u32) % width).collect();
            let served: Vec<_> = chosen.iter().filter(|c| **c > 0).collect();
            if (1..width).any(|column| served.iter().filter(|c| ***c == column).count() > 1) {
                continue;
            }
            let clutter: f64 = if p.diffuse { (0..served.len()).map(|k| m / (m - k as f64)).product() } else { 1.0 };
            let weight: f64 = prior * clutter * list.iter().zip(&chosen).map(|(row, c)| row[*c]).product::<f64>();
            total += weight;
            sink(&chosen, weight);
        }
    };
    let every: Vec<&[f64]> = p.rows.iter().map(Vec::as_slice).collect();
    visit(&every, p.resolved, &mut |chosen, weight| chosen.iter().enumerate().for_each(|(row, c)| rows[row][*c] += weight));
    let as_one: Vec<&[f64]> = std::iter::once(p.pair.as_slice()).chain(every[2..].iter().copied()).collect();
    visit(&as_one, 1.0, &mut |chosen, weight| {
        pair[chosen[0]] += weight;
        chosen[1..].iter().enumerate().for_each(|(row, c)| rows[row + 2][*c] += weight);
    });
    for v in rows.iter_mut().flatten().chain(&mut pair) {
        *v /= total;
    }
    (rows, pair)
}

fn check<T: Real>(p: &Problem, tolerance: f64) {
    let mut matrix = AssociationMatrix::<T, TRACKS, DETS>::new();
    let clutter = if p.diffuse { ClutterPrior::Diffuse } else { ClutterPrior::Poisson };
    matrix.reset(p.pair.len() - 1, clutter, Domain::Linear);
    for (row, weights) in p.rows.iter().enumerate() {
        let (miss, hit) = matrix.row_mut(row).expect("a row");
        *miss = T::lit(weights[0]);
        hit.iter_mut().zip(&weights[1..]).for_each(|(h, w)| *h = T::lit(*w));
    }
    let mut memory = <Merging as Associator<T, TRACKS, DETS>>::MEMORY;
    let mut pair =
        UnresolvedPair { rows: [0, 1], resolved: T::lit(p.resolved), alone: T::ONE, miss: T::lit(p.pair[0]), hit: [T::ZERO; DETS] };
    pair.hit.iter_mut().zip(&p.pair[1..]).for_each(|(h, w)| *h = T::lit(*w));
    <Merging as Associator<T, TRACKS, DETS>>::pairs(&mut memory).expect("pairs").push(pair).expect("room");
    assert!(Merging::new(Jpda::new()).associate(&mut matrix, &mut memory).is_exact());
    let (rows, as_one) = enumerate(p);
    for (row, want) in rows.iter().enumerate() {
        let (miss, hit) = matrix.row(row).expect("a row");
        for (got, want) in std::iter::once(&miss).chain(hit).zip(want) {
            assert!((got.to_f64() - want).abs() < tolerance, "row {row}: {got} for {want}: {p:?}");
        }
    }
    let pairs = <Merging as Associator<T, TRACKS, DETS>>::pairs(&mut memory).expect("pairs");
    for (got, want) in std::iter::once(&pairs[0].miss).chain(&pairs[0].hit).zip(&as_one) {
        assert!((got.to_f64() - want).abs() < tolerance, "as one: {got} for {want}: {p:?}");
    }
}

#[test]
fn probabilities_are_those_of_all_events() {
    for seed in 0..1500 {
        check::<f64>(&problem(seed), 1e-9);
        check::<f32>(&problem(seed), 1e-4);
    }
}
