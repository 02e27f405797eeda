//! One record a scan for whoever watches a tracker at work: its tracks, its report, what it cost.
//!
//! ```text
//! offset  bytes    little-endian
//! 0       8        time [µs]
//! 8       4        cost, in the caller's unit
//! 12      15 x 2   the report: its counts in order ..
//! 42      2 x 4    .. its error bound, and the truncated mass
//! 50      2        number of tracks
//! then    29 each  identity 4, status 1, position and velocity 4 each: x, y, z, vx, vy, vz
//! last    4        CRC-32 of all before
//! ```
//!
//! [`Telemetry::SIZE`] bytes at most, for any link: 56 and 29 a track, 520 for 16 of them. With the feature `defmt` the record can be
//! logged as it is. Unlike a [`log`](crate::log) it holds what an engineer wants to see, not what a desk needs to do the same
//! again. [`Telemetry::decode`] reads it back; `host-tests telemetry FILE` prints a stream of them.

use crate::bytes::{CHECKSUM, Reader, Writer, crc32};
use crate::log::LogError;
use crate::model::Layout;
use crate::scalar::Real;
use crate::scan::{Estimate, Report};
use crate::time::Instant;
use crate::track::{Status, TrackId};
use core::num::NonZeroU32;

/// Bytes before the tracks, and of a track.
const HEAD: usize = 52;
const TRACK: usize = 29;

// As the text above says.
const _: () = assert!(Telemetry::<0>::SIZE == 56 && Telemetry::<16>::SIZE == 520);

/// What is told of one scan.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Telemetry<const TRACKS: usize> {
    /// When
    pub time: Instant,
    /// What the scan cost: cycles, or any other unit that the caller counts
    pub cost: u32,
    /// What the tracker did, and gave up
    pub report: Report,
    /// The tracks afterwards
    pub tracks: heapless::Vec<Brief, TRACKS>,
}

/// A track in brief.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Brief {
    /// Which one
    pub id: TrackId,
    /// How far it is trusted
    pub status: Status,
    /// x, y, z \[m\]; 0 in axes that the tracker does not have
    pub position: [f32; 3],
    /// The velocity \[m/s\]
    pub velocity: [f32; 3],
}

impl Brief {
    /// Position and velocity where `layout` has them.
    #[must_use]
    pub fn new<T: Real, const NX: usize>(estimate: &Estimate<T, NX>, layout: Layout) -> Self {
        let state = |axis: usize, part: usize| {
            let number = estimate.state.mean.get(axis * layout.stride + part).filter(|_| axis < layout.axes);
            number.map_or(0.0, |x| x.to_f64() as f32)
        };
        let all = |part| [state(0, part), state(1, part), state(2, part)];
        Self { id: estimate.id, status: estimate.status, position: all(0), velocity: all(1) }
    }

    fn read(reader: &mut Reader<'_>) -> Option<Self> {
        let (id, status) = (TrackId(NonZeroU32::new(reader.word()?)?), Status::from_byte(reader.byte()?)?);
        let (mut position, mut velocity) = ([0.0; 3], [0.0; 3]);
        reader.reals(&mut position)?;
        reader.reals(&mut velocity)?;
        Some(Self { id, status, position, velocity })
    }
}

impl<const TRACKS: usize> Telemetry<TRACKS> {
    /// Bytes of the largest record.
    pub const SIZE: usize = {
        assert!(TRACKS < 65536, "their number takes two bytes");
        HEAD + TRACKS * TRACK + CHECKSUM
    };

    /// The record of the scan at `time`, with the first `TRACKS` of `estimates`.
    pub fn new<T: Real, const NX: usize>(
        time: Instant,
        cost: u32,
        report: Report,
        layout: Layout,
        estimates: impl Iterator<Item = Estimate<T, NX>>,
    ) -> Self {
        Self { time, cost, report, tracks: estimates.take(TRACKS).map(|estimate| Brief::new(&estimate, layout)).collect() }
    }

