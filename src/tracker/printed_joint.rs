//! The IMM-JPDAF and the LMS-JPDAF as Gomes prints them, kept as a baseline: do not use them to track.
//!
//! ```text
//! eq. 26, 33  gate and β by the mode with the largest det S, the same β for all modes
//! table 4     ν̃_r = Σ_j β_j ν_jr,  x_r ← x_r + K_r ν̃_r,
//!             P_r ← P_r − Σ_j β_j K_r S_r K_r' + K_r (Σ_j β_j ν_jr ν_jr' − ν̃_r ν̃_r') K_r'
//! table 5     L_r = N(ν̃_r; 0, S_r),   μ_r ∝ c_r L_r
//! ```
//!
//! The combined residual is shrunk by the weights, so that every mode looks good in ambiguity: where targets cross about one pair in
//! six swaps or is lost, against one in three hundred with the association of [`evidence`](crate::evidence). Detections with a
//! noise of their own bring their own S_j; L_r then takes that of the most probable one. With a set that keeps all modes it is
//! the printed IMM-JPDAF.

use super::picture::{Outcome, Picture, looks};
use super::{Joint, Likely, LmsJpda, LmsState, State, rows};
use crate::association::Associator;
use crate::error::ScanError;
use crate::evidence::{Evidence, Predicted, SomeInnovations, density_of, innovations, no_innovations, predict_measurements};
use crate::gaussian::{Correction, Gaussian, Innovation};
use crate::mode::{ActiveSet, ModeBank, ModeSet};
use crate::model::MeasurementModel;
use crate::scalar::{Real, exp, larger};
use crate::scan::{Detection, Report, Scan};
use crate::sensor::Sensor;
use crate::symmetric::Symmetric;
use nalgebra::SVector;

/// Likelihoods of activated modes are at most e to this, relative to those that were there.
const MOST: f64 = 60.0;

impl<T, M, A, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize> LmsJpda<T, M, NX, MODES, TRACKS, DETS, A>
where
    T: Real,
    M: ModeSet<T, NX, MODES>,
    A: Associator<T, TRACKS, DETS>,
{
    /// [`step`](Self::step) by the printed equations: a baseline that swaps and loses tracks. It costs no flash unless it is used.
    ///
    /// # Errors
    /// As `step`.
    pub fn step_printed<S: Sensor<T, NX, NZ>, const NZ: usize>(
        &self,
        state: &mut LmsState<T, NX, MODES, TRACKS, DETS, A>,
        sensor: &S,
        scan: &Scan<'_, T, NZ>,
    ) -> Result<Report, ScanError> {
        let (selection, mut report) = self.open(state, sensor, scan)?;
        let (model, detections) = (sensor.model(), scan.detections);
        let State { picture, evidence, scratch: Likely { joint: Joint { matrix, memory }, slots, dt } } = state;
        rows::write(matrix, picture, evidence, sensor, detections, &selection, |evidence, slot, track, look| {
            let run = slots.get(slot).map_or(ActiveSet::EMPTY, |slot| slot.run);
            let widest = ModeBank::<T, NX, 1>::new([T::ONE], widest(&track.bank, run, model));
            evidence.collect(&widest, &innovations(&widest, model), look, detections, selection.candidates())
        });
        report.add(self.associator.associate(matrix, memory));

        let Picture { tracks, .. } = picture;
        let (mut innovations, steps) = (no_innovations(), self.steps(*dt));
        for ((number, track), slot) in tracks.iter_mut().enumerate().zip(slots).filter(|((_, t), _)| !t.is_free()) {
            let Some((beta_0, row)) = matrix.row_mut(number) else { continue };
            let bank = &mut track.bank;
            let run = slot.run;
            predict_measurements(&mut innovations, bank, run, model);
            let predicted = SomeInnovations::new(&innovations, run);
            evidence.take(&predicted, detections, selection.indices.iter().copied().zip(row.iter().copied()));
            let p_detect = sensor.p_detect(&bank.modes[0].mean);
            let recall = looks(p_detect) && self.likely.recalls(NZ, |nis| evidence.is_explained(bank, &predicted, model, detections, nis));
            let (ln_likelihood, mut resets) = correct(evidence, bank, &predicted, model, detections);
            let reference = ln_likelihood.iter().fold(-T::ONE / T::ZERO, |most, ln_l| larger(most, *ln_l));
            let relative = |ln_l: T| if ln_l - reference > T::lit(MOST) { exp(T::lit(MOST)) } else { exp(ln_l - reference) };
            self.adapt(bank, slot, ln_likelihood.map(relative), recall, steps.as_ref(), |bank, new| {
                predict_measurements(&mut innovations, bank, new, model);
                let predicted = SomeInnovations::activated(&innovations, run, new);
                let (ln_likelihood, more) = correct(evidence, bank, &predicted, model, detections);
                resets += more;
                ln_likelihood.map(relative)
            });
            self.setup.conclude(track, Outcome { looked: looks(p_detect), hit: *beta_0 < T::lit(0.5), resets }, &mut report);
        }
        state.picture.close(&self.setup, sensor, scan, &selection, &mut report);
        Ok(report)
    }
}

