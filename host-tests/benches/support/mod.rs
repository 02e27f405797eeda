//! What the benchmarks share: times that what else the machine does only adds to, and Python beside us.

use criterion::BenchmarkGroup;
use criterion::measurement::WallTime;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::error::Error;
use std::path::Path;
use std::time::Instant;
use std::{env, fs, process};

/// Lets criterion time `routine`, and returns the seconds per call in the shortest of its batches. `None` where the command
/// line leaves it out.
pub fn shortest(group: &mut BenchmarkGroup<'_, WallTime>, name: &str, mut routine: impl FnMut()) -> Option<f64> {
    let mut shortest: Option<f64> = None;
    group.bench_function(name, |bencher| {
        bencher.iter_custom(|calls| {
            let start = Instant::now();
            (0..calls).for_each(|_| routine());
            let elapsed = start.elapsed();
            let seconds = elapsed.as_secs_f64() / calls as f64;
            shortest = Some(shortest.map_or(seconds, |s| s.min(seconds)));
            elapsed
        });
    });
    shortest
}

/// What the script `benches/SCRIPT` makes of `question`, in the Python that `PYTHON` names; `None` where it cannot: the
/// script says why.
pub fn ask<A: DeserializeOwned>(script: &str, question: &impl Serialize) -> Result<Option<A>, Box<dyn Error>> {
    let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join(script);
    fs::create_dir_all(&dir)?;
    let (asked, answered) = (dir.join("question.json"), dir.join("answer.json"));
    fs::write(&asked, serde_json::to_vec(question)?)?;
    let python = env::var_os("PYTHON").unwrap_or_else(|| "python3".into());
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches").join(script);
    let ended_well = process::Command::new(&python).arg(&script).args([&asked, &answered]).status().is_ok_and(|status| status.success());
    if !ended_well {
        eprintln!("nothing from {} by {}", script.display(), python.display());
        return Ok(None);
    }
    Ok(Some(serde_json::from_slice(&fs::read(&answered)?)?))
}

/// A ratio for the table.
pub fn times(ratio: f64) -> String {
    match ratio {
        r if r < 0.095 => format!("x{r:.3}"),
        r if r < 9.95 => format!("x{r:.1}"),
        r => format!("x{r:.0}"),
    }
}
