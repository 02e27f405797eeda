//! Tracks in bytes.

use crate::bank;
use crate::support::draws;
use boresight::association::Gate;
use boresight::fusion::{MessageError, TrackMessage};
use boresight::gaussian::Gaussian;
use boresight::mode::ModeBank;
use boresight::model::position::Position;
use boresight::scalar::Real;
use boresight::scan::{Detection, Scan};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use boresight::time::Instant;
use boresight::track::Logic;
use boresight::tracker::{ImmPdaf, State};
use nalgebra::SVector;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

type Message<T> = TrackMessage<T, 6, 2>;
const SIZE: usize = Message::<f32>::SIZE;

/// The message of a track that a tracker has started at `g`.
fn message<T: Real>(g: Gaussian<T, 6>) -> Result<Message<T>, TestCaseError> {
    let fail = |e: boresight::error::ConfigError| TestCaseError::fail(e.to_string());
    let initial = [T::lit(0.75), T::lit(0.25)];
    let tracker =
        ImmPdaf::<T, _, 6, 2, 4, 4>::new(crate::modes().map_err(fail)?, crate::jump(), initial, Logic::unmanaged()).map_err(fail)?;
    let mut state = State::new();
    let time = Instant::from_micros(123_456_789_012);
    let _ = tracker.start(&mut state, g, time);
    state.tracks().next().and_then(|track| Message::new(513, time, track)).ok_or_else(|| TestCaseError::fail("no track"))
}

fn bytes<T: Real>(message: &Message<T>) -> Result<[u8; SIZE], TestCaseError> {
    let mut bytes = [0; SIZE];
    message.encode(&mut bytes).map_err(|e| TestCaseError::fail(e.to_string()))?;
    Ok(bytes)
}

proptest! {
    #[test]
    fn what_goes_over_the_link_comes_out_to_the_bit(draws in draws(), start in draws()) {
        let sent = Message { bank: bank::<f32>(&draws, 1e4, 5.0), ..message(crate::support::gaussian(&start, 1e4, 5.0))? };
        prop_assert_eq!(Message::decode(&bytes(&sent)?), Ok(sent));
    }

    #[test]
    fn double_precision_comes_out_rounded_to_single(draws in draws()) {
        let sent = Message { bank: bank::<f64>(&draws, 1e4, 5.0), ..message(Gaussian::new(SVector::zeros(), Symmetric::from_diagonal([1.0; 6])))? };
        let got = Message::<f64>::decode(&bytes(&sent)?).map_err(|e| TestCaseError::fail(e.to_string()))?;
        for (a, b) in sent.bank.modes.iter().zip(&got.bank.modes) {
            prop_assert!(a.mean.iter().zip(b.mean.iter()).all(|(a, b)| *b == f64::from(*a as f32)));
            prop_assert!((a.cov.to_matrix() - b.cov.to_matrix()).abs().max() <= 6e-8 * a.cov.to_matrix().abs().max());
        }
        prop_assert_eq!((sent.id, sent.time, sent.sensor, sent.status), (got.id, got.time, got.sensor, got.status));
    }

    /// A burst of at most 32 bits is found for certain, and so is every change of a byte or two.
    #[test]
    fn every_corrupted_byte_is_found(draws in draws(), at in 0..SIZE, other in 0..SIZE, flip in 1u8.., more: u8) {
        let mut bytes = bytes(&Message { bank: bank::<f32>(&draws, 1e4, 5.0), ..message(Gaussian::new(SVector::zeros(), Symmetric::from_diagonal([1.0; 6])))? })?;
        bytes[at] ^= flip;
        if other != at {
            bytes[other] ^= more;
        }
        prop_assert!(Message::<f32>::decode(&bytes).is_err());
    }

    #[test]
    fn no_bytes_at_all_make_a_track_by_chance(bytes in prop::collection::vec(any::<u8>(), 0..2 * SIZE)) {
        prop_assert!(Message::<f32>::decode(&bytes).is_err());
    }

    #[test]
    fn every_other_length_is_refused(draws in draws(), length in 0..2 * SIZE) {
        let sent = Message { bank: bank::<f32>(&draws, 1e4, 5.0), ..message(Gaussian::new(SVector::zeros(), Symmetric::from_diagonal([1.0; 6])))? };
        let mut bytes = bytes(&sent)?.to_vec();
        bytes.resize(length, 0);
        let decoded = Message::<f32>::decode(&bytes);
        prop_assert_eq!(decoded, if length == SIZE { Ok(sent) } else { Err(MessageError::Length) });
        let mut room = vec![0; length];
        prop_assert_eq!(sent.encode(&mut room).is_ok(), length >= SIZE);
    }
}

