//! The command `budget`: what every tracker and kernel costs on a Cortex-M4F, known before flashing.
//!
//! ```text
//! build     the images of firmware-example, one per tracker, by cargo                         image.rs
//! count     run each in QEMU with the plugin of firmware-example/counter                      count.rs
//! code      the bytes of a step, built for speed and for size                                 code.rs
//! modes     how many ran of those that may, where a tracker chooses                            likely.rs
//! bound     the operation-count formula of each tracker, for its const parameters             bound.rs
//! publish   a table between two marks of firmware-example/README.md, and the same figures
//!           for machines in firmware-example/budget.toml                                      table.rs
//! check     or compare with the latter: growth beyond 2 % fails, and so does a table that
//!           shows other figures                                                               figures.rs
//! ```
//!
//! Every image runs on a Cortex-M4 and on a Cortex-M7, and must execute the same instructions on both, call by call.

pub mod bound;
mod code;
mod configuration;
mod count;
mod coupled;
pub(crate) mod figures;
mod image;
pub(crate) mod labelled;
mod likely;
pub(crate) mod table;

use crate::{Failure, compare, output};
use configuration::{FUSION, KERNELS, PIECES, Tracker, trackers};
use count::{Board, Call};
use coupled::Coupled;
use figures::{Figures, Fusion, Kernel, Load, Record};
use image::{Image, RELEASE};
use indexmap::IndexMap;
use indicatif::{ProgressBar, ProgressStyle};
use std::path::Path;
use std::sync::OnceLock;

/// Where the table stands.
const README: &str = "firmware-example/README.md";
/// The same figures for machines.
pub(crate) const RECORD: &str = "firmware-example/budget.toml";

/// What the command is asked for.
#[derive(Debug, Clone, Default)]
pub struct Request {
    /// Compare with the published figures instead of publishing
    pub check: bool,
    /// Only trackers whose names contain this
    pub only: Option<String>,
}

/// Carries the command out, from the repository root.
///
/// # Errors
/// Where images cannot be built or run, where the two boards differ, and with `check` where a figure has grown.
pub fn run(root: &Path, request: &Request) -> Result<(), Failure> {
    let wanted = request.only.as_deref().unwrap_or_default();
    let trackers: Vec<Tracker> = trackers().filter(|tracker| tracker.name().contains(wanted)).collect();
    if trackers.is_empty() {
        return Err(Failure::input(format!("no tracker's name contains \"{wanted}\"")));
    }
    let record = measure(root, &trackers, request.only.is_none())?;
    output::print(&table::render(&record)?)?;
    if request.check {
        let published = Record::read(&root.join(RECORD))?;
        table::check(&root.join(README), &published)?;
        let notes = record.compare(&published)?;
        output::print(&notes)
    } else if request.only.is_none() {
        table::publish(&root.join(README), &record)?;
        record.write(&root.join(RECORD))?;
        // Another page shows some of these figures.
        compare::refresh(root)
    } else {
        output::print("only some trackers: nothing published\n")
    }
}

/// Builds and counts `trackers`, and the kernels if wanted.
fn measure(root: &Path, trackers: &[Tracker], with_kernels: bool) -> Result<Record, Failure> {
    let bar = progress(trackers.len() as u64 + 2);
    bar.set_message("the counter and the common images");
    let counter = image::build_counter(root)?;
    image::build(root, RELEASE, &["budget", "coupled", "empty", "fusion", "glmb", "kernels", "memory", "unfused"], &[])?;
    bar.inc(1);

    let memory = Image::open(root, "memory")?;
    let mut record = Record { compiler: image::compiler(root)?, sizes: configuration::sizes(&memory)?, ..Record::default() };
    if with_kernels {
        record.kernels = measure_kernels(&counter, &Image::open(root, "budget")?, &KERNELS)?;
        record.code = code::measure(root, &counter)?;
        record.pieces = measure_kernels(&counter, &Image::open(root, "kernels")?, &PIECES)?;
        let coupled = Image::open(root, "coupled")?;
        let calls = on_both_boards(&counter, &coupled, &coupled::functions())?;
        record.coupled = Coupled::of(&coupled, &calls, Image::open(root, "empty")?.flash()?)?;
        let fusion = Image::open(root, "fusion")?;
        let flash = fusion.flash()?.saturating_sub(Image::open(root, "unfused")?.flash()?);
        record.fusion = Fusion { ram: configuration::picture(&memory)?, flash, calls: measure_fusion(&counter, &fusion)? };
        let glmb = Image::open(root, "glmb")?;
        record.labelled = labelled::forms(&glmb, &on_both_boards(&counter, &glmb, &labelled::functions())?)?;
    }
    bar.inc(1);

    // Images are built one after another, and counted while the next is built.
    let empty = Image::open(root, "empty")?.flash()?;
    let counted: Vec<OnceLock<_>> = trackers.iter().map(|_| OnceLock::new()).collect();
    let built = rayon::in_place_scope(|scope| {
        for (tracker, counted) in trackers.iter().zip(&counted) {
            bar.set_message(tracker.name());
            let ram = record.sizes.ram(tracker)?;
            image::build(root, RELEASE, &["tracker"], &[("BORESIGHT_TRACKER", tracker.name()), ("BORESIGHT_MOST_RAM", ram.to_string())])?;
            let image = Image::open(root, "tracker")?;
            let (counter, bar) = (&counter, &bar);
            scope.spawn(move |_| {
                let _ = counted.set(measure_tracker(counter, &image, empty, ram));
                bar.inc(1);
            });
        }
        Ok(())
    });
    bar.finish_and_clear();
    built?;
    for (tracker, figures) in trackers.iter().zip(counted) {
        let figures = figures.into_inner().unwrap_or_else(|| Err(Failure::input("not counted")));
        record.trackers.insert(tracker.name(), figures.map_err(|failure| failure.within(tracker.name()))?);
        record.runs.extend(likely::runs(tracker)?.map(|runs| (tracker.name(), runs)));
    }
    Ok(record)
}

