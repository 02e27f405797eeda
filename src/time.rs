//! Time in integer microseconds, so that an hour of uptime costs no precision.

use crate::scalar::Real;

/// A point in time: microseconds since an epoch of the caller's choice. There is no clock inside the library.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Instant {
    micros: u64,
}

/// A signed span of time in microseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Duration {
    micros: i64,
}

impl Instant {
    /// The epoch.
    pub const ZERO: Instant = Instant { micros: 0 };

    /// `micros` microseconds after the epoch.
    #[must_use]
    pub const fn from_micros(micros: u64) -> Self {
        Self { micros }
    }

    /// `millis` milliseconds after the epoch, saturating.
    #[must_use]
    pub const fn from_millis(millis: u64) -> Self {
        Self { micros: millis.saturating_mul(1000) }
    }

    /// Microseconds since the epoch.
    #[must_use]
    pub const fn as_micros(self) -> u64 {
        self.micros
    }

    /// The time from `earlier` to `self`, negative where `earlier` is the later one; saturates after 292,000 years.
    #[must_use]
    pub const fn since(self, earlier: Instant) -> Duration {
        let span = self.micros.wrapping_sub(earlier.micros) as i64;
        let micros = match (self.micros >= earlier.micros, span < 0) {
            (true, true) => i64::MAX,
            (false, false) => i64::MIN,
            _ => span,
        };
        Duration { micros }
    }
}

impl Duration {
    /// No time.
    pub const ZERO: Duration = Duration { micros: 0 };

    /// `micros` microseconds.
    #[must_use]
    pub const fn from_micros(micros: i64) -> Self {
        Self { micros }
    }

    /// `millis` milliseconds, saturating.
    #[must_use]
    pub const fn from_millis(millis: i64) -> Self {
        Self { micros: millis.saturating_mul(1000) }
    }

    /// Microseconds.
    #[must_use]
    pub const fn as_micros(self) -> i64 {
        self.micros
    }

    /// Seconds, in the tracker's scalar.
    #[must_use]
    pub fn as_secs<T: Real>(self) -> T {
        T::from_micros(self.micros)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_are_signed_and_saturate() {
        let (a, b) = (Instant::from_millis(5), Instant::from_micros(7_500));
        assert_eq!(b.since(a), Duration::from_micros(2_500));
        assert_eq!(a.since(b), Duration::from_micros(-2_500));
        let last = Instant::from_micros(u64::MAX);
        assert_eq!(last.since(Instant::ZERO).as_micros(), i64::MAX);
        assert_eq!(Instant::ZERO.since(last).as_micros(), i64::MIN);
        assert_eq!(b.since(a).as_secs::<f32>(), 0.0025);
    }
}
