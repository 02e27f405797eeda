//! The command `guide`: what wrong numbers look like. Runs the lessons of GUIDE.md, writes their tables between its marks and their
//! pictures beside the others.
//!
//! | file | holds |
//! |---|---|
//! | `lesson.rs` | the settings of every lesson, right ones and wrong ones |
//! | `world.rs` | one run of a setting: what is told to the tracker, and what came of it |
//! | `curve.rs` | the figures over all runs, as a row of a table and over time |
//!
//! All lessons share one world: the two targets of scenario `kashyap-a`, of whose plots one in eleven is missing, so P_D is 0.9 and the
//! density of clutter 9e-6 /m². They are tracked by `ImmJpda`, which finds them by itself.

mod curve;
mod lesson;
mod world;

use crate::picture::{Chart, Series};
use crate::{Failure, monte_carlo, output};
use curve::Figures;
use lesson::{LESSONS, Lesson, Shown};
use std::fmt::Write;
use std::path::Path;
use world::Watched;

/// The text.
const GUIDE: &str = "GUIDE.md";
/// Where the pictures go.
const PICTURES: &str = "host-tests/pictures";

/// Runs all lessons, `runs` runs of every setting from the base seed 0, and writes text and pictures.
///
/// # Errors
/// Where a file cannot be read or written, or has no marks, or where the figures contradict the text.
pub fn run(root: &Path, runs: u64) -> Result<(), Failure> {
    let guide = root.join(GUIDE);
    let mut text = output::read_text(&guide)?;
    for lesson in &LESSONS {
        let (figures, first) = teach(lesson, runs, 0)?;
        let table = table(lesson, &figures, runs);
        if !(lesson.holds)(&figures) {
            return Err(Failure::check("the figures are not what the guide says of them").within(lesson.name));
        }
        output::print(&format!("{}\n{table}\n", lesson.name))?;
        text = between(&text, lesson.name, &table).ok_or_else(|| {
            let reason = format!("has no marks for the lesson \"{}\"", lesson.name);
            Failure::input(reason).in_file(&guide)
        })?;
        let file = |kind: &str| root.join(PICTURES).join(format!("guide-{}{kind}.svg", lesson.name));
        output::write_file(&file(""), over_time(lesson, lesson.title, lesson.shown, &figures).render()?.as_bytes())?;
        if lesson.map {
            output::write_file(&file("-map"), map(lesson, &first).render()?.as_bytes())?;
        }
        if lesson.nees {
            let title = format!("{}: is the covariance honest?", lesson.title);
            output::write_file(&file("-nees"), over_time(lesson, &title, Shown::Nees, &figures).render()?.as_bytes())?;
        }
    }
    output::write_file(&guide, text.as_bytes())
}

/// The figures of every setting, and its first run.
fn teach(lesson: &Lesson, runs: u64, seed: u64) -> Result<(Vec<Figures>, Vec<Watched>), Failure> {
    let one = |index| -> Result<Vec<Watched>, Failure> {
        lesson.settings.iter().map(|setting| world::watch(setting, &mut monte_carlo::streams(seed, index))).collect()
    };
    let runs = monte_carlo::run(lesson.name, runs, one).into_iter().collect::<Result<Vec<_>, _>>()?;
    let figures = (0..lesson.settings.len()).map(|number| Figures::of(runs.iter().map(|run| &run[number]))).collect();
    Ok((figures, runs.into_iter().next().unwrap_or_default()))
}

fn table(lesson: &Lesson, figures: &[Figures], runs: u64) -> String {
    let mut text = format!(
        "{runs} runs, base seed 0:\n\n\
         | {} | lost at the end | scans without a track | false tracks a scan | rms in manoeuvres | otherwise | NEES |\n\
         |---|--:|--:|--:|--:|--:|--:|\n",
        lesson.told
    );
    for (setting, figures) in lesson.settings.iter().zip(figures) {
        let _ = writeln!(text, "| {} | {figures} |", setting.label);
    }
    text
}

fn over_time(lesson: &Lesson, title: &str, shown: Shown, figures: &[Figures]) -> Chart {
    let label = match shown {
        Shown::Error => "rms position error [m]",
        Shown::Nees => "NEES, a component",
        Shown::Found => "share of the targets with a track",
        Shown::False => "false tracks",
    };
    let chart = Chart::curves(title, "time [s]", label);
    let chart = if matches!(shown, Shown::Error | Shown::Nees) { chart.log_y() } else { chart };
    let chart = lesson.settings.iter().zip(figures).enumerate().fold(chart, |chart, (number, (setting, figures))| {
        chart.with(Series::curve(setting.label.replace('*', ""), figures.over_time(shown)).coloured(number))
    });
    match (shown, figures.first().and_then(Figures::interval)) {
        (Shown::Nees, Some([lower, upper])) => {
            chart.with(Series::level("95 % of honest ones", lower)).with(Series::level("95 % of honest ones", upper))
        }
        _ => chart,
    }
}

/// The first manoeuvre of the first run, on a map.
fn map(lesson: &Lesson, first: &[Watched]) -> Chart {
    let mut chart = Chart::map(format!("{}: the first manoeuvre", lesson.title), "x [m]", "y [m]");
    let Some(world) = first.first() else { return chart };
    chart = chart.with(Series::truth("truth", world.turn()));
    for (number, (setting, watched)) in lesson.settings.iter().zip(first).enumerate() {
        chart = chart.with(Series::track(setting.label.replace('*', ""), watched.tracks()).coloured(number));
    }
    chart
}

/// `text` with `part` between the marks of `name`.
fn between(text: &str, name: &str, part: &str) -> Option<String> {
    let [begin, end] = ["begin", "end"].map(|which| format!("<!-- {name}: {which} -->\n"));
    let (before, rest) = text.split_once(&begin)?;
    let (_, after) = rest.split_once(&end)?;
    Some(format!("{before}{begin}{part}{end}{after}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the guide says of every lesson, on data that it does not show.
    #[test]
    fn the_lessons_teach_what_the_guide_says() -> Result<(), Failure> {
        for lesson in &LESSONS {
            let (figures, _) = teach(lesson, 6, 1_000_000)?;
            assert!((lesson.holds)(&figures), "{}:\n{}", lesson.name, table(lesson, &figures, 6));
        }
        Ok(())
    }

    #[test]
    fn a_part_is_put_between_its_marks() {
        let text = "a\n<!-- q: begin -->\nold\n<!-- q: end -->\nb\n";
        assert_eq!(between(text, "q", "new\n").as_deref(), Some("a\n<!-- q: begin -->\nnew\n<!-- q: end -->\nb\n"));
        assert_eq!(between(text, "gate", "new\n"), None);
    }

    #[test]
    fn the_guide_shows_every_lesson() -> Result<(), Failure> {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let text = output::read_text(&root.join(GUIDE))?;
        for lesson in &LESSONS {
            assert!(between(&text, lesson.name, "").is_some(), "{}", lesson.name);
            for (kind, _) in [("", true), ("-map", lesson.map), ("-nees", lesson.nees)].into_iter().filter(|(_, drawn)| *drawn) {
                let shown = format!("{PICTURES}/guide-{}{kind}.svg", lesson.name);
                assert!(text.contains(&shown) && root.join(&shown).is_file(), "{shown}");
            }
            assert!(lesson.settings.iter().all(|setting| text.contains(&format!("| {} |", setting.label))), "{}", lesson.name);
        }
        Ok(())
    }
}
