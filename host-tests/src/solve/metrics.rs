//! Kind `metrics`: OSPA and GOSPA of two point sets, NEES of a set of runs, chi-square quantiles.
//!
//! | list | inputs of an entry | results |
//! |---|---|---|
//! | `cases` | `dim`, `X` (truth), `Y` (estimates), `c` | `ospa_p1`, `gospa_p1`, `ospa_p2`, `gospa_p2` |
//! | `nees` | `n`, `runs`: `error`, `P` | `nees` of each run, `mean_nees`, `anees`, `chi2_95`, `consistent` |
//! | `chi2_quantiles_dof_p_value` | `[dof, p]` or `[dof, p, value]` | `[dof, p, value]` |
//!
//! Definitions: [`crate::metrics`]. These judge the library and are no part of it, so they run in f64
//! whatever the precision asked for.

use super::Kind;
use super::field::{Field, number};
use crate::metrics::{Gospa, Ospa, chi_square_quantile, consistency, gospa, nees, ospa};
use crate::{Failure, Precision};
use serde_json::{Value, json};

/// The kind and its three lists.
pub(super) const KIND: Kind =
    Kind { name: "metrics", lists: &[("cases", point_sets), ("nees", nees_runs), ("chi2_quantiles_dof_p_value", quantile)] };

fn point_sets(case: &Field<'_>, _: Precision) -> Result<Value, Failure> {
    let truth = points(case, "X")?;
    let estimates = points(case, "Y")?;
    let cutoff = case.get("c")?;
    let c = cutoff.number::<f64>()?;
    if c <= 0.0 {
        return Err(cutoff.failure("not positive"));
    }
    Ok(json!({
        "ospa_p1": ospa_json(&ospa(&truth, &estimates, c, 1.0)),
        "gospa_p1": gospa_json(&gospa(&truth, &estimates, c, 1.0)),
        "ospa_p2": ospa_json(&ospa(&truth, &estimates, c, 2.0)),
        "gospa_p2": gospa_json(&gospa(&truth, &estimates, c, 2.0)),
    }))
}

/// The points of one set, each with `dim` coordinates.
fn points(case: &Field<'_>, key: &str) -> Result<Vec<Vec<f64>>, Failure> {
    let dim = case.get("dim")?.count()?;
    let point = |item: &Field<'_>| match item.numbers()? {
        point if point.len() == dim => Ok(point),
        point => Err(item.failure(format!("{} coordinates where {dim} belong", point.len()))),
    };
    case.get(key)?.items()?.iter().map(point).collect()
}

fn ospa_json(o: &Ospa) -> Value {
    json!({"ospa": o.ospa, "localisation": o.localisation, "cardinality": o.cardinality})
}

fn gospa_json(g: &Gospa) -> Value {
    json!({
        "gospa": g.gospa, "localisation": g.localisation, "missed": g.missed, "false": g.false_,
        "n_assigned": g.n_assigned, "n_missed": g.n_missed, "n_false": g.n_false,
    })
}

fn nees_runs(entry: &Field<'_>, _: Precision) -> Result<Value, Failure> {
    let n = entry.get("n")?.count()?;
    let runs = entry.get("runs")?;
    let values: Vec<f64> = runs.items()?.iter().map(|run| nees_of(run, n)).collect::<Result<_, _>>()?;
    let summary = consistency(&values, n).ok_or_else(|| runs.failure("empty, or n is 0"))?;
    Ok(json!({
        "runs": values.iter().map(|&value| json!({"nees": value})).collect::<Vec<_>>(),
        "mean_nees": summary.mean_nees,
        "anees": summary.anees,
        "chi2_95": summary.interval,
        "consistent": summary.consistent(),
    }))
}

fn nees_of(run: &Field<'_>, n: usize) -> Result<f64, Failure> {
    let error = run.get("error")?;
    let components: Vec<f64> = error.numbers()?;
    if components.len() != n {
        return Err(error.failure(format!("{} entries where {n} belong", components.len())));
    }
    let cov = run.get("P")?;
    let rows = cov.rows::<f64>()?;
    if rows.len() != n || rows.iter().any(|row| row.len() != n) {
        return Err(cov.failure(format!("not {n} x {n}")));
    }
    nees(&components, &rows.concat()).ok_or_else(|| cov.failure("not positive definite"))
}

fn quantile(entry: &Field<'_>, _: Precision) -> Result<Value, Failure> {
    let items = entry.items()?;
    let [dof, p, ..] = items.as_slice() else {
        return Err(entry.failure("not of the form [dof, p]"));
    };
    let value = chi_square_quantile(dof.number()?, p.number()?).ok_or_else(|| entry.failure("needs dof > 0 and 0 < p < 1"))?;
    Ok(json!([dof.value(), p.value(), number(value)]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(solver: super::super::CaseSolver, case: Value) -> Option<String> {
        let field = Field::root(&case, "").renamed("case a".into());
        solver(&field, Precision::F64).err().map(|failure| failure.to_string())
    }

    #[test]
    fn bad_inputs_are_told() {
        for (case, expected) in [
            (json!({"dim": 2, "X": [[1, 2], [3]], "Y": [], "c": 1}), "case a: X[1]: 1 coordinates where 2 belong"),
            (json!({"dim": 2, "X": [], "Y": [], "c": 0}), "case a: c: not positive"),
            (json!({"dim": 2, "X": [], "Y": [[1, null]], "c": 1}), "case a: Y[0][1]: null, not a number"),
        ] {
            assert_eq!(told(point_sets, case).as_deref(), Some(expected));
        }
        let runs = |p: Value| json!({"n": 2, "runs": [{"error": [1, 1], "P": p}]});
        assert_eq!(told(nees_runs, runs(json!([[1, 2], [2, 1]]))).as_deref(), Some("case a: runs[0].P: not positive definite"));
        assert_eq!(told(nees_runs, runs(json!([[1]]))).as_deref(), Some("case a: runs[0].P: not 2 x 2"));
        assert_eq!(told(nees_runs, json!({"n": 2, "runs": []})).as_deref(), Some("case a: runs: empty, or n is 0"));
        assert_eq!(told(quantile, json!([2])).as_deref(), Some("case a: not of the form [dof, p]"));
        assert_eq!(told(quantile, json!([2, 1.0])).as_deref(), Some("case a: needs dof > 0 and 0 < p < 1"));
    }
}
