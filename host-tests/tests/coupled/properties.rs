//! What holds of every scan, whatever it is.

use crate::scene::{Answer, N, Scene, scene};
use boresight::coupled::{Candidate, CoupledBank, CoupledGaussian, Coupling, Cross, NoCross};
use boresight::gaussian::Gaussian;
use boresight::mode::ModeBank;
use boresight::model::motion::{ConstantAcceleration, ConstantVelocity, ProcessNoise};
use boresight::model::radar::{Component, Radar};
use boresight::symmetric::Symmetric;
use nalgebra::SMatrix;

fn difference(a: &Answer, b: &Answer) -> f64 {
    let (x, p) = ((a.mean - b.mean).amax() / a.mean.amax(), (a.cov - b.cov).amax() / a.cov.amax());
    x.max(p).max((a.ln_evidence - b.ln_evidence).abs()).max((a.seen[0] - b.seen[0]).abs()).max((a.unresolved - b.unresolved).abs())
}

/// The same scene with the targets' names exchanged.
fn exchanged(scene: &Scene) -> Scene {
    let turned = |i: usize| (i + N) % (2 * N);
    let candidates = scene.candidates.iter().map(|c| Candidate { gated: [c.gated[1], c.gated[0]], ..*c }).collect();
    Scene {
        mean: [scene.mean[1], scene.mean[0]],
        cov: SMatrix::from_fn(|i, j| scene.cov[(turned(i), turned(j))]),
        share: 1.0 - scene.share,
        p_detect: [scene.p_detect[1], scene.p_detect[0]],
        candidates,
        ..scene.clone()
    }
}

#[test]
fn names_of_the_targets_do_not_matter() {
    for seed in 0..500 {
        let scene = scene(seed, true);
        let (a, b) = (scene.solve::<f64>(), exchanged(&scene).solve::<f64>());
        let turned = |i: usize| (i + N) % (2 * N);
        let back = Answer {
            mean: nalgebra::SVector::from_fn(|i, _| b.mean[turned(i)]),
            cov: SMatrix::from_fn(|i, j| b.cov[(turned(i), turned(j))]),
            seen: [b.seen[1], b.seen[0]],
            ..b
        };
        assert!(difference(&a, &back) < 1e-9, "{scene:?}");
    }
}

#[test]
fn order_of_the_detections_does_not_matter() {
    for seed in 0..500 {
        let scene = scene(seed, true);
        let mut turned = scene.clone();
        turned.detections.reverse();
        turned.candidates.reverse();
        for candidate in &mut turned.candidates {
            candidate.number = (scene.detections.len() - 1) as u16 - candidate.number;
        }
        assert!(difference(&scene.solve::<f64>(), &turned.solve::<f64>()) < 1e-9);
    }
}

#[test]
fn with_cells_of_no_size_no_detection_is_of_both() {
    for seed in 0..500 {
        let scene = scene(seed, true);
        let fine = Scene { cells: scene.cells * 1e-14, unresolving: true, ..scene.clone() };
        let without = Scene { unresolving: false, ..scene };
        assert!(difference(&fine.solve::<f64>(), &without.solve::<f64>()) < 1e-6, "{without:?}");
    }
}

#[test]
fn covariances_stay_definite_in_single_precision() {
    for seed in 0..2000 {
        let least = scene(seed, true).solve::<f32>().cov.symmetric_eigenvalues().min();
        assert!(least > 0.0, "{seed}: {least}");
    }
}

/// Noise a million times below what is predicted leaves a covariance that is definite but for rounding, and no larger than before.
#[test]
fn sharp_noise_leaves_a_covariance() {
    for seed in 0..2000 {
        let mut scene = scene(seed, true);
        (scene.noise, scene.merged_noise) = (scene.noise * 1e-7, scene.merged_noise * 1e-7);
        for (_, noise) in &mut scene.detections {
            *noise = noise.map(|noise| noise * 1e-7);
        }
        let cov = scene.solve::<f32>().cov;
        let scale = SMatrix::from_diagonal(&cov.diagonal().map(|v| 1.0 / v.sqrt()));
        let least = (scale * cov * scale).symmetric_eigenvalues().min();
        assert!(least > -1e-3, "{seed}: {least}");
    }
}

