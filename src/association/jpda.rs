//! Joint probabilistic data association in bounded memory, exact whenever it fits and otherwise with a proven bound.
//!
//! ```text
//! β_tj = Σ weights of the joint events that give track t detection j / Σ weights of all joint events
//!
//! cluster     tracks that share detections; each cluster on its own               partition.rs, cluster.rs
//! dense       exact, if all sets of open tracks, or of open detections, fit into NODES;
//!             otherwise, or where Z is too small for the precision:                   small.rs, sweep.rs
//! balance     hit_tj e^{−u_t − v_j}, vacant_t e^{−u_t}, q_j = e^{−v_j} with the prices of the
//!             best event: no weight is above 1 and the best event is 1          scaling.rs, assignment.rs
//! bounded     the heaviest sets; every marginal is within D / (Z + D) of the exact one          beam.rs
//! approximate loopy belief propagation, if that bound exceeds the tolerance                     lbp.rs
//! ```
//!
//! Balancing multiplies all events by the same factor, as every event pays u_t for every track and v_j for every
//! detection, used or not. So weights of any range can be associated in single precision: what underflows is less than
//! the smallest number beside the best event. Diffuse clutter couples all tracks, as φ counts the detections of all: they are
//! one cluster, swept with the number of tracks served in every node.
//!
//! # Cost
//! With T rows, M columns, N = NODES and g = min(T, 26), steps of loops over weights, sets, keys and messages are at most
//!
//! ```text
//! always       8 T M + T² (M / 64 + 2)
//! order        2 M² (g + 7)                                      more than four tracks
//! exact        2 (3 T + 8) (N + 16)                              once plain, once balanced
//! balance      T M (min(T, M) + 5)
//! bounded      N (g + 1) (3 (log₂ N + 4) + 2 N + 2 g)            the N beside the logarithm: moves of nodes
//! approximate  40 · 6 T M
//! ```
//!
//! as [`Jpda::worst_case`] adds up. A cluster ends at the first rung that holds: most never leave "exact".
//!
//! # Flash
//! Only what most scans need is unrolled. The loops of everything else leave early where an entry is missing, which cannot happen:
//! a compiler unrolls no such loop, and where it unrolls the others they take twice the flash and no less time.

use super::assignment::Assignment;
use super::beam::{Beam, Kept, Nodes};
use super::cluster::{Cluster, MASKED};
use super::matrix::{AssociationMatrix, Associator, ClutterPrior, Completeness, Domain};
use super::partition::Partition;
use super::scaling::{balance, exponentiate, least};
use super::{lbp, sweep};
use crate::error::ConfigError;
use crate::scalar::{Real, is_finite, larger, sqrt};

/// JPDA with room for `NODES` sets of served tracks over all layers of a sweep, at least one per detection and one more.
///
/// Tracks that share detections form a cluster. Its probabilities are exact where all sets of tracks, or of detections, that
/// can be served fit into `NODES`: four tracks that share eight detections all around take 112 nodes (144 if
/// balanced), and a node takes the size of a scalar and 4 bytes. Otherwise the heaviest sets are kept: with Z the weight of the events kept and D an upper
/// bound of that of the others, every probability is within D / (Z + D) of the exact one, and that number, rounding included,
/// is [`Completeness::error_bound`]. Where it exceeds the tolerance the cluster gets loopy belief propagation, which has no
/// bound and counts as approximated.
///
/// A cluster of more than 32 tracks, or of more than 26 that are open at the same time, gets no bound: it is exact if its
/// shared detections are few, else approximated. Under diffuse clutter all tracks that gate anything are one cluster, and 32
/// or more of them are approximated. Logarithms of magnitude L cost an error of 4 T L ε with T tracks in the cluster; where
/// that is more than a few roots of ε it is reported as a bound.
///
/// Cost: at most [`worst_case`](Self::worst_case) steps, quadratic in `NODES`; typically T M for T tracks and M detections
/// and 1.5 T 2^T M multiply-adds for T that share them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Jpda<const NODES: usize> {
    tolerance: f32,
}

impl<const NODES: usize> Default for Jpda<NODES> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const NODES: usize> Jpda<NODES> {
    /// Takes bounded probabilities up to an error of 0.05, and the approximation beyond.
    #[must_use]
    pub const fn new() -> Self {
        Self { tolerance: 0.05 }
    }

    /// Takes bounded probabilities up to an error of `tolerance`: 0 takes exact ones only, 1 all that have a bound.
    ///
    /// # Errors
    /// Unless the tolerance lies within 0 to 1.
    pub fn with_tolerance(self, tolerance: f32) -> Result<Self, ConfigError> {
        if (0.0..=1.0).contains(&tolerance) { Ok(Self { tolerance }) } else { Err(ConfigError::NotAProbability) }
    }

