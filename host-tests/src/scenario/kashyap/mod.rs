//! Scenario `kashyap-a`: two manoeuvring targets in clutter, one sensor, nine filters on the same data.
//!
//! ```text
//! lost           mean position error over the last ten scans above 100 m, or not finite
//! rms_manoeuvre  root mean square position error over scans a + 1..b of all manoeuvres of all tracks not lost
//! rms_quiet      the same over scans outside of manoeuvres, their five scans after, and the start (k < 5)
//! peak           the largest value of the curve "rms position error at scan k over the tracks not lost", k ≥ 5
//! ```
//!
//! The figures of the reference (an independent implementation in double precision, base seed 0) stand beside ours.

pub(crate) mod data;
pub(crate) mod filters;
mod pictures;

use super::{FilterResult, Metrics, Order, Outcome, Scenario};
use crate::statistics::{mean, quantile, wilson};
use crate::{Failure, Precision, monte_carlo};
use data::{Data, Phase, SCANS, TARGETS, phase};
use filters::{Point, Tracks};
use std::fmt::Write;

/// The entry of the table of scenarios.
pub const SCENARIO: Scenario = Scenario {
    name: "kashyap-a",
    about: "two targets manoeuvring at 1 g in clutter; IMM-PDAF in printed and corrected form (Kashyap et al. 2006)",
    default_runs: 200,
    filters: filters::NAMES,
    on_request: &[filters::SPECIFIED],
    run,
};

/// The first scan with an estimate.
const FIRST: usize = 2;
/// The first scan of the rms curve.
const SETTLED: usize = 5;
/// The filters that are also compared between the two precisions.
const COMPARED: [&str; 3] = ["IMM-PDAF proper case 1", "IMM-PDAF three models", filters::SPECIFIED];

/// Reference figures over 400 tracks: lost, rms in manoeuvres and quiet, peak \[m\].
const REFERENCE: [(&str, f64, Option<[f64; 3]>); 10] = [
    ("NN CV", 400.0, None),
    ("NN CA", 106.0, Some([7.02, 7.18, 15.0])),
    ("PDAF CA", 2.0, Some([7.08, 7.23, 16.0])),
    ("IMM-NN case 1", 62.0, Some([7.39, 120.0, 823.0])),
    ("IMM-PDAF paper case 1", 126.0, Some([7.06, 4.77, 10.0])),
    ("IMM-PDAF paper case 2", 368.0, Some([8.91, 4.74, 38.0])),
    ("IMM-PDAF proper case 1", 0.0, Some([31.3, 4.82, 107.0])),
    ("IMM-PDAF proper case 2", 16.0, Some([621.0, 1455.0, 3714.0])),
    ("IMM-PDAF three models", 0.0, Some([6.91, 4.99, 12.9])),
    (filters::SPECIFIED, 0.0, Some([6.91, 4.99, 12.9])),
];

/// One filter on one run: errors and what the pictures need.
struct Tracked {
    tracks: Tracks,
    errors: [Vec<f64>; TARGETS],
}

impl Tracked {
    fn new(tracks: Tracks, data: &Data) -> Self {
        let errors = std::array::from_fn(|target| {
            let truth = &data.truth[target][FIRST..];
            tracks[target].iter().zip(truth).map(|(p, t)| (p.position[0] - t[0]).hypot(p.position[1] - t[1])).collect()
        });
        Self { tracks, errors }
    }

    fn lost(&self, target: usize) -> bool {
        let tail = &self.errors[target][SCANS - FIRST - 10..];
        let mean = tail.iter().sum::<f64>() / tail.len() as f64;
        mean.is_nan() || mean > 100.0
    }
}

/// One run: every filter in the order's precision, and the compared filters in the other one.
struct Run {
    data: Data,
    filters: Vec<Tracked>,
    differences: Vec<(usize, [Difference; TARGETS])>,
}

/// A track in single precision against the same in double precision.
#[derive(Clone, Copy)]
struct Difference {
    largest: f64,
    lost: [bool; 2],
    /// Whether the estimate was ever farther from the truth than ten standard deviations of a measurement: it followed
    /// clutter then, and which point it took may hang on the last bit.
    strayed: bool,
}

