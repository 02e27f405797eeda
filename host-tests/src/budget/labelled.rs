//! What labelled random finite sets cost: the forms of the image `glmb`, a hundred scans of each.

use super::count::Call;
use super::figures::Load;
use super::image::Image;
use super::table::{ms, row};
use crate::Failure;
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};
use twin::glmb::{Linear, MOST, Points, Sigma};

/// What the image exports, in the order of the sizes in `STATES`; and what it is.
const FORMS: [(&str, &str); 3] = [
    ("step_linear", "linear, 3 modes, 48 tracks"),
    ("step_unscented", "sigma points, 2 modes, 48 tracks"),
    ("step_particles", "64 particles a track, 2 modes, 20 tracks"),
];

/// The functions to be counted.
pub fn functions() -> [&'static str; 3] {
    FORMS.map(|(function, _)| function)
}

/// What one form costs. Memory in bytes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Form {
    pub ram: u64,
    pub stack: u64,
    pub load: Load,
}

impl Form {
    /// Every figure with its name.
    pub fn list(&self) -> Vec<(String, u64)> {
        let memory = [("ram", self.ram), ("stack", self.stack)];
        memory.into_iter().chain(self.load.figures()).map(|(name, value)| (name.to_owned(), value)).collect()
    }
}

/// All forms, from the calls of the image.
pub fn forms(image: &Image, calls: &[Call]) -> Result<IndexMap<String, Form>, Failure> {
    let states = image.data("STATES")?;
    let sizes = states.as_chunks::<4>().0.iter().map(|word| u64::from(u32::from_le_bytes(*word)));
    let form = |((function, name), ram): ((&str, &str), u64)| {
        let calls: Vec<Call> = calls.iter().filter(|call| call.function == function).cloned().collect();
        let stack = calls.iter().map(|call| call.stack).max();
        let stack = stack.ok_or_else(|| Failure::input(format!("{function} has not been called")))?;
        Ok((name.to_owned(), Form { ram, stack, load: Load::of(&calls) }))
    };
    FORMS.into_iter().zip(sizes).map(form).collect()
}

/// The table of all forms.
pub fn render(text: &mut String, forms: &IndexMap<String, Form>) {
    if forms.is_empty() {
        return;
    }
    text.push_str(
        "\n### Labelled sets\n\n\
         Three targets that come, turn and go in 60 clutter points, 100 scans 5 s apart, at most 20 hypotheses.\n\n\
         | jump-Markov GLMB | RAM | stack | instructions/k mean | worst | cycles/k mean | worst | ms worst | bound: steps/k |\n\
         |---|--:|--:|--:|--:|--:|--:|--:|--:|\n",
    );
    let most = [Linear::worst_case::<4, 3>(MOST), Sigma::worst_case::<5, 2>(MOST), Points::worst_case::<5, 2>(MOST)];
    for ((_, name), most) in FORMS.iter().zip(most) {
        let Some(Form { ram, stack, load }) = forms.get(*name) else { continue };
        let kilo = [load.mean_instructions, load.worst_instructions, load.mean_cycles, load.worst_cycles, most.steps()];
        let [mean, worst, mean_cycles, worst_cycles, steps] = kilo.map(|n| format!("{:.0}", n as f64 / 1e3));
        let (ram, stack) = (ram.to_string(), stack.to_string());
        row(text, [name.to_string(), ram, stack, mean, worst, mean_cycles, worst_cycles, ms(load.worst_cycles), steps]);
    }
}
