//! Fusion of tracks, held against the textbook in double precision and against what may be asked of any picture.
//!
//! | module | what | against what |
//! |---|---|---|
//! | [`rules`] | covariance intersection, convex combination, mode probabilities | the information form; true errors of any correlation; a dense scan |
//! | [`correlated`] | cross-covariance, Bar-Shalom and Campo, the test of two tracks | the joint covariance of two filters; NEES of simulated ones |
//! | [`registration`] | frames | points moved by hand; finite differences |
//! | [`picture`] | life and identity of fused tracks | what happened to the targets |
//! | [`message`] | tracks in bytes | themselves; every byte changed, every length |
//! | [`reference`] | all of the reference cases | 50 digits, computed elsewhere |
//! | [`scenario`] | two sensors, four targets | the acceptance of the published scenario |

#[path = "../support/mod.rs"]
mod support;

mod correlated;
mod message;
mod picture;
mod reference;
mod registration;
mod rules;
mod scenario;

use boresight::mode::ModeBank;
use boresight::model::motion::{ConstantAcceleration, ConstantVelocity, ProcessNoise};
use boresight::scalar::Real;
use nalgebra::SMatrix;

/// Constant velocity and constant acceleration in the plane, as in the published scenario.
type Modes<T> = (ConstantVelocity<T, 2, 3>, ConstantAcceleration<T, 2>);

fn modes<T: Real>() -> Result<Modes<T>, boresight::error::ConfigError> {
    let noise = |variance: f64| ProcessNoise::Discrete(T::lit(variance));
    Ok((ConstantVelocity::new(noise(0.1))?, ConstantAcceleration::new(noise(30.0))?))
}

fn jump<T: Real>() -> boresight::mode::JumpMatrix<T, 2> {
    [[0.88, 0.12], [0.07, 0.93]].map(|row| row.map(T::lit))
}

/// Random modes about the first: whatever a tracker could have made of one target.
fn bank<T: Real>(draws: &[f64], mean: f64, deviation: f64) -> ModeBank<T, 6, 2> {
    let mut bank = ModeBank::<T, 6, 2>::new([T::lit(0.75), T::lit(0.25)], support::gaussian(draws, mean, deviation));
    let [first, second] = &mut bank.modes;
    for (k, x) in second.mean.iter_mut().enumerate() {
        *x += T::lit(draws[k] * deviation);
    }
    // As after a prediction by constant velocity: accelerations are known to be zero.
    for k in [2, 5] {
        first.mean[k] = T::ZERO;
        for (i, row) in first.cov.upper_mut().iter_mut().enumerate() {
            for (j, p) in row.iter_mut().enumerate() {
                if i == k || j == k {
                    *p = T::ZERO;
                }
            }
        }
    }
    bank
}

/// The smallest eigenvalue of `m`, made symmetric.
fn least<const N: usize>(m: &SMatrix<f64, N, N>) -> f64 {
    nalgebra::DMatrix::from_fn(N, N, |i, j| 0.5 * (m[(i, j)] + m[(j, i)])).symmetric_eigenvalues().min()
}
