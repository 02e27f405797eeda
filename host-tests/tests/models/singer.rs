//! Singer's model against its integrals, evaluated numerically, and against constant acceleration for slow decay.
//!
//! ```text
//! F = [1 T g₁; 0 1 g₂; 0 0 g₃],  Q = 2ασ² ∫₀ᵀ g(τ) g(τ)' dτ,  g = ((ατ − 1 + e^{−ατ})/α², (1 − e^{−ατ})/α, e^{−ατ})
//! ```
//!
//! All integrands are positive and are evaluated without cancellation; the quadrature (double exponential) is good to
//! 1e-14, which is checked on the way by halving its step.

use crate::support::{least_eigenvalue, wide, wide_cov, within};
use boresight::model::MotionModel;
use boresight::model::motion::{ConstantAcceleration, ProcessNoise, Singer};
use boresight::scalar::Real;
use nalgebra::{SMatrix, SVector, Vector3};
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestCaseResult};

/// Relative error of an entry of F or Q, in ε. Worst is Q₁₁ where the closed form takes over from the series, at αT = 1:
/// terms whose absolute values sum to 4.6 leave 0.03, so that their roundings, about six each, count 150 times.
pub const ACCURACY: f64 = 1000.0;

/// ∫₀¹ f(u) du by the double exponential rule with step `h`; u and 1 − u without cancellation at both ends.
fn integral<const N: usize>(h: f64, f: impl Fn(f64) -> SVector<f64, N>) -> SVector<f64, N> {
    let steps = (4.0 / h) as i32;
    (-steps..=steps)
        .map(|k| {
            let t = f64::from(k) * h;
            let (u, rest) = (1.0 / (1.0 + (-std::f64::consts::PI * t.sinh()).exp()), 1.0 / (1.0 + (std::f64::consts::PI * t.sinh()).exp()));
            f(u) * (u * rest * std::f64::consts::PI * t.cosh() * h)
        })
        .sum()
}

/// g(τ) in units of T = 1, for x = ατ: g₁ = τ² ∫ (1 − u) e^{−xu} du, where x is too small for the quotient.
fn g(a: f64, tau: f64) -> Vector3<f64> {
    let x = a * tau;
    let first = if x > 2.0 {
        (x - 1.0 + (-x).exp()) / (a * a)
    } else {
        tau * tau * integral(1.0 / 16.0, |u| SVector::<f64, 1>::new((1.0 - u) * (-x * u).exp()))[0]
    };
    Vector3::new(first, if a == 0.0 { tau } else { -(-x).exp_m1() / a }, (-x).exp())
}

/// ∫₀¹ g g' dτ, rows one after another.
fn gramian(a: f64) -> Result<SMatrix<f64, 3, 3>, TestCaseError> {
    let products = |tau: f64| {
        let g = g(a, tau);
        SVector::<f64, 9>::from_fn(|i, _| g[i / 3] * g[i % 3])
    };
    // In two pieces: up to the knee the exponentials fade, behind it they are gone.
    let knee = (40.0 / a).min(1.0);
    let at = |h: f64| integral(h, |u| products(knee * u) * knee + products(knee + (1.0 - knee) * u) * (1.0 - knee));
    let (fine, coarse) = (at(1.0 / 32.0), at(1.0 / 16.0));
    // The rule doubles its correct digits with every halving: 1e-10 here is 1e-14 there, rounding apart.
    prop_assert!((0..9).all(|i| (fine[i] - coarse[i]).abs() <= 1e-10 * fine[i]), "the quadrature did not converge at {a}");
    Ok(SMatrix::from_fn(|i, j| fine[3 * i + j]))
}

/// diag(T², T, 1)
fn powers(dt: f64) -> SMatrix<f64, 3, 3> {
    SMatrix::from_diagonal(&Vector3::new(dt * dt, dt, 1.0))
}

fn equals_the_integrals<T: Real>(time_constant: f64, dt: f64) -> TestCaseResult {
    let (time_constant, dt, sigma) = (T::lit(time_constant), T::lit(dt), T::lit(3.0));
    let model = Singer::<T, 1>::new(time_constant, sigma)?;
    let (x, alpha, t) = (SVector::<T, 3>::zeros(), 1.0 / time_constant.to_f64(), dt.to_f64());
    let relative = ACCURACY * T::EPSILON.to_f64() + 1e-14;
    let q = wide_cov(&model.process_noise(&x, dt));
    let want = powers(t) * gramian(alpha * t)? * powers(t) * (2.0 * 9.0 * alpha * t);
    within("Q", &q, &want, &(want * relative))?;
    let (f, g) = (wide(&model.jacobian(&x, dt)), g(alpha * t, 1.0));
    for (i, want) in [g[0] * t * t, g[1] * t, g[2]].into_iter().enumerate() {
        // e^{−αT} inherits αT ε from its argument and is zero below the least number.
        let bound = (relative + alpha * t * T::EPSILON.to_f64()) * want + T::LN_FLOOR.to_f64().exp();
        prop_assert!((f[(i, 2)] - want).abs() <= bound, "F{i}3: {} for {want}", f[(i, 2)]);
    }
    Ok(())
}

