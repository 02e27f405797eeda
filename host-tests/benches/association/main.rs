//! How association scales: marginals of 2 to 20 tracks with 2 to 30 detections, dense, sparse and banded.
//!
//! ```text
//! cargo bench -p host-tests --bench association                     all, in about two minutes
//! cargo bench -p host-tests --bench association -- 'banded 20x30'   one problem
//! PYTHON=venv/bin/python cargo bench ...                            beside PyEHM: `pip install pyehm` in that Python
//! ```
//!
//! Timed on the same matrices are [`Jpda`] with room for all sets (f64 and f32) and with room for a thousand (f32), plain
//! enumeration of all joint events, and EHM2 of PyEHM, which is C++. Times include loading the weights. Criterion times and
//! compares with its last run; the table in the end takes the shortest batch of each, and divides within this run.
//!
//! What is exact must agree with enumeration and with PyEHM to 1e-9, and what is bounded must keep its bound: otherwise the
//! run fails.

mod enumeration;
mod matrices;
mod pyehm;
#[path = "../support/mod.rs"]
mod support;
mod table;

use boresight::association::{AssociationMatrix, Associator, ClutterPrior, Completeness, Domain, Jpda, JpdaMemory};
use boresight::scalar::Real;
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion};
use enumeration::Enumeration;
use matrices::Problem;
use std::error::Error;
use std::hint::black_box;
use std::sync::Mutex;
use std::time::Duration;
use support::shortest;

/// One memory for all sizes: that of the largest.
const TRACKS: usize = 20;
const DETS: usize = 30;
/// Nodes enough for fifteen tracks that all gate thirty detections.
const PLENTY: usize = 1 << 20;
/// What a microcontroller may have to spare: 8 KiB in single precision.
const FEW: usize = 1 << 10;
/// Problems of more joint events are not enumerated.
const MOST_EVENTS: u64 = 1_000_000;
/// How far two exact answers may lie apart.
const AGREEMENT: f64 = 1e-9;
/// What single precision may lose of an exact probability: a rounding for each of ten thousand terms of a sum.
const ROUNDING: f64 = 10_000.0 * f32::EPSILON as f64 / 2.0;

type Matrix<T> = AssociationMatrix<T, TRACKS, DETS>;
type Memory<T, const NODES: usize> = JpdaMemory<T, TRACKS, DETS, NODES>;
/// β_t0 and β_tj, one row per track.
type Marginals = Vec<Vec<f64>>;

static PLENTY_F64: Mutex<Memory<f64, PLENTY>> = Mutex::new(<Jpda<PLENTY> as Associator<f64, TRACKS, DETS>>::MEMORY);
static PLENTY_F32: Mutex<Memory<f32, PLENTY>> = Mutex::new(<Jpda<PLENTY> as Associator<f32, TRACKS, DETS>>::MEMORY);
static FEW_F32: Mutex<Memory<f32, FEW>> = Mutex::new(<Jpda<FEW> as Associator<f32, TRACKS, DETS>>::MEMORY);

/// What somebody makes of a problem, and the seconds it takes.
struct Run {
    seconds: f64,
    completeness: Completeness,
    marginals: Marginals,
}

/// All that is measured of a problem.
struct Measured {
    problem: Problem,
    double: Option<Run>,
    single: Option<Run>,
    few: Run,
    /// `None` above [`MOST_EVENTS`]
    events: Option<u64>,
    enumeration: Option<f64>,
}

impl Measured {
    /// The exact answer, if it was found.
    fn exact(&self) -> Option<&Run> {
        self.double.as_ref().filter(|run| run.completeness.is_exact())
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let brief = |c: Criterion| c.warm_up_time(Duration::from_millis(20)).measurement_time(Duration::from_millis(60));
    let mut criterion = brief(Criterion::default().without_plots().sample_size(10).nresamples(1_000)).configure_from_args();
    let mut all = vec![];
    for problem in Problem::all() {
        let mut group = criterion.benchmark_group(problem.name());
        all.extend(measure(&mut group, problem)?);
        group.finish();
    }
    if !all.is_empty() {
        let pyehm = pyehm::run(&all)?;
        table::print(&all, &pyehm);
    }
    Ok(())
}

/// `None` where the command line leaves the problem out.
fn measure(group: &mut BenchmarkGroup<'_, WallTime>, problem: Problem) -> Result<Option<Measured>, Box<dyn Error>> {
    let enumeration = Enumeration::new(&problem);
    let events = enumeration.events(MOST_EVENTS);
    let Some(few) = associate(group, "f32 few nodes", &FEW_F32, &problem) else { return Ok(None) };
    let (mut double, mut single, mut enumerated) = (None, None, None);
    if problem.fits(PLENTY) {
        double = associate(group, "f64", &PLENTY_F64, &problem);
        single = associate(group, "f32", &PLENTY_F32, &problem);
    }
    if events.is_some() {
        enumerated = shortest(group, "enumeration", || drop(black_box(enumeration.marginals())));
    }
    let measured = Measured { problem, double, single, few, events, enumeration: enumerated };
    check(&measured, &enumeration)?;
    Ok(Some(measured))
}

/// Holds f64 against enumeration, and single precision against f64: bounded answers within their bound.
fn check(measured: &Measured, enumeration: &Enumeration) -> Result<(), String> {
    let Some(exact) = measured.exact() else { return Ok(()) };
    let within = |bound: f64, a: &Marginals, what: &str| {
        let off = difference(a, &exact.marginals);
        (off <= bound).then_some(()).ok_or_else(|| format!("{}: {what} is off by {off}", measured.problem.name()))
    };
    if measured.events.is_some() {
        within(AGREEMENT, &enumeration.marginals(), "f64")?;
    }
    for (run, name) in [(measured.single.as_ref(), "f32"), (Some(&measured.few), "f32 with few nodes")] {
        if let Some(run) = run.filter(|run| run.completeness.approximated == 0) {
            within(f64::from(run.completeness.error_bound) + ROUNDING, &run.marginals, name)?;
        }
    }
    Ok(())
}

fn associate<T: Real, const NODES: usize>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: &str,
    memory: &Mutex<Memory<T, NODES>>,
    problem: &Problem,
) -> Option<Run> {
    let mut weights = Matrix::<T>::new();
    weights.reset(problem.detections(), ClutterPrior::Poisson, Domain::Linear);
    for (t, (miss, hit)) in problem.miss.iter().zip(&problem.hit).enumerate() {
        let (m, h) = weights.row_mut(t)?;
        *m = T::lit(*miss);
        h.iter_mut().zip(hit).for_each(|(h, w)| *h = T::lit(*w));
    }
    let memory = &mut *memory.lock().ok()?;
    let mut matrix = weights.clone();
    let mut completeness = Completeness::default();
    let seconds = shortest(group, name, || {
        matrix.clone_from(black_box(&weights));
        completeness = Jpda::<NODES>::new().associate(&mut matrix, memory);
        black_box(&matrix);
    })?;
    let row = |(miss, hit): (T, &[T])| std::iter::once(&miss).chain(hit).map(|beta| beta.to_f64()).collect();
    let marginals = (0..problem.tracks()).filter_map(|t| matrix.row(t).map(row)).collect();
    Some(Run { seconds, completeness, marginals })
}

/// The largest difference of any probability.
fn difference(a: &Marginals, b: &Marginals) -> f64 {
    a.iter().flatten().zip(b.iter().flatten()).fold(0.0, |worst, (a, b)| f64::max(worst, (a - b).abs()))
}