fn run(order: &Order) -> Result<Outcome, Failure> {
    let runs = order.repeat(SCENARIO.name, |index| one_run(order, index))?;
    let mut outcome = Outcome::default();
    let mut notes = String::new();
    for (number, name) in order.filters.iter().enumerate() {
        let tracks = || runs.iter().map(|run| &run.filters[number]);
        let summary = Summary::new(tracks());
        outcome.filters.push(FilterResult { name, metrics: summary.metrics() });
        summary.describe(name, &mut notes);
        compare(name, number, &runs, &mut notes);
    }
    claims(&outcome.filters, &mut notes);
    if order.pictures {
        outcome.pictures = pictures::draw(order, &runs)?;
    }
    outcome.notes = notes;
    Ok(outcome)
}

fn one_run(order: &Order, index: u64) -> Result<Run, Failure> {
    let data = data::draw(&mut monte_carlo::streams(order.seed, index));
    let run_in = |name: &str, precision| match precision {
        Precision::F32 => filters::run::<f32>(name, &data),
        Precision::F64 => filters::run::<f64>(name, &data),
    };
    let mut tracked = Vec::new();
    let mut differences = Vec::new();
    for (number, name) in order.filters.iter().enumerate() {
        let own = Tracked::new(run_in(name, order.precision)?, &data);
        if COMPARED.contains(name) {
            let other = match order.precision {
                Precision::F32 => Precision::F64,
                Precision::F64 => Precision::F32,
            };
            let other = Tracked::new(run_in(name, other)?, &data);
            differences.push((number, std::array::from_fn(|target| difference(&own, &other, target))));
        }
        tracked.push(own);
    }
    Ok(Run { data, filters: tracked, differences })
}

fn difference(own: &Tracked, other: &Tracked, target: usize) -> Difference {
    let apart = |(a, b): (&Point, &Point)| (a.position[0] - b.position[0]).hypot(a.position[1] - b.position[1]);
    let largest = own.tracks[target].iter().zip(&other.tracks[target]).map(apart).fold(0.0, f64::max);
    let strayed = own.errors[target].iter().chain(&other.errors[target]).any(|e| e.is_nan() || *e > 10.0 * data::SIGMA);
    Difference { largest, lost: [own.lost(target), other.lost(target)], strayed }
}

/// The statistics of one filter over all runs.
struct Summary {
    tracks: usize,
    lost: usize,
    manoeuvre: Spread,
    quiet: Spread,
    peak: Option<f64>,
}

/// A root mean square with its standard error over tracks.
#[derive(Default)]
struct Spread {
    squares: Vec<f64>,
    weights: Vec<f64>,
}

impl Spread {
    /// Adds the errors of one track.
    fn add(&mut self, errors: impl Iterator<Item = f64>) {
        let (count, sum) = errors.fold((0.0, 0.0), |(n, s), e| (n + 1.0, s + e * e));
        if count > 0.0 {
            self.squares.push(sum);
            self.weights.push(count);
        }
    }

    fn rms(&self) -> Option<f64> {
        let count: f64 = self.weights.iter().sum();
        (count > 0.0).then(|| (self.squares.iter().sum::<f64>() / count).sqrt())
    }

    /// By the delta method, tracks being independent: se(rms) = se(mean square) / (2 rms).
    fn error(&self) -> Option<f64> {
        let per_track = self.squares.iter().zip(&self.weights).map(|(s, n)| s / n);
        Some(mean(per_track)?.standard_error? / (2.0 * self.rms()?))
    }
}

