//! The coupled filter on two aircraft that meet: nine pairs of modes over 18 states, a radar and an infrared sensor, one plot of both
//! while they are close; to the same bits on desk and target. And an IMM-JPDA on the radar's plots that pairs the same two tracks.
//!
//! The plots are not random: what noise they have is made of the number of the scan.

use crate::{Fault, Label, Sink, tell};
use boresight::association::{Gate, Jpda, MergingJpda};
use boresight::coupled::{Coupling, Cross, NoCross};
use boresight::error::{ConfigError, ScanError};
use boresight::gaussian::Gaussian;
use boresight::model::motion::{ConstantAcceleration, ConstantVelocity, ProcessNoise};
use boresight::model::radar::{Component, Radar};
use boresight::model::resolution::Resolution;
use boresight::scalar::{atan2, sqrt};
use boresight::scan::{Detection, Report, Scan};
use boresight::sensor::{Clutter, UniformSensor, Unresolving};
use boresight::symmetric::Symmetric;
use boresight::time::Instant;
use boresight::track::Logic;
use boresight::tracker::{CoupledState, ImmCoupled, ImmJpda, JointState, Work};
use nalgebra::SVector;

/// States of either target: (x, vx, ax, y, vy, ay, z, vz, az)
pub const NX: usize = 9;
/// Modes of either target
pub const MODES: usize = 3;
/// Room for detections
pub const DETS: usize = 16;
/// Scans of either sensor
pub const SCANS: usize = 12;
/// What [`checksum`] is of both filters after all scans, with and without the cross covariance: found on the desk
pub const CHECKSUMS: [u32; 2] = [0x35dd_8715, 0xab81_ff5d];

/// The filter that keeps what the targets have in common
pub type Kept = Cross<f32, NX>;
type Modes = (ConstantVelocity<f32, 3, 3>, ConstantAcceleration<f32, 3>, ConstantAcceleration<f32, 3>);
type Seeing = Unresolving<UniformSensor<Radar<f32, 2, 3, 3>, f32>, f32, 2>;
type Merging = MergingJpda<32, 1>;
/// What the filter remembers
pub type Memory<C = Kept> = CoupledState<f32, NX, MODES, DETS, C>;
/// What the tracker of pairs remembers
pub type Tracks = JointState<f32, NX, MODES, 2, DETS, Merging>;

/// The filter and its two sensors.
#[derive(Clone, Copy, Debug)]
pub struct Meeting<C = Kept> {
    filter: ImmCoupled<f32, Modes, NX, MODES, C>,
    sensors: [Seeing; 2],
}

/// The tracker of pairs, and its radar.
#[derive(Clone, Copy, Debug)]
pub struct Pairs {
    tracker: ImmJpda<f32, Modes, NX, MODES, 2, DETS, Merging>,
    radar: Seeing,
}

/// One scan: up to three plots, and how many there are.
pub type Plots = ([Detection<f32, 2>; 3], usize);

fn modes() -> Result<Modes, ConfigError> {
    let [quiet, turning, hard] = [25.0, 56.25, 1600.0].map(ProcessNoise::Discrete);
    Ok((ConstantVelocity::new(quiet)?, ConstantAcceleration::new(turning)?, ConstantAcceleration::new(hard)?))
}

const JUMP: [[f32; MODES]; MODES] = [[0.8, 0.1, 0.1], [0.1, 0.8, 0.1], [0.1, 0.1, 0.8]];
const INITIAL: [f32; MODES] = [0.8, 0.1, 0.1];

/// Range and azimuth, then azimuth and elevation; cells of two standard deviations.
fn sensors() -> Result<[Seeing; 2], ConfigError> {
    let seeing = |components, sigmas: [f32; 2]| -> Result<Seeing, ConfigError> {
        let radar = Radar::new(components, Symmetric::from_diagonal(sigmas.map(|sigma| sigma * sigma)))?;
        let sensor = UniformSensor::new(radar, 0.97, Clutter::Diffuse, Gate::new::<2>(16.0)?)?;
        Ok(Unresolving { sensor, resolution: Resolution::new(sigmas.map(|sigma| 2.0 * sigma))? })
    };
    let radar = seeing([Component::Range, Component::Azimuth], [20.0, 0.007])?;
    Ok([radar, seeing([Component::Azimuth, Component::Elevation], [0.002, 0.002])?])
}

