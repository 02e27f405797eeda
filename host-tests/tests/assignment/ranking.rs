//! Ranked assignment: complete lists, the beginnings of long ones, and the lists of the reference cases.

use crate::{Event, Kind, Outcome, Problem, cases, field, on_random_problems};
use boresight::association::{Assignment, KBest};
use boresight::scalar::Real;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::cell::Cell;
use std::collections::HashSet;

fn ranked<T: Real, const TRACKS: usize, const DETS: usize, const K: usize>(
    ranking: &mut KBest<T, TRACKS, DETS, K>,
    problem: &Problem<T>,
) -> Vec<(T, Event)> {
    let count = ranking.rank(problem.rows(), problem.columns, |t| problem.miss[t], |t, j| problem.hit[t][j]);
    let events: Vec<_> = ranking.events().map(|(ln_weight, event)| (ln_weight, event.to_vec())).collect();
    assert_eq!(events.len(), count);
    events
}

/// More places than events: the list is complete, its order exact.
fn complete<T: Real>(problem: &Problem<T>) -> Outcome {
    // 209 events of three rows and five columns with a miss, at most 1546 of four.
    let events = problem.events();
    let list = ranked(&mut KBest::<T, 4, 5, 1600>::new(), problem);
    if list == events { Ok(()) } else { Err(format!("{} of {} events, or in another order", list.len(), events.len()).into()) }
}

#[test]
fn with_room_for_all_events_the_list_is_complete_and_in_order() -> Outcome {
    on_random_problems::<f64>(11, 60, 4, 5, complete)?;
    on_random_problems::<f32>(12, 60, 4, 5, complete)
}

/// The first `K` of all: equal weights, up to rounding; equal events wherever no other is as good.
fn beginning<T: Real, const K: usize>(problem: &Problem<T>) -> Outcome {
    let all = problem.events();
    let list = ranked(&mut KBest::<T, 4, 5, K>::new(), problem);
    let exact = problem.miss.iter().chain(problem.hit.iter().flatten()).all(|w| !w.is_finite() || w.to_f64().fract() == 0.0);
    let bound = if exact { 0.0 } else { problem.rounding() };
    if list.len() != all.len().min(K) || list.iter().map(|(_, event)| event).collect::<HashSet<_>>().len() != list.len() {
        return Err(format!("{} events of {}", list.len(), all.len()).into());
    }
    for (place, ((got, event), (want, best))) in list.iter().zip(&all).enumerate() {
        if (got.to_f64() - want.to_f64()).abs() > bound || *got != problem.ln_weight(event) {
            return Err(format!("place {place}: {got} for {want}").into());
        }
        // Of a tie that the end of the list cuts, any part may be there.
        let cut = all.get(K).is_some_and(|(next, _)| want.to_f64() - next.to_f64() <= bound);
        let near = |other: Option<&(T, Event)>| !exact && other.is_some_and(|(w, _)| (w.to_f64() - want.to_f64()).abs() <= bound);
        let doubtful = cut || near(all.get(place + 1)) || near(place.checked_sub(1).and_then(|k| all.get(k)));
        if !doubtful && event != best {
            return Err(format!("place {place}: {event:?} for {best:?}").into());
        }
    }
    Ok(())
}

#[test]
fn a_short_list_is_the_beginning_of_the_complete_one() -> Outcome {
    on_random_problems::<f64>(13, 300, 4, 5, beginning::<f64, 1>)?;
    on_random_problems::<f64>(14, 300, 4, 5, beginning::<f64, 2>)?;
    on_random_problems::<f64>(15, 300, 4, 5, beginning::<f64, 7>)?;
    on_random_problems::<f64>(16, 100, 4, 5, beginning::<f64, 100>)?;
    on_random_problems::<f32>(17, 300, 4, 5, beginning::<f32, 7>)?;
    on_random_problems::<f32>(18, 100, 4, 5, beginning::<f32, 100>)
}

