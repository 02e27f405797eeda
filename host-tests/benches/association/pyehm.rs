//! PyEHM on the same problems, through `time_pyehm.py` beside this directory, where a Python has it.

use crate::support::ask;
use crate::{AGREEMENT, Marginals, Measured};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::error::Error;

/// A problem as the script reads it; probabilities only where they are exact.
#[derive(Serialize)]
struct Problem<'a> {
    name: String,
    miss: &'a [f64],
    hit: &'a [Vec<f64>],
    marginals: Option<&'a Marginals>,
}

impl<'a> From<&'a Measured> for Problem<'a> {
    fn from(measured: &'a Measured) -> Self {
        let problem = &measured.problem;
        let marginals = measured.exact().map(|run| &run.marginals);
        Self { name: problem.name(), miss: &problem.miss, hit: &problem.hit, marginals }
    }
}

/// What the script found.
#[derive(Default, Deserialize)]
pub struct Pyehm {
    pub version: String,
    /// Seconds of a call that has one track and one detection to associate: the way from Python and back
    pub call: f64,
    /// Seconds after which a problem is given up
    pub limit: f64,
    /// Seconds by the name of the problem; `None` where given up
    pub seconds: HashMap<String, Option<f64>>,
    /// The largest difference from our exact probabilities
    difference: f64,
}

/// Nothing timed where there is no PyEHM: the script says why.
pub fn run(all: &[Measured]) -> Result<Pyehm, Box<dyn Error>> {
    let problems: Vec<_> = all.iter().map(Problem::from).collect();
    let Some(pyehm) = ask::<Pyehm>("time_pyehm.py", &problems)? else { return Ok(Pyehm::default()) };
    if pyehm.difference > AGREEMENT {
        return Err(format!("PyEHM and f64 differ by {}", pyehm.difference).into());
    }
    Ok(pyehm)
}
