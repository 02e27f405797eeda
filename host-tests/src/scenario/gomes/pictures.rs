//! The pictures of the scenarios after Gomes, comparable with the paper's figures: mean errors of position and velocity over time,
//! association and mode probabilities, active models, and the tracks of one run.

use super::filters::RATES;
use super::{Order, Run, Tracked, curve};
use crate::Failure;
use crate::picture::{Chart, Series};
use crate::scenario::Picture;

/// All pictures of an order.
pub(super) fn draw(order: &Order, scenario: &str, runs: &[Run]) -> Result<Vec<Picture>, Failure> {
    let mut pictures = Vec::new();
    let mut add = |what: &str, chart: Chart| -> Result<(), Failure> {
        pictures.push(Picture { file: format!("{scenario}-{what}.svg"), svg: chart.render()? });
        Ok(())
    };
    add("tracks", map(order, &runs[0]))?;
    add(
        "position",
        over_time(order, runs, "Mean position error, runs neither swapped nor lost", "error [m]", |run, t, k| run.errors[t][k]),
    )?;
    add(
        "velocity",
        over_time(order, runs, "Mean velocity error, runs neither swapped nor lost", "error [m/s]", |run, t, k| run.velocity[t][k]),
    )?;
    add("active", over_time(order, runs, "Models that a track runs", "models", |run, t, k| run.tracks[t][k].active as f64))?;
    add("association", association(order, runs))?;
    for (number, name) in order.filters.iter().enumerate().filter(|(_, name)| name.ends_with("proper") || name.ends_with("fallback")) {
        let mut chart = Chart::curves(format!("Mean mode probabilities of target 2, {name}"), "time [s]", "probability");
        for (mode, rate) in RATES.iter().enumerate() {
            let points = curve(kept(runs, number), |run, _, k| run.tracks[1][k].prob[mode]);
            chart = chart.with(Series::curve(format!("{rate} rad/s"), points).coloured(mode));
        }
        add(&format!("modes-{}", name.to_lowercase().replace(' ', "-")), chart)?;
    }
    Ok(pictures)
}

/// The runs in which a filter neither swapped nor lost.
fn kept(runs: &[Run], number: usize) -> impl Iterator<Item = &Tracked> + Clone {
    runs.iter().map(move |run| &run.filters[number]).filter(|tracked| !tracked.lost())
}

fn over_time(order: &Order, runs: &[Run], title: &str, label: &str, value: impl Fn(&Tracked, usize, usize) -> f64 + Copy) -> Chart {
    order.filters.iter().enumerate().fold(Chart::curves(title, "time [s]", label), |chart, (number, name)| {
        chart.with(Series::curve(*name, curve(kept(runs, number), value)).coloured(number))
    })
}

/// As the paper's figure 1: how probable it is that the plot of target 1 is that of track 1, and of track 2.
fn association(order: &Order, runs: &[Run]) -> Chart {
    let title = "Mean association probability of the plot of target 1: with its track, and with the other";
    let joint = order.filters.iter().enumerate().filter(|(_, name)| name.contains("JPDAF"));
    joint.fold(Chart::curves(title, "time [s]", "probability"), |chart, (number, name)| {
        let all = || runs.iter().map(|run| &run.filters[number]);
        let with = |track: usize| curve(all(), move |run, _, k| run.tracks[track][k].beta[0]);
        chart.with(Series::curve(*name, with(0)).coloured(number)).with(Series::curve(*name, with(1)).coloured(number))
    })
}

fn map(order: &Order, run: &Run) -> Chart {
    let (number, name) = (order.filters.len() - 1, order.filters[order.filters.len() - 1]);
    let plots = run.data.plots.iter().flatten().map(|[range, azimuth]| [range * azimuth.cos(), range * azimuth.sin()]).collect();
    let mut chart = Chart::map(format!("{name}, run 0"), "x [m]", "y [m]").with(Series::clutter("plots", plots));
    for truth in &run.data.truth {
        chart = chart.with(Series::truth("truth", truth.iter().map(|[x, _, y, _]| [*x, *y]).collect()));
    }
    for (target, points) in run.filters[number].tracks.iter().enumerate() {
        let points = points.iter().map(|p| [p.state[0], p.state[2]]).collect();
        chart = chart.with(Series::track(format!("track {}", target + 1), points).coloured(target));
    }
    chart
}