/// Where the fold of a range-rate is not certain it tells nothing: of its own target, nor of the other through what both have in common.
#[test]
fn an_ambiguous_range_rate_tells_nothing_of_either() {
    let noise = Symmetric::from_diagonal([25.0, 1e-4, 1.0]);
    let radar = Radar::<f64, 3, 2, 2>::new([Component::Range, Component::Azimuth, Component::RangeRate], noise).expect("sound");
    let radar = radar.with_unambiguous_speed(10.0).expect("sound");
    let target =
        |x: f64, variance: f64| Gaussian::new([x, 5.0, 300.0, -5.0].into(), Symmetric::from_diagonal([100.0, variance, 100.0, variance]));
    // The first is too uncertain to be unfolded.
    let targets = [target(1000.0, 400.0), target(1020.0, 1.0)];
    let cross = Cross(SMatrix::<f64, 4, 4>::from_diagonal_element(8.0));
    let innovation = CoupledGaussian { targets, cross }.innovation(&radar);
    let column = |state: usize, of: usize| innovation.gain[state][of].column(2).amax();
    assert_eq!([column(0, 0), column(1, 0)], [0.0; 2]);
    assert!(column(1, 1) > 0.0 && column(0, 1) > 0.0);
    assert_eq!(innovation.spread.cross[2], [0.0; 3]);
    assert!(innovation.spread.cross[0][0] > 0.0 && innovation.spread.cross[0][2] != 0.0);
}

type Modes = (ConstantVelocity<f64, 1, 3>, ConstantAcceleration<f64, 1>);
const JUMP: [[f64; 2]; 2] = [[0.9, 0.1], [0.3, 0.7]];

fn modes() -> Modes {
    let noise = |variance| ProcessNoise::Discrete(variance);
    let modes = (ConstantVelocity::new(noise(1.0)), ConstantAcceleration::new(noise(9.0)));
    (modes.0.expect("sound"), modes.1.expect("sound"))
}

fn target(seed: u64, shift: f64) -> Gaussian<f64, 3> {
    let a = SMatrix::<f64, 3, 3>::from_fn(|i, j| ((seed as f64 + 3.0 * i as f64 + 7.0 * j as f64) * 1.7).sin());
    let cov = a * a.transpose() + SMatrix::identity() * 0.2;
    Gaussian::new([shift, 2.0 * shift, 0.1].into(), Symmetric::from_matrix(&cov))
}

/// A bank whose pairs differ, as a product of two banks of one target each.
fn product<C: Coupling<f64, 3>>(seed: u64) -> (CoupledBank<f64, 3, 2, C>, [ModeBank<f64, 3, 2>; 2]) {
    let bank = |r: u64| ModeBank {
        prob: [0.3 + 0.4 * r as f64, 0.7 - 0.4 * r as f64],
        modes: [target(seed + r, 5.0), target(seed + 5 * r + 1, 7.0)],
    };
    let banks = [bank(0), bank(1)];
    let pair = |i: usize, j: usize| CoupledGaussian::new([banks[0].modes[i], banks[1].modes[j]]);
    let prob = |i: usize, j: usize| banks[0].prob[i] * banks[1].prob[j];
    let coupled = CoupledBank {
        prob: std::array::from_fn(|i| std::array::from_fn(|j| prob(i, j))),
        pairs: std::array::from_fn(|i| std::array::from_fn(|j| pair(i, j))),
    };
    (coupled, banks)
}

