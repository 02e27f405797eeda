//! Coordinated turns against the differential equation they solve, and around the two places where a formula could
//! break: ω = 0, where S(a) = sin a / a is 0/0, and |ωT| = ½, where power series hand over to quotients.
//!
//! ```text
//! S(a) = ∫₀¹ cos au du,  C(a) = ∫₀¹ sin au du:   |S|, |C| ≤ 1,   |S'|, |C'| ≤ ½,   |S''|, |C''| ≤ 1/3
//! ```
//!
//! These are the Lipschitz constants of the tests: two rates that are close must give states, and derivatives, that are.

use crate::support::{draws, gaussian, wide};
use boresight::model::MotionModel;
use boresight::model::motion::{ConstantVelocity, ProcessNoise};
use boresight::model::turn::{KnownTurn, UnknownTurn};
use boresight::scalar::Real;
use nalgebra::SVector;
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestCaseResult};

/// x after `dt` at the known rate `rate`.
fn known<T: Real, const NX: usize, const AXES: usize>(rate: T, x: &SVector<T, NX>, dt: T) -> Result<SVector<T, NX>, TestCaseError> {
    let model = KnownTurn::<T, AXES>::new(rate, ProcessNoise::Continuous(T::ZERO))?;
    Ok(MotionModel::<T, NX>::transition(&model, x, dt))
}

/// A turn of unknown rate without noise.
fn unknown<T: Real, const AXES: usize>() -> Result<UnknownTurn<T, AXES>, TestCaseError> {
    Ok(UnknownTurn::new(ProcessNoise::Continuous(T::ZERO), ProcessNoise::Continuous(T::ZERO))?)
}

/// (x, vx, y, vy) and the rate.
fn with_rate<T: Real>(x: &SVector<T, 4>, rate: T) -> SVector<T, 5> {
    SVector::from([x[0], x[1], x[2], x[3], rate])
}

/// d/dt (x, vx, y, vy, z, vz) = (vx, −ω vy, vy, ω vx, vz, 0) by the classical Runge-Kutta method.
fn integrated(rate: f64, x: SVector<f64, 6>, dt: f64) -> SVector<f64, 6> {
    const STEPS: u32 = 400;
    let slope = |x: SVector<f64, 6>| SVector::from([x[1], -rate * x[3], x[3], rate * x[1], x[5], 0.0]);
    let h = dt / f64::from(STEPS);
    (0..STEPS).fold(x, |x, _| {
        let a = slope(x);
        let b = slope(x + a * (h / 2.0));
        let c = slope(x + b * (h / 2.0));
        let d = slope(x + c * h);
        x + (a + (b + c) * 2.0 + d) * (h / 6.0)
    })
}

/// Two rates whose angles differ by little: so must the states, by the Lipschitz constants, known rate and unknown.
fn states_are_close<T: Real>(x: &SVector<T, 4>, rates: [T; 2], dt: T) -> TestCaseResult {
    let speed = (x[1].abs() + x[3].abs()).to_f64();
    let time = dt.to_f64();
    let turned = time * (rates[0] - rates[1]).abs().to_f64();
    // sin and cos are within one ε; their quotients by ½ and more, and the products with T and v, within eight.
    let rounding = 8.0 * T::EPSILON.to_f64();
    let (a, b) = (known::<T, 4, 2>(rates[0], x, dt)?, known::<T, 4, 2>(rates[1], x, dt)?);
    let model = unknown::<T, 2>()?;
    let (c, d) = (model.transition(&with_rate(x, rates[0]), dt), model.transition(&with_rate(x, rates[1]), dt));
    for (i, size) in [(0, time), (1, 1.0), (2, time), (3, 1.0)] {
        // Positions by time · |S'| or |C'| · speed, velocities by the speed.
        let lipschitz = if i % 2 == 0 { 0.5 * time } else { 1.0 };
        let bound = lipschitz * turned * speed + rounding * (x[i].abs().to_f64() + size * speed);
        let (known, unknown) = ((a[i] - b[i]).abs().to_f64(), (c[i] - d[i]).abs().to_f64());
        prop_assert!(known <= bound, "state {i}: {known:e} apart, bound {bound:e}");
        prop_assert!(unknown <= bound, "state {i}: {unknown:e} apart, bound {bound:e}");
    }
    Ok(())
}

/// The derivatives by the rate at two rates.
fn derivatives_are_close<T: Real>(x: &SVector<T, 4>, rates: [T; 2], dt: T) -> TestCaseResult {
    let model = unknown::<T, 2>()?;
    let [a, b] = rates.map(|rate| wide(&model.jacobian(&with_rate(x, rate), dt)));
    let (speed, time) = ((x[1].abs() + x[3].abs()).to_f64(), dt.to_f64());
    let turned = time * (rates[0] - rates[1]).abs().to_f64();
    // (cos a − S) / a at a = ½: three ε of the terms, over ½, twice; and the products.
    let rounding = 16.0 * T::EPSILON.to_f64();
    for (i, size, lipschitz) in [(0, time * time, 1.0 / 3.0), (1, time, 1.0), (2, time * time, 1.0 / 3.0), (3, time, 1.0)] {
        let bound = size * speed * (lipschitz * turned + rounding);
        let difference = (a[(i, 4)] - b[(i, 4)]).abs();
        prop_assert!(difference <= bound, "∂x{i}/∂ω: {difference:e} apart, bound {bound:e}");
    }
    Ok(())
}

/// The two numbers next to `a`, below and above.
fn neighbours<T: Real>(a: T) -> [T; 2] {
    let step = a.abs() * T::EPSILON;
    [a - step, a + step]
}

