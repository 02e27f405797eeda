//! Two targets that the sensor sees as one: what they give together, and what that says of either.
//!
//! ```text
//! of both      [z; 0] = [s h₁ + (1 − s) h₂; h₁ − h₂] + noise of diag(R_a, R_d)
//! of one       h_u ~ N(ẑ_u, Σ_u), z = ẑ_u + ζ:   [ζ; 0] = [s_t; 1] (h_t − ẑ_u) + noise of W,
//!              W = [s_u² Σ_u + R_a  −s_u Σ_u; ·  Σ_u + R_d],   R = ([s_t 1] W⁻¹ [s_t; 1])⁻¹,   z_t = ẑ_u + R [s_t 1] W⁻¹ [ζ; 0]
//! ```
//!
//! The second is the first with the other target integrated out: a detection of h_t by itself, at z_t with the noise R. One that was
//! not made, of two that are one, is the detection ẑ_u with the noise Σ_u + R_d.

use super::blocks::{self, Blocks};
use super::hypotheses::{Density, Event, Hypothesis, Odds, density_of, density_of_pair};
use crate::gaussian::{ResidualDensity, blunted, dot};
use crate::model::MeasurementModel;
use crate::model::resolution::Resolution;
use crate::scalar::{Real, exp, larger, ln};
use crate::scan::Detection;
use crate::symmetric::Symmetric;
use nalgebra::SVector;

/// Two targets as one to the sensor.
pub(crate) struct AsOne<T, const NZ: usize> {
    /// ln P_u and ln (1 − P_u)
    pub ln_unresolved: T,
    pub ln_resolved: T,
    /// ln (P_Da √det 2πR_d) and ln (1 − P_Da P_G)
    ln_detected: T,
    pub ln_missed: T,
    /// (s, 1 − s)
    share: [T; 2],
    /// ẑ_a and −ẑ_d
    z_hat: SVector<T, NZ>,
    distance: [T; NZ],
    /// A Σ A' and what detections without a noise of their own make of it
    spread: Blocks<T, NZ>,
    density: Density<Blocks<T, NZ>, T>,
    /// R_d, and N(·; 0, H_d P H_d' + R_d)
    cells: Symmetric<T, NZ>,
    together: Density<Symmetric<T, NZ>, T>,
}

impl<T: Real, const NZ: usize> AsOne<T, NZ> {
    /// Of two targets that are predicted at `z_hat` with the covariance `spread`. `noise` is R_a, unless the resolution states it.
    #[inline(always)]
    pub fn new<M: MeasurementModel<T, NX, NZ>, const NX: usize>(
        model: &M,
        z_hat: &[SVector<T, NZ>; 2],
        spread: &Blocks<T, NZ>,
        noise: &Symmetric<T, NZ>,
        resolution: &Resolution<T, NZ>,
        odds: &Odds<T>,
    ) -> Self {
        let Resolution { cells, ln_volume, share, .. } = *resolution;
        let spread = spread.combined([[share, T::ONE - share], [T::ONE, -T::ONE]]);
        let apart = model.difference(&z_hat[0], &z_hat[1]);
        let distance = apart.data.0[0].map(|v| -v);
        let noise = blunted(resolution.noise.as_ref().unwrap_or(noise), &spread.own[0]);
        let together = density_of(&spread.own[1].plus(&cells));
        let ln_unresolved = ln_volume + together.ln_peak - T::lit(0.5) * dot(&distance, &together.inverse.times(&distance));
        let p_detect = resolution.p_detect.unwrap_or(larger(odds.p_detect[0], odds.p_detect[1]));
        Self {
            ln_unresolved,
            // Where rounding leaves no difference to certainty, the least doubt that can be told.
            ln_resolved: ln(larger(T::ONE - exp(ln_unresolved), T::EPSILON)),
            ln_detected: ln(p_detect) + ln_volume,
            ln_missed: ln(T::ONE - p_detect * odds.p_gate),
            share: [share, T::ONE - share],
            // From the second on, not the sum of both: angles may be a whole turn apart.
            z_hat: z_hat[1] + apart * share,
            distance,
            density: density_of_pair(&Blocks { own: [spread.own[0].plus(&noise), spread.own[1].plus(&cells)], ..spread }),
            spread,
            cells,
            together,
        }
    }

