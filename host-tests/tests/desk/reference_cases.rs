//! The filters against their reference cases (`cases/*.json`), computed elsewhere at 50 digits and cross-checked with
//! three other libraries.
//!
//! Every result is removed from a file, filled in by `solve`, and compared: vectors and matrices by the largest
//! deviation over the largest reference entry, probabilities absolutely, sets exactly. Tolerances are those of each
//! file's `meta.tolerance`; in single precision a million times as wide, which is a relative 1e-3 for most and what
//! a unit roundoff of 6e-8 leaves after twenty to forty steps.

use host_tests::{Precision, solve};
use serde_json::Value;
use std::error::Error;
use std::path::Path;

/// How a field is compared.
#[derive(Clone, Copy, PartialEq)]
enum Mode {
    Relative,
    Absolute,
    Equal,
}
use Mode::{Absolute, Equal, Relative};

/// A field of a case, or of each of its steps, with its tolerance in double precision.
type Compared = (&'static str, &'static str, Mode, f64);

const KF: &[Compared] = &[
    ("steps", "x", Relative, 1e-9),
    ("steps", "P", Relative, 1e-9),
    ("steps", "nis", Relative, 1e-8),
    ("steps", "loglik", Relative, 1e-8),
];
const NONLINEAR: &[Compared] = &[("steps", "x", Relative, 1e-8), ("steps", "P", Relative, 1e-8), ("steps", "nis", Relative, 1e-7)];
const IMM: &[Compared] = &[("steps", "mu", Absolute, 1e-9), ("steps", "x", Relative, 1e-9), ("steps", "P", Relative, 1e-9)];
const PDA: &[Compared] = &[
    ("", "validated", Equal, 0.0),
    ("parametric", "beta", Absolute, 1e-10),
    ("parametric", "x", Relative, 1e-9),
    ("parametric", "P", Relative, 1e-9),
    ("nonparametric", "beta", Absolute, 1e-10),
    ("nonparametric", "x", Relative, 1e-9),
    ("nonparametric", "P", Relative, 1e-9),
];
const IMMPDAF: &[Compared] =
    &[("steps", "validated", Equal, 0.0), ("steps", "mu", Absolute, 1e-8), ("steps", "x", Relative, 1e-8), ("steps", "P", Relative, 1e-8)];

const JPDA: &[Compared] = &[("", "beta", Absolute, 1e-9)];
const IMMJPDAF: &[Compared] = &[
    ("targets", "beta", Absolute, 1e-8),
    ("targets", "mu", Absolute, 1e-8),
    ("targets", "x", Relative, 1e-8),
    ("targets", "P", Relative, 1e-8),
];

const LMS: &[Compared] = &[
    ("steps", "run", Equal, 0.0),
    ("steps", "union", Equal, 0.0),
    ("steps", "next", Equal, 0.0),
    ("steps", "mu", Absolute, 1e-8),
    ("steps", "x", Relative, 1e-8),
    ("steps", "P", Relative, 1e-8),
];

const COUPLED_SCAN: &[Compared] = &[
    ("result.consistent", "P_merged", Absolute, 1e-8),
    ("result.consistent", "marginal", Absolute, 1e-8),
    ("result.consistent", "x", Relative, 1e-8),
    ("result.consistent", "P", Relative, 1e-8),
];
const COUPLED_CYCLE: &[Compared] = &[
    ("result.consistent", "mu1", Absolute, 1e-8),
    ("result.consistent", "mu2", Absolute, 1e-8),
    ("result.consistent", "x", Relative, 1e-8),
    ("result.consistent", "P", Relative, 1e-8),
];

const GLMB: &[Compared] = &[
    ("steps", "cardinality", Absolute, 1e-7),
    ("labels", "label", Equal, 0.0),
    ("labels", "r", Absolute, 1e-7),
    ("labels", "x", Relative, 1e-6),
    ("labels", "mode", Absolute, 1e-6),
];

/// What `solve` may read of a step; all else is a result, as is of a case what is named here.
const STEP_INPUTS: [&str; 5] = ["z", "F", "Q", "H", "R"];
const PDA_RESULTS: &[&str] = &["d2_all", "validated", "z_pred", "S", "K", "V", "parametric", "nonparametric"];
const JPDA_RESULTS: &[&str] = &["n_events", "infeasible", "log_total", "beta", "log_beta", "kbest", "validated", "m"];

