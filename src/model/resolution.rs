//! What a sensor cannot tell apart: two targets within its cells may give one detection between them.
//!
//! ```text
//! P_u(d) = exp(−½ d' R_d⁻¹ d)                          that two targets are one to the sensor whose measurements differ by d,
//!                                                      R_d = diag(α_k²), α the cells
//!        = √det 2πR_d · N(0; d, R_d)                   the same, as the likelihood of "0 was measured of d with the noise R_d"
//! E P_u  = √det 2πR_d · N(0; d̂, D + R_d)               for d ~ N(d̂, D)
//! z      = s h(x₁) + (1 − s) h(x₂) + noise of R_a      what they give then
//! ```
//!
//! Koch and van Keuk, *IEEE Trans. AES* 33(3), 1997; Jeong and Tugnait, *IEE Proc. Radar Sonar Navig.* 152(5), 2005, with R_d of
//! the squares of the cells. The second line is what makes filters of it: that two targets are unresolved is a measurement of
//! their distance, and P_u is part of the density of that measurement, not a factor beside it.

use crate::error::ConfigError;
use crate::gaussian::unit_peak;
use crate::scalar::{Real, ln};
use crate::symmetric::Symmetric;

/// The cells of a sensor that measures `NZ` components, and what two targets in one cell give.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Resolution<T, const NZ: usize> {
    /// R_d
    pub(crate) cells: Symmetric<T, NZ>,
    /// ln √det 2πR_d
    pub(crate) ln_volume: T,
    /// s
    pub(crate) share: T,
    /// R_a, where it is not the sensor's R
    pub(crate) noise: Option<Symmetric<T, NZ>>,
    /// The P_D of both as one, where it is not that of the better seen
    pub(crate) p_detect: Option<T>,
}

impl<T: Real, const NZ: usize> Resolution<T, NZ> {
    /// Cells of the sizes `cells`, in the units and the order of the measurement: two targets that differ by one cell in one
    /// component are unresolved with probability e^{−½}. A component that resolves nothing has a cell of more than any distance.
    ///
    /// # Errors
    /// Where a cell is not positive, or R_d not finite.
    pub fn new(cells: [T; NZ]) -> Result<Self, ConfigError> {
        Self::from_covariance(Symmetric::from_diagonal(cells.map(|cell| if cell > T::ZERO { cell * cell } else { cell })))
    }

    /// The same by R_d itself, where components go together.
    ///
    /// # Errors
    /// Where it is not positive definite.
    pub fn from_covariance(cells: Symmetric<T, NZ>) -> Result<Self, ConfigError> {
        if !cells.is_finite() {
            return Err(ConfigError::NotFinite);
        }
        let root = cells.inverse().root;
        if root == T::ZERO {
            return Err(ConfigError::NotDefinite);
        }
        Ok(Self { cells, ln_volume: -ln(root * unit_peak::<T, NZ>()), share: T::lit(0.5), noise: None, p_detect: None })
    }

    /// The same where the first target has the share `share` of what both give: of two strengths, the first over the sum. A half
    /// unless stated.
    ///
    /// # Errors
    /// Where it lies outside 0..=1.
    pub fn with_share(self, share: T) -> Result<Self, ConfigError> {
        if share >= T::ZERO && share <= T::ONE { Ok(Self { share, ..self }) } else { Err(ConfigError::NotAProbability) }
    }

    /// The same where what both give has the noise covariance `noise`; that of the sensor unless stated.
    ///
    /// # Errors
    /// Where it is not positive definite.
    pub fn with_noise(self, noise: Symmetric<T, NZ>) -> Result<Self, ConfigError> {
        if noise.is_definite() { Ok(Self { noise: Some(noise), ..self }) } else { Err(ConfigError::NotDefinite) }
    }

    /// The same where both as one are detected with `p_detect`; with that of the better seen unless stated.
    ///
    /// # Errors
    /// Where it lies outside 0..=1.
    pub fn with_p_detect(self, p_detect: T) -> Result<Self, ConfigError> {
        let valid = p_detect >= T::ZERO && p_detect <= T::ONE;
        if valid { Ok(Self { p_detect: Some(p_detect), ..self }) } else { Err(ConfigError::NotAProbability) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_must_be_sound() {
        let refused = |cells: [f32; 2]| Resolution::new(cells).err();
        assert_eq!(refused([40.0, 0.0]), Some(ConfigError::NotDefinite));
        assert_eq!(refused([-40.0, 0.01]), Some(ConfigError::NotDefinite));
        assert_eq!(refused([f32::NAN, 0.01]), Some(ConfigError::NotFinite));
        assert_eq!(refused([1e30, 0.01]), Some(ConfigError::NotFinite));
        assert_eq!(refused([40.0, 0.014]), None);
    }

    /// ln √det 2πR_d of (40 m, 14 mrad) is ln(2π · 40 · 0.014).
    #[test]
    fn volume_is_that_of_the_density() {
        let volume = Resolution::new([40.0, 0.014]).map(|r| r.ln_volume);
        assert!(volume.is_ok_and(|v: f64| (v - (2.0 * core::f64::consts::PI * 40.0 * 0.014).ln()).abs() < 1e-12));
    }
}
