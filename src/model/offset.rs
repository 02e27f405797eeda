//! Detections with a time of their own: the state is at the time of the scan, the detection was made δ later (or earlier).
//!
//! N puts velocities in the place of positions and accelerations in that of velocities, so that F = I + δ N moves a state
//! over δ and ẋ = N x. The sensor itself moves with v_o.
//!
//! ```text
//! ẑ_δ = ẑ + δ ż,                   ż = H N x − H_p v_o            H_p: the columns of H at positions
//! G_δ = P F' H' = G + δ Ġ,         Ġ = P N' H'
//! H F P F' H' = H P H' + δ (H Ġ + Ġ' H') + δ² H N Ġ
//! ```
//!
//! ẑ alone would do for a track whose velocity is known; the rest lets a young track learn its velocity over the time that
//! really passed. Left out are the process noise over δ and the curvature of h: at a range r a target that crosses with
//! speed v is predicted v² δ² / 2r too near, 4 m at 5 km, 200 m/s and one second.
//!
//! What is predicted costs one Jacobian and about NX NZ (NX + 2 NZ) multiply-adds a mode, whatever the number of detections.

use super::{Layout, MeasurementModel};
use crate::gaussian::{Gaussian, Innovation};
use crate::scalar::Real;
use crate::symmetric::Symmetric;
use nalgebra::{SMatrix, SVector};

/// How the predicted measurement of one mode moves with time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drift<T, const NX: usize, const NZ: usize> {
    /// ż
    rate: SVector<T, NZ>,
    /// Ġ
    cross: SMatrix<T, NX, NZ>,
    /// H Ġ + Ġ' H'
    linear: Symmetric<T, NZ>,
    /// H N Ġ
    square: Symmetric<T, NZ>,
    /// R
    noise: Symmetric<T, NZ>,
}

impl<T: Real, const NX: usize, const NZ: usize> Drift<T, NX, NZ> {
    /// Of the predicted measurement `innovation` of `g`.
    pub fn new<M: MeasurementModel<T, NX, NZ>>(model: &M, g: &Gaussian<T, NX>, innovation: &Innovation<T, NX, NZ>) -> Self {
        let h = model.jacobian(&g.mean);
        let mut hn =
            SMatrix::<T, NZ, NX>::from_fn(|k, j| M::LAYOUT.integral(j).and_then(|i| h.data.0.get(i)).map_or(T::ZERO, |column| column[k]));
        let mut rate = hn * g.mean;
        for (a, v) in model.velocity().iter().enumerate().take(M::LAYOUT.axes) {
            if let Some(column) = h.data.0.get(a * M::LAYOUT.stride) {
                for k in 0..NZ {
                    rate.data.0[0][k] -= column[k] * *v;
                }
            }
        }
        // What the prediction does not tell at the time of the scan it does not tell at another.
        for k in 0..NZ {
            if innovation.cross.data.0[k].iter().all(|g| *g == T::ZERO) {
                hn.row_mut(k).fill(T::ZERO);
            }
        }
        let cross = g.cov.to_matrix() * hn.transpose();
        let (first, second) = (h * cross, hn * cross);
        Self {
            rate,
            cross,
            linear: Symmetric::from_fn(|k, l| first.data.0[l][k] + first.data.0[k][l]),
            square: Symmetric::from_matrix(&second),
            noise: model.noise(&g.mean),
        }
    }

    /// The predicted measurement `dt` \[s\] from the scan's, for a detection with `noise` of its own or the sensor's.
    #[inline(always)]
    pub fn seen(&self, innovation: &Innovation<T, NX, NZ>, dt: T, noise: Option<&Symmetric<T, NZ>>) -> Innovation<T, NX, NZ> {
        let spread =
            Symmetric::from_fn(|k, l| innovation.spread.upper()[k][l] + dt * (self.linear.upper()[k][l] + dt * self.square.upper()[k][l]));
        let (z_hat, cross) = (innovation.z_hat + self.rate * dt, innovation.cross + self.cross * dt);
        Innovation::new(z_hat, cross, spread, noise.unwrap_or(&self.noise))
    }
}

/// x ← F x, P ← F P F' over `dt` \[s\]: brings what was seen at one time to another.
pub(crate) fn shift<T: Real, const NX: usize>(g: &mut Gaussian<T, NX>, layout: Layout, dt: T) {
    let f = SMatrix::<T, NX, NX>::from_fn(|i, j| match layout.integral(j) {
        _ if i == j => T::ONE,
        Some(k) if k == i => dt,
        _ => T::ZERO,
    });
    g.mean = f * g.mean;
    g.cov = Symmetric::from_matrix(&(f * g.cov.to_matrix() * f.transpose()));
}
