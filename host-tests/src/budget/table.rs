//! The table that people read.

use super::configuration::{DETECTIONS, PIECES, ROOMS, Sizes, TRACKS, trackers};
use super::figures::{Figures, Fusion, Kernel, Record};
use super::labelled;
use super::{bound, code};
use crate::{Failure, output};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::Path;
use twin::load;

/// What the table stands between.
const MARKS: [&str; 2] = ["<!-- budget: begin -->\n", "<!-- budget: end -->\n"];
/// Hertz of the processor that the milliseconds are for.
const CLOCK: f64 = 168e6;

/// Cycles of a kernel's peers for the same workload, counted and estimated the same way, and the share of Eigen's that is the
/// goal.
pub struct Peers {
    pub name: &'static str,
    pub eigen: f64,
    nalgebra: f64,
    cmsis: f64,
    goal: f64,
    /// Whether it is the whole step of a track
    pub is_step: bool,
}

pub const PEERS: [Peers; 4] = [
    Peers { name: "imm6_step", eigen: 10_966.0, nalgebra: 18_256.0, cmsis: 42_500.0, goal: 0.33, is_step: true },
    Peers { name: "imm4_step", eigen: 7_616.0, nalgebra: 10_868.0, cmsis: 36_520.0, goal: 0.52, is_step: true },
    Peers { name: "jpda_marginals", eigen: 11_207.0, nalgebra: 34_111.0, cmsis: 25_016.0, goal: 0.30, is_step: false },
    Peers { name: "kf4_step", eigen: 776.0, nalgebra: 1_246.0, cmsis: 5_800.0, goal: 0.40, is_step: false },
];

/// The table as Markdown.
pub fn render(record: &Record) -> Result<String, Failure> {
    let mut text = String::new();
    let kilo = |n: u64| format!("{:.1}", n as f64 / 1e3);
    let _ = writeln!(text, "Built by {}.\n", record.compiler);
    text += "### Trackers\n\n\
        | tracker | RAM | flash | stack | instructions/k mean | worst | adversarial | cycles/k mean | worst | adversarial | ms worst | \
        adversarial | bound: steps/k | bound: Mcycles |\n\
        |---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n";
    for tracker in trackers() {
        let name = tracker.name();
        let Some(Figures { ram, flash, stack, recorded, adversarial }) = record.trackers.get(&name) else { continue };
        let most = bound::most(&tracker)?;
        let cycles = bound::cycles(&most);
        if adversarial.worst_cycles.max(recorded.worst_cycles) > cycles {
            return Err(Failure::check("more cycles observed than the bound gives: calibrate it anew").within(name));
        }
        let cells = [
            name,
            ram.to_string(),
            flash.to_string(),
            stack.to_string(),
            kilo(recorded.mean_instructions),
            kilo(recorded.worst_instructions),
            kilo(adversarial.worst_instructions),
            kilo(recorded.mean_cycles),
            kilo(recorded.worst_cycles),
            kilo(adversarial.worst_cycles),
            ms(recorded.worst_cycles),
            ms(adversarial.worst_cycles),
            kilo(most.steps()),
            format!("{:.2}", cycles as f64 / 1e6),
        ];
        row(&mut text, cells);
    }
    likely(&mut text, record);
    sizes(&mut text, &record.sizes);
    gtrack(&mut text, record);
    fusion(&mut text, record)?;
    record.coupled.render(&mut text)?;
    labelled::render(&mut text, &record.labelled);
    kernels(&mut text, record);
    code::render(&mut text, &record.code);
    pieces(&mut text, record);
    Ok(text)
}

/// Trackers that choose among their modes, each below the same tracker with all of them.
fn likely(text: &mut String, record: &Record) {
    if record.runs.is_empty() {
        return;
    }
    text.push_str(
        "\n### Likely modes\n\n\
         How many of 7 modes run for a track in a recorded scan, and what a step takes for each of its tracks; as shares of the same \
         tracker with all modes.\n\n\
         | tracker | modes | share | instructions | share | cycles | share |\n|---|--:|--:|--:|--:|--:|--:|\n",
    );
    // Modes, instructions and cycles of a track and scan.
    let means = |name: &str| {
        let (runs, Figures { recorded, .. }) = record.runs.get(name).zip(record.trackers.get(name))?;
        let per_track = |sum: u64| sum as f64 / runs.tracks as f64;
        let steps = load::SCANS as u64;
        Some([runs.modes, steps * recorded.mean_instructions, steps * recorded.mean_cycles].map(per_track))
    };
    // By name: a record that was read is not in the order of measuring.
    let names: BTreeSet<_> = record.runs.keys().filter(|name| name.starts_with("lms")).collect();
    for name in names {
        let all = name.replacen("lms", "imm", 1);
        let (Some(ours), Some(theirs)) = (means(name), means(&all)) else { continue };
        for (name, means) in [(&all, theirs), (name, ours)] {
            let cell = |k: usize, digits: usize| [format!("{:.digits$}", means[k]), format!("{:.2}", means[k] / theirs[k])];
            row(text, std::iter::once(name.clone()).chain([cell(0, 2), cell(1, 0), cell(2, 0)].into_iter().flatten()));
        }
    }
}

