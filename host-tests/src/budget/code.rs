//! The code of an IMM step: what a step of one track is in flash, compiled for speed and for size.

use super::image::{self, Image, RELEASE, SMALL};
use super::{count, measure_kernels, table};
use crate::Failure;
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The kernels that are a step.
const STEPS: [&str; 2] = ["imm6_step", "imm4_step"];
/// Optimisation levels, the profiles of the images built by them, and the bytes of a step that are the goal.
const LEVELS: [(&str, &str, u64); 2] = [("3", RELEASE, 6000), ("s", SMALL, 3500)];

/// A step at one level.
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

/// The steps at all levels, by name and level; the images for speed have been built.
pub fn measure(root: &Path, counter: &Path) -> Result<IndexMap<String, Code>, Failure> {
    image::build(root, SMALL, &["budget"], &[])?;
    let mut all = IndexMap::new();
    for (level, profile, _) in LEVELS {
        let image = Image::of_profile(root, profile, "budget")?;
        let kernels = measure_kernels(counter, &image, &STEPS)?;
        for (name, bytes) in STEPS.into_iter().zip(count::code(counter, &image, &STEPS)?) {
            all.insert(key(name, level), Code { bytes, cycles: kernels.get(name).map_or(0, |kernel| kernel.cycles) });
        }
    }
    Ok(all)
}

fn key(name: &str, level: &str) -> String {
    format!("{name}, opt-level {level}")
}

/// The table of the steps.
pub fn render(text: &mut String, code: &IndexMap<String, Code>) {
    if code.is_empty() {
        return;
    }
    text.push_str(
        "\n### Code of a step\n\n\
         All functions that one scan of one track runs, in bytes. Compiled for size the library takes other forms of its loops, with the same \
         bits as results.\n\n\
         | step | opt-level | bytes | goal | cycles |\n|---|---|--:|--:|--:|\n",
    );
    for name in STEPS {
        for (level, _, goal) in LEVELS {
            let Some(Code { bytes, cycles }) = code.get(&key(name, level)) else { continue };
            table::row(text, [name.to_owned(), level.to_owned(), bytes.to_string(), goal.to_string(), cycles.to_string()]);
        }
    }
}
