//! Motion and measurement models, held against their definitions on random inputs, in f32 and f64.
//!
//! | module | what | against what |
//! |---|---|---|
//! | [`motion`] | every motion model | its dense form, central differences, composition of steps |
//! | [`turn`] | coordinated turns | the differential equation, the limits at ω = 0, both sides of the series |
//! | [`singer`] | the noise integrals of Singer's model | numerical quadrature, constant acceleration |
//! | [`sensors`] | position and every radar | its dense form, central differences, the geometry written with rotations |
//! | [`converted`] | polar to Cartesian | Monte Carlo with fixed seeds |
//! | [`unscented`] | sigma points | the Kalman filter on linear models, a turned sensor at the seam of angles |

#[path = "../support/mod.rs"]
mod support;

mod converted;
mod motion;
mod scene;
mod sensors;
mod singer;
mod turn;
mod unscented;

use nalgebra::{SMatrix, SVector};

/// ∂f/∂x at `x` by central differences, with a bound on what is wrong with each entry.
///
/// With D(h) = (f(x + h) − f(x − h)) / 2h the estimate is (4 D(h) − D(2h)) / 3. Its error is of fourth order in h and so
/// smaller than |D(2h) − D(h)|, which is of second; rounding adds at most `rounding` / h, where `rounding` bounds the error
/// of every coordinate of f. `minus` takes the difference of two values: angles wrap.
fn derivative<const N: usize, const M: usize>(
    f: impl Fn(&SVector<f64, N>) -> SVector<f64, M>,
    minus: impl Fn(&SVector<f64, M>, &SVector<f64, M>) -> SVector<f64, M>,
    x: &SVector<f64, N>,
    steps: &SVector<f64, N>,
    rounding: &SVector<f64, M>,
) -> (SMatrix<f64, M, N>, SMatrix<f64, M, N>) {
    let mut estimate = SMatrix::<f64, M, N>::zeros();
    let mut bound = SMatrix::<f64, M, N>::zeros();
    for i in 0..N {
        let difference = |h: f64| {
            let (mut above, mut below) = (*x, *x);
            above[i] += h;
            below[i] -= h;
            // The step that was taken, after rounding.
            minus(&f(&above), &f(&below)) / (above[i] - below[i])
        };
        let (fine, coarse) = (difference(steps[i]), difference(2.0 * steps[i]));
        estimate.set_column(i, &((fine * 4.0 - coarse) / 3.0));
        bound.set_column(i, &((coarse - fine).abs() + rounding / steps[i]));
    }
    (estimate, bound)
}