/// TI's group tracker beside ours, for half of the detections that there is room for: what the recorded scenario has on average.
fn gtrack(text: &mut String, record: &Record) {
    text.push_str(
        "\n### Beside TI gtrack\n\n\
         Cycles a scan, for tracks x detections; gtrack on a Cortex-R4F, ours the means above.\n\n\
         | tracks x detections | gtrack | imm-pdaf 6x2 | imm-jpda 6x2, 256 nodes |\n|---|--:|--:|--:|\n",
    );
    for (tracks, room) in ROOMS {
        let detections = room / 2;
        let (t, m) = (tracks as f64, detections as f64);
        // Least squares over the 120 steady rows of the logs of TI's mmWave SDK 1.2.0.5, within 4.9 % of each.
        let theirs = 1_600.0 + 12_400.0 * t + 834.0 * m + 136.0 * t * m;
        let ours = |name: String| record.trackers.get(&name).map_or("-".to_owned(), |ours| ours.recorded.mean_cycles.to_string());
        let (single, joint) = (ours(format!("imm-pdaf 6x2 {tracks}x{room}")), ours(format!("imm-jpda 6x2 {tracks}x{room} 256")));
        row(text, [format!("{tracks}x{detections}"), format!("{theirs:.0}"), single, joint]);
    }
}

/// Two lists made one picture.
fn fusion(text: &mut String, record: &Record) -> Result<(), Failure> {
    let Fusion { ram, flash, calls } = &record.fusion;
    if calls.is_empty() {
        return Ok(());
    }
    let most = twin::fusion::Fusion::MOST;
    let bound = bound::fusion_cycles(&most);
    let _ = write!(
        text,
        "\n### Fusion\n\n\
         Two sensors with 16 tracks each, 6 states in 2 modes, by covariance intersection of the least determinant: a picture of {ram} bytes \
         of RAM, {flash} bytes of flash. At most {:.1}k steps an update, {:.2} million cycles.\n\n\
         | call | instructions/k | cycles/k | ms | stack |\n|---|--:|--:|--:|--:|\n",
        most.steps() as f64 / 1e3,
        bound as f64 / 1e6,
    );
    for (name, Kernel { instructions, cycles, stack }) in calls.iter().collect::<BTreeMap<_, _>>() {
        if *cycles > bound {
            return Err(Failure::check("more cycles observed than the bound gives: calibrate it anew").within(name));
        }
        let kilo = |n: u64| format!("{:.1}", n as f64 / 1e3);
        row(text, [name.clone(), kilo(*instructions), kilo(*cycles), ms(*cycles), stack.to_string()]);
    }
    Ok(())
}

/// Milliseconds of so many cycles.
pub fn ms(cycles: u64) -> String {
    format!("{:.2}", cycles as f64 / CLOCK * 1e3)
}

/// One row.
pub fn row<S: AsRef<str>>(text: &mut String, cells: impl IntoIterator<Item = S>) {
    for cell in cells {
        let _ = write!(text, "| {} ", cell.as_ref());
    }
    text.push_str("|\n");
}

fn sizes(text: &mut String, sizes: &Sizes) {
    text.push_str("\n### RAM of all capacities\n\nBytes of the state, for tracks x detections.\n\n");
    let rooms = || TRACKS.into_iter().flat_map(|t| DETECTIONS.map(|d| (t, d)));
    row(text, std::iter::once("tracker".to_owned()).chain(rooms().map(|(t, d)| format!("{t}x{d}"))));
    text.push_str("|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for entry in &sizes.0 {
        // A sweep needs more nodes than there are detections.
        let nodes = entry.name.split(' ').nth(2).and_then(|nodes| nodes.parse().ok());
        let cells = entry.bytes.as_flattened().iter().zip(rooms());
        let cells = cells.map(|(bytes, (_, d))| if nodes.is_some_and(|nodes: usize| nodes <= d) { "-".into() } else { bytes.to_string() });
        row(text, std::iter::once(entry.name.clone()).chain(cells));
    }
}

