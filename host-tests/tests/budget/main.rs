//! Work against the formulas of the worst case, in a build that counts; and the cycles published against what the work amounts to.

mod association;
#[path = "../support/counting.rs"]
mod counting;
mod coupled;
mod fusion;
mod labelled;
mod trackers;

use std::error::Error;
use std::path::Path;
use std::sync::Mutex;

type Outcome = Result<(), Box<dyn Error>>;

/// The library counts for all threads together.
static COUNTER: Mutex<()> = Mutex::new(());

/// The figures of the images.
fn published() -> Result<toml::Table, Box<dyn Error>> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../firmware-example/budget.toml");
    Ok(std::fs::read_to_string(file)?.parse()?)
}
