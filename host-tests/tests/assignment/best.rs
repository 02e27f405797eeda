//! One assignment. The prices prove the assignment best without any list of events, so large problems are held to the same.

use crate::{Kind, Outcome, Problem, on_random_problems};
use boresight::association::Assignment;
use boresight::scalar::Real;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::cell::Cell;

fn solve<T: Real, const TRACKS: usize, const DETS: usize>(assignment: &mut Assignment<T, TRACKS, DETS>, problem: &Problem<T>) -> bool {
    assignment.solve(problem.rows(), problem.columns, |t| problem.miss[t], |t, j| problem.hit[t][j])
}

fn event<T: Real, const TRACKS: usize, const DETS: usize>(assignment: &Assignment<T, TRACKS, DETS>, rows: usize) -> Vec<u16> {
    (0..rows).map(|row| assignment.column(row).map_or(0, |j| j as u16 + 1)).collect()
}

/// Complementary slackness. Returns how far from equality an assigned pair is, in units of ε times the largest number.
///
/// The price of a row is at last a difference of a weight and the price of a column, so no pair exceeds its prices but by
/// the rounding of that difference; the comparison itself takes two roundings in double precision. A pair is assigned with
/// three roundings, and each later row moves both its prices by one number, with one rounding each; slacks that these
/// errors make negative add as much again: 4 (rows + 4) in all.
fn prove<T: Real, const TRACKS: usize, const DETS: usize>(
    assignment: &Assignment<T, TRACKS, DETS>,
    problem: &Problem<T>,
) -> Result<f64, String> {
    let prices = |prices: &[T]| prices.iter().map(|p| p.to_f64()).collect::<Vec<_>>();
    let (u, v) = (prices(assignment.row_prices()), prices(assignment.column_prices()));
    if (u.len(), v.len()) != (problem.rows(), problem.columns) || u.iter().chain(&v).any(|p| !p.is_finite()) {
        return Err(format!("prices {u:?} {v:?}"));
    }
    let largest = |prices: &[f64]| prices.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    let size = problem.magnitude() + largest(&u) + largest(&v);
    let unit = T::EPSILON.to_f64() * size;
    let mut worst = 0.0f64;
    let mut owner = vec![None; problem.columns];
    for row in 0..problem.rows() {
        for choice in 0..=problem.columns as u16 {
            let v_j = if choice == 0 { 0.0 } else { v[usize::from(choice) - 1] };
            let slack = u[row] + v_j - problem.choice(row, choice).to_f64();
            if slack < -0.5 * T::EPSILON.to_f64() * u[row].abs() - f64::EPSILON * size {
                return Err(format!("row {row}, choice {choice}: slack {slack:e}"));
            }
            if assignment.column(row).map_or(0, |j| j as u16 + 1) == choice {
                worst = worst.max(slack / unit);
            }
        }
        if let Some(j) = assignment.column(row)
            && owner[j].replace(row).is_some()
        {
            return Err(format!("column {j} twice"));
        }
    }
    if v.iter().zip(&owner).any(|(v, owner)| *v < 0.0 || (owner.is_none() && *v != 0.0)) {
        return Err(format!("{v:?} for columns with rows {owner:?}"));
    }
    if worst <= 4.0 * (problem.rows() + 4) as f64 { Ok(worst) } else { Err(format!("an assigned pair is off by {worst} units")) }
}

fn best_of_all<T: Real>(problem: &Problem<T>) -> Outcome {
    let mut assignment = Assignment::<T, 4, 5>::new();
    let feasible = solve(&mut assignment, problem);
    let events = problem.events();
    let Some((most, best)) = events.first() else {
        let empty = assignment.row_prices().is_empty() && assignment.column_prices().is_empty();
        return if !feasible && empty && event(&assignment, 4) == [0; 4] { Ok(()) } else { Err("not possible".into()) };
    };
    if !feasible {
        return Err("possible".into());
    }
    prove(&assignment, problem)?;
    let found = event(&assignment, problem.rows());
    let lost = most.to_f64() - problem.ln_weight(&found).to_f64();
    let unique = events.get(1).is_none_or(|(second, _)| most.to_f64() - second.to_f64() > problem.rounding());
    if lost > problem.rounding() || (unique && found != *best) {
        return Err(format!("found {found:?}, best is {best:?} by {lost:e}").into());
    }
    Ok(())
}

#[test]
fn the_best_of_all_events_is_found_and_proven() -> Outcome {
    on_random_problems::<f64>(1, 4000, 4, 5, best_of_all)?;
    on_random_problems::<f32>(2, 4000, 4, 5, best_of_all)
}

