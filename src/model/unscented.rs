//! The unscented transform: any model of this library, or of a user, without its Jacobian.
//!
//! ```text
//! λ = α² (n + κ) − n,  X₀ = x,  X_i = x + column i of L,  X_{n+i} = x − column i of L,  L L' = (n + λ) P
//! mean        W₀ = λ / (n + λ)              W_i = 1 / (2 (n + λ))
//! covariance  W₀ + 1 − α² + β               W_i
//! predict     x = Σ W f(X_i),  P = Σ W (f(X_i) − x)(·)' + Q
//! observe     ẑ = Z₀ + Σ W (Z_i − Z₀),  H P H' = Σ W (Z_i − ẑ)(·)',  G = Σ W (X_i − x)(Z_i − ẑ)'
//! ```
//!
//! Z_i − Z₀ is taken by the model's `difference`, so angles wrap, and Z_i − ẑ = (Z_i − Z₀) − (ẑ − Z₀): every point is observed
//! once. Points are kept as X_i − X₀, which no coordinate rounds away. Two conventions exist: sigma
//! points drawn anew from the prediction, Q included (Särkkä; [`Unscented`] does this), or the propagated points used
//! again, which do not know Q (Julier and Uhlmann; Wan and van der Merwe): keep the points that
//! [`SigmaPoints::propagate`] returns and call [`SigmaPoints::observe`] on them.
//!
//! Julier and Uhlmann, *Proc. IEEE* 92(3), 2004. A small α makes weights of size 1/α² that cancel: in single
//! precision keep α ≥ 0.1.

use super::{Layout, MeasurementModel, MotionModel};
use crate::error::ConfigError;
use crate::gaussian::{Gaussian, Innovation};
use crate::scalar::{Real, sqrt};
use crate::symmetric::Symmetric;
use nalgebra::{ArrayStorage, SMatrix, SVector};

/// The scaling of the sigma points.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Scaling<T> {
    alpha: T,
    beta: T,
    kappa: T,
}

impl<T: Real> Scaling<T> {
    /// α (spread, 0 < α ≤ 1), β (2 for Gaussians) and κ, for states of `NX` entries.
    ///
    /// # Errors
    /// Where a number is not finite, or α or NX + κ is not positive.
    pub fn new<const NX: usize>(alpha: T, beta: T, kappa: T) -> Result<Self, ConfigError> {
        if !(alpha.is_finite() && beta.is_finite() && kappa.is_finite()) {
            return Err(ConfigError::NotFinite);
        }
        if alpha <= T::ZERO || T::from_count(NX) + kappa <= T::ZERO {
            return Err(ConfigError::NotPositive);
        }
        Ok(Self { alpha, beta, kappa })
    }

    /// n + λ
    fn spread(&self, n: usize) -> T {
        self.alpha * self.alpha * (T::from_count(n) + self.kappa)
    }
}

/// 2 NX + 1 sigma points: the centre, and one to either side for every column of the factor.
#[derive(Clone, Copy, Debug)]
pub struct SigmaPoints<T, const NX: usize> {
    /// X₀
    centre: SVector<T, NX>,
    /// X_i − X₀
    sides: [[SVector<T, NX>; NX]; 2],
    scaling: Scaling<T>,
}

impl<T: Real, const NX: usize> SigmaPoints<T, NX> {
    /// The points of `g`, or `None` where its covariance is not positive semi-definite.
    #[must_use]
    pub fn draw(g: &Gaussian<T, NX>, scaling: Scaling<T>) -> Option<Self> {
        let l = g.cov.cholesky()?;
        let root = sqrt(scaling.spread(NX));
        let side = |root: T| core::array::from_fn(|j| SVector::from_fn(|i, _| l[i][j] * root));
        Some(Self { centre: g.mean, sides: [side(root), side(-root)], scaling })
    }

    /// Moves every point by `model`; returns the moved points and the predicted density, Q added.
    #[must_use]
    pub fn propagate<M: MotionModel<T, NX>>(&self, model: &M, dt: T) -> (Self, Gaussian<T, NX>) {
        let centre = model.transition(&self.centre, dt);
        let sides = self.sides.each_ref().map(|side| side.each_ref().map(|d| model.transition(&(self.centre + d), dt) - centre));
        let weights = Weights::new(&self.scaling, NX);
        let shift = sides.iter().flatten().sum::<SVector<T, NX>>() * weights.side;
        let mut cov = model.process_noise(&self.centre, dt);
        add_square(&mut cov, weights.centre, &shift);
        for d in sides.iter().flatten() {
            add_square(&mut cov, weights.side, &(d - shift));
        }
        (Self { centre, sides, scaling: self.scaling }, Gaussian::new(centre + shift, cov))
    }

