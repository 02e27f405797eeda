//! Scenario `kashyap-b`: four targets, two sensors with a tracker each, their tracks fused; and one tracker for all plots.
//!
//! ```text
//! pairing                target and track by the least Σ min(d, 50), d² over positions [m] and velocities [m/s], scan by scan:
//!                        target 1 passes target 2 within metres, and by positions alone would be taken for it
//! exactly_four_fraction  share of scans 15..99 with exactly four confirmed tracks
//! rms_t1, rms_t2         root mean square position error of the paired track over those scans
//! p_manoeuvre_t1         mean probability of the second mode over scans 41..50, target 1
//! p_manoeuvre_other      the largest of the means over scans 15..99 of targets 2 to 4
//! nees_t1                mean over scans 15..99 of the NEES of (x, vx, y, vy); 4 where the covariance is honest
//! ```
//!
//! Scans without a paired track count in none of the last four; how many there are is told below the table. The figures of the
//! reference (an independent implementation in double precision, 60 runs of other seeds) stand beside ours.

mod data;
mod filters;
mod pictures;

use super::{FilterResult, Metrics, Order, Outcome, Scenario};
use crate::metrics::{consistency, match_points, nees};
use crate::statistics::{mean, rms};
use crate::{Failure, monte_carlo};
use data::{Data, MANOEUVRE, SCANS, TARGETS};
use filters::{Point, Tracks};
use std::fmt::Write;

/// The entry of the table of scenarios.
pub const SCENARIO: Scenario = Scenario {
    name: "kashyap-b",
    about: "four targets, two sensors with an IMM-PDAF each, tracks fused; against one tracker for all (Kashyap et al. 2006)",
    default_runs: 60,
    filters: filters::NAMES,
    on_request: &[],
    run,
};

/// The first scan that counts.
const SETTLED: usize = 15;
/// Tracks farther than this from a target are not its own.
const CUTOFF: f64 = 50.0;

/// Reference figures: scans with exactly four tracks \[%\], rms position of targets 1 and 2 \[m\], probability of the manoeuvre for target
/// 1 in scans 41..50 and for target 2, NEES of target 1.
const REFERENCE: [(&str, [f64; 6]); 3] = [
    ("paper fused", [91.6, 3.35, 1.45, 0.88, 0.13, 5.12]),
    ("proper fused convex", [100.0, 1.75, 1.46, 0.92, 0.13, 2.75]),
    ("proper fused CI", [100.0, 1.75, 1.46, 0.92, 0.13, 1.38]),
];

/// One run: the tracks of every filter, and which belongs to which target.
struct Run {
    data: Data,
    filters: Vec<Tracked>,
}

/// The tracks of a filter on one run.
struct Tracked {
    tracks: Tracks,
    /// Of every target by scan, the track that follows it.
    paired: [Vec<Option<Point>>; TARGETS],
}

impl Tracked {
    fn new(tracks: Tracks, data: &Data) -> Self {
        let mut paired: [Vec<Option<Point>>; TARGETS] = Default::default();
        for (k, points) in tracks.iter().enumerate() {
            let truth: [[f64; 4]; TARGETS] = std::array::from_fn(|target: usize| data.truth[target][k]);
            let estimates: Vec<[f64; 4]> = points.iter().map(|p| p.state).collect();
            let matching = match_points(&truth, &estimates, CUTOFF, 1.0);
            for (target, list) in paired.iter_mut().enumerate() {
                list.push(matching.pairs.iter().find(|pair| pair.truth == target).map(|pair| points[pair.estimate].clone()));
            }
        }
        Self { tracks, paired }
    }

    fn scans_with_exactly_four(&self) -> usize {
        self.tracks[SETTLED..].iter().filter(|points| points.len() == TARGETS).count()
    }

    /// What `of` makes of the tracks of a target and its truth, scan by scan, where there is a track.
    fn over<'a>(
        &'a self,
        data: &'a Data,
        target: usize,
        scans: std::ops::Range<usize>,
        of: impl Fn(&Point, [f64; 4]) -> f64 + 'a,
    ) -> impl Iterator<Item = f64> + 'a {
        scans.filter_map(move |k| Some(of(self.paired[target][k].as_ref()?, data.truth[target][k])))
    }
}

fn distance(point: &Point, truth: [f64; 4]) -> f64 {
    (point.state[0] - truth[0]).hypot(point.state[2] - truth[2])
}

fn normalised(point: &Point, truth: [f64; 4]) -> f64 {
    let error: [f64; 4] = std::array::from_fn(|i| point.state[i] - truth[i]);
    nees(&error, &point.cov).unwrap_or(f64::NAN)
}

