//! The steps of joint association and of ranking, counted in a build with the feature `count`.

use crate::counter::Counter;

static OPERATIONS: Counter = Counter::new();

/// Counts `operations`: nothing at all without the feature.
#[inline(always)]
pub(super) fn count(operations: usize) {
    OPERATIONS.add(operations);
}

/// Takes the number of operations that [`Jpda`](super::Jpda), [`Gnn`](super::Gnn) and [`KBest`](super::KBest) counted since the
/// last call, in all threads: steps of loops over weights, sets, keys and messages; looks at pairs and events.
#[cfg(feature = "count")]
pub fn take_operations() -> usize {
    OPERATIONS.take()
}
