//! Independent seeded runs: in parallel, in order, the same whatever the number of threads.
//!
//! Run i of base seed B draws from the generator ChaCha8 seeded with B + i (mod 2^64). Stream 0 makes the
//! truth and the measurements, stream 1 the filters' initial errors: however many numbers a filter draws,
//! the data of the run stay byte-identical, so all filters can be compared on the same data.
//!
//! Results come back in the order of i and are to be reduced in that order: floating-point sums then do
//! not depend on the scheduling either.

use indicatif::{ProgressBar, ProgressStyle};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// A debug build keeps every temporary of a tracker's step on the stack; rayon's default of 2 MiB is tight.
const STACK_BYTES: usize = 16 << 20;

/// The random numbers of one run.
#[derive(Debug, Clone)]
pub struct Streams {
    /// Truth, detections, noise, clutter.
    pub data: ChaCha8Rng,
    /// Initial errors of the filters. Clone it for each filter that is to start from the same error.
    pub initial: ChaCha8Rng,
}

/// The generators of run `index` of base seed `base`.
#[must_use]
pub fn streams(base: u64, index: u64) -> Streams {
    let stream = |number| {
        let mut rng = ChaCha8Rng::seed_from_u64(base.wrapping_add(index));
        rng.set_stream(number);
        rng
    };
    Streams { data: stream(0), initial: stream(1) }
}

/// Calls `job` with 0, 1, .. `runs` - 1 on all cores and returns the results in that order.
///
/// Shows `label`, a bar and the time left on stderr while it runs, when that is a terminal.
pub fn run<R: Send>(label: &str, runs: u64, job: impl Fn(u64) -> R + Sync) -> Vec<R> {
    let bar = progress_bar(label, runs);
    let work = || {
        (0..runs)
            .into_par_iter()
            .map(|index| {
                let result = job(index);
                bar.inc(1);
                result
            })
            .collect()
    };
    let results = match rayon::ThreadPoolBuilder::new().stack_size(STACK_BYTES).build() {
        Ok(pool) => pool.install(work),
        // The system refuses threads of its own: one thread does the same work.
        Err(_) => (0..runs).map(&job).inspect(|_| bar.inc(1)).collect(),
    };
    bar.finish_and_clear();
    results
}

fn progress_bar(label: &str, runs: u64) -> ProgressBar {
    const TEMPLATE: &str = "{prefix} {bar:32} {pos}/{len} runs, {elapsed} passed, {eta} left";
    let bar = ProgressBar::new(runs).with_prefix(label.to_owned());
    match ProgressStyle::with_template(TEMPLATE) {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::Rng;

    fn draws(index: u64) -> (u64, u64) {
        let mut streams = streams(20_000, index);
        (streams.data.next_u64(), streams.initial.next_u64())
    }

    #[test]
    fn number_of_threads_changes_nothing() {
        let serial: Vec<_> = (0..200).map(draws).collect();
        for threads in [1, 2, 5] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            let parallel = pool.map(|pool| pool.install(|| run("test", 200, draws)));
            assert!(parallel.is_ok_and(|results| results == serial));
        }
    }

    #[test]
    fn run_i_of_a_base_is_run_0_of_base_plus_i() {
        assert_eq!(streams(5, 7).data, streams(12, 0).data);
        assert_eq!(streams(u64::MAX, 1).data, streams(0, 0).data);
        assert_ne!(streams(5, 7).data, streams(5, 8).data);
    }

    #[test]
    fn streams_are_separate() {
        let (data, initial) = draws(0);
        assert_ne!(data, initial);
        let mut drained = streams(20_000, 0);
        drained.initial.next_u64();
        assert_eq!(drained.data.next_u64(), data, "initial errors must not touch the data");
    }

    #[test]
    fn no_runs_no_results() {
        assert!(run("test", 0, draws).is_empty());
    }
}