/// True positions at scan `k`: the targets meet at scan 6 \[m\].
fn positions(k: usize) -> [[f32; 3]; 2] {
    let t = k as f32 - 6.0;
    [[8000.0 + 150.0 * t, 3000.0 + 60.0 * t, 900.0], [8000.0 + 150.0 * t, 3000.0 - 60.0 * t, 900.0]]
}

fn densities() -> [Gaussian<f32, NX>; 2] {
    let cov = Symmetric::from_fn(|i, j| if i == j { [1600.0, 225.0, 25.0][i % 3] } else { 0.0 });
    [60.0, -60.0].map(|climb| {
        let [x, y] = [8000.0 - 6.0 * 150.0, 3000.0 - 6.0 * climb];
        Gaussian::new(SVector::from([x, 150.0, 0.0, y, climb, 0.0, 900.0, 0.0, 0.0]), cov)
    })
}

/// What the sensor number `sensor` sees at scan `k`: both targets, or one plot of both from scan 5 to 7, and a false one.
#[must_use]
pub fn plots(sensor: usize, k: usize) -> Plots {
    let polar = |[x, y, z]: [f32; 3]| {
        let ground = sqrt(x * x + y * y);
        [[sqrt(ground * ground + z * z), atan2(y, x)], [atan2(y, x), atan2(z, ground)]]
    };
    let sigmas = [[20.0, 0.007], [0.002, 0.002]];
    // Between −1 and 1, by the number of the scan.
    let noise = |n: usize| ((7 * k + 5 * n + 3 * sensor) % 13) as f32 / 6.0 - 1.0;
    let seen = positions(k).map(polar);
    let plot = |z: [f32; 2], n: usize| {
        let [a, b] = sigmas.get(sensor).copied().unwrap_or_default();
        Detection::new([z[0] + a * noise(n), z[1] + b * noise(n + 1)])
    };
    let of = |target: usize| seen.get(target).and_then(|seen| seen.get(sensor)).copied().unwrap_or_default();
    let (first, second) = (of(0), of(1));
    let between = [0.5 * (first[0] + second[0]), 0.5 * (first[1] + second[1])];
    let [a, b] = sigmas.get(sensor).copied().unwrap_or_default();
    let false_plot = plot([between[0] + 3.0 * a, between[1] - 4.0 * b], 4);
    if (5..=7).contains(&k) { ([plot(between, 0), false_plot, false_plot], 2) } else { ([plot(first, 0), plot(second, 2), false_plot], 3) }
}

impl Meeting {
    /// The most work of a [`step`](Self::step), in either form.
    pub const MOST: Work = Self::most(DETS);

    /// The most work of one with so many plots.
    #[must_use]
    pub const fn most(plots: usize) -> Work {
        ImmCoupled::<f32, Modes, NX, MODES>::worst_case(plots)
    }
}

impl<C: Coupling<f32, NX>> Meeting<C> {
    /// Three modes, two sensors that cannot tell close targets apart.
    ///
    /// # Errors
    /// None, unless the constants here are wrong.
    pub fn new() -> Result<Self, ConfigError> {
        Ok(Self { filter: ImmCoupled::new(modes()?, JUMP, INITIAL)?, sensors: sensors()? })
    }

    /// Puts the targets where the scans find them.
    pub fn start(&self, memory: &mut Memory<C>) -> bool {
        self.filter.start(memory, densities(), Instant::ZERO).is_some()
    }

