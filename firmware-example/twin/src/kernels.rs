//! One pass through every kernel: reference cases through EKF, UKF, IMM and IMM-PDAF, then every motion and
//! measurement model on one density, and every rule of fusion.

use crate::{Fault, Label, Sink, data, tell};
use boresight::association::{Gate, Pda, SingleAssociator};
use boresight::evidence::{Evidence, innovations};
use boresight::fusion::{CrossCovariance, Rule, Weight};
use boresight::gaussian::{Gaussian, Innovation};
use boresight::mode::ModeBank;
use boresight::model::converted::Polar;
use boresight::model::linear::{LinearMeasurement, LinearMotion};
use boresight::model::motion::{ConstantAcceleration, ConstantVelocity, ProcessNoise, Singer};
use boresight::model::position::Position;
use boresight::model::radar::{Component, Mount, Radar};
use boresight::model::turn::{KnownTurn, UnknownTurn};
use boresight::model::unscented::{Scaling, Unscented};
use boresight::model::{Layout, MeasurementModel, MotionModel};
use boresight::scan::{Candidates, Detection};
use boresight::sensor::{Clutter, UniformSensor};
use boresight::symmetric::Symmetric;
use nalgebra::{SMatrix, SVector};

/// A reference case of a nonlinear filter with the measurements range and azimuth.
#[derive(Clone, Copy, Debug)]
pub struct Nonlinear<const N: usize> {
    /// Time step \[s\]
    pub dt: f32,
    /// F, rows; of no meaning where the motion is not linear
    pub f: [[f32; N]; N],
    /// Q
    pub q: [[f32; N]; N],
    /// R
    pub r: [[f32; 2]; 2],
    /// x₀
    pub x0: [f32; N],
    /// P₀
    pub p0: [[f32; N]; N],
    /// Measurements, `None` where missed
    pub z: &'static [Option<[f32; 2]>],
}

/// A reference case of a target that switches between `R` linear models, seen in clutter.
#[derive(Clone, Copy, Debug)]
pub struct Switching<const N: usize, const R: usize> {
    /// F of every model, rows
    pub f: [[[f32; N]; N]; R],
    /// Q of every model
    pub q: [[[f32; N]; N]; R],
    /// H
    pub h: [[f32; N]; 2],
    /// R
    pub r: [[f32; 2]; 2],
    /// π
    pub jump: [[f32; R]; R],
    /// μ₀
    pub prob: [f32; R],
    /// x₀
    pub x0: [f32; N],
    /// P₀
    pub p0: [[f32; N]; N],
    /// γ
    pub threshold: f32,
    /// P_D
    pub p_detect: f32,
    /// λ
    pub density: f32,
    /// The plots of every scan
    pub plots: &'static [&'static [[f32; 2]]],
}

const DETS: usize = 32;

fn symmetric<const N: usize>(rows: &[[f32; N]; N]) -> Symmetric<f32, N> {
    Symmetric::from_fn(|i, j| rows[i][j])
}

fn matrix<const R: usize, const C: usize>(rows: &[[f32; C]; R]) -> SMatrix<f32, R, C> {
    SMatrix::from_fn(|i, j| rows[i][j])
}

/// Everything of this module.
///
/// # Errors
/// Where a configuration here is wrong.
pub fn run<S: Sink>(sink: &mut S) -> Result<(), Fault> {
    let turn = UnknownTurn::<f32, 2>::new(ProcessNoise::Discrete(0.5), ProcessNoise::Discrete(1e-4))?;
    let seen = [Component::Range, Component::Azimuth];
    let case = &data::EKF_TURN;
    nonlinear(sink, "ekf turn", case, &turn, &Radar::<f32, 2, 2, 2>::new(seen, symmetric(&case.r))?);
    let case = &data::EKF_SPACE;
    let motion = LinearMotion { transition: matrix(&case.f), process_noise: symmetric(&case.q) };
    nonlinear(sink, "ekf space", case, &motion, &Radar::<f32, 2, 3, 3>::new(seen, symmetric(&case.r))?);
    let case = &data::UKF_PLANE;
    let scaling = Scaling::new::<4>(0.5, 2.0, -1.0)?;
    let motion = Unscented { model: LinearMotion { transition: matrix(&case.f), process_noise: symmetric(&case.q) }, scaling };
    let radar = Unscented { model: Radar::<f32, 2, 2, 2>::new(seen, symmetric(&case.r))?, scaling };
    nonlinear(sink, "ukf plane", case, &motion, &radar);
    switching(sink, "imm-pdaf poisson", &data::IMM_PDAF, Clutter::Poisson(data::IMM_PDAF.density))?;
    switching(sink, "imm-pdaf diffuse", &data::IMM_PDAF, Clutter::Diffuse)?;
    models(sink)?;
    rules(sink);
    correlated(sink, &data::UKF_PLANE)
}

