//! The pictures of scenario `kashyap-a`, comparable with the paper's figures 3 to 5: tracks among plots, x over time,
//! probability of the manoeuvre modes, standard deviation of x, and the rms error of all filters.

use super::data::{SIGMA, TARGETS};
use super::filters::Point;
use super::{FIRST, Order, RmsCurve, Run, SCANS, SCENARIO};
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
    add("tracks", map(order, &runs[0]))?;
    add("x", x_over_time(order, &runs[0]))?;
    add(
        "manoeuvre-probability",
        over_time(order, runs, "Mean probability of the manoeuvre modes, target 1", "probability", |p| p.p_manoeuvre),
    )?;
    add("sigma-x", over_time(order, runs, "Mean standard deviation of x, target 1", "sigma x [m]", |p| p.sigma_x))?;
    let mut chart = Chart::curves("Position error of the tracks not lost", "time [s]", "rms [m]").log_y();
    for (number, name) in order.filters.iter().enumerate() {
        let mut curve = RmsCurve::default();
        for run in runs {
            let tracked = &run.filters[number];
            (0..TARGETS).filter(|t| !tracked.lost(*t)).for_each(|t| curve.add(&tracked.errors[t]));
        }
        chart = chart.with(Series::curve(*name, curve.points()).coloured(number));
    }
    add("rms", chart.with(Series::level("measurement error", SIGMA * 2f64.sqrt())))?;
    Ok(pictures)
}

/// The best filter there is: the last of the order.
fn best(order: &Order) -> (usize, &'static str) {
    (order.filters.len() - 1, order.filters[order.filters.len() - 1])
}

fn map(order: &Order, run: &Run) -> Chart {
    let (number, name) = best(order);
    let mut chart = Chart::map(format!("{name}, run 0"), "x [m]", "y [m]");
    chart = chart.with(Series::clutter("plots", run.data.plots.iter().flatten().copied().collect()));
    for truth in &run.data.truth {
        chart = chart.with(Series::truth("truth", truth.clone()));
    }
    for (target, track) in run.filters[number].tracks.iter().enumerate() {
        let points = track.iter().map(|p| p.position).collect();
        chart = chart.with(Series::track(format!("track {}", target + 1), points).coloured(target));
    }
    chart
}

/// As the paper's figures 4 and 5: x of plots, truth and estimates.
fn x_over_time(order: &Order, run: &Run) -> Chart {
    let (number, name) = best(order);
    let plots = run.data.plots.iter().enumerate().flat_map(|(k, plots)| plots.iter().map(move |p| [k as f64, p[0]])).collect();
    let mut chart = Chart::curves(format!("x in clutter, {name}, run 0"), "time [s]", "x [m]").with(Series::clutter("plots", plots));
    let over_time = |from: usize, x: &mut dyn Iterator<Item = f64>| (from..).zip(x).map(|(k, x)| [k as f64, x]).collect::<Vec<_>>();
    for (target, track) in run.filters[number].tracks.iter().enumerate() {
        let truth = over_time(0, &mut run.data.truth[target].iter().map(|p| p[0]));
        let estimate = over_time(FIRST, &mut track.iter().map(|p| p.position[0]));
        chart = chart.with(Series::truth("truth", truth)).with(Series::curve(format!("track {}", target + 1), estimate).coloured(target));
    }
    chart
}

/// The mean over the runs in which target 1 is not lost.
fn over_time(order: &Order, runs: &[Run], title: &str, label: &str, value: impl Fn(&Point) -> f64) -> Chart {
    let mut chart = Chart::curves(title, "time [s]", label);
    for (number, name) in order.filters.iter().enumerate().filter(|(_, name)| name.starts_with("IMM")) {
        let kept = || runs.iter().map(|run| &run.filters[number]).filter(|tracked| !tracked.lost(0));
        let at = |i: usize| mean(kept().map(|tracked| value(&tracked.tracks[0][i]))).map_or(f64::NAN, |m| m.mean);
        let points = (0..SCANS - FIRST).map(|i| [(i + FIRST) as f64, at(i)]).collect();
        chart = chart.with(Series::curve(*name, points).coloured(number));
    }
    chart
}
