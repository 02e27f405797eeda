//! A radar (or a camera, a direction finder): any subset of range, azimuth, elevation and range-rate.
//!
//! With d = M' (p − o) the target in the axes of the sensor at o with mounting M, and u the unit line of sight:
//!
//! ```text
//! range       r = |d|                       ∂/∂p = u
//! azimuth     a = atan2(d_y, d_x)           ∂/∂p = M (−d_y, d_x, 0) / ρ²,            ρ² = d_x² + d_y²
//! elevation   e = atan2(d_z, ρ)             ∂/∂p = M (−d_x d_z, −d_y d_z, ρ²) / (ρ r²)
//! range-rate  ṙ = (v − v_o) · u             ∂/∂p = (v − v_o − ṙ u) / r,  ∂/∂v = u
//! ```
//!
//! Azimuth is counter-clockwise from the sensor's x axis; residuals of angles are wrapped into (−π, π]. At the
//! sensor itself, and on its vertical axis, the distances are held at a floor, so that nothing divides by zero.
//!
//! A pulse-Doppler radar measures ṙ modulo 2 V, where V is its unambiguous speed, λ / 4 over the time between pulses. The
//! prediction unfolds it, as long as its fold is certain:
//!
//! ```text
//! 3 √(S_ṙ) ≤ V    ν_ṙ = z − ẑ + 2 V n in (−V, V]
//! else            uniform over the interval and independent of the state: ν_ṙ as before, G_ṙ = 0, (H P H')_ṙ = V² / 3
//! ```
//!
//! The second line is the density of the folded measurement by its moments; it lets no wrong fold into a track. The density
//! of clutter is that of folded range-rates.
//!
//! H has entries only at positions and, for range-rate, at velocities: G = P H' and H G visit those alone.

use super::block::add;
use super::converted::Polar;
use super::{Fix, Layout, MeasurementModel, RadialSpeed};
use crate::error::ConfigError;
use crate::gaussian::{Gaussian, Innovation};
use crate::scalar::{Real, atan2, fold, larger, sin_cos, sqrt};
use crate::symmetric::Symmetric;
use crate::time::Duration;
use nalgebra::{SMatrix, SVector};

/// One coordinate that a radar measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Component {
    /// Distance \[m\]
    Range,
    /// Angle in the sensor's horizontal plane \[rad\]
    Azimuth,
    /// Angle above the sensor's horizontal plane \[rad\]
    Elevation,
    /// Rate of the distance \[m/s\]
    RangeRate,
}

/// Where a sensor is, how it moves and how it is turned.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Mount<T> {
    /// Position \[m\]
    pub position: [T; 3],
    /// Velocity over the ground \[m/s\]
    pub velocity: [T; 3],
    /// The sensor's axes as columns in world axes
    rotation: [[T; 3]; 3],
}

impl<T: Real> Mount<T> {
    /// At `position`, at rest, with axes parallel to the world's.
    #[must_use]
    pub const fn at(position: [T; 3]) -> Self {
        let (o, l) = (T::ZERO, T::ONE);
        Self { position, velocity: [o; 3], rotation: [[l, o, o], [o, l, o], [o, o, l]] }
    }

    /// The same, moving with `velocity` \[m/s\].
    #[must_use]
    pub const fn moving(self, velocity: [T; 3]) -> Self {
        Self { velocity, ..self }
    }

    /// The same, turned by `yaw` about z (left), then `pitch` about the new y (nose down), then `roll` about the new x
    /// (right side down) \[rad\].
    #[must_use]
    pub fn turned(self, yaw: T, pitch: T, roll: T) -> Self {
        let ((sy, cy), (sp, cp), (sr, cr)) = (sin_cos(yaw), sin_cos(pitch), sin_cos(roll));
        let rotation = [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ];
        Self { rotation, ..self }
    }

    fn to_sensor(self, v: [T; 3]) -> [T; 3] {
        let m = &self.rotation;
        core::array::from_fn(|i| m[0][i] * v[0] + m[1][i] * v[1] + m[2][i] * v[2])
    }

    fn to_world(self, v: [T; 3]) -> [T; 3] {
        self.rotation.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
    }
}

/// A radar measuring `NZ` components of targets with `AXES` axes of `STRIDE` states.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Radar<T, const NZ: usize, const AXES: usize, const STRIDE: usize> {
    components: [Component; NZ],
    noise: Symmetric<T, NZ>,
    mount: Mount<T>,
    /// Half the interval modulo which a component is measured: π, V, or infinite.
    half: [T; NZ],
}

