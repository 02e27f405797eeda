//! Scenario `kashyap-b` in a short, fixed-seed form: the figures of the scenario's acceptance must be in reach of twelve runs.

use host_tests::Precision;
use host_tests::scenario::{Metrics, Order, SCENARIOS};
use std::error::Error;

fn metrics(seed: u64, precision: Precision) -> Result<Vec<Metrics>, Box<dyn Error>> {
    let scenario = SCENARIOS.iter().find(|s| s.name == "kashyap-b").ok_or("no such scenario")?;
    let order = Order { runs: 12, seed, precision, filters: scenario.filters.to_vec(), pictures: false };
    Ok((scenario.run)(&order)?.filters.into_iter().map(|f| f.metrics).collect())
}

#[test]
fn four_targets_are_four_tracks_and_one_of_them_manoeuvres() -> Result<(), Box<dyn Error>> {
    for precision in [Precision::F32, Precision::F64] {
        let results = metrics(500_000, precision)?;
        assert_eq!(results.len(), 4);
        let of = |filter: usize, name: &str| results[filter].get(name).copied().flatten().ok_or("no value");
        for filter in 1..4 {
            assert!(of(filter, "exactly_four_fraction")? >= 0.99);
            assert!(of(filter, "rms_t1")? <= 2.0 && of(filter, "p_manoeuvre_t1")? >= 0.8 && of(filter, "p_manoeuvre_other")? <= 0.2);
            // Two deviations above the mean of twelve, if each were χ² with four degrees of freedom.
            assert!(of(filter, "nees_t1")? <= 4.0 * (1.0 + 2.0 * (2.0 / 48.0f64).sqrt()));
        }
        assert!(of(1, "rms_t2")? <= 1.6 && of(2, "rms_t2")? <= 1.6);
        // Two covariances of one size: intersection claims twice what the convex rule claims.
        assert!((of(1, "nees_t1")? / of(2, "nees_t1")? - 2.0).abs() < 0.05);
        assert!(of(0, "exactly_four_fraction")? < 0.99, "the printed form loses tracks");
    }
    Ok(())
}

#[test]
fn the_same_seed_gives_the_same_figures() -> Result<(), Box<dyn Error>> {
    assert_eq!(metrics(7, Precision::F32)?, metrics(7, Precision::F32)?);
    Ok(())
}
