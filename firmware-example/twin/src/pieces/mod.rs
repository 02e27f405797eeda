//! Pieces of a scan one by one, and what they must give: the workloads of the image `kernels`.
//!
//! ```text
//! ekf2_update_4    one measurement, from G = P H' to x + G w, P − G E G': range, azimuth;            states (x, vx, y, vy)
//! ekf3_update_4    the same with range-rate
//! ekf4_update_9    range, azimuth, elevation, range-rate;    three axes of position, velocity, acceleration
//! ukf4_update_9    the same by 19 sigma points
//! convert_polar    range, azimuth, elevation to Cartesian coordinates, debiased
//! turn_predict_5   a turn at an unknown rate; states (x, vx, y, vy, ω)
//! mix3_4, mix7_4   interaction of 3 and of 7 modes; states (x, vx, y, vy)
//! gate64_polar     64 detections of range and azimuth, 4 in the gate of a track with 3 modes, and their weights
//! gate64_plane     the same in Cartesian coordinates
//! cluster16_32     marginal association probabilities of 16 tracks and 32 detections in 7 clusters of 1 to 4 tracks
//! ```
//!
//! A density agrees with its reference if no mean is off by more than a thousandth of its standard deviation, and no
//! covariance by more than a thousandth of the product of the two: whatever the units, an error nobody can see in a track.
//! Single precision, with seven digits, loses four of them at most.

#[rustfmt::skip]
pub mod data;

use crate::workloads::{Bank, Density};
use boresight::association::{Associator, ClutterPrior, Completeness, Domain, Gate, Jpda, JpdaMemory, Pda, SingleAssociator};
use boresight::error::ConfigError;
use boresight::evidence::{Evidence, Innovations};
use boresight::gaussian::Gaussian;
use boresight::mode::{JumpMatrix, ModeBank};
use boresight::model::MeasurementModel;
use boresight::model::converted::{Converted, Polar};
use boresight::model::motion::ProcessNoise;
use boresight::model::position::Position;
use boresight::model::radar::{Component, Radar};
use boresight::model::turn::UnknownTurn;
use boresight::model::unscented::{Scaling, Unscented};
use boresight::scan::{Candidates, Detection};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use nalgebra::SVector;

/// Calls of every piece that carries on with its own results.
pub const CALLS: usize = 4;
/// Time step of the turn \[s\]
pub const DT: f32 = 1.0;
/// Tracks of the joint association
pub const TRACKS: usize = 16;
/// Detections of the joint association, and in the scan to be gated
pub const DETS: usize = 32;
/// Detections in the scan to be gated
pub const PLOTS: usize = 64;
/// Modes of the track that gates
pub const MODES: usize = 3;
/// Room for sets of served tracks
pub const NODES: usize = 128;
/// The largest error, as a share of a standard deviation or as a probability
pub const TOLERANCE: f32 = 1e-3;

/// Range and azimuth in the plane.
pub type Radar2 = Radar<f32, 2, 2, 2>;
/// Range, azimuth and range-rate in the plane.
pub type Radar3 = Radar<f32, 3, 2, 2>;
/// Range, azimuth, elevation and range-rate in space.
pub type Radar4 = Radar<f32, 4, 3, 3>;
/// The weights of the joint association.
pub type Matrix = boresight::association::AssociationMatrix<f32, TRACKS, DETS>;
/// What the joint association works in.
pub type Joint = JpdaMemory<f32, TRACKS, DETS, NODES>;
/// The evidence of one scan.
pub type Scored = Evidence<f32, PLOTS>;

/// Updates by several measurements, one after the other.
#[derive(Clone, Copy, Debug)]
pub struct Updates<const NX: usize, const NZ: usize> {
    /// Before the first
    pub start: Density<NX>,
    /// Measurements
    pub z: [[f32; NZ]; CALLS],
    /// After the last
    pub expected: Density<NX>,
}

/// [`CALLS`] predictions over [`DT`].
#[derive(Clone, Copy, Debug)]
pub struct Predictions<const NX: usize> {
    /// Before the first
    pub start: Density<NX>,
    /// After the last
    pub expected: Density<NX>,
}

/// [`CALLS`] interactions.
#[derive(Clone, Copy, Debug)]
pub struct Mixing<const NX: usize, const R: usize> {
    /// π
    pub jump: JumpMatrix<f32, R>,
    /// Before the first
    pub start: Bank<NX, R>,
    /// After the last
    pub expected: Bank<NX, R>,
}

