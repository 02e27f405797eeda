//! Scenarios `jms-glmb-linear` and `jms-glmb-nonlinear`: targets that come, manoeuvre and go in heavy clutter, tracked as a
//! labelled set; eleven and six filters on the same data.
//!
//! ```text
//! ospa, gospa           over positions, order 1, cut-off 1000 m, mean of all scans; ospa_localisation + ospa_cardinality = ospa
//! cardinality_error     mean of | estimates − targets |
//! model_accuracy        share of (scan, target) with an estimate within 1 km whose most probable mode is that of the target's last
//!                       transition, of those with an estimate
//! label_switches        a run's sum over targets of the different labels that were nearest within 1 km, less one each; mean
//! p_cv_scans_above_0_9  scans of 5..30 in which the mean over runs of target 1's probability of constant velocity is above 0.9
//! ```
//!
//! The figures of the reference (an independent implementation in double precision, 100 runs of other random numbers) stand
//! beside ours. The paper gives curves only.

pub(crate) mod data;
pub(crate) mod filters;
mod pictures;

use super::{FilterResult, Metrics, Order, Outcome, Scenario};
use crate::metrics::{distance, gospa, ospa};
use crate::statistics::mean;
use crate::{Failure, Precision, monte_carlo};
use data::{Data, SCANS, TARGETS};
use filters::{Estimates, Point};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeSet;
use std::fmt::Write;
use std::ops::RangeInclusive;

/// Positions measured, three modes.
pub const LINEAR: Scenario = Scenario {
    name: "jms-glmb-linear",
    about: "three manoeuvring targets in 60 clutter points, three modes; jump-Markov GLMB filters (Punchihewa et al. 2016)",
    default_runs: 100,
    filters: filters::LINEAR,
    on_request: filters::LINEAR_ON_REQUEST,
    run: |order| run(order, &LINEAR_EXAMPLE),
};
/// Azimuth and range measured, constant velocity and unknown turns.
pub const NONLINEAR: Scenario = Scenario {
    name: "jms-glmb-nonlinear",
    about: "the same seen in azimuth and range, turns of unknown rate; by sigma points, linearised, and by particles",
    default_runs: 100,
    filters: filters::NONLINEAR,
    on_request: filters::NONLINEAR_ON_REQUEST,
    run: |order| run(order, &NONLINEAR_EXAMPLE),
};

/// Estimates farther than this from a target are not its own, and no error is larger \[m\].
const CUTOFF: f64 = 1000.0;
/// Scans of the straight flight of target 1, from 1.
const STRAIGHT: RangeInclusive<usize> = 5..=30;