fn nonlinear<S: Sink, D: MotionModel<f32, N>, M: MeasurementModel<f32, N, 2>, const N: usize>(
    sink: &mut S,
    part: &'static str,
    case: &Nonlinear<N>,
    motion: &D,
    model: &M,
) {
    let mut g = Gaussian::new(SVector::from(case.x0), symmetric(&case.p0));
    for (scan, z) in case.z.iter().enumerate() {
        motion.predict(&mut g, case.dt);
        if let Some(z) = z {
            let innovation = model.innovation(&g);
            let nu = model.residual(&SVector::from(*z), &innovation.z_hat);
            let label = Label { part, scan, track: 0, field: "ln likelihood" };
            sink.take(label, innovation.density.ln_at(&nu));
            let kept = g.update(&innovation, &nu);
            sink.take(Label { field: "update kept", ..label }, f32::from(u8::from(kept)));
        }
        tell(sink, Label { part, scan, track: 0, field: "" }, &g);
    }
}

fn switching<S: Sink, const N: usize, const R: usize>(
    sink: &mut S,
    part: &'static str,
    case: &Switching<N, R>,
    clutter: Clutter<f32>,
) -> Result<(), Fault> {
    let motion: [LinearMotion<f32, N>; R] =
        core::array::from_fn(|r| LinearMotion { transition: matrix(&case.f[r]), process_noise: symmetric(&case.q[r]) });
    let model = LinearMeasurement { matrix: matrix(&case.h), noise: symmetric(&case.r) };
    let sensor = UniformSensor::new(model, case.p_detect, clutter, Gate::new::<2>(case.threshold)?)?;
    let mut bank = ModeBank::new(case.prob, Gaussian::new(SVector::from(case.x0), symmetric(&case.p0)));
    let mut evidence = Evidence::<f32, DETS>::new();
    let candidates: [u16; DETS] = core::array::from_fn(|i| i as u16);
    for (scan, plots) in case.plots.iter().enumerate() {
        let detections: [Detection<f32, 2>; DETS] = core::array::from_fn(|i| Detection::new(plots.get(i).copied().unwrap_or_default()));
        bank.interact(&case.jump);
        bank.predict(&motion, 1.0);
        let innovations = innovations(&bank, &sensor.model);
        let candidates = candidates.get(..plots.len()).unwrap_or(&candidates);
        evidence.collect(&bank, &innovations, &sensor, &detections, Candidates::new(&detections, candidates));
        let (miss, weights) = evidence.weights();
        let beta_0 = Pda.associate(miss, weights);
        let resets = evidence.absorb(beta_0, &mut bank, &innovations, &sensor.model, &detections);
        let label = Label { part, scan, track: 0, field: "mode probability" };
        sink.take(Label { field: "beta 0", ..label }, beta_0);
        sink.take(Label { field: "resets", ..label }, f32::from(resets));
        for p in bank.prob {
            sink.take(label, p);
        }
        tell(sink, label, &bank.combined());
    }
    Ok(())
}

/// A density with every state correlated with every other.
fn density<const N: usize>() -> Gaussian<f32, N> {
    let mean = SVector::from_fn(|i, _| [900.0, -21.0, 410.0, 13.0, 150.0, 4.0, -2.5, 0.25, 1.5][i % 9]);
    Gaussian::new(mean, Symmetric::from_fn(|i, j| if i == j { 40.0 + i as f32 } else { 3.0 / (1.0 + (j - i) as f32) }))
}

fn models<S: Sink>(sink: &mut S) -> Result<(), Fault> {
    let (discrete, continuous) = (ProcessNoise::Discrete(2.0f32), ProcessNoise::Continuous(0.7f32));
    moved::<S, _, 4>(sink, "cv", &ConstantVelocity::<f32, 2>::new(discrete)?);
    moved::<S, _, 6>(sink, "cv space", &ConstantVelocity::<f32, 3>::new(continuous)?);
    moved::<S, _, 6>(sink, "cv padded", &ConstantVelocity::<f32, 2, 3>::new(discrete)?);
    moved::<S, _, 9>(sink, "ca", &ConstantAcceleration::<f32, 3>::new(continuous)?);
    moved::<S, _, 6>(sink, "singer", &Singer::<f32, 2>::new(20.0, 3.0)?);
    moved::<S, _, 6>(sink, "singer fast", &Singer::<f32, 2>::new(0.4, 3.0)?);
    moved::<S, _, 4>(sink, "turn", &KnownTurn::<f32, 2>::new(-0.05, discrete)?);
    moved::<S, _, 6>(sink, "turn hard", &KnownTurn::<f32, 3>::new(0.9, continuous)?);
    moved::<S, _, 5>(sink, "turn rate", &UnknownTurn::<f32, 2>::new(discrete, ProcessNoise::Discrete(1e-4))?);
    moved::<S, _, 7>(sink, "turn rate space", &UnknownTurn::<f32, 3>::new(discrete, ProcessNoise::Continuous(1e-3))?);

    let mount = Mount::at([100.0, -50.0, 20.0]).moving([3.0, -1.0, 0.0]).turned(0.3, -0.2, 0.1);
    let all = [Component::Range, Component::Azimuth, Component::Elevation, Component::RangeRate];
    let noise = Symmetric::from_diagonal([100.0, 1e-5, 2e-5, 0.25]);
    observed::<S, _, 9, 4>(sink, "radar", &Radar::<f32, 4, 3, 3>::new(all, noise)?.on(mount));
    let noise = Symmetric::from_diagonal([1e-5]);
    observed::<S, _, 4, 1>(sink, "direction finder", &Radar::<f32, 1, 2, 2>::new([Component::Azimuth], noise)?.on(mount));
    observed::<S, _, 6, 3>(sink, "position", &Position::<f32, 3, 2>::new(Symmetric::from_diagonal([25.0, 36.0, 49.0]))?);

    let polar = Polar { range: 9e3, azimuth: 2.5, elevation: 0.4, range_variance: 400.0, azimuth_variance: 4e-4, elevation_variance: 9e-4 };
    for (field, converted) in [("linear", polar.linear()), ("debiased", polar.debiased())] {
        let label = Label { part: "converted", scan: 0, track: 0, field };
        for value in converted.position.iter().chain(converted.cov.upper().iter().flatten()) {
            sink.take(label, *value);
        }
    }
    Ok(())
}

