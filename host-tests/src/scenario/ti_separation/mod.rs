//! Scenario `ti-separation`: whether two objects that differ by 4 m, or 4°, or 4 m/s are two tracks, with and without the model of
//! merged measurements.
//!
//! ```text
//! separated   the two tracks that followed the objects before they closed up are alive, and in every frame of the last second one
//!             is within half of the objects' distance, and within 2 m, of either object
//! ```
//!
//! Where one object overtakes the other, each track must be on its own. Where they close up to one cell and stay, either may be on
//! either: whether two objects turned back or passed while they were one plot is not what the criterion asks. How many runs end
//! exchanged is told.
//!
//! The criterion is Texas Instruments' for its people-and-vehicle radars: separated in more than 95 % of the runs. What a run holds
//! stands in `data.rs`.

mod data;
mod filters;

use super::{FilterResult, Metrics, Order, Outcome, Picture, Scenario};
use crate::picture::{Chart, Series};
use crate::statistics::wilson;
use crate::{Failure, monte_carlo};
use data::{Case, Data, FRAME_MS, FRAMES};
use filters::Frame;
use std::fmt::Write;

/// The scenario.
pub const SCENARIO: Scenario = Scenario {
    name: "ti-separation",
    about: "two objects 4 m, 4 degrees or 4 m/s apart before a short-range radar, with and without merged measurements",
    default_runs: 500,
    filters: filters::NAMES,
    on_request: &[],
    run,
};

const CASES: [(Case, &str, &str); 3] = [
    (Case::Range, "separated_fraction_range", "4 m"),
    (Case::Azimuth, "separated_fraction_azimuth", "4 degrees"),
    (Case::Speed, "separated_fraction_speed", "4 m/s"),
];
/// The frame by which tracks are told whose they are, and from which on they are judged: counted from 1.
const NAMED: usize = 20;
const JUDGED: usize = FRAMES - 9;
/// No error beyond this is a track of the object \[m\].
const NEAR: f64 = 2.0;

/// One case of one run: its data and the tracks of every filter.
type Tracked = (Data, Vec<Vec<Frame>>);

fn run(order: &Order) -> Result<Outcome, Failure> {
    let runs = order.repeat(SCENARIO.name, |index| one_run(order, index))?;
    let mut outcome = Outcome::default();
    for (number, name) in order.filters.iter().enumerate() {
        let mut metrics = Metrics::new();
        for (case, (_, metric, what)) in CASES.iter().enumerate() {
            let count = |wanted: End| runs.iter().filter(|run| end(&run[case].0, &run[case].1[number]) == wanted).count();
            let (home, exchanged) = (count(End::Home), count(End::Exchanged));
            let separated = if CASES[case].0 == Case::Speed { home } else { home + exchanged };
            let share = wilson(separated, runs.len());
            metrics.insert(metric, share.map(|share| share.fraction));
            if let Some(share) = share {
                let [lower, upper] = [share.lower, share.upper].map(|v| 100.0 * v);
                let _ = writeln!(
                    outcome.notes,
                    "{name}: {separated} of {} separated at {what} ({lower:.1}-{upper:.1} %), {exchanged} exchanged",
                    runs.len()
                );
            }
        }
        outcome.filters.push(FilterResult { name, metrics });
    }
    outcome.notes.push_str("criterion: more than 95 %\n");
    if order.pictures {
        outcome.pictures = pictures(order, &runs[0])?;
    }
    Ok(outcome)
}

fn one_run(order: &Order, index: u64) -> Result<[Tracked; 3], Failure> {
    let mut streams = monte_carlo::streams(order.seed, index);
    let mut tracked = |case: Case| -> Result<Tracked, Failure> {
        let data = data::draw(case, &mut streams);
        let tracks = order.filter(&data, [filters::run::<f32>, filters::run::<f64>])?;
        Ok((data, tracks))
    };
    Ok([tracked(Case::Range)?, tracked(Case::Azimuth)?, tracked(Case::Speed)?])
}

fn distance(a: &[f64; 2], b: &[f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Where the tracks are in the last second that followed the objects before.
#[derive(Clone, Copy, PartialEq, Eq)]
enum End {
    Home,
    Exchanged,
    Lost,
}

fn end(data: &Data, frames: &[Frame]) -> End {
    let nearest = |object: usize| {
        let off = |position: &[f64; 2]| distance(position, &data.truth[NAMED - 1][object]);
        let near = frames[NAMED - 1].iter().filter(|(_, position)| off(position) < NEAR);
        near.min_by(|a, b| off(&a.1).total_cmp(&off(&b.1))).map(|(id, _)| *id)
    };
    let Some((first, second)) = nearest(0).zip(nearest(1)) else { return End::Lost };
    let on = |k: usize, id: u32, object: usize| {
        let limit = NEAR.min(0.5 * distance(&data.truth[k][0], &data.truth[k][1]));
        frames[k].iter().any(|(of, position)| *of == id && distance(position, &data.truth[k][object]) < limit)
    };
    let all = |objects: [usize; 2]| (JUDGED - 1..FRAMES).all(|k| on(k, first, objects[0]) && on(k, second, objects[1]));
    match (first != second && all([0, 1]), first != second && all([1, 0])) {
        (true, _) => End::Home,
        (_, true) => End::Exchanged,
        _ => End::Lost,
    }
}

/// Tracks of run 0 over time: range in the cases of range and speed, azimuth in the other.
fn pictures(order: &Order, run: &[Tracked; 3]) -> Result<Vec<Picture>, Failure> {
    let mut pictures = Vec::new();
    for ((case, metric, what), (data, tracks)) in CASES.iter().zip(run) {
        let (label, value): (_, fn(&[f64; 2]) -> f64) = match case {
            Case::Azimuth => ("azimuth [degrees]", |[x, y]| y.atan2(*x).to_degrees()),
            _ => ("range [m]", |[x, y]| x.hypot(*y)),
        };
        let time = |k: usize| 0.001 * (FRAME_MS * (k as u64 + 1)) as f64;
        for (name, frames) in order.filters.iter().zip(tracks) {
            let seen = data.plots.iter().enumerate().flat_map(|(k, plots)| {
                plots.iter().map(move |plot| [time(k), if *case == Case::Azimuth { plot[1].to_degrees() } else { plot[0] }])
            });
            let mut chart = Chart::curves(format!("Two objects {what} apart, {name}, run 0"), "time [s]", label)
                .with(Series::clutter("plots", seen.collect()));
            for object in 0..2 {
                let truth = data.truth.iter().enumerate().map(|(k, truth)| [time(k), value(&truth[object])]);
                chart = chart.with(Series::truth("truth", truth.collect()));
            }
            let mut ids: Vec<u32> = frames.iter().flatten().map(|(id, _)| *id).collect();
            ids.sort_unstable();
            ids.dedup();
            for (colour, id) in ids.iter().enumerate() {
                let own = frames
                    .iter()
                    .enumerate()
                    .flat_map(|(k, frame)| frame.iter().filter(|(of, _)| of == id).map(move |(_, p)| [time(k), value(p)]));
                chart = chart.with(Series::curve(format!("track {id}"), own.collect()).coloured(colour));
            }
            let (case, filter) = (metric.trim_start_matches("separated_fraction_"), name.to_lowercase().replace(' ', "-"));
            pictures.push(Picture { file: format!("{}-{case}-{filter}.svg", SCENARIO.name), svg: chart.render()? });
        }
    }
    Ok(pictures)
}
