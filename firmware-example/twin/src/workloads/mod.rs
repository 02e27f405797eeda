//! Four kernels on five scans each, and what they must give: the workloads of the image `budget`, and of anyone who wants to
//! compare the library with something else.
//!
//! ```text
//! imm6   one scan of one track, states (x, vx, ax, y, vy, ay): constant velocity and constant acceleration
//! imm4   the same, states (x, vx, y, vy): constant velocity, a turn to the left and one to the right
//!          μ_i|j = π_ij μ_i / c_j, mixing;  x ← F x, P ← F P F' + Q;  ν = z − H x, S = H P H' + R
//!          ν' S⁻¹ ν ≤ γ by the mode with the largest det S;  all four plots are in the gate
//!          PDA in every mode, clutter of known density, P_D and P_G < 1;  μ_j;  combination
//! jpda   marginal association probabilities of 4 tracks and 8 detections, 16 pairs gated: 356 joint events
//!          weight of an event: Π P_D L_tj / λ over the tracks that have a detection, Π (1 − P_D) over the others
//! kf4    constant velocity over (x, vx, y, vy), prediction and one position
//! ```
//!
//! The IMM-PDAF here is PDA inside every mode with the mode's own likelihoods. The library associates once, by the mixture of
//! the modes, and gives each mode its share: one target, Poisson clutter, and both are the same filter.

#[rustfmt::skip]
pub mod data;

use boresight::association::{AssociationMatrix, ClutterPrior, Domain, Gate};
use boresight::error::ConfigError;
use boresight::evidence::{Evidence, Innovations, no_innovations, predict_measurements};
use boresight::gaussian::Gaussian;
use boresight::mode::{ActiveSet, JumpMatrix, ModeBank, ModeSet};
use boresight::model::motion::{ConstantAcceleration, ConstantVelocity, ProcessNoise, VelocityStep};
use boresight::model::position::Position;
use boresight::model::turn::KnownTurn;
use boresight::model::{MeasurementModel, MotionModel};
use boresight::scan::{Candidates, Detection};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use nalgebra::SVector;

/// Plots a scan
pub const PLOTS: usize = 4;
/// Detections that a gate has room for
pub const ROOM: usize = 16;
/// Tracks of the joint association
pub const TRACKS: usize = 4;
/// Detections of the joint association
pub const DETS: usize = 8;
/// The largest error of a block of results, as a share of the block's largest reference
pub const TOLERANCE: f32 = 1e-4;

/// The plots of one scan.
pub type Plots = [Detection<f32, 2>; PLOTS];
/// The weights of the joint association.
pub type Matrix = AssociationMatrix<f32, TRACKS, DETS>;
/// The configuration of `imm6`.
pub type Imm6 = Imm<(ConstantVelocity<f32, 2, 3>, ConstantAcceleration<f32, 2>), 6, 3, 2>;
/// The configuration of `imm4`.
pub type Imm4 = Imm<(ConstantVelocity<f32, 2>, KnownTurn<f32, 2>, KnownTurn<f32, 2>), 4, 2, 3>;

/// A Gaussian density in plain numbers.
#[derive(Clone, Copy, Debug)]
pub struct Density<const NX: usize> {
    /// x
    pub mean: [f32; NX],
    /// P, of which the upper triangle counts
    pub cov: [[f32; NX]; NX],
}

/// The density of a target over modes in plain numbers.
#[derive(Clone, Copy, Debug)]
pub struct Bank<const NX: usize, const MODES: usize> {
    /// μ
    pub prob: [f32; MODES],
    /// x_j, P_j
    pub modes: [Density<NX>; MODES],
}

/// What one scan must give.
#[derive(Clone, Copy, Debug)]
pub struct Expected<const NX: usize, const MODES: usize> {
    /// After the update
    pub bank: Bank<NX, MODES>,
    /// The combined estimate
    pub combined: Density<NX>,
}

