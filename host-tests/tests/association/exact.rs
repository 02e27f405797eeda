//! Where everything fits the probabilities are those of enumeration.

use crate::events::Problem;
use crate::problems::{KINDS, problem};
use crate::{DETS, Rows, TRACKS, associate, associate_in, difference};
use boresight::association::{Domain, Jpda, Pda, SingleAssociator};
use boresight::scalar::Real;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const PLENTY: Jpda<8192> = Jpda::new();

fn equals_enumeration<T: Real>(tolerance: f64) {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for i in 0..6000 {
        let kind = KINDS[i % KINDS.len()];
        let (tracks, detections) = (rng.random_range(1..=5), rng.random_range(0..=6));
        let p = problem(kind, tracks, detections, i % 3 == 0, &mut rng);
        let Some(truth) = p.marginals() else { continue };
        for domain in [Domain::Linear, Domain::Logarithmic] {
            let (completeness, got) = associate_in::<T, _>(&PLENTY, &p, domain);
            assert!(completeness.is_exact(), "{kind:?} {p:?} {completeness:?}");
            let off = difference(&got, &truth);
            assert!(off < tolerance, "{kind:?} {domain:?} off by {off:e}: {p:?}");
        }
    }
}

#[test]
fn marginals_are_those_of_all_events() {
    equals_enumeration::<f64>(1e-11);
    equals_enumeration::<f32>(1e-4);
}

fn sums_to_one(rows: &Rows, tolerance: f64) -> bool {
    rows.iter().all(|(m, h)| (m + h.iter().sum::<f64>() - 1.0).abs() < tolerance && *m >= 0.0 && h.iter().all(|h| *h >= 0.0))
}

#[test]
fn rows_sum_to_one_at_any_capacity() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for i in 0..3000 {
        let p = problem(KINDS[i % 6], rng.random_range(1..=TRACKS), rng.random_range(0..=DETS), i % 4 == 0, &mut rng);
        assert!(sums_to_one(&associate::<f32, _>(&Jpda::<13>::new(), &p).1, 1e-4), "{p:?}");
        assert!(sums_to_one(&associate::<f32, _>(&Jpda::<40>::new(), &p).1, 1e-4), "{p:?}");
        assert!(sums_to_one(&associate::<f64, _>(&PLENTY, &p).1, 1e-9), "{p:?}");
    }
}

#[test]
fn a_permutation_of_tracks_and_detections_permutes_the_answer() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for i in 0..2000 {
        let p = problem(KINDS[i % 6], rng.random_range(1..=6), rng.random_range(1..=9), i % 4 == 0, &mut rng);
        let mut rows: Vec<usize> = (0..p.tracks()).collect();
        let mut columns: Vec<usize> = (0..p.detections()).collect();
        rows.shuffle(&mut rng);
        columns.shuffle(&mut rng);
        let permuted = |row: &[f64]| columns.iter().map(|j| row[*j]).collect::<Vec<_>>();
        let q = Problem {
            miss: rows.iter().map(|t| p.miss[*t]).collect(),
            hit: rows.iter().map(|t| permuted(&p.hit[*t])).collect(),
            diffuse: p.diffuse,
        };
        let (_, a) = associate::<f64, _>(&PLENTY, &p);
        let (_, b) = associate::<f64, _>(&PLENTY, &q);
        let a: Rows = rows.iter().map(|t| (a[*t].0, permuted(&a[*t].1))).collect();
        assert!(difference(&a, &b) < 1e-11, "{p:?}");
    }
}

/// `p` with another track and detections of its own beside it, and a detection that nobody gates.
fn with_neighbours(p: &Problem) -> Problem {
    let mut q = p.clone();
    for row in &mut q.hit {
        row.insert(0, 0.0);
        row.extend([0.0, 0.0]);
    }
    let mut far = vec![0.0; q.detections()];
    let own = far.len() - 2;
    far[own..].fill(0.7);
    q.miss.insert(0, 0.1);
    q.hit.insert(0, far);
    q
}

