//! What a scan says about one track: gating, likelihoods under every mode, and the update by association weights.
//!
//! With c_r the predicted mode probabilities, L_jr = N(z_j; ẑ_r, S_r) and λ_j the clutter density at z_j:
//!
//! ```text
//! gate     ν' S⁻¹ ν ≤ γ by the mode with the largest det S, one gate for all modes
//! score    h_j = P_D Σ_r c_r L_jr / λ_j,   m = 1 − P_D P_G        (diffuse clutter: λ = number gated / V)
//! absorb   given β_j:  w_jr = β_j L_jr / Σ_s c_s L_js,  w_0r = β_0,  e_r = Σ_j w_jr
//!          μ_r = c_r e_r, and mode r takes the association update with weights w_jr / e_r
//! ```
//!
//! The association is blind to modes and the modes stay exact all the same: for one track this is PDA inside every
//! mode with the mixture likelihood e_r, as corrected in the equations 10–16 of Kashyap et al. (2006). Detections with a
//! time of their own within the scan are in `offset.rs`.
//!
//! Likelihoods are kept relative to e^reference, the largest of the scan, so that an outlier under every mode does
//! not turn probabilities into 0/0. Where a miss is possible the reference stays above −60: likelihoods far below are
//! then zero beside the miss, and the miss is at most e⁶⁰, which single precision holds.

mod offset;

use crate::gaussian::{Correction, Innovation, ResidualDensity};
use crate::mode::{LEAST_PROBABILITY, ModeBank};
use crate::model::MeasurementModel;
use crate::scalar::{Real, exp, larger};
use crate::scan::Detection;
use crate::sensor::{Clutter, Sensor};
use crate::symmetric::Symmetric;
use crate::time::Duration;
use nalgebra::SVector;

/// Densities of clutter below this count as this.
pub(crate) const LEAST_DENSITY: f64 = 1e-30;
/// The least reference where a miss is possible.
const LEAST_REFERENCE: f64 = -60.0;

/// The gated detections of one track with their likelihoods under every mode. Scratch: one serves all tracks.
#[derive(Clone, Debug)]
pub struct Evidence<T, const MODES: usize, const DETS: usize> {
    /// Numbers of the gated detections in the scan.
    gated: heapless::Vec<u16, DETS>,
    /// L_jr e^{−reference}
    likelihood: [[T; MODES]; DETS],
    /// Σ_r c_r L_jr e^{−reference}
    mixture: [T; DETS],
    /// P_D / λ_j times the mixture: the weights of association, on the scale of `miss`
    hit: [T; DETS],
    /// (1 − P_D P_G) e^{−reference}
    miss: T,
}

/// ẑ_r, G_r and S_r of every mode.
pub type Innovations<T, const NX: usize, const NZ: usize, const MODES: usize> = [Innovation<T, NX, NZ>; MODES];

/// The predicted measurements of a bank.
#[inline(always)]
#[must_use]
pub fn innovations<T: Real, M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize, const MODES: usize>(
    bank: &ModeBank<T, NX, MODES>,
    model: &M,
) -> Innovations<T, NX, NZ, MODES> {
    core::array::from_fn(|r| model.innovation(&bank.modes[r]))
}

