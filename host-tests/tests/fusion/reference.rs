//! All four lists of the reference cases, solved from their inputs and compared with tolerances that their file states.
//!
//! Single precision is given a relative 1e-3 for x and P, as the other kinds, 1e-2 for d² and 1e-2 for a weight: what is looked for
//! is where a function is flat.

use host_tests::{Precision, solve};
use serde_json::Value;
use std::error::Error;
use std::path::Path;

/// List, path to the values (`[]` walks a list), and the tolerance in double and in single precision.
type Compared = (&'static str, &'static str, Measure, f64, f64);

#[derive(Clone, Copy, PartialEq)]
enum Measure {
    /// The largest deviation over the largest entry
    Relative,
    Absolute,
    Equal,
}
use Measure::{Absolute, Equal, Relative};

const FIELDS: &[Compared] = &[
    ("cases", "det.omega", Absolute, 1e-4, 1e-2),
    ("cases", "det.x", Relative, 1e-6, 1e-3),
    ("cases", "det.P", Relative, 1e-6, 1e-3),
    ("cases", "det.log_det", Relative, 1e-9, 1e-3),
    ("cases", "trace.omega", Absolute, 1e-4, 1e-2),
    ("cases", "trace.x", Relative, 1e-6, 1e-3),
    ("cases", "trace.P", Relative, 1e-6, 1e-3),
    ("cases", "trace.trace", Relative, 1e-9, 1e-3),
    ("cases", "fixed[].x", Relative, 1e-9, 1e-3),
    ("cases", "fixed[].P", Relative, 1e-9, 1e-3),
    ("bar_shalom_campo", "x", Relative, 1e-9, 1e-3),
    ("bar_shalom_campo", "P", Relative, 1e-9, 1e-3),
    ("bar_shalom_campo", "x_indep", Relative, 1e-9, 1e-3),
    ("bar_shalom_campo", "P_indep", Relative, 1e-9, 1e-3),
    ("bar_shalom_campo", "d2", Relative, 1e-8, 1e-2),
    ("bar_shalom_campo", "d2_indep", Relative, 1e-8, 1e-2),
    ("bar_shalom_campo", "threshold", Relative, 1e-9, 1e-9),
    ("bar_shalom_campo", "same_target", Equal, 0.0, 0.0),
    ("bar_shalom_campo", "same_target_indep", Equal, 0.0, 0.0),
    ("cross_covariance_runs", "steps[].P12", Relative, 1e-9, 1e-3),
    ("cross_covariance_runs", "steps[].x", Relative, 1e-9, 1e-3),
    ("cross_covariance_runs", "steps[].P", Relative, 1e-9, 1e-3),
    ("cross_covariance_runs", "steps[].d2", Relative, 1e-8, 1e-2),
    ("assignment", "d2", Relative, 1e-9, 1e-3),
    ("assignment", "assignment", Equal, 0.0, 0.0),
    ("assignment", "cost", Relative, 1e-9, 1e-3),
];

/// Inputs of all lists; everything else is a result and taken out.
const INPUTS: [&str; 23] = [
    "name",
    "n",
    "x1",
    "P1",
    "x2",
    "P2",
    "P12",
    "alpha",
    "F",
    "Q",
    "H1",
    "R1",
    "H2",
    "R2",
    "x0",
    "P0",
    "P12_0",
    "tracks1",
    "tracks2",
    "threshold",
    "steps",
    "fixed",
    "omega",
];

fn bare(list: &str, value: &mut Value) {
    let keep = |key: &str| match list {
        "steps" => ["z1", "z2"].contains(&key),
        "bar_shalom_campo" => INPUTS.contains(&key) && key != "threshold",
        "fixed" => key == "omega",
        _ => INPUTS.contains(&key),
    };
    for entry in value.as_array_mut().into_iter().flatten().filter_map(Value::as_object_mut) {
        entry.retain(|key, _| keep(key));
        for nested in ["steps", "fixed"] {
            if let Some(value) = entry.get_mut(nested) {
                bare(nested, value);
            }
        }
    }
}

fn pick<'a>(value: &'a Value, path: &str) -> Vec<&'a Value> {
    let Some((head, rest)) = path.split_once('.') else { return vec![&value[path]] };
    match head.strip_suffix("[]") {
        Some(list) => value[list].as_array().into_iter().flatten().flat_map(|entry| pick(entry, rest)).collect(),
        None => pick(&value[head], rest),
    }
}

fn flat(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(entries) => entries.iter().flat_map(flat).collect(),
        Value::Null => vec![],
        other => vec![other.as_f64().unwrap_or(f64::NAN)],
    }
}

fn deviation(measure: Measure, reference: &Value, solved: &Value) -> f64 {
    let (r, s) = (flat(reference), flat(solved));
    if measure == Equal || r.len() != s.len() {
        return if reference == solved { 0.0 } else { f64::INFINITY };
    }
    let worst = r.iter().zip(&s).map(|(r, s)| (r - s).abs()).fold(0.0, |a: f64, b| if b.is_nan() { f64::INFINITY } else { a.max(b) });
    let largest = r.iter().map(|r| r.abs()).fold(f64::MIN_POSITIVE, f64::max);
    if measure == Relative { worst / largest } else { worst }
}

fn hold(precision: Precision) -> Result<(), Box<dyn Error>> {
    let reference: Value =
        serde_json::from_str(&std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/fusion.json"))?)?;
    let mut input = reference.clone();
    for list in ["cases", "bar_shalom_campo", "cross_covariance_runs", "assignment"] {
        bare(list, &mut input[list]);
    }
    let dir = tempfile::tempdir()?;
    let (file, output) = (dir.path().join("in.json"), dir.path().join("out.json"));
    std::fs::write(&file, input.to_string())?;
    solve::run(&file, &output, precision)?;
    let solved: Value = serde_json::from_str(&std::fs::read_to_string(&output)?)?;
    let mut faults = Vec::new();
    for &(list, path, measure, double, single) in FIELDS {
        let limit = if precision == Precision::F64 { double } else { single };
        let (references, solutions) = (reference[list].as_array().ok_or("no list")?, solved[list].as_array().ok_or("no list")?);
        assert_eq!(references.len(), solutions.len());
        for (r, s) in references.iter().zip(solutions) {
            assert_eq!(r["name"], s["name"]);
            let (rs, ss) = (pick(r, path), pick(s, path));
            assert!(!rs.is_empty() && rs.len() == ss.len(), "{list} {path}: {} values for {}", ss.len(), rs.len());
            let worst = rs.iter().zip(ss).map(|(r, s)| deviation(measure, r, s)).fold(0.0, f64::max);
            if worst > limit {
                faults.push(format!("{list} {} {path}: {worst:e} > {limit:e}", r["name"]));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    Ok(())
}

#[test]
fn fusion_in_double_precision() -> Result<(), Box<dyn Error>> {
    hold(Precision::F64)
}

#[test]
fn fusion_in_single_precision() -> Result<(), Box<dyn Error>> {
    hold(Precision::F32)
}
