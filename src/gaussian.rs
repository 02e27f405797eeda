//! Gaussian densities: what a track is made of, how a measurement sees it, and how it is corrected.
//!
//! ```text
//! innovation    G = P H',  S = H G + R,  N(ν; 0, S) = peak · exp(−½ ν' S⁻¹ ν),  peak = 1 / √det 2πS
//! correction    x ← x + G w,  P ← P − G E G'
//!   Kalman      w = S⁻¹ ν,            E = S⁻¹
//!   association w = Σ p_i S_i⁻¹ ν_i,  E = Σ p_i S_i⁻¹ − (Σ p_i w_i w_i' − w w'),  w_i = S_i⁻¹ ν_i
//! mixture       x = Σ c_i x_i,  P = Σ c_i (P_i + (x_i − x)(x_i − x)')
//! ```
//!
//! The gain K = G S⁻¹ is never formed. The association form is the probabilistic data association update
//! P − (1 − β₀) K S K' + K (Σ β_i ν_i ν_i' − ν ν') K' (Bar-Shalom, Willett and Tian, *Tracking and Data Fusion*,
//! 2011, eq. 3.4.2-10) with K taken out on both sides; written this way each detection may bring its own R_i.
//!
//! Covariances are symmetric by type. The correction subtracts: where the noise is far smaller than what it corrects, rounding
//! leaves nothing definite of P − G E G'. An innovation knows whether it is so [`sharp`](Innovation::sharp), and
//! [`Gaussian::update_joseph`] then does what only adds positive terms, at about three times the cost.

use crate::scalar::{Real, exp2, is_plus_zero, larger, ln};
use crate::symmetric::Symmetric;
use core::borrow::Borrow;
use nalgebra::{SMatrix, SVector};

/// A Gaussian density of an `NX`-state, or an estimate with its covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gaussian<T, const NX: usize> {
    /// x, the mean
    pub mean: SVector<T, NX>,
    /// P, the covariance
    pub cov: Symmetric<T, NX>,
}

/// A predicted measurement and all that an update needs: S is factorised once, here.
///
/// Where S is not positive definite, the density is zero everywhere (`peak` = 0) and S⁻¹ = 0, so that a correction by it
/// changes nothing.
#[derive(Clone, Copy, Debug)]
pub struct Innovation<T, const NX: usize, const NZ: usize> {
    /// ẑ, the predicted measurement
    pub z_hat: SVector<T, NZ>,
    /// G = P H', the covariance between state and measurement
    pub cross: SMatrix<T, NX, NZ>,
    /// H P H', the covariance of the predicted measurement without the noise
    pub spread: Symmetric<T, NZ>,
    /// S⁻¹ and the normalisation of the density
    pub density: ResidualDensity<T, NZ>,
    /// Whether a variance of the noise is below 2¹³ ε of that of the predicted measurement (10⁻³ in single precision):
    /// corrections that subtract may then leave a covariance that is not definite
    pub sharp: bool,
}

/// The zero-mean Gaussian density of a residual.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ResidualDensity<T, const NZ: usize> {
    /// S⁻¹
    pub s_inv: Symmetric<T, NZ>,
    /// The density at zero, 1 / √det 2πS
    pub peak: T,
    /// det S
    pub det: T,
    /// The first variance in S: no residual inside a gate γ has a first coordinate beyond √(γ S₁₁)
    pub first: T,
}

/// A correction of a Gaussian in measurement space: w and E of the module's equations.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Correction<T, const NZ: usize> {
    /// w
    pub w: [T; NZ],
    /// E
    pub e: Symmetric<T, NZ>,
}

impl<T: Real, const NZ: usize> ResidualDensity<T, NZ> {
    /// N(ν; 0, `s`).
    #[inline(always)]
    #[must_use]
    pub fn new(s: &Symmetric<T, NZ>) -> Self {
        let inverse = s.inverse();
        Self { s_inv: inverse.matrix, peak: inverse.root * unit_peak::<T, NZ>(), det: inverse.det, first: s.upper()[0][0] }
    }

