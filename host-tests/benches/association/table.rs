//! The table: our time, and the times of the others as multiples of it.

use crate::pyehm::Pyehm;
use crate::support::times;
use crate::{FEW, MOST_EVENTS, Measured, Run, difference};

/// Prints the table, its legend, and where we are slower than PyEHM.
pub fn print(all: &[Measured], pyehm: &Pyehm) {
    println!("\n| problem | joint events | f64 [us] | f32 | {FEW} nodes, f32 | its answer | enumeration | PyEHM |");
    println!("|---|--:|--:|--:|--:|---|--:|--:|");
    for m in all {
        let name = m.problem.name();
        let events = m.events.map_or(format!("> {:.0e}", MOST_EVENTS as f64), |n| n.to_string());
        let ours = m.double.as_ref().map(|run| run.seconds);
        let multiple = |seconds: Option<f64>| ours.zip(seconds).map_or(String::new(), |(ours, s)| times(s / ours));
        let double = m.double.as_ref().map_or(String::new(), |run| format!("{:.2}{}", run.seconds * 1e6, unless_exact(run)));
        let single = multiple(m.single.as_ref().map(|run| run.seconds));
        let few = if ours.is_some() { multiple(Some(m.few.seconds)) } else { format!("{:.0} us", m.few.seconds * 1e6) };
        let answer = answer(&m.few, m.exact());
        let theirs = match pyehm.seconds.get(&name) {
            None => String::new(),
            Some(Some(s)) if ours.is_none() => format!("{:.0} us", s * 1e6),
            Some(Some(s)) => multiple(Some(s - pyehm.call)),
            Some(None) => format!("> {}", ours.map_or(format!("{} s", pyehm.limit), |ours| times(pyehm.limit / ours))),
        };
        println!("| {name} | {events} | {double} | {single} | {few} | {answer} | {} | {theirs} |", multiple(m.enumeration));
    }
    legend(all, pyehm);
}

fn legend(all: &[Measured], pyehm: &Pyehm) {
    println!("\nTimes but the first are multiples of it, of this run on this machine. \"<= 1e-2\": every probability is within 0.01 of");
    println!("the exact one; \"approx.\": belief propagation, with its largest error in brackets where the exact answer is known.");
    let pairs = || all.iter().filter_map(|m| m.double.as_ref().zip(m.single.as_ref()));
    let apart = pairs().fold(0.0, |worst, (double, single)| f64::max(worst, difference(&double.marginals, &single.marginals)));
    println!("Exact f32 is off by {apart:.1e} at most.");
    if pyehm.seconds.is_empty() {
        return;
    }
    println!("PyEHM {}, less the {:.1} us of a call from Python; \"> x9\": given up.", pyehm.version, pyehm.call * 1e6);
    let slower = |m: &&Measured| {
        let theirs = pyehm.seconds.get(&m.problem.name()).copied().flatten().map(|s| s - pyehm.call);
        theirs.is_some_and(|theirs| m.exact().is_none_or(|run| run.seconds > theirs))
    };
    let slower: Vec<String> = all.iter().filter(slower).map(|m| m.problem.name()).collect();
    println!("PyEHM is faster, or has the exact answer alone, in: {}.", if slower.is_empty() { "none".into() } else { slower.join(", ") });
}

/// What the answer with few nodes is worth.
fn answer(few: &Run, exact: Option<&Run>) -> String {
    match few.completeness {
        c if c.is_exact() => "exact".into(),
        c if c.approximated == 0 => format!("<= {:.1e}", c.error_bound),
        _ => exact.map_or("approx.".into(), |exact| format!("approx. ({:.3})", difference(&exact.marginals, &few.marginals))),
    }
}

fn unless_exact(run: &Run) -> String {
    if run.completeness.is_exact() { String::new() } else { format!(" ({})", answer(run, None)) }
}
