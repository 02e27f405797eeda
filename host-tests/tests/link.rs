//! The link to a sensor: on a mocked bus, and with frames that are lost, repeated, cut and changed at random.

use boresight::link::{Counts, Link, LinkError, encode};
use boresight::scan::Detection;
use boresight::time::Instant;
use embedded_hal_mock::eh1::spi::{Mock, Transaction};
use proptest::prelude::*;
use std::collections::VecDeque;

const DETS: usize = 8;
type Wire<D> = Link<D, 2, DETS>;
const FRAME: usize = Wire::<Bus>::FRAME;

/// A bus that gives what it is told, then idles low; `Err` where it is told to fail.
#[derive(Default)]
struct Bus(VecDeque<Result<Vec<u8>, embedded_hal::spi::ErrorKind>>);

impl embedded_hal::spi::ErrorType for Bus {
    type Error = embedded_hal::spi::ErrorKind;
}

impl embedded_hal::spi::SpiDevice for Bus {
    fn transaction(&mut self, operations: &mut [embedded_hal::spi::Operation<'_, u8>]) -> Result<(), Self::Error> {
        for operation in operations {
            let embedded_hal::spi::Operation::Read(words) = operation else { panic!("the link only reads") };
            words.fill(0);
            if let Some(sent) = self.0.pop_front() {
                let sent = sent?;
                let length = sent.len().min(words.len());
                words[..length].copy_from_slice(&sent[..length]);
            }
        }
        Ok(())
    }
}

fn plots(count: usize) -> Vec<Detection<f32, 2>> {
    (0..count).map(|i| Detection::new([1000.0 + i as f32, 0.1 * i as f32])).collect()
}

fn frame(sequence: u32, micros: u32, detections: &[Detection<f32, 2>]) -> Vec<u8> {
    let mut bytes = vec![0; FRAME];
    let length = encode(sequence, micros, detections, &mut bytes).unwrap();
    bytes.truncate(length);
    bytes
}

/// The time of a scan and its number of detections.
type Outcome = Result<(u64, usize), LinkError<embedded_hal::spi::ErrorKind>>;

/// What the frames come to, one by one.
fn poll_all(frames: &[Vec<u8>]) -> (Vec<Outcome>, Counts) {
    let mut link = Wire::new(Bus(frames.iter().cloned().map(Ok).collect()));
    let mut buffer = [0; FRAME];
    let poll = |_| link.poll(&mut buffer).map(|scan| (scan.time.as_micros(), scan.detections.len()));
    let outcomes = frames.iter().map(poll).collect();
    (outcomes, link.counts())
}

#[test]
fn one_transfer_of_known_length_makes_a_scan() {
    let detections: Vec<_> = plots(5).into_iter().map(|d| d.with_amplitude(7.0)).collect();
    let mut sent = frame(9, 123_456, &detections);
    sent.resize(FRAME, 0xff);
    let expected = [Transaction::transaction_start(), Transaction::read_vec(sent), Transaction::transaction_end()];
    let mut bus = Mock::new(&expected);
    let mut link = Wire::new(bus.clone());
    let mut buffer = [0; FRAME];
    let scan = link.poll(&mut buffer).unwrap();
    assert_eq!((scan.time, scan.detections), (Instant::from_micros(123_456), detections.as_slice()));
    // Without room nothing is fetched.
    assert_eq!(link.poll(&mut buffer[1..]).err(), Some(LinkError::Room));
    bus.done();
}

#[test]
fn faults_are_refused_and_counted() {
    let good = |sequence: u32| frame(sequence, sequence.wrapping_mul(1000), &plots(3));
    let (mut flipped, mut cut, mut crowded) = (good(3), good(3), good(4));
    flipped[20] ^= 4;
    cut.truncate(25);
    crowded[12] = DETS as u8 + 1;
    let backward = frame(5, 1, &[]);
    let frames = [good(1), good(2), good(2), good(1), flipped, cut, good(3), crowded, backward, vec![], vec![0xff; FRAME], good(9)];
    let (outcomes, counts) = poll_all(&frames);
    use LinkError::{Backward, Corrupted, Empty, Repeated, Truncated};
    let scan = |sequence: u64| Ok((1000 * sequence, 3));
    let refused = [Err(Corrupted), Err(Backward), Err(Empty), Err(Empty)];
    let expected = [scan(1), scan(2), Err(Repeated), Err(Repeated), Err(Corrupted), Err(Truncated), scan(3)];
    assert_eq!(outcomes, [expected.as_slice(), &refused, &[scan(9)]].concat());
    assert_eq!(counts, Counts { frames: 4, lost: 5, repeated: 2, truncated: 1, corrupted: 2, backward: 1, failed: 0 });

    let mut failing = Wire::new(Bus([Err(embedded_hal::spi::ErrorKind::Overrun), Ok(good(1))].into()));
    assert_eq!(failing.poll(&mut [0; FRAME]).err(), Some(LinkError::Bus(embedded_hal::spi::ErrorKind::Overrun)));
    assert!(failing.poll(&mut [0; FRAME]).is_ok() && failing.counts().failed == 1);
}

#[test]
fn numbers_and_times_wrap_and_a_sensor_may_start_again() {
    let late = u32::MAX - 500;
    let frames = [frame(u32::MAX, late, &[]), frame(0, late.wrapping_add(2000), &[]), frame(1, late.wrapping_add(2_000_000_000), &[])];
    let (outcomes, counts) = poll_all(&frames);
    let start = u64::from(late);
    assert_eq!(outcomes, [Ok((start, 0)), Ok((start + 2000, 0)), Ok((start + 2_000_000_000, 0))]);
    assert_eq!((counts.frames, counts.lost), (3, 0));

    let mut link = Wire::new(Bus([Ok(frame(700, 5, &[])), Ok(frame(0, 9, &[])), Ok(frame(1, 19, &[]))].into()));
    let mut time = || link.poll(&mut [0; FRAME]).map(|scan| scan.time.as_micros());
    assert_eq!(time(), Ok(5));
    link.restart(Instant::from_micros(1_000_000));
    let mut time = || link.poll(&mut [0; FRAME]).map(|scan| scan.time.as_micros());
    assert_eq!((time(), time()), (Ok(1_000_000), Ok(1_000_010)));
}

/// What may happen to a frame on its way.
#[derive(Clone, Debug)]
enum Fate {
    Arrives,
    Lost,
    Twice,
    Cut(prop::sample::Index),
    Flipped(Vec<(prop::sample::Index, u8)>),
    Noise(Vec<u8>),
}

fn fate() -> impl Strategy<Value = Fate> {
    prop_oneof![
        3 => Just(Fate::Arrives),
        1 => Just(Fate::Lost),
        1 => Just(Fate::Twice),
        1 => any::<prop::sample::Index>().prop_map(Fate::Cut),
        // Up to three flipped bits a CRC-32 always finds in frames as short as these.
        1 => proptest::collection::vec((any::<prop::sample::Index>(), 0u8..8), 1..4).prop_map(Fate::Flipped),
        1 => proptest::collection::vec(any::<u8>(), 0..FRAME).prop_map(Fate::Noise),
    ]
}

proptest! {
    /// Whatever happens on the way, every scan that comes out is one that was sent, in order, and nothing is lost uncounted.
    #[test]
    fn only_what_was_sent_comes_out(fates in proptest::collection::vec((fate(), 0usize..=DETS), 1..60)) {
        let sent: Vec<Vec<u8>> = fates.iter().enumerate().map(|(k, (_, count))| frame(k as u32, 50_000 * k as u32, &plots(*count))).collect();
        let mut frames = Vec::new();
        for ((fate, _), frame) in fates.iter().zip(&sent) {
            let mut frame = frame.clone();
            match fate {
                Fate::Arrives => frames.push(frame),
                Fate::Lost => {}
                Fate::Twice => frames.extend([frame.clone(), frame]),
                Fate::Cut(at) => {
                    frame.truncate(at.index(frame.len()));
                    frames.push(frame);
                }
                Fate::Flipped(bits) => {
                    for (at, bit) in bits {
                        let at = at.index(frame.len());
                        frame[at] ^= 1 << bit;
                    }
                    frames.push(frame);
                }
                Fate::Noise(noise) => frames.push(noise.clone()),
            }
        }
        let (outcomes, counts) = poll_all(&frames);
        let scans: Vec<(u64, usize)> = outcomes.iter().filter_map(|outcome| outcome.ok()).collect();
        prop_assert!(scans.windows(2).all(|pair| pair[0].0 < pair[1].0));
        let known = |(time, count): &(u64, usize)| fates.get((time / 50_000) as usize).is_some_and(|(_, sent)| sent == count) && time % 50_000 == 0;
        prop_assert!(scans.iter().all(known));
        // Every frame that arrived whole has come out.
        let whole = fates.iter().filter(|(fate, _)| matches!(fate, Fate::Arrives | Fate::Twice)).count();
        prop_assert!(scans.len() >= whole);
        // From the first scan to the last all numbers are accounted for.
        if let (Some(first), Some(last)) = (scans.first(), scans.last()) {
            prop_assert_eq!(u64::from(counts.frames + counts.lost), (last.0 - first.0) / 50_000 + 1);
        }
        let empty = outcomes.iter().filter(|outcome| **outcome == Err(LinkError::Empty)).count();
        let refused = counts.repeated + counts.truncated + counts.corrupted + counts.backward;
        prop_assert_eq!(counts.frames as usize + refused as usize + empty, frames.len());
    }
}