    /// Writes the record to `out` and returns its length; `None` where there is no room for [`SIZE`](Self::SIZE) bytes.
    pub fn encode(&self, out: &mut [u8]) -> Option<usize> {
        let length = HEAD + self.tracks.len() * TRACK;
        let (body, checksum) = out.get_mut(..Self::SIZE)?.get_mut(..length + CHECKSUM)?.split_at_mut_checked(length)?;
        let (mut writer, r) = (Writer(body), &self.report);
        writer.put(&self.time.as_micros().to_le_bytes());
        writer.put(&self.cost.to_le_bytes());
        let taken = [r.detections, r.detections_dropped, r.detections_unclaimed, r.seeds_dropped];
        let tracks = [r.births, r.births_refused, r.tracks_evicted, r.tracks_confirmed, r.tracks_deleted, r.duplicates_deleted];
        let association = [r.numeric_resets, r.clusters_bounded, r.clusters_approximated, r.clusters_infeasible, r.pairs_refused];
        taken.iter().chain(&tracks).chain(&association).for_each(|count| writer.put(&count.to_le_bytes()));
        writer.real(r.association_error_bound);
        writer.real(r.truncated_mass);
        writer.put(&(self.tracks.len() as u16).to_le_bytes());
        for Brief { id, status, position, velocity } in &self.tracks {
            writer.put(&id.number().to_le_bytes());
            writer.put(&[*status as u8]);
            position.iter().chain(velocity).for_each(|x| writer.real(*x));
        }
        checksum.copy_from_slice(&crc32(body).to_le_bytes());
        Some(length + CHECKSUM)
    }

    /// Reads the record that `bytes` begin with; what is behind it comes second.
    ///
    /// # Errors
    /// Where they begin with none, or with one of more than `TRACKS` tracks.
    pub fn decode(bytes: &[u8]) -> Result<(Self, &[u8]), LogError> {
        let mut count = Reader(bytes.get(HEAD - 2..).ok_or(LogError::Length)?);
        let count = usize::from(count.half().ok_or(LogError::Length)?);
        let (body, rest) = bytes.split_at_checked(HEAD + count * TRACK).ok_or(LogError::Length)?;
        let (checksum, rest) = rest.split_first_chunk::<CHECKSUM>().ok_or(LogError::Length)?;
        if crc32(body).to_le_bytes() != *checksum {
            return Err(LogError::Checksum);
        }
        if count > TRACKS {
            return Err(LogError::Shape);
        }
        let mut reader = Reader(body);
        let mut read = || {
            let (time, cost) = (Instant::from_micros(reader.wide()?), reader.word()?);
            let report = Report {
                detections: reader.half()?,
                detections_dropped: reader.half()?,
                detections_unclaimed: reader.half()?,
                seeds_dropped: reader.half()?,
                births: reader.half()?,
                births_refused: reader.half()?,
                tracks_evicted: reader.half()?,
                tracks_confirmed: reader.half()?,
                tracks_deleted: reader.half()?,
                duplicates_deleted: reader.half()?,
                numeric_resets: reader.half()?,
                clusters_bounded: reader.half()?,
                clusters_approximated: reader.half()?,
                clusters_infeasible: reader.half()?,
                pairs_refused: reader.half()?,
                association_error_bound: reader.real()?,
                truncated_mass: reader.real()?,
            };
            let (count, mut tracks) = (reader.half()?, heapless::Vec::new());
            (0..count).try_for_each(|_| tracks.push(Brief::read(&mut reader)?).ok())?;
            Some(Self { time, cost, report, tracks })
        };
        Ok((read().ok_or(LogError::Content)?, rest))
    }
}

