//! Every motion model: `predict` against the dense form, `jacobian` against central differences, the process noise
//! against its definition (semi-definite, and adding up over steps), and steps of no length.

use crate::derivative;
use crate::support::{draws, gaussian, least_eigenvalue, wide, wide_cov, within};
use boresight::error::ConfigError;
use boresight::gaussian::Gaussian;
use boresight::model::motion::{ConstantAcceleration, ConstantVelocity, ProcessNoise, Singer};
use boresight::model::turn::{KnownTurn, UnknownTurn};
use boresight::model::{MotionModel, predict_dense};
use boresight::scalar::Real;
use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestCaseResult};

/// Something that holds for a motion model.
trait Law<T: Real> {
    fn hold<M: MotionModel<T, NX>, const NX: usize>(&self, model: &M) -> TestCaseResult;
}

/// The parameters of all models.
#[derive(Clone, Copy, Debug)]
struct Parameters {
    discrete: bool,
    noise: f64,
    rate_noise: f64,
    rate: f64,
    time_constant: f64,
}

fn parameters() -> impl Strategy<Value = Parameters> {
    (any::<bool>(), 0.0..10.0f64, 0.0..0.1f64, -2.0..2.0f64, -2.0..3.0f64).prop_map(|(discrete, noise, rate_noise, rate, decades)| {
        Parameters { discrete, noise, rate_noise, rate, time_constant: 10f64.powf(decades) }
    })
}

/// Constant velocity of every shape: bare, padded, with states behind the axes.
fn every_velocity<T: Real>(noise: ProcessNoise<T>, law: &impl Law<T>) -> TestCaseResult {
    law.hold::<_, 2>(&ConstantVelocity::<T, 1>::new(noise)?)?;
    law.hold::<_, 4>(&ConstantVelocity::<T, 2>::new(noise)?)?;
    law.hold::<_, 5>(&ConstantVelocity::<T, 2>::new(noise)?)?;
    law.hold::<_, 6>(&ConstantVelocity::<T, 3>::new(noise)?)?;
    law.hold::<_, 7>(&ConstantVelocity::<T, 3>::new(noise)?)?;
    law.hold::<_, 6>(&ConstantVelocity::<T, 2, 3>::new(noise)?)?;
    law.hold::<_, 7>(&ConstantVelocity::<T, 2, 3>::new(noise)?)?;
    law.hold::<_, 9>(&ConstantVelocity::<T, 3, 3>::new(noise)?)
}

fn every_acceleration<T: Real>(noise: ProcessNoise<T>, law: &impl Law<T>) -> TestCaseResult {
    law.hold::<_, 3>(&ConstantAcceleration::<T, 1>::new(noise)?)?;
    law.hold::<_, 6>(&ConstantAcceleration::<T, 2>::new(noise)?)?;
    law.hold::<_, 9>(&ConstantAcceleration::<T, 3>::new(noise)?)
}

fn every_singer<T: Real>(p: &Parameters, law: &impl Law<T>) -> TestCaseResult {
    let (time_constant, deviation) = (T::lit(p.time_constant), T::lit(p.noise.sqrt()));
    law.hold::<_, 3>(&Singer::<T, 1>::new(time_constant, deviation)?)?;
    law.hold::<_, 6>(&Singer::<T, 2>::new(time_constant, deviation)?)?;
    law.hold::<_, 9>(&Singer::<T, 3>::new(time_constant, deviation)?)
}

fn every_turn<T: Real>(noise: ProcessNoise<T>, rate_noise: ProcessNoise<T>, rate: f64, law: &impl Law<T>) -> TestCaseResult {
    law.hold::<_, 4>(&KnownTurn::<T, 2>::new(T::lit(rate), noise)?)?;
    law.hold::<_, 6>(&KnownTurn::<T, 3>::new(T::lit(rate), noise)?)?;
    law.hold::<_, 5>(&UnknownTurn::<T, 2>::new(noise, rate_noise)?)?;
    law.hold::<_, 7>(&UnknownTurn::<T, 3>::new(noise, rate_noise)?)
}

fn every_model<T: Real>(p: &Parameters, law: &impl Law<T>) -> TestCaseResult {
    let kind = |v: f64| if p.discrete { ProcessNoise::Discrete(T::lit(v)) } else { ProcessNoise::Continuous(T::lit(v)) };
    every_velocity(kind(p.noise), law)?;
    every_acceleration(kind(p.noise), law)?;
    every_singer(p, law)?;
    every_turn(kind(p.noise), kind(p.rate_noise), p.rate, law)
}

/// predict = predict_dense.
struct DenseForm<'a> {
    draws: &'a [f64],
    dt: f64,
}