    /// Whether S was positive definite.
    #[inline(always)]
    #[must_use]
    pub fn is_proper(&self) -> bool {
        self.peak > T::ZERO
    }

    /// The normalised innovation squared ν' S⁻¹ ν.
    #[inline(always)]
    #[must_use]
    pub fn nis(&self, nu: &SVector<T, NZ>) -> T {
        dot(&nu.data.0[0], &self.s_inv.times(&nu.data.0[0]))
    }

    /// N(ν; 0, S).
    #[inline(always)]
    #[must_use]
    pub fn at(&self, nu: &SVector<T, NZ>) -> T {
        self.of_square(self.nis(nu))
    }

    /// The density where ν' S⁻¹ ν is `nis`.
    #[inline(always)]
    #[must_use]
    pub fn of_square(&self, nis: T) -> T {
        self.peak * exp2(T::lit(-0.5 * core::f64::consts::LOG2_E) * nis)
    }

    /// ln N(ν; 0, S).
    #[inline(always)]
    #[must_use]
    pub fn ln_at(&self, nu: &SVector<T, NZ>) -> T {
        ln(self.peak) - T::lit(0.5) * self.nis(nu)
    }

    /// √det S.
    #[must_use]
    pub fn root_det(&self) -> T {
        unit_peak::<T, NZ>() / self.peak
    }
}

/// (2π)^{−NZ/2}: the density of NZ standard normal numbers at zero.
#[inline(always)]
pub(crate) fn unit_peak<T: Real, const NZ: usize>() -> T {
    let mut peak = T::ONE;
    each!(_k in NZ {
        peak *= T::lit(0.398_942_280_401_432_7);
    });
    peak
}

/// Noise below this many roundings of what it corrects is sharp.
const SHARP: f64 = 8192.0;

impl<T: Real, const NX: usize, const NZ: usize> Innovation<T, NX, NZ> {
    /// From the predicted measurement, G = P H', H P H' and the noise R.
    #[inline(always)]
    #[must_use]
    pub fn new(z_hat: SVector<T, NZ>, cross: SMatrix<T, NX, NZ>, spread: Symmetric<T, NZ>, noise: &Symmetric<T, NZ>) -> Self {
        let density = ResidualDensity::new(&spread.plus(noise));
        let sharp = noise_is_sharp(&spread, noise);
        Self { z_hat, cross, spread, density, sharp }
    }

    /// The gain K = G S⁻¹. For inspection: no filter of this library needs it.
    #[must_use]
    pub fn gain(&self) -> SMatrix<T, NX, NZ> {
        self.cross * self.density.s_inv.to_matrix()
    }

    /// The Kalman correction by the residual `nu`.
    #[inline(always)]
    #[must_use]
    pub fn correction(&self, nu: &SVector<T, NZ>) -> Correction<T, NZ> {
        Correction { w: self.density.s_inv.times(&nu.data.0[0]), e: self.density.s_inv }
    }
}

/// Whether a variance of the noise is sharp beside that of the predicted measurement.
#[inline(always)]
pub(crate) fn noise_is_sharp<T: Real, const NZ: usize>(spread: &Symmetric<T, NZ>, noise: &Symmetric<T, NZ>) -> bool {
    let share = T::EPSILON * T::lit(SHARP);
    // By the signs of differences: in integer registers, where comparisons would wait for flags.
    let mut sharp = false;
    each!(k in NZ {
        sharp |= (noise.upper()[k][k] - share * spread.upper()[k][k]).is_sign_negative();
    });
    sharp
}

/// `noise` with every variance raised to where it is no longer sharp beside that of the predicted measurement.
#[inline(always)]
pub(crate) fn blunted<T: Real, const NZ: usize>(noise: &Symmetric<T, NZ>, spread: &Symmetric<T, NZ>) -> Symmetric<T, NZ> {
    let share = T::EPSILON * T::lit(SHARP);
    Symmetric::from_fn(|k, l| if k == l { larger(noise.upper()[k][k], share * spread.upper()[k][k]) } else { noise.upper()[k][l] })
}