fn strip(kind: &str, file: &mut Value) {
    let results: &[&str] = match kind {
        // K is an input there: the least number of modes.
        "lms" => &[],
        _ if kind.starts_with("coupled") => &["result"],
        "glmb" => &["steps"],
        _ if kind.starts_with("jpda") => JPDA_RESULTS,
        _ => PDA_RESULTS,
    };
    for case in file["cases"].as_array_mut().into_iter().flatten().filter_map(Value::as_object_mut) {
        case.retain(|key, _| !results.contains(&key.as_str()));
        for step in case.get_mut("steps").and_then(Value::as_array_mut).into_iter().flatten().filter_map(Value::as_object_mut) {
            step.retain(|key, _| STEP_INPUTS.contains(&key.as_str()));
        }
    }
}

fn flat(value: &Value, out: &mut Vec<f64>) {
    match value {
        Value::Array(entries) => entries.iter().for_each(|entry| flat(entry, out)),
        Value::Null => {}
        other => out.push(other.as_f64().unwrap_or(f64::NAN)),
    }
}

fn deviation(mode: Mode, reference: &Value, solved: &Value) -> f64 {
    let (mut r, mut s) = (Vec::new(), Vec::new());
    flat(reference, &mut r);
    flat(solved, &mut s);
    if r.len() != s.len() || s.iter().any(|v| v.is_nan()) || (mode == Equal && r != s) {
        return f64::INFINITY;
    }
    let worst = r.iter().zip(&s).map(|(r, s)| (r - s).abs()).fold(0.0, f64::max);
    let largest = r.iter().map(|r| r.abs()).fold(1e-300, f64::max);
    if mode == Relative { worst / largest } else { worst }
}

/// The values of a field: of the case, of a container in it, of every step, or of every target or label of every step.
fn pick<'a>(case: &'a Value, container: &str, field: &str) -> Vec<&'a Value> {
    match container {
        "" => vec![&case[field]],
        "targets" | "labels" => {
            let targets = case["steps"].as_array().into_iter().flatten().filter_map(|step| step[container].as_array()).flatten();
            targets.map(|target| &target[field]).collect()
        }
        "steps" => case["steps"].as_array().into_iter().flatten().map(|step| &step[field]).collect(),
        other => vec![&other.split('.').fold(case, |value, key| &value[key])[field]],
    }
}