/// The sight of one target: all that h and H need, computed once.
struct Sight<T> {
    d: [T; 3],
    rho: T,
    range: T,
    /// 1 / ρ
    per_rho: T,
    /// 1 / r
    per_range: T,
    u: [T; 3],
    closing: [T; 3],
    rate: T,
}

impl<T: Real, const NZ: usize, const AXES: usize, const STRIDE: usize> Radar<T, NZ, AXES, STRIDE> {
    /// Measuring `components`, in this order, with the noise covariance `noise` \[m, rad, rad, m/s\]².
    ///
    /// # Errors
    /// Where `noise` is not positive definite.
    pub fn new(components: [Component; NZ], noise: Symmetric<T, NZ>) -> Result<Self, ConfigError> {
        const { assert!(NZ >= 1 && AXES >= 2 && AXES <= 3 && STRIDE >= 1, "a radar sees a plane or space") }
        if !noise.is_definite() {
            return Err(ConfigError::NotDefinite);
        }
        let half = components.map(|component| match component {
            Component::Azimuth | Component::Elevation => T::PI,
            Component::Range | Component::RangeRate => T::lit(f64::INFINITY),
        });
        Ok(Self { components, noise, mount: Mount::at([T::ZERO; 3]), half })
    }

    /// The same sensor on `mount`. For a moving sensor, once a scan.
    #[must_use]
    pub fn on(self, mount: Mount<T>) -> Self {
        Self { mount, ..self }
    }

    /// The same radar measuring range-rate modulo 2 `speed` \[m/s\], folded into (−`speed`, `speed`] or any other interval
    /// of that length. Folds are judged by the radar's noise: a detection that brings its own should know its range-rate no
    /// worse.
    ///
    /// # Errors
    /// Where `speed` is not positive or not finite, or the radar does not measure range-rate.
    pub fn with_unambiguous_speed(self, speed: T) -> Result<Self, ConfigError> {
        match (self.components.contains(&Component::RangeRate), (speed + speed).is_finite(), speed > T::ZERO) {
            (false, ..) => Err(ConfigError::NoRangeRate),
            (_, false, _) => Err(ConfigError::NotFinite),
            (.., false) => Err(ConfigError::NotPositive),
            _ => {
                let mut half = self.half;
                for (half, component) in half.iter_mut().zip(&self.components) {
                    if *component == Component::RangeRate {
                        *half = speed;
                    }
                }
                Ok(Self { half, ..self })
            }
        }
    }

    #[inline(always)]
    fn sight<const NX: usize>(&self, x: &SVector<T, NX>) -> Sight<T> {
        const { assert!((AXES - 1) * STRIDE < NX, "the state is too short for this sensor") }
        let x = &x.data.0[0];
        let (o, floor) = (&self.mount.position, T::lit(1e-3));
        let axis = |a: usize| if a < AXES { x[a * STRIDE] - o[a] } else { -o[a] };
        let delta = [axis(0), axis(1), axis(2)];
        let d = self.mount.to_sensor(delta);
        let rho2 = d[0] * d[0] + d[1] * d[1];
        let rho = larger(sqrt(rho2), floor);
        let range = larger(sqrt(rho2 + d[2] * d[2]), floor);
        let (per_rho, per_range) = (T::ONE / rho, T::ONE / range);
        let u = delta.map(|v| v * per_range);
        let mut closing = [T::ZERO; 3];
        let mut rate = T::ZERO;
        if self.components.contains(&Component::RangeRate) {
            for a in 0..3 {
                let v = if a < AXES && STRIDE >= 2 { x[a * STRIDE + 1] } else { T::ZERO };
                closing[a] = v - self.mount.velocity[a];
                rate += closing[a] * u[a];
            }
        }
        Sight { d, rho, range, per_rho, per_range, u, closing, rate }
    }

    #[inline(always)]
    fn value(component: Component, sight: &Sight<T>) -> T {
        match component {
            Component::Range => sight.range,
            Component::Azimuth => atan2(sight.d[1], sight.d[0]),
            Component::Elevation => atan2(sight.d[2], sight.rho),
            Component::RangeRate => sight.rate,
        }
    }