impl<T: Real, const NX: usize> Gaussian<T, NX> {
    /// All zero bits: what a free track slot holds.
    pub const ZERO: Self = Self { mean: zero_vector(), cov: Symmetric::zeros() };

    /// The density N(x; `mean`, `cov`).
    #[must_use]
    pub const fn new(mean: SVector<T, NX>, cov: Symmetric<T, NX>) -> Self {
        Self { mean, cov }
    }

    /// x ← x + G w, P ← P − G E G'. Where P would not keep finite variances that are not negative, or w is not finite,
    /// nothing changes and the answer is `false`.
    ///
    /// Cost: 2 NX·NZ + NX·NZ² + NX(NX + 1)/2 · NZ multiply-adds.
    #[cfg(not(small))]
    #[inline(always)]
    #[must_use]
    pub fn correct<const NZ: usize>(&mut self, cross: &SMatrix<T, NX, NZ>, by: &Correction<T, NZ>) -> bool {
        let g = &cross.data.0;
        let p = self.cov.upper_mut();
        // G E, and the variances first. The flaw is zero while all is well, positive or NaN otherwise.
        let rows: [[T; NZ]; NX] = core::array::from_fn(|i| core::array::from_fn(|k| g[k][i]));
        let ge = rows.each_ref().map(|row| by.e.times(row));
        let taken: [T; NX] = core::array::from_fn(|i| dot(&ge[i], &rows[i]));
        let variance: [T; NX] = core::array::from_fn(|i| p[i][i] - taken[i]);
        let flaw = sum(&variance.map(|v| v.abs() - v)) + sum(&by.w) * T::ZERO;
        if !is_plus_zero(flaw) {
            return false;
        }
        let moved: [T; NX] = core::array::from_fn(|i| dot(&rows[i], &by.w));
        for i in 0..NX {
            self.mean.data.0[0][i] += moved[i];
        }
        unrolled!(for i in NX {
            p[i][i] = variance[i];
            let (mut taken, mut product) = ([T::ZERO; NX], [T::ZERO; NX]);
            for j in i + 1..NX {
                taken[j] = ge[i][0] * rows[j][0];
            }
            for k in 1..NZ {
                for j in i + 1..NX {
                    product[j] = ge[i][k] * rows[j][k];
                }
                for j in i + 1..NX {
                    taken[j] += product[j];
                }
            }
            for j in i + 1..NX {
                p[i][j] -= taken[j];
            }
        });
        true
    }

    /// x ← x + G w, P ← P − G E G'. Where P would not keep finite variances that are not negative, or w is not finite,
    /// nothing changes and the answer is `false`.
    ///
    /// Cost: that of the form for speed, and G E twice.
    // Loops, one copy for all that correct. The same operations in the same order.
    #[cfg(small)]
    #[inline(never)]
    #[must_use]
    pub fn correct<const NZ: usize>(&mut self, cross: &SMatrix<T, NX, NZ>, by: &Correction<T, NZ>) -> bool {
        let (g, p) = (&cross.data.0, self.cov.upper_mut());
        let row = |i: usize| {
            let mut row = by.w;
            each!(k in NZ {
                row[k] = g[k][i];
            });
            row
        };
        let mut flaw = sum(&by.w) * T::ZERO;
        for i in 0..NX {
            let variance = p[i][i] - dot(&by.e.times(&row(i)), &row(i));
            flaw += variance.abs() - variance;
        }
        if !is_plus_zero(flaw) {
            return false;
        }
        for i in 0..NX {
            let ge = by.e.times(&row(i));
            self.mean.data.0[0][i] += dot(&row(i), &by.w);
            for j in i..NX {
                p[i][j] -= dot(&ge, &row(j));
            }
        }
        true
    }

