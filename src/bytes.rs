//! Bytes of messages, logs and frames: little-endian, written and read in order, with a checksum and a digest.
//!
//! ```text
//! CRC-32   the remainder of the bits, lowest first, by the reversed polynomial 0xedb88320: that of Ethernet
//! digest   h ← rotate(h ⊕ w, 5) · 0x9e3779b1 for every word w: one word that differs always shows
//! ```

use crate::scalar::Real;
use crate::symmetric::Symmetric;

/// Bytes that a checksum takes.
pub(crate) const CHECKSUM: usize = 4;

/// The checksum of Ethernet, four bits at a time.
pub(crate) fn crc32(bytes: &[u8]) -> u32 {
    const fn remainder(nibble: u32) -> u32 {
        let (mut crc, mut bit) = (nibble, 0);
        while bit < 4 {
            crc = crc >> 1 ^ (0xedb8_8320 & (crc & 1).wrapping_neg());
            bit += 1;
        }
        crc
    }
    const REMAINDERS: [u32; 16] = {
        let (mut table, mut nibble) = ([0; 16], 0);
        while nibble < 16 {
            table[nibble] = remainder(nibble as u32);
            nibble += 1;
        }
        table
    };
    let step = |crc: u32| crc >> 4 ^ REMAINDERS[(crc & 15) as usize];
    !bytes.iter().fold(u32::MAX, |crc, byte| step(step(crc ^ u32::from(*byte))))
}

/// The bytes still to be written. What does not fit is not written: callers see to the room beforehand.
pub(crate) struct Writer<'a>(pub &'a mut [u8]);

impl Writer<'_> {
    pub fn put(&mut self, bytes: &[u8]) {
        if let Some((head, rest)) = core::mem::take(&mut self.0).split_at_mut_checked(bytes.len()) {
            head.copy_from_slice(bytes);
            self.0 = rest;
        }
    }

    pub fn real<T: Real>(&mut self, x: T) {
        self.put(&(x.to_f64() as f32).to_le_bytes());
    }

    pub fn upper<T: Real, const N: usize>(&mut self, cov: &Symmetric<T, N>) {
        for (i, row) in cov.upper().iter().enumerate() {
            row.iter().skip(i).for_each(|p| self.real(*p));
        }
    }
}

/// The bytes still to be read; `None` where they end early.
pub(crate) struct Reader<'a>(pub &'a [u8]);

impl Reader<'_> {
    pub fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*head)
    }

    pub fn byte(&mut self) -> Option<u8> {
        self.take().map(|[byte]| byte)
    }

    pub fn half(&mut self) -> Option<u16> {
        self.take().map(u16::from_le_bytes)
    }

    pub fn word(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    pub fn wide(&mut self) -> Option<u64> {
        self.take().map(u64::from_le_bytes)
    }

    pub fn real(&mut self) -> Option<f32> {
        self.take().map(f32::from_le_bytes)
    }

    pub fn reals(&mut self, into: &mut [f32]) -> Option<()> {
        into.iter_mut().try_for_each(|x| self.real().map(|read| *x = read))
    }

    pub fn upper<const N: usize>(&mut self, into: &mut Symmetric<f32, N>) -> Option<()> {
        into.upper_mut().iter_mut().enumerate().try_for_each(|(i, row)| self.reals(row.get_mut(i..)?))
    }
}

/// Many words folded into one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Digest(pub u32);

impl Digest {
    pub fn word(&mut self, word: u32) {
        self.0 = (self.0 ^ word).rotate_left(5).wrapping_mul(0x9e37_79b1);
    }

    pub fn wide(&mut self, wide: u64) {
        self.word(wide as u32);
        self.word((wide >> 32) as u32);
    }

    /// By its bits in single precision.
    pub fn real<T: Real>(&mut self, x: T) {
        self.word((x.to_f64() as f32).to_bits());
    }

    pub fn upper<T: Real, const N: usize>(&mut self, cov: &Symmetric<T, N>) {
        for (i, row) in cov.upper().iter().enumerate() {
            row.iter().skip(i).for_each(|p| self.real(*p));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_that_of_ethernet() {
        // The check value of the standard, and that of nothing.
        assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
        assert_eq!(crc32(b""), 0);
    }

    #[test]
    fn one_word_that_differs_shows() {
        let of = |words: [u32; 3]| {
            let mut digest = Digest::default();
            words.iter().for_each(|word| digest.word(*word));
            digest.0
        };
        let all = of([1, 2, 3]);
        for bit in 0..32 {
            assert!(of([1 ^ 1 << bit, 2, 3]) != all && of([1, 2 ^ 1 << bit, 3]) != all && of([1, 2, 3 ^ 1 << bit]) != all);
        }
    }
}
