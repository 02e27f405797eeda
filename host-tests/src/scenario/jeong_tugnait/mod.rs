//! Scenario `jeong-tugnait`: two aircraft cross unresolved, seen by a radar and an infrared sensor; seven filters on the same data.
//!
//! ```text
//! ok, swapped, lost   mean position error of each track over scans 83..=87 below 500 m with its own target; with the other; else
//! excursions_500m     runs in which at some scan from 6 on, by the better pairing, the larger of the two errors is above 500 m
//! clean_rms_close     rms error of runs that are ok and had no excursion, mean over scans 38..=52 and both targets
//! median_error_t      median error of the runs that are ok, over all scans
//! ```
//!
//! Errors are of position, in three dimensions. The paper's counts and those of the reference (an independent implementation in double
//! precision) stand beside ours.

pub(crate) mod data;
pub(crate) mod filters;
mod pictures;

use super::{FilterResult, Metrics, Order, Outcome, Scenario};
use crate::statistics::{mean, median, rms, wilson};
use crate::{Failure, monte_carlo};
use data::{Data, SCANS, TARGETS};
use filters::Tracks;
use std::fmt::Write;
use std::ops::RangeInclusive;

/// The scenario.
pub const SCENARIO: Scenario = Scenario {
    name: "jeong-tugnait",
    about: "two aircraft cross, unresolved by radar and infrared sensor; coupled filters with and without merged measurements (Jeong & Tugnait)",
    default_runs: 1000,
    filters: filters::NAMES,
    on_request: filters::ON_REQUEST,
    run,
};

/// Per 1000 runs of the paper, and of the reference: ok, swapped, lost.
const PAPER: [(&str, [f64; 3]); 2] = [("CF", [902.0, 4.0, 94.0]), ("MCF", [953.0, 3.0, 44.0])];
const REFERENCE: [(&str, [f64; 3]); 7] = [
    ("CF", [856.0, 67.0, 77.0]),
    ("MCF", [986.0, 9.0, 5.0]),
    ("MCF-D", [990.0, 8.0, 2.0]),
    ("MCF parametric", [990.0, 5.0, 5.0]),
    ("IMM-JPDA", [873.0, 57.0, 70.0]),
    ("IMM-PDA", [154.0, 6.0, 840.0]),
    ("IMM-NN", [103.0, 3.0, 894.0]),
];

/// Errors beyond this are a loss or an excursion \[m\].
const FAR: f64 = 500.0;
/// Scans in which the targets are close.
const CLOSE: RangeInclusive<usize> = 38..=52;
/// Before this scan the filters are still settling.
const SETTLED: usize = 6;

#[derive(Clone, Copy, PartialEq, Eq)]
enum End {
    Ok,
    Swapped,
    Lost,
}

/// One filter on one run.
struct Tracked {
    tracks: Tracks,
    /// Position errors at scans 1..=87
    errors: [Vec<f64>; TARGETS],
    end: End,
    excursion: bool,
}

impl Tracked {
    fn new(tracks: Tracks, data: &Data) -> Self {
        let off = |track: usize, target: usize| -> Vec<f64> {
            let distance = |p: &[f64; 3], t: &[f64; 3]| (0..3).map(|a| (p[a] - t[a]).powi(2)).sum::<f64>().sqrt();
            tracks[track].iter().zip(&data.truth[target][1..]).map(|(p, truth)| distance(&p.position, truth)).collect()
        };
        let (own, other) = ([off(0, 0), off(1, 1)], [off(0, 1), off(1, 0)]);
        // A mean that is no number is not below it.
        let near = |errors: &[Vec<f64>; 2]| errors.iter().all(|e| mean(e[SCANS - 5..].iter().copied()).is_some_and(|m| m.mean < FAR));
        let end = match (near(&own), near(&other)) {
            (true, _) => End::Ok,
            (_, true) => End::Swapped,
            _ => End::Lost,
        };
        let larger = |errors: &[Vec<f64>; 2], k: usize| if errors[0][k] > errors[1][k] { errors[0][k] } else { errors[1][k] };
        let excursion = (SETTLED - 1..SCANS).any(|k| !(larger(&own, k) <= FAR || larger(&other, k) <= FAR));
        Self { tracks, errors: own, end, excursion }
    }

