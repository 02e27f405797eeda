//! Sets of modes: which models of a bank are at work for a target.

/// A set of modes by their numbers, at most [`MOST`](Self::MOST) of them: one bit each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ActiveSet(u32);

impl ActiveSet {
    /// No mode.
    pub const EMPTY: Self = Self(0);
    /// Modes are numbered below this.
    pub const MOST: usize = 32;

    /// The modes below `count`.
    #[must_use]
    pub const fn first(count: usize) -> Self {
        Self(match count {
            0 => 0,
            1..Self::MOST => (1 << count) - 1,
            _ => u32::MAX,
        })
    }

    /// `mode` alone; a number beyond the last gives the empty set.
    #[inline(always)]
    #[must_use]
    pub const fn of(mode: usize) -> Self {
        Self(if mode < Self::MOST { 1 << mode } else { 0 })
    }

    /// Whether `mode` belongs to it.
    #[inline(always)]
    #[must_use]
    pub const fn contains(self, mode: usize) -> bool {
        self.0 & Self::of(mode).0 != 0
    }

    /// How many modes there are.
    #[inline(always)]
    #[must_use]
    pub const fn len(self) -> usize {
        self.0.count_ones() as usize
    }

    /// Whether there is none.
    #[inline(always)]
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The modes of either set.
    #[inline(always)]
    #[must_use]
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// The modes that are not in `other`.
    #[inline(always)]
    #[must_use]
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// The modes in ascending order, one step for each: those not in the set cost nothing.
    #[inline(always)]
    pub fn iter(self) -> impl Iterator<Item = usize> + Clone {
        let mut rest = self.0;
        core::iter::from_fn(move || {
            let mode = rest.trailing_zeros();
            rest &= rest.wrapping_sub(1);
            (mode < u32::BITS).then_some(mode as usize)
        })
    }
}

impl FromIterator<usize> for ActiveSet {
    fn from_iter<I: IntoIterator<Item = usize>>(modes: I) -> Self {
        modes.into_iter().fold(Self::EMPTY, |set, mode| set.with(Self::of(mode)))
    }
}