    /// One scan of one sensor: what is counted. The radar's comes first, and moves the targets.
    ///
    /// # Errors
    /// None, unless scans go back in time.
    pub fn step(&self, memory: &mut Memory<C>, sensor: usize, k: usize, (plots, count): &Plots) -> Result<Report, ScanError> {
        let sensor = self.sensors.get(sensor).unwrap_or(&self.sensors[0]);
        let plots = plots.get(..*count).unwrap_or_default();
        self.filter.step(memory, sensor, &Scan::new(at(k), plots))
    }
}

// Inline: compiled with the image that uses it. Compiled here, its generic code would serve all images, and at `opt-level = "s"`
// with bounds checks that an image as a whole does away with.
impl Pairs {
    /// The same modes, the radar alone.
    ///
    /// # Errors
    /// None, unless the constants here are wrong.
    #[inline]
    pub fn new() -> Result<Self, ConfigError> {
        let [radar, _] = sensors()?;
        Ok(Self { tracker: ImmJpda::new(modes()?, JUMP, INITIAL, Logic::unmanaged(), Merging::new(Jpda::new()))?, radar })
    }

    /// Puts the targets where the scans find them.
    #[inline]
    pub fn start(&self, memory: &mut Tracks) -> bool {
        densities().into_iter().all(|g| self.tracker.start(memory, g, Instant::ZERO).is_some())
    }

    /// One scan of the radar.
    ///
    /// # Errors
    /// None, unless scans go back in time.
    #[inline]
    pub fn step(&self, memory: &mut Tracks, k: usize) -> Result<Report, ScanError> {
        let (plots, count) = plots(0, k);
        self.tracker.step(memory, &self.radar, &Scan::new(at(k), plots.get(..count).unwrap_or_default()))
    }
}

/// When scan `k` is.
fn at(k: usize) -> Instant {
    Instant::from_millis(1000 * k as u64)
}

/// The bits of both states, folded.
#[must_use]
pub fn checksum<C: Coupling<f32, NX>>(memory: &Memory<C>) -> u32 {
    let fold = |sum: u32, x: &f32| sum.rotate_left(5).wrapping_mul(0x9e37_79b1) ^ x.to_bits();
    memory.estimates().fold(0, |sum, estimate| {
        let sum = estimate.state.mean.iter().fold(sum, fold);
        estimate.state.cov.upper().iter().enumerate().fold(sum, |sum, (i, row)| row.iter().skip(i).fold(sum, fold))
    })
}

/// All scans of both sensors through both filters, and the radar's through the tracker of pairs; tells every state after both.
///
/// # Errors
/// Where a configuration here is wrong.
pub fn run<S: Sink>(sink: &mut S, kept: &mut Memory, dropped: &mut Memory<NoCross>, tracks: &mut Tracks) -> Result<(), Fault> {
    follow(&Meeting::new()?, "coupled filter", sink, kept)?;
    follow(&Meeting::new()?, "coupled filter without cross covariance", sink, dropped)?;
    let pairs = Pairs::new()?;
    pairs.start(tracks);
    for k in 1..=SCANS {
        pairs.step(tracks, k)?;
        for estimate in tracks.estimates() {
            let label = Label { part: "IMM-JPDAF with unresolved pairs", scan: k, track: estimate.id.number(), field: "" };
            tell(sink, label, &estimate.state);
        }
    }
    Ok(())
}

fn follow<C: Coupling<f32, NX>, S: Sink>(
    meeting: &Meeting<C>,
    part: &'static str,
    sink: &mut S,
    memory: &mut Memory<C>,
) -> Result<(), Fault> {
    meeting.start(memory);
    for k in 1..=SCANS {
        for sensor in 0..2 {
            meeting.step(memory, sensor, k, &plots(sensor, k))?;
            let label = Label { part, scan: 2 * k + sensor, track: 0, field: "unresolved" };
            sink.take(label, memory.unresolved_probability());
            if sensor == 1 {
                memory.estimates().for_each(|estimate| tell(sink, Label { track: estimate.id.number(), ..label }, &estimate.state));
            }
        }
    }
    Ok(())
}
