//! The pictures of the scenario after Jeong and Tugnait, comparable with the paper's figures: the paths, errors over time, mode
//! probabilities, and what the filters believe of the targets' resolution.

use super::data::{SCANS, TARGETS};
use super::filters::MODES;
use super::{End, Order, Run, SCENARIO, Tracked, rms_curve};
use crate::Failure;
use crate::picture::{Chart, Series};
use crate::scenario::Picture;
use crate::statistics::mean;

/// All pictures of an order.
pub(super) fn draw(order: &Order, runs: &[Run]) -> Result<Vec<Picture>, Failure> {
    let mut pictures = Vec::new();
    let mut add = |what: &str, chart: Chart| -> Result<(), Failure> {
        pictures.push(Picture { file: format!("{}-{what}.svg", SCENARIO.name), svg: chart.render()? });
        Ok(())
    };
    // The first two show what the others are compared by.
    for (number, name) in order.filters.iter().enumerate().take(2) {
        let file = name.to_lowercase().replace(' ', "-");
        for (what, scans) in [("paths", 0..=SCANS), ("crossing", 30..=56)] {
            let mut chart = Chart::map(format!("Truth, and tracks of {name} in run 0"), "x [m]", "y [m]");
            for truth in &runs[0].data.truth {
                chart = chart.with(Series::truth("truth", truth[scans.clone()].iter().map(|[x, y, _]| [*x, *y]).collect()));
            }
            for (target, points) in runs[0].filters[number].tracks.iter().enumerate() {
                let points = (1..=SCANS).zip(points).filter(|(k, _)| scans.contains(k)).map(|(_, p)| [p.position[0], p.position[1]]);
                chart = chart.with(Series::track(format!("track {}", target + 1), points.collect()).coloured(target));
            }
            add(&format!("{what}-{file}"), chart)?;
        }
    }
    for target in 0..TARGETS {
        let title = format!("Rms position error of target {}, runs that are ok without excursions", target + 1);
        let chart = Chart::curves(title, "time [s]", "rms [m]").log_y();
        let chart = order.filters.iter().enumerate().fold(chart, |chart, (number, name)| {
            let clean = runs.iter().map(move |run| &run.filters[number]).filter(|tracked| tracked.is_clean());
            chart.with(Series::curve(*name, rms_curve(clean, target)).coloured(number))
        });
        add(&format!("error-t{}", target + 1), chart)?;
    }
    for (number, name) in order.filters.iter().enumerate().filter(|(_, name)| name.contains("CF")) {
        let file = name.to_lowercase().replace(' ', "-");
        let ok = || runs.iter().map(move |run| &run.filters[number]).filter(|tracked| tracked.end == End::Ok);
        for target in 0..TARGETS {
            let title = format!("Mean mode probabilities of target {}, {name}", target + 1);
            let chart = (0..MODES).fold(Chart::curves(title, "time [s]", "probability"), |chart, mode| {
                let points = curve(ok(), |run, k| run.tracks[target][k].prob[mode]);
                chart.with(Series::curve(["constant velocity", "slow acceleration", "fast acceleration"][mode], points).coloured(mode))
            });
            add(&format!("modes-{file}-t{}", target + 1), chart)?;
        }
        if name.starts_with("MCF") {
            let chart = Chart::curves(
                format!("Both targets as one: share of the scans, and mean probability by {name}"),
                "time [s]",
                "probability",
            );
            let chart = ["radar", "infrared"].iter().enumerate().fold(chart, |chart, (sensor, which)| {
                let truth = (0..SCANS).map(|k| {
                    let share = mean(runs.iter().map(|run| f64::from(u8::from(run.data.merged[sensor][k]))));
                    [k as f64 + 1.0, share.map_or(f64::NAN, |m| m.mean)]
                });
                let believed = curve(ok(), |run, k| run.tracks[0][k].unresolved[sensor]);
                let chart = chart.with(Series::reference(format!("{which}, in truth"), truth.collect()).coloured(sensor));
                chart.with(Series::curve(*which, believed).coloured(sensor))
            });
            add(&format!("unresolved-{file}"), chart)?;
        }
    }
    Ok(pictures)
}

/// The mean over runs of what `value` gives, at scans 1..=87.
fn curve<'a>(runs: impl Iterator<Item = &'a Tracked> + Clone, value: impl Fn(&'a Tracked, usize) -> f64) -> Vec<[f64; 2]> {
    let at = |k: usize| mean(runs.clone().map(|run| value(run, k))).map_or(f64::NAN, |m| m.mean);
    (0..SCANS).map(|k| [k as f64 + 1.0, at(k)]).collect()
}