impl<T: Real, const MODES: usize, const DETS: usize> Default for Evidence<T, MODES, DETS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real, const MODES: usize, const DETS: usize> Evidence<T, MODES, DETS> {
    /// None.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            gated: heapless::Vec::new(),
            likelihood: [[T::ZERO; MODES]; DETS],
            mixture: [T::ZERO; DETS],
            hit: [T::ZERO; DETS],
            miss: T::ZERO,
        }
    }

    /// Numbers of the gated detections in the scan.
    #[must_use]
    pub fn gated(&self) -> &[u16] {
        &self.gated
    }

    /// The weights of association: that of no detection, and those of the gated detections, to be replaced by β.
    #[inline(always)]
    pub fn weights(&mut self) -> (T, &mut [T]) {
        let count = self.gated.len().min(DETS);
        (self.miss, self.hit.get_mut(..count).unwrap_or_default())
    }

    /// The gated detections by number, ascending as the candidates did, with their weights, to be replaced by β.
    #[inline(always)]
    pub fn scored(&mut self) -> impl Iterator<Item = (u16, &mut T)> {
        self.gated.iter().copied().zip(&mut self.hit)
    }

    /// Gates the detections numbered `candidates` and scores them. Returns V, the volume of the gate; zero where no
    /// mode can be measured.
    ///
    /// Cost: one residual and form ν' S⁻¹ ν per candidate, MODES of them and exponentials per gated detection; for those with
    /// an offset a factorisation of S each as well, and once the drift of every mode.
    #[inline(always)]
    pub fn collect<S: Sensor<T, NX, NZ>, const NX: usize, const NZ: usize>(
        &mut self,
        bank: &ModeBank<T, NX, MODES>,
        innovations: &Innovations<T, NX, NZ, MODES>,
        sensor: &S,
        detections: &[Detection<T, NZ>],
        candidates: &[u16],
    ) -> T {
        self.gated.clear();
        let (model, gate) = (sensor.model(), sensor.gate());
        let (mut widest, mut widest_mode) = (Predicted::of(&innovations[0]), 0);
        for (r, innovation) in innovations.iter().enumerate().skip(1) {
            let density = &innovation.density;
            if density.is_proper() && (density.ln_norm < widest.density.ln_norm || !widest.density.is_proper()) {
                (widest, widest_mode) = (Predicted::of(innovation), r);
            }
        }
        let p_detect = sensor.p_detect(&bank.modes[0].mean);
        if !widest.density.is_proper() {
            self.miss = T::ONE;
            return T::ZERO;
        }
        match kind_of(detections, candidates) {
            Kind::Plain => self.gate::<_, true, NX, NZ>(&widest, innovations, model, gate.threshold(), detections, candidates),
            Kind::OwnNoise => self.gate_with_noise(&widest, innovations, model, gate.threshold(), detections, candidates),
            Kind::OwnTime => self.gate_at_their_times(bank, innovations, sensor, detections, candidates, widest_mode),
        }
        let volume = gate.volume(widest.density.root_det());
        let diffuse = T::from_count(self.gated.len()) / volume;
        self.score(&bank.prob, p_detect, T::ONE - p_detect * gate.p_gate(), |number| {
            match detections.get(usize::from(number)).map(|d| sensor.clutter(&d.z)) {
                Some(Clutter::Poisson(density)) => density,
                Some(Clutter::Diffuse) | None => diffuse,
            }
        });
        volume
    }

    /// Gates by `widest`, and writes ln L of the detections in the gate; `score` makes likelihoods of them. With `PLAIN` no
    /// detection has a noise of its own.
    #[inline(always)]
    fn gate<M: MeasurementModel<T, NX, NZ>, const PLAIN: bool, const NX: usize, const NZ: usize>(
        &mut self,
        widest: &Predicted<T, NZ>,
        innovations: &Innovations<T, NX, NZ, MODES>,
        model: &M,
        threshold: T,
        detections: &[Detection<T, NZ>],
        candidates: &[u16],
    ) {
        for &number in candidates {
            let Some(detection) = detections.get(usize::from(number)) else { continue };
            let density = |p: &Predicted<T, NZ>| if PLAIN { p.density } else { p.density_of(detection) };
            if density(widest).nis(&model.residual(&detection.z, &widest.z_hat)) <= threshold
                && let Some(row) = self.admit(number)
            {
                for (ln_l, innovation) in row.iter_mut().zip(innovations) {
                    let nu = model.residual(&detection.z, &innovation.z_hat);
                    *ln_l = density(&Predicted::of(innovation)).ln_at(&nu);
                }
            }
        }
    }

    #[inline(never)]
    fn gate_with_noise<M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize>(
        &mut self,
        widest: &Predicted<T, NZ>,
        innovations: &Innovations<T, NX, NZ, MODES>,
        model: &M,
        threshold: T,
        detections: &[Detection<T, NZ>],
        candidates: &[u16],
    ) {
        self.gate::<_, false, NX, NZ>(widest, innovations, model, threshold, detections, candidates);
    }

    /// The row of likelihoods of one more gated detection.
    #[inline(always)]
    fn admit(&mut self, number: u16) -> Option<&mut [T; MODES]> {
        let slot = self.gated.len();
        self.gated.push(number).ok()?;
        self.likelihood.get_mut(slot)
    }

    /// From ln L to weights on one scale: `p_miss` = 1 − P_D P_G, `density` the clutter at a detection.
    #[inline(always)]
    fn score(&mut self, c: &[T; MODES], p_detect: T, p_miss: T, density: impl Fn(u16) -> T) {
        let mut reference = if p_miss > T::ZERO { T::lit(LEAST_REFERENCE) } else { -T::ONE / T::ZERO };
        for ln_l in self.likelihood.iter().take(self.gated.len()) {
            for (ln_l, c) in ln_l.iter().zip(c) {
                if *c > T::lit(LEAST_PROBABILITY) && *ln_l > reference {
                    reference = *ln_l;
                }
            }
        }
        if self.gated.is_empty() || !reference.is_finite() {
            self.miss = T::ONE;
            self.hit.iter_mut().take(self.gated.len()).for_each(|hit| *hit = T::ZERO);
            return;
        }
        for (((number, row), mixture), hit) in self.gated.iter().zip(&mut self.likelihood).zip(&mut self.mixture).zip(&mut self.hit) {
            *mixture = T::ZERO;
            for (l, c) in row.iter_mut().zip(c) {
                *l = if *c > T::lit(LEAST_PROBABILITY) { exp(*l - reference) } else { T::ZERO };
                *mixture += *c * *l;
            }
            *hit = *mixture * (p_detect / larger(density(*number), T::lit(LEAST_DENSITY)));
        }
        self.miss = p_miss * exp(-reference);
    }

    /// Updates `bank` by the association probabilities: `beta_0`, and those that replaced the weights of the gated
    /// detections. Returns how many corrections were refused because they would have broken a covariance.
    ///
    /// Cost per mode: about 12 NZ² + 2 operations a gated detection, and one [`correct`](crate::gaussian::Gaussian::correct);
    /// where a gated detection has an offset, the drift of the mode and two corrections a gated detection.
    #[inline(always)]
    pub fn absorb<M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize>(
        &mut self,
        beta_0: T,
        bank: &mut ModeBank<T, NX, MODES>,
        innovations: &Innovations<T, NX, NZ, MODES>,
        model: &M,
        detections: &[Detection<T, NZ>],
    ) -> u16 {
        if self.gated.is_empty() {
            return 0;
        }
        for (beta, mixture) in self.hit.iter_mut().zip(&self.mixture).take(self.gated.len()) {
            *beta = if *mixture > T::lit(LEAST_PROBABILITY) { *beta / *mixture } else { T::ZERO };
        }
        let kind = kind_of(detections, &self.gated);
        let mut resets = 0;
        let mut sum = T::ZERO;
        let mut prob = bank.prob;
        for r in 0..MODES {
            let (mode, innovation) = (&mut bank.modes[r], &innovations[r]);
            let (evidence, kept) = if let Kind::OwnTime = kind {
                self.correct_one_by_one(r, beta_0, mode, innovation, model, detections)
            } else {
                let (evidence, correction) = match kind {
                    Kind::Plain => self.correction::<_, true, NX, NZ>(r, beta_0, innovation, model, detections),
                    _ => self.correction_with_noise(r, beta_0, innovation, model, detections),
                };
                // False for what is no number, too: there is nothing to correct by.
                let likely = evidence > T::lit(LEAST_PROBABILITY);
                (evidence, !likely || mode.correct(&innovation.cross, &correction))
            };
            prob[r] *= evidence;
            sum += prob[r];
            resets += u16::from(!kept);
        }
        let scale = T::ONE / sum;
        if sum > T::ZERO && scale.is_finite() {
            for (mode, p) in bank.prob.iter_mut().zip(prob) {
                *mode = p * scale;
            }
        }
        resets
    }

    #[inline(never)]
    fn correction_with_noise<M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize>(
        &self,
        r: usize,
        beta_0: T,
        innovation: &Innovation<T, NX, NZ>,
        model: &M,
        detections: &[Detection<T, NZ>],
    ) -> (T, Correction<T, NZ>) {
        self.correction::<_, false, NX, NZ>(r, beta_0, innovation, model, detections)
    }

    /// e_r, and the association update of mode r. With `PLAIN` no detection has a noise of its own.
    #[inline(always)]
    fn correction<M: MeasurementModel<T, NX, NZ>, const PLAIN: bool, const NX: usize, const NZ: usize>(
        &self,
        r: usize,
        beta_0: T,
        innovation: &Innovation<T, NX, NZ>,
        model: &M,
        detections: &[Detection<T, NZ>],
    ) -> (T, Correction<T, NZ>) {
        let (mut evidence, mut shared) = (beta_0, T::ZERO);
        let mut w = [T::ZERO; NZ];
        // Σ p S⁻¹ of detections with a noise of their own, less Σ p w w'.
        let mut e = Symmetric::<T, NZ>::zeros();
        for ((number, likelihood), q) in self.gated.iter().zip(&self.likelihood).zip(&self.hit) {
            let p = *q * likelihood[r];
            let Some(detection) = detections.get(usize::from(*number)) else { continue };
            let nu = model.residual(&detection.z, &innovation.z_hat);
            let u = if !PLAIN && detection.noise.is_some() {
                let density = Predicted::of(innovation).density_of(detection);
                for k in 0..NZ {
                    for l in k..NZ {
                        e.upper_mut()[k][l] += p * density.s_inv.upper()[k][l];
                    }
                }
                density.s_inv.times(&nu.data.0[0])
            } else {
                shared += p;
                innovation.density.s_inv.times(&nu.data.0[0])
            };
            evidence += p;
            for k in 0..NZ {
                let pu = p * u[k];
                w[k] += pu;
                for l in k..NZ {
                    e.upper_mut()[k][l] -= pu * u[l];
                }
            }
        }
        let scale = T::ONE / evidence;
        let w = w.map(|v| v * scale);
        let s_inv = innovation.density.s_inv.upper();
        let e = Symmetric::from_fn(|k, l| (e.upper()[k][l] + shared * s_inv[k][l]) * scale + w[k] * w[l]);
        (evidence, Correction { w, e })
    }
}