/// What the reference found: OSPA with its standard error, cardinality error, model accuracy, label switches, and scans with P(CV)
/// above 0.9.
type Reference = (&'static str, [f64; 5], Option<usize>);

/// One of the two.
struct Example {
    name: &'static str,
    filter: fn(&str, Precision, &Data, &mut ChaCha8Rng) -> Result<Estimates, Failure>,
    reference: &'static [Reference],
}

const LINEAR_EXAMPLE: Example = Example {
    name: "jms-glmb-linear",
    filter: |name, precision, data, rng| match precision {
        Precision::F32 => filters::linear::<f32>(name, data, rng),
        Precision::F64 => filters::linear::<f64>(name, data, rng),
    },
    reference: &[
        ("GLMB 100", [75.3, 0.7, 0.058, 0.942, 0.07], Some(0)),
        ("GLMB 5", [75.2, 0.7, 0.058, 0.942, 0.07], None),
        ("GLMB tuned", [66.9, 0.7, 0.057, 0.954, 0.08], Some(26)),
        ("CV GLMB", [635.0, 1.0, 1.71, f64::NAN, 0.08], None),
        ("GLMB paper birth", [114.6, 1.6, 0.239, 0.942, 0.35], None),
        ("GLMB r 0.002", [83.5, 0.6, 0.066, 0.941, 0.02], None),
        ("GLMB P_D 0.9", [93.1, 1.1, 0.089, 0.938, 0.08], None),
        ("GLMB 300", [75.4, 0.7, 0.058, 0.942, 0.07], None),
    ],
};

const NONLINEAR_EXAMPLE: Example = Example {
    name: "jms-glmb-nonlinear",
    filter: |name, precision, data, rng| match precision {
        Precision::F32 => filters::nonlinear::<f32>(name, data, rng),
        Precision::F64 => filters::nonlinear::<f64>(name, data, rng),
    },
    reference: &[
        ("GLMB UKF", [115.4, 0.8, 0.044, 0.916, 0.09], Some(0)),
        ("GLMB paper birth", [143.6, 1.2, 0.157, 0.916, 0.23], None),
        ("GLMB 1 deg", [349.3, 2.0, 0.056, 0.899, 0.09], None),
        ("GLMB 0.1 deg", [66.1, 0.7, 0.043, 0.932, 0.08], None),
    ],
};

/// One run: the estimates of every filter.
struct Run {
    data: Data,
    filters: Vec<Estimates>,
}

fn run(order: &Order, example: &Example) -> Result<Outcome, Failure> {
    let runs = order.repeat(example.name, |index| one_run(order, example, index))?;
    let mut outcome = Outcome::default();
    for (number, name) in order.filters.iter().enumerate() {
        let scores: Vec<Score> = runs.iter().map(|run| Score::new(&run.data, &run.filters[number].points)).collect();
        let summary = Summary::new(&scores);
        summary.describe(name, example, &runs, number, &mut outcome.notes);
        outcome.filters.push(FilterResult { name, metrics: summary.metrics });
    }
    if order.pictures {
        outcome.pictures = pictures::draw(order, example, &runs)?;
    }
    Ok(outcome)
}

fn one_run(order: &Order, example: &Example, index: u64) -> Result<Run, Failure> {
    let mut streams = monte_carlo::streams(order.seed, index);
    let data = data::draw(&mut streams);
    let filter = |name: &&'static str| (example.filter)(name, order.precision, &data, &mut streams.initial.clone());
    let filters = order.filters.iter().map(filter).collect::<Result<_, _>>()?;
    Ok(Run { data, filters })
}

/// The estimate nearest to `position`, if it is within the cut-off.
fn nearest(points: &[Point], position: [f64; 2]) -> Option<&Point> {
    let far = |point: &&Point| distance(&point.position, &position);
    points.iter().min_by(|a, b| far(a).total_cmp(&far(b))).filter(|point| far(point) < CUTOFF)
}

/// What one run of one filter is worth.
struct Score {
    /// OSPA by scan: all, localisation, cardinality
    ospa: Vec<[f64; 3]>,
    gospa: f64,
    cardinality_error: f64,
    /// Of so many estimates, so many in the right mode
    modes: [usize; 2],
    label_switches: f64,
    /// By scan of the straight flight, the probability of constant velocity of target 1
    p_cv: Vec<Option<f64>>,
}

impl Score {
    fn new(data: &Data, estimates: &[Vec<Point>]) -> Self {
        let mut score = Self { ospa: Vec::new(), gospa: 0.0, cardinality_error: 0.0, modes: [0, 0], label_switches: 0.0, p_cv: Vec::new() };
        let mut labels: [BTreeSet<u64>; TARGETS] = Default::default();
        for (k, (truth, points)) in data.truth.iter().zip(estimates).enumerate() {
            let truths: Vec<[f64; 2]> = truth.iter().map(|target| target.position).collect();
            let positions: Vec<[f64; 2]> = points.iter().map(|point| point.position).collect();
            let errors = ospa(&truths, &positions, CUTOFF, 1.0);
            score.ospa.push([errors.ospa, errors.localisation, errors.cardinality]);
            score.gospa += gospa(&truths, &positions, CUTOFF, 1.0).gospa / SCANS as f64;
            score.cardinality_error += points.len().abs_diff(truth.len()) as f64 / SCANS as f64;
            for target in truth {
                let Some(point) = nearest(points, target.position) else { continue };
                labels[target.number].insert(point.label);
                if let Some(right) = point.is_in(target.motion) {
                    score.modes[0] += 1;
                    score.modes[1] += usize::from(right);
                }
            }
            if STRAIGHT.contains(&(k + 1)) {
                let first = truth.iter().find(|target| target.number == 0).and_then(|target| nearest(points, target.position));
                score.p_cv.push(first.filter(|point| point.modes.len() > 1).map(|point| point.modes[0]));
            }
        }
        score.label_switches = labels.iter().map(|labels| labels.len().saturating_sub(1) as f64).sum();
        score
    }
}

/// The statistics of one filter over all runs.
struct Summary {
    metrics: Metrics,
    /// The standard error of OSPA
    error: Option<f64>,
}

impl Summary {
    fn new(scores: &[Score]) -> Self {
        let by_run = |of: fn(&Score) -> f64| mean(scores.iter().map(of));
        let part = |part: usize| mean(scores.iter().flat_map(|s| s.ospa.iter().map(move |scan| scan[part]))).map(|m| m.mean);
        let [estimates, right] = [0, 1].map(|i| scores.iter().map(|s| s.modes[i]).sum::<usize>() as f64);
        let p_cv = |scan: usize| mean(scores.iter().filter_map(|s| s.p_cv[scan])).map(|m| m.mean);
        let straight: Option<Vec<f64>> = (0..STRAIGHT.count()).map(p_cv).collect();
        let metrics = Metrics::from_iter([
            ("ospa", part(0)),
            ("ospa_localisation", part(1)),
            ("ospa_cardinality", part(2)),
            ("gospa", by_run(|s| s.gospa).map(|m| m.mean)),
            ("cardinality_error", by_run(|s| s.cardinality_error).map(|m| m.mean)),
            ("model_accuracy", (estimates > 0.0).then(|| right / estimates)),
            ("label_switches", by_run(|s| s.label_switches).map(|m| m.mean)),
            ("p_cv_scans_above_0_9", straight.map(|p| p.iter().filter(|p| **p > 0.9).count() as f64)),
        ]);
        let run_mean = |score: &Score| score.ospa.iter().map(|scan| scan[0]).sum::<f64>() / score.ospa.len() as f64;
        Self { metrics, error: mean(scores.iter().map(run_mean)).and_then(|m| m.standard_error) }
    }

    /// Ours with its uncertainty, then the reference's.
    fn describe(&self, name: &str, example: &Example, runs: &[Run], filter: usize, notes: &mut String) {
        let value = |metric: &str| self.metrics.get(metric).copied().flatten().unwrap_or(f64::NAN);
        let error = self.error.map_or(String::new(), |error| format!(" ± {error:.1}"));
        let truncated = runs.iter().map(|run| run.filters[filter].truncated).fold(0.0, f32::max);
        let tracks = runs.iter().map(|run| run.filters[filter].tracks).max().unwrap_or(0);
        let _ =
            writeln!(notes, "{name}: OSPA {:.1}{error} m; at most {tracks} tracks in the table, {truncated:.1e} truncated", value("ospa"));
        if let Some((_, [ospa, error, cardinality, accuracy, switches], straight)) = example.reference.iter().find(|r| r.0 == name) {
            let straight = straight.map_or(String::new(), |scans| format!(", {scans} scans with P(CV) above 0.9"));
            let _ = writeln!(
                notes,
                "    reference: OSPA {ospa} ± {error} m, cardinality error {cardinality}, model accuracy {accuracy}, label switches \
                 {switches}{straight}"
            );
        }
    }
}