    /// The predicted measurement of a density with mean `mean` that these points stand for.
    ///
    /// Cost: 2 NX + 1 observations, and about 2 NX NZ (NX + NZ / 2) multiply-adds.
    #[must_use]
    pub fn observe<M: MeasurementModel<T, NX, NZ>, const NZ: usize>(&self, model: &M, mean: &SVector<T, NX>) -> Innovation<T, NX, NZ> {
        let z_centre = model.observe(&self.centre);
        // Z_i − Z₀, and of ẑ the same.
        let mut seen =
            self.sides.each_ref().map(|side| side.each_ref().map(|d| model.difference(&model.observe(&(self.centre + d)), &z_centre)));
        let weights = Weights::new(&self.scaling, NX);
        let shift = seen.iter().flatten().sum::<SVector<T, NZ>>() * weights.side;
        seen.iter_mut().flatten().for_each(|dz| *dz -= shift);
        // ẑ wrapped by asking for its difference from zero.
        let z_hat = model.difference(&(z_centre + shift), &SVector::zeros());
        let mut spread = Symmetric::zeros();
        add_square(&mut spread, weights.centre, &shift);
        for dz in seen.iter().flatten() {
            add_square(&mut spread, weights.side, dz);
        }
        let total = seen.iter().flatten().sum::<SVector<T, NZ>>() * weights.side - shift * weights.centre;
        let away = self.centre - mean;
        let mut cross = SMatrix::from_array_storage(ArrayStorage(core::array::from_fn(|k| {
            // A column at a time, all of which fits into registers.
            let mut sum = [T::ZERO; NX];
            for (d, dz) in self.sides.iter().flatten().zip(seen.iter().flatten()) {
                let products: [T; NX] = core::array::from_fn(|i| d.data.0[0][i] * dz.data.0[0][k]);
                for i in 0..NX {
                    sum[i] += products[i];
                }
            }
            core::array::from_fn(|i| sum[i] * weights.side + away.data.0[0][i] * total.data.0[0][k])
        })));
        let noise = model.noise(mean);
        model.drop_ambiguous(&mut cross, &mut spread, &noise);
        Innovation::new(z_hat, cross, spread, &noise)
    }
}

/// S ← S + `weight` d d'
#[inline(always)]
fn add_square<T: Real, const N: usize>(s: &mut Symmetric<T, N>, weight: T, d: &SVector<T, N>) {
    let d = &d.data.0[0];
    let weighted = d.map(|d| weight * d);
    for i in 0..N {
        for j in i..N {
            s.upper_mut()[i][j] += weighted[i] * d[j];
        }
    }
}

/// W of the sides, and of the centre in covariances.
struct Weights<T> {
    centre: T,
    side: T,
}

impl<T: Real> Weights<T> {
    fn new(s: &Scaling<T>, n: usize) -> Self {
        let spread = s.spread(n);
        Self { centre: T::lit(2.0) - T::from_count(n) / spread - s.alpha * s.alpha + s.beta, side: T::lit(0.5) / spread }
    }
}

/// A motion or measurement model seen through sigma points instead of its Jacobian: put it where the model stood.
///
/// Where a covariance has no factor (a filter gone wrong), the model's own linearisation serves.
#[derive(Clone, Copy, Debug)]
pub struct Unscented<M, T> {
    /// The model.
    pub model: M,
    /// The scaling of the points.
    pub scaling: Scaling<T>,
}

impl<T: Real, M: MotionModel<T, NX>, const NX: usize> MotionModel<T, NX> for Unscented<M, T> {
    const LAYOUT: Layout = M::LAYOUT;
    type Step = T;

    fn transition(&self, x: &SVector<T, NX>, dt: T) -> SVector<T, NX> {
        self.model.transition(x, dt)
    }
    fn jacobian(&self, x: &SVector<T, NX>, dt: T) -> SMatrix<T, NX, NX> {
        self.model.jacobian(x, dt)
    }
    fn process_noise(&self, x: &SVector<T, NX>, dt: T) -> Symmetric<T, NX> {
        self.model.process_noise(x, dt)
    }
    fn step(&self, dt: T) -> T {
        dt
    }
    fn advance(&self, g: &mut Gaussian<T, NX>, dt: &T) {
        match SigmaPoints::draw(g, self.scaling) {
            Some(points) => *g = points.propagate(&self.model, *dt).1,
            None => self.model.predict(g, *dt),
        }
    }
}

impl<T: Real, M: MeasurementModel<T, NX, NZ>, const NX: usize, const NZ: usize> MeasurementModel<T, NX, NZ> for Unscented<M, T> {
    const LAYOUT: Layout = M::LAYOUT;

    fn observe(&self, x: &SVector<T, NX>) -> SVector<T, NZ> {
        self.model.observe(x)
    }
    fn jacobian(&self, x: &SVector<T, NX>) -> SMatrix<T, NZ, NX> {
        self.model.jacobian(x)
    }
    fn noise(&self, x: &SVector<T, NX>) -> Symmetric<T, NZ> {
        self.model.noise(x)
    }
    fn residual(&self, z: &SVector<T, NZ>, z_hat: &SVector<T, NZ>) -> SVector<T, NZ> {
        self.model.residual(z, z_hat)
    }
    fn difference(&self, a: &SVector<T, NZ>, b: &SVector<T, NZ>) -> SVector<T, NZ> {
        self.model.difference(a, b)
    }
    fn drop_ambiguous(&self, cross: &mut SMatrix<T, NX, NZ>, spread: &mut Symmetric<T, NZ>, noise: &Symmetric<T, NZ>) {
        self.model.drop_ambiguous(cross, spread, noise);
    }
    fn innovation(&self, g: &Gaussian<T, NX>) -> Innovation<T, NX, NZ> {
        match SigmaPoints::draw(g, self.scaling) {
            Some(points) => points.observe(&self.model, &g.mean),
            None => self.model.innovation(g),
        }
    }
    fn is_finite(&self) -> bool {
        self.model.is_finite()
    }
    fn velocity(&self) -> [T; 3] {
        self.model.velocity()
    }
    fn nominal_noise(&self) -> Symmetric<T, NZ> {
        self.model.nominal_noise()
    }
    fn locate(&self, z: &SVector<T, NZ>, noise: &Symmetric<T, NZ>) -> Option<super::Fix<T>> {
        self.model.locate(z, noise)
    }
}
