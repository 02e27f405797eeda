//! Truncation by ranked assignment: the events of a hypothesis in the order of their weights.
//!
//! ```text
//! rows      the targets;  columns  the detections that any of them gates, and one for every row of its own
//! miss      the heavier of gone and missed;  own column  the lighter
//! ```
//!
//! Events end where they become lighter than what is kept already. Ranking is Murty's, see
//! [`KBest`]; Vo, Vo and Phung 2014 (truncation by ranked assignment).

use super::row::{Event, FIRST_HIT, GONE, Limits, MISSED, Problem, Row, Truncation};
use super::work::COUNTED;
use crate::association::KBest;
use crate::scalar::{Real, is_finite};
use rand_core::Rng;

/// At most `EVENTS` of every hypothesis, over at most `COLUMNS` columns.
///
/// `COLUMNS` is one for every row that has two fates, and one for every detection that the targets of a hypothesis gate; where
/// there is no room, those go that are farthest down in their rows. For cost and memory see [`KBest`]; the matrix takes LABELS `COLUMNS`
/// scalars more.
#[derive(Clone, Copy, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Ranked<const EVENTS: usize, const COLUMNS: usize>;

/// What ranking works on.
#[derive(Clone, Debug)]
pub struct RankedMemory<T, const LABELS: usize, const EVENTS: usize, const COLUMNS: usize> {
    ranking: KBest<T, LABELS, COLUMNS, EVENTS>,
    /// ln w by row and column
    matrix: [[T; COLUMNS]; LABELS],
    /// Of the idle choice by row
    idle: [T; LABELS],
}

/// Whose a column is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Column {
    /// The other fate of a row
    Own(u16),
    Detection(u16),
}

/// The heavier fate of a row, and the other.
fn fates<T: Real, const GATED: usize>(row: &Row<T, GATED>) -> (u16, u16) {
    let ln_weight = |fate| row.outcome(fate).map_or(T::ZERO, |o| o.ln_weight);
    if ln_weight(GONE) > ln_weight(MISSED) { (GONE, MISSED) } else { (MISSED, GONE) }
}

/// The choice of `row` that is `column`, if it has it.
fn choice<T: Real, const GATED: usize>(place: usize, row: &Row<T, GATED>, column: Column) -> Option<u16> {
    COUNTED.looks.add(1 + row.hits().len());
    match column {
        Column::Own(owner) => (usize::from(owner) == place).then(|| fates(row).1),
        Column::Detection(number) => {
            let place = row.hits().iter().position(|hit| hit.detection == Some(number))?;
            Some(FIRST_HIT + place as u16)
        }
    }
}

/// The columns of a problem, and whether there was room for all.
fn columns<T: Real, const GATED: usize, const COLUMNS: usize>(problem: &Problem<'_, T, GATED>) -> (heapless::Vec<Column, COLUMNS>, bool) {
    let mut columns = heapless::Vec::new();
    let mut complete = true;
    let mut add = |column| {
        COUNTED.looks.add(columns.len());
        if !columns.contains(&column) {
            complete &= columns.push(column).is_ok();
        }
    };
    for (place, row) in problem.rows().enumerate() {
        if row.outcome(fates(row).1).is_some_and(|o| is_finite(o.ln_weight)) {
            add(Column::Own(place as u16));
        }
    }
    for place in 0..GATED {
        problem.rows().filter_map(|row| row.hits().get(place)?.detection).for_each(|number| add(Column::Detection(number)));
    }
    (columns, complete)
}

impl<T: Real, const LABELS: usize, const EVENTS: usize, const COLUMNS: usize> Truncation<T, LABELS> for Ranked<EVENTS, COLUMNS> {
    type Memory = RankedMemory<T, LABELS, EVENTS, COLUMNS>;
    const MEMORY: Self::Memory = RankedMemory { ranking: KBest::new(), matrix: [[T::ZERO; COLUMNS]; LABELS], idle: [T::ZERO; LABELS] };

    fn explore<R: Rng, const GATED: usize>(
        &self,
        problem: &Problem<'_, T, GATED>,
        limits: &Limits<T>,
        memory: &mut Self::Memory,
        _: &mut R,
        mut found: impl FnMut(T, Event<'_>),
    ) -> bool {
        let none = -T::ONE / T::ZERO;
        let RankedMemory { ranking, matrix, idle } = memory;
        let (columns, complete) = columns::<T, GATED, COLUMNS>(problem);
        for (place, (row, (entries, idle))) in problem.rows().zip(matrix.iter_mut().zip(idle.iter_mut())).enumerate() {
            let ln_weight = |choice: Option<u16>| choice.and_then(|choice| row.outcome(choice)).map_or(none, |o| o.ln_weight);
            *idle = ln_weight(Some(fates(row).0));
            for (entry, column) in entries.iter_mut().zip(&columns) {
                *entry = ln_weight(choice(place, row, *column));
            }
        }
        let miss = |row: usize| idle.get(row).copied().unwrap_or(none);
        let hit = |row: usize, column: usize| matrix.get(row).and_then(|row| row.get(column)).copied().unwrap_or(none);
        ranking.rank_above(limits.ln_least, limits.ln_span, problem.chosen.len(), columns.len(), miss, hit);
        for (ln_weight, entries) in ranking.events() {
            let mut event = [MISSED; LABELS];
            for (place, ((row, entry), chosen)) in problem.rows().zip(entries).zip(&mut event).enumerate() {
                let column = entry.checked_sub(1).and_then(|column| columns.get(usize::from(column)));
                *chosen = column.and_then(|column| choice(place, row, *column)).unwrap_or(fates(row).0);
            }
            found(ln_weight, event.get(..entries.len()).unwrap_or_default());
        }
        complete && ranking.is_exhaustive()
    }
}
