//! Scenarios `jms-glmb-linear` and `jms-glmb-nonlinear` in a short, fixed-seed form: the statistics that the full runs report
//! must be in reach. Bounds are those of the scenario's acceptance, with four standard errors of so few runs.

use super::Outcome;
use host_tests::Precision;
use host_tests::scenario::{Metrics, Order, SCENARIOS};
use std::error::Error;

fn metrics(scenario: &str, runs: u64, precision: Precision, filters: &[&'static str]) -> Result<Vec<Metrics>, Box<dyn Error>> {
    let scenario = SCENARIOS.iter().find(|s| s.name == scenario).ok_or("no such scenario")?;
    let order = Order { runs, seed: 500_000, precision, filters: filters.to_vec(), pictures: false };
    Ok((scenario.run)(&order)?.filters.into_iter().map(|f| f.metrics).collect())
}

fn of(metrics: &Metrics, name: &str) -> Result<f64, Box<dyn Error>> {
    Ok(metrics.get(name).copied().flatten().ok_or("no value")?)
}

#[test]
fn five_hypotheses_are_enough_and_modes_tell_turns_from_straight_flight() -> Outcome {
    for precision in [Precision::F32, Precision::F64] {
        let results = metrics("jms-glmb-linear", 16, precision, &["GLMB 100", "GLMB 5", "GLMB tuned", "CV GLMB"])?;
        let [hundred, five, tuned, single] = &results[..] else { return Err("four filters".into()) };
        // A run's mean OSPA scatters by 8 m.
        assert!(of(hundred, "ospa")? < 88.0 && of(five, "ospa")? < 88.0 && of(tuned, "ospa")? < 79.0);
        assert!((of(hundred, "ospa")? - of(five, "ospa")?).abs() < 3.0);
        assert!(of(tuned, "ospa")? <= 0.2 * of(single, "ospa")?);
        assert!(of(hundred, "model_accuracy")? >= 0.92 && of(hundred, "cardinality_error")? <= 0.1);
        assert!(of(tuned, "p_cv_scans_above_0_9")? >= 22.0);
    }
    Ok(())
}

#[test]
fn sigma_points_and_particles_are_as_good() -> Outcome {
    let results = metrics("jms-glmb-nonlinear", 2, Precision::F32, &["GLMB UKF", "GLMB EKF", "GLMB SMC"])?;
    let [unscented, linearised, points] = &results[..] else { return Err("three filters".into()) };
    assert!(of(unscented, "ospa")? < 147.0 && of(unscented, "model_accuracy")? >= 0.87);
    assert!((of(linearised, "ospa")? / of(unscented, "ospa")? - 1.0).abs() < 0.05);
    assert!(of(points, "ospa")? < 1.05 * of(unscented, "ospa")?);
    Ok(())
}
