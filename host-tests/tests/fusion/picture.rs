//! Fused tracks: their life and their identities.
//!
//! Targets move at a constant velocity; every sensor tells of them with noise of one metre, in its own frame, under identities
//! of its own.

use crate::{Modes, jump, modes};
use boresight::error::ConfigError;
use boresight::fusion::{Combiner, Frame, FusedPicture, FusionReport, Limits, ListError, Rule, Weight};
use boresight::gaussian::Gaussian;
use boresight::mode::ModeBank;
use boresight::scalar::Real;
use boresight::symmetric::Symmetric;
use boresight::time::{Duration, Instant};
use boresight::track::{Logic, TrackId};
use boresight::tracker::{ImmPdaf, State};
use nalgebra::SVector;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::collections::BTreeMap;
use std::error::Error;

/// (x, vx, y, vy)
type Kinematics = [f64; 4];
type Bank<T> = ModeBank<T, 6, 2>;

/// Identities 1 to 64, as a tracker gives them.
fn identities() -> Result<Vec<TrackId>, ConfigError> {
    let tracker = ImmPdaf::<f64, _, 6, 2, 64, 1>::new(modes()?, jump(), [0.9, 0.1], Logic::unmanaged())?;
    let mut state = Box::new(State::new());
    let g = Gaussian::new(SVector::zeros(), Symmetric::from_diagonal([1.0; 6]));
    Ok((0..64).filter_map(|_| tracker.start(&mut state, g, Instant::ZERO)).collect())
}

/// Some sensors and the picture that is made of their tracks.
struct Net<T: Real, const SENSORS: usize, const TRACKS: usize> {
    combiner: Combiner<T, Modes<T>, 6, 2>,
    picture: Box<FusedPicture<T, 6, 2, SENSORS, TRACKS>>,
    ids: Vec<TrackId>,
    rng: ChaCha8Rng,
}

/// Where sensor number `sensor` stands, and how it is turned.
fn place(sensor: usize) -> ([f64; 3], f64) {
    ([700.0 * sensor as f64, -300.0 * sensor as f64, 0.0], 0.6 * sensor as f64)
}

impl<T: Real, const SENSORS: usize, const TRACKS: usize> Net<T, SENSORS, TRACKS> {
    fn new(rule: Rule<T>) -> Result<Self, ConfigError> {
        let limits = Limits { join: T::lit(16.0), part: T::lit(30.0), max_age: Duration::from_millis(5000) };
        let combiner = Combiner::new(modes()?, jump(), rule, limits)?;
        Ok(Self { combiner, picture: Box::default(), ids: identities()?, rng: ChaCha8Rng::seed_from_u64(7) })
    }

    fn intersecting() -> Result<Self, ConfigError> {
        Self::new(Rule::Intersection(Weight::Determinant))
    }

    /// What a sensor's filter would have of a target, in the frame of that sensor.
    fn bank(&mut self, sensor: usize, [x, vx, y, vy]: Kinematics) -> Bank<T> {
        let (origin, heading) = place(sensor);
        let (sin, cos) = heading.sin_cos();
        let turned = |x: f64, y: f64| [cos * x + sin * y, -sin * x + cos * y];
        let ([x, y], [vx, vy]) = (turned(x - origin[0], y - origin[1]), turned(vx, vy));
        let mut noisy = |value: f64, deviation: f64| {
            let normal: f64 = StandardNormal.sample(&mut self.rng);
            T::lit(value + deviation * normal)
        };
        let mean = SVector::from([noisy(x, 1.0), noisy(vx, 0.5), T::ZERO, noisy(y, 1.0), noisy(vy, 0.5), T::ZERO]);
        let manoeuvring = Gaussian::new(mean, Symmetric::from_diagonal([1.0, 0.25, 4.0, 1.0, 0.25, 4.0].map(T::lit)));
        let straight = Gaussian::new(mean, Symmetric::from_diagonal([1.0, 0.25, 0.0, 1.0, 0.25, 0.0].map(T::lit)));
        ModeBank { prob: [T::lit(0.9), T::lit(0.1)], modes: [straight, manoeuvring] }
    }

