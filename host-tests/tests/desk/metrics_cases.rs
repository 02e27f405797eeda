//! The metrics against their reference cases, `cases/metrics.json`, computed elsewhere at 50 digits.
//!
//! All results are removed from the file, filled in by `solve`, and then every number of it is compared:
//! relative deviation at most 1e-10 (chi-square quantiles 1e-8, see the file's `meta.tolerance`).

use host_tests::{Precision, solve};
use serde_json::{Map, Value};
use std::error::Error;
use std::path::Path;

const RESULTS: [&str; 9] = ["ospa_p1", "gospa_p1", "ospa_p2", "gospa_p2", "nees", "mean_nees", "anees", "chi2_95", "consistent"];

fn stripped(value: &Value) -> Value {
    match value {
        Value::Object(fields) => {
            let inputs = fields.iter().filter(|(key, value)| !RESULTS.contains(&key.as_str()) || is_list_of_cases(value));
            Value::Object(inputs.map(|(key, value)| (key.clone(), stripped(value))).collect::<Map<_, _>>())
        }
        Value::Array(entries) => entries.iter().map(stripped).collect(),
        other => other.clone(),
    }
}

/// The list `nees` of the file has the name of a result but is none.
fn is_list_of_cases(value: &Value) -> bool {
    value.as_array().is_some_and(|entries| entries.iter().any(Value::is_object))
}

fn compare(reference: &Value, solved: &Value, tolerance: f64, path: &str, faults: &mut Vec<String>) {
    match (reference, solved) {
        (Value::Object(r), Value::Object(s)) => r
            .iter()
            .for_each(|(key, value)| compare(value, s.get(key).unwrap_or(&Value::Null), tolerance, &format!("{path}.{key}"), faults)),
        (Value::Array(r), Value::Array(s)) if r.len() == s.len() => {
            r.iter().zip(s).enumerate().for_each(|(i, (r, s))| compare(r, s, tolerance, &format!("{path}[{i}]"), faults));
        }
        (Value::Number(r), Value::Number(s)) => {
            let (r, s) = (r.as_f64().unwrap_or(f64::NAN), s.as_f64().unwrap_or(f64::NAN));
            if (r - s).abs() > tolerance * r.abs() || s.is_nan() {
                faults.push(format!("{path}: {s}, expected {r}"));
            }
        }
        _ if reference == solved => {}
        _ => faults.push(format!("{path}: {solved}, expected {reference}")),
    }
}

#[test]
fn every_number_of_the_reference_is_met() -> Result<(), Box<dyn Error>> {
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/metrics.json");
    let mut reference: Value = serde_json::from_str(&std::fs::read_to_string(cases)?)?;
    let dir = tempfile::tempdir()?;
    let (input, output) = (dir.path().join("in.json"), dir.path().join("out.json"));
    let mut bare = stripped(&reference);
    for entry in bare["chi2_quantiles_dof_p_value"].as_array_mut().into_iter().flatten() {
        entry.as_array_mut().ok_or("not a list")?.truncate(2);
    }
    std::fs::write(&input, bare.to_string())?;
    solve::run(&input, &output, Precision::F64)?;
    let mut solved: Value = serde_json::from_str(&std::fs::read_to_string(&output)?)?;

    let mut faults = Vec::new();
    let quantiles = [&mut reference, &mut solved].map(|file| file["chi2_quantiles_dof_p_value"].take());
    compare(&quantiles[0], &quantiles[1], 1e-8, "quantiles", &mut faults);
    compare(&reference, &solved, 1e-10, "", &mut faults);
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    Ok(())
}
