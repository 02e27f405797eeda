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
//! Tracks that share no detection do not see each other, so every cluster has its own event, and a track alone the likeliest of
//! its weights. Diffuse clutter couples all tracks: they are one cluster.
//!
//! # Cost
//! With T rows and M columns, steps of loops over weights and pairs are at most
//!
//! ```text
//! always        8 T M + T² (M / 64 + 2)                   who gates what, and logarithms
//! assignments   (min(T, M) + 2) T (T + 5) / 2 M           row r looks at r + 1 rows and again at its own; one assignment, another
//!                                                         where no event is possible, and one more a track under diffuse clutter
//! ```
//!
//! Blackman and Popoli 1999, section 6.4; φ! / V^φ: Bar-Shalom, Willett and Tian 2011, section 6.2.

use super::assignment::Assignment;
use super::cluster::Cluster;
use super::matrix::{AssociationMatrix, Associator, ClutterPrior, Completeness, Domain};
use super::partition::Partition;
use super::scaling::{is_possible, to_logarithm};
use super::work::count;
use crate::scalar::{Real, ln};

/// What a miss that is impossible weighs where it has to be.
const LN_IMPOSSIBLE: f64 = -1e4;

/// Global nearest neighbour. Of the joint event of the greatest weight every probability is 1.
///
/// In a cluster without any possible event as few tracks as can be miss although they cannot, and [`Completeness::infeasible`]
/// counts it. What it takes at most is [`worst_case`](Self::worst_case).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Gnn;

impl Gnn {
    /// The most steps that associating `tracks` rows with `detections` columns can take, by the formula of this file.
    #[must_use]
    pub const fn worst_case(tracks: usize, detections: usize) -> u64 {
        let (t, m) = (tracks as u64, detections as u64);
        let served = if t < m { t } else { m };
        8 * t * m + t * t * (m / 64 + 2) + (served + 2) * (t * (t + 5) / 2) * m
    }
}

/// What [`Gnn`] works in.
#[derive(Clone, Debug)]
pub struct GnnMemory<T, const TRACKS: usize, const DETS: usize> {
    partition: Partition<T, TRACKS, DETS>,
    cluster: Cluster<T, TRACKS, DETS>,
    assignment: Assignment<T, TRACKS, DETS>,
}

impl<T: Real, const TRACKS: usize, const DETS: usize> Associator<T, TRACKS, DETS> for Gnn {
    type Memory = GnnMemory<T, TRACKS, DETS>;
    const MEMORY: Self::Memory = GnnMemory { partition: Partition::new(), cluster: Cluster::new(), assignment: Assignment::new() };

    // One copy for all sensors.
    #[inline(never)]
    fn associate(&self, matrix: &mut AssociationMatrix<T, TRACKS, DETS>, memory: &mut Self::Memory) -> Completeness {
        let mut completeness = Completeness::default();
        memory.partition.find(matrix, matrix.clutter == ClutterPrior::Diffuse);
        let none = if matrix.domain == Domain::Linear { T::ZERO } else { -T::ONE / T::ZERO };
        for row in 0..TRACKS {
            let feasible = match memory.partition.members(row) {
                None => continue,
                Some((1, _)) => take_likeliest(matrix, row, none),
                Some(_) => take_best_event(matrix, row, memory),
            };
            completeness.infeasible += u16::from(!feasible);
        }
        matrix.domain = Domain::Linear;
        completeness
    }
}

/// Gives a row alone its likeliest weight, above `none`; false, and a miss, where there is none.
fn take_likeliest<T: Real, const TRACKS: usize, const DETS: usize>(
    matrix: &mut AssociationMatrix<T, TRACKS, DETS>,
    row: usize,
    none: T,
) -> bool {
    let Some((miss, hit)) = matrix.row(row) else { return true };
    let (mut chosen, mut most) = (None, none);
    if miss > most {
        most = miss;
    }
    for (j, h) in hit.iter().enumerate() {
        if *h > most {
            (chosen, most) = (Some(j), *h);
        }
    }
    matrix.decide(row, chosen);
    most > none
}

