//! The workloads of `twin::workloads` in either precision: the same eight lines a scan, the same numbers.

use boresight::association::{AssociationMatrix, Associator, ClutterPrior, Domain, Gate, Jpda, JpdaMemory};
use boresight::error::ConfigError;
use boresight::evidence::{Evidence, innovations, update_by_one};
use boresight::gaussian::Gaussian;
use boresight::mode::{JumpMatrix, ModeBank, ModeSet};
use boresight::model::motion::{ConstantAcceleration, ConstantVelocity, ProcessNoise};
use boresight::model::position::Position;
use boresight::model::turn::KnownTurn;
use boresight::model::{MeasurementModel, MotionModel};
use boresight::scalar::Real;
use boresight::scan::{Candidates, Detection};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use nalgebra::{SMatrix, SVector};
use twin::workloads::data::{DENSITY, DT, IMM4_JUMP, IMM6_JUMP, NOISE, P_DETECT, P_GATE, THRESHOLD, TURN};
use twin::workloads::{DETS, PLOTS, TRACKS, data};

/// Nodes of the joint association, as in the image `budget`.
const NODES: usize = 128;

/// A constant of the workloads, as it stands in single precision.
pub fn lit<T: Real>(x: f32) -> T {
    T::lit(f64::from(x))
}

pub type Modes6<T> = (ConstantVelocity<T, 2, 3>, ConstantAcceleration<T, 2>);
pub type Modes4<T> = (ConstantVelocity<T, 2>, KnownTurn<T, 2>, KnownTurn<T, 2>);

/// One track in clutter, or without, and a sensor of positions.
pub struct Imm<T: Real, M, const NX: usize, const STRIDE: usize, const MODES: usize> {
    pub modes: M,
    pub jump: JumpMatrix<T, MODES>,
    pub sensor: UniformSensor<Position<T, 2, STRIDE>, T>,
    pub start: ModeBank<T, NX, MODES>,
    evidence: Evidence<T, PLOTS>,
}

fn sensor<T: Real, const STRIDE: usize>() -> Result<UniformSensor<Position<T, 2, STRIDE>, T>, ConfigError> {
    let position = Position::new(Symmetric::from_fn(|i, j| lit(NOISE[i][j])))?;
    let gate = Gate::new::<2>(lit(THRESHOLD))?.with_probability(lit(P_GATE))?;
    UniformSensor::new(position, lit(P_DETECT), Clutter::Poisson(lit(DENSITY)), gate)
}

fn gaussian<T: Real, const NX: usize>(g: &Gaussian<f32, NX>) -> Gaussian<T, NX> {
    Gaussian::new(g.mean.map(lit), Symmetric::from_matrix(&g.cov.to_matrix().map(lit)))
}

pub fn imm6<T: Real>() -> Result<Imm<T, Modes6<T>, 6, 3, 2>, ConfigError> {
    let (quiet, lively) = (ProcessNoise::Discrete(T::lit(0.25)), ProcessNoise::Discrete(T::lit(2.25)));
    let modes = (ConstantVelocity::new(quiet)?, ConstantAcceleration::new(lively)?);
    Imm::new(modes, IMM6_JUMP, &data::IMM6_START.mode_bank())
}

pub fn imm4<T: Real>() -> Result<Imm<T, Modes4<T>, 4, 2, 3>, ConfigError> {
    let (quiet, lively) = (ProcessNoise::Discrete(T::lit(0.25)), ProcessNoise::Discrete(lit(0.64)));
    let modes = (ConstantVelocity::new(quiet)?, KnownTurn::new(lit(TURN), lively)?, KnownTurn::new(lit(-TURN), lively)?);
    Imm::new(modes, IMM4_JUMP, &data::IMM4_START.mode_bank())
}