    /// The most steps that associating `tracks` rows with `detections` columns can take, by the formula of this file.
    #[must_use]
    pub const fn worst_case(tracks: usize, detections: usize) -> u64 {
        let (t, m, n) = (tracks as u64, detections as u64, if NODES == 0 { 1 } else { NODES as u64 });
        let g = if t < 26 { t } else { 26 };
        let pairs = if t < m { t } else { m };
        let always = 8 * t * m + t * t * (m / 64 + 2);
        let order = 2 * m * m * (g + 7);
        let exact = 2 * (3 * t + 8) * (n + 16);
        let balance = t * m * (pairs + 5);
        let bounded = n * (g + 1) * (3 * (n.ilog2() as u64 + 4) + 2 * n + 2 * g);
        let approximate = 40 * 6 * t * m;
        always + order + exact + balance + bounded + approximate
    }
}

/// What [`Jpda`] works in.
#[derive(Clone, Debug)]
pub struct JpdaMemory<T, const TRACKS: usize, const DETS: usize, const NODES: usize> {
    partition: Partition<T, TRACKS, DETS>,
    cluster: Cluster<T, TRACKS, DETS>,
    turned: Cluster<T, TRACKS, DETS>,
    weight: [T; NODES],
    key: [u32; NODES],
    starts: [u32; DETS],
    scratch: [[T; DETS]; TRACKS],
    assignment: Assignment<T, TRACKS, DETS>,
}

impl<T: Real, const TRACKS: usize, const DETS: usize, const NODES: usize> JpdaMemory<T, TRACKS, DETS, NODES> {
    /// The cluster of every row, named by its first row, as associated last.
    pub(super) fn clusters(&self) -> &[u16; TRACKS] {
        &self.partition.label
    }
}

impl<T: Real, const TRACKS: usize, const DETS: usize, const NODES: usize> Associator<T, TRACKS, DETS> for Jpda<NODES> {
    type Memory = JpdaMemory<T, TRACKS, DETS, NODES>;

    const MEMORY: Self::Memory = {
        assert!(NODES > DETS, "a sweep needs a node for every detection and one more");
        JpdaMemory {
            partition: Partition::new(),
            cluster: Cluster::new(),
            turned: Cluster::new(),
            weight: [T::ZERO; NODES],
            key: [0; NODES],
            starts: [0; DETS],
            scratch: [[T::ZERO; DETS]; TRACKS],
            assignment: Assignment::new(),
        }
    };

    // One copy for all sensors.
    #[inline(never)]
    fn associate(&self, matrix: &mut AssociationMatrix<T, TRACKS, DETS>, memory: &mut Self::Memory) -> Completeness {
        let mut completeness = Completeness::default();
        let diffuse = matrix.clutter == ClutterPrior::Diffuse;
        memory.partition.find(matrix, diffuse);
        let linear = matrix.domain == Domain::Linear;
        let plain = linear && !diffuse;
        for row in 0..TRACKS {
            let outcome = match memory.partition.members(row) {
                None => continue,
                Some((1, _)) => {
                    memory.partition.normalise(row, matrix);
                    alone(matrix, row, !linear)
                }
                Some((members, rows)) => {
                    let few = if plain { memory.partition.few(members, rows, matrix, &mut memory.weight) } else { None };
                    if few == Some(true) { Outcome::Exact } else { self.joint(row, plain, few.is_some(), matrix, memory) }
                }
            };
            match outcome {
                Outcome::Exact => {}
                Outcome::Bounded(bound) => {
                    completeness.bounded += 1;
                    completeness.error_bound = larger(completeness.error_bound, bound);
                }
                Outcome::Approximate => completeness.approximated += 1,
                Outcome::Infeasible => completeness.infeasible += 1,
            }
        }
        matrix.domain = Domain::Linear;
        completeness
    }
}

/// What became of a cluster.
enum Outcome {
    Exact,
    Bounded(f32),
    Approximate,
    Infeasible,
}

impl<const NODES: usize> Jpda<NODES> {
    /// The marginals of the cluster of two tracks or more that begins with `row`. Whether its weights are `plain`, and have been
    /// `tried` as they are.
    #[inline(never)]
    fn joint<T: Real, const TRACKS: usize, const DETS: usize>(
        &self,
        row: usize,
        plain: bool,
        tried: bool,
        matrix: &mut AssociationMatrix<T, TRACKS, DETS>,
        memory: &mut JpdaMemory<T, TRACKS, DETS, NODES>,
    ) -> Outcome {
        memory.partition.take(row, matrix, plain, &mut memory.cluster);
        let exact = plain && !tried && exact(&mut matrix.hit, memory);
        let outcome = if exact { Outcome::Exact } else { self.balanced(matrix, memory) };
        memory.partition.hand_out(matrix, &memory.cluster);
        outcome
    }