/// Gives the rows of the cluster that begins with `row` the event of the greatest weight; false where it has misses that are
/// impossible.
fn take_best_event<T: Real, const TRACKS: usize, const DETS: usize>(
    matrix: &mut AssociationMatrix<T, TRACKS, DETS>,
    row: usize,
    memory: &mut GnnMemory<T, TRACKS, DETS>,
) -> bool {
    let GnnMemory { partition, cluster, assignment } = memory;
    partition.take(row, matrix, false, cluster);
    if matrix.domain == Domain::Linear {
        for (row, vacant) in cluster.tracks.iter().zip(&mut cluster.vacant) {
            count(cluster.columns.len());
            *vacant = to_logarithm(*vacant, true);
            for column in &cluster.columns {
                let hit = matrix.hit.get_mut(usize::from(*row)).and_then(|hit| hit.get_mut(usize::from(column.det)));
                if let Some(hit) = hit {
                    *hit = to_logarithm(*hit, true);
                }
            }
        }
    }
    let bonus = match matrix.clutter {
        ClutterPrior::Poisson => T::ZERO,
        ClutterPrior::Diffuse => best_bonus(cluster, &matrix.hit, assignment),
    };
    let feasible = solve(cluster, &matrix.hit, assignment, bonus);
    if !feasible {
        // Who cannot be served must miss, at a price that keeps all others served.
        for miss in &mut cluster.vacant {
            if !is_possible(*miss) {
                *miss = T::lit(LN_IMPOSSIBLE);
            }
        }
        let _ = solve(cluster, &matrix.hit, assignment, bonus);
    }
    for (k, row) in cluster.tracks.iter().enumerate() {
        let chosen = assignment.column(k).and_then(|c| cluster.columns.get(c));
        matrix.decide(usize::from(*row), chosen.map(|column| usize::from(column.det)));
    }
    feasible
}

/// The best assignment with `bonus` added to every ln hit; false where there is none.
fn solve<T: Real, const TRACKS: usize, const DETS: usize>(
    cluster: &Cluster<T, TRACKS, DETS>,
    hit: &[[T; DETS]; TRACKS],
    assignment: &mut Assignment<T, TRACKS, DETS>,
    bonus: T,
) -> bool {
    let pair = |k, c| {
        count(1);
        cluster.ln_weight(hit, k, c) + bonus
    };
    assignment.solve(cluster.tracks.len(), cluster.columns.len(), |k| cluster.ln_vacant(k), pair)
}

/// The bonus for every track served with which the best assignment is the best event under diffuse clutter.
fn best_bonus<T: Real, const TRACKS: usize, const DETS: usize>(
    cluster: &Cluster<T, TRACKS, DETS>,
    hit: &[[T; DETS]; TRACKS],
    assignment: &mut Assignment<T, TRACKS, DETS>,
) -> T {
    let (tracks, gated) = (cluster.tracks.len(), cluster.columns.len());
    let gain = |i| ln(T::from_count(gated) / T::from_count(gated - i));
    let (mut best, mut best_sum, mut served) = (T::ZERO, -T::ONE / T::ZERO, 0);
    for i in 0..gated.min(tracks) {
        if i < served {
            continue;
        }
        if !solve(cluster, hit, assignment, gain(i)) {
            break;
        }
        served = (0..tracks).filter(|k| assignment.column(*k).is_some()).count();
        let weight = |k| assignment.column(k).map_or_else(|| cluster.ln_vacant(k), |c| cluster.ln_weight(hit, k, c));
        let sum = (0..tracks).map(weight).chain((0..served).map(gain)).fold(T::ZERO, |sum, x| sum + x);
        if sum > best_sum {
            (best, best_sum) = (gain(i), sum);
        }
    }
    best
}
