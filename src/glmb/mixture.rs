//! A mixture of Gaussians in every mode.
//!
//! ```text
//! predict   mode j comes of all (i, c) with the weights π_ij w_ic: the COMPS − 1 heaviest as they are, the rest moment matched
//! weigh     M_j = Σ_ic w_ic P_D,i(x_ic) N(z_j; ẑ_ic, S_ic) over the components in whose gate z_j lies
//! absorb    w_ic ∝ w_ic P_D,i N(z_j; ẑ_ic, S_ic), Kalman's update of every component;  w_ic (1 − P_D,i P_G) without a detection
//! ```
//!
//! With `COMPS` = 1 it is the interacting multiple model's bank, one Gaussian in every mode. With MODES^{s−1} it keeps
//! every sequence of modes for s scans, and is exact for linear models. The models decide the rest: linear, extended or, in
//! [`Unscented`](crate::model::unscented::Unscented), sigma points.

use super::density::{Density, Sight};
use crate::gaussian::{Gaussian, Innovation};
use crate::mode::{JumpMatrix, LEAST_PROBABILITY, ModeBank, ModeSet};
use crate::model::MeasurementModel;
use crate::model::offset::Drift;
use crate::order::sort;
use crate::scalar::{Real, is_finite};
use crate::scan::Detection;
use crate::sensor::Sensor;
use rand_core::Rng;

/// Up to `COMPS` Gaussians in each of `MODES` modes: the probabilities of all banks together sum to one.
///
/// A prediction costs `COMPS` predictions of every mode and, with more than one component, MODES sorts of COMPS MODES weights
/// with as many moment matches; one detection a factorisation of S and a residual for every component.
#[derive(Clone, Copy, Debug)]
pub struct Mixture<T, const NX: usize, const MODES: usize, const COMPS: usize> {
    banks: [ModeBank<T, NX, MODES>; COMPS],
}

impl<T: Real, const NX: usize, const MODES: usize, const COMPS: usize> Mixture<T, NX, MODES, COMPS> {
    /// (weight, mode, Gaussian) of all components that have a weight.
    pub fn components(&self) -> impl Iterator<Item = (T, usize, &Gaussian<T, NX>)> + Clone {
        let weighed = |bank: &ModeBank<T, NX, MODES>| bank.prob.iter().any(|p| *p > T::ZERO);
        let all = self.banks.iter().filter(move |bank| weighed(bank)).flat_map(|bank| bank.prob.iter().zip(&bank.modes).enumerate());
        all.filter(|(_, (weight, _))| **weight > T::ZERO).map(|(mode, (weight, g))| (*weight, mode, g))
    }

    /// Every mode from all it can be reached from, [`ModeBank::interact`] for many components.
    fn interact(&mut self, jump: &JumpMatrix<T, MODES>) {
        let before = *self;
        let mut sum = T::ZERO;
        for to in 0..MODES {
            let mut sources = [[(T::ZERO, &before.banks[0].modes[0]); MODES]; COMPS];
            for (sources, bank) in sources.iter_mut().zip(&before.banks) {
                for (from, source) in sources.iter_mut().enumerate() {
                    *source = (jump[from][to] * bank.prob[from], &bank.modes[from]);
                }
            }
            let sources = sources.as_flattened_mut();
            sort(sources, |a, b| a.0 > b.0);
            let rest = sources.get(COMPS - 1..).unwrap_or_default();
            let weight = rest.iter().fold(T::ZERO, |sum, (w, _)| sum + *w);
            for (bank, (w, g)) in self.banks.iter_mut().zip(sources.iter()) {
                (bank.prob[to], bank.modes[to]) = (*w, **g);
            }
            let scale = if weight > T::lit(LEAST_PROBABILITY) { T::ONE / weight } else { T::ZERO };
            let possible = rest.iter().filter(|(w, _)| *w * scale > T::ZERO);
            if let Some(last) = self.banks.last_mut() {
                last.prob[to] = weight * if scale > T::ZERO { T::ONE } else { T::ZERO };
                if possible.clone().count() > 1 {
                    last.modes[to] = Gaussian::moment_match(possible.map(|(w, g)| (*w * scale, *g)));
                }
            }
            sum += self.banks.iter().fold(T::ZERO, |sum, bank| sum + bank.prob[to]);
        }
        self.scale(sum);
    }

    /// Divides all weights by `sum`.
    fn scale(&mut self, sum: T) {
        let scale = T::ONE / sum;
        if sum > T::ZERO && is_finite(scale) {
            self.banks.iter_mut().flat_map(|bank| &mut bank.prob).for_each(|p| *p *= scale);
        }
    }
}

/// The predicted measurement of `g` as a detection with a noise or a time of its own sees it.
// Out of line: plain detections pay for one look.
#[inline(never)]
fn seen_apart<T: Real, M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize>(
    model: &M,
    g: &Gaussian<T, NX>,
    innovation: &Innovation<T, NX, NZ>,
    detection: &Detection<T, NZ>,
) -> Innovation<T, NX, NZ> {
    Drift::new(model, g, innovation).seen(innovation, detection.offset.as_secs(), detection.noise.as_ref())
}

/// The density of `detection` in the gate of `g`; zero outside.
#[inline(always)]
pub(super) fn gated_density<T: Real, S: Sensor<T, NX, NZ>, const NX: usize, const NZ: usize>(
    sensor: &S,
    g: &Gaussian<T, NX>,
    innovation: &Innovation<T, NX, NZ>,
    detection: &Detection<T, NZ>,
) -> T {
    let (model, threshold) = (sensor.model(), sensor.gate().threshold());
    if detection.is_plain() {
        let nu = model.residual(&detection.z, &innovation.z_hat);
        // The box: a residual in the gate has no first coordinate beyond √(γ S₁₁).
        let first = nu.data.0[0][0];
        if first * first > threshold * innovation.density.first {
            return T::ZERO;
        }
        let nis = innovation.density.nis(&nu);
        return if nis <= threshold { innovation.density.of_square(nis) } else { T::ZERO };
    }
    let seen = seen_apart(model, g, innovation, detection);
    let nis = seen.density.nis(&model.residual(&detection.z, &seen.z_hat));
    if nis <= threshold { seen.density.of_square(nis) } else { T::ZERO }
}

