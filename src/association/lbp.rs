//! Loopy belief propagation: approximate marginals of any cluster, at a fixed cost.
//!
//! ```text
//! track to detection    μ_tj = h_tj / (vacant_t + Σ_{i ≠ j} h_ti ν_it)
//! detection to track    ν_jt = 1 / (q_j + Σ_{s ≠ t} μ_sj)            q_j the weight of the detection unused
//! marginals             β_tj = h_tj ν_jt / (vacant_t + Σ_i h_ti ν_it),   β_t0 = vacant_t / (same)
//! ```
//!
//! Williams and Lau, *IEEE Trans. AES* 50(4), 2014: the iteration always converges; the marginals are exact where the
//! graph of shared detections has no loop, and tend to be too sure of themselves where it has.

use super::cluster::Cluster;
use super::work::count;
use crate::scalar::{Real, larger};

/// Rounds at most.
const ROUNDS: usize = 40;
/// Done when no row sum changes by more than this share.
const SETTLED: f64 = 1e-4;
/// Messages μ are kept below the reciprocal of this.
const LEAST_REST: f64 = 1e-25;

/// Replaces the weights of `cluster` by approximate marginals. `message` is scratch.
///
/// Cost: at most 40 rounds of some ten operations and two divisions per weight.
pub(super) fn marginals<T: Real, const TRACKS: usize, const DETS: usize>(
    cluster: &mut Cluster<T, TRACKS, DETS>,
    hit: &mut [[T; DETS]; TRACKS],
    message: &mut [[T; DETS]; TRACKS],
) {
    for row in &cluster.tracks {
        if let Some(nu) = message.get_mut(usize::from(*row)) {
            nu.fill(T::ONE);
        }
    }
    cluster.sums = [T::ZERO; TRACKS];
    for _ in 0..ROUNDS {
        let change = tracks_to_detections(cluster, hit, message);
        detections_to_tracks(cluster, message);
        if change < T::lit(SETTLED) {
            break;
        }
    }
    let Cluster { tracks, columns, vacant, .. } = cluster;
    for (row, vacant) in tracks.iter().map(|row| usize::from(*row)).zip(vacant) {
        let (Some(hit), Some(nu)) = (hit.get_mut(row), message.get(row)) else { return };
        let mut sum = *vacant;
        for det in columns.iter().map(|c| usize::from(c.det)) {
            let Some((h, nu)) = hit.get_mut(det).zip(nu.get(det)) else { return };
            *h *= *nu;
            sum += *h;
        }
        // A row that every other track outbids is left without a choice: it counts as not detected.
        let (scale, lost) = if sum > T::ZERO { (T::ONE / sum, T::ZERO) } else { (T::ZERO, T::ONE) };
        *vacant = *vacant * scale + lost;
        for det in columns.iter().map(|c| usize::from(c.det)) {
            let Some(h) = hit.get_mut(det) else { return };
            *h *= scale;
        }
    }
}

/// From ν to μ, row by row. Returns the largest change of a row sum, as a share of it.
fn tracks_to_detections<T: Real, const TRACKS: usize, const DETS: usize>(
    cluster: &mut Cluster<T, TRACKS, DETS>,
    hit: &[[T; DETS]; TRACKS],
    message: &mut [[T; DETS]; TRACKS],
) -> T {
    let mut change = T::ZERO;
    let Cluster { tracks, columns, vacant, sums, .. } = cluster;
    let dets = || columns.iter().map(|c| usize::from(c.det));
    for ((row, vacant), last) in tracks.iter().map(|row| usize::from(*row)).zip(vacant).zip(sums) {
        let (Some(hit), Some(message)) = (hit.get(row), message.get_mut(row)) else { break };
        count(3 * columns.len());
        let terms = || dets().map_while(|det| hit.get(det).copied().zip(message.get(det).copied()));
        let (mut total, mut largest) = (*vacant, T::ZERO);
        for (h, nu) in terms() {
            total += h * nu;
            largest = larger(largest, h * nu);
        }
        // The one term beyond half of the sum, if there is one: its difference from the sum would cancel.
        let dominates = |term: T| term + term > total;
        let others = terms().map(|(h, nu)| h * nu).filter(|term| !dominates(*term)).fold(*vacant, |sum, term| sum + term);
        for det in dets() {
            let Some((h, m)) = hit.get(det).copied().zip(message.get_mut(det)) else { break };
            let rest = if dominates(h * *m) { others } else { total - h * *m };
            *m = if h > T::ZERO { h / larger(rest, h * T::lit(LEAST_REST)) } else { T::ZERO };
        }
        change = larger(change, (total - *last).abs() / total);
        *last = total;
    }
    change
}

/// From μ to ν, column by column.
fn detections_to_tracks<T: Real, const TRACKS: usize, const DETS: usize>(
    cluster: &Cluster<T, TRACKS, DETS>,
    message: &mut [[T; DETS]; TRACKS],
) {
    for column in &cluster.columns {
        let det = usize::from(column.det);
        count(3 * cluster.tracks.len());
        let rows = || cluster.tracks.iter().map(|row| usize::from(*row));
        let terms = || rows().map_while(|row| message.get(row)?.get(det).copied());
        let total = terms().fold(column.unused, |sum, mu| sum + mu);
        let dominates = |mu: T| mu + mu > total;
        let others = terms().filter(|mu| !dominates(*mu)).fold(column.unused, |sum, mu| sum + mu);
        for row in rows() {
            let Some(mu) = message.get_mut(row).and_then(|r| r.get_mut(det)) else { break };
            let rest = if dominates(*mu) { others } else { total - *mu };
            *mu = T::ONE / larger(rest, T::lit(LEAST_REST));
        }
    }
}