    /// ∂/∂p in world axes.
    #[inline(always)]
    fn by_position(&self, component: Component, sight: &Sight<T>) -> [T; 3] {
        let Sight { d, rho, per_rho, per_range, u, closing, rate, .. } = sight;
        match component {
            Component::Range => *u,
            Component::Azimuth => {
                let scale = *per_rho * *per_rho;
                self.mount.to_world([-d[1] * scale, d[0] * scale, T::ZERO])
            }
            Component::Elevation => {
                let per_range2 = *per_range * *per_range;
                let scale = -d[2] * (*per_rho * per_range2);
                self.mount.to_world([d[0] * scale, d[1] * scale, *rho * per_range2])
            }
            Component::RangeRate => core::array::from_fn(|a| (closing[a] - *rate * u[a]) * *per_range),
        }
    }

    /// Whether ∂/∂v is u; it is zero otherwise.
    #[inline(always)]
    fn tells_velocity(component: Component) -> bool {
        component == Component::RangeRate && STRIDE >= 2
    }

    /// Σ_a `row`_a times the column of P at entry `part` of axis a.
    #[inline(always)]
    fn gather<const NX: usize>(p: &Symmetric<T, NX>, row: &[T; 3], part: usize) -> [T; NX] {
        // All products, then all sums: no result is used at once.
        let (mut sum, y) = (p.column(part, row[0]), p.column(STRIDE + part, row[1]));
        add(&mut sum, &y);
        if AXES == 3 {
            add(&mut sum, &p.column(2 * STRIDE + part, row[2]));
        }
        sum
    }

    /// The elevation at which a line of sight of this range and azimuth meets the plane of a state without height:
    /// A cos ε + B sin ε = −o_z / r, with (A, B) the vertical parts of the horizontal and the vertical direction.
    fn elevation_to_plane(&self, range: T, azimuth: T) -> Option<T> {
        let [.., up] = self.mount.rotation;
        let (sin, cos) = sin_cos(azimuth);
        let (a, b) = (up[0] * cos + up[1] * sin, up[2]);
        let norm = sqrt(a * a + b * b);
        let c = -self.mount.position[2] / (range * norm);
        let s2 = T::ONE - c * c;
        // The target must lie beyond the sensor's own height, or there is no such point.
        (s2 > T::ZERO).then(|| atan2(b, a) - atan2(sqrt(s2), c))
    }

    /// The measured value of `component` in `z`, with its variance in `noise`.
    fn measured(&self, component: Component, z: &SVector<T, NZ>, noise: &Symmetric<T, NZ>) -> Option<(T, T)> {
        let k = self.components.iter().position(|c| *c == component)?;
        Some((*z.get(k)?, noise.get(k, k)?))
    }
}