fn hold(kind: &str, precision: Precision, scale: f64, fields: &[Compared]) -> Result<(), Box<dyn Error>> {
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("cases/{kind}.json"));
    let reference: Value = serde_json::from_str(&std::fs::read_to_string(cases)?)?;
    let mut bare = reference.clone();
    strip(kind, &mut bare);
    let dir = tempfile::tempdir()?;
    let (input, output) = (dir.path().join("in.json"), dir.path().join("out.json"));
    std::fs::write(&input, bare.to_string())?;
    solve::run(&input, &output, precision)?;
    let solved: Value = serde_json::from_str(&std::fs::read_to_string(&output)?)?;
    let (references, solutions) = (reference["cases"].as_array().ok_or("no cases")?, solved["cases"].as_array().ok_or("no cases")?);
    assert_eq!(references.len(), solutions.len());
    let mut faults = Vec::new();
    for (r, s) in references.iter().zip(solutions) {
        assert_eq!(r["name"], s["name"]);
        let name = r["name"].as_str().unwrap_or_default();
        let ill = name.starts_with("ill_conditioned");
        // Sigma points at α = 1e-3 carry weights of a million that cancel; the reference allows for it.
        let cancelling = if r["alpha"].as_f64().is_some_and(|alpha| alpha <= 0.01) { 1e3 } else { 1.0 };
        for &(container, field, mode, tolerance) in fields {
            // P0 of the ill-conditioned case spans ten decades: in double precision 1e-3 is asked of P, in single x alone.
            let allowed = match (ill && field != "x", precision) {
                (true, Precision::F32) => continue,
                (true, Precision::F64) => 1e6,
                (false, _) => cancelling,
            };
            let limit = tolerance * scale * allowed;
            let (rs, ss) = (pick(r, container, field), pick(s, container, field));
            assert_eq!(rs.len(), ss.len());
            let worst = rs.iter().zip(ss).map(|(r, s)| deviation(mode, r, s)).fold(0.0, f64::max);
            if worst > limit {
                faults.push(format!("{kind} {name} {container}.{field}: {worst:e} > {limit:e}"));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    Ok(())
}

macro_rules! held {
    ($($test:ident: $kind:literal $precision:ident $scale:literal $fields:ident;)*) => {
        $(
            #[test]
            fn $test() -> Result<(), Box<dyn Error>> {
                hold($kind, Precision::$precision, $scale, $fields)
            }
        )*
    };
}
held! {
    kf_in_double_precision: "kf" F64 1.0 KF;
    ekf_in_double_precision: "ekf" F64 1.0 NONLINEAR;
    ukf_in_double_precision: "ukf" F64 1.0 NONLINEAR;
    imm_in_double_precision: "imm" F64 1.0 IMM;
    pda_in_double_precision: "pda" F64 1.0 PDA;
    immpdaf_in_double_precision: "immpdaf" F64 1.0 IMMPDAF;
    jpda_in_double_precision: "jpda" F64 1.0 JPDA;
    large_jpda_in_double_precision: "jpda_large" F64 1.0 JPDA;
    nonparametric_jpda_in_double_precision: "jpda_nonparametric" F64 1.0 JPDA;
    immjpdaf_in_double_precision: "immjpdaf" F64 1.0 IMMJPDAF;
    lms_in_double_precision: "lms" F64 1.0 LMS;
    coupled_scan_in_double_precision: "coupled_jpdam" F64 1.0 COUPLED_SCAN;
    coupled_cycle_in_double_precision: "coupled_cycle" F64 1.0 COUPLED_CYCLE;
    glmb_in_double_precision: "glmb" F64 1.0 GLMB;
    kf_in_single_precision: "kf" F32 1e6 KF;
    ekf_in_single_precision: "ekf" F32 1e6 NONLINEAR;
    imm_in_single_precision: "imm" F32 1e6 IMM;
    pda_in_single_precision: "pda" F32 1e6 PDA;
    immpdaf_in_single_precision: "immpdaf" F32 1e6 IMMPDAF;
    jpda_in_single_precision: "jpda" F32 1e6 JPDA;
    large_jpda_in_single_precision: "jpda_large" F32 1e6 JPDA;
    nonparametric_jpda_in_single_precision: "jpda_nonparametric" F32 1e6 JPDA;
    immjpdaf_in_single_precision: "immjpdaf" F32 1e6 IMMJPDAF;
    lms_in_single_precision: "lms" F32 1e6 LMS;
    coupled_scan_in_single_precision: "coupled_jpdam" F32 1e6 COUPLED_SCAN;
    coupled_cycle_in_single_precision: "coupled_cycle" F32 1e6 COUPLED_CYCLE;
    glmb_in_single_precision: "glmb" F32 1e3 GLMB;
}

/// Single precision cannot hold sigma points with α = 1e-3: their distance from the mean is 2e-3 standard deviations, a
/// few units in the last place of the coordinates, and is divided by α² again. With α = 0.5 it holds them like an EKF.
#[test]
fn ukf_in_single_precision_holds_except_for_tiny_spreads() -> Result<(), Box<dyn Error>> {
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/ukf.json");
    let mut file: Value = serde_json::from_str(&std::fs::read_to_string(cases)?)?;
    let list = file["cases"].as_array_mut().ok_or("no cases")?;
    list.retain(|case| case["alpha"].as_f64().is_some_and(|alpha| alpha > 0.01));
    assert_eq!(list.len(), 3);
    let dir = tempfile::tempdir()?;
    let (input, output) = (dir.path().join("in.json"), dir.path().join("out.json"));
    std::fs::write(&input, file.to_string())?;
    solve::run(&input, &output, Precision::F32)?;
    let solved: Value = serde_json::from_str(&std::fs::read_to_string(&output)?)?;
    for (r, s) in file["cases"].as_array().into_iter().flatten().zip(solved["cases"].as_array().into_iter().flatten()) {
        for (container, field, mode, tolerance) in NONLINEAR {
            for (r, s) in pick(r, container, field).iter().zip(pick(s, container, field)) {
                assert!(deviation(*mode, r, s) <= tolerance * 1e6, "{field}");
            }
        }
    }
    Ok(())
}

#[test]
fn broken_file_is_named_with_its_line() -> Result<(), Box<dyn Error>> {
    let dir = tempfile::tempdir()?;
    let (input, output) = (dir.path().join("in.json"), dir.path().join("out.json"));
    std::fs::write(&input, "{\"meta\": {},\n \"cases\": [NaN]}")?;
    let failure = solve::run(&input, &output, Precision::F64);
    assert!(failure.is_err_and(|f| f.to_string().contains("in.json, line 2: not valid JSON")));
    assert!(!output.exists());
    Ok(())
}