    fn is_clean(&self) -> bool {
        self.end == End::Ok && !self.excursion
    }
}

/// One run: its data and every filter.
struct Run {
    data: Data,
    filters: Vec<Tracked>,
}

fn run(order: &Order) -> Result<Outcome, Failure> {
    let runs = order.repeat(SCENARIO.name, |index| one_run(order, index))?;
    let mut outcome = Outcome::default();
    for (number, name) in order.filters.iter().enumerate() {
        let tracked: Vec<&Tracked> = runs.iter().map(|run| &run.filters[number]).collect();
        outcome.filters.push(FilterResult { name, metrics: metrics(&tracked) });
        describe(name, &tracked, &mut outcome.notes);
    }
    if order.pictures {
        outcome.pictures = pictures::draw(order, &runs)?;
    }
    Ok(outcome)
}

fn one_run(order: &Order, index: u64) -> Result<Run, Failure> {
    let data = data::draw(&mut monte_carlo::streams(order.seed, index));
    let tracks = order.filter(&data, [filters::run::<f32>, filters::run::<f64>])?;
    let filters = tracks.into_iter().map(|tracks| Tracked::new(tracks, &data)).collect();
    Ok(Run { data, filters })
}

/// The rms error of a target over runs, at scans 1..=87.
fn rms_curve<'a>(runs: impl Iterator<Item = &'a Tracked> + Clone, target: usize) -> Vec<[f64; 2]> {
    let at = |scan: usize| rms(runs.clone().map(|run| run.errors[target][scan])).unwrap_or(f64::NAN);
    (0..SCANS).map(|scan| [scan as f64 + 1.0, at(scan)]).collect()
}

fn count(tracked: &[&Tracked], of: impl Fn(&Tracked) -> bool) -> usize {
    tracked.iter().filter(|run| of(run)).count()
}

fn metrics(tracked: &[&Tracked]) -> Metrics {
    let clean = tracked.iter().copied().filter(|run| run.is_clean());
    let close = (0..TARGETS).flat_map(|target| rms_curve(clean.clone(), target)).filter(|[k, _]| CLOSE.contains(&(*k as usize)));
    let close = mean(close.map(|[_, rms]| rms)).map(|m| m.mean).filter(|rms| rms.is_finite());
    let ok = |target: usize| median(tracked.iter().filter(|run| run.end == End::Ok).flat_map(|run| run.errors[target].iter().copied()));
    let ends = |end: End| Some(count(tracked, |run| run.end == end) as f64);
    Metrics::from_iter([
        ("ok", ends(End::Ok)),
        ("swapped", ends(End::Swapped)),
        ("lost", ends(End::Lost)),
        ("excursions_500m", Some(count(tracked, |run| run.excursion) as f64)),
        ("clean_rms_close", close),
        ("median_error_t1", ok(0)),
        ("median_error_t2", ok(1)),
    ])
}

/// One line: ours with its uncertainty, the paper's and the reference's.
fn describe(name: &str, tracked: &[&Tracked], notes: &mut String) {
    let runs = tracked.len();
    let interval = |of: &dyn Fn(&Tracked) -> bool| {
        let k = count(tracked, of);
        wilson(k, runs).map_or(String::new(), |p| format!("{k} ({:.0}-{:.0})", p.lower * runs as f64, p.upper * runs as f64))
    };
    let told = |table: &[(&str, [f64; 3])], who: &str| {
        table
            .iter()
            .find(|(known, _)| *known == name)
            .map_or(String::new(), |(_, [ok, swapped, lost])| format!("; {who} {ok} / {swapped} / {lost} of 1000"))
    };
    let _ = writeln!(
        notes,
        "{name}: ok {}, swapped {}, lost {}, not ok {}, excursions {} of {runs}{}{}",
        interval(&|run| run.end == End::Ok),
        interval(&|run| run.end == End::Swapped),
        interval(&|run| run.end == End::Lost),
        interval(&|run| run.end != End::Ok),
        interval(&|run| run.excursion),
        told(&PAPER, "paper"),
        told(&REFERENCE, "reference"),
    );
}
