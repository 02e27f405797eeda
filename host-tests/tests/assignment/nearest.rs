//! Global nearest neighbour as an associator.

use crate::{Event, Outcome, Problem, cases, field, on_random_problems};
use boresight::association::{AssociationMatrix, Associator, ClutterPrior, Completeness, Domain, Gnn};
use boresight::scalar::Real;

const TRACKS: usize = 6;
const DETS: usize = 10;

/// The problem as a matrix; rows that it does not have are certain misses.
fn matrix<T: Real>(problem: &Problem<T>, clutter: ClutterPrior, domain: Domain) -> AssociationMatrix<T, TRACKS, DETS> {
    let mut matrix = AssociationMatrix::new();
    matrix.reset(problem.columns, clutter, domain);
    let weight = |ln: T| if domain == Domain::Linear { T::lit(ln.to_f64().exp()) } else { ln };
    for track in 0..problem.rows() {
        matrix.miss[track] = weight(problem.miss[track]);
        problem.hit[track].iter().enumerate().for_each(|(j, ln)| matrix.hit[track][j] = weight(*ln));
    }
    matrix
}

/// Associates, and returns the event that has all the probability.
fn nearest<T: Real>(matrix: &mut AssociationMatrix<T, TRACKS, DETS>) -> Result<(Event, Completeness), String> {
    let completeness = Gnn.associate(matrix, &mut <Gnn as Associator<T, TRACKS, DETS>>::MEMORY.clone());
    let mut event = Event::new();
    for track in 0..TRACKS {
        let (miss, hit) = matrix.row(track).ok_or("no row")?;
        let row: Vec<_> = std::iter::once(miss).chain(hit.iter().copied()).collect();
        if row.iter().any(|p| *p != T::ZERO && *p != T::ONE) || row.iter().filter(|p| **p == T::ONE).count() != 1 {
            return Err(format!("row {track}: {row:?}"));
        }
        event.push(row.iter().position(|p| *p == T::ONE).unwrap_or(0) as u16);
    }
    Ok((event, completeness))
}

/// ln of m^k (m − k)! / m!, the factor of k tracks served under diffuse clutter.
fn ln_factor<T: Real>(problem: &Problem<T>, event: &[u16]) -> f64 {
    let gated = (0..problem.columns).filter(|j| problem.hit.iter().any(|row| row[*j].is_finite())).count();
    let served = event.iter().filter(|c| **c > 0).count();
    (0..served).map(|i| (gated as f64 / (gated - i) as f64).ln()).sum()
}

/// Rows of an event that miss although they cannot; `None` where one has a column that it cannot have.
fn impossible<T: Real>(problem: &Problem<T>, event: &[u16]) -> Option<usize> {
    let weight = |row: usize| problem.choice(row, event[row]);
    let pairs_possible = (0..event.len()).all(|row| event[row] == 0 || weight(row).is_finite());
    pairs_possible.then(|| (0..event.len()).filter(|row| event[*row] == 0 && !weight(*row).is_finite()).count())
}

/// The fewest such rows of all events.
fn fewest_impossible<T: Real>(problem: &Problem<T>) -> Option<usize> {
    let relaxed = Problem { miss: vec![T::ZERO; problem.rows()], hit: problem.hit.clone(), columns: problem.columns };
    relaxed.events().into_iter().filter_map(|(_, event)| impossible(problem, &event)).min()
}

fn most_probable<T: Real>(problem: &Problem<T>, clutter: ClutterPrior, domain: Domain) -> Outcome {
    let total = |event: &Event| {
        let factor = if clutter == ClutterPrior::Diffuse { ln_factor(problem, event) } else { 0.0 };
        event.iter().enumerate().map(|(row, c)| problem.choice(row, *c).to_f64()).sum::<f64>() + factor
    };
    let mut all: Vec<_> = problem.events().into_iter().map(|(_, event)| (total(&event), event)).collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (event, completeness) = nearest(&mut matrix(problem, clutter, domain))?;
    let Some((most, best)) = all.first() else {
        let fewest = fewest_impossible(problem);
        let chosen = impossible(problem, &event[..problem.rows()]);
        return if completeness.infeasible > 0 && chosen == fewest { Ok(()) } else { Err("more misses than need be".into()) };
    };
    // Linear weights and their logarithms back bring an error of ε for each row, relative to the weight.
    let bound = problem.rounding() + 8.0 * T::EPSILON.to_f64() * (problem.magnitude() + 1.0) * TRACKS as f64;
    let event = event[..problem.rows()].to_vec();
    let unique = all.get(1).is_none_or(|(second, _)| most - second > bound);
    if !completeness.is_exact() || most - total(&event) > bound || (unique && event != *best) {
        return Err(format!("{clutter:?} {domain:?}: {event:?} for {best:?}, {completeness:?}").into());
    }
    Ok(())
}

#[test]
fn the_most_probable_event_is_taken_whatever_is_known_of_clutter() -> Outcome {
    for (seed, clutter) in [(31, ClutterPrior::Poisson), (32, ClutterPrior::Diffuse)] {
        on_random_problems::<f64>(seed, 1000, 4, 5, |problem| most_probable(problem, clutter, Domain::Logarithmic))?;
        on_random_problems::<f32>(seed, 1000, 4, 5, |problem| most_probable(problem, clutter, Domain::Logarithmic))?;
        on_random_problems::<f64>(seed, 1000, 4, 5, |problem| most_probable(problem, clutter, Domain::Linear))?;
    }
    Ok(())
}

#[test]
fn the_first_events_of_the_reference_cases_are_taken() -> Outcome {
    for case in cases("jpda.json")? {
        let weights: Vec<Vec<f64>> = field(&case, "w")?;
        let problem = Problem::<f64>::from_weights(&weights);
        let (event, completeness) = nearest(&mut matrix(&problem, ClutterPrior::Poisson, Domain::Linear))?;
        assert_eq!(completeness.infeasible > 0, field::<bool>(&case, "infeasible")?, "{}", case["name"]);
        if completeness.is_exact() {
            assert_eq!(event[..problem.rows()], field::<Event>(&case["kbest"][0], "a")?, "{}", case["name"]);
        }
    }
    Ok(())
}

#[test]
fn the_first_events_of_the_nonparametric_cases_are_taken() -> Outcome {
    for case in cases("jpda_nonparametric.json")? {
        let (likelihoods, p_detect): (Vec<Vec<f64>>, Vec<f64>) = (field(&case, "N")?, field(&case, "Pd")?);
        let (volume, gated): (f64, Vec<usize>) = (field(&case, "V")?, field(&case, "validated")?);
        // λ = m / V, of the validated detections only.
        let row = |(likelihoods, p_detect): (&Vec<f64>, &f64)| {
            let hit = |j: &usize| p_detect * likelihoods[j - 1] * volume / gated.len() as f64;
            std::iter::once(1.0 - p_detect).chain(gated.iter().map(hit)).collect()
        };
        let weights: Vec<Vec<f64>> = likelihoods.iter().zip(&p_detect).map(row).collect();
        let problem = Problem::<f64>::from_weights(&weights);
        let (event, completeness) = nearest(&mut matrix(&problem, ClutterPrior::Diffuse, Domain::Linear))?;
        assert!(completeness.is_exact());
        assert_eq!(event[..problem.rows()], field::<Event>(&case["kbest"][0], "a")?, "{}", case["name"]);
    }
    Ok(())
}
