//! Global nearest neighbour: the most probable joint event is taken for certain. A baseline that knows no doubt.
//!
//! ```text
//! Poisson clutter   a* = argmax_a Σ_t ln w(t, a_t)
//! diffuse clutter   a* = argmax_a Σ_t ln w(t, a_t) + ln f(k),   ln f(k) = Σ_{i<k} g_i,   g_i = ln (m / (m − i))
//! k tracks are served, m detections are gated by any track (see `matrix.rs` for the factor f)
//! ```
//!
//! f makes no difference of its own between detections, so with g added to every ln hit an assignment is the best of all
//! with the number k that it happens to serve. A(k), the best sum with k served, is concave (a flow of k units), and ln f
//! is convex. So the best k of all, k*, is also what a bonus of g = g_{k*} finds (g_{k*−1} if k* = min(T, m)), or finds
//! something as good. More bonus never serves fewer: after a bonus g_i that served k > i, those between g_i and g_k need
//! no trial. The event is the exact maximum, for at most min(T, m) assignments instead of one, and mostly one or two.
//!
//! Blackman and Popoli 1999, section 6.4; φ! / V^φ: Bar-Shalom, Willett and Tian 2011, section 6.2.

use super::scaling::{is_possible, to_logarithms};
use super::{Assignment, AssociationMatrix, Associator, ClutterPrior, Completeness, Domain};
use crate::scalar::{Real, ln};

/// What a miss that is impossible weighs where it has to be.
const LN_IMPOSSIBLE: f64 = -1e4;

/// Global nearest neighbour. Of the joint event of the greatest weight every probability is 1.
///
/// Without any possible event as few tracks as can be miss although they cannot, and [`Completeness::infeasible`] is 1. At most
/// `TRACKS (TRACKS + 3) DETS` pairs are looked at, under diffuse clutter `TRACKS + 1` times as many.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Gnn;

impl<T: Real, const TRACKS: usize, const DETS: usize> Associator<T, TRACKS, DETS> for Gnn {
    type Memory = Assignment<T, TRACKS, DETS>;
    const MEMORY: Self::Memory = Assignment::new();

    fn associate(&self, matrix: &mut AssociationMatrix<T, TRACKS, DETS>, memory: &mut Self::Memory) -> Completeness {
        if matrix.domain == Domain::Linear {
            to_logarithms(matrix);
        }
        let bonus = match matrix.clutter {
            ClutterPrior::Poisson => T::ZERO,
            ClutterPrior::Diffuse => best_bonus(matrix, memory),
        };
        let feasible = solve(matrix, memory, bonus);
        if !feasible {
            // Who cannot be served must miss, at a price that keeps all others served.
            for miss in &mut matrix.miss {
                if !is_possible(*miss) {
                    *miss = T::lit(LN_IMPOSSIBLE);
                }
            }
            let _ = solve(matrix, memory, bonus);
        }
        let (one, zero) = (T::ONE, T::ZERO);
        for (track, (miss, hit)) in matrix.miss.iter_mut().zip(&mut matrix.hit).enumerate() {
            let chosen = memory.column(track);
            *miss = if chosen.is_none() { one } else { zero };
            hit.iter_mut().enumerate().for_each(|(j, hit)| *hit = if chosen == Some(j) { one } else { zero });
        }
        matrix.domain = Domain::Linear;
        Completeness { infeasible: u16::from(!feasible), ..Completeness::default() }
    }
}

/// ln hit, −∞ beyond the matrix.
fn ln_hit<T: Real, const TRACKS: usize, const DETS: usize>(matrix: &AssociationMatrix<T, TRACKS, DETS>, track: usize, column: usize) -> T {
    matrix.hit.get(track).and_then(|row| row.get(column)).copied().unwrap_or(-T::ONE / T::ZERO)
}

/// ln miss, −∞ beyond the matrix.
fn ln_miss<T: Real, const TRACKS: usize, const DETS: usize>(matrix: &AssociationMatrix<T, TRACKS, DETS>, track: usize) -> T {
    matrix.miss.get(track).copied().unwrap_or(-T::ONE / T::ZERO)
}

/// The best assignment with `bonus` added to every ln hit; false where there is none.
fn solve<T: Real, const TRACKS: usize, const DETS: usize>(
    matrix: &AssociationMatrix<T, TRACKS, DETS>,
    memory: &mut Assignment<T, TRACKS, DETS>,
    bonus: T,
) -> bool {
    memory.solve(TRACKS, matrix.columns(), |t| ln_miss(matrix, t), |t, j| ln_hit(matrix, t, j) + bonus)
}

/// The bonus for every track served with which the best assignment is the best event under diffuse clutter.
fn best_bonus<T: Real, const TRACKS: usize, const DETS: usize>(
    matrix: &AssociationMatrix<T, TRACKS, DETS>,
    memory: &mut Assignment<T, TRACKS, DETS>,
) -> T {
    let possible = |j: &usize| (0..TRACKS).any(|t| is_possible(ln_hit(matrix, t, *j)));
    let gated = (0..matrix.columns()).filter(possible).count();
    let gain = |i| ln(T::from_count(gated) / T::from_count(gated - i));
    let (mut best, mut best_sum, mut served) = (T::ZERO, -T::ONE / T::ZERO, 0);
    for i in 0..gated.min(TRACKS) {
        if i < served {
            continue;
        }
        if !solve(matrix, memory, gain(i)) {
            break;
        }
        served = (0..TRACKS).filter(|t| memory.column(*t).is_some()).count();
        let weight = |t| memory.column(t).map_or_else(|| ln_miss(matrix, t), |j| ln_hit(matrix, t, j));
        let sum = (0..TRACKS).map(weight).chain((0..served).map(gain)).fold(T::ZERO, |sum, x| sum + x);
        if sum > best_sum {
            (best, best_sum) = (gain(i), sum);
        }
    }
    best
}
