//! The code of the kernels: what each takes in flash and in cycles, compiled for speed and for size.

use super::image::{self, Image, RELEASE, SMALL};
use super::table::{self, PEERS, Peers};
use super::{count, measure_kernels};
use crate::Failure;
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Optimisation levels, the profiles of the images built by them, and the bytes of an IMM step that are the goal.
const LEVELS: [(&str, &str, u64); 2] = [("3", RELEASE, 6000), ("s", SMALL, 3500)];

/// A kernel at one level.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Code {
    /// Of all functions that it runs
    bytes: u64,
    /// Estimated
    cycles: u64,
}

impl Code {
    pub fn list(&self) -> Vec<(String, u64)> {
        [("bytes", self.bytes), ("cycles", self.cycles)].map(|(name, value)| (name.to_owned(), value)).into()
    }
}

/// The kernels at all levels, by name and level; the images for speed have been built.
pub fn measure(root: &Path, counter: &Path) -> Result<IndexMap<String, Code>, Failure> {
    image::build(root, SMALL, &["budget"], &[])?;
    let mut all = IndexMap::new();
    for (level, profile, _) in LEVELS {
        let image = Image::of_profile(root, profile, "budget")?;
        let names = PEERS.map(|peers| peers.name);
        let kernels = measure_kernels(counter, &image, &names)?;
        for (name, bytes) in names.into_iter().zip(count::code(counter, &image, &names)?) {
            all.insert(key(name, level), Code { bytes, cycles: kernels.get(name).map_or(0, |kernel| kernel.cycles) });
        }
    }
    Ok(all)
}

fn key(name: &str, level: &str) -> String {
    format!("{name}, opt-level {level}")
}

/// The table of the kernels at all levels.
pub fn render(text: &mut String, code: &IndexMap<String, Code>) {
    if code.is_empty() {
        return;
    }
    text.push_str(
        "\n### Compiled for speed and for size\n\n\
         The code of all functions that a kernel runs, in bytes. Compiled for size the library takes other forms of its loops, with the same \
         bits as results. The share is that of Eigen's cycles compiled for speed.\n\n\
         | kernel | opt-level | bytes | goal | cycles | share of Eigen |\n|---|---|--:|--:|--:|--:|\n",
    );
    for Peers { name, eigen, is_step, .. } in PEERS {
        for (level, _, goal) in LEVELS {
            let Some(Code { bytes, cycles }) = code.get(&key(name, level)) else { continue };
            let goal = if is_step { goal.to_string() } else { String::new() };
            let share = format!("{:.2}", *cycles as f64 / eigen);
            table::row(text, [name.to_owned(), level.to_owned(), bytes.to_string(), goal, cycles.to_string(), share]);
        }
    }
}