fn small_rates<T: Real>(draws: &[f64], exponent: i32, dt: f64) -> TestCaseResult {
    let x = gaussian::<T, 4>(draws, 100.0, 1.0).mean;
    let (tiny, dt) = (T::lit(10f64.powi(exponent)), T::lit(dt));
    let cv = ConstantVelocity::<T, 2>::new(ProcessNoise::Continuous(T::ZERO))?;
    let straight = MotionModel::<T, 4>::transition(&cv, &x, dt);
    let at_zero = known::<T, 4, 2>(T::ZERO, &x, dt)?;
    for i in 0..4 {
        // One rounding each in x + T v.
        let bound = T::EPSILON * (x[i].abs() + (dt * x[(i + 1).min(3)]).abs());
        prop_assert!((at_zero[i] - straight[i]).abs() <= bound);
    }
    for rates in [[-tiny, tiny], [T::ZERO, tiny], [-tiny, T::ZERO]] {
        states_are_close(&x, rates, dt)?;
        derivatives_are_close(&x, rates, dt)?;
    }
    // ω = 0: S' = 0 and C' = ½, so ∂(x, vx, y, vy)/∂ω = (−½ T² vy, −T vy, ½ T² vx, T vx).
    let f = unknown::<T, 2>()?.jacobian(&with_rate(&x, T::ZERO), dt);
    let half = T::lit(0.5) * dt * dt;
    for (got, want) in f.column(4).iter().zip([-half * x[3], -dt * x[3], half * x[1], dt * x[1]]) {
        // Two or three products on either side.
        prop_assert!((*got - want).abs() <= T::lit(4.0) * T::EPSILON * want.abs(), "{got} for {want}");
    }
    Ok(())
}

fn across_the_series<T: Real>(draws: &[f64], dt: f64, left: bool) -> TestCaseResult {
    let x = gaussian::<T, 4>(draws, 100.0, 1.0).mean;
    let dt = T::lit(dt);
    let half = T::lit(if left { 0.5 } else { -0.5 }) / dt;
    // The quotient half / dt is rounded: among its neighbours the product falls on both sides of ½.
    let [below, above] = neighbours(half);
    for rates in [[below, above], [below, half], [half, above]] {
        states_are_close(&x, rates, dt)?;
        derivatives_are_close(&x, rates, dt)?;
    }
    Ok(())
}

fn solves_the_equation<T: Real>(draws: &[f64], rate: f64, dt: f64) -> TestCaseResult {
    let x = gaussian::<T, 6>(draws, 100.0, 1.0).mean;
    let (rate, dt) = (T::lit(rate), T::lit(dt));
    let truth = integrated(rate.to_f64(), wide(&x), dt.to_f64());
    let got = wide(&known::<T, 6, 3>(rate, &x, dt)?);
    let mut unknown_state = SVector::<T, 7>::zeros();
    unknown_state.fixed_rows_mut::<6>(0).copy_from(&x);
    unknown_state[6] = rate;
    let unknown = wide(&unknown::<T, 3>()?.transition(&unknown_state, dt));
    let (angle, time) = ((rate * dt).to_f64().abs(), dt.to_f64());
    let speed = wide(&x).iter().skip(1).step_by(2).map(|v| v.abs()).sum::<f64>();
    // The method's error, (a/n)⁴ a / 120 of the speed, and that of rounding the angle, a ε / 2; the rest as above.
    let relative = (angle / 400.0).powi(4) * angle / 120.0 + T::EPSILON.to_f64() * (8.0 + angle) + 400.0 * f64::EPSILON;
    for i in 0..6 {
        let bound = relative * (x[i].abs().to_f64() + speed * if i % 2 == 0 { time } else { 1.0 });
        prop_assert!((got[i] - truth[i]).abs() <= bound, "state {i}: {} for {}, bound {bound:e}", got[i], truth[i]);
        prop_assert!((unknown[i] - truth[i]).abs() <= bound, "state {i}: {} for {}, bound {bound:e}", unknown[i], truth[i]);
    }
    prop_assert_eq!(unknown[6], rate.to_f64());
    Ok(())
}

proptest! {
    #[test]
    fn a_turn_solves_its_differential_equation(draws in draws(), rate in -3.0..3.0f64, dt in 0.0..3.0f64) {
        solves_the_equation::<f32>(&draws, rate, dt)?;
        solves_the_equation::<f64>(&draws, rate, dt)?;
    }

    #[test]
    fn small_rates_tend_to_straight_motion(draws in draws(), exponent in -30..-1i32, dt in 0.01..10.0f64) {
        small_rates::<f32>(&draws, exponent, dt)?;
        small_rates::<f64>(&draws, exponent, dt)?;
    }

    #[test]
    fn series_and_quotients_meet(draws in draws(), dt in 0.01..10.0f64, left in any::<bool>()) {
        across_the_series::<f32>(&draws, dt, left)?;
        across_the_series::<f64>(&draws, dt, left)?;
    }

    #[test]
    fn nearby_rates_give_nearby_turns(draws in draws(), rate in -3.0..3.0f64, apart in 0.0..0.1f64, dt in 0.01..3.0f64) {
        // Angles are rounded by |rate| dt ε / 2: less than the 32 ε dt by which these are at least apart.
        let rates = [rate, rate + apart + 32.0 * f64::EPSILON];
        let x = gaussian::<f64, 4>(&draws, 100.0, 1.0).mean;
        states_are_close(&x, rates, dt)?;
        derivatives_are_close(&x, rates, dt)?;
    }
}
