//! Evidence of detections with a time of their own, an offset from their scan ([`Detection::with_offset`]).
//!
//! Each is predicted at its time, with its own ẑ, G and S (`model/offset.rs`). The G differ then, and mode r is corrected by
//! one detection after the other, none first:
//!
//! ```text
//! P ← P − p_j G_j S_j⁻¹ G_j',   d = G_j S_j⁻¹ ν_j − m,   m ← m + p_j/(q + p_j) d,   P ← P + q p_j/(q + p_j) d d',   q ← q + p_j
//! ```
//!
//! from q = β_0 / e_r and m = 0, which ends in x + m: the same mixture, by terms that do not cancel. All of it is out of
//! line: scans without offsets pay for one look at their detections.

use super::{Evidence, Innovations};
use crate::gaussian::{Correction, Gaussian, Innovation};
use crate::mode::{LEAST_PROBABILITY, ModeBank};
use crate::model::MeasurementModel;
use crate::model::offset::Drift;
use crate::scalar::Real;
use crate::scan::Detection;
use crate::sensor::Sensor;
use crate::symmetric::Symmetric;
use nalgebra::SVector;

impl<T: Real, const MODES: usize, const DETS: usize> Evidence<T, MODES, DETS> {
    /// Gates the detections numbered `candidates` by the mode `widest`, and writes ln L of those in the gate.
    #[inline(never)]
    pub(super) fn gate_at_their_times<S: Sensor<T, NX, NZ>, const NX: usize, const NZ: usize>(
        &mut self,
        bank: &ModeBank<T, NX, MODES>,
        innovations: &Innovations<T, NX, NZ, MODES>,
        sensor: &S,
        detections: &[Detection<T, NZ>],
        candidates: &[u16],
        widest: usize,
    ) {
        let model = sensor.model();
        let drifts: [_; MODES] = core::array::from_fn(|r| Drift::new(model, &bank.modes[r], &innovations[r]));
        for &number in candidates {
            let Some(detection) = detections.get(usize::from(number)) else { continue };
            let modes = innovations.iter().zip(&drifts);
            // The density of the residual under one mode, and the residual.
            let under = |(innovation, drift)| {
                let s = seen(drift, innovation, detection);
                (s.density, model.residual(&detection.z, &s.z_hat))
            };
            if let Some((density, nu)) = modes.clone().nth(widest).map(under)
                && density.is_proper()
                && density.nis(&nu) <= sensor.gate().threshold()
                && let Some(row) = self.admit(number)
            {
                for (ln_l, (density, nu)) in row.iter_mut().zip(modes.map(under)) {
                    *ln_l = density.ln_at(&nu);
                }
            }
        }
    }

    /// e_r, and whether mode r took the association update by detections with times of their own.
    #[inline(never)]
    pub(super) fn correct_one_by_one<M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize>(
        &self,
        r: usize,
        beta_0: T,
        mode: &mut Gaussian<T, NX>,
        innovation: &Innovation<T, NX, NZ>,
        model: &M,
        detections: &[Detection<T, NZ>],
    ) -> (T, bool) {
        let weighed = self.gated.iter().zip(&self.likelihood).zip(&self.hit).map(|((number, likelihood), q)| (number, *q * likelihood[r]));
        let evidence = weighed.clone().fold(beta_0, |sum, (_, p)| sum + p);
        if !evidence.is_finite() || evidence <= T::lit(LEAST_PROBABILITY) {
            return (evidence, true);
        }
        let drift = Drift::new(model, mode, innovation);
        let mut corrected = *mode;
        let (mut q, mut m) = (beta_0 / evidence, SVector::<T, NX>::zeros());
        for (number, p) in weighed {
            let p = p / evidence;
            let Some(detection) = detections.get(usize::from(*number)).filter(|_| p > T::ZERO) else { continue };
            let seen = seen(&drift, innovation, detection);
            let s_inv = &seen.density.s_inv;
            let d = seen.cross * SVector::from(s_inv.times(&model.residual(&detection.z, &seen.z_hat).data.0[0])) - m;
            let share = p / (q + p);
            let known = Correction { w: [T::ZERO; NZ], e: Symmetric::from_fn(|k, l| p * s_inv.upper()[k][l]) };
            let apart = Correction { w: [share], e: Symmetric::from_diagonal([-q * share]) };
            if !(corrected.correct(&seen.cross, &known) && corrected.correct(&d, &apart)) {
                return (evidence, false);
            }
            (q, m) = (q + p, m + d * share);
        }
        *mode = corrected;
        (evidence, true)
    }
}

/// The predicted measurement at the time of `detection`, with its own noise or the sensor's.
#[inline(always)]
fn seen<T: Real, const NX: usize, const NZ: usize>(
    drift: &Drift<T, NX, NZ>,
    innovation: &Innovation<T, NX, NZ>,
    detection: &Detection<T, NZ>,
) -> Innovation<T, NX, NZ> {
    drift.seen(innovation, detection.offset.as_secs(), detection.noise.as_ref())
}
