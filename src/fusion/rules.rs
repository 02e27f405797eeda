//! Two estimates of one target made one, x_1, P_1 and x_2, P_2 of unknown or no correlation.
//!
//! ```text
//! both       M = β P_1 + α P_2,  W_1 = P_1 M⁻,  W_2 = P_2 M⁻
//!            x = x_1 + β W_1 (x_2 − x_1),   P = α W_2 P_1 W_2' + β W_1 P_2 W_1'
//! convex     α = β = 1:       P⁻¹ = P_1⁻¹ + P_2⁻¹
//! CI         α = ω, β = 1−ω:  P⁻¹ = ω P_1⁻¹ + (1−ω) P_2⁻¹
//!   det      least where tr M⁻ (P_1 − P_2) = 0,   for ln det P = ln det P_1 P_2 − ln det M
//!   trace    least where tr W_1 P_2 W_1' = tr W_2 P_1 W_2'
//! ```
//!
//! The information form of the textbooks is written without P⁻¹: nothing singular is inverted (M⁻ in `inverse.rs`), P is a sum of
//! positive terms, and the weights 0 and 1 need no care. What both know exactly stays as the first has it.
//!
//! Both criteria are convex in ω. Their slopes are tr M⁻ (P_1 − P_2), and the second trace less the first: they rise, and one
//! bracketed search for the zero finds the optimum, or the boundary exactly where the slope does not change sign. The search is
//! that of Oliveira and Takahashi (*ACM Trans. Math. Software* 47(1), 2020): as fast as the secant, never more steps than
//! bisection and one. It stops at √ε, where what is left to gain is of the order of ε.
//!
//! Covariance intersection: Julier and Uhlmann, *Proc. ACC*, 1997. It is consistent whatever the correlation. The convex
//! combination is exact for independent errors and overconfident for all others: tracks of one target share its process
//! noise and its prior.

use super::inverse::generalised_inverse;
use super::work::COUNTED;
use crate::error::ConfigError;
use crate::gaussian::Gaussian;
use crate::scalar::{Real, exp, larger, ln, sqrt};
use crate::symmetric::Symmetric;
use nalgebra::SMatrix;

/// How two estimates whose correlation is not known become one.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Rule<T> {
    /// As if the errors were independent: a baseline, overconfident for tracks of one target
    NaiveConvex,
    /// Covariance intersection: never overconfident
    Intersection(Weight<T>),
}

/// The weight ω of the first estimate in covariance intersection.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Weight<T> {
    /// Given, 0 to 1
    Fixed(T),
    /// That of the least det P: minds no units
    Determinant,
    /// That of the least tr P, the squares of metres and metres per second added up
    Trace,
}

/// More steps than the search can take: log₂ of 1 / √ε and two, in double precision.
const ROUNDS: usize = 30;

impl<T: Real> Rule<T> {
    /// Refuses a fixed weight that is none.
    ///
    /// # Errors
    /// Where it is not in 0..=1.
    pub fn check(self) -> Result<Self, ConfigError> {
        match self {
            Rule::Intersection(Weight::Fixed(w)) if !(w >= T::ZERO && w <= T::ONE) => Err(ConfigError::NotAProbability),
            rule => Ok(rule),
        }
    }

    /// The estimate made of `a` and `b`; `None` where a covariance is none, or the result not finite.
    ///
    /// Cost: about 5 NX³ multiply-adds, and NX³ more for every step of a search: at most 14 in single precision, 29 in double.
    #[must_use]
    pub fn fuse<const NX: usize>(&self, a: &Gaussian<T, NX>, b: &Gaussian<T, NX>) -> Option<Gaussian<T, NX>> {
        COUNTED.fusions.add(1);
        match self {
            Rule::NaiveConvex => combine(a, b, [T::ONE; 2]),
            Rule::Intersection(weight) => {
                let w = weight.of(&a.cov, &b.cov)?;
                combine(a, b, [w, T::ONE - w])
            }
        }
    }

    /// All of `estimates` made one, each fused in its turn with what the ones before have made; `None` without any, or where
    /// [`fuse`](Self::fuse) has none. The convex combination does not depend on the order; intersection does, and is consistent
    /// in any.
    #[must_use]
    pub fn fuse_in_order<'a, const NX: usize>(&self, mut estimates: impl Iterator<Item = &'a Gaussian<T, NX>>) -> Option<Gaussian<T, NX>>
    where
        T: 'a,
    {
        let first = *estimates.next()?;
        estimates.try_fold(first, |fused, g| self.fuse(&fused, g))
    }
}

impl<T: Real> Weight<T> {
    /// ω for these covariances; ½ where every weight is as good, for equal ones.
    #[must_use]
    pub fn of<const NX: usize>(&self, p1: &Symmetric<T, NX>, p2: &Symmetric<T, NX>) -> Option<T> {
        match self {
            Weight::Fixed(w) => Some(*w),
            Weight::Determinant => optimum(|w| {
                let (inverse, _) = generalised_inverse(&mixed(p1, p2, [w, T::ONE - w]), |_| true)?;
                // The trace of a product of symmetric matrices is the sum of the products of their entries.
                let row = |i: usize| (0..NX).fold(T::ZERO, |sum, j| sum + inverse.at(i, j) * (p1.at(i, j) - p2.at(i, j)));
                Some((0..NX).fold(T::ZERO, |sum, i| sum + row(i)))
            }),
            Weight::Trace => optimum(|w| {
                let (_, [first, second]) = terms(p1, p2, [w, T::ONE - w])?;
                Some(second.trace() - first.trace())
            }),
        }
    }
}

