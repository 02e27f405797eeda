//! One scan of a log: what was taken in, and the tracks afterwards.

use super::{Header, LogError, is_intact, seal};
use crate::bytes::{CHECKSUM, Digest, Reader, Writer};
use crate::error::ScanError;
use crate::plots::Plots;
use crate::scalar::Real;
use crate::scan::{Detection, Report, Scan, Selection};
use crate::symmetric::Symmetric;
use crate::time::{Duration, Instant};
use crate::track::{Status, Track};
use crate::tracker::Tracker;

const MARKER: u8 = 0x5c;
/// Bytes before the detections.
const HEAD: usize = 28;

/// Writes the log of one tracker with one sensor.
#[derive(Clone, Copy, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Recorder<const NX: usize, const MODES: usize, const NZ: usize, const TRACKS: usize, const DETS: usize> {
    scans: u32,
}

impl<const NX: usize, const MODES: usize, const NZ: usize, const TRACKS: usize, const DETS: usize> Recorder<NX, MODES, NZ, TRACKS, DETS> {
    /// Bytes of the largest record.
    pub const MOST: usize = {
        let detection = 1 + 4 * NZ + 2 * NZ * (NZ + 1) + 8;
        let most = HEAD + DETS * detection + TRACKS * Seen::<NX, MODES>::SIZE + CHECKSUM;
        assert!(NX < 256 && MODES < 256 && NZ < 256 && most < 65536, "shapes take a byte each, lengths two");
        most
    };

    /// At the first scan.
    #[must_use]
    pub const fn new() -> Self {
        Self { scans: 0 }
    }

    /// Writes the header to `out` and returns its length, [`Header::size`]. `kind` and `numbers` say how the desk makes the same
    /// tracker: those of a ready configuration are in [`ready`](crate::ready). A tracker whose numbers have changed writes another
    /// header before its next record.
    ///
    /// # Errors
    /// Where there is no room.
    pub fn header(&self, kind: [u8; 4], numbers: &[u32], out: &mut [u8]) -> Result<usize, LogError> {
        const { assert!(Self::MOST > 0) }
        Header::encode([NX as u8, MODES as u8, NZ as u8], [TRACKS as u16, DETS as u16], kind, numbers, out)
    }

    /// A scan is offered to the tracker and goes unrecorded: the desk finds a gap in the numbers.
    pub fn skip(&mut self) {
        self.scans = self.scans.wrapping_add(1);
    }

    /// Writes the record of `scan`, which has just been offered to `tracker` with this `outcome`, to `out` and returns its length.
    ///
    /// # Errors
    /// Where there is no room for [`MOST`](Self::MOST) bytes, or there are more than `TRACKS` tracks; nothing is then recorded.
    pub fn record<T: Real, K: Tracker<T, NX, MODES>>(
        &mut self,
        scan: &Scan<'_, T, NZ>,
        outcome: &Result<Report, ScanError>,
        tracker: &K,
        state: &K::State,
        out: &mut [u8],
    ) -> Result<usize, LogError> {
        let out = out.get_mut(..Self::MOST).ok_or(LogError::Length)?;
        let tracks = u16::try_from(tracker.tracks(state).count()).ok().filter(|count| usize::from(*count) <= TRACKS);
        let tracks = tracks.ok_or(LogError::Shape)?;
        let offered = if outcome.is_ok() { scan.detections } else { &[] };
        let taken = Selection::<DETS>::new(offered);
        let mut writer = Writer(out.get_mut(2..).ok_or(LogError::Length)?);
        writer.put(&[MARKER, outcome.is_err().into()]);
        writer.put(&self.scans.to_le_bytes());
        writer.put(&scan.time.as_micros().to_le_bytes());
        // With those that were dropped on the way to the tracker.
        let dropped = outcome.as_ref().map_or(0, |report| report.detections_dropped);
        for count in [taken.indices.len() as u16, tracks, dropped, 0] {
            writer.put(&count.to_le_bytes());
        }
        writer.put(&tracker.digest(state).to_le_bytes());
        for detection in taken.indices.iter().filter_map(|number| offered.get(usize::from(*number))) {
            write_detection(&mut writer, detection);
        }
        tracker.tracks(state).filter_map(Seen::new).for_each(|seen| seen.write(&mut writer));
        let length = Self::MOST - writer.0.len() + CHECKSUM;
        let record = out.get_mut(..length).ok_or(LogError::Length)?;
        Writer(record).put(&(length as u16).to_le_bytes());
        seal(record);
        self.skip();
        Ok(length)
    }
}

/// One record as it is read.
#[derive(Clone, Debug)]
pub struct Record<const NX: usize, const MODES: usize, const NZ: usize, const TRACKS: usize, const DETS: usize> {
    /// Number of the scan
    pub number: u32,
    /// When
    pub time: Instant,
    /// Whether the scan was refused: the state stayed as it was
    pub refused: bool,
    /// The detections taken in
    pub plots: Plots<f32, NZ, DETS>,
    /// The detections that were dropped before
    pub dropped: u16,
    /// Digest of the state afterwards
    pub digest: u32,
    /// The tracks afterwards
    pub tracks: heapless::Vec<Seen<NX, MODES>, TRACKS>,
}

