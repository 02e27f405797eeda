//! Whole trackers.
//!
//! Models and associators that count their calls take the place of the plain ones; joint association counts its own steps.

use super::{COUNTER, Outcome, published};
use crate::counting::{Asked, Counting, take};
use boresight::association::{Gnn, Jpda, MergingJpda, Pda, SingleAssociator, take_operations};
use boresight::mode::JumpMatrix;
use boresight::model::MeasurementModel;
use boresight::model::radar::Radar;
use boresight::scan::{Detection, Report, Scan};
use boresight::sensor::{Clutter, Sensor as _, UniformSensor, Unresolving};
use boresight::time::Instant;
use boresight::track::Status;
use boresight::tracker::{ImmJpda, ImmPdaf, LmsJpda, Work};
use host_tests::budget::bound;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::cell::Cell;
use twin::load::{self, Room, Subject};
use twin::loaded::{Accelerating, Loaded, ManyTurns, Motion, Turning};

impl<M: Motion<NX, MODES>, const NX: usize, const MODES: usize> Motion<NX, MODES> for Counting<M> {
    fn new() -> Result<(Self, JumpMatrix<f32, MODES>, [f32; MODES]), boresight::error::ConfigError> {
        let (modes, jump, initial) = M::new()?;
        Ok((Self(modes), jump, initial))
    }
}

thread_local! {
    /// Weights that [`CountingPda`] has been given
    static WEIGHTS: Cell<u64> = const { Cell::new(0) };
}

/// PDA that counts the weights it is given.
#[derive(Clone, Copy, Debug, Default)]
struct CountingPda;

impl SingleAssociator<f32> for CountingPda {
    fn associate(&self, miss: f32, hit: &mut [f32]) -> f32 {
        WEIGHTS.set(WEIGHTS.get() + hit.len() as u64 + 1);
        Pda.associate(miss, hit)
    }
}

/// With a resolution, of which most trackers take no notice.
type Sensor<const STRIDE: usize> = Unresolving<UniformSensor<Counting<Radar<f32, 2, 2, STRIDE>>, f32>, f32, 2>;

/// One scan: what the tracker said of it, how many tracks it had in pairs, and what its steps amount to in cycles.
struct Taken {
    report: Report,
    paired: usize,
    cycles: u64,
}

/// A tracker whose every scan is held against the formula.
struct Held<K: Loaded<NX, MODES>, const NX: usize, const MODES: usize, const STRIDE: usize> {
    tracker: K,
    sensor: Sensor<STRIDE>,
    state: Box<K::State>,
    room: Room,
    unresolving: bool,
    formula: Work,
    worst: Work,
    taken: Vec<Taken>,
}

impl<K: Loaded<NX, MODES>, const NX: usize, const MODES: usize, const STRIDE: usize> Subject for Held<K, NX, MODES, STRIDE>
where
    Radar<f32, 2, 2, STRIDE>: MeasurementModel<f32, NX, 2>,
{
    fn crowd(&mut self, at: Instant) {
        assert!(self.tracker.crowd(&mut self.state, self.room.tracks, at), "not every cue has found room");
    }

    fn step(&mut self, scan: &Scan<'_, f32, 2>) -> bool {
        take();
        WEIGHTS.take();
        take_operations();
        let tracks = self.tracker.tracks(&self.state).count() as u64;
        let Ok(report) = self.tracker.step(&mut self.state, &self.sensor, scan) else { return false };
        let Asked { predictions, innovations, residuals, differences, fixes } = take();
        let pairings = u64::from(report.births) + u64::from(report.births_refused);
        let seen = Work {
            predictions,
            innovations,
            residuals,
            fixes,
            as_one: differences,
            association: WEIGHTS.take() + take_operations() as u64,
            pairings,
            // No model is called for these: as many as follow from the others.
            corrections: predictions,
            comparisons: tracks * tracks.saturating_sub(1) / 2,
            looks: pairings * (2 * self.room.tracks as u64 + 1),
        };
        let most = self.formula;
        for (kind, seen, most, worst) in [
            ("predictions", seen.predictions, most.predictions, &mut self.worst.predictions),
            ("innovations", seen.innovations, most.innovations, &mut self.worst.innovations),
            ("residuals", seen.residuals, most.residuals, &mut self.worst.residuals),
            ("association", seen.association, most.association, &mut self.worst.association),
            ("fixes", seen.fixes, most.fixes, &mut self.worst.fixes),
            ("pairings", seen.pairings, most.pairings, &mut self.worst.pairings),
            ("as one", seen.as_one, most.as_one, &mut self.worst.as_one),
        ] {
            assert!(seen <= most, "{kind}: {seen} steps, {most} by the formula");
            *worst = seen.max(*worst);
        }
        let paired = self.tracker.tracks(&self.state).filter(|track| track.is_unresolved()).count();
        self.taken.push(Taken { report, paired, cycles: bound::cycles(&seen) });
        true
    }

    fn confirmed(&self) -> usize {
        self.tracker.estimates(&self.state).filter(|estimate| estimate.status != Status::Tentative).count()
    }

    fn unresolving(&self) -> bool {
        self.unresolving
    }
}