/// The reference lists, computed elsewhere; in f32 those of the cases that f32 can tell apart.
fn references<T: Real>() -> Outcome {
    let mut compared = 0;
    for case in cases("jpda.json")? {
        let weights: Vec<Vec<f64>> = field(&case, "w")?;
        let problem = Problem::<T>::from_weights(&weights);
        // Without any possible event there is no list.
        let want = case["kbest"].as_array().map_or(&[][..], Vec::as_slice);
        let list = ranked(&mut KBest::<T, 6, 10, 10>::new(), &problem);
        assert_eq!(list.len(), want.len(), "{}", case["name"]);
        let ln_total = case["log_total"].as_f64().unwrap_or(0.0);
        let bound = problem.rounding();
        let p: Vec<f64> = want.iter().map(|event| field(event, "p")).collect::<Result<_, _>>()?;
        for (place, ((ln_weight, event), want)) in list.iter().zip(want).enumerate() {
            let near = |k: usize| p.get(k).is_some_and(|other| p[place] != *other && (other.ln() - p[place].ln()).abs() <= bound);
            let doubtful = near(place + 1) || (place > 0 && near(place - 1));
            if !doubtful {
                assert_eq!(*event, field::<Event>(want, "a")?, "{} {place}", case["name"]);
                compared += 1;
            }
            let deviation = (ln_weight.to_f64() - ln_total - p[place].ln()).abs();
            assert!(deviation <= bound.max(1e-12), "{} {place}: {deviation:e}", case["name"]);
        }
    }
    assert!(compared > 200, "{compared} events compared");
    Ok(())
}

#[test]
fn the_lists_of_the_reference_cases_are_met() -> Outcome {
    references::<f64>()?;
    references::<f32>()
}

/// Too many events to list: the best is that of one assignment, a longer list begins with a shorter one, and the work
/// stays within what is documented.
fn long<T: Real>(kind: Kind) -> Outcome {
    const TRACKS: usize = 12;
    const DETS: usize = 16;
    let mut rng = ChaCha8Rng::seed_from_u64(19);
    for _ in 0..10 {
        let problem = Problem::<T>::random(&mut rng, kind, TRACKS, DETS);
        let looks = Cell::new(0);
        let hit = |t: usize, j: usize| {
            looks.set(looks.get() + 1);
            problem.hit[t][j]
        };
        let mut ranking = KBest::<T, TRACKS, DETS, 400>::new();
        assert_eq!(ranking.rank(TRACKS, DETS, |t| problem.miss[t], hit), 400);
        assert!(looks.get() <= 3 * 400 * TRACKS * (TRACKS + 2) * DETS, "{} pairs", looks.get());
        let list: Vec<_> = ranking.events().map(|(ln_weight, event)| (ln_weight, event.to_vec())).collect();
        let distinct: HashSet<_> = list.iter().map(|(_, event)| event.clone()).collect();
        assert_eq!(distinct.len(), 400);
        for pair in list.windows(2) {
            assert!(pair[0].0 > pair[1].0 || (pair[0].0 == pair[1].0 && pair[0].1 < pair[1].1));
        }
        for (_, event) in &list {
            let columns: Vec<_> = event.iter().filter(|c| **c > 0).collect();
            assert_eq!(columns.iter().collect::<HashSet<_>>().len(), columns.len());
        }
        let mut single = Assignment::<T, TRACKS, DETS>::new();
        assert!(single.solve(TRACKS, DETS, |t| problem.miss[t], |t, j| problem.hit[t][j]));
        let best: Event = (0..TRACKS).map(|t| single.column(t).map_or(0, |j| j as u16 + 1)).collect();
        let bound = problem.rounding();
        assert!((problem.ln_weight(&best).to_f64() - list[0].0.to_f64()).abs() <= bound);
        for (short, long) in ranked(&mut KBest::<T, TRACKS, DETS, 50>::new(), &problem).iter().zip(&list) {
            assert!((short.0.to_f64() - long.0.to_f64()).abs() <= bound);
        }
    }
    Ok(())
}

#[test]
fn long_lists_are_consistent_and_their_work_bounded() -> Outcome {
    for kind in [Kind::Range(5.0), Kind::Range(400.0), Kind::Tied, Kind::Sparse] {
        long::<f64>(kind)?;
        long::<f32>(kind)?;
    }
    Ok(())
}

#[test]
fn rankings_of_nothing_are_defined() {
    let mut ranking = KBest::<f32, 3, 3, 4>::default();
    // No row: one event, of weight one.
    assert_eq!(ranking.rank(0, 3, |_| 0.0, |_, _| 0.0), 1);
    assert_eq!(ranking.events().collect::<Vec<_>>(), [(0.0, [0u16; 0].as_slice())]);
    // Two rows and one column, and neither may miss.
    assert_eq!(ranking.rank(2, 1, |_| f32::NAN, |_, _| 1.0), 0);
    assert_eq!(ranking.events().count(), 0);
}
