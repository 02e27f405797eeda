//! The published scenarios: a table of names, and what every one of them takes and gives.
//!
//! A scenario is a module `scenario/NAME` with a [`Scenario`] constant; it registers by its entry in
//! [`SCENARIOS`]. Its `run` receives an [`Order`] (runs, seed, precision, chosen filters) and returns an
//! [`Outcome`]: metrics of each filter, in the order of the table, and pictures comparable with the
//! paper's figures. This file does the rest: choosing filters by name, the result file, the table on
//! stdout.
//!
//! Result file: `{"scenario", "runs", "seed", "precision", "filters": [{"name", "metrics": {..}}]}`;
//! metrics are numbers in SI units, or null where they are not defined.

mod draw;
pub(crate) mod filter;
pub(crate) mod gomes;
pub(crate) mod jeong_tugnait;
pub(crate) mod jms_glmb;
pub(crate) mod kashyap;
mod kashyap_b;
mod ti_separation;

use crate::{Failure, Precision, output};
use indexmap::IndexMap;
use serde::Serialize;
use std::fmt::Write;
use std::path::PathBuf;

/// Every scenario that `list` shows and `run` knows.
pub static SCENARIOS: &[Scenario] = &[
    kashyap::SCENARIO,
    kashyap_b::SCENARIO,
    gomes::MAIN,
    gomes::WIDE,
    gomes::SUDDEN,
    jeong_tugnait::SCENARIO,
    ti_separation::SCENARIO,
    jms_glmb::LINEAR,
    jms_glmb::NONLINEAR,
];

/// A scenario as the table holds it.
#[derive(Debug, Clone, Copy)]
pub struct Scenario {
    /// The name on the command line.
    pub name: &'static str,
    /// One line: what it shows, and the paper.
    pub about: &'static str,
    /// Runs when `--runs` does not say otherwise.
    pub default_runs: u64,
    /// The filters that run by default, in the order of the results.
    pub filters: &'static [&'static str],
    /// Further filters, which run only when named; they follow the others in the results.
    pub on_request: &'static [&'static str],
    /// Runs the chosen filters, all on the same data.
    pub run: fn(&Order) -> Result<Outcome, Failure>,
}

/// What to run.
#[derive(Debug, Clone, PartialEq)]
pub struct Order {
    /// Number of Monte Carlo runs, at least 1.
    pub runs: u64,
    /// Base seed: run i uses `seed` + i, see [`crate::monte_carlo::streams`].
    pub seed: u64,
    /// Scalar type of the filters.
    pub precision: Precision,
    /// The chosen filters, a non-empty part of the scenario's, in its order.
    pub filters: Vec<&'static str>,
    /// Whether somebody will look at the pictures; if not, they need not be drawn.
    pub pictures: bool,
}

/// The metrics of a filter by name, in order; `None` where a metric is not defined.
pub type Metrics = IndexMap<&'static str, Option<f64>>;

/// The result of one filter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FilterResult {
    /// The filter's name in the table.
    pub name: &'static str,
    /// Its metrics.
    pub metrics: Metrics,
}

/// A picture to be written beside the result file.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// File name: scenario, what it shows, ending, e.g. `kashyap-a-rms.svg`.
    pub file: String,
    /// The SVG text, see [`crate::picture`].
    pub svg: String,
}

/// What a scenario gives back.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Outcome {
    /// One result per chosen filter, in the order of [`Order::filters`].
    pub filters: Vec<FilterResult>,
    /// The pictures, if [`Order::pictures`] asked for them.
    pub pictures: Vec<Picture>,
    /// What is printed below the table: uncertainties, the reference's and the paper's figures.
    pub notes: String,
}

/// The command `run` as the user gave it.
#[derive(Debug, Clone)]
pub struct Request {
    /// Name of the scenario.
    pub scenario: String,
    /// Number of runs, if given.
    pub runs: Option<u64>,
    /// Base seed.
    pub seed: u64,
    /// Comma-separated filter names, if given.
    pub filters: Option<String>,
    /// Scalar type of the filters.
    pub precision: Precision,
    /// Directory for pictures and the result file, if given; created when missing.
    pub out: Option<PathBuf>,
    /// The result file, if given.
    pub json: Option<PathBuf>,
}

