//! The figures of the budget, and their growth.

use super::code::Code;
use super::configuration::Sizes;
use super::count::Call;
use super::coupled::Coupled;
use super::labelled::Form;
use super::likely::Runs;
use crate::{Failure, output};
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};
use std::fmt::Write;
use std::path::Path;

/// The largest growth that passes, in per cent.
const GROWTH: u64 = 2;

/// What the steps of one scenario cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Load {
    pub mean_instructions: u64,
    pub worst_instructions: u64,
    /// Cycles are estimates.
    pub mean_cycles: u64,
    pub worst_cycles: u64,
}

impl Load {
    /// Over `calls`, one at least.
    pub fn of(calls: &[Call]) -> Self {
        let instructions = || calls.iter().map(|call| call.instructions);
        let cycles = || calls.iter().map(|call| call.cycles);
        let mean = |sum: u64| sum / calls.len().max(1) as u64;
        Self {
            mean_instructions: mean(instructions().sum()),
            worst_instructions: instructions().max().unwrap_or_default(),
            mean_cycles: mean(cycles().sum()),
            worst_cycles: cycles().max().unwrap_or_default(),
        }
    }

    /// Each with its name.
    pub fn figures(&self) -> [(&'static str, u64); 4] {
        [
            ("mean instructions", self.mean_instructions),
            ("worst instructions", self.worst_instructions),
            ("mean cycles", self.mean_cycles),
            ("worst cycles", self.worst_cycles),
        ]
    }
}

/// What a tracker costs. Memory in bytes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Figures {
    pub ram: u64,
    pub flash: u64,
    pub stack: u64,
    pub recorded: Load,
    pub adversarial: Load,
}

impl Figures {
    fn list(&self) -> Vec<(String, u64)> {
        let memory = [("ram", self.ram), ("flash", self.flash), ("stack", self.stack)].map(|(name, value)| (name.to_owned(), value));
        let load = |scenario: &'static str, load: &Load| load.figures().map(|(name, value)| (format!("{scenario} {name}"), value));
        memory.into_iter().chain(load("recorded", &self.recorded)).chain(load("adversarial", &self.adversarial)).collect()
    }
}

/// What the costliest call of a kernel costs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Kernel {
    pub instructions: u64,
    /// Estimated
    pub cycles: u64,
    pub stack: u64,
}

impl Kernel {
    pub fn of(call: &Call) -> Self {
        Self { instructions: call.instructions, cycles: call.cycles, stack: call.stack }
    }

    fn list(&self) -> Vec<(String, u64)> {
        [("instructions", self.instructions), ("cycles", self.cycles), ("stack", self.stack)].map(|(n, v)| (n.to_owned(), v)).into()
    }
}

/// What fusion costs: memory in bytes, and the costliest call of every kind.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fusion {
    pub ram: u64,
    pub flash: u64,
    pub calls: IndexMap<String, Kernel>,
}

/// All figures.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Record {
    /// What built the images
    pub compiler: String,
    pub sizes: Sizes,
    pub trackers: IndexMap<String, Figures>,
    /// Of trackers of many modes
    pub runs: IndexMap<String, Runs>,
    pub kernels: IndexMap<String, Kernel>,
    /// Of steps
    pub code: IndexMap<String, Code>,
    pub pieces: IndexMap<String, Kernel>,
    pub fusion: Fusion,
    pub coupled: Coupled,
    /// Of labelled sets
    pub labelled: IndexMap<String, Form>,
}

impl Record {
    /// What has been published.
    pub fn read(file: &Path) -> Result<Self, Failure> {
        toml::from_str(&output::read_text(file)?).map_err(|error| Failure::input(error).in_file(file))
    }

    /// Publishes.
    pub fn write(&self, file: &Path) -> Result<(), Failure> {
        let text = toml::to_string(self).map_err(|error| Failure::input(error).in_file(file))?;
        let head = "# Written by `cargo run --release -p host-tests -- budget`; the table in README.md holds the same figures.\n\n";
        output::write_file(file, format!("{head}{text}").as_bytes())
    }