impl<T: Real, M: ModeSet<T, NX, MODES>, const NX: usize, const STRIDE: usize, const MODES: usize> Imm<T, M, NX, STRIDE, MODES> {
    fn new(modes: M, jump: JumpMatrix<f32, MODES>, start: &ModeBank<f32, NX, MODES>) -> Result<Self, ConfigError> {
        let start = ModeBank { prob: start.prob.map(lit), modes: start.modes.each_ref().map(gaussian) };
        Ok(Self { modes, jump: jump.map(|row| row.map(lit)), sensor: sensor()?, start, evidence: Evidence::new() })
    }

    /// All scans, of four plots each: IMM-PDAF.
    pub fn in_clutter(&mut self, scans: &[[[f32; 2]; PLOTS]]) -> Gaussian<T, NX> {
        let (mut bank, model) = (self.start, &self.sensor.model);
        for plots in scans {
            let plots = plots.map(|z| Detection::new(z.map(lit)));
            bank.interact(&self.jump);
            bank.predict(&self.modes, lit(DT));
            let predicted = innovations(&bank, model);
            self.evidence.gate(&bank, &predicted, &self.sensor, &plots, Candidates::new(&plots, &[0, 1, 2, 3]));
            self.evidence.pda(&mut bank, &predicted, &self.sensor, &plots, T::ONE);
        }
        bank.combined()
    }

    /// The first plot of every scan, the target's for certain: IMM.
    pub fn alone(&mut self, scans: &[[[f32; 2]; PLOTS]]) -> Gaussian<T, NX> {
        let mut bank = self.start;
        for [z, ..] in scans {
            bank.interact(&self.jump);
            bank.predict(&self.modes, lit(DT));
            update_by_one(&mut bank, &self.sensor.model, &SVector::from(z.map(lit)));
        }
        bank.combined()
    }
}

/// Constant velocity and positions.
pub struct Kf4<T: Real> {
    pub motion: ConstantVelocity<T, 2>,
    pub position: Position<T, 2, 2>,
    pub start: Gaussian<T, 4>,
}

impl<T: Real> Kf4<T> {
    pub fn new() -> Result<Self, ConfigError> {
        let motion = ConstantVelocity::new(ProcessNoise::Discrete(T::lit(0.25)))?;
        Ok(Self { motion, position: sensor()?.model, start: gaussian(&data::IMM4_START.modes[0].gaussian()) })
    }

    /// The first plot of every scan.
    pub fn run(&self, scans: &[[[f32; 2]; PLOTS]]) -> Gaussian<T, 4> {
        let mut g = self.start;
        for [z, ..] in scans {
            self.motion.predict(&mut g, lit(DT));
            let innovation = self.position.innovation(&g);
            let nu = MeasurementModel::<T, 4, 2>::residual(&self.position, &SVector::from(z.map(lit)), &innovation.z_hat);
            let _ = g.update(&innovation, &nu);
        }
        g
    }
}

/// Four tracks and eight detections.
pub struct Joint<T: Real> {
    pub weights: AssociationMatrix<T, TRACKS, DETS>,
    matrix: AssociationMatrix<T, TRACKS, DETS>,
    memory: JpdaMemory<T, TRACKS, DETS, NODES>,
}

impl<T: Real> Joint<T> {
    pub fn new() -> Self {
        let mut weights = AssociationMatrix::new();
        weights.reset(DETS, ClutterPrior::Poisson, Domain::Linear);
        weights.miss = [T::ONE - lit(P_DETECT); TRACKS];
        weights.hit = data::JPDA_LIKELIHOOD.map(|row| row.map(|l| lit::<T>(P_DETECT) * lit(l) / lit(DENSITY)));
        Self { matrix: weights.clone(), weights, memory: <Jpda<NODES> as Associator<T, TRACKS, DETS>>::MEMORY }
    }

    /// The probabilities, a row per track, none first.
    pub fn run(&mut self) -> SMatrix<f64, TRACKS, { DETS + 1 }> {
        self.matrix.clone_from(&self.weights);
        Jpda::<NODES>::new().associate(&mut self.matrix, &mut self.memory);
        SMatrix::from_fn(|t, j| j.checked_sub(1).map_or(self.matrix.miss[t], |j| self.matrix.hit[t][j]).to_f64())
    }
}
