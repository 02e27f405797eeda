//! What the scenarios' filters share: how they run and fail, and constants and plots in their precision.

use super::Order;
use crate::precision::Scalar;
use crate::{Failure, Precision, monte_carlo};
use boresight::error::{ConfigError, ScanError};
use boresight::fusion::{FusionReport, ListError};
use boresight::mode::JumpMatrix;
use boresight::scan::{Detection, Report};

/// What can go wrong besides the data: nothing, unless the constants of a scenario are.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    #[error("{0}")]
    Config(#[from] ConfigError),
    #[error("{0}")]
    Scan(#[from] ScanError),
    #[error("{0}")]
    List(#[from] ListError),
    #[error("a track could not be started")]
    Start,
    #[error("detections were dropped: {0:?}")]
    Dropped(Report),
    #[error("the picture has no room: {0:?}")]
    Full(FusionReport),
}

impl Fault {
    /// The failure of the filter `name`.
    pub fn of(self, name: &str) -> Failure {
        Failure::input(self).within(name)
    }
}

/// A filter by its name, over the data of a run.
pub type Filter<D, R> = fn(&str, &D) -> Result<R, Failure>;

impl Order {
    /// All runs, in parallel; or the failure of the first that fails.
    pub fn repeat<R: Send>(&self, scenario: &str, run: impl Fn(u64) -> Result<R, Failure> + Sync) -> Result<Vec<R>, Failure> {
        monte_carlo::run(scenario, self.runs, run).into_iter().collect()
    }

    /// What the chosen filters make of the data of a run, in single precision or in double.
    pub fn filter<D, R>(&self, data: &D, [single, double]: [Filter<D, R>; 2]) -> Result<Vec<R>, Failure> {
        let filter = match self.precision {
            Precision::F32 => single,
            Precision::F64 => double,
        };
        self.filters.iter().map(|name| filter(name, data)).collect()
    }
}

/// The probabilities of jumps in the precision of the filter.
pub fn jump<T: Scalar, const MODES: usize>(matrix: [[f64; MODES]; MODES]) -> JumpMatrix<T, MODES> {
    matrix.map(|row| row.map(T::lit))
}

/// The plots of a scan as detections.
pub fn detections<T: Scalar, const NZ: usize>(plots: &[[f64; NZ]]) -> Vec<Detection<T, NZ>> {
    plots.iter().map(|plot| Detection::new(plot.map(T::lit))).collect()
}
