//! Truncation by Gibbs sampling: a random walk through the events of a hypothesis, which stays where they are heavy.
//!
//! ```text
//! start     row by row the heaviest choice that is free
//! a sweep   row by row: drawn anew from all its choices by weight, but detections that other rows have
//! ```
//!
//! The walk visits an event as often as its weight says, so heavy ones are soon found; the weight of what is found is
//! exact all the same. Its cost grows with the rows, not with the number of events that there are. Vo, Vo and Hoang 2017,
//! algorithm 1.

use super::random;
use super::row::{Event, FIRST_HIT, GONE, Limits, Outcome, Problem, Truncation};
use crate::scalar::{Real, sqrt};
use rand_core::Rng;

/// A walk of `SWEEPS` events from a hypothesis that is certain, of √w as many from one of weight w, of one at least.
///
/// A sweep costs rows² GATED comparisons, and as many more as events were found before. It keeps `SWEEPS` LABELS choices.
#[derive(Clone, Copy, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Gibbs<const SWEEPS: usize>;

impl<T: Real, const LABELS: usize, const SWEEPS: usize> Truncation<T, LABELS> for Gibbs<SWEEPS> {
    /// The events found.
    type Memory = [[u16; LABELS]; SWEEPS];
    const MEMORY: Self::Memory = [[GONE; LABELS]; SWEEPS];

    fn explore<R: Rng, const GATED: usize>(
        &self,
        problem: &Problem<'_, T, GATED>,
        limits: &Limits<T>,
        memory: &mut Self::Memory,
        rng: &mut R,
        mut found: impl FnMut(T, Event<'_>),
    ) -> bool {
        let rows = problem.chosen.len().min(LABELS);
        let mut walk = [GONE; LABELS];
        for place in 0..rows {
            let choice = heaviest(problem, &walk, place);
            choose(&mut walk, place, choice);
        }
        let (steps, mut count) = (sqrt(limits.share) * T::from_count(SWEEPS), 0);
        for sweep in 0..SWEEPS {
            if sweep > 0 && T::from_count(sweep) >= steps {
                break;
            }
            if sweep > 0 {
                for place in 0..rows {
                    let choice = drawn(problem, &walk, place, rng);
                    choice.into_iter().for_each(|choice| choose(&mut walk, place, choice));
                }
            }
            let (event, ln_weight) = (walk.get(..rows).unwrap_or_default(), problem.ln_weight(&walk));
            if memory.iter().take(count).any(|known| *known == walk) {
                continue;
            }
            memory.iter_mut().skip(count).take(1).for_each(|free| *free = walk);
            count += 1;
            if ln_weight >= limits.ln_least {
                found(ln_weight, event);
            }
        }
        false
    }
}

fn choose<const LABELS: usize>(walk: &mut [u16; LABELS], place: usize, choice: u16) {
    walk.iter_mut().skip(place).take(1).for_each(|c| *c = choice);
}

/// By logarithms: a share may be too small for single precision, and still be all that is left.
fn heaviest<T: Real, const GATED: usize>(problem: &Problem<'_, T, GATED>, walk: &[u16], place: usize) -> u16 {
    free(problem, walk, place).reduce(|a, b| if b.1.ln_weight > a.1.ln_weight { b } else { a }).map_or(GONE, |(choice, _)| choice)
}

/// None where all that is free is lighter than single precision tells.
fn drawn<T: Real, R: Rng, const GATED: usize>(problem: &Problem<'_, T, GATED>, walk: &[u16], place: usize, rng: &mut R) -> Option<u16> {
    let mut choices = free(problem, walk, place);
    let drawn = random::index(choices.clone().map(|(_, o)| o.share), rng)?;
    choices.nth(drawn).map(|(choice, _)| choice)
}

/// The choices that the row at `place` has while the others stay: all but the detections that they have.
fn free<'a, T: Real, const GATED: usize>(
    problem: &'a Problem<'_, T, GATED>,
    walk: &'a [u16],
    place: usize,
) -> impl Iterator<Item = (u16, &'a Outcome<T>)> + Clone {
    let taken = move |detection: Option<u16>| {
        let others = problem.rows().zip(walk).enumerate().filter(move |(other, (_, choice))| *other != place && **choice >= FIRST_HIT);
        detection.is_some() && others.filter_map(|(_, (row, choice))| row.outcome(*choice)).any(|o| o.detection == detection)
    };
    (0..).zip(problem.row(place).into_iter().flat_map(|row| row.outcomes())).filter(move |(_, o)| !taken(o.detection))
}