/// Two targets with nothing in common mix and move as two targets.
#[test]
fn a_product_of_two_banks_cycles_as_both() {
    fn hold<C: Coupling<f64, 3>>() {
        for seed in 0..100 {
            let (mut coupled, mut banks) = product::<C>(seed);
            coupled.interact(&JUMP);
            coupled.predict(&modes(), 0.5);
            for bank in &mut banks {
                bank.interact(&JUMP);
                bank.predict(&modes(), 0.5);
            }
            let combined = coupled.combined();
            for (r, bank) in banks.iter().enumerate() {
                let (got, want, got_prob) = (combined.targets[r], bank.combined(), coupled.mode_probabilities(r));
                assert!((got.mean - want.mean).amax() < 1e-10 && (got.cov.to_matrix() - want.cov.to_matrix()).amax() < 1e-9);
                assert!(got_prob.iter().zip(bank.prob).all(|(a, b)| (a - b).abs() < 1e-12));
                // Each mode of a product keeps its density whatever the other target does.
                for j in 0..2 {
                    let pair = |other: usize| if r == 0 { &coupled.pairs[j][other] } else { &coupled.pairs[other][j] };
                    assert!((0..2).all(|other| (pair(other).targets[r].mean - bank.modes[j].mean).amax() < 1e-10));
                }
            }
            assert!(combined.cross.block().is_none_or(|c| c.amax() < 1e-9));
        }
    }
    hold::<Cross<f64, 3>>();
    hold::<NoCross>();
}

/// Mixing against the textbook's sums over all pairs, with weights π_IJ μ_I / c_J and dense second moments about the mixed mean.
#[test]
fn mixing_is_the_moment_match_over_all_pairs() {
    for seed in 0..100 {
        let (mut coupled, _) = product::<Cross<f64, 3>>(seed);
        for (k, pair) in coupled.pairs.iter_mut().flatten().enumerate() {
            pair.cross = Cross(SMatrix::from_fn(|i, j| 0.02 * ((k + 2 * i + 3 * j) as f64).cos()));
            pair.targets[0].mean[0] += k as f64;
        }
        let before = coupled;
        coupled.interact(&JUMP);
        for (j1, j2) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let all = || (0..2).flat_map(|i1| (0..2).map(move |i2| (i1, i2)));
            let weight = |(i1, i2): (usize, usize)| JUMP[i1][j1] * JUMP[i2][j2] * before.prob[i1][i2];
            let c: f64 = all().map(weight).sum();
            let state = |(i1, i2): (usize, usize)| {
                let pair = &before.pairs[i1][i2];
                nalgebra::SVector::<f64, 6>::from_fn(|i, _| pair.targets[i / 3].mean[i % 3])
            };
            let mean: nalgebra::SVector<f64, 6> = all().map(|i| state(i) * (weight(i) / c)).sum();
            let cross: SMatrix<f64, 3, 3> = all()
                .map(|i| {
                    let d = state(i) - mean;
                    let spread = d.fixed_rows::<3>(0) * d.fixed_rows::<3>(3).transpose();
                    (before.pairs[i.0][i.1].cross.0 + spread) * (weight(i) / c)
                })
                .sum();
            let got = &coupled.pairs[j1][j2];
            assert!((0..6).all(|i| (got.targets[i / 3].mean[i % 3] - mean[i]).abs() < 1e-10));
            assert!((got.cross.0 - cross).amax() < 1e-9 && (coupled.prob[j1][j2] - c).abs() < 1e-12);
        }
    }
}

/// Without the block between the targets a pair of modes takes two thirds of the memory, half of a whole matrix.
#[test]
fn memory_is_that_of_the_blocks() {
    assert_eq!(size_of::<CoupledGaussian<f32, 9, Cross<f32, 9>>>(), 4 * (2 * (9 + 81) + 81));
    assert_eq!(size_of::<CoupledGaussian<f32, 9, NoCross>>(), 4 * 2 * (9 + 81));
}