/// What has generic parts is checked here: a derived format holds only where those of its parts do.
#[cfg(feature = "defmt")]
const _: () = {
    use crate::{coupled, fusion, gaussian, glmb, initiation, log, mode, model, scan, sensor, symmetric, tracker};
    const fn formats<F: defmt::Format>() {}
    formats::<Telemetry<1>>();
    formats::<coupled::Candidate<f32>>();
    formats::<coupled::NoCross>();
    formats::<coupled::Odds<f32>>();
    formats::<fusion::FusedTrack<f32, 4, 2, 2>>();
    formats::<fusion::TrackMessage<f32, 4, 2>>();
    formats::<gaussian::Gaussian<f32, 4>>();
    formats::<glmb::Gibbs<9>>();
    formats::<glmb::Ranked<9, 9>>();
    formats::<glmb::Region<f32, 4, 2>>();
    formats::<initiation::Initiation<f32, 4>>();
    formats::<log::Recorder<4, 2, 2, 8, 8>>();
    formats::<log::Seen<4, 2>>();
    formats::<mode::Adaptation<f32, 7>>();
    formats::<mode::LikelyModes<f32, 7>>();
    formats::<model::resolution::Resolution<f32, 2>>();
    formats::<model::Fix<f32>>();
    formats::<scan::Detection<f32, 2>>();
    formats::<scan::Estimate<f32, 4>>();
    formats::<scan::Scan<'_, f32, 2>>();
    formats::<sensor::UniformSensor<model::radar::Radar<f32, 2, 2, 2>, f32>>();
    formats::<sensor::Unresolving<sensor::UniformSensor<model::radar::Radar<f32, 2, 2, 2>, f32>, f32, 2>>();
    formats::<symmetric::Symmetric<f32, 4>>();
    formats::<tracker::LabelledEstimate<f32, 4, 2>>();
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gaussian::Gaussian;
    use nalgebra::SVector;
    use proptest::prelude::*;

    /// Most bytes behind a record, exclusive.
    const BEHIND: usize = 20;

    #[test]
    fn a_record_has_the_layout_and_the_length_that_are_stated() {
        let id = TrackId(NonZeroU32::MIN);
        let state = Gaussian { mean: SVector::from([1.0f32, 2.0, 3.0, 4.0, 5.0, 6.0]), ..Gaussian::ZERO };
        let estimate = Estimate { id, status: Status::Coasting, existence: 1.0, state };
        let report = Report { detections: 7, clusters_infeasible: 9, ..Report::default() };
        let record = Telemetry::<3>::new(Instant::from_micros(5), 1000, report, Layout { axes: 2, stride: 3 }, [estimate; 5].into_iter());
        assert_eq!(record.tracks[0], Brief { id, status: Status::Coasting, position: [1.0, 4.0, 0.0], velocity: [2.0, 5.0, 0.0] });
        let mut out = [0; Telemetry::<3>::SIZE];
        // Of five tracks three have room: the record is the largest.
        assert_eq!((record.encode(&mut out), record.encode(&mut [0; 10])), (Some(52 + 3 * 29 + 4), None));
        assert_eq!((out[0], out[8..12] == 1000u32.to_le_bytes(), out[12], out[38], out[50]), (5, true, 7, 9, 3));
        assert_eq!((out[52], out[56], out[57..61] == 1f32.to_le_bytes(), out[73..77] == 5f32.to_le_bytes()), (1, 2, true, true));
        assert_eq!(Telemetry::<3>::decode(&out), Ok((record, [].as_slice())));
        assert_eq!(Telemetry::<2>::decode(&out).err(), Some(LogError::Shape));
    }

    fn report() -> impl Strategy<Value = Report> {
        (proptest::array::uniform15(any::<u16>()), 0f32..1.0, 0f32..1.0).prop_map(|(n, association_error_bound, truncated_mass)| Report {
            detections: n[0],
            detections_dropped: n[1],
            detections_unclaimed: n[2],
            seeds_dropped: n[3],
            births: n[4],
            births_refused: n[5],
            tracks_evicted: n[6],
            tracks_confirmed: n[7],
            tracks_deleted: n[8],
            duplicates_deleted: n[9],
            numeric_resets: n[10],
            clusters_bounded: n[11],
            clusters_approximated: n[12],
            clusters_infeasible: n[13],
            pairs_refused: n[14],
            association_error_bound,
            truncated_mass,
        })
    }

    fn brief() -> impl Strategy<Value = Brief> {
        (1..=u32::MAX, 0u8..3, proptest::array::uniform3(-1e6f32..1e6), proptest::array::uniform3(-1e3f32..1e3)).prop_map(
            |(id, status, position, velocity)| Brief {
                id: TrackId(NonZeroU32::new(id).unwrap()),
                status: Status::from_byte(status).unwrap(),
                position,
                velocity,
            },
        )
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_and_what_is_changed_is_refused(
            (micros, cost, report, tracks) in (any::<u64>(), any::<u32>(), report(), proptest::collection::vec(brief(), 0..=5)),
            (at, bit, behind) in (any::<prop::sample::Index>(), 0u8..8, proptest::collection::vec(any::<u8>(), 0..BEHIND)),
        ) {
            let record = Telemetry::<5> { time: Instant::from_micros(micros), cost, report, tracks: tracks.into_iter().collect() };
            let mut bytes = [0; Telemetry::<5>::SIZE + BEHIND];
            let length = record.encode(&mut bytes).unwrap();
            let bytes = &mut bytes[..length + behind.len()];
            bytes[length..].copy_from_slice(&behind);
            prop_assert_eq!(Telemetry::<5>::decode(bytes), Ok((record, behind.as_slice())));
            bytes[at.index(length)] ^= 1 << bit;
            prop_assert!(Telemetry::<5>::decode(bytes).is_err());
        }

        #[test]
        fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
            prop_assert!(Telemetry::<5>::decode(&bytes).is_err());
        }
    }
}
