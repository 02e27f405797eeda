//! Counts operations in a build with the feature `count`, so that worst cases can be held against their formulas.

#[cfg(feature = "count")]
static OPERATIONS: core::sync::atomic::AtomicUsize = core::sync::atomic::AtomicUsize::new(0);

/// Counts `operations`: nothing at all without the feature.
#[inline(always)]
pub(super) fn count(operations: usize) {
    #[cfg(feature = "count")]
    OPERATIONS.fetch_add(operations, core::sync::atomic::Ordering::Relaxed);
    #[cfg(not(feature = "count"))]
    let _ = operations;
}

/// Takes the number of operations that [`Jpda`](super::Jpda) counted since the last call, in all threads: steps of loops over
/// weights, sets, keys and messages.
#[cfg(feature = "count")]
pub fn take_operations() -> usize {
    OPERATIONS.swap(0, core::sync::atomic::Ordering::Relaxed)
}
