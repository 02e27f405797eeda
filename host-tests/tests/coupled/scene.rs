//! Random pairs of targets with what a scan of theirs may hold.

use boresight::coupled::{Candidate, CoupledGaussian, Cross, Odds, Sums};
use boresight::gaussian::Gaussian;
use boresight::model::linear::LinearMeasurement;
use boresight::model::resolution::Resolution;
use boresight::scalar::Real;
use boresight::scan::Detection;
use boresight::symmetric::Symmetric;
use nalgebra::{SMatrix, SVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub const N: usize = 4;
pub const M: usize = 2;
pub type Targets<T> = CoupledGaussian<T, N, Cross<T, N>>;

/// Everything that one scan asks, in double precision.
#[derive(Clone, Debug)]
pub struct Scene {
    pub mean: [SVector<f64, N>; 2],
    /// The covariance of both targets
    pub cov: SMatrix<f64, 8, 8>,
    pub h: SMatrix<f64, M, N>,
    pub noise: SMatrix<f64, M, M>,
    pub cells: SMatrix<f64, M, M>,
    pub merged_noise: SMatrix<f64, M, M>,
    pub share: f64,
    pub p_detect: [f64; 2],
    pub p_merged: f64,
    pub p_gate: f64,
    pub ln_pair: f64,
    pub detections: Vec<(SVector<f64, M>, Option<SMatrix<f64, M, M>>)>,
    pub candidates: Vec<Candidate<f64>>,
    pub unresolving: bool,
}

fn random<const R: usize, const C: usize>(rng: &mut ChaCha8Rng, scale: f64) -> SMatrix<f64, R, C> {
    SMatrix::from_fn(|_, _| scale * (2.0 * rng.random::<f64>() - 1.0))
}

fn definite<const D: usize>(rng: &mut ChaCha8Rng, scale: f64) -> SMatrix<f64, D, D> {
    let a = random::<D, D>(rng, 1.0);
    (a * a.transpose() + SMatrix::identity() * 0.3) * (scale * scale)
}

/// One scene of the seed `seed`, with cross covariance or without.
pub fn scene(seed: u64, coupled: bool) -> Scene {
    let rng = &mut ChaCha8Rng::seed_from_u64(seed);
    let mut cov = definite::<8>(rng, 10.0);
    if !coupled {
        for i in 0..N {
            for j in N..2 * N {
                (cov[(i, j)], cov[(j, i)]) = (0.0, 0.0);
            }
        }
    }
    let first = random::<N, 1>(rng, 500.0);
    let mean = [first, first + random::<N, 1>(rng, 40.0)];
    let h = random::<M, N>(rng, 1.0) + SMatrix::<f64, M, N>::from_fn(|k, i| f64::from(u8::from(i == 2 * k)));
    let count = rng.random_range(0..=4);
    let detections = (0..count).map(|_| {
        let of = mean[rng.random_range(0..2)];
        (h * of + random::<M, 1>(rng, 30.0), rng.random_bool(0.25).then(|| definite::<M>(rng, 8.0)))
    });
    let detections: Vec<_> = detections.collect();
    let candidates = (0..count).map(|number| Candidate {
        number: number as u16,
        gated: [rng.random_bool(0.8), rng.random_bool(0.8)],
        merged: rng.random_bool(0.8),
        ln_rate: 4.0 + 3.0 * rng.random::<f64>(),
    });
    let candidates = candidates.collect();
    let p = |rng: &mut ChaCha8Rng| 0.5 + 0.499 * rng.random::<f64>();
    Scene {
        mean,
        cov,
        h,
        noise: definite(rng, 10.0),
        cells: definite(rng, 25.0),
        merged_noise: definite(rng, 10.0),
        share: rng.random(),
        p_detect: [p(rng), p(rng)],
        p_merged: p(rng),
        p_gate: p(rng),
        ln_pair: rng.random::<f64>(),
        detections,
        candidates,
        unresolving: rng.random_bool(0.8),
    }
}

pub fn symmetric<T: Real, const D: usize>(m: &SMatrix<f64, D, D>) -> Symmetric<T, D> {
    Symmetric::from_fn(|i, j| T::lit(m[(i, j)]))
}

/// What the library makes of a scene: both targets, ln Λ, P(seen) of either, P(one to the sensor).
#[derive(Clone, Debug)]
pub struct Answer {
    pub mean: SVector<f64, 8>,
    pub cov: SMatrix<f64, 8, 8>,
    pub ln_evidence: f64,
    pub seen: [f64; 2],
    pub unresolved: f64,
}

impl Scene {
    pub fn targets<T: Real>(&self) -> Targets<T> {
        let target = |r: usize| {
            let cov = Symmetric::from_fn(|i, j| T::lit(self.cov[(N * r + i, N * r + j)]));
            Gaussian::new(self.mean[r].map(T::lit), cov)
        };
        CoupledGaussian { targets: [target(0), target(1)], cross: Cross(SMatrix::from_fn(|i, j| T::lit(self.cov[(i, N + j)]))) }
    }

    pub fn resolution<T: Real>(&self) -> Resolution<T, M> {
        let resolution = Resolution::from_covariance(symmetric(&self.cells)).and_then(|r| r.with_noise(symmetric(&self.merged_noise)));
        let resolution = resolution.and_then(|r| r.with_share(T::lit(self.share))?.with_p_detect(T::lit(self.p_merged)));
        resolution.expect("sound by construction")
    }

    pub fn solve<T: Real>(&self) -> Answer {
        let mut targets = self.targets::<T>();
        let model = LinearMeasurement::<T, N, M> { matrix: self.h.map(T::lit), noise: symmetric(&self.noise) };
        let detections: Vec<Detection<T, M>> = self
            .detections
            .iter()
            .map(|(z, noise)| {
                let detection = Detection::new([T::lit(z[0]), T::lit(z[1])]);
                noise.map_or(detection, |noise| detection.with_noise(symmetric(&noise)))
            })
            .collect();
        let candidates: Vec<_> = self
            .candidates
            .iter()
            .map(|c| {
                let Candidate { number, gated, merged, ln_rate } = *c;
                Candidate { number, gated, merged, ln_rate: T::lit(ln_rate) }
            })
            .collect();
        let odds = Odds { p_detect: self.p_detect.map(T::lit), p_gate: T::lit(self.p_gate), ln_pair: T::lit(self.ln_pair) };
        let (innovation, mut sums) = (targets.innovation(&model), Sums::new());
        let resolution = self.unresolving.then(|| self.resolution());
        innovation.hypotheses(&model, resolution.as_ref(), &odds, &detections, &candidates, |h| sums.take(h));
        let ((seen, unresolved), ln_evidence) = (sums.probabilities(), sums.ln_evidence());
        let (w, e) = sums.correction();
        assert!(targets.correct(&innovation, &w, &e), "refused: {self:?}");
        Answer {
            mean: SVector::from_fn(|i, _| targets.targets[i / N].mean[i % N].to_f64()),
            cov: joint(&targets),
            ln_evidence: ln_evidence.to_f64(),
            seen: seen.map(Real::to_f64),
            unresolved: unresolved.to_f64(),
        }
    }
}

/// The covariance of both targets, both triangles.
pub fn joint<T: Real>(targets: &Targets<T>) -> SMatrix<f64, 8, 8> {
    let own = targets.targets.map(|g| g.cov.to_matrix());
    let c = targets.cross.0;
    SMatrix::from_fn(|i, j| {
        match (i / N, j / N) {
            (0, 0) => own[0][(i, j)],
            (1, 1) => own[1][(i - N, j - N)],
            (0, _) => c[(i, j - N)],
            _ => c[(j, i - N)],
        }
        .to_f64()
    })
}
