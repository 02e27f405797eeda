//! Counts operations in a build with the feature `count`, so that worst cases can be held against their formulas.

#[cfg(feature = "count")]
use core::sync::atomic::{AtomicUsize, Ordering};

/// Operations of one kind, in all threads together: nothing at all without the feature.
pub(crate) struct Counter {
    #[cfg(feature = "count")]
    operations: AtomicUsize,
}

impl Counter {
    pub const fn new() -> Self {
        Self {
            #[cfg(feature = "count")]
            operations: AtomicUsize::new(0),
        }
    }

    #[inline(always)]
    pub fn add(&self, operations: usize) {
        #[cfg(feature = "count")]
        self.operations.fetch_add(operations, Ordering::Relaxed);
        #[cfg(not(feature = "count"))]
        let _ = operations;
    }

    /// What was counted since the last call.
    #[cfg(feature = "count")]
    pub fn take(&self) -> usize {
        self.operations.swap(0, Ordering::Relaxed)
    }
}
