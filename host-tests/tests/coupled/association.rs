//! Joint association with unresolved pairs against the list of all events: every set of pairs may be one, and whoever is left, tracks
//! and pairs that are one, has a detection or none.

use boresight::association::{AssociationMatrix, Associator, ClutterPrior, Domain, Jpda, MergingJpda, UnresolvedPair};
use boresight::scalar::Real;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const TRACKS: usize = 10;
const DETS: usize = 5;
type Merging = MergingJpda<8192, 5>;

/// Two tracks: their rows, and what they weigh as one, none first.
#[derive(Clone, Debug)]
struct Pair {
    rows: [usize; 2],
    resolved: f64,
    weights: Vec<f64>,
}

/// Weights of rows, none first, and of pairs.
#[derive(Clone, Debug)]
struct Problem {
    rows: Vec<Vec<f64>>,
    pairs: Vec<Pair>,
    diffuse: bool,
}

/// Probabilities of all rows, less those of pairs as one, and of the pairs.
struct Answer {
    rows: Vec<Vec<f64>>,
    pairs: Vec<Vec<f64>>,
}

/// Of `pairs` pairs in at least as many tracks as they need, which gate a detection with probability `density`.
fn problem(seed: u64, pairs: usize, density: f64) -> Problem {
    let rng = &mut ChaCha8Rng::seed_from_u64(seed);
    let most = (2 * pairs + 1).clamp(4, TRACKS);
    let (tracks, dets) = (rng.random_range(2 * pairs.max(1)..=most), rng.random_range(0..=DETS));
    let weight = |rng: &mut ChaCha8Rng| if rng.random_bool(density) { (6.0 * rng.random::<f64>() - 2.0).exp() } else { 0.0 };
    let row = |rng: &mut ChaCha8Rng| -> Vec<f64> {
        std::iter::once(0.02 + 0.3 * rng.random::<f64>()).chain((0..dets).map(|_| weight(rng))).collect()
    };
    let mut rows: Vec<_> = (0..tracks).map(|_| row(rng)).collect();
    // Where clutter is diffuse every detection is somebody's, so that all events count as many.
    let diffuse = rng.random_bool(0.4);
    if diffuse {
        rows[0].iter_mut().skip(1).for_each(|w| *w += 0.1);
    }
    let mut order: Vec<_> = (0..tracks).collect();
    order.shuffle(rng);
    let pair = |rows: &[usize; 2]| Pair { rows: *rows, resolved: rng.random_range(0.05..0.95), weights: row(rng) };
    let pairs = order.as_chunks().0.iter().take(pairs).map(pair).collect();
    Problem { rows, pairs, diffuse }
}

/// Visits the choice of a column, 0 for none, for every row of `list`, no column twice but 0; with the product of the weights.
fn choices(list: &[&[f64]], chosen: &mut Vec<usize>, weight: f64, visit: &mut dyn FnMut(&[usize], f64)) {
    let Some(row) = list.get(chosen.len()) else { return visit(chosen, weight) };
    for (column, w) in row.iter().enumerate().filter(|(_, w)| **w > 0.0) {
        if column == 0 || !chosen.contains(&column) {
            chosen.push(column);
            choices(list, chosen, weight * w, visit);
            chosen.pop();
        }
    }
}

fn enumerate(p: &Problem) -> Answer {
    let width = p.rows[0].len();
    let m = (width - 1) as f64;
    let mut answer = Answer { rows: vec![vec![0.0; width]; p.rows.len()], pairs: vec![vec![0.0; width]; p.pairs.len()] };
    let mut total = 0.0;
    for as_one in 0..1 << p.pairs.len() {
        let is_one = |number: usize| as_one >> number & 1 == 1;
        let (one, two): (Vec<_>, Vec<_>) = (0..p.pairs.len()).partition(|number| is_one(*number));
        let alone: Vec<usize> = (0..p.rows.len()).filter(|row| !one.iter().any(|number| p.pairs[*number].rows.contains(row))).collect();
        let list: Vec<&[f64]> =
            one.iter().map(|number| &p.pairs[*number].weights).chain(alone.iter().map(|row| &p.rows[*row])).map(Vec::as_slice).collect();
        let prior = two.iter().map(|number| p.pairs[*number].resolved).product();
        choices(&list, &mut Vec::new(), prior, &mut |chosen, weight| {
            let served = chosen.iter().filter(|column| **column > 0).count();
            let clutter: f64 = if p.diffuse { (0..served).map(|k| m / (m - k as f64)).product() } else { 1.0 };
            let (of_pairs, of_rows) = chosen.split_at(one.len());
            one.iter().zip(of_pairs).for_each(|(number, column)| answer.pairs[*number][*column] += weight * clutter);
            alone.iter().zip(of_rows).for_each(|(row, column)| answer.rows[*row][*column] += weight * clutter);
            total += weight * clutter;
        });
    }
    answer.rows.iter_mut().chain(&mut answer.pairs).flatten().for_each(|v| *v /= total);
    answer
}

