//! What a log begins with: which library, which tracker, which numbers.

use super::{LogError, is_intact, seal};
use crate::bytes::{CHECKSUM, Digest, Reader, Writer};

const MAGIC: [u8; 4] = *b"bslg";
const FORMAT: u8 = 1;
/// Bytes before the numbers.
const HEAD: usize = 24;

/// The version of this library: a log says which one has made it.
pub const VERSION: [u16; 3] =
    [number(env!("CARGO_PKG_VERSION_MAJOR")), number(env!("CARGO_PKG_VERSION_MINOR")), number(env!("CARGO_PKG_VERSION_PATCH"))];

const fn number(digits: &str) -> u16 {
    let (bytes, mut n, mut i) = (digits.as_bytes(), 0, 0);
    while i < bytes.len() {
        n = 10 * n + (bytes[i] - b'0') as u16;
        i += 1;
    }
    n
}

/// What a log begins with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Header<'a> {
    /// NX, MODES, NZ
    pub shape: [u8; 3],
    /// TRACKS, DETS
    pub capacity: [u16; 2],
    /// Version of the library that has written it
    pub version: [u16; 3],
    /// Which configuration the numbers are for
    pub kind: [u8; 4],
    /// Hash of kind, shape, capacity and numbers
    pub configuration: u32,
    numbers: &'a [u8],
}

impl<'a> Header<'a> {
    /// Bytes of a header with so many numbers.
    #[must_use]
    pub const fn size(numbers: usize) -> usize {
        numbers.saturating_mul(4).saturating_add(HEAD + 4 + CHECKSUM)
    }

    /// The numbers of the configuration; `None` where there are not `N` of them.
    #[must_use]
    pub fn numbers<const N: usize>(&self) -> Option<[u32; N]> {
        let mut reader = Reader(self.numbers);
        let numbers = core::array::from_fn(|_| reader.word());
        let all = self.numbers.len() == 4 * N && numbers.iter().all(Option::is_some);
        all.then(|| numbers.map(Option::unwrap_or_default))
    }

    /// Reads the header that `bytes` begin with; what is behind it comes second.
    ///
    /// # Errors
    /// Where they begin with none.
    pub fn decode(bytes: &'a [u8]) -> Result<(Self, &'a [u8]), LogError> {
        let mut reader = Reader(bytes);
        if reader.take().ok_or(LogError::Length)? != MAGIC {
            return Err(LogError::Magic);
        }
        if reader.byte().ok_or(LogError::Length)? != FORMAT {
            return Err(LogError::Format);
        }
        let mut read = || {
            let shape = reader.take()?;
            let mut three = || Some([reader.half()?, reader.half()?, reader.half()?]);
            let ([tracks, dets, major], [minor, patch, count]) = (three()?, three()?);
            let (kind, count) = (reader.take()?, usize::from(count));
            let (numbers, rest) = reader.0.split_at_checked(4 * count)?;
            let (hash, _) = rest.split_first_chunk()?;
            let (all, rest) = bytes.split_at_checked(Self::size(count))?;
            let configuration = u32::from_le_bytes(*hash);
            Some((Self { shape, capacity: [tracks, dets], version: [major, minor, patch], kind, configuration, numbers }, all, rest))
        };
        let (header, all, rest) = read().ok_or(LogError::Length)?;
        if !is_intact(all) {
            return Err(LogError::Checksum);
        }
        if header.hash() != header.configuration {
            return Err(LogError::Content);
        }
        Ok((header, rest))
    }

    pub(super) fn encode(shape: [u8; 3], capacity: [u16; 2], kind: [u8; 4], numbers: &[u32], out: &mut [u8]) -> Result<usize, LogError> {
        let count = u16::try_from(numbers.len()).map_err(|_| LogError::Length)?;
        let (size, end) = (Self::size(numbers.len()), HEAD + 4 * numbers.len());
        let out = out.get_mut(..size).ok_or(LogError::Length)?;
        let mut writer = Writer(out);
        writer.put(&MAGIC);
        writer.put(&[FORMAT]);
        writer.put(&shape);
        capacity.iter().chain(&VERSION).chain([&count]).for_each(|half| writer.put(&half.to_le_bytes()));
        writer.put(&kind);
        numbers.iter().for_each(|word| writer.put(&word.to_le_bytes()));
        let (_, numbers) = out.get(..end).and_then(|head| head.split_at_checked(HEAD)).ok_or(LogError::Length)?;
        let hash = Header { shape, capacity, version: VERSION, kind, configuration: 0, numbers }.hash();
        Writer(out.get_mut(end..).ok_or(LogError::Length)?).put(&hash.to_le_bytes());
        seal(out);
        Ok(size)
    }

    fn hash(&self) -> u32 {
        let mut digest = Digest::default();
        let [states, modes, components] = self.shape;
        digest.word(u32::from_le_bytes([states, modes, components, 0]));
        self.capacity.iter().for_each(|n| digest.word((*n).into()));
        digest.word(u32::from_le_bytes(self.kind));
        let mut reader = Reader(self.numbers);
        while let Some(word) = reader.word() {
            digest.word(word);
        }
        digest.0
    }
}