impl<K: Loaded<NX, MODES>, const NX: usize, const MODES: usize, const STRIDE: usize> Held<K, NX, MODES, STRIDE>
where
    Radar<f32, 2, 2, STRIDE>: MeasurementModel<f32, NX, 2>,
{
    fn new(room: Room, formula: Work) -> Result<Self, Box<dyn std::error::Error>> {
        let Unresolving { sensor, resolution } = room.coarse::<STRIDE>()?;
        let sensor = Unresolving { sensor: sensor.with_model(Counting(sensor.model)), resolution };
        let unresolving = formula.as_one > 0;
        Ok(Self {
            tracker: K::new()?,
            sensor,
            state: Box::default(),
            room,
            unresolving,
            formula,
            worst: Work::imm_pdaf(0, 0, 0),
            taken: Vec::new(),
        })
    }

    /// Scans of any number of detections, near and far from each other, with clutter of known and of unknown density.
    fn random(&mut self) -> Outcome {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let time = |k: u64| Instant::from_millis(100_000 + 1000 * k);
        for k in 1..120 {
            let clutter = if k / 20 % 2 == 0 { Clutter::Poisson(1e-4) } else { Clutter::Diffuse };
            self.sensor.sensor = UniformSensor::new(*self.sensor.model(), 0.9, clutter, *self.sensor.gate())?;
            if k % 6 == 5 {
                self.crowd(time(k - 1));
            }
            let spread: f32 = [30.0, 300.0, 3000.0][(k / 3 % 3) as usize];
            let mut near = |middle: f32, scale: f32| middle + rng.random_range(-spread..spread) * scale;
            let mut plots = vec![Detection::new([0.0; 2]); self.room.detections];
            plots.iter_mut().for_each(|plot| *plot = Detection::new([near(12_000.0, 1.0), near(1.57, 1.0 / 12_000.0)]));
            plots.truncate(rng.random_range(0..=self.room.detections));
            assert!(self.step(&Scan::new(time(k), &plots)));
        }
        Ok(())
    }
}

/// The scans of the images, then random ones; what became of the former.
fn hold<K: Loaded<NX, MODES>, const NX: usize, const MODES: usize, const STRIDE: usize>(
    room: Room,
    formula: Work,
) -> Result<Vec<Taken>, Box<dyn std::error::Error>>
where
    Radar<f32, 2, 2, STRIDE>: MeasurementModel<f32, NX, 2>,
{
    let _alone = COUNTER.lock();
    let mut held = Held::<K, NX, MODES, STRIDE>::new(room, formula)?;
    assert!(load::run(&mut held, room), "a scan was refused, or the targets were not found");
    let taken = std::mem::take(&mut held.taken);
    held.random()?;
    println!("{:?}\n    of at most {formula:?}", held.worst);
    // The adversarial scans reach what the numbers of tracks and detections alone decide, so the formula is not idle.
    let decided = |work: Work| (work.predictions, work.fixes, work.pairings);
    assert_eq!(decided(held.worst), decided(formula));
    // No scan runs all modes and activates some of them, too.
    assert!(3 * held.worst.residuals >= formula.residuals && 2 * held.worst.innovations >= formula.innovations);
    Ok(taken)
}

macro_rules! single {
    ($modes:ty, $nx:literal, $mode_count:literal, $tracks:literal, $dets:literal) => {{
        type Single = ImmPdaf<f32, Counting<$modes>, $nx, $mode_count, $tracks, $dets, CountingPda>;
        let most = ImmPdaf::<f32, $modes, $nx, $mode_count, $tracks, $dets>::worst_case();
        hold::<Single, $nx, $mode_count, { $nx / 2 }>(Room { tracks: $tracks, detections: $dets }, most)?
    }};
}

macro_rules! joint {
    ($modes:ty, $nx:literal, $mode_count:literal, $tracks:literal, $dets:literal, $nodes:literal) => {{
        type Joint = ImmJpda<f32, Counting<$modes>, $nx, $mode_count, $tracks, $dets, Jpda<$nodes>>;
        hold::<Joint, $nx, $mode_count, { $nx / 2 }>(Room { tracks: $tracks, detections: $dets }, Joint::worst_case())?
    }};
}

macro_rules! nearest {
    ($tracks:literal, $dets:literal) => {{
        type Nearest = ImmJpda<f32, Counting<Turning>, 4, 3, $tracks, $dets, Gnn>;
        hold::<Nearest, 4, 3, 2>(Room { tracks: $tracks, detections: $dets }, Nearest::worst_case())?
    }};
}

