//! Fusion: updates of a picture.

use super::{COUNTER, Outcome, published};
use boresight::error::ConfigError;
use boresight::fusion::{Combiner, Frame, FusedPicture, FusionReport, FusionWork, Limits, Rule, Weight, take_work};
use boresight::gaussian::Gaussian;
use boresight::mode::ModeBank;
use boresight::model::motion::{ConstantVelocity, ProcessNoise};
use boresight::symmetric::Symmetric;
use boresight::time::{Duration, Instant};
use boresight::track::{Logic, TrackId};
use boresight::tracker::{ImmPdaf, State};
use host_tests::budget::bound;
use nalgebra::SVector;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::cell::Cell;
use twin::fusion::{APART, CROWD, Case, Fusion, Memory, Picture};

type Modes = [ConstantVelocity<f32, 2>; 2];

fn kinds(work: &FusionWork) -> [u64; 7] {
    let FusionWork { predictions, combinations, tests, fusions, slopes, pairs, looks } = *work;
    [predictions, combinations, tests, fusions, slopes, pairs, looks]
}

/// An update, held against the formula.
fn held(most: &FusionWork, update: impl FnOnce() -> FusionReport) -> (FusionReport, FusionWork) {
    take_work();
    let report = update();
    let seen = take_work();
    assert!(kinds(&seen).iter().zip(kinds(most)).all(|(seen, most)| *seen <= most), "{seen:?}\n    of at most {most:?}");
    (report, seen)
}

/// The most of every kind.
fn larger(a: [u64; 7], b: [u64; 7]) -> [u64; 7] {
    std::array::from_fn(|kind| a[kind].max(b[kind]))
}

/// Identities 1 to 16, as a tracker gives them.
fn identities(modes: Modes) -> Result<Vec<TrackId>, ConfigError> {
    let tracker = ImmPdaf::<f32, _, 4, 2, 16, 1>::new(modes, [[0.9, 0.1]; 2], [0.9, 0.1], Logic::unmanaged())?;
    let (mut state, g) = (State::new(), Gaussian::new(SVector::zeros(), Symmetric::from_diagonal([1.0; 4])));
    Ok((0..16).filter_map(|_| tracker.start(&mut state, g, Instant::ZERO)).collect())
}

/// A track within `spread` metres of the origin, better in a random axis.
fn track(spread: f32, rng: &mut impl Rng) -> ModeBank<f32, 4, 2> {
    let mut any = |scale: f32| rng.random_range(-scale..=scale);
    let mean = SVector::from([any(spread), any(1.0), any(spread), any(1.0)]);
    let good = any(1.0) < 0.0;
    let variances = if good { [1.0, 1.0, 30.0, 2.0] } else { [30.0, 2.0, 1.0, 1.0] };
    ModeBank::new([0.5; 2], Gaussian::new(mean, Symmetric::from_diagonal(variances)))
}

/// The largest share of the formula in every kind of operation, over random lists: whole and half empty, at different times, near
/// to each other and far.
fn shares<const SENSORS: usize, const TRACKS: usize>(rounds: usize) -> Result<[f64; 7], ConfigError> {
    let modes = [ConstantVelocity::new(ProcessNoise::Discrete(0.1))?, ConstantVelocity::new(ProcessNoise::Discrete(30.0))?];
    let limits = Limits { join: 20.0, part: 30.0, max_age: Duration::from_millis(3000) };
    let combiner = Combiner::new(modes, [[0.9, 0.1], [0.2, 0.8]], Rule::Intersection(Weight::Determinant), limits)?;
    let most = Combiner::<f32, Modes, 4, 2>::worst_case::<SENSORS, TRACKS>();
    let mut rng = ChaCha8Rng::seed_from_u64(17);
    let (ids, mut worst) = (identities(modes)?, [0; 7]);
    let mut picture = Box::new(FusedPicture::<f32, 4, 2, SENSORS, TRACKS>::new());
    for round in 0..rounds {
        // Now and then all begins anew: then every list is one of strangers.
        if round % 4 == 0 {
            *picture = FusedPicture::new();
        }
        let spread = [1.0, 1.0, 10.0, 200.0][round / 4 % 4];
        for sensor in (0..SENSORS).filter(|sensor| (round + sensor) % 5 != 4) {
            let time = Instant::from_millis(2000 * round as u64 + rng.random_range(0..1000));
            let first = rng.random_range(0..=16 - TRACKS);
            let density = if round % 3 == 0 { 0.6 } else { 1.0 };
            let list: Vec<_> = ids[first..first + TRACKS].iter().filter_map(|id| rng.random_bool(density).then_some(*id)).collect();
            let list: Vec<_> = list.into_iter().map(|id| (id, track(spread, &mut rng))).collect();
            let tracks = list.iter().map(|(id, bank)| (*id, bank));
            assert_eq!(combiner.receive(&mut picture, sensor, &Frame::COMMON, time, tracks), Ok(()));
        }
        let (_, seen) = held(&most, || combiner.update(&mut picture));
        worst = larger(worst, kinds(&seen));
    }
    Ok(std::array::from_fn(|kind| worst[kind] as f64 / kinds(&most)[kind] as f64))
}

#[test]
fn no_update_takes_more_work_than_the_formula() -> Outcome {
    let _alone = COUNTER.lock();
    for shares in [shares::<1, 3>(100)?, shares::<2, 4>(1500)?, shares::<3, 4>(1500)?, shares::<2, 16>(200)?, shares::<4, 6>(500)?] {
        println!("largest shares of the formula: {shares:.2?}");
        assert!(shares.iter().all(|share| *share <= 1.0 || share.is_nan()), "{shares:?}");
    }
    // The formula is not idle: two sensors reach two fifths of everything, and predictions and fusions in full.
    let shares = shares::<2, 4>(1500)?;
    assert!(shares.iter().all(|share| *share >= 0.4) && shares[0] == 1.0 && shares[3] == 1.0, "{shares:?}");
    Ok(())
}

#[test]
fn published_cycles_are_within_what_the_updates_amount_to() -> Outcome {
    let _alone = COUNTER.lock();
    let published = published()?;
    let amount = |case: Case| -> Result<u64, ConfigError> {
        let (mut sensors, mut picture) = ([Memory::new(), Memory::new()], Picture::new());
        let most = Cell::new(0);
        let passed = Fusion::new()?.pass(&mut sensors, &mut picture, case, Fusion::send, |fusion, picture| {
            let (report, seen) = held(&Fusion::MOST, || fusion.update(picture));
            println!("{seen:?}");
            most.set(most.get().max(bound::fusion_cycles(&seen)));
            report
        });
        assert!(passed);
        Ok(most.get())
    };
    for (name, amount) in [("fuse16_16", amount(APART)?), ("fuse16_16, crowd", amount(CROWD)?)] {
        let counted = published["fusion"]["calls"][name]["cycles"].as_integer().ok_or("no cycles")?;
        println!("{name}: {counted} of {amount} cycles");
        assert!(counted > 0 && counted.unsigned_abs() <= amount, "{name}: {counted} of {amount} cycles");
    }
    Ok(())
}