impl<T: Real, const NX: usize, const NZ: usize, const AXES: usize, const STRIDE: usize> MeasurementModel<T, NX, NZ>
    for Radar<T, NZ, AXES, STRIDE>
{
    const LAYOUT: Layout = Layout { axes: AXES, stride: STRIDE };

    fn observe(&self, x: &SVector<T, NX>) -> SVector<T, NZ> {
        let sight = self.sight(x);
        SVector::from_fn(|k, _| Self::value(self.components[k], &sight))
    }
    fn jacobian(&self, x: &SVector<T, NX>) -> SMatrix<T, NZ, NX> {
        let sight = self.sight(x);
        let mut h = SMatrix::zeros();
        for (k, component) in self.components.iter().enumerate() {
            let by_position = self.by_position(*component, &sight);
            for a in 0..AXES {
                h.data.0[a * STRIDE][k] = by_position[a];
                if Self::tells_velocity(*component) {
                    h.data.0[a * STRIDE + 1][k] = sight.u[a];
                }
            }
        }
        h
    }
    fn noise(&self, _x: &SVector<T, NX>) -> Symmetric<T, NZ> {
        self.noise
    }
    #[inline(always)]
    fn residual(&self, z: &SVector<T, NZ>, z_hat: &SVector<T, NZ>) -> SVector<T, NZ> {
        SVector::from_fn(|k, _| fold(z.data.0[0][k] - z_hat.data.0[0][k], self.half[k]))
    }
    #[inline(always)]
    fn difference(&self, a: &SVector<T, NZ>, b: &SVector<T, NZ>) -> SVector<T, NZ> {
        SVector::from_fn(|k, _| {
            let d = a.data.0[0][k] - b.data.0[0][k];
            if self.components[k] == Component::RangeRate { d } else { fold(d, self.half[k]) }
        })
    }
    #[inline(always)]
    fn drop_ambiguous(&self, cross: &mut SMatrix<T, NX, NZ>, spread: &mut Symmetric<T, NZ>, noise: &Symmetric<T, NZ>) {
        for k in 0..NZ {
            let (v, variance) = (self.half[k], spread.upper()[k][k] + noise.upper()[k][k]);
            if self.components[k] == Component::RangeRate && T::lit(9.0) * variance > v * v {
                cross.data.0[k] = [T::ZERO; NX];
                for l in 0..NZ {
                    spread.upper_mut()[k.min(l)][k.max(l)] = if l == k { v * v * T::lit(1.0 / 3.0) } else { T::ZERO };
                }
            }
        }
    }
    #[inline]
    fn innovation(&self, g: &Gaussian<T, NX>) -> Innovation<T, NX, NZ> {
        let sight = self.sight(&g.mean);
        let by_position = self.components.map(|component| self.by_position(component, &sight));
        let mut cross = SMatrix::zeros();
        for k in 0..NZ {
            let mut column = Self::gather(&g.cov, &by_position[k], 0);
            if Self::tells_velocity(self.components[k]) {
                add(&mut column, &Self::gather(&g.cov, &sight.u, 1));
            }
            cross.data.0[k] = column;
        }
        let mut spread = Symmetric::from_fn(|k, l| {
            let column = &cross.data.0[l];
            let mut sum = by_position[k][0] * column[0];
            for a in 1..AXES {
                sum += by_position[k][a] * column[a * STRIDE];
            }
            if Self::tells_velocity(self.components[k]) {
                for a in 0..AXES {
                    sum += sight.u[a] * column[a * STRIDE + 1];
                }
            }
            sum
        });
        let z_hat = SVector::from_fn(|k, _| Self::value(self.components[k], &sight));
        MeasurementModel::<T, NX, NZ>::drop_ambiguous(self, &mut cross, &mut spread, &self.noise);
        Innovation::new(z_hat, cross, spread, &self.noise)
    }
    fn velocity(&self) -> [T; 3] {
        self.mount.velocity
    }
    fn is_finite(&self) -> bool {
        let Mount { position, velocity, rotation } = &self.mount;
        position.iter().chain(velocity).chain(rotation.iter().flatten()).all(|v| v.is_finite())
    }
    fn locate(&self, z: &SVector<T, NZ>, noise: &Symmetric<T, NZ>) -> Option<Fix<T>> {
        let (range, range_variance) = self.measured(Component::Range, z, noise)?;
        let (azimuth, azimuth_variance) = self.measured(Component::Azimuth, z, noise)?;
        if range <= T::ZERO {
            return None;
        }
        let (elevation, elevation_variance, range_variance) = match self.measured(Component::Elevation, z, noise) {
            Some((elevation, variance)) => (elevation, variance, range_variance),
            None if AXES == 3 => return None,
            None => {
                let elevation = self.elevation_to_plane(range, azimuth)?;
                // Over the ground the range is stretched by 1 / cos; the conversion will shorten it by cos.
                let (_, cos) = sin_cos(elevation);
                let stretch = T::ONE / (cos * cos);
                (elevation, T::ZERO, range_variance * stretch * stretch)
            }
        };
        let seen = Polar { range, azimuth, elevation, range_variance, azimuth_variance, elevation_variance }.debiased();
        let offset = self.mount.to_world(seen.position);
        let m = SMatrix::<T, 3, 3>::from_fn(|i, j| self.mount.rotation[i][j]);
        let cov = Symmetric::from_matrix(&(m * seen.cov.to_matrix() * m.transpose()));
        let radial = self.measured(Component::RangeRate, z, noise).map(|(rate, variance)| {
            let distance = sqrt(offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2]);
            let direction = offset.map(|v| v / larger(distance, T::lit(1e-3)));
            let mut speed = rate;
            for (d, v) in direction.iter().zip(&self.mount.velocity) {
                speed += *d * *v;
            }
            let folded = self.components.iter().zip(&self.half).find(|(c, v)| **c == Component::RangeRate && v.is_finite());
            RadialSpeed { direction, speed, variance, unambiguous: folded.map(|(_, v)| *v) }
        });
        let position = core::array::from_fn(|a| self.mount.position[a] + offset[a]);
        Some(Fix { position, cov, radial, offset: Duration::ZERO })
    }
}
