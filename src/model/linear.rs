//! Models given as matrices: x ← F x, P ← F P F' + Q; z = H x.
//!
//! For reference cases, for experiments and for users with a linear system of their own. F and Q hold for one step,
//! whatever its length. Dense: a model with structure should be one of the others, or `advance` by code of its own.

use super::{MeasurementModel, MotionModel, predict_dense};
use crate::gaussian::Gaussian;
use crate::scalar::Real;
use crate::symmetric::Symmetric;
use nalgebra::{SMatrix, SVector};

/// x ← F x with process noise Q, for steps of one length.
#[derive(Clone, Copy, Debug)]
pub struct LinearMotion<T, const NX: usize> {
    /// F
    pub transition: SMatrix<T, NX, NX>,
    /// Q
    pub process_noise: Symmetric<T, NX>,
}

impl<T: Real, const NX: usize> MotionModel<T, NX> for LinearMotion<T, NX> {
    type Step = T;

    fn transition(&self, x: &SVector<T, NX>, _dt: T) -> SVector<T, NX> {
        self.transition * x
    }
    fn jacobian(&self, _x: &SVector<T, NX>, _dt: T) -> SMatrix<T, NX, NX> {
        self.transition
    }
    fn process_noise(&self, _x: &SVector<T, NX>, _dt: T) -> Symmetric<T, NX> {
        self.process_noise
    }
    fn step(&self, dt: T) -> T {
        dt
    }
    fn advance(&self, g: &mut Gaussian<T, NX>, dt: &T) {
        predict_dense(self, g, *dt);
    }
}

/// z = H x with noise R.
#[derive(Clone, Copy, Debug)]
pub struct LinearMeasurement<T, const NX: usize, const NZ: usize> {
    /// H
    pub matrix: SMatrix<T, NZ, NX>,
    /// R
    pub noise: Symmetric<T, NZ>,
}

impl<T: Real, const NX: usize, const NZ: usize> MeasurementModel<T, NX, NZ> for LinearMeasurement<T, NX, NZ> {
    fn observe(&self, x: &SVector<T, NX>) -> SVector<T, NZ> {
        self.matrix * x
    }
    fn jacobian(&self, _x: &SVector<T, NX>) -> SMatrix<T, NZ, NX> {
        self.matrix
    }
    fn noise(&self, _x: &SVector<T, NX>) -> Symmetric<T, NZ> {
        self.noise
    }
    fn is_finite(&self) -> bool {
        self.noise.is_finite() && self.matrix.iter().all(|v| v.is_finite())
    }
}
