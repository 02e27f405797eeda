//! Scenario `kashyap-a` in a short, fixed-seed form: the statistics that the full run reports must be in reach.
//!
//! 40 runs are 80 tracks. Bounds are those of the scenario's acceptance, with the binomial 99.9 % bound where a count is
//! compared: of 80 tracks the printed form loses 19 to 32 in the mean of its acceptance, so 9 to 43 here.

use host_tests::Precision;
use host_tests::scenario::{self, Order, SCENARIOS};
use std::error::Error;

fn metrics(seed: u64, precision: Precision, filters: &[&'static str]) -> Result<Vec<scenario::Metrics>, Box<dyn Error>> {
    let scenario = SCENARIOS.iter().find(|s| s.name == "kashyap-a").ok_or("no such scenario")?;
    let order = Order { runs: 40, seed, precision, filters: filters.to_vec(), pictures: false };
    Ok((scenario.run)(&order)?.filters.into_iter().map(|f| f.metrics).collect())
}

#[test]
fn corrected_filters_keep_their_tracks_and_the_printed_one_does_not() -> Result<(), Box<dyn Error>> {
    let filters = ["IMM-PDAF paper case 1", "IMM-PDAF proper case 1", "IMM-PDAF three models"];
    for precision in [Precision::F32, Precision::F64] {
        let results = metrics(500_000, precision, &filters)?;
        let of = |filter: usize, name: &str| results[filter].get(name).copied().flatten().ok_or("no value");
        assert_eq!(of(0, "tracks")?, 80.0);
        assert!((9.0..=43.0).contains(&of(0, "lost")?), "printed form lost {}", of(0, "lost")?);
        assert!(of(1, "lost")? <= 1.0);
        assert_eq!(of(2, "lost")?, 0.0);
        assert!(of(2, "rms_manoeuvre")? <= 11.0 && of(2, "rms_quiet")? <= 5.3 && of(2, "peak")? <= 45.0);
    }
    Ok(())
}

#[test]
fn the_same_seed_gives_the_same_figures() -> Result<(), Box<dyn Error>> {
    let run = || metrics(7, Precision::F32, &["IMM-NN case 1"]);
    assert_eq!(run()?, run()?);
    Ok(())
}