/// The mode of `run` with the largest det S.
fn widest<T: Real, M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize, const MODES: usize>(
    bank: &ModeBank<T, NX, MODES>,
    run: ActiveSet,
    model: &M,
) -> Gaussian<T, NX> {
    let of_run = bank.modes.iter().enumerate().filter(|(r, _)| run.contains(*r)).map(|(_, g)| (g, model.innovation(g).density.peak));
    of_run.reduce(|a, b| if b.1 < a.1 { b } else { a }).map_or(bank.modes[0], |(g, _)| *g)
}

/// Corrects the modes of `predicted` by the printed equations. Their ln L, and how many corrections were refused.
fn correct<T: Real, M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize, const MODES: usize, const DETS: usize>(
    evidence: &Evidence<T, DETS>,
    bank: &mut ModeBank<T, NX, MODES>,
    predicted: &SomeInnovations<'_, T, NX, NZ, MODES>,
    model: &M,
    detections: &[Detection<T, NZ>],
) -> ([T; MODES], u16) {
    let mut ln_likelihood = [-T::ONE / T::ZERO; MODES];
    let mut resets = 0;
    for r in 0..MODES {
        if !predicted.corrects(r) {
            continue;
        }
        let innovation = &predicted.innovations()[r];
        let weighed = evidence.associated().filter_map(|(number, beta)| Some((detections.get(usize::from(number))?, beta)));
        let (correction, ln_l) = combined(innovation, model, weighed);
        ln_likelihood[r] = ln_l;
        resets += u16::from(!bank.modes[r].correct(&innovation.cross, &correction));
    }
    (ln_likelihood, resets)
}

/// The correction by the combined residual, and its ln L.
fn combined<'a, T: Real, M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize>(
    innovation: &Innovation<T, NX, NZ>,
    model: &M,
    weighed: impl Iterator<Item = (&'a Detection<T, NZ>, T)>,
) -> (Correction<T, NZ>, T) {
    let (mut w, mut e, mut nu_sum) = (SVector::<T, NZ>::zeros(), Symmetric::<T, NZ>::zeros(), SVector::<T, NZ>::zeros());
    let (mut density, mut most) = (innovation.density, T::ZERO);
    for (detection, beta) in weighed {
        let own = density_of(innovation, detection);
        let nu = model.residual(&detection.z, &innovation.z_hat);
        let u = SVector::from(own.s_inv.times(&nu.data.0[0]));
        (w, nu_sum) = (w + u * beta, nu_sum + nu * beta);
        e = Symmetric::from_fn(|k, l| e.upper()[k][l] + beta * (own.s_inv.upper()[k][l] - u[k] * u[l]));
        if beta > most {
            (density, most) = (own, beta);
        }
    }
    let e = Symmetric::from_fn(|k, l| e.upper()[k][l] + w[k] * w[l]);
    (Correction { w: w.data.0[0], e }, density.ln_at(&nu_sum))
}