#[test]
fn what_is_far_away_or_gated_by_nobody_changes_no_bit() {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    for i in 0..2000 {
        let p = problem(KINDS[i % 6], rng.random_range(1..=7), rng.random_range(1..=9), false, &mut rng);
        let (_, alone) = associate::<f32, _>(&PLENTY, &p);
        let (_, beside) = associate::<f32, _>(&PLENTY, &with_neighbours(&p));
        let cut: Rows = beside[1..].iter().map(|(m, h)| (*m, h[1..h.len() - 2].to_vec())).collect();
        assert_eq!(alone, cut, "{p:?}");
    }
}

#[test]
fn one_track_is_pda() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for i in 0..600 {
        let p = problem(KINDS[i % 6], 1, rng.random_range(0..=DETS), i % 2 == 0, &mut rng);
        let mut hit = p.hit[0].clone();
        let beta_0 = Pda.associate(p.miss[0], &mut hit);
        let (_, got) = associate::<f64, _>(&PLENTY, &p);
        assert!(difference(&got, &vec![(beta_0, hit)]) < 1e-12, "{p:?}");
    }
}

#[test]
fn without_a_possible_event_nothing_is_detected() {
    let two_for_one = Problem { miss: vec![0.0, 0.0, 0.3], hit: vec![vec![1.0, 0.0], vec![2.0, 0.0], vec![0.0, 0.6]], diffuse: false };
    let (completeness, rows) = associate::<f32, _>(&PLENTY, &two_for_one);
    assert_eq!(completeness.infeasible, 1);
    assert_eq!(rows[..2], [(1.0, vec![0.0, 0.0]), (1.0, vec![0.0, 0.0])]);
    assert!(difference(&rows[2..].to_vec(), &vec![(1.0 / 3.0, vec![0.0, 2.0 / 3.0])]) < 1e-6);
    for diffuse in [false, true] {
        let nothing = Problem { miss: vec![0.0; 2], hit: vec![vec![0.0; 3]; 2], diffuse };
        let (completeness, rows) = associate::<f64, _>(&PLENTY, &nothing);
        assert_eq!((completeness.infeasible, &rows[0]), (2, &(1.0, vec![0.0; 3])));
    }
}

#[test]
fn garbage_is_no_weight() {
    let hit = vec![vec![f64::NAN, 1.0, -3.0], vec![f64::INFINITY, 1.0, 1.0]];
    let (_, got) = associate::<f64, _>(&PLENTY, &Problem { miss: vec![0.5, f64::NAN], hit, diffuse: false });
    let clean = Problem { miss: vec![0.5, 0.0], hit: vec![vec![0.0, 1.0, 0.0], vec![0.0, 1.0, 1.0]], diffuse: false };
    assert!(clean.marginals().is_some_and(|truth| difference(&got, &truth) < 1e-12));
}

#[test]
fn weights_of_any_range_keep_their_ratios() {
    // Two tracks for one detection, each 400 decades surer of it than of none: one of them has it.
    let (tiny, huge) = (1e-200, 1e200);
    let p = Problem { miss: vec![tiny, 3.0 * tiny], hit: vec![vec![huge], vec![huge]], diffuse: false };
    // Events: (hit, none) 3, (none, hit) 1, (none, none) 0.
    let truth = vec![(0.25, vec![0.75]), (0.75, vec![0.25])];
    for domain in [Domain::Linear, Domain::Logarithmic] {
        let (completeness, got) = associate_in::<f64, _>(&PLENTY, &p, domain);
        assert!(completeness.is_exact() && difference(&got, &truth) < 1e-12, "{got:?}");
    }
    let (_, got) = associate_in::<f32, _>(&PLENTY, &p, Domain::Logarithmic);
    assert!(difference(&got, &truth) < 1e-3, "{got:?}");
    // In linear f32 the same with all the range there is.
    let (tiny, huge) = (1e-36, 1.0);
    let p = Problem { miss: vec![tiny, 3.0 * tiny, tiny], hit: vec![vec![huge], vec![huge], vec![huge]], diffuse: false };
    let (completeness, got) = associate::<f32, _>(&PLENTY, &p);
    let truth = vec![(4.0 / 7.0, vec![3.0 / 7.0]), (6.0 / 7.0, vec![1.0 / 7.0]), (4.0 / 7.0, vec![3.0 / 7.0])];
    assert!(completeness.is_exact() && difference(&got, &truth) < 1e-4, "{got:?}");
}