impl<T: Real> Law<T> for DenseForm<'_> {
    fn hold<M: MotionModel<T, NX>, const NX: usize>(&self, model: &M) -> TestCaseResult {
        let g = gaussian::<T, NX>(self.draws, 10.0, 3.0);
        let dt = T::lit(self.dt);
        let (mut fast, mut dense) = (g, g);
        model.predict(&mut fast, dt);
        predict_dense(model, &mut dense, dt);
        let f = wide(&model.jacobian(&g.mean, dt)).abs();
        let p = f * wide_cov(&g.cov).abs() * f.transpose() + wide_cov(&model.process_noise(&g.mean, dt)).abs();
        // An entry of F P F' + Q is a sum of sums of NX products each; that of f(x) one sum.
        let (epsilon, n) = (T::EPSILON.to_f64(), NX as f64);
        within("mean", &wide(&fast.mean), &wide(&dense.mean), &(f * wide(&g.mean).abs() * (epsilon * (n + 2.0))))?;
        within("covariance", &wide_cov(&fast.cov), &wide_cov(&dense.cov), &(p * (epsilon * (2.0 * n + 4.0))))
    }
}

/// jacobian = ∂ transition / ∂x.
struct Derivative<'a> {
    draws: &'a [f64],
    dt: f64,
}

impl Law<f64> for Derivative<'_> {
    fn hold<M: MotionModel<f64, NX>, const NX: usize>(&self, model: &M) -> TestCaseResult {
        let x = gaussian::<f64, NX>(self.draws, 10.0, 1.0).mean;
        // Transitions vary over states of 1, turn rates of 1/dt: a thousandth of either.
        let steps = SVector::repeat(1e-3 / self.dt.max(1.0));
        let f = model.jacobian(&x, self.dt);
        // A coordinate of f is the sum of NX products and more, each of a coefficient and a state.
        let rounding = f.abs() * x.abs() * (4.0 * NX as f64 * f64::EPSILON);
        let (estimate, bound) = derivative(|x| model.transition(x, self.dt), |a, b| a - b, &x, &steps, &rounding);
        within("F", &f, &estimate, &bound)
    }
}

/// Q is positive semi-definite.
struct SemiDefinite {
    dt: f64,
}

impl<T: Real> Law<T> for SemiDefinite {
    fn hold<M: MotionModel<T, NX>, const NX: usize>(&self, model: &M) -> TestCaseResult {
        let q = model.process_noise(&SVector::zeros(), T::lit(self.dt));
        // Each entry is a product of at most 16 factors, so a correlation is off by at most 16 ε and an eigenvalue by NX
        // times that. Singer's integrals are less exact but far from singular: see the module `singer`.
        let least = least_eigenvalue(&q);
        prop_assert!(least >= -16.0 * NX as f64 * T::EPSILON.to_f64(), "least eigenvalue {least:e} of {q:?}");
        Ok(())
    }
}

/// A step of no length moves no state that the model uses, and adds no noise but the increments that a model with
/// discrete noise makes once a step, however long.
struct NoTime<'a> {
    draws: &'a [f64],
    increments: bool,
}

impl<T: Real> Law<T> for NoTime<'_> {
    fn hold<M: MotionModel<T, NX>, const NX: usize>(&self, model: &M) -> TestCaseResult {
        let before = gaussian::<T, NX>(self.draws, 10.0, 3.0);
        let mut after = before;
        model.predict(&mut after, T::ZERO);
        let f = model.jacobian(&before.mean, T::ZERO);
        let q = model.process_noise(&before.mean, T::ZERO);
        for i in 0..NX {
            // What constant velocity does not use it makes zero at once.
            let used = f[(i, i)];
            prop_assert!(used == T::ONE || used == T::ZERO);
            prop_assert_eq!(after.mean[i], before.mean[i] * used);
            for j in i..NX {
                let (p, noise) = (entry(&before, i, j), q.to_matrix()[(i, j)]);
                let increment = self.increments && i == j && (i % 3 == 2 || i == NX - 1);
                prop_assert!(noise == T::ZERO || increment, "noise {noise} at ({i}, {j})");
                prop_assert_eq!(entry(&after, i, j), p * used * f[(j, j)] + noise);
            }
        }
        Ok(())
    }
}

fn entry<T: Real, const NX: usize>(g: &Gaussian<T, NX>, i: usize, j: usize) -> T {
    g.cov.upper()[i][j]
}

/// Two steps make one: F(s + t) = F(s) F(t) and Q(s + t) = F(t) Q(s) F(t)' + Q(t).
struct Composition {
    dt: [f64; 2],
    noise_too: bool,
    /// Relative error of an entry of F or Q, in ε.
    accuracy: f64,
}

