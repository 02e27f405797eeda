//! A sensor as a tracker sees it: what it measures, how well it detects, what clutter it brings, how it is gated.

use crate::association::Gate;
use crate::error::ConfigError;
use crate::model::MeasurementModel;
use crate::model::resolution::Resolution;
use crate::scalar::Real;
use nalgebra::SVector;

/// The expected density of false detections.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Clutter<T> {
    /// Poisson clutter of this density λ: false detections per scan and unit of measurement volume, such as 1/m² or
    /// 1/(m rad). Densities below 1e-30 count as 1e-30.
    Poisson(T),
    /// Nothing known beforehand: the density is estimated by the detections in the gate over its volume, m / V.
    Diffuse,
}

/// A sensor whose detections an `NX`-state tracker takes in. Sensors of different `NZ` may feed the same tracks.
pub trait Sensor<T: Real, const NX: usize, const NZ: usize> {
    /// What it measures.
    type Model: MeasurementModel<T, NX, NZ>;

    /// What it measures.
    fn model(&self) -> &Self::Model;
    /// P_D of a target at `x`; zero where the sensor does not look: a track there is not counted as missed.
    fn p_detect(&self, x: &SVector<T, NX>) -> T;
    /// The clutter at the measurement `z`.
    fn clutter(&self, z: &SVector<T, NZ>) -> Clutter<T>;
    /// The clutter where it is the same at every measurement: nothing is then asked for every detection.
    #[inline(always)]
    fn uniform_clutter(&self) -> Option<Clutter<T>> {
        None
    }
    /// The validation gate.
    fn gate(&self) -> &Gate<T>;
    /// What it cannot tell apart; where it does not say, every target gives a detection of its own, and no code is made for others.
    #[inline(always)]
    fn resolution(&self) -> Option<&Resolution<T, NZ>> {
        None
    }
}

/// A sensor with the same detection probability and clutter everywhere.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct UniformSensor<M, T> {
    /// What it measures
    pub model: M,
    p_detect: T,
    clutter: Clutter<T>,
    gate: Gate<T>,
}

impl<M, T: Real> UniformSensor<M, T> {
    /// With detection probability `p_detect`, `clutter` and `gate`.
    ///
    /// # Errors
    /// Where `p_detect` is no probability, or the clutter density is negative or not finite.
    pub fn new(model: M, p_detect: T, clutter: Clutter<T>, gate: Gate<T>) -> Result<Self, ConfigError> {
        if !(p_detect >= T::ZERO && p_detect <= T::ONE) {
            return Err(ConfigError::NotAProbability);
        }
        match clutter {
            Clutter::Poisson(density) if !density.is_finite() => Err(ConfigError::NotFinite),
            Clutter::Poisson(density) if density < T::ZERO => Err(ConfigError::NotPositive),
            _ => Ok(Self { model, p_detect, clutter, gate }),
        }
    }

    /// The same sensor with another measurement model: a moving one, scan by scan.
    #[must_use]
    pub fn with_model<N>(&self, model: N) -> UniformSensor<N, T> {
        UniformSensor { model, p_detect: self.p_detect, clutter: self.clutter, gate: self.gate }
    }
}

impl<T: Real, M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize> Sensor<T, NX, NZ> for UniformSensor<M, T> {
    type Model = M;

    #[inline(always)]
    fn model(&self) -> &M {
        &self.model
    }
    #[inline(always)]
    fn p_detect(&self, _x: &SVector<T, NX>) -> T {
        self.p_detect
    }
    #[inline(always)]
    fn clutter(&self, _z: &SVector<T, NZ>) -> Clutter<T> {
        self.clutter
    }
    #[inline(always)]
    fn uniform_clutter(&self) -> Option<Clutter<T>> {
        Some(self.clutter)
    }
    #[inline(always)]
    fn gate(&self) -> &Gate<T> {
        &self.gate
    }
}

/// A sensor that sees two targets within its cells as one.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Unresolving<S, T, const NZ: usize> {
    /// The sensor
    pub sensor: S,
    /// Its cells
    pub resolution: Resolution<T, NZ>,
}

impl<T: Real, S: Sensor<T, NX, NZ>, const NX: usize, const NZ: usize> Sensor<T, NX, NZ> for Unresolving<S, T, NZ> {
    type Model = S::Model;

    #[inline(always)]
    fn model(&self) -> &S::Model {
        self.sensor.model()
    }
    #[inline(always)]
    fn p_detect(&self, x: &SVector<T, NX>) -> T {
        self.sensor.p_detect(x)
    }
    #[inline(always)]
    fn clutter(&self, z: &SVector<T, NZ>) -> Clutter<T> {
        self.sensor.clutter(z)
    }
    #[inline(always)]
    fn uniform_clutter(&self) -> Option<Clutter<T>> {
        self.sensor.uniform_clutter()
    }
    #[inline(always)]
    fn gate(&self) -> &Gate<T> {
        self.sensor.gate()
    }
    #[inline(always)]
    fn resolution(&self) -> Option<&Resolution<T, NZ>> {
        Some(&self.resolution)
    }
}
