//! Polar measurements converted to Cartesian: position and covariance for linear filters and for starting tracks.
//!
//! Along (r), across (c) and, in space, above (v) the line of sight to (range r, azimuth 0, elevation ε):
//!
//! ```text
//! linear     R = diag(σ_r², r² cos²ε σ_a², r² σ_e²) in the line-of-sight frame
//! debiased   λ = e^{−σ_a²/2}, μ = e^{−σ_e²/2}, A = 1 − λ², B = 1 − μ², c = cos ε, s = sin ε
//!   position (r c / λμ, 0, r s / μ), turned by the azimuth
//!   R_xx = r² λ² B (½B + μ² s²) + (½A² r² + (λ² + ½A²) σ_r²) h,   h = ½ (1 − μ⁴) + μ⁴ c²
//!   R_yy = ½ (r² + σ_r²) A (1 + λ²) h
//!   R_zz = r² B (½B + μ² c²) + σ_r² (½ (1 − μ⁴) + μ⁴ s²)
//!   R_xz = λ s c (σ_r² μ⁴ − r² μ² B)
//! ```
//!
//! The plane is ε = 0, μ = 1. The debiased form is the modified unbiased conversion (Longbin, Xiaoquan, Yiyu, Kang and
//! Bar-Shalom, *IEEE Trans. AES* 34(3), 1998) with every difference of near-equal second moments worked out, so that
//! it keeps its digits in single precision; A and B come from a series, not from 1 − e^{−σ²}. It is needed when
//! r σ_a² / σ_r exceeds about 0.4 (Lerro and Bar-Shalom 1993); below, both agree.

use crate::scalar::{Real, exp, polynomial, sin_cos, sqrt};
use crate::symmetric::Symmetric;

/// A polar measurement with independent errors.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Polar<T> {
    /// Range \[m\]
    pub range: T,
    /// Azimuth \[rad\], counter-clockwise from x
    pub azimuth: T,
    /// Elevation \[rad\] above the plane
    pub elevation: T,
    /// Variance of the range \[m²\]
    pub range_variance: T,
    /// Variance of the azimuth \[rad²\]
    pub azimuth_variance: T,
    /// Variance of the elevation \[rad²\]
    pub elevation_variance: T,
}

/// A Cartesian position relative to the sensor, with its covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Converted<T> {
    /// Position \[m\]
    pub position: [T; 3],
    /// Covariance \[m²\]
    pub cov: Symmetric<T, 3>,
}

/// 1 − e^{−x} for x ≥ 0 without cancellation.
fn one_minus_exp<T: Real>(x: T) -> T {
    if x > T::lit(0.5) {
        return T::ONE - exp(-x);
    }
    // 1/n! with alternating signs
    let series = polynomial!(x;
        1.0, -1.0 / 2.0, 1.0 / 6.0, -1.0 / 24.0, 1.0 / 120.0, -1.0 / 720.0, 1.0 / 5040.0, -1.0 / 40_320.0;
        1.0 / 362_880.0, -1.0 / 3_628_800.0, 1.0 / 39_916_800.0, -1.0 / 479_001_600.0, 1.0 / 6_227_020_800.0,
        -1.0 / 87_178_291_200.0, 1.0 / 1_307_674_368_000.0);
    x * series
}

impl<T: Real> Polar<T> {
    /// Range and azimuth in the plane.
    #[must_use]
    pub fn in_plane(range: T, azimuth: T, range_variance: T, azimuth_variance: T) -> Self {
        Self { range, azimuth, elevation: T::ZERO, range_variance, azimuth_variance, elevation_variance: T::ZERO }
    }

    /// The first-order conversion R = J diag(σ²) J'.
    #[must_use]
    pub fn linear(&self) -> Converted<T> {
        let (s, c) = sin_cos(self.elevation);
        let r2 = self.range * self.range;
        let (along, across, above) = (self.range_variance, r2 * c * c * self.azimuth_variance, r2 * self.elevation_variance);
        let (xx, zz) = (c * c * along + s * s * above, s * s * along + c * c * above);
        self.turned(self.range * c, self.range * s, [xx, across, zz, s * c * (along - above)])
    }

