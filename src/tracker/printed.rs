//! The IMM-PDAF update as Kashyap et al. (2006) print it, kept as a baseline: do not use it to track.
//!
//! ```text
//! gate, β   from the combined prediction x̃ = Σ c_j x_j, S̃ = H P̃ H' + R
//! eq. 10    z̃ = H x̃ + Σ β_i ν_i, one resultant measurement for all modes
//! eq. 13    x_j ← x_j + K_j (z̃ − H x_j),  P_j ← P_j − K_j S_j K_j'
//! eq. 16    Λ_j = N(z̃ − H x_j; 0, S_j),   μ_j ∝ c_j Λ_j
//! ```
//!
//! The residual is shrunk by the weights and every mode is taken to have been measured, so the covariances claim more
//! than they know and every mode looks good in ambiguity: about a third of the tracks of that paper's first scenario
//! are lost, none with the update of [`evidence`](crate::evidence).

use crate::evidence::{Evidence, Found, innovations};
use crate::mode::ModeBank;
use crate::model::MeasurementModel;
use crate::scalar::{Real, exp};
use crate::scan::{Candidates, Detection};
use crate::sensor::Sensor;
use nalgebra::SVector;

/// The update by the printed equations. `associate` replaces weights by probabilities, as
/// [`SingleAssociator`](crate::association::SingleAssociator) does; the modes are updated as if a miss weighed `doubt` times
/// what it does; `gated` is called with the number of every gated detection.
pub(super) fn update<T: Real, S: Sensor<T, NX, NZ>, const NX: usize, const NZ: usize, const MODES: usize, const DETS: usize>(
    bank: &mut ModeBank<T, NX, MODES>,
    sensor: &S,
    associate: impl FnOnce(T, &mut [T]) -> T,
    doubt: T,
    detections: &[Detection<T, NZ>],
    candidates: Candidates<'_>,
    gated: impl FnMut(u16),
) -> Found<T> {
    let model = sensor.model();
    let combined = ModeBank::<T, NX, 1>::new([T::ONE], bank.combined());
    let overall = innovations(&combined, model);
    let mut evidence = Evidence::<T, DETS>::new();
    evidence.collect(&combined, &overall, sensor, detections, candidates);
    evidence.gated().iter().copied().for_each(gated);
    let (miss, weights) = evidence.weights();
    let beta_0 = associate(miss, weights);
    let (miss, hits) = (beta_0, T::ONE - beta_0);
    if evidence.gated().is_empty() {
        return Found { miss, hits, resets: 0 };
    }
    let share = T::ONE / (miss * doubt + hits);
    let mut resultant = SVector::<T, NZ>::zeros();
    let (_, beta) = evidence.weights();
    let mut probable = heapless::Vec::<T, DETS>::new();
    let _ = probable.extend_from_slice(beta);
    for (number, beta) in evidence.gated().iter().zip(&probable) {
        if let Some(detection) = detections.get(usize::from(*number)) {
            resultant += model.residual(&detection.z, &overall[0].z_hat) * (*beta * share);
        }
    }
    let resultant = overall[0].z_hat + resultant;

    let mut ln_prob = [T::ZERO; MODES];
    let mut largest = -T::ONE / T::ZERO;
    let mut resets = 0;
    for (g, ln_l) in bank.modes.iter_mut().zip(&mut ln_prob) {
        let innovation = model.innovation(g);
        let nu = model.residual(&resultant, &innovation.z_hat);
        *ln_l = innovation.density.ln_at(&nu);
        if *ln_l > largest {
            largest = *ln_l;
        }
        if !g.update(&innovation, &nu) {
            resets += 1;
        }
    }
    let mut sum = T::ZERO;
    let mut prob = bank.prob;
    for (p, ln_l) in prob.iter_mut().zip(ln_prob) {
        *p *= exp(ln_l - largest);
        sum += *p;
    }
    if sum > T::ZERO {
        bank.prob = prob.map(|p| p / sum);
    }
    Found { miss, hits, resets }
}
