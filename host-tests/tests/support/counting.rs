//! Models that count what they are asked, thread by thread: for the tests of the most work of a scan.

use boresight::gaussian::{Gaussian, Innovation};
use boresight::mode::ModeSet;
use boresight::model::{Fix, Layout, MeasurementModel};
use boresight::scalar::Real;
use boresight::symmetric::Symmetric;
use nalgebra::{SMatrix, SVector};
use std::cell::Cell;

/// What models have been asked.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Asked {
    /// Predictions of one mode
    pub predictions: u64,
    /// Predicted measurements
    pub innovations: u64,
    /// Residuals of measurements
    pub residuals: u64,
    /// Differences of predicted measurements
    pub differences: u64,
    /// Measurements traced back to a position
    pub fixes: u64,
}

thread_local! {
    static ASKED: Cell<Asked> = const { Cell::new(Asked { predictions: 0, innovations: 0, residuals: 0, differences: 0, fixes: 0 }) };
}

/// What the models of this thread have been asked since the last call.
pub fn take() -> Asked {
    ASKED.take()
}

fn count(add: impl FnOnce(&mut Asked)) {
    let mut asked = ASKED.get();
    add(&mut asked);
    ASKED.set(asked);
}

/// Modes, or what a sensor measures, that count.
#[derive(Clone, Copy, Debug)]
pub struct Counting<M>(pub M);

impl<T: Real, M: ModeSet<T, NX, MODES>, const NX: usize, const MODES: usize> ModeSet<T, NX, MODES> for Counting<M> {
    const LAYOUT: Layout = M::LAYOUT;
    type Steps = M::Steps;

    fn steps(&self, dt: T) -> M::Steps {
        self.0.steps(dt)
    }
    fn advance(&self, mode: usize, g: &mut Gaussian<T, NX>, steps: &M::Steps) {
        count(|asked| asked.predictions += 1);
        self.0.advance(mode, g, steps);
    }
    fn propagate(&self, mode: usize, x: &SVector<T, NX>, v: &mut SMatrix<T, NX, NX>, dt: T) {
        self.0.propagate(mode, x, v, dt);
    }
}

impl<T: Real, M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize> MeasurementModel<T, NX, NZ> for Counting<M> {
    const LAYOUT: Layout = M::LAYOUT;

    fn observe(&self, x: &SVector<T, NX>) -> SVector<T, NZ> {
        self.0.observe(x)
    }
    fn jacobian(&self, x: &SVector<T, NX>) -> SMatrix<T, NZ, NX> {
        self.0.jacobian(x)
    }
    fn noise(&self, x: &SVector<T, NX>) -> Symmetric<T, NZ> {
        self.0.noise(x)
    }
    fn residual(&self, z: &SVector<T, NZ>, z_hat: &SVector<T, NZ>) -> SVector<T, NZ> {
        count(|asked| asked.residuals += 1);
        self.0.residual(z, z_hat)
    }
    fn difference(&self, a: &SVector<T, NZ>, b: &SVector<T, NZ>) -> SVector<T, NZ> {
        count(|asked| asked.differences += 1);
        self.0.difference(a, b)
    }
    fn drop_ambiguous(&self, cross: &mut SMatrix<T, NX, NZ>, spread: &mut Symmetric<T, NZ>, noise: &Symmetric<T, NZ>) {
        self.0.drop_ambiguous(cross, spread, noise);
    }
    fn innovation(&self, g: &Gaussian<T, NX>) -> Innovation<T, NX, NZ> {
        count(|asked| asked.innovations += 1);
        self.0.innovation(g)
    }
    fn locate(&self, z: &SVector<T, NZ>, noise: &Symmetric<T, NZ>) -> Option<Fix<T>> {
        count(|asked| asked.fixes += 1);
        self.0.locate(z, noise)
    }
    fn velocity(&self) -> [T; 3] {
        self.0.velocity()
    }
    fn is_finite(&self) -> bool {
        self.0.is_finite()
    }
    fn nominal_noise(&self) -> Symmetric<T, NZ> {
        self.0.nominal_noise()
    }
}