#[derive(Serialize)]
struct Report<'a> {
    scenario: &'a str,
    runs: u64,
    seed: u64,
    precision: Precision,
    filters: &'a [FilterResult],
}

/// The command `list`: every scenario with its filters, in the order in which they run.
pub fn list(registry: &[Scenario]) -> Result<(), Failure> {
    let mut text = String::new();
    for scenario in registry {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{}  {} ({} runs)", scenario.name, scenario.about, scenario.default_runs);
        for filter in scenario.filters {
            let _ = writeln!(text, "    {filter}");
        }
        for filter in scenario.on_request {
            let _ = writeln!(text, "    {filter} (by name only)");
        }
    }
    output::print(&text)
}

/// The command `run`: every complaint about the request comes before the first run.
pub fn run(registry: &[Scenario], request: &Request) -> Result<(), Failure> {
    let names = registry.iter().map(|scenario| scenario.name);
    let scenario = registry
        .iter()
        .find(|scenario| scenario.name == request.scenario)
        .ok_or_else(|| Failure::unknown("scenario", &request.scenario, names))?;
    let order = Order {
        runs: request.runs.unwrap_or(scenario.default_runs),
        seed: request.seed,
        precision: request.precision,
        filters: choose(scenario, request.filters.as_deref())?,
        pictures: request.out.is_some(),
    };
    if let Some(file) = &request.json {
        output::check_target(file)?;
    }
    if let Some(dir) = &request.out {
        output::create_directory(dir)?;
    }

    let outcome = (scenario.run)(&order).map_err(|failure| failure.within(scenario.name))?;
    let report =
        Report { scenario: scenario.name, runs: order.runs, seed: order.seed, precision: order.precision, filters: &outcome.filters };
    if let Some(dir) = &request.out {
        for picture in &outcome.pictures {
            output::write_file(&dir.join(&picture.file), picture.svg.as_bytes())?;
        }
        output::write_json(&dir.join(scenario.name).with_extension("json"), &report)?;
    }
    if let Some(file) = &request.json {
        output::write_json(file, &report)?;
    }
    output::print(&format!("{}\n{}", table(&report), outcome.notes))
}

/// The filters named in a comma-separated list, or all default ones, in the scenario's order.
fn choose(scenario: &Scenario, names: Option<&str>) -> Result<Vec<&'static str>, Failure> {
    let Some(names) = names else { return Ok(scenario.filters.to_vec()) };
    let known = || scenario.filters.iter().chain(scenario.on_request).copied();
    let wanted: Vec<_> = names.split(',').map(str::trim).collect();
    match wanted.iter().find(|name| !known().any(|filter| filter == **name)) {
        Some(stranger) => Err(Failure::unknown("filter", stranger, known()).within("--filters")),
        None => Ok(known().filter(|filter| wanted.contains(filter)).collect()),
    }
}

/// The results as a table: a line per filter, a column per metric, `-` where not defined.
fn table(report: &Report<'_>) -> String {
    let header = report.filters.first().map_or_else(Vec::new, |filter| filter.metrics.keys().map(|name| (*name).to_owned()).collect());
    let rows = report.filters.iter().map(|filter| {
        let cells = filter.metrics.values().map(|value| value.map_or("-".to_owned(), short)).collect();
        (filter.name.to_owned(), cells)
    });
    let lines: Vec<(String, Vec<String>)> = std::iter::once((String::new(), header)).chain(rows).collect();
    let name_width = lines.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    let width = |column: usize| lines.iter().filter_map(|(_, cells)| cells.get(column)).map(String::len).max().unwrap_or(0);

    let Report { scenario, runs, seed, precision, .. } = report;
    let mut text = format!("{scenario}: {runs} runs, base seed {seed}, {precision}\n");
    for (name, cells) in &lines {
        let _ = write!(text, "{name:name_width$}");
        for (column, cell) in cells.iter().enumerate() {
            let _ = write!(text, "  {cell:>width$}", width = width(column));
        }
        text.push('\n');
    }
    text
}

