//! A sensor and a target in space, seen by every radar there is: all sequences of different components, targets in the
//! plane and in space, states of two and three entries an axis, bare and with an entry behind.
//!
//! Tests are [`Law`]s: things that hold for a radar looking at a scene.

use crate::support::{draws, gaussian};
use boresight::gaussian::Gaussian;
use boresight::model::radar::Component::{self, Azimuth, Elevation, Range, RangeRate};
use boresight::model::radar::{Mount, Radar};
use boresight::scalar::Real;
use boresight::symmetric::Symmetric;
use nalgebra::{Rotation3, SVector, Vector3};
use proptest::prelude::*;
use proptest::test_runner::TestCaseResult;

/// Where sensor and target are and how they move.
#[derive(Clone, Debug)]
pub struct Scene {
    pub place: Vector3<f64>,
    pub velocity: Vector3<f64>,
    /// Yaw, pitch, roll
    pub turned: [f64; 3],
    /// From the sensor to the target, in the axes of the sensor
    pub sight: Vector3<f64>,
    pub target_velocity: Vector3<f64>,
    pub draws: Vec<f64>,
}

fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-1.0..1.0f64).prop_map(move |v| Vector3::from(v) * size)
}

pub fn scenes() -> impl Strategy<Value = Scene> {
    let turned = (-3.1..3.1f64, -1.5..1.5f64, -3.1..3.1f64).prop_map(|(yaw, pitch, roll)| [yaw, pitch, roll]);
    (vector(5e3), vector(50.0), turned, vector(2e4), vector(300.0), draws())
        .prop_filter("the azimuth needs a distance from the vertical axis", |s| s.3.xy().norm() > 200.0)
        .prop_map(|(place, velocity, turned, sight, target_velocity, draws)| Scene {
            place,
            velocity,
            turned,
            sight,
            target_velocity,
            draws,
        })
}

impl Scene {
    pub fn rotation(&self) -> Rotation3<f64> {
        let [yaw, pitch, roll] = self.turned;
        Rotation3::from_euler_angles(roll, pitch, yaw)
    }

    pub fn mount<T: Real>(&self) -> Mount<T> {
        let [place, velocity] = [self.place, self.velocity].map(|v| v.map(T::lit).into());
        let [yaw, pitch, roll] = self.turned.map(T::lit);
        Mount::at(place).moving(velocity).turned(yaw, pitch, roll)
    }

    /// The target with a covariance of some 100 m and 100 m/s; in the plane it is at height zero.
    pub fn target<T: Real, const NX: usize>(&self, axes: usize, stride: usize) -> Gaussian<T, NX> {
        let mut g = gaussian::<T, NX>(&self.draws, 1.0, 100.0);
        let position = self.place + self.rotation() * self.sight;
        for a in 0..axes {
            g.mean[a * stride] = T::lit(position[a]);
            g.mean[a * stride + 1] = T::lit(self.target_velocity[a]);
        }
        g
    }

    /// d in the axes of the sensor, d in the world's, v − v_o, all of a state as it was rounded.
    pub fn relative<T: Real, const NX: usize>(&self, x: &SVector<T, NX>, axes: usize, stride: usize) -> [Vector3<f64>; 3] {
        let entry = |a: usize, k: usize| if a < axes { x[a * stride + k].to_f64() } else { 0.0 };
        let rounded = |v: &Vector3<f64>| v.map(|v| T::lit(v).to_f64());
        let delta = Vector3::from_fn(|a, _| entry(a, 0)) - rounded(&self.place);
        let closing = Vector3::from_fn(|a, _| entry(a, 1)) - rounded(&self.velocity);
        let [yaw, pitch, roll] = self.turned.map(|v| T::lit(v).to_f64());
        [Rotation3::from_euler_angles(roll, pitch, yaw).inverse() * delta, delta, closing]
    }
}

/// Something that holds for a radar.
pub trait Law<T: Real> {
    fn hold<const NX: usize, const NZ: usize, const AXES: usize, const STRIDE: usize>(
        &self,
        radar: &Radar<T, NZ, AXES, STRIDE>,
        components: &[Component; NZ],
        scene: &Scene,
    ) -> TestCaseResult;
}

/// All sequences of `NZ` different components.
fn sequences<const NZ: usize>() -> Vec<[Component; NZ]> {
    let all = [Range, Azimuth, Elevation, RangeRate];
    let numbers = (0..4usize.pow(NZ as u32)).map(|n| std::array::from_fn(|k| all[n / 4usize.pow(k as u32) % 4]));
    numbers.filter(|s: &[Component; NZ]| (0..NZ).all(|k| !s[..k].contains(&s[k]))).collect()
}

/// Standard deviations of 20 m, 2 mrad, 3 mrad, 1 m/s, correlated by 0.3.
fn noise<T: Real, const NZ: usize>(components: &[Component; NZ]) -> Symmetric<T, NZ> {
    let deviation = components.map(|c| match c {
        Range => 20.0,
        Azimuth => 2e-3,
        Elevation => 3e-3,
        RangeRate => 1.0,
    });
    Symmetric::from_fn(|i, j| T::lit(deviation[i] * deviation[j] * if i == j { 1.0 } else { 0.3 }))
}

fn every_sequence<T: Real, const NZ: usize>(scene: &Scene, law: &impl Law<T>) -> TestCaseResult {
    for c in sequences::<NZ>() {
        let (noise, mount) = (noise(&c), scene.mount());
        law.hold::<4, NZ, 2, 2>(&Radar::new(c, noise)?.on(mount), &c, scene)?;
        law.hold::<5, NZ, 2, 2>(&Radar::new(c, noise)?.on(mount), &c, scene)?;
        law.hold::<6, NZ, 2, 3>(&Radar::new(c, noise)?.on(mount), &c, scene)?;
        law.hold::<6, NZ, 3, 2>(&Radar::new(c, noise)?.on(mount), &c, scene)?;
        law.hold::<9, NZ, 3, 3>(&Radar::new(c, noise)?.on(mount), &c, scene)?;
    }
    Ok(())
}

pub fn every_radar<T: Real>(scene: &Scene, law: &impl Law<T>) -> TestCaseResult {
    every_sequence::<T, 1>(scene, law)?;
    every_sequence::<T, 2>(scene, law)?;
    every_sequence::<T, 3>(scene, law)?;
    every_sequence::<T, 4>(scene, law)
}