    /// They were not detected.
    #[inline(always)]
    pub fn unseen(&self) -> Hypothesis<T, NZ> {
        let inverse = self.together.inverse;
        let u = inverse.times(&self.distance);
        let cross = core::array::from_fn(|k| core::array::from_fn(|l| -inverse.at(k, l)));
        let e = Blocks { own: [inverse; 2], cross };
        Hypothesis { event: Event::Unseen, ln_weight: self.ln_unresolved + self.ln_missed, w: [u, u.map(|v| -v)], e }
    }

    /// `detection`, the candidate `index`, is of both.
    #[inline(always)]
    pub fn merged<M: MeasurementModel<T, NX, NZ>, const NX: usize>(
        &self,
        model: &M,
        detection: &Detection<T, NZ>,
        ln_rate: T,
        index: usize,
    ) -> Hypothesis<T, NZ> {
        let density = match &detection.noise {
            None => self.density,
            Some(noise) => {
                let own = [self.spread.own[0].plus(&blunted(noise, &self.spread.own[0])), self.spread.own[1].plus(&self.cells)];
                density_of_pair(&Blocks { own, ..self.spread })
            }
        };
        let nu = [model.residual(&detection.z, &self.z_hat).data.0[0], self.distance];
        let u = density.inverse.times(&nu);
        let ln_weight = self.ln_detected + ln_rate + density.ln_peak - T::lit(0.5) * blocks::dot(&nu, &u);
        let [first, second] = self.share;
        let w = [core::array::from_fn(|k| first * u[0][k] + u[1][k]), core::array::from_fn(|k| second * u[0][k] - u[1][k])];
        Hypothesis { event: Event::Merged(index), ln_weight, w, e: density.inverse.combined([[first, T::ONE], [second, -T::ONE]]) }
    }

    /// ẑ_a, and the density of what both give about it with the noise `noise`.
    #[inline(always)]
    pub fn predicted(&self, noise: &Symmetric<T, NZ>) -> (SVector<T, NZ>, ResidualDensity<T, NZ>) {
        (self.z_hat, ResidualDensity::new(&self.spread.own[0].plus(noise)))
    }
}

/// What a target that is one with another to the sensor learns of it: the other is predicted at `z_hat` with the covariance `spread`,
/// `share` is that of the target itself, `noise` is R_a. Of no detection, that the other is near.
#[inline(always)]
pub(crate) fn of_one<T: Real, M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize>(
    model: &M,
    (z_hat, spread): (&SVector<T, NZ>, &Symmetric<T, NZ>),
    resolution: &Resolution<T, NZ>,
    share: T,
    noise: &Symmetric<T, NZ>,
    z: Option<&SVector<T, NZ>>,
) -> Detection<T, NZ> {
    let near = spread.plus(&resolution.cells);
    let Some(z) = z else { return Detection::new(z_hat.data.0[0]).with_noise(near) };
    let other = T::ONE - share;
    let cross = core::array::from_fn(|k| core::array::from_fn(|l| -other * spread.at(k, l)));
    let own = Symmetric::from_fn(|k, l| other * other * spread.upper()[k][l] + noise.upper()[k][l]);
    let (inverse, _) = Blocks { own: [own, near], cross }.inverse();
    let zeta = model.residual(z, z_hat).data.0[0];
    let [mut seen, tied] = inverse.times(&[zeta, [T::ZERO; NZ]]);
    for k in 0..NZ {
        seen[k] = share * seen[k] + tied[k];
    }
    // [s 1; · ·] combines the blocks to the information that is wanted.
    let own_noise = inverse.combined([[share, T::ONE], [T::ZERO, T::ONE]]).own[0].inverse().matrix;
    let shift = own_noise.times(&seen);
    Detection::new(core::array::from_fn(|k| z_hat.data.0[0][k] + shift[k])).with_noise(own_noise)
}