    /// Notes of what has shrunk; fails where something has grown beyond the limit or is not among the published figures.
    pub fn compare(&self, published: &Self) -> Result<String, Failure> {
        let (mut notes, mut grown) = (String::new(), Vec::new());
        let (new, old) = (self.list(), published.list());
        for (name, value) in &new {
            let Some(before) = old.get(name).copied() else {
                grown.push(format!("{name}: not published yet"));
                continue;
            };
            let change = 100.0 * (*value as f64 / before.max(1) as f64 - 1.0);
            let text = format!("{name}: {before} -> {value} ({change:+.1} %)");
            if 100 * value > (100 + GROWTH) * before {
                grown.push(text);
            } else if 100 * value < (100 - GROWTH) * before {
                let _ = writeln!(notes, "shrunk: {text}");
            }
        }
        match grown.as_slice() {
            [] => Ok(format!("{notes}{} figures, none grown beyond {GROWTH} %\n", new.len())),
            // The whole list is for people, the failure is one line.
            list => {
                output::print(&format!("{notes}grown: {}\n", list.join("\ngrown: ")))?;
                let compilers = if self.compiler == published.compiler {
                    String::new()
                } else {
                    format!(" (built by {}, published by {})", self.compiler, published.compiler)
                };
                Err(Failure::check(format!("{} of {} figures have grown, such as {}{compilers}", list.len(), new.len(), list[0])))
            }
        }
    }

    /// Every figure with its full name.
    fn list(&self) -> IndexMap<String, u64> {
        let within = |name: &str, list: Vec<(String, u64)>| -> Vec<(String, u64)> {
            list.into_iter().map(|(figure, value)| (format!("{name}, {figure}"), value)).collect()
        };
        let trackers = self.trackers.iter().flat_map(|(name, figures)| within(name, figures.list()));
        let kernels =
            self.kernels.iter().chain(&self.pieces).chain(&self.fusion.calls).flat_map(|(name, kernel)| within(name, kernel.list()));
        let sizes = self.sizes.0.iter().flat_map(|row| {
            let cells = row.bytes.as_flattened().iter().enumerate();
            within(&row.name, cells.map(|(k, bytes)| (format!("size {k}"), *bytes)).collect())
        });
        let runs = self.runs.iter().flat_map(|(name, Runs { tracks, modes })| {
            within(name, vec![("modes a thousand tracks".to_owned(), 1000 * modes / tracks.max(&1))])
        });
        let fusion = [("fusion, ram".to_owned(), self.fusion.ram), ("fusion, flash".to_owned(), self.fusion.flash)];
        let code = self.code.iter().flat_map(|(name, code)| within(name, code.list()));
        let labelled = self.labelled.iter().flat_map(|(name, form)| within(name, form.list()));
        trackers.chain(fusion).chain(self.coupled.list()).chain(labelled).chain(runs).chain(kernels).chain(code).chain(sizes).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Status;

    fn record(cycles: u64, stack: u64) -> Record {
        let kernel = Kernel { instructions: 1000, cycles, stack };
        Record { kernels: IndexMap::from([("k".to_owned(), kernel)]), ..Record::default() }
    }

    #[test]
    fn growth_beyond_two_per_cent_fails_and_shrinkage_is_told() {
        let published = record(1000, 100);
        assert!(record(1020, 102).compare(&published).is_ok_and(|notes| !notes.contains("shrunk")));
        assert!(record(1021, 100).compare(&published).is_err_and(|f| f.status() == Status::Check && f.to_string().contains("k, cycles")));
        assert!(record(1000, 103).compare(&published).is_err());
        assert!(record(900, 100).compare(&published).is_ok_and(|notes| notes.contains("shrunk: k, cycles: 1000 -> 900")));
        assert!(record(1000, 100).compare(&Record::default()).is_err_and(|f| f.to_string().contains("not published")));
    }

    #[test]
    fn a_record_survives_being_written() -> Result<(), Box<dyn std::error::Error>> {
        let dir = tempfile::tempdir()?;
        let file = dir.path().join("budget.toml");
        let load = Load { mean_instructions: 1, worst_instructions: 2, mean_cycles: 3, worst_cycles: 4 };
        let mut all = record(7, 8);
        all.trackers.insert("imm-pdaf 4x3 4x8".into(), Figures { ram: 1, flash: 2, stack: 3, recorded: load, adversarial: load });
        all.write(&file)?;
        assert_eq!(Record::read(&file)?, all);
        Ok(())
    }
}