    /// The debiased conversion of the module's equations.
    #[must_use]
    pub fn debiased(&self) -> Converted<T> {
        let (s, c) = sin_cos(self.elevation);
        let half = T::lit(0.5);
        let (a, b) = (one_minus_exp(self.azimuth_variance), one_minus_exp(self.elevation_variance));
        let (lambda2, mu2) = (T::ONE - a, T::ONE - b);
        let (lambda, mu, mu4) = (sqrt(lambda2), sqrt(mu2), mu2 * mu2);
        let (r2, var) = (self.range * self.range, self.range_variance);
        let spread = half * b * (T::ONE + mu2);
        let h = spread + mu4 * c * c;
        let xx = r2 * lambda2 * b * (half * b + mu2 * s * s) + (half * a * a * r2 + (lambda2 + half * a * a) * var) * h;
        let yy = half * (r2 + var) * a * (T::ONE + lambda2) * h;
        let zz = r2 * b * (half * b + mu2 * c * c) + var * (spread + mu4 * s * s);
        let xz = lambda * s * c * (var * mu4 - r2 * mu2 * b);
        self.turned(self.range * c / (lambda * mu), self.range * s / mu, [xx, yy, zz, xz])
    }

    /// From the vertical plane of the line of sight, [xx, yy, zz, xz], to the axes of the sensor.
    fn turned(&self, x: T, z: T, [xx, yy, zz, xz]: [T; 4]) -> Converted<T> {
        let (sin, cos) = sin_cos(self.azimuth);
        let upper = [
            [cos * cos * xx + sin * sin * yy, sin * cos * (xx - yy), cos * xz],
            [T::ZERO, sin * sin * xx + cos * cos * yy, sin * xz],
            [T::ZERO, T::ZERO, zz],
        ];
        Converted { position: [x * cos, x * sin, z], cov: Symmetric::from_fn(|i, j| upper[i][j]) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::FRAC_PI_6;

    /// The defining moments of the modified unbiased conversion, term by term as published, in double precision.
    fn published(p: &Polar<f64>) -> [[f64; 3]; 3] {
        let (l, m) = (libm::exp(-p.azimuth_variance / 2.0), libm::exp(-p.elevation_variance / 2.0));
        let (l4, m4) = (l.powi(4), m.powi(4));
        let ((sa, ca), (se, ce)) = (libm::sincos(p.azimuth), libm::sincos(p.elevation));
        let (c2a, s2a, c2e, s2e) =
            (libm::cos(2.0 * p.azimuth), libm::sin(2.0 * p.azimuth), libm::cos(2.0 * p.elevation), libm::sin(2.0 * p.elevation));
        let (r2, e2) = (p.range * p.range, p.range * p.range + p.range_variance);
        let xx = -l * l * m * m * r2 * ca * ca * ce * ce + 0.25 * e2 * (1.0 + l4 * c2a) * (1.0 + m4 * c2e);
        let yy = -l * l * m * m * r2 * sa * sa * ce * ce + 0.25 * e2 * (1.0 - l4 * c2a) * (1.0 + m4 * c2e);
        let zz = -m * m * r2 * se * se + 0.5 * e2 * (1.0 - m4 * c2e);
        let xy = -l * l * m * m * r2 * sa * ca * ce * ce + 0.25 * e2 * l4 * s2a * (1.0 + m4 * c2e);
        let xz = -l * m * m * r2 * ca * se * ce + 0.5 * e2 * l * m4 * ca * s2e;
        let yz = -l * m * m * r2 * sa * se * ce + 0.5 * e2 * l * m4 * sa * s2e;
        [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
    }

    #[test]
    fn the_debiased_covariance_is_the_published_one() {
        for (sa, se) in [(0.05, 0.03), (0.3, 0.0), (1e-3, 2e-3), (0.2, 0.4)] {
            let p = Polar {
                range: 12_000.0,
                azimuth: 2.1,
                elevation: FRAC_PI_6,
                range_variance: 400.0,
                azimuth_variance: sa * sa,
                elevation_variance: se * se,
            };
            let (got, want) = (p.debiased().cov, published(&p));
            for (i, row) in want.iter().enumerate() {
                for (j, want) in row.iter().enumerate() {
                    let scale = (got.at(i, i) * got.at(j, j)).sqrt();
                    assert!((got.at(i, j) - want).abs() < 1e-6 * scale, "{sa} {se} {i}{j}: {} {want}", got.at(i, j));
                }
            }
        }
    }

    #[test]
    fn small_errors_make_both_conversions_one_in_single_precision_too() {
        let p = Polar::in_plane(30_000.0f32, -1.0, 400.0, 4e-8);
        let (linear, debiased) = (p.linear(), p.debiased());
        for i in 0..2 {
            assert!((linear.position[i] - debiased.position[i]).abs() < 0.01);
            assert!((linear.cov.at(i, i) / debiased.cov.at(i, i) - 1.0).abs() < 1e-4);
        }
    }
}