/// F within αT, and Q within 2 αT, of constant acceleration, relatively: e^{−αT} ≥ 1 − αT in every integrand.
fn tends_to_constant_acceleration<T: Real>(decay: f64, dt: f64) -> TestCaseResult {
    let (a, sigma) = (T::lit(decay), T::lit(2.0));
    let dt = T::lit(dt);
    let singer = Singer::<T, 2>::new(dt / a, sigma)?;
    let jerk = (a / dt).to_f64() * 2.0 * 4.0;
    let ca = ConstantAcceleration::<T, 2>::new(ProcessNoise::Continuous(T::lit(jerk)))?;
    let x = SVector::<T, 6>::zeros();
    let (f, q) = (wide(&ca.jacobian(&x, dt)), wide_cov(&ca.process_noise(&x, dt)));
    // Sixteen roundings on the way to an entry, and those of the series, whose terms fall from the first.
    let rounding = 32.0 * T::EPSILON.to_f64();
    within("F", &wide(&singer.jacobian(&x, dt)), &f, &(f * (a.to_f64() + rounding)))?;
    within("Q", &wide_cov(&singer.process_noise(&x, dt)), &q, &(q * (2.0 * a.to_f64() + rounding)))
}

/// At αT = 1 the series ends and the closed form begins: the neighbours of 1 give nearly one Q.
fn is_continuous_at_one<T: Real>() -> TestCaseResult {
    let model = Singer::<T, 1>::new(T::ONE, T::ONE)?;
    let x = SVector::<T, 3>::zeros();
    let sides = [T::ONE - T::EPSILON, T::ONE, T::ONE + T::EPSILON];
    let [below, at, above] = sides.map(|dt| wide_cov(&model.process_noise(&x, dt)));
    // No entry of Q grows faster than T⁶; the rest is the accuracy of either side.
    let bound = at * ((2.0 * ACCURACY + 2.0 * 6.0) * T::EPSILON.to_f64());
    within("series to closed form", &at, &above, &bound)?;
    within("series to series", &below, &at, &bound)
}

/// Q is far from singular for every decay: the smallest eigenvalue of its correlations lies between those of constant
/// acceleration, 0.0086, and of white acceleration, 1 − √¾ = 0.134.
fn is_definite<T: Real>(decay: f64) -> TestCaseResult {
    let model = Singer::<T, 1>::new(T::ONE, T::ONE)?;
    let least = least_eigenvalue::<T, 3>(&model.process_noise(&SVector::zeros(), T::lit(decay)));
    // Three entries a row, each off by the accuracy.
    let slack = 3.0 * ACCURACY * T::EPSILON.to_f64();
    prop_assert!(least >= 0.0085 - slack && least <= 0.134 + slack, "least eigenvalue {least} at {decay}");
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn transition_and_noise_are_the_integrals(time_constant in -3.0..6.0f64, dt in -3.0..3.0f64) {
        let (time_constant, dt) = (10f64.powf(time_constant), 10f64.powf(dt));
        equals_the_integrals::<f32>(time_constant, dt)?;
        equals_the_integrals::<f64>(time_constant, dt)?;
    }

    #[test]
    fn around_one_too(dt in 0.9..1.1f64) {
        equals_the_integrals::<f32>(1.0, dt)?;
        equals_the_integrals::<f64>(1.0, dt)?;
    }

    #[test]
    fn slow_decay_is_constant_acceleration(decay in -12.0..-1.0f64, dt in -2.0..2.0f64) {
        tends_to_constant_acceleration::<f32>(10f64.powf(decay), 10f64.powf(dt))?;
        tends_to_constant_acceleration::<f64>(10f64.powf(decay), 10f64.powf(dt))?;
    }

    #[test]
    fn the_noise_is_definite(decay in -6.0..6.0f64) {
        is_definite::<f32>(10f64.powf(decay))?;
        is_definite::<f64>(10f64.powf(decay))?;
    }
}

#[test]
fn series_and_closed_form_meet_at_one() -> Result<(), TestCaseError> {
    is_continuous_at_one::<f32>()?;
    is_continuous_at_one::<f64>()
}
