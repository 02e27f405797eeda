//! A sensor that measures Cartesian position: z = p − o + noise, p the positions in the state, o the sensor's place.
//!
//! ```text
//! H picks the entries 0, s, 2s of an s-stride state:  G = those columns of P,  S = those rows of G + R
//! ```

use super::{Fix, Layout, MeasurementModel};
use crate::error::ConfigError;
use crate::gaussian::{Gaussian, Innovation};
use crate::scalar::Real;
use crate::symmetric::Symmetric;
use crate::time::Duration;
use nalgebra::{ArrayStorage, SMatrix, SVector};

/// Position in `NZ` axes of states with `STRIDE` entries each.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Position<T, const NZ: usize, const STRIDE: usize> {
    origin: SVector<T, NZ>,
    noise: Symmetric<T, NZ>,
}

impl<T: Real, const NZ: usize, const STRIDE: usize> Position<T, NZ, STRIDE> {
    /// At the coordinate origin, with the noise covariance `noise` \[m²\].
    ///
    /// # Errors
    /// Where `noise` is not positive definite.
    pub fn new(noise: Symmetric<T, NZ>) -> Result<Self, ConfigError> {
        const { assert!(NZ >= 1 && NZ <= 3 && STRIDE >= 1, "position has one to three axes") }
        if !noise.is_definite() {
            return Err(ConfigError::NotDefinite);
        }
        Ok(Self { origin: SVector::zeros(), noise })
    }

    /// The same sensor at `origin` \[m\]: what it reports is relative to there. For a moving sensor, once a scan.
    #[must_use]
    pub fn at(self, origin: SVector<T, NZ>) -> Self {
        Self { origin, ..self }
    }
}

impl<T: Real, const NX: usize, const NZ: usize, const STRIDE: usize> MeasurementModel<T, NX, NZ> for Position<T, NZ, STRIDE> {
    const LAYOUT: Layout = Layout { axes: NZ, stride: STRIDE };

    fn observe(&self, x: &SVector<T, NX>) -> SVector<T, NZ> {
        SVector::from_fn(|k, _| x.data.0[0][k * STRIDE] - self.origin.data.0[0][k])
    }
    fn jacobian(&self, _x: &SVector<T, NX>) -> SMatrix<T, NZ, NX> {
        SMatrix::from_fn(|k, i| if i == k * STRIDE { T::ONE } else { T::ZERO })
    }
    fn noise(&self, _x: &SVector<T, NX>) -> Symmetric<T, NZ> {
        self.noise
    }
    #[inline(always)]
    fn innovation(&self, g: &Gaussian<T, NX>) -> Innovation<T, NX, NZ> {
        const { assert!((NZ - 1) * STRIDE < NX, "the state is too short for this sensor") }
        let mut cross = SMatrix::from_array_storage(ArrayStorage([g.cov.line(0); NZ]));
        each!(k in NZ {
            if k > 0 {
                cross.data.0[k] = g.cov.line(k * STRIDE);
            }
        });
        let spread = Symmetric::from_fn(|k, l| g.cov.at(k * STRIDE, l * STRIDE));
        Innovation::new(self.observe(&g.mean), cross, spread, &self.noise)
    }
    fn is_finite(&self) -> bool {
        self.origin.iter().all(|v| v.is_finite())
    }
    fn locate(&self, z: &SVector<T, NZ>, noise: &Symmetric<T, NZ>) -> Option<Fix<T>> {
        let mut position = [T::ZERO; 3];
        for (p, (z, o)) in position.iter_mut().zip(z.iter().zip(self.origin.iter())) {
            *p = *z + *o;
        }
        let cov = Symmetric::from_fn(|i, j| noise.get(i, j).unwrap_or(T::ZERO));
        Some(Fix { position, cov, radial: None, offset: Duration::ZERO })
    }
}