fn run(order: &Order) -> Result<Outcome, Failure> {
    let runs = order.repeat(SCENARIO.name, |index| one_run(order, index))?;
    let mut outcome = Outcome::default();
    for (number, name) in order.filters.iter().enumerate() {
        let summary = Summary::new(&runs, number);
        outcome.filters.push(FilterResult { name, metrics: summary.metrics() });
        summary.describe(name, runs.len(), &mut outcome.notes);
    }
    let _ = writeln!(outcome.notes, "paper: four tracks after fusion, and the manoeuvre noticed in track 1 only");
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

/// The statistics of one filter over all runs; by target where there are four.
struct Summary {
    exactly_four: f64,
    mean_tracks: f64,
    rms: [Option<f64>; TARGETS],
    nees: [Option<f64>; TARGETS],
    /// Of every run, for the interval
    nees_by_run: [Vec<f64>; TARGETS],
    manoeuvring: Option<f64>,
    p_manoeuvre: [Option<f64>; TARGETS],
    missed: [usize; TARGETS],
}

impl Summary {
    fn new(runs: &[Run], filter: usize) -> Self {
        let tracked = || runs.iter().map(|run| (&run.filters[filter], &run.data));
        let scans = (runs.len() * (SCANS - SETTLED)) as f64;
        let all = |target: usize, of: fn(&Point, [f64; 4]) -> f64, scans: std::ops::Range<usize>| -> Vec<f64> {
            tracked().flat_map(|(tracked, data)| tracked.over(data, target, scans.clone(), of)).collect()
        };
        let settled = || SETTLED..SCANS;
        let by_target = |of: fn(&Point, [f64; 4]) -> f64| std::array::from_fn(|target| mean(all(target, of, settled())).map(|m| m.mean));
        let p = |point: &Point, _| point.p_manoeuvre;
        Self {
            exactly_four: tracked().map(|(tracked, _)| tracked.scans_with_exactly_four() as f64).sum::<f64>() / scans,
            mean_tracks: tracked().flat_map(|(tracked, _)| &tracked.tracks[SETTLED..]).map(Vec::len).sum::<usize>() as f64 / scans,
            rms: std::array::from_fn(|target| rms(all(target, distance, settled()))),
            nees: by_target(normalised),
            nees_by_run: std::array::from_fn(|target| {
                let of_run = |(tracked, data): (&Tracked, &Data)| mean(tracked.over(data, target, settled(), normalised)).map(|m| m.mean);
                tracked().filter_map(of_run).collect()
            }),
            manoeuvring: mean(all(0, p, MANOEUVRE.start + 1..MANOEUVRE.end + 1)).map(|m| m.mean),
            p_manoeuvre: by_target(p),
            missed: std::array::from_fn(|target| scans as usize - all(target, distance, settled()).len()),
        }
    }

    fn metrics(&self) -> Metrics {
        let other = self.p_manoeuvre[1..].iter().flatten().copied().reduce(f64::max);
        Metrics::from_iter([
            ("exactly_four_fraction", Some(self.exactly_four)),
            ("rms_t1", self.rms[0]),
            ("rms_t2", self.rms[1]),
            ("p_manoeuvre_t1", self.manoeuvring),
            ("p_manoeuvre_other", other),
            ("nees_t1", self.nees[0]),
        ])
    }

    /// Ours by target, then the reference's.
    fn describe(&self, name: &str, runs: usize, notes: &mut String) {
        let list =
            |values: &[Option<f64>]| values.iter().map(|v| v.map_or("-".into(), |v| format!("{v:.2}"))).collect::<Vec<_>>().join(" ");
        let missed: Vec<String> = self.missed.iter().map(usize::to_string).collect();
        let _ = writeln!(
            notes,
            "{name}: {:.3} tracks, T1..T4: rms {} m, NEES(4) {}, P(manoeuvre) {}, scans without a track {}",
            self.mean_tracks,
            list(&self.rms),
            list(&self.nees),
            list(&self.p_manoeuvre),
            missed.join(" ")
        );
        if let Some(upper) = consistency(&vec![4.0; runs], 4).map(|c| c.interval[1]) {
            let above: Vec<String> =
                (0..TARGETS).filter(|t| self.nees[*t].is_some_and(|n| n > upper)).map(|t| format!("T{}", t + 1)).collect();
            let worst = self.nees_by_run.iter().flatten().copied().fold(0.0, f64::max);
            let verdict = if above.is_empty() { "none above".into() } else { format!("{} above", above.join(", ")) };
            let _ = writeln!(
                notes,
                "    NEES against the 95 % upper bound of {runs} runs, {upper:.2}: {verdict}; largest mean of a run {worst:.2}"
            );
        }
        if let Some((_, [four, rms1, rms2, p1, p2, nees])) = REFERENCE.iter().find(|(known, _)| *known == name) {
            let _ = writeln!(
                notes,
                "    reference: exactly four in {four} %, rms T1 {rms1} T2 {rms2} m, P(manoeuvre) T1 {p1} in 41..50, T2 {p2}, NEES T1 {nees}"
            );
        }
    }
}
