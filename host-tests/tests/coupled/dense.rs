//! One scan by dense matrices: every hypothesis a Kalman update of the vector of both targets, the answer their moment match.

use crate::scene::{Answer, M, N, Scene, scene};
use nalgebra::{DMatrix, DVector};

struct Kalman {
    ln_weight: f64,
    x: DVector<f64>,
    p: DMatrix<f64>,
    seen: [bool; 2],
    as_one: bool,
}

/// Lists all hypotheses of a scene and matches their moments.
fn oracle(scene: &Scene) -> Answer {
    let x = DVector::from_fn(2 * N, |i, _| scene.mean[i / N][i % N]);
    let p = DMatrix::from_fn(2 * N, 2 * N, |i, j| scene.cov[(i, j)]);
    let rows = |weights: [f64; 2]| DMatrix::from_fn(M, 2 * N, |k, i| weights[i / N] * scene.h[(k, i % N)]);
    let dynamic = |m: &nalgebra::SMatrix<f64, M, M>| DMatrix::from_fn(M, M, |i, j| m[(i, j)]);
    let below =
        |a: &DMatrix<f64>, b: &DMatrix<f64>| DMatrix::from_fn(2 * M, a.ncols(), |i, j| if i < M { a[(i, j)] } else { b[(i - M, j)] });
    let beside = |a: &DMatrix<f64>, b: &DMatrix<f64>| {
        DMatrix::from_fn(2 * M, 2 * M, |i, j| match (i / M, j / M) {
            (0, 0) => a[(i, j)],
            (1, 1) => b[(i - M, j - M)],
            _ => 0.0,
        })
    };
    let update = |h: &DMatrix<f64>, r: &DMatrix<f64>, z: &DVector<f64>| {
        let (s, nu) = (h * &p * h.transpose() + r, z - h * &x);
        let inverse = s.clone().try_inverse().expect("definite");
        let gain = &p * h.transpose() * &inverse;
        let ln_density = -0.5 * (nu.dot(&(&inverse * &nu)) + (2.0 * std::f64::consts::PI * &s).determinant().ln());
        (ln_density, &x + &gain * nu, &p - &gain * s * gain.transpose())
    };
    let (own, cells) = ([rows([1.0, 0.0]), rows([0.0, 1.0])], dynamic(&scene.cells));
    let (between, apart) = (rows([scene.share, 1.0 - scene.share]), rows([1.0, -1.0]));
    let nowhere = DVector::zeros(M);
    let ln_volume = 0.5 * (2.0 * std::f64::consts::PI * &cells).determinant().ln();
    let (ln_density, x_near, p_near) = update(&apart, &cells, &nowhere);
    let p_one = if scene.unresolving { (ln_volume + ln_density).exp() } else { 0.0 };
    let ln_two = (1.0 - p_one).ln();
    let missed = scene.p_detect.map(|p| (1.0 - p * scene.p_gate).ln());
    let nothing = Kalman { ln_weight: ln_two + missed[0] + missed[1], x: x.clone(), p: p.clone(), seen: [false; 2], as_one: false };
    let mut all = vec![nothing];
    if scene.unresolving {
        let ln_weight = p_one.ln() + (1.0 - scene.p_merged * scene.p_gate).ln();
        all.push(Kalman { ln_weight, x: x_near, p: p_near, seen: [false; 2], as_one: true });
    }
    let z = |i: usize| DVector::from_fn(M, |k, _| scene.detections[i].0[k]);
    let noise = |i: usize, else_: &nalgebra::SMatrix<f64, M, M>| dynamic(scene.detections[i].1.as_ref().unwrap_or(else_));
    for (i, a) in scene.candidates.iter().enumerate() {
        for r in (0..2).filter(|r| a.gated[*r]) {
            let (ln_density, x, p) = update(&own[r], &noise(i, &scene.noise), &z(i));
            let ln_weight = ln_two + scene.p_detect[r].ln() + missed[1 - r] + a.ln_rate + ln_density;
            all.push(Kalman { ln_weight, x, p, seen: [r == 0, r == 1], as_one: false });
        }
        if a.merged && scene.unresolving {
            let r = beside(&noise(i, &scene.merged_noise), &cells);
            let stacked = DVector::from_fn(2 * M, |k, _| if k < M { z(i)[k] } else { 0.0 });
            let (ln_density, x, p) = update(&below(&between, &apart), &r, &stacked);
            let ln_weight = scene.p_merged.ln() + ln_volume + a.ln_rate + ln_density;
            all.push(Kalman { ln_weight, x, p, seen: [true; 2], as_one: true });
        }
        for (j, b) in scene.candidates.iter().enumerate().filter(|(j, b)| *j != i && a.gated[0] && b.gated[1]) {
            let r = beside(&noise(i, &scene.noise), &noise(j, &scene.noise));
            let stacked = DVector::from_fn(2 * M, |k, _| if k < M { z(i)[k] } else { z(j)[k - M] });
            let (ln_density, x, p) = update(&below(&own[0], &own[1]), &r, &stacked);
            let detected = scene.p_detect[0].ln() + scene.p_detect[1].ln();
            let ln_weight = ln_two + detected + a.ln_rate + b.ln_rate + scene.ln_pair + ln_density;
            all.push(Kalman { ln_weight, x, p, seen: [true; 2], as_one: false });
        }
    }
    let most = all.iter().map(|k| k.ln_weight).fold(f64::NEG_INFINITY, f64::max);
    let total: f64 = all.iter().map(|k| (k.ln_weight - most).exp()).sum();
    let share = |k: &Kalman| (k.ln_weight - most).exp() / total;
    let mean: DVector<f64> = all.iter().map(|k| &k.x * share(k)).sum();
    let cov: DMatrix<f64> = all.iter().map(|k| (&k.p + (&k.x - &mean) * (&k.x - &mean).transpose()) * share(k)).sum();
    let probability = |of: &dyn Fn(&Kalman) -> bool| all.iter().filter(|k| of(k)).map(share).sum();
    Answer {
        mean: nalgebra::SVector::from_fn(|i, _| mean[i]),
        cov: nalgebra::SMatrix::from_fn(|i, j| cov[(i, j)]),
        ln_evidence: most + total.ln(),
        seen: [probability(&|k| k.seen[0]), probability(&|k| k.seen[1])],
        unresolved: probability(&|k| k.as_one),
    }
}

fn hold(scene: &Scene, got: &Answer, tolerance: f64) {
    let want = oracle(scene);
    let (x, p) = ((got.mean - want.mean).amax() / want.mean.amax(), (got.cov - want.cov).amax() / want.cov.amax());
    let seen = (got.seen[0] - want.seen[0]).abs() + (got.seen[1] - want.seen[1]).abs();
    let off = [x, p, seen, (got.unresolved - want.unresolved).abs(), (got.ln_evidence - want.ln_evidence).abs() / 10.0];
    assert!(off.iter().all(|off| *off < tolerance), "{off:?}: {scene:?}");
}

#[test]
fn every_scan_is_the_moment_match_of_all_hypotheses() {
    for seed in 0..2000 {
        let scene = scene(seed, seed % 3 != 0);
        hold(&scene, &scene.solve::<f64>(), 1e-9);
        hold(&scene, &scene.solve::<f32>(), 2e-3);
    }
}