/// What the detections of a scan bring besides their coordinates.
#[derive(Clone, Copy)]
enum Kind {
    Plain,
    OwnNoise,
    OwnTime,
}

/// The most that any of the detections numbered `numbers` brings.
#[inline(always)]
fn kind_of<T, const NZ: usize>(detections: &[Detection<T, NZ>], numbers: &[u16]) -> Kind {
    let mut kind = Kind::Plain;
    for detection in numbers.iter().filter_map(|number| detections.get(usize::from(*number))) {
        if detection.offset != Duration::ZERO {
            return Kind::OwnTime;
        }
        if detection.noise.is_some() {
            kind = Kind::OwnNoise;
        }
    }
    kind
}

/// What gating needs of an innovation: copied, unlike the wide G = P H'.
#[derive(Clone, Copy)]
struct Predicted<T, const NZ: usize> {
    z_hat: SVector<T, NZ>,
    spread: Symmetric<T, NZ>,
    density: ResidualDensity<T, NZ>,
}

impl<T: Real, const NZ: usize> Predicted<T, NZ> {
    #[inline(always)]
    fn of<const NX: usize>(innovation: &Innovation<T, NX, NZ>) -> Self {
        Self { z_hat: innovation.z_hat, spread: innovation.spread, density: innovation.density }
    }