/// One track and one scan.
#[derive(Clone, Copy, Debug)]
pub struct Gating {
    /// The track
    pub start: Bank<4, MODES>,
    /// The scan
    pub z: [[f32; 2]; PLOTS],
    /// Numbers of the detections in the gate
    pub gated: [u16; 4],
    /// β of none of them, and of each
    pub beta: [f32; 5],
}

/// Whether `g` is `expected`, by the tolerance of the module. What is not a number is not.
fn agrees<const NX: usize>(g: &Gaussian<f32, NX>, expected: &Density<NX>) -> bool {
    let expected = expected.gaussian();
    let (got, want) = (g.cov.upper(), expected.cov.upper());
    let is_near = |i: usize| {
        let off = g.mean[i] - expected.mean[i];
        let covariances = (i..NX).all(|j| {
            let off = got[i][j] - want[i][j];
            off * off <= TOLERANCE * TOLERANCE * want[i][i] * want[j][j]
        });
        off * off <= TOLERANCE * TOLERANCE * want[i][i] && covariances
    };
    (0..NX).all(is_near)
}

/// Whether probabilities are those expected.
fn all_near<'a>(got: impl Iterator<Item = &'a f32>, expected: impl Iterator<Item = &'a f32>) -> bool {
    got.zip(expected).all(|(a, b)| (a - b).abs() <= TOLERANCE)
}

/// The Kalman update of `g` by the measurement `z` of `model`; `false` where it would have broken the covariance.
#[inline(always)]
#[must_use]
pub fn update<M: MeasurementModel<f32, NX, NZ>, const NX: usize, const NZ: usize>(
    model: &M,
    g: &mut Gaussian<f32, NX>,
    z: &SVector<f32, NZ>,
) -> bool {
    let innovation = model.innovation(g);
    let nu = model.residual(z, &innovation.z_hat);
    g.update(&innovation, &nu)
}

impl<const NX: usize, const NZ: usize> Updates<NX, NZ> {
    /// Whether `update` does all of them, and ends where it should.
    pub fn pass(&self, mut update: impl FnMut(&mut Gaussian<f32, NX>, &SVector<f32, NZ>) -> bool) -> bool {
        let mut g = self.start.gaussian();
        self.z.iter().all(|z| update(&mut g, &SVector::from(*z))) && agrees(&g, &self.expected)
    }
}

impl<const NX: usize> Predictions<NX> {
    /// Whether `predict` ends where it should.
    pub fn pass(&self, mut predict: impl FnMut(&mut Gaussian<f32, NX>)) -> bool {
        let mut g = self.start.gaussian();
        (0..CALLS).for_each(|_| predict(&mut g));
        agrees(&g, &self.expected)
    }
}

impl<const NX: usize, const R: usize> Mixing<NX, R> {
    /// Whether `mix` ends where it should.
    pub fn pass(&self, bank: &mut ModeBank<f32, NX, R>, mut mix: impl FnMut(&mut ModeBank<f32, NX, R>, &JumpMatrix<f32, R>)) -> bool {
        *bank = self.start.mode_bank();
        (0..CALLS).for_each(|_| mix(bank, &self.jump));
        let modes = bank.modes.iter().zip(&self.expected.modes).all(|(g, expected)| agrees(g, expected));
        modes && all_near(bank.prob.iter(), self.expected.prob.iter())
    }
}

impl Gating {
    /// Whether `collect` gates the detections it should, by weights of the right proportions.
    pub fn pass(&self, scored: &mut Scored, collect: impl FnOnce(&ModeBank<f32, 4, MODES>, &[Detection<f32, 2>], &mut Scored)) -> bool {
        collect(&self.start.mode_bank(), &self.z.map(Detection::new), scored);
        let (miss, hits) = scored.weights();
        let beta_0 = Pda.associate(miss, hits);
        // With the probabilities in place of the weights.
        let beta = core::iter::once(&beta_0).chain(&*hits);
        all_near(beta, self.beta.iter()) && scored.gated() == self.gated
    }
}

/// The numbers of all detections in the scan to be gated
pub const ALL: [u16; PLOTS] = {
    let mut numbers = [0; PLOTS];
    let mut i = 0;
    while i < PLOTS {
        numbers[i] = i as u16;
        i += 1;
    }
    numbers
};