fn kernels(text: &mut String, record: &Record) {
    if record.kernels.is_empty() {
        return;
    }
    text.push_str(
        "\n### Kernels\n\n\
         The same workloads in Eigen, nalgebra and CMSIS-DSP, their cycles estimated by the same model: how many times ours they take.\n\n\
         | kernel | instructions | cycles | stack | Eigen | nalgebra | CMSIS-DSP | share of Eigen | goal |\n\
         |---|--:|--:|--:|--:|--:|--:|--:|--:|\n",
    );
    for Peers { name, eigen, nalgebra, cmsis, goal, .. } in PEERS {
        let Some(kernel) = record.kernels.get(name) else { continue };
        let ours = kernel.cycles as f64;
        let times = |theirs: f64| format!("{:.2}", theirs / ours);
        let (share, goal) = (format!("{:.3}", ours / eigen), format!("{goal:.2}"));
        let [instructions, cycles, stack] = [kernel.instructions, kernel.cycles, kernel.stack].map(|n| n.to_string());
        row(text, [name.to_owned(), instructions, cycles, stack, times(eigen), times(nalgebra), times(cmsis), share, goal]);
    }
}

fn pieces(text: &mut String, record: &Record) {
    if record.pieces.is_empty() {
        return;
    }
    text.push_str("\n### Pieces\n\n| piece | instructions | cycles | stack |\n|---|--:|--:|--:|\n");
    for (name, piece) in PIECES.iter().filter_map(|name| Some((name, record.pieces.get(*name)?))) {
        row(text, [name.to_string(), piece.instructions.to_string(), piece.cycles.to_string(), piece.stack.to_string()]);
    }
}

/// Writes the table between its marks.
pub fn publish(readme: &Path, record: &Record) -> Result<(), Failure> {
    output::write_file(readme, with_table(&output::read_text(readme)?, record, readme)?.as_bytes())
}

/// Fails where the table is not that of `record`.
pub fn check(readme: &Path, record: &Record) -> Result<(), Failure> {
    let text = output::read_text(readme)?;
    if with_table(&text, record, readme)? == text {
        return Ok(());
    }
    Err(Failure::check("not the table of budget.toml; run `budget`").in_file(readme))
}

/// The text of the README with the table of `record`.
fn with_table(text: &str, record: &Record, readme: &Path) -> Result<String, Failure> {
    let [begin, end] = MARKS;
    let parts = text.split_once(begin).and_then(|(before, rest)| Some((before, rest.split_once(end)?.1)));
    let (before, after) = parts.ok_or_else(|| Failure::input("has no marks for the table").in_file(readme))?;
    Ok(format!("{before}{begin}{}{end}{after}", render(record)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::figures::Load;
    use crate::error::Status;

    fn record() -> Record {
        let kernel = |cycles| Kernel { instructions: 100, cycles, stack: 8 };
        let load = |worst_cycles| Load { mean_instructions: 1000, worst_instructions: 2000, mean_cycles: 1500, worst_cycles };
        let figures = Figures { ram: 2000, flash: 40_000, stack: 300, recorded: load(30_000), adversarial: load(168_000) };
        Record {
            trackers: trackers().map(|tracker| (tracker.name(), figures.clone())).collect(),
            kernels: PEERS.iter().map(|peers| (peers.name.to_owned(), kernel(500))).collect(),
            pieces: PIECES.iter().map(|name| (name.to_string(), kernel(600))).collect(),
            ..Record::default()
        }
    }

    #[test]
    fn the_published_table_is_that_of_the_published_record() -> Result<(), Box<dyn std::error::Error>> {
        let dir = tempfile::tempdir()?;
        let (readme, file) = (dir.path().join("README.md"), dir.path().join("budget.toml"));
        let [begin, end] = MARKS;
        std::fs::write(&readme, format!("before\n{begin}old\n{end}after\n"))?;
        publish(&readme, &record())?;
        record().write(&file)?;
        assert_eq!(check(&readme, &Record::read(&file)?), Ok(()));
        let text = std::fs::read_to_string(&readme)?;
        assert!(text.starts_with("before\n") && text.ends_with("after\n") && !text.contains("old"));
        // 168,000 cycles at 168 MHz; 776 of Eigen's cycles over 500 of ours.
        assert!(text.contains("| 0.18 | 1.00 |") && text.contains("| kf4_step | 100 | 500 | 8 | 1.55 |"));
        std::fs::write(&readme, text.replace("| 1.55 |", "| 9.99 |"))?;
        assert!(check(&readme, &record()).is_err_and(|failure| failure.status() == Status::Check));
        Ok(())
    }

    #[test]
    fn more_cycles_than_the_bound_gives_are_refused() {
        let mut record = record();
        for figures in record.trackers.values_mut() {
            figures.adversarial.worst_cycles = u64::MAX;
        }
        assert!(render(&record).is_err_and(|failure| failure.to_string().contains("calibrate")));
    }
}