/// M = β P_1 + α P_2
fn mixed<T: Real, const NX: usize>(p1: &Symmetric<T, NX>, p2: &Symmetric<T, NX>, [alpha, beta]: [T; 2]) -> Symmetric<T, NX> {
    Symmetric::from_fn(|i, j| beta * p1.upper()[i][j] + alpha * p2.upper()[i][j])
}

type Square<T, const N: usize> = SMatrix<T, N, N>;

/// W_1, and the two terms of P: W_2 P_1 W_2' and W_1 P_2 W_1'.
fn terms<T: Real, const NX: usize>(
    p1: &Symmetric<T, NX>,
    p2: &Symmetric<T, NX>,
    shares: [T; 2],
) -> Option<(Square<T, NX>, [Square<T, NX>; 2])> {
    let (inverse, _) = generalised_inverse(&mixed(p1, p2, shares), |_| true)?;
    let (p1, p2, inverse) = (p1.to_matrix(), p2.to_matrix(), inverse.to_matrix());
    let (w1, w2) = (p1 * inverse, p2 * inverse);
    Some((w1, [w2 * p1 * w2.transpose(), w1 * p2 * w1.transpose()]))
}

fn combine<T: Real, const NX: usize>(a: &Gaussian<T, NX>, b: &Gaussian<T, NX>, [alpha, beta]: [T; 2]) -> Option<Gaussian<T, NX>> {
    if alpha == T::ZERO || beta == T::ZERO {
        return Some(if beta == T::ZERO { *a } else { *b });
    }
    let (w1, [first, second]) = terms(&a.cov, &b.cov, [alpha, beta])?;
    let mut fused = *a;
    fused.replace(a.mean + w1 * (b.mean - a.mean) * beta, &(first * alpha + second * beta)).then_some(fused)
}

/// The zero in 0..=1 of `slope`, which rises; the end where it has none, ½ where it is zero at both.
fn optimum<T: Real>(slope: impl Fn(T) -> Option<T>) -> Option<T> {
    let slope = |w| {
        COUNTED.slopes.add(1);
        slope(w)
    };
    let (half, tolerance) = (T::lit(0.5), sqrt(T::EPSILON));
    let (mut low, mut high) = ((T::ZERO, slope(T::ZERO)?), (T::ONE, slope(T::ONE)?));
    match (low.1 >= T::ZERO, high.1 <= T::ZERO) {
        (true, true) => return Some(half),
        (true, false) => return Some(T::ZERO),
        (false, true) => return Some(T::ONE),
        (false, false) => {}
    }
    // The half width that bisection would have had one step before: no step may lead outside of it.
    let mut allowance = T::ONE;
    for _ in 0..ROUNDS {
        let width = high.0 - low.0;
        if width <= tolerance + tolerance {
            break;
        }
        let middle = low.0 + half * width;
        let secant = low.0 + width * (low.1 / (low.1 - high.1));
        // A little towards the middle, so that both ends come nearer; then into the allowance.
        let push = T::lit(0.2) * width * width;
        let towards = if secant < middle { T::ONE } else { -T::ONE };
        let distance = (middle - secant).abs();
        let left = larger(distance - push, T::ZERO);
        let radius = allowance - half * width;
        let w = middle - towards * if left <= radius { left } else { larger(radius, T::ZERO) };
        let at = slope(w)?;
        if at < T::ZERO {
            low = (w, at);
        } else if at > T::ZERO {
            high = (w, at);
        } else {
            return at.is_finite().then_some(w);
        }
        allowance *= half;
    }
    Some(half * (low.0 + high.0))
}

/// The mode probabilities of several estimates of one target: their geometric mean, normalised, μ_j ∝ Π_i μ_ij^{1/n}.
///
/// That is what covariance intersection does to densities, done to probabilities (Hurley, *Proc. Fusion*, 2002): common
/// knowledge counts once. A mode that one of them excludes is excluded; where they exclude all, it is the arithmetic mean.
/// All zeros without any.
#[must_use]
pub fn fuse_probabilities<'a, T: Real, const MODES: usize>(of: impl Iterator<Item = &'a [T; MODES]>) -> [T; MODES] {
    let (mut logs, mut sums, mut count) = ([T::ZERO; MODES], [T::ZERO; MODES], 0);
    for prob in of {
        for ((log, sum), p) in logs.iter_mut().zip(&mut sums).zip(prob) {
            *log += ln(*p);
            *sum += *p;
        }
        count += 1;
    }
    let most = logs.iter().fold(-T::ONE / T::ZERO, |most, log| larger(most, *log));
    let share = T::ONE / T::from_count(count.max(1));
    let fused = if count > 1 && most.is_finite() { logs.map(|log| exp((log - most) * share)) } else { sums };
    let sum = fused.iter().fold(T::ZERO, |sum, p| sum + *p);
    if sum > T::ZERO && count > 1 { fused.map(|p| p / sum) } else { sums }
}