/// [`Density::weigh`] of one Gaussian, of a weight and a mode: its share of M_j and m.
#[inline(always)]
pub(super) fn weigh_part<S: Sensor<T, NX, NZ>, T: Real, const NX: usize, const NZ: usize, const MODES: usize>(
    sight: &Sight<'_, S, T, MODES>,
    (weight, mode, g): (T, usize, &Gaussian<T, NX>),
    detections: &[Detection<T, NZ>],
    candidates: &[u16],
    weights: &mut [T],
) -> T {
    let (innovation, p_detect) = (sight.sensor.model().innovation(g), sight.p_detect(mode, &g.mean));
    for (number, sum) in candidates.iter().zip(weights) {
        let Some(detection) = detections.get(usize::from(*number)) else { break };
        let density = gated_density(sight.sensor, g, &innovation, detection);
        if density > T::ZERO {
            *sum += weight * p_detect * density;
        }
    }
    weight * (T::ONE - p_detect * sight.sensor.gate().p_gate())
}

/// Kalman's update of `g`, whose predicted measurement is `innovation`, by `detection`. `false` where that would break the
/// covariance.
pub(super) fn correct<T: Real, M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize>(
    model: &M,
    g: &mut Gaussian<T, NX>,
    innovation: &Innovation<T, NX, NZ>,
    detection: &Detection<T, NZ>,
) -> bool {
    let innovation = if detection.is_plain() { *innovation } else { seen_apart(model, g, innovation, detection) };
    let nu = model.residual(&detection.z, &innovation.z_hat);
    if innovation.sharp {
        let noise = detection.noise.unwrap_or_else(|| model.noise(&g.mean));
        return g.update_joseph(&innovation, &model.jacobian(&g.mean), &noise, &nu);
    }
    g.update(&innovation, &nu)
}

impl<T: Real, const NX: usize, const MODES: usize, const COMPS: usize> Density<T, NX, MODES> for Mixture<T, NX, MODES, COMPS> {
    const ZERO: Self = {
        assert!(COMPS >= 1 && MODES >= 1, "a mixture needs a component");
        Self { banks: [ModeBank::ZERO; COMPS] }
    };
    const COMPONENTS: usize = MODES * COMPS;

    fn bear<R: Rng>(&mut self, g: &Gaussian<T, NX>, prob: &[T; MODES], _: &mut R) {
        *self = Self::ZERO;
        self.banks[0] = ModeBank::new(*prob, *g);
    }

    fn predict<M: ModeSet<T, NX, MODES>, R: Rng>(&mut self, modes: &M, jump: &JumpMatrix<T, MODES>, steps: &M::Steps, _: &mut R) {
        if COMPS == 1 {
            self.banks[0].interact(jump);
        } else {
            self.interact(jump);
        }
        for bank in &mut self.banks {
            for (mode, (g, _)) in bank.modes.iter_mut().zip(&bank.prob).enumerate().filter(|(_, (_, weight))| **weight > T::ZERO) {
                modes.advance(mode, g, steps);
            }
        }
    }

    fn weigh<S: Sensor<T, NX, NZ>, const NZ: usize>(
        &self,
        sight: &Sight<'_, S, T, MODES>,
        detections: &[Detection<T, NZ>],
        candidates: &[u16],
        weights: &mut [T],
    ) -> T {
        self.components().fold(T::ZERO, |miss, part| miss + weigh_part(sight, part, detections, candidates, weights))
    }

    fn absorb<S: Sensor<T, NX, NZ>, R: Rng, const NZ: usize>(
        &self,
        child: &mut Self,
        sight: &Sight<'_, S, T, MODES>,
        detection: Option<&Detection<T, NZ>>,
        _: &mut R,
    ) -> u16 {
        *child = *self;
        let (mut sum, mut resets) = (T::ZERO, 0);
        for bank in &mut child.banks {
            for mode in 0..MODES {
                let (weight, g) = (&mut bank.prob[mode], &mut bank.modes[mode]);
                if *weight <= T::ZERO {
                    continue;
                }
                let p_detect = sight.p_detect(mode, &g.mean);
                if let Some(detection) = detection {
                    let (model, innovation) = (sight.sensor.model(), sight.sensor.model().innovation(g));
                    *weight *= p_detect * gated_density(sight.sensor, g, &innovation, detection);
                    resets += u16::from(*weight > T::ZERO && !correct(model, g, &innovation, detection));
                } else {
                    *weight *= T::ONE - p_detect * sight.sensor.gate().p_gate();
                }
                sum += *weight;
            }
        }
        child.scale(sum);
        if sum <= T::ZERO {
            // Not to be missed, and missed: nothing is learnt of the mode.
            child.banks.iter_mut().zip(&self.banks).for_each(|(bank, before)| bank.prob = before.prob);
        }
        resets
    }

    fn prob(&self) -> [T; MODES] {
        core::array::from_fn(|mode| self.banks.iter().fold(T::ZERO, |sum, bank| sum + bank.prob[mode]))
    }

    fn combined(&self) -> Gaussian<T, NX> {
        Gaussian::moment_match(self.components().map(|(weight, _, g)| (weight, g)))
    }

    fn is_valid(&self) -> bool {
        self.banks.iter().all(ModeBank::is_valid)
    }
}
