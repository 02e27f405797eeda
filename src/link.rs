//! The driver of a sensor that sends its detections over SPI: frames in, scans out, whatever happens on the wire.
//!
//! ```text
//! frame     bytes, little-endian
//! 0         2      "BR"
//! 2         1 x 2  version, 1; NZ
//! 4         4      sequence number, one more for every scan
//! 8         4      time [µs], modulo 2³²
//! 12        2 x 2  number of detections; 1 where each has an amplitude, else 0
//! then      for every detection 4 NZ, and 4 for its amplitude
//! last      4      CRC-32 (IEEE 802.3) of all before
//! ```
//!
//! A transfer has always the length of the largest frame, so that it takes a time that is known; what follows a shorter frame does
//! not count. A scan is handed out only if its frame is whole, newer than the last and not earlier:
//!
//! ```text
//! empty       the bus idles, all 0x00 or 0xff: no frame is waiting
//! truncated   the bus idles where the checksum belongs
//! corrupted   another checksum, magic or shape, or more detections than there is room for
//! repeated    a sequence number that is not after the last one
//! backward    a time before that of the last frame
//! lost        numbers between the last one and this: counted, the frame is good
//! ```
//!
//! Times are unfolded to 64 bits from frame to frame; a silence of more than 35 minutes needs [`Link::restart`]. Numbers that are
//! no measurement (NaN) are for the tracker to refuse.

use crate::bytes::{CHECKSUM, Reader, Writer, crc32};
use crate::plots::Plots;
use crate::scan::{Detection, Scan};
use crate::time::Instant;
use core::fmt;
use embedded_hal::spi::SpiDevice;

const MAGIC: [u8; 2] = *b"BR";
const VERSION: u8 = 1;
/// Bytes before the detections.
const HEAD: usize = 16;

/// A sensor on the device `D` that measures `NZ` components, at most `DETS` detections a scan.
#[derive(Debug)]
pub struct Link<D, const NZ: usize, const DETS: usize> {
    device: D,
    plots: Plots<f32, NZ, DETS>,
    last: Option<Stamp>,
    time: Option<Instant>,
    counts: Counts,
}

/// What orders frames: sequence number and time.
#[derive(Clone, Copy, Debug)]
struct Stamp {
    sequence: u32,
    micros: u32,
}

/// What has come over the link so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counts {
    /// Scans handed out
    pub frames: u32,
    /// Frames that never came, by the gaps between sequence numbers
    pub lost: u32,
    /// Frames refused because they, or later ones, had come before
    pub repeated: u32,
    /// Frames refused because they end early
    pub truncated: u32,
    /// Frames refused because they are not as they were sent
    pub corrupted: u32,
    /// Frames refused because their time is before that of the last
    pub backward: u32,
    /// Transfers that the bus has failed
    pub failed: u32,
}

/// Why there is no scan.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum LinkError<E> {
    /// The bus has failed.
    Bus(E),
    /// The buffer is shorter than the largest frame.
    Room,
    /// No frame is waiting.
    Empty,
    /// The frame ends early.
    Truncated,
    /// The frame is not as it was sent.
    Corrupted,
    /// The frame, or a later one, has come before.
    Repeated,
    /// The time of the frame is before that of the last.
    Backward,
}

impl<D: SpiDevice, const NZ: usize, const DETS: usize> Link<D, NZ, DETS> {
    /// Bytes of the largest frame, and of every transfer.
    pub const FRAME: usize = {
        assert!(NZ >= 1 && NZ < 256 && DETS < 65536, "NZ takes one byte, the number of detections two");
        HEAD + DETS * (4 * NZ + 4) + CHECKSUM
    };

    /// A link on `device`, before its first frame. Times are those of the sensor until [`restart`](Self::restart).
    #[must_use]
    pub const fn new(device: D) -> Self {
        let counts = Counts { frames: 0, lost: 0, repeated: 0, truncated: 0, corrupted: 0, backward: 0, failed: 0 };
        Self { device, plots: Plots::new(), last: None, time: None, counts }
    }

    /// The sensor has started again, or was silent for long: the next frame is taken whatever its number, and was made at `at`.
    pub fn restart(&mut self, at: Instant) {
        (self.last, self.time) = (None, Some(at));
    }

    /// What has come so far.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Fetches a frame into `buffer` and returns its scan. Costs one transfer of [`FRAME`](Self::FRAME) bytes, two steps a byte
    /// for the checksum, and a copy.
    ///
    /// # Errors
    /// Where there is no scan; why is counted.
    pub fn poll(&mut self, buffer: &mut [u8]) -> Result<Scan<'_, f32, NZ>, LinkError<D::Error>> {
        let frame = buffer.get_mut(..Self::FRAME).ok_or(LinkError::Room)?;
        let taken = match self.device.read(frame) {
            Ok(()) => self.take(frame),
            Err(error) => Err(LinkError::Bus(error)),
        };
        let Counts { frames, repeated, truncated, corrupted, backward, failed, .. } = &mut self.counts;
        let counter = match &taken {
            Ok(()) => frames,
            Err(LinkError::Bus(_)) => failed,
            Err(LinkError::Truncated) => truncated,
            Err(LinkError::Corrupted) => corrupted,
            Err(LinkError::Repeated) => repeated,
            Err(LinkError::Backward) => backward,
            Err(LinkError::Room | LinkError::Empty) => &mut 0,
        };
        *counter = counter.saturating_add(1);
        taken.map(|()| self.plots.scan(self.time.unwrap_or_default()))
    }

    fn take(&mut self, bytes: &[u8]) -> Result<(), LinkError<D::Error>> {
        if idles(bytes) {
            return Err(LinkError::Empty);
        }
        let frame = Frame::<NZ>::whole(bytes, DETS)?;
        let now = frame.stamp;
        let (lost, passed) = match self.last {
            None => (0, 0),
            Some(last) => {
                let ahead = now.sequence.wrapping_sub(last.sequence) as i32;
                let lost = u32::try_from(ahead).ok().and_then(|ahead| ahead.checked_sub(1)).ok_or(LinkError::Repeated)?;
                (lost, u64::try_from(now.micros.wrapping_sub(last.micros) as i32).map_err(|_| LinkError::Backward)?)
            }
        };
        let before = self.time.map_or(u64::from(now.micros), Instant::as_micros);
        (self.last, self.time) = (Some(now), Some(Instant::from_micros(before.saturating_add(passed))));
        self.counts.lost = self.counts.lost.saturating_add(lost);
        self.plots.clear();
        frame.detections().for_each(|detection| self.plots.push(detection));
        Ok(())
    }
}