    /// A sensor tells of targets, each with the number of its track there.
    fn tell(&mut self, sensor: usize, millis: u64, targets: &[(usize, Kinematics)]) -> Result<(), Box<dyn Error>> {
        let list: Vec<_> = targets.iter().map(|(number, at)| (self.ids[*number], self.bank(sensor, *at))).collect();
        let (origin, heading) = place(sensor);
        let frame = Frame::new(origin.map(T::lit), T::lit(heading))?;
        let tracks = list.iter().map(|(id, bank)| (*id, bank));
        Ok(self.combiner.receive(&mut self.picture, sensor, &frame, Instant::from_millis(millis), tracks)?)
    }

    fn update(&mut self) -> FusionReport {
        self.combiner.update(&mut self.picture)
    }

    /// The identity of the fused track nearest to a place, and how far it is.
    fn nearest(&self, [x, _, y, _]: Kinematics) -> Option<(u32, f64)> {
        let away = |g: &Gaussian<T, 6>| (g.mean[0].to_f64() - x).hypot(g.mean[3].to_f64() - y);
        let all = self.picture.tracks().filter_map(|fused| Some((fused.id()?.number(), away(&fused.state))));
        all.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Identity of the fused track, and what it is made of: sensors and numbers of their tracks.
    fn made_of(&self) -> BTreeMap<u32, Vec<(usize, u32)>> {
        let members = |f: &boresight::fusion::FusedTrack<T, 6, 2, SENSORS>| f.members().map(|(s, id)| (s, id.number())).collect();
        self.picture.tracks().filter_map(|f| Some((f.id()?.number(), members(f)))).collect()
    }
}

const NORTH: Kinematics = [0.0, 0.0, 900.0, 10.0];
const SOUTH: Kinematics = [200.0, 5.0, -900.0, -10.0];

fn moved([x, vx, y, vy]: Kinematics, seconds: f64) -> Kinematics {
    [x + vx * seconds, vx, y + vy * seconds, vy]
}

fn joined_by_all_sensors<T: Real>(rule: Rule<T>) -> Result<(), Box<dyn Error>> {
    let mut net = Net::<T, 3, 4>::new(rule)?;
    for k in 0..10u64 {
        let at = |target| moved(target, k as f64);
        net.tell(0, 1000 * k, &[(0, at(NORTH)), (1, at(SOUTH))])?;
        net.tell(1, 1000 * k, &[(0, at(SOUTH)), (1, at(NORTH))])?;
        net.tell(2, 1000 * k, &[(5, at(NORTH)), (3, at(SOUTH))])?;
        let report = net.update();
        assert_eq!((report.tracks, report.parted, report.is_complete()), (2, 0, true));
        let all = [(1, vec![(0, 1), (1, 2), (2, 6)]), (2, vec![(0, 2), (1, 1), (2, 4)])];
        assert_eq!(net.made_of(), BTreeMap::from(all));
        // Each axis within five deviations of one sensor.
        assert!([NORTH, SOUTH].iter().all(|target| net.nearest(at(*target)).is_some_and(|(_, away)| away < 7.0)));
    }
    Ok(())
}

#[test]
fn tracks_of_one_target_are_one_in_both_precisions_and_by_every_rule() -> Result<(), Box<dyn Error>> {
    joined_by_all_sensors::<f32>(Rule::NaiveConvex)?;
    joined_by_all_sensors::<f32>(Rule::Intersection(Weight::Determinant))?;
    joined_by_all_sensors::<f32>(Rule::Intersection(Weight::Trace))?;
    joined_by_all_sensors::<f64>(Rule::Intersection(Weight::Fixed(0.5)))
}

#[test]
fn a_fused_track_survives_the_loss_of_a_sensor_and_its_return() -> Result<(), Box<dyn Error>> {
    let mut net = Net::<f32, 2, 4>::intersecting()?;
    for k in 0..30u64 {
        let at = moved(NORTH, k as f64);
        // The first sensor loses its track for a while and finds the target again under another identity, the second likewise.
        let first = [(if k < 5 { 0 } else { 1 }, at)];
        let second = [(if k < 15 { 0 } else { 1 }, at)];
        net.tell(0, 1000 * k, &first[..usize::from(!(5..10).contains(&k))])?;
        net.tell(1, 1000 * k, &second[..usize::from(!(15..20).contains(&k))])?;
        let report = net.update();
        assert_eq!((report.tracks, report.ended, report.created), (1, 0, u16::from(k == 0)));
        assert_eq!(net.nearest(at).map(|(id, _)| id), Some(1));
    }
    Ok(())
}

#[test]
fn a_sensor_that_falls_silent_is_forgotten_and_the_rest_lives_on() -> Result<(), Box<dyn Error>> {
    let mut net = Net::<f32, 2, 4>::intersecting()?;
    let mut expired = 0;
    for k in 0..20u64 {
        let at = moved(NORTH, k as f64);
        net.tell(0, 1000 * k, &[(0, at)])?;
        if k < 3 {
            net.tell(1, 1000 * k, &[(0, at), (1, moved(SOUTH, k as f64))])?;
        }
        let report = net.update();
        expired += report.lists_expired;
        // Sent at 2 s, and counted for five seconds.
        assert_eq!(report.tracks, if k <= 7 { 2 } else { 1 }, "{k}");
        assert!(net.nearest(at).is_some_and(|(id, away)| id == 1 && away < 7.0));
    }
    assert_eq!(expired, 1);
    Ok(())
}

#[test]
fn tracks_that_part_are_two_and_the_first_keeps_the_identity() -> Result<(), Box<dyn Error>> {
    let mut net = Net::<f32, 2, 4>::intersecting()?;
    let mut counts = Vec::new();
    for k in 0..20u64 {
        // Side by side, then each its own way by 4 m/s more every second.
        let away = 2.0 * (k as f64 - 10.0).max(0.0).powi(2);
        let (left, right) = ([-away, 0.0, 0.0, 0.0], [away, 0.0, 0.0, 0.0]);
        net.tell(0, 1000 * k, &[(0, left)])?;
        net.tell(1, 1000 * k, &[(0, right)])?;
        counts.push(net.update());
        let first = net.made_of().get(&1).cloned().unwrap_or_default();
        assert_eq!(first.first(), Some(&(0, 1)));
    }
    assert_eq!(counts.iter().map(|r| r.parted).sum::<u16>(), 1);
    assert!(counts[..=10].iter().all(|r| r.tracks == 1) && counts[15..].iter().all(|r| r.tracks == 2));
    assert_eq!(net.made_of(), BTreeMap::from([(1, vec![(0, 1)]), (2, vec![(1, 1)])]));
    Ok(())
}

impl<const SENSORS: usize, const TRACKS: usize> Net<f64, SENSORS, TRACKS> {
    /// A sensor tells of exact tracks, each with its number and its x, all variances of position one: between two of them d² is half
    /// the square of the difference.
    fn tell_exactly(&mut self, sensor: usize, millis: u64, tracks: &[(usize, f64)]) -> Result<(), ListError> {
        let variances = Symmetric::from_diagonal([1.0, 0.25, 4.0, 1.0, 0.25, 4.0]);
        let bank = |x: f64| ModeBank::new([0.9, 0.1], Gaussian::new(SVector::from([x, 0.0, 0.0, 0.0, 0.0, 0.0]), variances));
        let list: Vec<_> = tracks.iter().map(|(number, x)| (self.ids[*number], bank(*x))).collect();
        let list = list.iter().map(|(id, bank)| (*id, bank));
        self.combiner.receive(&mut self.picture, sensor, &Frame::COMMON, Instant::from_millis(millis), list)
    }
}

#[test]
fn between_the_limits_nothing_changes() -> Result<(), Box<dyn Error>> {
    let mut net = Net::<f64, 2, 4>::intersecting()?;
    let mut counts = Vec::new();
    for (k, square) in [20.0f64, 15.0, 20.0, 29.0, 31.0, 29.0, 17.0, 15.0].into_iter().enumerate() {
        net.tell_exactly(0, 1000 * k as u64, &[(0, 0.0)])?;
        net.tell_exactly(1, 1000 * k as u64, &[(0, (2.0 * square).sqrt())])?;
        counts.push(net.update().tracks);
    }
    assert_eq!(counts, [2, 1, 1, 1, 2, 2, 2, 1]);
    Ok(())
}

#[test]
fn of_fused_tracks_that_join_the_older_identity_stays() -> Result<(), Box<dyn Error>> {
    // The older one is the first sensor's, then the second's.
    for older in [0, 1] {
        let mut net = Net::<f64, 2, 4>::intersecting()?;
        net.tell_exactly(older, 0, &[(3, 0.0)])?;
        net.update();
        net.tell_exactly(1 - older, 1000, &[(7, 100.0)])?;
        assert_eq!(net.update().tracks, 2);
        net.tell_exactly(older, 2000, &[(3, 0.0)])?;
        net.tell_exactly(1 - older, 2000, &[(7, 1.0)])?;
        net.update();
        let ids = if older == 0 { [(0, 4), (1, 8)] } else { [(0, 8), (1, 4)] };
        assert_eq!(net.made_of(), BTreeMap::from([(1, ids.to_vec())]));
    }
    Ok(())
}

#[test]
fn a_pair_stays_together_though_another_track_comes_nearer() -> Result<(), Box<dyn Error>> {
    let mut net = Net::<f64, 2, 4>::intersecting()?;
    for k in 0..4 {
        net.tell_exactly(0, 1000 * k, &[(0, 0.0)])?;
        net.tell_exactly(1, 1000 * k, &[(0, 4.0), (1, if k == 0 { 100.0 } else { 1.0 })])?;
        net.update();
        assert_eq!(net.made_of(), BTreeMap::from([(1, vec![(0, 1), (1, 1)]), (2, vec![(1, 2)])]));
    }
    Ok(())
}

#[test]
fn the_order_of_a_list_means_nothing() -> Result<(), Box<dyn Error>> {
    let mut net = Net::<f32, 2, 4>::intersecting()?;
    let mut before = None;
    for k in 0..12u64 {
        let at = |target| moved(target, k as f64);
        let (mut first, mut second) = (vec![(0, at(NORTH)), (1, at(SOUTH))], vec![(7, at(SOUTH)), (2, at(NORTH))]);
        if k % 2 == 1 {
            first.reverse();
        }
        if k % 3 == 1 {
            second.reverse();
        }
        net.tell(0, 1000 * k, &first)?;
        net.tell(1, 1000 * k, &second)?;
        net.update();
        let made_of = net.made_of();
        assert!(before.is_none_or(|before| before == made_of), "{made_of:?}");
        before = Some(made_of);
    }
    Ok(())
}

#[test]
fn targets_that_cross_keep_their_identities() -> Result<(), Box<dyn Error>> {
    let mut net = Net::<f32, 2, 4>::intersecting()?;
    for k in 0..=20u64 {
        let t = k as f64 - 10.0;
        let (east, west) = ([20.0 * t, 20.0, 0.0, 0.0], [-20.0 * t, -20.0, 2.0, 0.0]);
        net.tell(0, 1000 * k, &[(0, east), (1, west)])?;
        net.tell(1, 1000 * k, &[(4, west), (3, east)])?;
        let report = net.update();
        assert_eq!((report.tracks, report.parted), (2, 0));
        assert_eq!(net.made_of(), BTreeMap::from([(1, vec![(0, 1), (1, 4)]), (2, vec![(0, 2), (1, 5)])]));
    }
    Ok(())
}

#[test]
fn lists_of_different_times_meet_at_the_later() -> Result<(), Box<dyn Error>> {
    let fast = [0.0, 150.0, 0.0, -80.0];
    let mut net = Net::<f32, 2, 4>::intersecting()?;
    for k in 0..40u64 {
        // Every 700 ms and every 400 ms, the second one's reaching the combiner 200 ms late.
        if k % 7 == 0 {
            net.tell(0, 100 * k, &[(0, moved(fast, 0.1 * k as f64))])?;
        }
        if k >= 2 && k % 4 == 2 {
            net.tell(1, 100 * (k - 2), &[(0, moved(fast, 0.1 * (k - 2) as f64))])?;
        }
        let report = net.update();
        assert_eq!(report.tracks, 1, "{k}: {report:?}");
        let now = net.picture.time().map_or(0.0, |time| 1e-6 * time.as_micros() as f64);
        // Six deviations of a position that a velocity of half a metre a second was predicted by for up to a second.
        assert!(net.nearest(moved(fast, now)).is_some_and(|(id, away)| id == 1 && away < 9.0), "{k}");
    }
    Ok(())
}

/// The other list is drawn into the past by nothing, and what it says is not counted again.
#[test]
fn an_update_without_news_changes_nothing() -> Result<(), Box<dyn Error>> {
    let mut net = Net::<f32, 2, 4>::intersecting()?;
    net.tell(0, 1000, &[(0, NORTH)])?;
    net.tell(1, 1500, &[(0, moved(NORTH, 0.5))])?;
    net.update();
    let before: Vec<_> = net.picture.tracks().map(|f| (f.state, f.prob)).collect();
    for _ in 0..5 {
        net.update();
        assert_eq!(net.picture.tracks().map(|f| (f.state, f.prob)).collect::<Vec<_>>(), before);
    }
    Ok(())
}

#[test]
fn what_has_no_room_is_counted_and_the_rest_is_kept() -> Result<(), Box<dyn Error>> {
    let apart = |i: usize| [500.0 * i as f64, 0.0, 0.0, 0.0];
    let many = |from: usize, count: usize| (from..from + count).map(|i| (i, apart(i))).collect::<Vec<_>>();
    let mut net = Net::<f32, 2, 4>::intersecting()?;
    net.tell(0, 0, &many(0, 6))?;
    net.tell(1, 0, &many(2, 4))?;
    let report = net.update();
    // 0 to 3 of the first; 2 and 3 of the second join, 4 and 5 find the picture full.
    assert_eq!((report.tracks, report.tracks_dropped, report.tracks_refused, report.joined), (4, 2, 2, 2));
    assert!(!report.is_complete());
    // Room comes when the first sensor forgets two: the second one's are there at once.
    net.tell(0, 1000, &many(0, 2))?;
    net.tell(1, 1000, &many(2, 4))?;
    let report = net.update();
    assert_eq!((report.tracks, report.tracks_refused), (4, 2));
    net.tell(0, 2000, &[])?;
    net.tell(1, 2000, &many(2, 4))?;
    let report = net.update();
    assert_eq!((report.tracks, report.tracks_refused, report.ended), (4, 0, 2));
    Ok(())
}

#[test]
fn a_full_picture_still_joins_a_track_that_comes_back() -> Result<(), Box<dyn Error>> {
    let apart = |i: usize| [500.0 * i as f64, 0.0, 0.0, 0.0];
    let mut net = Net::<f32, 2, 2>::intersecting()?;
    for (k, number) in [0usize, 0, 9, 9].into_iter().enumerate() {
        // The first sensor loses target 0 and comes back with a new track while both places are taken by the second's.
        let first = [(number, apart(0))];
        net.tell(0, 1000 * k as u64, &first[..usize::from(k != 1)])?;
        net.tell(1, 1000 * k as u64, &[(0, apart(0)), (1, apart(1))])?;
        let report = net.update();
        assert_eq!((report.tracks, report.tracks_refused, report.ended), (2, 0, 0), "{k}");
    }
    assert_eq!(net.nearest(apart(0)).map(|(id, _)| id), Some(1));
    Ok(())
}

#[test]
fn what_is_no_list_is_refused_and_what_is_no_track_is_counted() -> Result<(), Box<dyn Error>> {
    let mut net = Net::<f32, 2, 4>::intersecting()?;
    net.tell(0, 1000, &[(0, NORTH), (0, SOUTH)])?;
    assert_eq!(net.update().tracks_refused, 1, "the same identity twice");
    let bank = net.bank(0, NORTH);
    let mut receive = |sensor, millis, bank: &Bank<f32>| {
        net.combiner.receive(&mut net.picture, sensor, &Frame::COMMON, Instant::from_millis(millis), [(net.ids[0], bank)])
    };
    assert_eq!(receive(2, 2000, &bank), Err(ListError::UnknownSensor));
    assert_eq!(receive(0, 999, &bank), Err(ListError::TimeReversed));
    assert_eq!(receive(1, 999, &bank), Ok(()), "late, but not for its sensor");
    let mut broken = bank;
    broken.modes[1].mean[3] = f32::NAN;
    assert_eq!(receive(1, 2000, &broken), Ok(()));
    let report = net.update();
    assert_eq!((report.tracks, report.tracks_refused), (1, 1));
    assert!(net.picture.tracks().all(|f| f.state.mean.iter().all(|v| v.is_finite())));
    Ok(())
}

/// Nothing a link may bring makes the picture panic or its estimates be no numbers.
#[test]
fn random_lists_never_break_the_picture() -> Result<(), Box<dyn Error>> {
    let mut net = Net::<f32, 3, 3>::intersecting()?;
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut time = 0u64;
    for _ in 0..3000 {
        time += [0, 1, 300, 4000, 1 << 40][if rng.random_bool(0.01) { 4 } else { rng.random_range(0..4) }];
        let sensor = rng.random_range(0..4);
        let scale = [1.0, 100.0, 1e15, 1e30][rng.random_range(0..4)];
        let banks: Vec<_> = (0..rng.random_range(0..6usize))
            .map(|_| {
                let mean = SVector::from_fn(|_, _| rng.random_range(-1.0..1.0f32) * scale);
                let cov = Symmetric::from_fn(|i, j| rng.random_range(-0.2..1.0f32) * if i == j { scale } else { 0.3 });
                (net.ids[rng.random_range(0..5)], ModeBank::new([0.5; 2], Gaussian::new(mean, cov)))
            })
            .collect();
        let _ = net.combiner.receive(
            &mut net.picture,
            sensor,
            &Frame::COMMON,
            Instant::from_millis(time),
            banks.iter().map(|(id, b)| (*id, b)),
        );
        let report = net.update();
        assert!(report.tracks <= 3);
        let mut members: Vec<_> = net.picture.tracks().flat_map(|f| f.members().collect::<Vec<_>>()).collect();
        let all = members.len();
        members.sort();
        members.dedup();
        assert_eq!(members.len(), all, "a track is in two fused tracks");
        assert!(net.picture.tracks().all(|f| f.state.cov.has_valid_variances() && f.prob.iter().all(|p| (0.0..=1.0).contains(p))));
    }
    Ok(())
}

/// What the image `fusion` is held against on the target.
#[test]
fn the_desk_finds_the_bits_that_the_target_is_held_against() -> Result<(), Box<dyn Error>> {
    use twin::fusion::{APART, CROWD, Fusion, Memory, Picture, checksum};
    for case in [APART, CROWD] {
        let (mut sensors, mut picture) = ([Memory::new(), Memory::new()], Picture::new());
        let passed = Fusion::new()?.pass(&mut sensors, &mut picture, case, Fusion::send, Fusion::update);
        assert!(passed, "{case:?}, but {:#x}", checksum(&picture));
    }
    Ok(())
}

#[test]
fn bad_configurations_are_refused() -> Result<(), ConfigError> {
    let good = Limits { join: 16.0f32, part: 25.0, max_age: Duration::from_millis(1) };
    let with = |jump, rule, limits| Ok(Combiner::<f32, _, 6, 2>::new(modes()?, jump, rule, limits).err());
    let jumps = jump();
    assert_eq!(with(jumps, Rule::NaiveConvex, good)?, None);
    assert_eq!(with([[0.9, 0.2], [0.1, 0.9]], Rule::NaiveConvex, good)?, Some(ConfigError::NotNormalised));
    assert_eq!(with(jumps, Rule::Intersection(Weight::Fixed(-0.1)), good)?, Some(ConfigError::NotAProbability));
    assert_eq!(with(jumps, Rule::NaiveConvex, Limits { part: 15.0, ..good })?, Some(ConfigError::BadThresholds));
    assert_eq!(with(jumps, Rule::NaiveConvex, Limits { join: 0.0, ..good })?, Some(ConfigError::NotPositive));
    assert_eq!(with(jumps, Rule::NaiveConvex, Limits { max_age: Duration::ZERO, ..good })?, Some(ConfigError::NotPositive));
    assert_eq!(with(jumps, Rule::NaiveConvex, Limits { part: f32::INFINITY, ..good })?, Some(ConfigError::NotFinite));
    Ok(())
}
