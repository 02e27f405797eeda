//! The table of WHICH-TRACKER.md, between two marks.

use super::follow::Which;
use super::{Figure, Record, Row, SCENES, Scene, obstacle};
use crate::budget::figures::{Figures, Record as Costs};
use crate::budget::table::{ms, row};
use crate::statistics::wilson;
use crate::{Failure, output};
use std::fmt::Write;
use std::path::Path;

/// What the table stands between.
const MARKS: [&str; 2] = ["<!-- compare: begin -->\n", "<!-- compare: end -->\n"];

/// What a tracker costs on the target, for the table: kB and ms; empty where it is not counted.
#[derive(Default)]
struct Cost {
    flash: String,
    mean: String,
    worst: String,
    counted_as: String,
}

/// The published configuration that is nearest to the tracker on this scenario.
fn published(scene: &Scene, which: Which) -> Option<&'static str> {
    Some(match (which, scene.name) {
        (Which::Gnn, "jms-glmb-linear") => "imm-gnn 4x3 16x32",
        (Which::ImmPdaf, "kashyap-a") => "imm-pdaf 6x2 16x32",
        (Which::ImmPdaf, "gomes" | "jms-glmb-linear") => "imm-pdaf 4x3 16x32",
        (Which::ImmJpda, "kashyap-a") => "imm-jpda 6x2 16x32 64",
        (Which::ImmJpda, "gomes") => "imm-jpda 4x7 16x32 64",
        (Which::ImmJpda, "jms-glmb-linear") => "imm-jpda 4x3 16x32 64",
        (Which::LmsJpda, "gomes") => "lms-jpda 4x7 16x32 64",
        (Which::MergingJpda, "jeong-tugnait") => "merging-jpda 4x3 16x32 256 4",
        (Which::ImmCoupled, "jeong-tugnait") => "with the cross covariance",
        (Which::JmsGlmb, "jms-glmb-linear") => "linear, 3 modes, 48 tracks",
        _ => return None,
    })
}

impl Cost {
    fn of(name: &str, costs: &Costs) -> Self {
        let counted_as = name.to_owned();
        if let Some(Figures { flash, recorded, .. }) = costs.trackers.get(name) {
            let [mean, worst] = [recorded.mean_cycles, recorded.worst_cycles].map(ms);
            return Self { flash: kilo(*flash), mean, worst, counted_as };
        }
        if let Some(form) = costs.labelled.get(name) {
            let [mean, worst] = [form.load.mean_cycles, form.load.worst_cycles].map(ms);
            return Self { mean, worst, counted_as, ..Self::default() };
        }
        match costs.coupled.forms.get(name) {
            Some(form) => {
                let [mean, worst] = [form.radar.mean_cycles, form.radar.worst_cycles].map(ms);
                Self { flash: kilo(costs.coupled.flash), mean, worst, counted_as }
            }
            None => Self::default(),
        }
    }
}

fn kilo(bytes: u64) -> String {
    format!("{:.1}", bytes as f64 / 1000.0)
}

/// The table as Markdown.
pub fn table(record: &Record, costs: &Costs) -> String {
    let Record { runs, seed, .. } = record;
    let mut text = format!(
        "{runs} runs of each scenario, base seed {seed}, single precision.\n\n\
         | tracker | lost, % | exchanged, % | OSPA, m | GOSPA, m | NEES | RAM, kB | flash, kB | ms a scan | worst | counted as |\n\
         |---|--:|--:|--:|--:|--:|--:|--:|--:|--:|---|\n"
    );
    for scene in &SCENES {
        let _ = writeln!(text, "| **{}**: {}; cut-off {} m | | | | | | | | | | |", scene.name, scene.about, scene.cutoff);
        for which in Which::ALL {
            let quality = match (obstacle(scene, which), record.row(scene.name, which.name())) {
                (Some(reason), _) => [reason.to_owned(), String::new(), String::new(), String::new(), String::new()],
                (None, Some(row)) => quality(row, *runs),
                (None, None) => continue,
            };
            let cost = published(scene, which).map_or_else(Cost::default, |name| Cost::of(name, costs));
            let ram = if obstacle(scene, which).is_none() { kilo((scene.ram)(which) as u64) } else { String::new() };
            let cells = [ram, cost.flash, cost.mean, cost.worst, cost.counted_as];
            row(&mut text, std::iter::once(which.name().to_owned()).chain(quality).chain(cells));
        }
    }
    text
}

fn quality(row: &Row, runs: u64) -> [String; 5] {
    let share = |count: usize| {
        wilson(count, runs as usize).map_or("-".to_owned(), |p| {
            let [fraction, lower, upper] = [p.fraction, p.lower, p.upper].map(|part| 100.0 * part);
            format!("{fraction:.1} ({lower:.1}–{upper:.1})")
        })
    };
    let figure = |figure: Option<Figure>, digits: usize| match figure {
        Some(Figure { mean, error: Some(error) }) => format!("{mean:.digits$} ± {error:.digits$}"),
        Some(Figure { mean, error: None }) => format!("{mean:.digits$}"),
        None => "-".to_owned(),
    };
    [share(row.lost), share(row.exchanged), figure(row.ospa, 1), figure(row.gospa, 1), figure(row.nees, 2)]
}

/// Writes the table between its marks.
pub fn publish(page: &Path, record: &Record, costs: &Costs) -> Result<(), Failure> {
    output::write_file(page, with_table(&output::read_text(page)?, record, costs, page)?.as_bytes())
}

/// Fails where the table is not that of `record` and `costs`.
pub fn check(page: &Path, record: &Record, costs: &Costs) -> Result<(), Failure> {
    let text = output::read_text(page)?;
    match with_table(&text, record, costs, page)? == text {
        true => Ok(()),
        false => Err(Failure::check("not the table of compare.json and budget.toml; run `compare --refresh`").in_file(page)),
    }
}

fn with_table(text: &str, record: &Record, costs: &Costs, page: &Path) -> Result<String, Failure> {
    let [begin, end] = MARKS;
    let parts = text.split_once(begin).and_then(|(before, rest)| Some((before, rest.split_once(end)?.1)));
    let (before, after) = parts.ok_or_else(|| Failure::input("has no marks for the table").in_file(page))?;
    Ok(format!("{before}{begin}{}{end}{after}", table(record, costs)))
}
