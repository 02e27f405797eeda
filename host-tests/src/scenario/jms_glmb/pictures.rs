//! The pictures of both examples, comparable with the paper's figures: plots and tracks coloured by mode, the mode probabilities of
//! target 1, and OSPA and the number of targets over time.

use super::data::{SCANS, STEP_MS, Sensor};
use super::filters::Point;
use super::{CUTOFF, Example, Order, Run, Score, nearest};
use crate::Failure;
use crate::picture::{Chart, Series};
use crate::scenario::Picture;
use crate::statistics::mean;

/// All pictures of an order.
pub(super) fn draw(order: &Order, example: &Example, runs: &[Run]) -> Result<Vec<Picture>, Failure> {
    let mut pictures = Vec::new();
    let mut add = |what: &str, chart: Chart| -> Result<(), Failure> {
        pictures.push(Picture { file: format!("{}-{what}.svg", example.name), svg: chart.render()? });
        Ok(())
    };
    for (number, name) in order.filters.iter().enumerate() {
        let slug = name.replace(' ', "-").to_lowercase();
        add(&format!("tracks-{slug}"), map(&runs[0], number, name))?;
        if let Some(chart) = modes(runs, number, name) {
            add(&format!("modes-{slug}"), chart)?;
        }
    }
    add("ospa", ospa(order, runs))?;
    add("cardinality", cardinality(order, runs))?;
    Ok(pictures)
}

/// The end of scan `k`, from 0 \[s\].
fn time(k: usize) -> f64 {
    (k + 1) as f64 * STEP_MS as f64 / 1000.0
}

/// What the modes are called: of three two turns, of two one.
fn mode_name(modes: usize, mode: usize) -> &'static str {
    match (modes, mode) {
        (_, 0) => "constant velocity",
        (2, _) => "turn",
        (_, 1) => "right turn",
        _ => "left turn",
    }
}

/// Truth, plots and all estimates of run 0, every estimate in the colour of its most probable mode.
fn map(run: &Run, filter: usize, name: &str) -> Chart {
    let plots = run.data.plots(Sensor::Position(0.0), 1.0).concat();
    let mut chart = Chart::map(format!("{name}, run 0: tracks by mode"), "x [m]", "y [m]").with(Series::clutter("plots", plots));
    for target in 0..super::TARGETS {
        let path = run.data.truth.iter().flatten().filter(|t| t.number == target).map(|t| t.position).collect();
        chart = chart.with(Series::truth("truth", path));
    }
    let points = || run.filters[filter].points.iter().flatten();
    let likely = |point: &Point| (0..point.modes.len()).max_by(|a, b| point.modes[*a].total_cmp(&point.modes[*b]));
    let count = points().map(|point| point.modes.len()).max().unwrap_or(0);
    (0..count).fold(chart, |chart, mode| {
        // Gaps between the points: only their colour tells.
        let of_mode = points().filter(|point| likely(point) == Some(mode)).flat_map(|point| [point.position, [f64::NAN; 2]]).collect();
        chart.with(Series::track(mode_name(count, mode), of_mode).coloured(mode))
    })
}

/// The mean over all runs of the mode probabilities of target 1; none of a filter with one mode.
fn modes(runs: &[Run], filter: usize, name: &str) -> Option<Chart> {
    let of = |run: &Run, k: usize| -> Option<Vec<f64>> {
        let target = run.data.truth[k].iter().find(|target| target.number == 0)?;
        Some(nearest(&run.filters[filter].points[k], target.position)?.modes.clone())
    };
    let count = runs.iter().flat_map(|run| (0..SCANS).filter_map(move |k| of(run, k))).map(|modes| modes.len()).max()?;
    let mean_of = |mode: usize, k: usize| mean(runs.iter().filter_map(|run| of(run, k)?.get(mode).copied()));
    (count > 1).then(|| {
        let chart = Chart::curves(format!("{name}: mean mode probabilities of target 1"), "time [s]", "probability");
        (0..count).fold(chart.with(Series::level("0.9", 0.9)), |chart, mode| {
            let points = (0..SCANS).map(|k| [time(k), mean_of(mode, k).map_or(f64::NAN, |m| m.mean)]).collect();
            chart.with(Series::curve(mode_name(count, mode), points).coloured(mode))
        })
    })
}

fn ospa(order: &Order, runs: &[Run]) -> Chart {
    let chart = Chart::curves(format!("Mean OSPA, cut-off {CUTOFF} m, order 1"), "time [s]", "OSPA [m]");
    order.filters.iter().enumerate().fold(chart, |chart, (number, name)| {
        let scores: Vec<Score> = runs.iter().map(|run| Score::new(&run.data, &run.filters[number].points)).collect();
        let at = |k: usize| mean(scores.iter().map(|score| score.ospa[k][0])).map_or(f64::NAN, |m| m.mean);
        chart.with(Series::curve(*name, (0..SCANS).map(|k| [time(k), at(k)]).collect()).coloured(number))
    })
}

fn cardinality(order: &Order, runs: &[Run]) -> Chart {
    let truth = (0..SCANS).map(|k| [time(k), runs[0].data.truth[k].len() as f64]).collect();
    let chart = Chart::curves("Mean number of targets", "time [s]", "targets").with(Series::truth("truth", truth));
    order.filters.iter().enumerate().fold(chart, |chart, (number, name)| {
        let at = |k: usize| mean(runs.iter().map(|run| run.filters[number].points[k].len() as f64)).map_or(f64::NAN, |m| m.mean);
        chart.with(Series::curve(*name, (0..SCANS).map(|k| [time(k), at(k)]).collect()).coloured(number))
    })
}