macro_rules! merging {
    ($tracks:literal, $dets:literal) => {{
        type Merging = ImmJpda<f32, Counting<Turning>, 4, 3, $tracks, $dets, MergingJpda<256, 4>>;
        hold::<Merging, 4, 3, 2>(Room { tracks: $tracks, detections: $dets }, Merging::worst_case())?
    }};
}

macro_rules! likely {
    ($tracks:literal, $dets:literal) => {{
        type Likely = LmsJpda<f32, Counting<ManyTurns>, 4, 7, $tracks, $dets, Jpda<64>>;
        hold::<Likely, 4, 7, 2>(Room { tracks: $tracks, detections: $dets }, Likely::worst_case())?
    }};
}

#[test]
fn no_scan_takes_more_work_than_the_formula() -> Outcome {
    single!(Turning, 4, 3, 1, 1);
    single!(Turning, 4, 3, 16, 32);
    single!(Accelerating, 6, 2, 32, 64);
    nearest!(4, 8);
    nearest!(16, 32);
    let crowded = [
        joint!(Turning, 4, 3, 4, 8, 64),
        joint!(Turning, 4, 3, 16, 32, 256),
        joint!(Accelerating, 6, 2, 16, 32, 64),
        joint!(Turning, 4, 3, 32, 64, 256),
        joint!(ManyTurns, 4, 7, 16, 32, 64),
        likely!(4, 8),
        likely!(16, 32),
    ];
    let given_up = |part: &[Taken]| part.iter().map(|t| t.report.clusters_bounded + t.report.clusters_approximated).sum::<u16>();
    for taken in crowded {
        let (recorded, adversarial) = taken.split_at(load::SCANS);
        // The crowd makes joint association give up the exact sum: otherwise nothing was adversarial.
        assert_eq!((given_up(recorded), usize::from(given_up(adversarial))), (0, load::ROUNDS));
    }
    let taken = merging!(16, 32);
    let (recorded, adversarial) = taken.split_at(load::SCANS);
    // Targets that cross are in pairs and part again; in the crowd all eight pairs are, and find room for four.
    let paired: Vec<_> = recorded.iter().map(|taken| taken.paired).collect();
    println!("tracks in pairs: {paired:?}");
    let (before, met, after) = (&paired[..15], &paired[20..22], &paired[25..]);
    assert!(met.iter().all(|paired| *paired >= 2) && before.iter().chain(after).all(|paired| *paired == 0));
    assert!(given_up(recorded) == 0 && usize::from(given_up(adversarial)) >= load::ROUNDS);
    let refused: Vec<_> = adversarial.iter().map(|taken| taken.report.pairs_refused).collect();
    println!("pairs refused: {refused:?}");
    assert_eq!(refused.iter().filter(|refused| **refused == 4).count(), load::ROUNDS);
    Ok(())
}

#[test]
fn published_cycles_are_within_what_the_steps_of_their_scans_amount_to() -> Outcome {
    let published = published()?;
    for (name, taken) in [
        ("imm-pdaf 4x3 4x8", single!(Turning, 4, 3, 4, 8)),
        ("imm-pdaf 6x2 32x64", single!(Accelerating, 6, 2, 32, 64)),
        ("imm-gnn 4x3 16x32", nearest!(16, 32)),
        ("imm-gnn 4x3 32x64", nearest!(32, 64)),
        ("imm-jpda 4x3 16x32 64", joint!(Turning, 4, 3, 16, 32, 64)),
        ("imm-jpda 6x2 4x8 64", joint!(Accelerating, 6, 2, 4, 8, 64)),
        ("imm-jpda 4x3 32x64 256", joint!(Turning, 4, 3, 32, 64, 256)),
        ("imm-jpda 4x7 16x32 64", joint!(ManyTurns, 4, 7, 16, 32, 64)),
        ("lms-jpda 4x7 4x8 64", likely!(4, 8)),
        ("lms-jpda 4x7 16x32 64", likely!(16, 32)),
        ("merging-jpda 4x3 4x8 256 4", merging!(4, 8)),
        ("merging-jpda 4x3 16x32 256 4", merging!(16, 32)),
    ] {
        let (recorded, adversarial) = taken.split_at(load::SCANS);
        for (scenario, part) in [("recorded", recorded), ("adversarial", adversarial)] {
            let counted = published["trackers"][name][scenario]["worst_cycles"].as_integer().ok_or("no cycles")?;
            let amount = part.iter().map(|taken| taken.cycles).max().unwrap_or_default();
            println!("{name}, {scenario}: {counted} of {amount} cycles");
            assert!(counted > 0 && counted.unsigned_abs() <= amount, "{name}, {scenario}: {counted} of {amount} cycles");
        }
    }
    Ok(())
}