    /// The Kalman update by the residual `nu`; see [`correct`](Self::correct).
    #[inline(always)]
    #[must_use]
    pub fn update<const NZ: usize>(&mut self, innovation: &Innovation<T, NX, NZ>, nu: &SVector<T, NZ>) -> bool {
        self.correct(&innovation.cross, &innovation.correction(nu))
    }

    /// The Kalman update in Joseph's form, P ← (I − K H) P (I − K H)' + K R K': a sum of positive terms for any gain.
    /// `h` is the Jacobian and `noise` the covariance that `innovation` was made with.
    #[must_use]
    pub fn update_joseph<const NZ: usize>(
        &mut self,
        innovation: &Innovation<T, NX, NZ>,
        h: &SMatrix<T, NZ, NX>,
        noise: &Symmetric<T, NZ>,
        nu: &SVector<T, NZ>,
    ) -> bool {
        let gain = innovation.gain();
        let cov = self.joseph(&gain, h, noise);
        self.replace(self.mean + gain * nu, &cov)
    }

    /// Becomes N(`mean`, `cov`). Where that has no finite variances, or negative ones, nothing changes and the answer is `false`.
    pub(crate) fn replace(&mut self, mean: SVector<T, NX>, cov: &SMatrix<T, NX, NX>) -> bool {
        let new = Self::new(mean, Symmetric::from_matrix(cov));
        let valid = new.cov.has_valid_variances() && new.mean.iter().all(|v| v.is_finite());
        if valid {
            *self = new;
        }
        valid
    }

    /// (I − K H) P (I − K H)' + K R K'
    pub(crate) fn joseph<const NZ: usize>(
        &self,
        gain: &SMatrix<T, NX, NZ>,
        h: &SMatrix<T, NZ, NX>,
        noise: &Symmetric<T, NZ>,
    ) -> SMatrix<T, NX, NX> {
        let keep = SMatrix::<T, NX, NX>::identity() - gain * h;
        keep * self.cov.to_matrix() * keep.transpose() + gain * noise.to_matrix() * gain.transpose()
    }

    /// The mean and covariance of the mixture Σ `weights[i]` · `components[i]`, weights summing to one, from
    /// deviations about the mixed mean (raw second moments cancel to nothing in single precision).
    #[must_use]
    pub fn moment_match<G: Borrow<Self>>(components: impl Iterator<Item = (T, G)> + Clone) -> Self {
        let mut out = Self::ZERO;
        for (weight, g) in components.clone() {
            out.mean += g.borrow().mean * weight;
        }
        for (weight, g) in components {
            let g = g.borrow();
            let d = (g.mean - out.mean).data.0[0];
            for (i, ((row, own), first)) in out.cov.upper_mut().iter_mut().zip(g.cov.upper()).zip(&d).enumerate() {
                for ((p, own), second) in row.iter_mut().zip(own).zip(&d).skip(i) {
                    *p += weight * (*own + *first * *second);
                }
            }
        }
        out
    }
}

/// The zero vector, for `const` initialisers.
#[must_use]
pub(crate) const fn zero_vector<T: Real, const N: usize>() -> SVector<T, N> {
    SVector::from_array_storage(nalgebra::ArrayStorage([[T::ZERO; N]; 1]))
}

#[inline(always)]
pub(crate) fn sum<T: Real, const N: usize>(a: &[T; N]) -> T {
    let mut sum = a[0];
    each!(i in N {
        if i > 0 {
            sum += a[i];
        }
    });
    sum
}

#[inline(always)]
pub(crate) fn dot<T: Real, const N: usize>(a: &[T; N], b: &[T; N]) -> T {
    let mut sum = a[0] * b[0];
    each!(i in N {
        if i > 0 {
            sum += a[i] * b[i];
        }
    });
    sum
}
#[cfg(feature = "defmt")]
impl<T: Real + defmt::Format, const NX: usize> defmt::Format for Gaussian<T, NX> {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "Gaussian {{ mean: {}, cov: {} }}", self.mean.data.0[0], self.cov);
    }
}
