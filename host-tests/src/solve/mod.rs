//! The command `solve`: fills a file of reference cases with what the library computes.
//!
//! A case file is `{"meta": {"file": KIND, ..}, "cases": [..], further lists ..}`, with or without its
//! result fields. The output is the same file: same order, same names, all input fields, and the result
//! fields of every case replaced by ours. Two programs then compare it with the reference.
//!
//! A kind is a module `solve/KIND.rs` with a [`CaseSolver`] per list; it registers by its entry in
//! `KINDS`. A solver returns *results only*; they are laid over the case by [`overlay`]: objects key by
//! key, lists of objects (`steps`) entry by entry, anything else as a whole.

mod coupled;
pub mod field;
mod fusion;
mod glmb;
mod imm;
mod jpda;
mod kf;
mod lms;
mod metrics;
mod nonlinear;
mod pda;
mod sizes;

use crate::{Failure, Precision, output};
use field::Field;
use serde_json::Value;
use std::path::Path;

/// Solves one entry of a list: takes the entry, returns its result fields.
pub type CaseSolver = fn(&Field<'_>, Precision) -> Result<Value, Failure>;

/// A kind of case file.
#[derive(Debug, Clone, Copy)]
pub struct Kind {
    /// The value of `meta.file`.
    pub name: &'static str,
    /// The lists it holds and the solver of their entries. The first must be there, others may be missing.
    pub lists: &'static [(&'static str, CaseSolver)],
}

/// Every kind that `solve` knows.
static KINDS: &[Kind] = &[
    kf::KIND,
    nonlinear::EKF,
    nonlinear::UKF,
    imm::KIND,
    pda::PDA,
    pda::IMMPDAF,
    jpda::JPDA,
    jpda::LARGE,
    jpda::NONPARAMETRIC,
    jpda::IMMJPDAF,
    lms::KIND,
    metrics::KIND,
    fusion::KIND,
    coupled::ONE_SCAN,
    coupled::CYCLE,
    glmb::KIND,
];

/// The command `solve`.
pub fn run(input: &Path, output: &Path, precision: Precision) -> Result<(), Failure> {
    output::check_target(output)?;
    let text = output::read_text(input)?;
    let file: Value = serde_json::from_str(&text).map_err(|error| Failure::at_line(input, error.line() as u64, json_reason(&error)))?;
    let solved = solve(KINDS, file, precision).map_err(|failure| failure.in_file(input))?;
    let mut text = solved.to_string();
    text.push('\n');
    output::write_file(output, text.as_bytes())
}

/// Fills in the results of all lists of a case file.
fn solve(kinds: &[Kind], mut file: Value, precision: Precision) -> Result<Value, Failure> {
    let root = Field::root(&file, "");
    let name = root.get("meta")?.get("file")?.text()?;
    let kind = kinds
        .iter()
        .find(|kind| kind.name == name)
        .ok_or_else(|| Failure::unknown("kind", name, kinds.iter().map(|kind| kind.name)))
        .map_err(|failure| failure.within("meta.file"))?;
    for (position, (list, solver)) in kind.lists.iter().enumerate() {
        let root = Field::root(&file, "");
        let Some(entries) = root.find(list)? else {
            if position == 0 {
                return Err(Failure::at_field(list, "missing"));
            }
            continue;
        };
        let results: Vec<Value> =
            entries.items()?.iter().map(|entry| solver(&entry.renamed(entry_name(entry)), precision)).collect::<Result<_, _>>()?;
        overlay(&mut file[*list], Value::Array(results));
    }
    Ok(file)
}

/// How messages call an entry: by its name if it has one, by its place otherwise.
fn entry_name(entry: &Field<'_>) -> String {
    match entry.value()["name"].as_str() {
        Some(name) => format!("case {name}"),
        None => entry.path().to_owned(),
    }
}

/// Lays `result` over `target`.
///
/// Objects merge key by key; lists of the same length merge entry by entry where both entries are
/// objects or such lists themselves; everything else is replaced.
pub fn overlay(target: &mut Value, result: Value) {
    match (target, result) {
        (Value::Object(target), Value::Object(result)) => {
            for (key, value) in result {
                overlay(target.entry(key).or_insert(Value::Null), value);
            }
        }
        (Value::Array(target), Value::Array(result)) if target.len() == result.len() => {
            target.iter_mut().zip(result).for_each(|(target, result)| overlay(target, result));
        }
        (target, result) => *target = result,
    }
}

/// The parser's reason without the position, which the failure already names.
fn json_reason(error: &serde_json::Error) -> String {
    let text = error.to_string();
    let reason = text.split(" at line ").next().unwrap_or_default();
    format!("not valid JSON: {reason} (column {})", error.column())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// Doubles `x` of the case and of every step.
    fn double(case: &Field<'_>, _: Precision) -> Result<Value, Failure> {
        let twice = |field: &Field<'_>| Ok(2.0 * field.get("x")?.number::<f64>()?);
        let steps: Vec<_> =
            case.get("steps")?.items()?.iter().map(|step| Ok(json!({"y": twice(step)?}))).collect::<Result<_, Failure>>()?;
        Ok(json!({"y": twice(case)?, "steps": steps}))
    }

    const TOY: Kind = Kind { name: "toy", lists: &[("cases", double), ("more", double)] };

    fn solved(file: Value) -> Result<Value, String> {
        solve(&[TOY], file, Precision::F64).map_err(|failure| failure.to_string())
    }

    #[test]
    fn results_are_laid_over_the_inputs_in_order() {
        let file = json!({"meta": {"file": "toy"}, "note": "kept", "cases": [
            {"name": "a", "x": 1, "y": null, "steps": [{"x": 2, "y": -1.0, "z": null}]},
            {"name": "b", "x": 3, "steps": []},
        ]});
        let expected = json!({"meta": {"file": "toy"}, "note": "kept", "cases": [
            {"name": "a", "x": 1, "y": 2.0, "steps": [{"x": 2, "y": 4.0, "z": null}]},
            {"name": "b", "x": 3, "steps": [], "y": 6.0},
        ]});
        assert_eq!(solved(file), Ok(expected));
    }

    #[test]
    fn failures_name_the_case_and_the_field() {
        for (file, expected) in [
            (json!([]), "not an object"),
            (json!({}), "meta: missing"),
            (json!({"meta": {"file": "kalman"}, "cases": []}), "meta.file: unknown kind \"kalman\"; known: toy"),
            (json!({"meta": {"file": "toy"}}), "cases: missing"),
            (json!({"meta": {"file": "toy"}, "cases": {}}), "cases: not a list"),
            (json!({"meta": {"file": "toy"}, "cases": [{"name": "a", "steps": []}]}), "case a: x: missing"),
            (json!({"meta": {"file": "toy"}, "cases": [{"name": "a", "x": 1, "steps": [{"x": "?"}]}]}), "case a: steps[0].x: not a number"),
            (json!({"meta": {"file": "toy"}, "cases": [7]}), "cases[0]: not an object"),
        ] {
            assert_eq!(solved(file), Err(expected.to_owned()));
        }
    }

    #[test]
    fn overlay_replaces_what_it_cannot_merge() {
        let mut target = json!({"m": [[1, 2], [3, 4]], "v": [1, 2, 3], "s": 1});
        overlay(&mut target, json!({"m": [[5, 6], [7, 8]], "v": [9], "s": {"t": null}}));
        assert_eq!(target, json!({"m": [[5, 6], [7, 8]], "v": [9], "s": {"t": null}}));
    }
}