/// Two densities of one target made one, by every rule.
fn rules<S: Sink>(sink: &mut S) {
    let (a, mut b) = (density::<6>(), density::<6>());
    for (i, x) in b.mean.iter_mut().enumerate() {
        *x += 0.5 * i as f32 - 1.0;
        b.cov.upper_mut()[i][i] *= 0.6 + 0.2 * i as f32;
    }
    let by = |weight| Rule::Intersection(weight);
    for (field, rule) in [
        ("convex", Rule::NaiveConvex),
        ("fixed", by(Weight::Fixed(0.3))),
        ("determinant", by(Weight::Determinant)),
        ("trace", by(Weight::Trace)),
    ] {
        let label = Label { part: "fusion rule", scan: 0, track: 0, field };
        if let Some(fused) = rule.fuse(&a, &b) {
            tell(sink, label, &fused);
        }
        if let Rule::Intersection(weight) = rule {
            sink.take(label, weight.of(&a.cov, &b.cov).unwrap_or(-1.0));
        }
    }
}

/// Two filters of one target, the second of which sees less of it: their cross-covariance, their test and what is made of both.
fn correlated<S: Sink>(sink: &mut S, case: &Nonlinear<4>) -> Result<(), Fault> {
    let motion = LinearMotion { transition: matrix(&case.f), process_noise: symmetric(&case.q) };
    let radar = |noise: Symmetric<f32, 2>| Radar::<f32, 2, 2, 2>::new([Component::Range, Component::Azimuth], noise);
    let radars = [radar(symmetric(&case.r))?, radar(symmetric(&case.r).plus(&symmetric(&case.r)))?];
    let mut filters = [Gaussian::new(SVector::from(case.x0), symmetric(&case.p0)); 2];
    let mut cross = CrossCovariance::zeros();
    for (scan, z) in case.z.iter().enumerate() {
        filters.iter_mut().for_each(|g| motion.predict(g, case.dt));
        cross.predict(&motion.transition, &motion.process_noise);
        for (number, (g, radar)) in filters.iter_mut().zip(&radars).enumerate() {
            let Some(z) = z.filter(|_| number == 0 || scan % 3 != 2) else { continue };
            let innovation: Innovation<f32, 4, 2> = radar.innovation(g);
            let (gain, h) = (innovation.gain(), MeasurementModel::<f32, 4, 2>::jacobian(radar, &g.mean));
            if number == 0 {
                cross.first_updated(&gain, &h)
            } else {
                cross.second_updated(&gain, &h)
            }
            let kept = g.update(&innovation, &MeasurementModel::<f32, 4, 2>::residual(radar, &SVector::from(z), &innovation.z_hat));
            sink.take(Label { part: "cross-covariance", scan, track: number as u32, field: "update kept" }, f32::from(u8::from(kept)));
        }
        let label = Label { part: "cross-covariance", scan, track: 0, field: "P12" };
        cross.0.iter().for_each(|p| sink.take(label, *p));
        let [a, b] = &filters;
        let square = cross.distance(a, b, Layout::UNKNOWN).map_or(-1.0, |d| d.square);
        sink.take(Label { field: "distance", ..label }, square);
        if let Some(fused) = cross.fuse(a, b) {
            tell(sink, label, &fused);
        }
    }
    Ok(())
}

fn moved<S: Sink, M: MotionModel<f32, N>, const N: usize>(sink: &mut S, part: &'static str, model: &M) {
    let mut g = density::<N>();
    for scan in 0..3 {
        model.predict(&mut g, 0.8);
        tell(sink, Label { part, scan, track: 0, field: "" }, &g);
    }
}

fn observed<S: Sink, M: MeasurementModel<f32, N, NZ>, const N: usize, const NZ: usize>(sink: &mut S, part: &'static str, model: &M) {
    let innovation = model.innovation(&density::<N>());
    let label = Label { part, scan: 0, track: 0, field: "prediction" };
    for value in innovation.z_hat.iter() {
        sink.take(label, *value);
    }
    for value in innovation.gain().iter() {
        sink.take(Label { field: "gain", ..label }, *value);
    }
    sink.take(Label { field: "peak", ..label }, innovation.density.peak);
}