/// The same by the library; whether it says that it is exact.
fn associate<T: Real>(p: &Problem) -> (Answer, bool) {
    let mut matrix = AssociationMatrix::<T, TRACKS, DETS>::new();
    let clutter = if p.diffuse { ClutterPrior::Diffuse } else { ClutterPrior::Poisson };
    matrix.reset(p.rows[0].len() - 1, clutter, Domain::Linear);
    for (row, weights) in p.rows.iter().enumerate() {
        let (miss, hit) = matrix.row_mut(row).expect("a row");
        *miss = T::lit(weights[0]);
        hit.iter_mut().zip(&weights[1..]).for_each(|(h, w)| *h = T::lit(*w));
    }
    let mut memory = <Merging as Associator<T, TRACKS, DETS>>::MEMORY;
    let pairs = <Merging as Associator<T, TRACKS, DETS>>::pairs(&mut memory).expect("pairs");
    for Pair { rows, resolved, weights } in &p.pairs {
        let mut hit = [T::ZERO; DETS];
        hit.iter_mut().zip(&weights[1..]).for_each(|(h, w)| *h = T::lit(*w));
        let pair = UnresolvedPair::new(rows.map(|row| row as u16), T::lit(*resolved), T::lit(weights[0]), hit);
        pairs.push(pair).expect("room");
    }
    let completeness = Merging::new(Jpda::new()).associate(&mut matrix, &mut memory);
    let list = |miss: T, hit: &[T]| std::iter::once(&miss).chain(hit).map(|v| v.to_f64()).collect::<Vec<_>>();
    let rows = (0..p.rows.len()).filter_map(|row| matrix.row(row)).map(|(miss, hit)| list(miss, hit)).collect();
    let pairs = <Merging as Associator<T, TRACKS, DETS>>::pairs(&mut memory).expect("pairs");
    let pairs = pairs.iter().map(|pair| list(pair.probability.miss, &pair.probability.hit[..p.rows[0].len() - 1])).collect();
    (Answer { rows, pairs }, completeness.is_exact())
}

/// The largest error of a probability.
fn error(got: &Answer, want: &Answer) -> f64 {
    let all = |answer: &Answer| answer.rows.iter().chain(&answer.pairs).flatten().copied().collect::<Vec<_>>();
    all(got).iter().zip(all(want)).map(|(got, want)| (got - want).abs()).fold(0.0, f64::max)
}

/// By how much what a track has itself and what its pair has are off one, together.
fn deficit(p: &Problem, got: &Answer) -> f64 {
    let of_pair = |row: usize| p.pairs.iter().zip(&got.pairs).filter(move |(pair, _)| pair.rows.contains(&row)).flat_map(|(_, own)| own);
    got.rows.iter().enumerate().map(|(row, own)| (own.iter().chain(of_pair(row)).sum::<f64>() - 1.0).abs()).fold(0.0, f64::max)
}

#[test]
fn probabilities_are_those_of_all_events() {
    fn check<T: Real>(p: &Problem, want: &Answer, tolerance: f64) {
        let (got, exact) = associate::<T>(p);
        assert!(exact && error(&got, want) < tolerance && deficit(p, &got) < tolerance, "{p:?}: {:?} {:?}", got.rows, got.pairs);
    }
    for pairs in 0..=4 {
        for seed in 0..300 {
            // From clusters of their own to all in one.
            let p = problem(seed, pairs, [0.2, 0.4, 0.7][seed as usize % 3]);
            let want = enumerate(&p);
            check::<f64>(&p, &want, 1e-9);
            check::<f32>(&p, &want, 1e-4);
        }
    }
}

/// A fifth pair of one cluster counts as resolved, and that is told.
#[test]
fn a_cluster_has_four_pairs() {
    let mut refused = 0;
    for seed in 0..100 {
        let five = problem(seed, 5, 0.7);
        let four = Problem { pairs: five.pairs[..4].to_vec(), ..five.clone() };
        let ((of_five, exact), (of_four, _)) = (associate::<f64>(&five), associate::<f64>(&four));
        if !exact {
            refused += 1;
            assert_eq!(of_five.pairs.len(), 4);
            assert!(error(&of_five, &of_four) < 1e-9, "{five:?}");
        } else {
            assert!(error(&of_five, &enumerate(&five)) < 1e-9, "{five:?}");
        }
    }
    assert!(refused > 50 && refused < 100, "{refused}");
}
