//! The validation gate: detections with ν' S⁻¹ ν ≤ γ, and the probability that the target's own is among them.
//!
//! ```text
//! P_G = P(χ²_n ≤ γ):   n = 1: erf √(γ/2)     n = 2: 1 − e^{−γ/2}
//!                      n + 2 from n: P_{n+2} = P_n − (γ/2)^{n/2} e^{−γ/2} / Γ(n/2 + 1)
//! V   = c_n γ^{n/2} √det S,  c_n the volume of the unit ball: 2, π, 4π/3, …, c_{n+2} = 2π c_n / (n + 2)
//! ```

use crate::error::ConfigError;
use crate::scalar::{Real, erf, exp, larger, sqrt};

/// A gate for measurements of one dimension.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Gate<T> {
    /// γ, the largest normalised innovation squared that is validated.
    threshold: T,
    /// P_G
    p_gate: T,
    /// c_n γ^{n/2}: the volume of the gate per √det S.
    unit_volume: T,
    /// n
    dimension: u8,
}

impl<T: Real> Gate<T> {
    /// The gate γ = `threshold` for `NZ`-dimensional measurements.
    ///
    /// # Errors
    /// Where the threshold is not positive and finite.
    pub fn new<const NZ: usize>(threshold: T) -> Result<Self, ConfigError> {
        const { assert!(NZ >= 1 && NZ <= 255, "a measurement has at least one coordinate") }
        if !threshold.is_finite() {
            return Err(ConfigError::NotFinite);
        }
        if threshold <= T::ZERO {
            return Err(ConfigError::NotPositive);
        }
        let half = threshold * T::lit(0.5);
        let (tail, root) = (exp(-half), sqrt(half));
        // (n, P_n, c_n γ^{n/2}, the term that leads to P_{n+2})
        let odd = NZ % 2 == 1;
        let (mut n, mut p, mut volume, mut term) = if odd {
            (1, erf(root), sqrt(threshold) * T::lit(2.0), root * tail * T::lit(2.0) / sqrt(T::PI))
        } else {
            (2, T::ONE - tail, threshold * T::PI, half * tail)
        };
        while n < NZ {
            p -= term;
            volume *= T::lit(2.0) * T::PI * threshold / T::from_count(n + 2);
            n += 2;
            term *= half / (T::from_count(n) * T::lit(0.5));
        }
        // Of a small gate the differences may leave less than nothing.
        Ok(Self { threshold, p_gate: larger(p, T::ZERO), unit_volume: volume, dimension: NZ as u8 })
    }

    /// The same gate with P_G given, where a source states its own.
    ///
    /// # Errors
    /// Where it is not a probability.
    pub fn with_probability(self, p_gate: T) -> Result<Self, ConfigError> {
        if p_gate >= T::ZERO && p_gate <= T::ONE { Ok(Self { p_gate, ..self }) } else { Err(ConfigError::NotAProbability) }
    }

    /// n, the dimension of the measurements that this gate is for.
    #[must_use]
    pub fn dimension(&self) -> usize {
        usize::from(self.dimension)
    }

    /// γ
    #[must_use]
    pub fn threshold(&self) -> T {
        self.threshold
    }

    /// P_G
    #[must_use]
    pub fn p_gate(&self) -> T {
        self.p_gate
    }

    /// V, the volume of the gate where `root_det` = √det S.
    #[must_use]
    pub fn volume(&self, root_det: T) -> T {
        self.unit_volume * root_det
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gate<const NZ: usize>(threshold: f64) -> Result<(f64, f64), ConfigError> {
        Gate::<f64>::new::<NZ>(threshold).map(|g| (g.p_gate(), g.volume(1.0)))
    }

    #[test]
    fn probabilities_are_chi_square_and_volumes_those_of_ellipsoids() {
        // Quantiles of the chi-square distribution at 0.99 from a statistical table.
        for (got, p) in [
            (gate::<1>(6.634_896_601), 0.99),
            (gate::<2>(9.210_340_372), 0.99),
            (gate::<3>(11.344_866_730), 0.99),
            (gate::<4>(13.276_704_136), 0.99),
            (gate::<5>(15.086_272_469), 0.99),
            (gate::<6>(16.811_893_830), 0.99),
        ] {
            assert!(got.is_ok_and(|(p_gate, _)| (p_gate - p).abs() < 1e-9), "{got:?}");
        }
        let pi = core::f64::consts::PI;
        assert!(gate::<1>(4.0).is_ok_and(|(_, v)| (v - 4.0).abs() < 1e-12));
        assert!(gate::<2>(4.0).is_ok_and(|(_, v)| (v - 4.0 * pi).abs() < 1e-12));
        assert!(gate::<3>(4.0).is_ok_and(|(_, v)| (v - 32.0 / 3.0 * pi).abs() < 1e-12));
        assert!(gate::<4>(4.0).is_ok_and(|(_, v)| (v - 8.0 * pi * pi).abs() < 1e-11));
        // In single precision, where rounding is more than what is left.
        for k in 1..400 {
            let threshold = 1e-4 * k as f32;
            for p in [Gate::new::<3>(threshold), Gate::new::<4>(threshold), Gate::new::<6>(threshold)] {
                assert!(p.is_ok_and(|gate| (0.0..=1.0).contains(&gate.p_gate())), "{threshold}");
            }
        }
        assert_eq!(gate::<2>(0.0), Err(ConfigError::NotPositive));
        assert_eq!(gate::<2>(f64::NAN), Err(ConfigError::NotFinite));
    }
}
