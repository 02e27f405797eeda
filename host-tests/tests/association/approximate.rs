//! The last rung: loopy belief propagation, and problems far beyond every capacity.

use crate::events::Problem;
use crate::problems::{KINDS, problem};
use crate::{associate, difference};
use boresight::association::{AssociationMatrix, Associator, ClutterPrior, Domain, Jpda};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Takes nothing but exact answers, and has no room for them: everything else is left to the approximation.
fn approximation() -> Jpda<13> {
    Jpda::new().with_tolerance(0.0).unwrap_or_default()
}

#[test]
fn a_cluster_without_loops_is_solved_by_propagation_too() {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    for _ in 0..300 {
        // A chain: track t has detections t and t + 1.
        let tracks = 5;
        let mut p = Problem { miss: vec![], hit: vec![], diffuse: false };
        for t in 0..tracks {
            let mut row = vec![0.0; tracks + 1];
            row[t..=t + 1].fill_with(|| 10f64.powf(rng.random_range(-2.0..2.0)));
            p.miss.push(rng.random_range(0.01..1.0));
            p.hit.push(row);
        }
        let (completeness, got) = associate::<f64, _>(&approximation(), &p);
        let Some(truth) = p.marginals() else { continue };
        assert!(completeness.approximated == 1 || completeness.is_exact());
        assert!(difference(&got, &truth) < 1e-3, "off by {:e}", difference(&got, &truth));
    }
}

#[test]
fn the_approximation_is_near_the_truth_on_average() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let (mut sum, mut count, mut worst) = (0.0, 0, 0.0f64);
    for i in 0..3000 {
        let p = problem(KINDS[i % KINDS.len()], 5, rng.random_range(4..=7), false, &mut rng);
        let (completeness, got) = associate::<f32, _>(&approximation(), &p);
        if let (Some(truth), 1) = (p.marginals(), completeness.approximated) {
            let error = difference(&got, &truth);
            (sum, count, worst) = (sum + error, count + 1, worst.max(error));
        }
    }
    println!("largest error of a problem: mean {:.3}, worst {worst:.3} of {count}", sum / f64::from(count));
    // Williams and Lau report marginals within a few percent where clutter is light.
    assert!(count > 1000 && sum / f64::from(count) < 0.05);
}

/// 64 x 64, everything gated by everybody.
fn overloaded<const NODES: usize>(spread: f32) {
    let mut rng = ChaCha8Rng::seed_from_u64(10);
    let mut matrix = AssociationMatrix::<f32, 64, 64>::new();
    for clutter in [ClutterPrior::Poisson, ClutterPrior::Diffuse] {
        matrix.reset(64, clutter, Domain::Linear);
        for t in 0..64 {
            if let Some((miss, hit)) = matrix.row_mut(t) {
                *miss = 0.1;
                hit.fill_with(|| 10f32.powf(rng.random_range(-spread..=spread)));
            }
        }
        let mut memory = Box::new(<Jpda<NODES> as Associator<f32, 64, 64>>::MEMORY);
        let completeness = Jpda::<NODES>::new().associate(&mut matrix, &mut memory);
        assert_eq!(completeness.bounded + completeness.approximated, 1, "{completeness:?}");
        for t in 0..64 {
            let sum = matrix.row(t).map_or(0.0, |(m, h)| m + h.iter().sum::<f32>());
            assert!((sum - 1.0).abs() < 1e-4, "row {t} sums to {sum}");
        }
    }
}

#[test]
fn sixty_four_tracks_on_sixty_four_detections_return_with_an_honest_report() {
    overloaded::<65>(0.0);
    overloaded::<65>(6.0);
    overloaded::<1024>(3.0);
    overloaded::<16384>(19.0);
}