/// Gates and scores every detection.
#[inline(always)]
pub fn collect<M: MeasurementModel<f32, 4, 2>>(
    sensor: &UniformSensor<M, f32>,
    bank: &ModeBank<f32, 4, MODES>,
    predicted: &Innovations<f32, 4, 2, MODES>,
    detections: &[Detection<f32, 2>],
    candidates: Candidates<'_>,
    scored: &mut Scored,
) -> f32 {
    scored.collect(bank, predicted, sensor, detections, candidates)
}

/// The sensors and models of all pieces.
#[derive(Clone, Debug)]
pub struct Models {
    /// Of `ekf2_update_4`
    pub radar2: Radar2,
    /// Of `ekf3_update_4`
    pub radar3: Radar3,
    /// Of `ekf4_update_9`
    pub radar4: Radar4,
    /// Of `ukf4_update_9`
    pub unscented: Unscented<Radar4, f32>,
    /// Of `turn_predict_5`
    pub turn: UnknownTurn<f32, 2>,
    /// Of `gate64_polar`
    pub polar: UniformSensor<Radar2, f32>,
    /// Of `gate64_plane`
    pub plane: UniformSensor<Position<f32, 2, 2>, f32>,
}

impl Models {
    /// All of them.
    ///
    /// # Errors
    /// Where a configuration here is wrong.
    pub fn new() -> Result<Self, ConfigError> {
        use Component::{Azimuth, Elevation, Range, RangeRate};
        let (range, azimuth, elevation, rate) = (400.0, 4e-6, 9e-6, 0.25);
        let radar2 = Radar::new([Range, Azimuth], Symmetric::from_diagonal([range, azimuth]))?;
        let radar4 = Radar::new([Range, Azimuth, Elevation, RangeRate], Symmetric::from_diagonal([range, azimuth, elevation, rate]))?;
        let position = Position::new(Symmetric::from_diagonal([400.0, 400.0]))?;
        let gate = Gate::new::<2>(16.0)?;
        Ok(Self {
            radar2,
            radar3: Radar::new([Range, Azimuth, RangeRate], Symmetric::from_diagonal([range, azimuth, rate]))?,
            radar4,
            unscented: Unscented { model: radar4, scaling: Scaling::new::<9>(0.5, 2.0, 0.0)? },
            turn: UnknownTurn::new(ProcessNoise::Discrete(0.5), ProcessNoise::Discrete(1e-4))?,
            polar: UniformSensor::new(radar2, 0.9, Clutter::Poisson(2e-4), gate)?,
            plane: UniformSensor::new(position, 0.9, Clutter::Poisson(4e-5), gate)?,
        })
    }
}

/// The measurement of `convert_polar`.
#[must_use]
pub fn polar() -> Polar<f32> {
    let [range, azimuth, elevation, range_variance, azimuth_variance, elevation_variance] = data::POLAR;
    Polar { range, azimuth, elevation, range_variance, azimuth_variance, elevation_variance }
}

/// Whether `converted` is the measurement of [`polar`] in Cartesian coordinates.
#[must_use]
pub fn is_converted(converted: &Converted<f32>) -> bool {
    agrees(&Gaussian::new(SVector::from(converted.position), converted.cov), &data::CONVERTED)
}

/// Whether `associate` makes the right probabilities of the weights of the joint association.
pub fn associates(matrix: &mut Matrix, associate: impl FnOnce(&mut Matrix) -> Completeness) -> bool {
    matrix.reset(DETS, ClutterPrior::Poisson, Domain::Linear);
    matrix.miss = data::MISS;
    for (track, detection, weight) in data::HIT {
        if let Some(hit) = matrix.hit.get_mut(usize::from(track)).and_then(|row| row.get_mut(usize::from(detection))) {
            *hit = weight;
        }
    }
    let complete = associate(matrix).is_exact();
    let entry = |(track, detection, _): &(u8, u8, f32)| matrix.hit.get(usize::from(*track))?.get(usize::from(*detection));
    let hits = data::HIT.iter().filter_map(entry);
    complete && all_near(matrix.miss.iter(), data::BETA_MISS.iter()) && all_near(hits, data::BETA_HIT.iter())
}

/// The joint association.
#[inline(always)]
pub fn joint(matrix: &mut Matrix, memory: &mut Joint) -> Completeness {
    Jpda::<NODES>::new().associate(matrix, memory)
}