/// Looks at the pairs of a large problem; the documented count is not exceeded.
fn large<T: Real>(limit: f64, seed: u64) -> Result<f64, Box<dyn std::error::Error>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut assignment = Assignment::<T, 64, 64>::new();
    let mut worst = 0.0f64;
    for kind in [Kind::Range(limit), Kind::Tied, Kind::Sparse] {
        for _ in 0..20 {
            let (rows, columns) = (rng.random_range(32..=64), rng.random_range(32..=64));
            let problem = Problem::<T>::random(&mut rng, kind, rows, columns);
            let looks = Cell::new(0);
            let hit = |t: usize, j: usize| {
                looks.set(looks.get() + 1);
                problem.hit[t][j]
            };
            if !assignment.solve(rows, columns, |t| problem.miss[t], hit) {
                return Err(format!("{kind:?}: not possible").into());
            }
            let most = rows * (rows.min(columns) + 3) * columns;
            if looks.get() > most {
                return Err(format!("{} pairs, at most {most}", looks.get()).into());
            }
            worst = worst.max(prove(&assignment, &problem).map_err(|fault| format!("{kind:?} {rows} {columns}: {fault}"))?);
        }
    }
    Ok(worst)
}

#[test]
fn large_problems_of_any_range_are_proven_best_with_bounded_work() -> Outcome {
    for limit in [10.0, 80.0, 400.0, 460.0, 1e5] {
        large::<f32>(limit, 3)?;
        large::<f64>(limit, 4)?;
    }
    Ok(())
}

/// The prices make every weight of the matrix at most one, and the best event's one.
#[test]
fn prices_balance_the_matrix() -> Outcome {
    on_random_problems::<f64>(5, 500, 4, 5, |problem| {
        let mut assignment = Assignment::<f64, 4, 5>::new();
        if solve(&mut assignment, problem) {
            let (u, v) = (assignment.row_prices(), assignment.column_prices());
            for (row, choice) in event(&assignment, problem.rows()).into_iter().enumerate() {
                let v = |choice: u16| if choice == 0 { 0.0 } else { v[usize::from(choice) - 1] };
                let balanced = |choice| (problem.choice(row, choice) - u[row] - v(choice)).exp();
                if (balanced(choice) - 1.0).abs() > 1e-11 || (0..=problem.columns as u16).any(|c| balanced(c) > 1.0 + 1e-12) {
                    return Err(format!("row {row}").into());
                }
            }
        }
        Ok(())
    })
}

#[test]
fn permuting_rows_or_columns_permutes_the_answer() -> Outcome {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let (mut one, mut two) = (Assignment::<f64, 20, 30>::new(), Assignment::<f64, 20, 30>::new());
    for _ in 0..300 {
        let problem = Problem::<f64>::random(&mut rng, Kind::Range(30.0), 20, 30);
        let (mut rows, mut columns) = ((0..20).collect::<Vec<_>>(), (0..30).collect::<Vec<_>>());
        rows.shuffle(&mut rng);
        columns.shuffle(&mut rng);
        let permuted = Problem {
            miss: rows.iter().map(|&t| problem.miss[t]).collect(),
            hit: rows.iter().map(|&t| columns.iter().map(|&j| problem.hit[t][j]).collect()).collect(),
            columns: 30,
        };
        assert!(solve(&mut one, &problem) && solve(&mut two, &permuted));
        for (row, &origin) in rows.iter().enumerate() {
            assert_eq!(two.column(row).map(|j| columns[j]), one.column(origin));
        }
    }
    Ok(())
}

/// What is no number, or none that could be added up, forbids; capacity limits what is looked at.
fn nonsense<T: Real>() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let (mut one, mut two) = (Assignment::<T, 6, 6>::new(), Assignment::<T, 6, 6>::new());
    let odd = [f64::NAN, f64::INFINITY, f64::MAX, f64::MIN, 2e30, -2e30];
    for _ in 0..2000 {
        let mut problem = Problem::<T>::random(&mut rng, Kind::Range(1e29), 6, 6);
        let mut odder = problem.clone();
        let both = |p: &mut Problem<T>, t: usize, j: usize, w: f64| if j == 6 { p.miss[t] = T::lit(w) } else { p.hit[t][j] = T::lit(w) };
        for _ in 0..rng.random_range(0..30) {
            let (t, j) = (rng.random_range(0..6), rng.random_range(0..7));
            both(&mut odder, t, j, odd[rng.random_range(0..odd.len())]);
            both(&mut problem, t, j, f64::NEG_INFINITY);
        }
        assert_eq!(solve(&mut one, &problem), two.solve(99, 99, |t| odder.miss[t], |t, j| odder.hit[t][j]), "{odder:?}");
        assert_eq!((event(&one, 6), one.row_prices(), one.column_prices()), (event(&two, 6), two.row_prices(), two.column_prices()));
        assert!(one.row_prices().iter().chain(one.column_prices()).all(|p| p.is_finite()));
    }
}

#[test]
fn logarithms_that_are_no_weights_forbid() {
    nonsense::<f32>();
    nonsense::<f64>();
}

#[test]
fn a_used_solver_answers_like_a_new_one() -> Outcome {
    let mut used = Assignment::<f64, 4, 5>::default();
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    for _ in 0..2000 {
        let (rows, columns) = (rng.random_range(0..=4), rng.random_range(0..=5));
        let problem = Problem::random(&mut rng, Kind::Sparse, rows, columns);
        let mut new = Assignment::<f64, 4, 5>::new();
        assert_eq!(solve(&mut used, &problem), solve(&mut new, &problem));
        assert_eq!((event(&used, 4), used.row_prices(), used.column_prices()), (event(&new, 4), new.row_prices(), new.column_prices()));
    }
    Ok(())
}
