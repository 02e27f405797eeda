//! The rows of joint association: what a scan weighs for every track, and what clutter of unknown density comes to.
//!
//! ```text
//! row        h_tj = P_D M_tj / λ_j,  m_t = 1 − P_D P_G      as evidence has them
//! diffuse    λ = m / V    m the detections that any track can have,  V the gate volumes of all tracks that the sensor may see
//! ```

use super::picture::{Look, Picture};
use crate::association::{AssociationMatrix, ClutterPrior, Domain};
use crate::evidence::{Evidence, LEAST_DENSITY};
use crate::scalar::{Real, is_finite, larger};
use crate::scan::{Detection, Selection};
use crate::sensor::{Clutter, Sensor};
use crate::track::Track;

/// Writes the row of every track from what `collect` finds for the track in a slot; it returns the volume of the gate. Weights
/// that are not finite are left out: they would spoil the rows of others. Returns 1 / λ of diffuse clutter, where there is any.
#[inline(always)]
pub(super) fn write<
    T: Real,
    S: Sensor<T, NX, NZ>,
    const NX: usize,
    const NZ: usize,
    const MODES: usize,
    const TRACKS: usize,
    const DETS: usize,
>(
    matrix: &mut AssociationMatrix<T, TRACKS, DETS>,
    picture: &mut Picture<T, NX, MODES, TRACKS, DETS>,
    evidence: &mut Evidence<T, DETS>,
    sensor: &S,
    detections: &[Detection<T, NZ>],
    selection: &Selection<DETS>,
    mut collect: impl FnMut(&mut Evidence<T, DETS>, usize, &Track<T, NX, MODES>, &Look<'_, S, T>) -> T,
) -> T {
    let Picture { tracks, claimed, .. } = picture;
    matrix.reset(selection.indices.len(), ClutterPrior::Poisson, Domain::Linear);
    let mut volume = T::ZERO;
    for (slot, track) in tracks.iter().enumerate().filter(|(_, t)| !t.is_free()) {
        let Some((miss, row)) = matrix.row_mut(slot) else { continue };
        // Clutter of unknown density counts as one until all tracks are known.
        let look = Look { sensor, existence: track.existence, diffuse: Clutter::Poisson(T::ONE) };
        let own_volume = collect(evidence, slot, track, &look);
        let (mut claims, mut entries) = (selection.walk(claimed), selection.walk(row));
        for (number, weight) in evidence.scored() {
            if let (Some(claimed), Some(entry)) = (claims(number), entries(number)) {
                *claimed = true;
                *entry = if *weight > T::ZERO && is_finite(*weight) { *weight } else { T::ZERO };
            }
        }
        let (p_miss, _) = evidence.weights();
        *miss = if p_miss >= T::ZERO && is_finite(p_miss) { p_miss } else { T::ONE };
        if own_volume > T::ZERO && look.p_detect(&track.bank.modes[0].mean) > T::ZERO {
            volume += own_volume;
        }
    }
    estimate_clutter(matrix, volume, |column| {
        let detection = selection.indices.get(column).and_then(|number| detections.get(usize::from(*number)));
        detection.is_some_and(|d| sensor.clutter(&d.z) == Clutter::Diffuse)
    })
}

/// Divides the weights of the columns that are `diffuse` by λ = m / V. Returns 1 / λ.
fn estimate_clutter<T: Real, const TRACKS: usize, const DETS: usize>(
    matrix: &mut AssociationMatrix<T, TRACKS, DETS>,
    volume: T,
    diffuse: impl Fn(usize) -> bool,
) -> T {
    let columns = matrix.columns();
    if !(0..columns).any(&diffuse) {
        return T::ONE;
    }
    let possible = |column: &usize| matrix.hit.iter().any(|row| row.get(*column).is_some_and(|h| *h > T::ZERO));
    let (mut count, mut known) = (0, 0);
    for column in (0..columns).filter(possible) {
        *(if diffuse(column) { &mut count } else { &mut known }) += 1;
    }
    if count == 0 {
        return T::ONE;
    }
    if known == 0 {
        matrix.clutter = ClutterPrior::Diffuse;
    }
    let scale = T::ONE / larger(T::from_count(count) / volume, T::lit(LEAST_DENSITY));
    for column in (0..columns).filter(|column| diffuse(*column)) {
        for entry in matrix.hit.iter_mut().filter_map(|row| row.get_mut(column)) {
            *entry *= scale;
        }
    }
    scale
}
