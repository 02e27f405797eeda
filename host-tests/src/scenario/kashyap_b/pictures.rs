//! The pictures of scenario `kashyap-b`, comparable with the paper's figures 6 and 7: the measurements of both sensors, the fused
//! tracks, the mode probabilities of all of them, and the position error by filter.

use super::data::{SENSORS, TARGETS};
use super::{Order, Run, SCANS, SCENARIO, SETTLED, distance};
use crate::Failure;
use crate::picture::{Chart, Series};
use crate::scenario::Picture;
use crate::statistics::{mean, rms};
use std::collections::BTreeMap;

/// All pictures of an order.
pub(super) fn draw(order: &Order, runs: &[Run]) -> Result<Vec<Picture>, Failure> {
    let mut pictures = Vec::new();
    let mut add = |what: &str, chart: Chart| -> Result<(), Failure> {
        pictures.push(Picture { file: format!("{}-{what}.svg", SCENARIO.name), svg: chart.render()? });
        Ok(())
    };
    add("measurements", measurements(&runs[0]))?;
    for (number, name) in order.filters.iter().enumerate() {
        let slug = name.replace(' ', "-").to_lowercase();
        add(&format!("tracks-{slug}"), map(&runs[0], number, name))?;
        add(&format!("manoeuvre-probability-{slug}"), probabilities(runs, number, name))?;
    }
    let mut chart = Chart::curves("Position error of target 1", "time [s]", "rms [m]").log_y();
    for (number, name) in order.filters.iter().enumerate() {
        let at = |k: usize| rms(runs.iter().flat_map(|run| run.filters[number].over(&run.data, 0, k..k + 1, distance)));
        let points = (SETTLED..SCANS).map(|k| [k as f64, at(k).unwrap_or(f64::NAN)]).collect();
        chart = chart.with(Series::curve(*name, points).coloured(number));
    }
    add("rms", chart)?;
    Ok(pictures)
}

fn truth(run: &Run, target: usize) -> Series {
    Series::truth("truth", run.data.truth[target].iter().map(|[x, _, y, _]| [*x, *y]).collect())
}

/// The plots of both sensors in the common frame.
fn measurements(run: &Run) -> Chart {
    let mut chart = Chart::map("Measurements of both sensors, run 0", "x [m]", "y [m]");
    for (sensor, [sx, sy]) in SENSORS.into_iter().enumerate() {
        let plots = run.data.plots[sensor].iter().flatten().map(|p| [p[0] + sx, p[1] + sy]).collect();
        chart = chart.with(Series::clutter(format!("sensor {}", sensor + 1), plots).coloured(sensor));
    }
    (0..TARGETS).fold(chart, |chart, target| chart.with(truth(run, target)))
}

/// Every track of run 0 by its identity.
fn map(run: &Run, filter: usize, name: &str) -> Chart {
    let mut tracks: BTreeMap<u32, Vec<[f64; 2]>> = BTreeMap::new();
    for point in run.filters[filter].tracks.iter().flatten() {
        tracks.entry(point.id).or_default().push([point.state[0], point.state[2]]);
    }
    let chart = (0..TARGETS).fold(Chart::map(format!("{name}, run 0"), "x [m]", "y [m]"), |chart, target| chart.with(truth(run, target)));
    tracks.into_iter().fold(chart, |chart, (id, points)| chart.with(Series::track(format!("track {id}"), points)))
}

/// The mean over all runs of the probability of the second mode, by target.
fn probabilities(runs: &[Run], filter: usize, name: &str) -> Chart {
    let mut chart = Chart::curves(format!("Mean probability of the manoeuvre mode, {name}"), "time [s]", "probability");
    for target in 0..TARGETS {
        let at = |k: usize| mean(runs.iter().flat_map(|run| run.filters[filter].over(&run.data, target, k..k + 1, |p, _| p.p_manoeuvre)));
        let points = (0..SCANS).map(|k| [k as f64, at(k).map_or(f64::NAN, |m| m.mean)]).collect();
        chart = chart.with(Series::curve(format!("target {}", target + 1), points).coloured(target));
    }
    chart
}