/// A number for the eye: counts in full, the rest with four significant digits.
fn short(value: f64) -> String {
    if value == value.trunc() && value.abs() < 1e9 {
        return format!("{value:.0}");
    }
    let digits_before_point = value.abs().log10().floor() as i32 + 1;
    match digits_before_point {
        -3..=9 => format!("{value:.*}", (4 - digits_before_point).max(0) as usize),
        _ => format!("{value:.3e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn echo(order: &Order) -> Result<Outcome, Failure> {
        let metrics = |i: usize| Metrics::from_iter([("lost", Some(i as f64)), ("peak", None)]);
        Ok(Outcome {
            filters: order.filters.iter().enumerate().map(|(i, name)| FilterResult { name, metrics: metrics(i) }).collect(),
            pictures: vec![Picture { file: "toy-map.svg".into(), svg: "<svg/>".into() }],
            notes: String::new(),
        })
    }

    const TOY: Scenario = Scenario {
        name: "toy",
        about: "a scenario that only counts its filters",
        default_runs: 3,
        filters: &["NN", "PDAF"],
        on_request: &["stress"],
        run: echo,
    };

    fn request(filters: Option<&str>) -> Request {
        Request {
            scenario: "toy".into(),
            runs: None,
            seed: 7,
            filters: filters.map(str::to_owned),
            precision: Precision::F32,
            out: None,
            json: None,
        }
    }

    #[test]
    fn filters_come_in_the_order_of_the_table() {
        assert_eq!(choose(&TOY, None), Ok(vec!["NN", "PDAF"]));
        assert_eq!(choose(&TOY, Some("stress, NN,NN")), Ok(vec!["NN", "stress"]));
    }

    #[test]
    fn strangers_are_refused_with_the_list_of_the_known() {
        let failure = choose(&TOY, Some("NN,KF")).err().map(|f| f.to_string());
        let expected = "--filters: unknown filter \"KF\"; known: NN, PDAF, stress";
        assert_eq!(failure.as_deref(), Some(expected));
        let lost = Request { scenario: "toys".into(), ..request(None) };
        assert!(run(&[TOY], &lost).is_err_and(|f| f.to_string().ends_with("known: toy")));
    }

    #[test]
    fn result_file_has_the_documented_form() -> Result<(), Box<dyn std::error::Error>> {
        let dir = tempfile::tempdir()?;
        let (out, json) = (dir.path().join("deep/out"), dir.path().join("result.json"));
        run(&[TOY], &Request { out: Some(out.clone()), json: Some(json.clone()), ..request(Some("PDAF")) })?;
        let value: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(json)?)?;
        assert_eq!(
            value,
            serde_json::json!({
                "scenario": "toy", "runs": 3, "seed": 7, "precision": "f32",
                "filters": [{"name": "PDAF", "metrics": {"lost": 0.0, "peak": null}}],
            })
        );
        assert_eq!(std::fs::read_to_string(out.join("toy-map.svg"))?, "<svg/>");
        assert!(out.join("toy.json").is_file());
        Ok(())
    }

    #[test]
    fn table_is_aligned() -> Result<(), Failure> {
        let order = Order { runs: 3, seed: 7, precision: Precision::F64, filters: vec!["NN", "PDAF"], pictures: false };
        let outcome = echo(&order)?;
        let report = Report { scenario: "toy", runs: 3, seed: 7, precision: Precision::F64, filters: &outcome.filters };
        let expected = "toy: 3 runs, base seed 7, f64\n      lost  peak\nNN       0     -\nPDAF     1     -\n";
        assert_eq!(table(&report), expected);
        Ok(())
    }

    #[test]
    fn numbers_for_the_eye() {
        let shown = [400.0, 7.0812, 0.01234, 1455.6, 1e-9].map(short);
        assert_eq!(shown, ["400", "7.081", "0.01234", "1456", "1.000e-9"]);
    }
}