/// A frame whose checksum holds.
struct Frame<'a, const NZ: usize> {
    stamp: Stamp,
    amplitudes: bool,
    body: &'a [u8],
}

impl<'a, const NZ: usize> Frame<'a, NZ> {
    fn whole<E>(bytes: &'a [u8], most: usize) -> Result<Self, LinkError<E>> {
        let mut reader = Reader(bytes);
        let mut head = || {
            let [b, r, version, components] = reader.take()?;
            let stamp = Stamp { sequence: reader.word()?, micros: reader.word()? };
            let (count, amplitudes) = (usize::from(reader.half()?), reader.half()?);
            ([b, r] == MAGIC && version == VERSION && usize::from(components) == NZ && count <= most && amplitudes <= 1).then_some((
                stamp,
                count,
                amplitudes == 1,
            ))
        };
        let (stamp, count, amplitudes) = head().ok_or(LinkError::Corrupted)?;
        let length = count * (4 * NZ + 4 * usize::from(amplitudes));
        let (body, rest) = reader.0.split_at_checked(length).ok_or(LinkError::Corrupted)?;
        let (checksum, _) = rest.split_first_chunk::<CHECKSUM>().ok_or(LinkError::Corrupted)?;
        let all = bytes.get(..HEAD + length).ok_or(LinkError::Corrupted)?;
        match crc32(all).to_le_bytes() == *checksum {
            true => Ok(Self { stamp, amplitudes, body }),
            false if idles(checksum) => Err(LinkError::Truncated),
            false => Err(LinkError::Corrupted),
        }
    }

    fn detections(&self) -> impl Iterator<Item = Detection<f32, NZ>> {
        let (mut reader, amplitudes) = (Reader(self.body), self.amplitudes);
        core::iter::from_fn(move || {
            let mut z = [0.0; NZ];
            reader.reals(&mut z)?;
            let detection = Detection::new(z);
            Some(if amplitudes { detection.with_amplitude(reader.real()?) } else { detection })
        })
    }
}

/// Whether nobody drives the bus: all low, or all high.
fn idles(bytes: &[u8]) -> bool {
    [0x00, 0xff].iter().any(|level| bytes.iter().all(|byte| byte == level))
}

/// Writes the frame of a scan to `out`: the sensor's side of the link. Returns its length; amplitudes are sent where all detections
/// have one. `None` where there is no room, or there are more than 65,535 detections.
pub fn encode<const NZ: usize>(sequence: u32, micros: u32, detections: &[Detection<f32, NZ>], out: &mut [u8]) -> Option<usize> {
    const { assert!(NZ >= 1 && NZ < 256, "NZ takes one byte") }
    let amplitudes = !detections.is_empty() && detections.iter().all(|detection| detection.amplitude.is_some());
    let count = u16::try_from(detections.len()).ok()?;
    let length = HEAD + detections.len() * (4 * NZ + 4 * usize::from(amplitudes));
    let (body, checksum) = out.get_mut(..length + CHECKSUM)?.split_at_mut_checked(length)?;
    let mut writer = Writer(body);
    writer.put(&MAGIC);
    writer.put(&[VERSION, NZ as u8]);
    writer.put(&sequence.to_le_bytes());
    writer.put(&micros.to_le_bytes());
    writer.put(&count.to_le_bytes());
    writer.put(&u16::from(amplitudes).to_le_bytes());
    for detection in detections {
        detection.z.iter().for_each(|z| writer.real(*z));
        if let (true, Some(amplitude)) = (amplitudes, detection.amplitude) {
            writer.real(amplitude);
        }
    }
    checksum.copy_from_slice(&crc32(body).to_le_bytes());
    Some(length + CHECKSUM)
}

impl<E: fmt::Debug> fmt::Display for LinkError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            LinkError::Bus(error) => return write!(f, "the bus has failed: {error:?}"),
            LinkError::Room => "the buffer is shorter than a frame",
            LinkError::Empty => "no frame is waiting",
            LinkError::Truncated => "the frame ends early",
            LinkError::Corrupted => "the frame is not as it was sent",
            LinkError::Repeated => "the frame, or a later one, has come before",
            LinkError::Backward => "the time of the frame is before that of the last",
        })
    }
}

impl<E: fmt::Debug> core::error::Error for LinkError<E> {}