impl Summary {
    fn new<'a>(runs: impl Iterator<Item = &'a Tracked>) -> Self {
        let mut summary = Self { tracks: 0, lost: 0, manoeuvre: Spread::default(), quiet: Spread::default(), peak: None };
        let mut curve = RmsCurve::default();
        for run in runs {
            for target in 0..TARGETS {
                summary.tracks += 1;
                if run.lost(target) {
                    summary.lost += 1;
                    continue;
                }
                let errors = &run.errors[target];
                let during = |wanted: Phase| (FIRST..SCANS).zip(errors).filter(move |(k, _)| phase(target, *k) == wanted).map(|(_, e)| *e);
                summary.manoeuvre.add(during(Phase::Manoeuvre));
                summary.quiet.add(during(Phase::Quiet));
                curve.add(errors);
            }
        }
        summary.peak = curve.points().into_iter().filter(|[k, _]| *k >= SETTLED as f64).map(|[_, rms]| rms).reduce(f64::max);
        summary
    }

    fn metrics(&self) -> Metrics {
        Metrics::from_iter([
            ("tracks", Some(self.tracks as f64)),
            ("lost", Some(self.lost as f64)),
            ("rms_manoeuvre", self.manoeuvre.rms()),
            ("rms_quiet", self.quiet.rms()),
            ("peak", self.peak),
        ])
    }

    /// One line: ours with its uncertainty, and the reference's scaled to as many tracks.
    fn describe(&self, name: &str, notes: &mut String) {
        let interval = wilson(self.lost, self.tracks)
            .map_or(String::new(), |p| format!(" ({:.0}-{:.0})", p.lower * self.tracks as f64, p.upper * self.tracks as f64));
        let shown = |spread: &Spread| match (spread.rms(), spread.error()) {
            (Some(rms), Some(error)) => format!("{rms:.2} ± {error:.2}"),
            _ => "-".into(),
        };
        let (ours_man, ours_quiet) = (shown(&self.manoeuvre), shown(&self.quiet));
        let peak = self.peak.map_or("-".into(), |p| format!("{p:.1}"));
        let reference = REFERENCE.iter().find(|(known, ..)| *known == name).map_or(String::new(), |(_, lost, rms)| {
            let rms = rms.map_or("-".into(), |[man, quiet, peak]| format!("{man} / {quiet} m, peak {peak} m"));
            format!("reference: lost {lost} of 400, {rms}")
        });
        let _ = writeln!(
            notes,
            "{name}: lost {}{interval} of {}, rms {ours_man} / {ours_quiet} m, peak {peak} m; {reference}",
            self.lost, self.tracks
        );
    }
}

/// The rms error at every scan over tracks.
#[derive(Default)]
struct RmsCurve {
    sums: Vec<f64>,
    count: f64,
}

impl RmsCurve {
    fn add(&mut self, errors: &[f64]) {
        self.sums.resize(errors.len(), 0.0);
        for (sum, e) in self.sums.iter_mut().zip(errors) {
            *sum += e * e;
        }
        self.count += 1.0;
    }

    fn points(&self) -> Vec<[f64; 2]> {
        self.sums.iter().enumerate().map(|(i, sum)| [(i + FIRST) as f64, (sum / self.count).sqrt()]).collect()
    }
}

/// The paper gives curves and claims, no table. The claims that a run can check, beside what it found.
fn claims(results: &[FilterResult], notes: &mut String) {
    let of = |filter: &str, metric: &str| results.iter().find(|r| r.name == filter)?.metrics.get(metric).copied().flatten();
    if let (Some(one), Some(two)) = (of("IMM-PDAF paper case 1", "lost"), of("IMM-PDAF paper case 2", "lost")) {
        let _ = writeln!(notes, "paper: case 2 errs more than case 1, both good; here its form loses {two} and {one} tracks");
    }
    if let (Some(imm), Some(pdaf)) = (of("IMM-PDAF proper case 1", "rms_quiet"), of("PDAF CA", "rms_quiet")) {
        let _ =
            writeln!(notes, "paper: less error in quiet flight than a filter with high process noise; here {imm:.2} against {pdaf:.2} m");
    }
}

/// Single against double precision on the same data.
fn compare(name: &str, number: usize, runs: &[Run], notes: &mut String) {
    let differences: Vec<Difference> =
        runs.iter().flat_map(|run| run.differences.iter().filter(|(n, _)| *n == number).flat_map(|(_, d)| *d)).collect();
    let lost = |which: usize| differences.iter().filter(|d| d.lost[which]).count();
    let summary = |strayed: bool| {
        let largest: Vec<f64> = differences.iter().filter(|d| d.strayed == strayed).map(|d| d.largest).collect();
        let at = |fraction| quantile(largest.iter().copied(), fraction).map_or("-".into(), |d| format!("{d:.4}"));
        format!("{} tracks, median {} m, 99 % {} m, maximum {} m", largest.len(), at(0.5), at(0.99), at(1.0))
    };
    if !differences.is_empty() {
        let _ = writeln!(notes, "    f32 against f64 ({name}): lost {} and {}; largest distance of a track:", lost(0), lost(1));
        let _ = writeln!(notes, "        {}; of those that strayed beyond 50 m from the truth: {}", summary(false), summary(true));
    }
}