/// Whether all values lie within the tolerance of the references of their block. What is not a number does not.
fn agree(values: impl Iterator<Item = f32>, references: impl Iterator<Item = f32> + Clone) -> bool {
    let largest = references.clone().fold(0.0, |m: f32, r| if r.abs() > m { r.abs() } else { m });
    values.zip(references).all(|(v, r)| (v - r).abs() <= TOLERANCE * largest)
}

/// The entries (i, j) with i ≤ j.
fn upper<const N: usize>(rows: &[[f32; N]; N]) -> impl Iterator<Item = f32> + Clone {
    rows.iter().enumerate().flat_map(|(i, row)| row.iter().skip(i).copied())
}

fn symmetric<const N: usize>(rows: &[[f32; N]; N]) -> Symmetric<f32, N> {
    let mut s = Symmetric::zeros();
    *s.upper_mut() = *rows;
    s
}

impl<const NX: usize> Density<NX> {
    /// The same as the library has it.
    #[must_use]
    pub fn gaussian(&self) -> Gaussian<f32, NX> {
        Gaussian::new(SVector::from(self.mean), symmetric(&self.cov))
    }

    /// Whether `g` is this density, mean and covariance each a block.
    #[must_use]
    pub fn agrees(&self, g: &Gaussian<f32, NX>) -> bool {
        agree(g.mean.iter().copied(), self.mean.iter().copied()) && agree(upper(g.cov.upper()), upper(&self.cov))
    }
}

impl<const NX: usize, const MODES: usize> Bank<NX, MODES> {
    /// The same as the library has it.
    #[must_use]
    pub fn mode_bank(&self) -> ModeBank<f32, NX, MODES> {
        ModeBank { prob: self.prob, modes: self.modes.each_ref().map(Density::gaussian) }
    }

    fn agrees(&self, bank: &ModeBank<f32, NX, MODES>) -> bool {
        agree(bank.prob.iter().copied(), self.prob.iter().copied()) && self.modes.iter().zip(&bank.modes).all(|(d, g)| d.agrees(g))
    }
}

/// A track and the scratch of its steps.
#[derive(Clone, Debug)]
pub struct Track<const NX: usize, const MODES: usize> {
    bank: ModeBank<f32, NX, MODES>,
    innovations: Innovations<f32, NX, 2, MODES>,
    evidence: Evidence<f32, ROOM>,
    combined: Gaussian<f32, NX>,
}

impl<const NX: usize, const MODES: usize> Default for Track<NX, MODES> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const NX: usize, const MODES: usize> Track<NX, MODES> {
    /// All zero bits.
    #[must_use]
    pub const fn new() -> Self {
        Self { bank: ModeBank::ZERO, innovations: no_innovations(), evidence: Evidence::new(), combined: Gaussian::ZERO }
    }

    /// Puts the track where the scans find it.
    pub fn start(&mut self, at: &Bank<NX, MODES>) {
        self.bank = at.mode_bank();
    }

    /// Whether bank and combined estimate are as expected.
    #[must_use]
    pub fn agrees(&self, expected: &Expected<NX, MODES>) -> bool {
        expected.bank.agrees(&self.bank) && expected.combined.agrees(&self.combined)
    }
}

/// An IMM-PDAF for one track and a sensor of positions.
#[derive(Clone, Debug)]
pub struct Imm<M: ModeSet<f32, NX, MODES>, const NX: usize, const STRIDE: usize, const MODES: usize> {
    modes: M,
    /// Those of one scan, which all tracks share
    steps: M::Steps,
    jump: JumpMatrix<f32, MODES>,
    sensor: UniformSensor<Position<f32, 2, STRIDE>, f32>,
}

impl Imm6 {
    /// `imm6`.
    ///
    /// # Errors
    /// Where a configuration here is wrong.
    pub fn new() -> Result<Self, ConfigError> {
        let (quiet, lively) = (ProcessNoise::Discrete(0.25), ProcessNoise::Discrete(2.25));
        Self::of((ConstantVelocity::new(quiet)?, ConstantAcceleration::new(lively)?), data::IMM6_JUMP)
    }
}