fn measure_tracker(counter: &Path, image: &Image, empty: u64, ram: u64) -> Result<Figures, Failure> {
    let calls = on_both_boards(counter, image, &["step", "crowd"])?;
    // The first call of `crowd` begins the adversarial scenario.
    let begin = calls.iter().position(|call| call.function == "crowd").unwrap_or(calls.len());
    let steps = |part: &[Call]| -> Vec<Call> { part.iter().filter(|call| call.function == "step").cloned().collect() };
    let (recorded, adversarial) = (steps(&calls[..begin]), steps(&calls[begin..]));
    if recorded.is_empty() || adversarial.is_empty() {
        return Err(Failure::input("one of the scenarios has not been run"));
    }
    let flash = image.flash()?.saturating_sub(empty);
    let stack = recorded.iter().chain(&adversarial).map(|call| call.stack).max().unwrap_or_default();
    Ok(Figures { ram, flash, stack, recorded: Load::of(&recorded), adversarial: Load::of(&adversarial) })
}

fn measure_kernels(counter: &Path, image: &Image, functions: &[&str]) -> Result<IndexMap<String, Kernel>, Failure> {
    let calls = on_both_boards(counter, image, functions)?;
    let worst = |name: &str| {
        let calls = calls.iter().filter(|call| call.function == name);
        let kernel = calls.max_by_key(|call| call.cycles).map(Kernel::of);
        Ok((name.to_owned(), kernel.ok_or_else(|| Failure::input(format!("{name} has not been called")))?))
    };
    functions.iter().map(|name| worst(name)).collect()
}

fn measure_fusion(counter: &Path, image: &Image) -> Result<IndexMap<String, Kernel>, Failure> {
    let calls = on_both_boards(counter, image, &FUSION)?;
    let [receive, fuse] = FUSION.map(|name| calls.iter().filter(|call| call.function == name).collect::<Vec<_>>());
    let (apart, crowd) = fuse.split_at(fuse.len() / 2);
    let kinds = [(FUSION[0].to_owned(), receive.as_slice()), (FUSION[1].to_owned(), apart), (format!("{}, crowd", FUSION[1]), crowd)];
    let worst = |(name, calls): (String, &[&Call])| {
        let kernel = calls.iter().max_by_key(|call| call.cycles).map(|call| Kernel::of(call));
        kernel.ok_or_else(|| Failure::input(format!("{name} has not been called"))).map(|kernel| (name, kernel))
    };
    kinds.into_iter().map(worst).collect()
}

/// The calls on a Cortex-M4, which a Cortex-M7 must make alike.
fn on_both_boards(counter: &Path, image: &Image, functions: &[&str]) -> Result<Vec<Call>, Failure> {
    let calls = count::run(counter, image, Board::CortexM4, functions)?;
    match count::run(counter, image, Board::CortexM7, functions)? == calls {
        true => Ok(calls),
        false => Err(Failure::check("Cortex-M4 and Cortex-M7 have executed different instructions")),
    }
}

fn progress(steps: u64) -> ProgressBar {
    let bar = ProgressBar::new(steps).with_prefix("budget");
    match ProgressStyle::with_template("{prefix} {bar:32} {pos}/{len} images, {elapsed} passed: {msg}") {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}