    /// The density of `detection` about the prediction: with its own noise, or the sensor's.
    #[inline(always)]
    fn density_of(&self, detection: &Detection<T, NZ>) -> ResidualDensity<T, NZ> {
        match &detection.noise {
            Some(noise) => ResidualDensity::new(&self.spread.plus(noise)),
            None => self.density,
        }
    }
}

/// Updates a bank by one measurement that is certainly the target's: the plain IMM update.
///
/// ```text
/// μ_r = c_r N(ν_r; 0, S_r) / Σ_s c_s N(ν_s; 0, S_s),   mode r takes the Kalman update by ν_r
/// ```
///
/// Returns how many corrections were refused.
pub fn update_by_one<T: Real, M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize, const MODES: usize>(
    bank: &mut ModeBank<T, NX, MODES>,
    model: &M,
    z: &SVector<T, NZ>,
) -> u16 {
    let innovations = innovations(bank, model);
    let mut evidence = Evidence::<T, MODES, 1>::new();
    if evidence.gated.push(0).is_err() {
        return 0;
    }
    for (ln_l, innovation) in evidence.likelihood[0].iter_mut().zip(&innovations) {
        *ln_l = innovation.density.ln_at(&model.residual(z, &innovation.z_hat));
    }
    evidence.score(&bank.prob, T::ONE, T::ZERO, |_| T::ONE);
    evidence.hit[0] = T::ONE;
    let detection = Detection { z: *z, noise: None, amplitude: None, offset: Duration::ZERO };
    evidence.absorb(T::ZERO, bank, &innovations, model, &[detection])
}
