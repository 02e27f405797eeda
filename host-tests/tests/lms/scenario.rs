//! Scenarios `gomes` and `gomes-abrupt` in a short, fixed-seed form: the statistics that the full runs report must be in reach.
//!
//! Bounds are those of the scenario's acceptance; where a count is compared, with the binomial 99.9 % bound for 60 runs.

use super::Outcome;
use host_tests::Precision;
use host_tests::scenario::{Metrics, Order, SCENARIOS};
use std::error::Error;

fn metrics(scenario: &str, seed: u64, precision: Precision, filters: &[&'static str]) -> Result<Vec<Metrics>, Box<dyn Error>> {
    let scenario = SCENARIOS.iter().find(|s| s.name == scenario).ok_or("no such scenario")?;
    let order = Order { runs: 60, seed, precision, filters: filters.to_vec(), pictures: false };
    Ok((scenario.run)(&order)?.filters.into_iter().map(|f| f.metrics).collect())
}

fn of(metrics: &Metrics, name: &str) -> Result<f64, Box<dyn Error>> {
    Ok(metrics.get(name).copied().flatten().ok_or("no value")?)
}

#[test]
fn half_the_models_are_as_good_as_all_and_the_printed_forms_swap() -> Outcome {
    let filters = ["IMM-JPDAF paper", "LMS-JPDAF paper", "IMM-JPDAF proper", "LMS-JPDAF proper"];
    for precision in [Precision::F32, Precision::F64] {
        let results = metrics("gomes", 500_000, precision, &filters)?;
        let lost = |filter: usize| of(&results[filter], "swapped_or_lost");
        // Of 60, 5 to 12 in the mean for all modes and 7 to 15.2 for the likely ones.
        assert!((1.0..=25.0).contains(&lost(0)?) && (1.0..=29.0).contains(&lost(1)?), "{} {}", lost(0)?, lost(1)?);
        // 8 of 300 are accepted.
        assert!(lost(2)? <= 6.0 && lost(3)? <= 6.0, "{} {}", lost(2)?, lost(3)?);
        let (imm, lms) = (&results[2], &results[3]);
        assert!(of(lms, "mean_error_ok")? <= 14.5 && of(lms, "mean_active_models")? <= 4.2);
        assert!(of(lms, "peak_ok")? <= 1.08 * of(imm, "peak_ok")?);
        assert_eq!(of(imm, "mean_active_models")?, 7.0);
    }
    Ok(())
}

/// One target in ten is lost without recall, so 60 runs without a loss have a probability of 0.2 %.
#[test]
fn recall_keeps_targets_that_turn_abruptly() -> Outcome {
    let results = metrics("gomes-abrupt", 500_000, Precision::F32, &["LMS-JPDAF proper", "LMS-JPDAF fallback"])?;
    let lost = |filter: usize| of(&results[filter], "swapped_or_lost");
    assert!(lost(0)? >= 1.0 && lost(1)? <= 4.0, "{} without, {} with", lost(0)?, lost(1)?);
    assert!(of(&results[1], "mean_error_ok")? < of(&results[0], "mean_error_ok")?);
    Ok(())
}