#[test]
fn numbers_that_are_no_track_are_refused_though_the_checksum_holds() -> Result<(), TestCaseError> {
    let good = message(Gaussian::new(SVector::zeros(), Symmetric::from_diagonal([1.0f32; 6])))?;
    let with = |change: &dyn Fn(&mut ModeBank<f32, 6, 2>)| {
        let mut bad = good;
        change(&mut bad.bank);
        bytes(&bad).map(|bytes| Message::<f32>::decode(&bytes))
    };
    assert!(with(&|_| {})?.is_ok());
    let refused = Err(MessageError::Content);
    assert_eq!(with(&|b| b.prob = [0.7, 0.7])?, refused);
    assert_eq!(with(&|b| b.prob = [1.5, -0.5])?, refused);
    assert_eq!(with(&|b| b.modes[1].mean[3] = f32::NAN)?, refused);
    assert_eq!(with(&|b| b.modes[0].cov = Symmetric::from_fn(|i, j| if i == j { 1.0 } else { -0.9 }))?, refused);
    assert_eq!(with(&|b| b.modes[0].cov = Symmetric::from_diagonal([1.0, 1.0, f32::INFINITY, 1.0, 1.0, 1.0]))?, refused);
    let bad = Message { existence: 1.5, ..good };
    assert_eq!(Message::<f32>::decode(&bytes(&bad)?), refused);
    Ok(())
}

/// A turn, a detection in ten missed and a coast of ten scans: no covariance that comes of it is refused.
#[test]
fn every_track_of_a_tracker_goes_over_the_link() -> Result<(), Box<dyn std::error::Error>> {
    let logic = Logic::new(3, 4, 20)?;
    let variances = [25.0, 400.0, 100.0, 25.0, 400.0, 100.0];
    let tracker = ImmPdaf::<f32, _, 6, 2, 4, 4>::new(crate::modes()?, crate::jump(), [0.9, 0.1], logic)?;
    let model = Position::<f32, 2, 3>::new(Symmetric::from_diagonal([1.0; 2]))?;
    let sensor = UniformSensor::new(model, 0.9, Clutter::Poisson(1e-6), Gate::new::<2>(16.0)?)?;
    let (mut state, mut rng) = (State::new(), ChaCha8Rng::seed_from_u64(5));
    let _ = tracker.start(&mut state, Gaussian::new(SVector::zeros(), Symmetric::from_diagonal(variances)), Instant::ZERO);
    let mut sent = 0;
    for k in 1..200u64 {
        let angle = 0.05 * k as f32;
        let noise = |rng: &mut ChaCha8Rng| rng.random_range(-1.5..1.5f32);
        let plot = [Detection::new([400.0 * angle.sin() + noise(&mut rng), 400.0 * (1.0 - angle.cos()) + noise(&mut rng)])];
        let seen = usize::from(rng.random_bool(0.9) && !(100..110).contains(&k));
        tracker.step(&mut state, &sensor, &Scan::new(Instant::from_millis(1000 * k), &plot[..seen]))?;
        for track in state.tracks() {
            let message = Message::new(1, Instant::from_millis(1000 * k), track).ok_or("no track")?;
            let mut bytes = [0; SIZE];
            message.encode(&mut bytes)?;
            assert_eq!(Message::decode(&bytes), Ok(message), "scan {k}");
            sent += 1;
        }
    }
    assert_eq!(sent, 199);
    Ok(())
}

#[test]
fn another_version_or_shape_is_told_from_noise() -> Result<(), TestCaseError> {
    let mut bytes = bytes(&message(Gaussian::new(SVector::zeros(), Symmetric::from_diagonal([1.0f32; 6])))?)?;
    assert_eq!(TrackMessage::<f32, 6, 3>::decode(&bytes), Err(MessageError::Shape));
    assert_eq!(TrackMessage::<f32, 4, 2>::decode(&bytes), Err(MessageError::Shape));
    bytes[0] = 2;
    assert_eq!(Message::<f32>::decode(&bytes), Err(MessageError::Version));
    Ok(())
}