    /// The same where the plain weights leave the range of the precision, or what is exact leaves the room.
    #[inline(never)]
    fn balanced<T: Real, const TRACKS: usize, const DETS: usize>(
        &self,
        matrix: &mut AssociationMatrix<T, TRACKS, DETS>,
        memory: &mut JpdaMemory<T, TRACKS, DETS, NODES>,
    ) -> Outcome {
        let diffuse = (matrix.clutter == ClutterPrior::Diffuse).then_some(memory.partition.gated);
        let logarithmic = matrix.domain == Domain::Logarithmic;
        let JpdaMemory { cluster, scratch, assignment, .. } = memory;
        let Some(perturbation) = balance(cluster, &mut matrix.hit, scratch, assignment, logarithmic) else {
            for row in cluster.tracks.iter().map(|row| usize::from(*row)) {
                matrix.decide(row, None);
            }
            (cluster.vacant, cluster.whole) = ([T::ONE; TRACKS], [T::ONE; TRACKS]);
            return Outcome::Infeasible;
        };
        let bound = |error: T| (error + perturbation).to_f64() as f32 * (1.0 + f32::EPSILON);
        // Logarithms too large for the precision make even the sum of all events an approximation.
        let all = if perturbation <= T::lit(16.0) * sqrt(T::EPSILON) { Outcome::Exact } else { Outcome::Bounded(bound(T::ZERO)) };
        if diffuse.is_none() && exact(&mut matrix.hit, memory) {
            return all;
        }
        let JpdaMemory { cluster, weight, key, starts, scratch, .. } = memory;
        if cluster.tracks.len() <= MASKED {
            cluster.order(&matrix.hit);
            let hit = &mut matrix.hit;
            let (nodes, tolerance) = (Nodes { weight, key }, T::lit(self.tolerance.into()));
            let mut beam = Beam { nodes, cluster, hit, after: scratch, starts, diffuse, tolerance };
            let sound = |kept: &Kept<T>| kept.z > least();
            let exact = |kept: &Kept<T>| sound(kept) && kept.given_up == T::ZERO;
            let bounded = |kept: &Kept<T>| sound(kept) && bound(kept.error_bound()) <= self.tolerance;
            match beam.marginals(|kept| exact(kept) || bounded(kept)) {
                Some(kept) if exact(&kept) => return all,
                Some(kept) if bounded(&kept) => return Outcome::Bounded(bound(kept.error_bound())),
                _ => {}
            }
        }
        lbp::marginals(cluster, &mut matrix.hit, scratch);
        Outcome::Approximate
    }
}

/// The marginals of all events, swept along the detections or along the tracks, whichever takes fewer nodes. `false`, and
/// nothing replaced, where neither fits or Z is too small for the precision.
fn exact<T: Real, const TRACKS: usize, const DETS: usize, const NODES: usize>(
    hit: &mut [[T; DETS]; TRACKS],
    memory: &mut JpdaMemory<T, TRACKS, DETS, NODES>,
) -> bool {
    let JpdaMemory { cluster, turned, weight, scratch, .. } = memory;
    let sound = |z: T| z > least() && is_finite(z);
    let (tracks, columns) = (cluster.tracks.len(), cluster.columns.len());
    let mut direct = usize::MAX;
    if tracks <= MASKED {
        cluster.order(hit);
        direct = sweep::size(cluster);
    }
    if columns < tracks && turned.turn(cluster, hit, scratch) {
        turned.order(scratch);
        let size = sweep::size(turned);
        if size < direct && size <= NODES {
            let swept = sound(sweep::marginals(turned, scratch, weight, least()));
            if swept {
                turned.turn_back(cluster, hit, scratch);
            }
            return swept;
        }
    }
    direct <= NODES && sound(sweep::marginals(cluster, hit, weight, least()))
}

/// A track that shares nothing.
fn alone<T: Real, const TRACKS: usize, const DETS: usize>(
    matrix: &mut AssociationMatrix<T, TRACKS, DETS>,
    row: usize,
    logarithmic: bool,
) -> Outcome {
    let Some((miss, hit)) = matrix.row_mut(row) else { return Outcome::Exact };
    if logarithmic {
        exponentiate(miss, hit);
    }
    if *miss == T::ZERO && hit.iter().all(|h| *h == T::ZERO) {
        matrix.decide(row, None);
        return Outcome::Infeasible;
    }
    Outcome::Exact
}