impl Imm4 {
    /// `imm4`.
    ///
    /// # Errors
    /// Where a configuration here is wrong.
    pub fn new() -> Result<Self, ConfigError> {
        let (quiet, lively) = (ProcessNoise::Discrete(0.25), ProcessNoise::Discrete(0.64));
        let (left, right) = (KnownTurn::new(data::TURN, lively)?, KnownTurn::new(-data::TURN, lively)?);
        Self::of((ConstantVelocity::new(quiet)?, left, right), data::IMM4_JUMP)
    }
}

impl<M: ModeSet<f32, NX, MODES>, const NX: usize, const STRIDE: usize, const MODES: usize> Imm<M, NX, STRIDE, MODES> {
    fn of(modes: M, jump: JumpMatrix<f32, MODES>) -> Result<Self, ConfigError> {
        let gate = Gate::new::<2>(data::THRESHOLD)?.with_probability(data::P_GATE)?;
        let position = Position::new(symmetric(&data::NOISE))?;
        let sensor = UniformSensor::new(position, data::P_DETECT, Clutter::Poisson(data::DENSITY), gate)?;
        Ok(Self { steps: modes.steps(data::DT), modes, jump, sensor })
    }

    /// One scan of one track.
    #[inline(always)]
    pub fn step(&self, track: &mut Track<NX, MODES>, plots: &[Detection<f32, 2>], candidates: Candidates<'_>) {
        let Track { bank, innovations, evidence, combined } = track;
        let model = &self.sensor.model;
        bank.interact(&self.jump);
        bank.advance(&self.modes, &self.steps);
        predict_measurements(innovations, bank, ActiveSet::first(MODES), model);
        evidence.gate(bank, innovations, &self.sensor, plots, candidates);
        evidence.pda(bank, innovations, &self.sensor, plots, 1.0);
        bank.combine(combined);
    }
}

/// A Kalman filter of constant velocity and a sensor of positions.
#[derive(Clone, Debug)]
pub struct Kf4 {
    motion: ConstantVelocity<f32, 2>,
    step: VelocityStep<f32>,
    position: Position<f32, 2, 2>,
}

impl Kf4 {
    /// `kf4`.
    ///
    /// # Errors
    /// Where a configuration here is wrong.
    pub fn new() -> Result<Self, ConfigError> {
        let motion = ConstantVelocity::new(ProcessNoise::Discrete(0.25))?;
        let step = MotionModel::<f32, 4>::step(&motion, data::DT);
        Ok(Self { motion, step, position: Position::new(symmetric(&data::NOISE))? })
    }

    /// Prediction and update by the position `z`; `false` where the update would have broken the covariance.
    #[inline(always)]
    #[must_use]
    pub fn step(&self, g: &mut Gaussian<f32, 4>, z: &SVector<f32, 2>) -> bool {
        self.motion.advance(g, &self.step);
        let innovation = self.position.innovation(g);
        let nu = MeasurementModel::<f32, 4, 2>::residual(&self.position, z, &innovation.z_hat);
        g.update(&innovation, &nu)
    }
}

/// Writes the weights of the joint association into `matrix`.
pub fn weigh(matrix: &mut Matrix) {
    matrix.reset(DETS, ClutterPrior::Poisson, Domain::Linear);
    for (track, likelihoods) in data::JPDA_LIKELIHOOD.iter().enumerate() {
        if let Some((miss, hits)) = matrix.row_mut(track) {
            *miss = 1.0 - data::P_DETECT;
            for (hit, likelihood) in hits.iter_mut().zip(likelihoods) {
                *hit = data::P_DETECT * likelihood / data::DENSITY;
            }
        }
    }
}

/// Whether `matrix` holds the marginal probabilities, all of them one block.
#[must_use]
pub fn marginals_agree(matrix: &Matrix) -> bool {
    let values =
        (0..TRACKS).filter_map(|track| matrix.row(track)).flat_map(|(miss, hits)| core::iter::once(miss).chain(hits.iter().copied()));
    values.clone().count() == TRACKS * (DETS + 1) && agree(values, data::JPDA_EXPECTED.iter().flatten().copied())
}