impl<const NX: usize, const MODES: usize, const NZ: usize, const TRACKS: usize, const DETS: usize> Record<NX, MODES, NZ, TRACKS, DETS> {
    /// Reads the record that `bytes` begin with; what is behind it comes second.
    ///
    /// # Errors
    /// Where they begin with none.
    pub fn decode(bytes: &[u8]) -> Result<(Self, &[u8]), LogError> {
        let mut reader = Reader(bytes);
        let (length, marker) = reader.half().zip(reader.byte()).ok_or(LogError::Length)?;
        if marker != MARKER {
            return Err(LogError::Magic);
        }
        let (record, rest) = bytes.split_at_checked(length.into()).ok_or(LogError::Length)?;
        if !is_intact(record) {
            return Err(LogError::Checksum);
        }
        let mut reader = Reader(record.get(3..record.len().saturating_sub(CHECKSUM)).unwrap_or_default());
        let mut read = || {
            let refused = match reader.byte()? {
                0 => false,
                1 => true,
                _ => return None,
            };
            let (number, time) = (reader.word()?, Instant::from_micros(reader.wide()?));
            let (detections, tracks, dropped, _) = (reader.half()?, reader.half()?, reader.half()?, reader.half()?);
            let mut record =
                Self { number, time, refused, plots: Plots::new(), dropped, digest: reader.word()?, tracks: heapless::Vec::new() };
            (0..detections).try_for_each(|_| read_detection(&mut reader).map(|plot| record.plots.push(plot)))?;
            (0..tracks).try_for_each(|_| record.tracks.push(Seen::read(&mut reader)?).ok())?;
            let told = !refused || detections == 0;
            (told && reader.0.is_empty() && record.plots.dropped() == 0).then_some(record)
        };
        Ok((read().ok_or(LogError::Content)?, rest))
    }
}

/// A track as a log tells of it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Seen<const NX: usize, const MODES: usize> {
    /// Number of its identity
    pub id: u32,
    /// How far it is trusted
    pub status: Status,
    /// The probability that the target exists
    pub existence: f32,
    /// Mode probabilities
    pub prob: [f32; MODES],
    /// The combined mean
    pub mean: [f32; NX],
    /// Digest of all of the track
    pub digest: u32,
}

impl<const NX: usize, const MODES: usize> Seen<NX, MODES> {
    const SIZE: usize = 4 + 1 + 4 + 4 * MODES + 4 * NX + 4;

    /// What a log tells of `track`; `None` for a free slot. The numbers are those of single precision.
    #[must_use]
    pub fn new<T: Real>(track: &Track<T, NX, MODES>) -> Option<Self> {
        let (single, mut digest) = (|x: T| x.to_f64() as f32, Digest::default());
        track.fold_into(&mut digest);
        Some(Self {
            id: track.id()?.number(),
            status: track.status(),
            existence: single(track.existence()),
            prob: track.bank().prob.map(single),
            mean: track.bank().combined().mean.data.0[0].map(single),
            digest: digest.0,
        })
    }

    fn write(&self, writer: &mut Writer<'_>) {
        writer.put(&self.id.to_le_bytes());
        writer.put(&[self.status as u8]);
        [self.existence].iter().chain(&self.prob).chain(&self.mean).for_each(|x| writer.put(&x.to_le_bytes()));
        writer.put(&self.digest.to_le_bytes());
    }

    fn read(reader: &mut Reader<'_>) -> Option<Self> {
        let id = reader.word()?;
        let status = Status::from_byte(reader.byte()?)?;
        let (existence, mut prob, mut mean) = (reader.real()?, [0.0; MODES], [0.0; NX]);
        reader.reals(&mut prob)?;
        reader.reals(&mut mean)?;
        Some(Self { id, status, existence, prob, mean, digest: reader.word()? })
    }
}

fn write_detection<T: Real, const NZ: usize>(writer: &mut Writer<'_>, detection: &Detection<T, NZ>) {
    let Detection { z, noise, amplitude, offset } = detection;
    let late = *offset != Duration::ZERO;
    writer.put(&[u8::from(noise.is_some()) | u8::from(amplitude.is_some()) << 1 | u8::from(late) << 2]);
    z.iter().for_each(|z| writer.real(*z));
    if let Some(noise) = noise {
        writer.upper(noise);
    }
    if let Some(amplitude) = amplitude {
        writer.real(*amplitude);
    }
    if late {
        // A scan with a larger offset has been refused.
        writer.put(&(offset.as_micros() as i32).to_le_bytes());
    }
}

fn read_detection<const NZ: usize>(reader: &mut Reader<'_>) -> Option<Detection<f32, NZ>> {
    let (brings, mut z) = (reader.byte()?, [0.0; NZ]);
    reader.reals(&mut z)?;
    let mut detection = Detection::new(z);
    if brings & 1 != 0 {
        let mut noise = Symmetric::zeros();
        reader.upper(&mut noise)?;
        detection = detection.with_noise(noise);
    }
    if brings & 2 != 0 {
        detection = detection.with_amplitude(reader.real()?);
    }
    if brings & 4 != 0 {
        detection = detection.with_offset(Duration::from_micros(i32::from_le_bytes(reader.take()?).into()));
    }
    (brings < 8).then_some(detection)
}
