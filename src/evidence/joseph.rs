//! The association update of modes for which a noise is sharp, far below the spread of what is predicted: by Joseph's form.
//!
//! ```text
//! K_j = G S_j⁻¹,   P_j = (I − K_j H) P (I − K_j H)' + K_j R_j K_j'
//! m  = Σ_j p_j K_j ν_j / e,                                x ← x + m
//! P ← (q (P + m m') + Σ_j p_j (P_j + (K_j ν_j − m) (K_j ν_j − m)')) / e,   e = q + Σ_j p_j
//! ```
//!
//! with q the weight of no detection and p_j that of each. All terms are positive: nothing cancels, as it does in P − G E G'
//! when R is below a few thousand roundings of H P H'. Bar-Shalom, Li and Kirubarajan 2001, equation 5.2.3-18. Out of line.

use super::logarithms::Share;
use super::update::Sums;
use super::{Evidence, Predicted};
use crate::gaussian::{Gaussian, Innovation, noise_is_sharp};
use crate::mode::{LEAST_PROBABILITY, ModeBank};
use crate::model::MeasurementModel;
use crate::scalar::{Real, is_finite};
use crate::scan::Detection;
use crate::symmetric::Symmetric;
use nalgebra::{SMatrix, SVector};

/// Whether the noise of a detection, its own or the sensor's, is sharp.
pub(super) fn is_sharp<T: Real, const NX: usize, const NZ: usize>(
    innovation: &Innovation<T, NX, NZ>,
    detection: &Detection<T, NZ>,
) -> bool {
    match &detection.noise {
        Some(noise) => noise_is_sharp(&innovation.spread, noise),
        None => innovation.sharp,
    }
}

impl<T: Real, const DETS: usize> Evidence<T, DETS> {
    /// Corrects the modes that are sharp, told with their sums. Returns how many refused.
    #[inline(never)]
    pub(super) fn correct_by_joseph<
        M: MeasurementModel<T, NX, NZ>,
        I: Predicted<T, NX, NZ, MODES>,
        const NX: usize,
        const NZ: usize,
        const MODES: usize,
    >(
        &self,
        miss: T,
        sums: &[(Sums<T, NZ>, bool); MODES],
        bank: &mut ModeBank<T, NX, MODES>,
        predicted: &I,
        model: &M,
        detections: &[Detection<T, NZ>],
    ) -> u16 {
        let innovations = predicted.innovations();
        let mut mixtures = [const { None }; MODES];
        for (((mixture, g), innovation), (sums, sharp)) in mixtures.iter_mut().zip(&bank.modes).zip(innovations).zip(sums) {
            let evidence = miss + sums.evidence;
            // False for what is no number, too: there is nothing to correct by.
            if *sharp && evidence > T::lit(LEAST_PROBABILITY) && is_finite(evidence) {
                *mixture = Some(Mixture::new(g, innovation, sums, miss, model));
            }
        }
        for (detection, shares) in self.shared(bank, predicted, model, detections) {
            for (((mixture, g), innovation), share) in mixtures.iter_mut().zip(&bank.modes).zip(innovations).zip(&shares) {
                if let Some(mixture) = mixture {
                    mixture.add(g, innovation, share, detection);
                }
            }
        }
        let mut resets = 0;
        for (mixture, g) in mixtures.iter().zip(&mut bank.modes) {
            if let Some(Mixture { shift, cov, .. }) = mixture {
                let mean = g.mean + shift;
                resets += u16::from(!g.replace(mean, cov));
            }
        }
        resets
    }
}

/// A mode as the mixture of what it is without a detection and with each.
struct Mixture<T, const NX: usize, const NZ: usize> {
    /// 1 / e
    scale: T,
    /// m
    shift: SVector<T, NX>,
    /// P so far
    cov: SMatrix<T, NX, NX>,
    h: SMatrix<T, NZ, NX>,
    noise: Symmetric<T, NZ>,
}

impl<T: Real, const NX: usize, const NZ: usize> Mixture<T, NX, NZ> {
    /// Of the term without a detection, which weighs `miss`.
    fn new<M: MeasurementModel<T, NX, NZ>>(
        g: &Gaussian<T, NX>,
        innovation: &Innovation<T, NX, NZ>,
        sums: &Sums<T, NZ>,
        miss: T,
        model: &M,
    ) -> Self {
        let scale = T::ONE / (miss + sums.evidence);
        let shift = innovation.cross * SVector::from(sums.first) * scale;
        let cov = (g.cov.to_matrix() + shift * shift.transpose()) * (miss * scale);
        Self { scale, shift, cov, h: model.jacobian(&g.mean), noise: model.noise(&g.mean) }
    }

    /// One more detection.
    fn add(&mut self, g: &Gaussian<T, NX>, innovation: &Innovation<T, NX, NZ>, share: &Share<T, NZ>, detection: &Detection<T, NZ>) {
        let gain = innovation.cross * share.s_inv.to_matrix();
        let d = gain * share.nu - self.shift;
        let joseph = g.joseph(&gain, &self.h, detection.noise.as_ref().unwrap_or(&self.noise));
        self.cov += (joseph + d * d.transpose()) * (share.p * self.scale);
    }
}