impl<T: Real> Law<T> for Composition {
    fn hold<M: MotionModel<T, NX>, const NX: usize>(&self, model: &M) -> TestCaseResult {
        let [first, second] = self.dt.map(T::lit);
        let x = SVector::zeros();
        let f = |dt: T| wide(&model.jacobian(&x, dt));
        let q = |dt: T| wide_cov(&model.process_noise(&x, dt));
        let (whole, turned) = (f(first + second), f(second) * f(first));
        // Besides the entries themselves and the sums of NX products, the sum of the times is rounded: half an ε, to the
        // fifth power at most. Turned velocities and faded accelerations may be small beside their terms, of which none
        // is larger than the time or one.
        let relative = T::EPSILON.to_f64() * (3.0 * self.accuracy + 2.0 * NX as f64 + 4.0);
        let size: SMatrix<f64, NX, NX> = f(second).abs() * f(first).abs() + whole.abs();
        let terms = 1.0 + self.dt[0] + self.dt[1];
        within("F", &whole, &turned, &size.map(|v| if v == 0.0 { 0.0 } else { relative * (v + terms) }))?;
        if self.noise_too {
            let sum = f(second) * q(first) * f(second).transpose() + q(second);
            within("Q", &q(first + second), &sum, &(sum.abs() * relative))?;
        }
        Ok(())
    }
}

/// A law that is tried in the precision of f32 and f64.
fn in_both(p: &Parameters, law: &(impl Law<f32> + Law<f64>)) -> TestCaseResult {
    every_model::<f32>(p, law)?;
    every_model::<f64>(p, law)
}

proptest! {
    #[test]
    fn prediction_equals_the_dense_form(draws in draws(), p in parameters(), dt in 0.0..5.0f64) {
        in_both(&p, &DenseForm { draws: &draws, dt })?;
    }

    #[test]
    fn the_jacobian_is_the_derivative_of_the_transition(draws in draws(), p in parameters(), dt in 0.01..5.0f64) {
        every_model::<f64>(&p, &Derivative { draws: &draws, dt })?;
    }

    #[test]
    fn process_noise_is_semi_definite(p in parameters(), decades in -4.0..3.0f64) {
        in_both(&p, &SemiDefinite { dt: 10f64.powf(decades) })?;
    }

    #[test]
    fn no_time_changes_nothing(draws in draws(), p in parameters()) {
        in_both(&p, &NoTime { draws: &draws, increments: p.discrete })?;
    }

    #[test]
    fn two_steps_make_one(p in parameters(), first in 0.01..3.0f64, second in 0.01..3.0f64) {
        let continuous = |v: f64| ProcessNoise::Continuous(v);
        // Nine factors at most: q t⁵/20.
        let exact = Composition { dt: [first, second], noise_too: true, accuracy: 9.0 };
        every_velocity(continuous(p.noise), &exact)?;
        every_acceleration(continuous(p.noise), &exact)?;
        every_velocity(ProcessNoise::Continuous(p.noise as f32), &exact)?;
        every_acceleration(ProcessNoise::Continuous(p.noise as f32), &exact)?;
        // The bound of the module `singer`.
        let singer = Composition { accuracy: crate::singer::ACCURACY, ..exact };
        every_singer::<f32>(&p, &singer)?;
        every_singer::<f64>(&p, &singer)?;
        // The noise of a turn is that of constant velocity and does not add up. The angle is at most 12, so that rounding
        // it moves sine and cosine by 12 ε.
        let turn = Composition { noise_too: false, accuracy: 16.0, ..exact };
        every_turn::<f32>(ProcessNoise::Continuous(0.0), ProcessNoise::Continuous(0.0), p.rate, &turn)?;
        every_turn::<f64>(continuous(0.0), continuous(0.0), p.rate, &turn)?;
    }
}

#[test]
fn impossible_parameters_are_refused() -> Result<(), TestCaseError> {
    for (value, error) in [(-1.0, ConfigError::NotPositive), (f64::NAN, ConfigError::NotFinite), (f64::INFINITY, ConfigError::NotFinite)] {
        for noise in [ProcessNoise::Discrete(value), ProcessNoise::Continuous(value)] {
            prop_assert_eq!(ConstantVelocity::<f64, 2>::new(noise).err(), Some(error));
            prop_assert_eq!(ConstantAcceleration::<f64, 2>::new(noise).err(), Some(error));
            prop_assert_eq!(KnownTurn::<f64, 2>::new(0.1, noise).err(), Some(error));
            prop_assert_eq!(UnknownTurn::<f64, 2>::new(noise, ProcessNoise::Discrete(0.0)).err(), Some(error));
            prop_assert_eq!(UnknownTurn::<f64, 2>::new(ProcessNoise::Discrete(0.0), noise).err(), Some(error));
        }
        prop_assert_eq!(Singer::<f64, 2>::new(value, 1.0).err(), Some(error));
        prop_assert_eq!(Singer::<f64, 2>::new(1.0, value).err(), Some(error));
    }
    prop_assert_eq!(Singer::<f64, 2>::new(0.0, 1.0).err(), Some(ConfigError::NotPositive));
    prop_assert_eq!(KnownTurn::<f64, 2>::new(f64::NAN, ProcessNoise::Discrete(0.0)).err(), Some(ConfigError::NotFinite));
    Ok(())
}
