//! The command `soak`: trackers in single precision that live long, on a link and in a world that do not treat them well.
//!
//! Each of the ready trackers lives through its own world: up to twelve targets come, fly straight, turn and accelerate at
//! random, and go; P_D 0.9, four false plots a scan. Plots come over the link, on a clock of 32 bits that wraps every 72
//! minutes. Of all scans
//!
//! ```text
//! 3 %      are lost                         1 %      come twice                1 %     are changed on the way
//! 0.5 %    hold a plot that is no number    0.5 %    are older than the last   1 %     hold sixty plots more
//! 0.1 %    follow a silence of a minute     0.1 %    hold absurd plots         0.01 %  follow a restart of the sensor
//! ```
//!
//! After every scan all numbers must be finite and all covariances sound, after every refused one the state as it was. Every
//! 50,000 scans the world is emptied: all tracks must end, and then as many targets as there are slots must all be followed: no
//! capacity is lost. What is wrong is a failed check. The share of targets followed is told for the first tenth of the scans
//! and for the last.

use crate::replay_log::desk::{Accelerates, Motion, Turns};
use crate::{Failure, monte_carlo, output};
use boresight::error::{ConfigError, ScanError};
use boresight::link::{Link, encode};
use boresight::ready::{DETS, Parameters, Sensor, State, TRACKS, Tracker};
use boresight::scan::{Detection, Scan};
use boresight::time::Instant;
use boresight::track::Status;
use embedded_hal::spi::{ErrorType, Operation, SpiDevice};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Poisson, StandardNormal};
use std::cell::RefCell;
use std::convert::Infallible;
use std::f64::consts::PI;
use std::fmt::Write;
use std::rc::Rc;

/// The trackers, by number.
const NAMES: [&str; 4] = ["turning ra", "turning rar", "accelerating ra", "accelerating rar"];
const MOST_TARGETS: usize = 12;
const P_DETECT: f64 = 0.9;
const CLUTTER: f64 = 4.0;
/// Farther targets are gone \[m\].
const EDGE: f64 = 12_000.0;
/// Scans between two checks of the capacity.
const CHECKED_EVERY: u64 = 50_000;

/// Lets every tracker live for `scans` scans.
pub fn run(scans: u64, seed: u64) -> Result<(), Failure> {
    let lives = monte_carlo::run("soak", NAMES.len() as u64, |number| live(number, scans, seed));
    let mut text = format!("{scans} scans each, seed {seed}\n");
    let _ = writeln!(
        text,
        "{:<18}{:>9}{:>9}{:>9}{:>9}{:>9}{:>8}{:>8}{:>8}",
        "", "refused", "births", "dropped", "resets", "filled", "most", "first", "last"
    );
    for (name, life) in NAMES.iter().zip(&lives) {
        let life = life.as_ref().map_err(|error| Failure::input(error).within(name))?;
        let Life { refused, births, dropped, resets, filled, most, followed: [first, last], .. } = life;
        let share = |[of, all]: &[u64; 2]| 100.0 * *of as f64 / (*all).max(1) as f64;
        let _ = writeln!(
            text,
            "{name:<18}{refused:>9}{births:>9}{dropped:>9}{resets:>9}{filled:>9}{most:>8}{:>7.1}%{:>7.1}%",
            share(first),
            share(last)
        );
    }
    output::print(&text)?;
    let fault = NAMES.iter().zip(&lives).find_map(|(name, life)| Some((name, life.as_ref().ok()?.fault.clone()?)));
    fault.map_or(Ok(()), |(name, fault)| Err(Failure::check(fault).within(name)))
}

/// What became of one tracker.
#[derive(Clone, Debug, Default)]
pub struct Life {
    /// Scans that link or tracker have refused
    pub refused: u64,
    /// Tracks born
    pub births: u64,
    /// Detections and births given up for want of room
    pub dropped: u64,
    /// Corrections refused
    pub resets: u64,
    /// How often all slots were filled
    pub filled: u64,
    /// Most tracks at once
    pub most: usize,
    /// Targets followed, and all, in the first and in the last tenth
    pub followed: [[u64; 2]; 2],
    /// The first thing that was wrong
    pub fault: Option<String>,
}

/// The life of the tracker `number`.
pub fn live(number: u64, scans: u64, seed: u64) -> Result<Life, ConfigError> {
    let world = World::new(monte_carlo::streams(seed, number).data);
    Ok(match number {
        0 => Subject::<Turns, 4, 2, 2>::new(Parameters::turning())?.live(world, scans),
        1 => Subject::<Turns, 4, 3, 2>::new(Parameters::turning())?.live(world, scans),
        2 => Subject::<Accelerates, 6, 2, 3>::new(Parameters::accelerating())?.live(world, scans),
        _ => Subject::<Accelerates, 6, 3, 3>::new(Parameters::accelerating())?.live(world, scans),
    })
}

/// A target: position, velocity and acceleration in the plane, and for how many scans it has been there.
#[derive(Clone, Copy, Debug)]
struct Target {
    at: [f64; 2],
    velocity: [f64; 2],
    /// Along its flight, and across
    force: [f64; 2],
    age: u32,
}

/// The targets, and everything random.
struct World {
    rng: ChaCha8Rng,
    targets: Vec<Target>,
}

impl World {
    fn new(rng: ChaCha8Rng) -> Self {
        Self { rng, targets: Vec::new() }
    }

    fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.rng)
    }

    fn go_on(&mut self, dt: f64) {
        let rng = &mut self.rng;
        for Target { at, velocity, force, age } in &mut self.targets {
            if rng.random_bool(0.05) {
                *force = if rng.random_bool(0.6) { [0.0; 2] } else { [rng.random_range(-8.0..8.0), rng.random_range(-15.0..15.0)] };
            }
            let speed = velocity[0].hypot(velocity[1]);
            let along = [velocity[0] / speed, velocity[1] / speed];
            let mut force = *force;
            // Neither stops nor flies faster than the trackers are told.
            if (speed < 50.0 && force[0] < 0.0) || (speed > 280.0 && force[0] > 0.0) {
                force[0] = 0.0;
            }
            let (sin, cos) = (force[1] / speed * dt).sin_cos();
            let faster = 1.0 + force[0] * dt / speed;
            (0..2).for_each(|axis| at[axis] += velocity[axis] * dt);
            *velocity = [(along[0] * cos - along[1] * sin) * speed * faster, (along[0] * sin + along[1] * cos) * speed * faster];
            *age += 1;
        }
        self.targets.retain(|target| target.at[0].hypot(target.at[1]) < EDGE && !rng.random_bool(0.005));
        if self.targets.len() < MOST_TARGETS && rng.random_bool(0.1) {
            let (from, to) = (rng.random_range(-PI..PI), rng.random_range(-PI..PI));
            let (range, speed) = (rng.random_range(2_000.0..10_000.0), rng.random_range(60.0..250.0));
            let at = [range * f64::cos(from), range * f64::sin(from)];
            self.targets.push(Target { at, velocity: [speed * f64::cos(to), speed * f64::sin(to)], force: [0.0; 2], age: 0 });
        }
    }

    /// What the radar of `p` sees of one target.
    fn plot<const NZ: usize>(&mut self, target: &Target, p: &Parameters) -> Detection<f32, NZ> {
        let (range, azimuth) = (target.at[0].hypot(target.at[1]), target.at[1].atan2(target.at[0]));
        let rate = (target.at[0] * target.velocity[0] + target.at[1] * target.velocity[1]) / range;
        let truth = [(range, p.sigma_range), (azimuth, p.sigma_azimuth), (rate, p.sigma_range_rate)];
        Detection::new(core::array::from_fn(|k| (truth[k].0 + self.normal() * f64::from(truth[k].1)) as f32))
    }

    fn false_plot<const NZ: usize>(&mut self) -> Detection<f32, NZ> {
        let rng = &mut self.rng;
        let z = [rng.random_range(1_000.0..12_000.0), rng.random_range(-3.1f32..3.1), rng.random_range(-250.0..250.0)];
        Detection::new(core::array::from_fn(|k| z[k]))
    }

    fn scan<const NZ: usize>(&mut self, p: &Parameters) -> Vec<Detection<f32, NZ>> {
        let seen: Vec<Target> = self.targets.clone().into_iter().filter(|_| self.rng.random_bool(P_DETECT)).collect();
        let mut plots: Vec<_> = seen.iter().map(|target| self.plot(target, p)).collect();
        let false_plots = Poisson::new(CLUTTER).map_or(0.0, |p| p.sample(&mut self.rng)) as usize;
        plots.extend((0..false_plots).map(|_| self.false_plot()));
        plots.truncate(DETS);
        plots
    }
}

/// The bus: idle, or with the frame on it that the other handle has put there.
#[derive(Clone, Default)]
struct Bus(Rc<RefCell<Vec<u8>>>);

impl ErrorType for Bus {
    type Error = Infallible;
}

impl SpiDevice for Bus {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Infallible> {
        for operation in operations {
            if let Operation::Read(words) = operation {
                words.fill(0);
                words.iter_mut().zip(self.0.take()).for_each(|(word, sent)| *word = sent);
            }
        }
        Ok(())
    }
}

/// A tracker with its radar, and what has become of it.
struct Subject<D: Motion<NX, STRIDE>, const NX: usize, const NZ: usize, const STRIDE: usize> {
    parameters: Parameters,
    tracker: Tracker<f32, D::Modes<f32>, NX>,
    sensor: Sensor<f32, NZ, STRIDE>,
    state: Box<State<f32, NX>>,
    micros: u64,
    scans: u64,
    life: Life,
}

impl<D: Motion<NX, STRIDE>, const NX: usize, const NZ: usize, const STRIDE: usize> Subject<D, NX, NZ, STRIDE> {
    fn new(parameters: Parameters) -> Result<Self, ConfigError> {
        let (tracker, sensor) = (D::tracker(&parameters)?, parameters.sensor()?);
        Ok(Self { parameters, tracker, sensor, state: Box::default(), micros: 1_000_000, scans: 0, life: Life::default() })
    }

    fn live(mut self, mut world: World, scans: u64) -> Life {
        let (bus, mut buffer) = (Bus::default(), vec![0; Link::<Bus, NZ, DETS>::FRAME]);
        let mut link = Link::<Bus, NZ, DETS>::new(bus.clone());
        while self.scans < scans && self.life.fault.is_none() {
            let dt = if world.rng.random_bool(0.001) { 60_000_000 } else { world.rng.random_range(900_000..1_100_000) };
            self.micros += dt;
            world.go_on(dt as f64 * 1e-6);
            let mut plots = world.scan::<NZ>(&self.parameters);
            let fate = world.rng.random_range(0..10_000);
            match (fate, plots.first_mut()) {
                (650..700, Some(plot)) => plot.z[0] = f32::NAN,
                (700..710, Some(plot)) => plot.z[0] = [1e-30, -1e30, f32::MAX][world.rng.random_range(0..3)],
                (710, _) => link.restart(Instant::from_micros(self.micros)),
                (750..850, _) => {
                    plots.extend((0..60).map(|_| world.false_plot()));
                    self.offer(self.micros, &plots);
                }
                (850..900, _) => self.offer_older(&plots),
                _ => {}
            }
            let length = encode(self.scans as u32, self.micros as u32, plots.get(..plots.len().min(DETS)).unwrap_or_default(), &mut buffer);
            let mut frame = buffer.get(..length.unwrap_or(0)).unwrap_or_default().to_vec();
            if (300..400).contains(&fate) {
                let at = world.rng.random_range(0..frame.len());
                frame[at] ^= 1 << world.rng.random_range(0..8);
            }
            let times = match fate {
                0..300 | 750..850 => 0,
                400..500 => 2,
                _ => 1,
            };
            for _ in 0..times {
                bus.0.replace(frame.clone());
                match link.poll(&mut buffer) {
                    Ok(scan) if scan.time.as_micros() == self.micros => self.offer(self.micros, scan.detections),
                    Ok(scan) => self.is_wrong(format!("a frame made at {} came as one of {:?}", self.micros, scan.time)),
                    Err(_) => self.life.refused += 1,
                }
            }
            self.judge(&world, scans);
            self.scans += 1;
            if self.scans.is_multiple_of(CHECKED_EVERY.min(scans / 2)) {
                self.fill(&mut world);
            }
        }
        self.life
    }

    /// One scan into the tracker: taken in, all is sound; refused, nothing has changed.
    fn offer(&mut self, micros: u64, plots: &[Detection<f32, NZ>]) {
        let before = self.state.digest();
        match self.tracker.step(&mut self.state, &self.sensor, &Scan::new(Instant::from_micros(micros), plots)) {
            Ok(report) => {
                self.life.births += u64::from(report.births);
                self.life.dropped += u64::from(report.detections_dropped) + u64::from(report.births_refused);
                self.life.resets += u64::from(report.numeric_resets);
            }
            Err(error) => {
                self.life.refused += 1;
                let expected = matches!(error, ScanError::DetectionNotFinite | ScanError::TimeReversed);
                if !expected || self.state.digest() != before {
                    self.is_wrong(format!("a refused scan ({error}) has changed the state, or was good"));
                }
            }
        }
        let sound = self.state.tracks().all(|track| {
            let g = track.bank().combined();
            let sum: f32 = track.bank().prob.iter().sum();
            let finite = g.mean.iter().all(|x| x.is_finite()) && g.cov.is_finite() && track.existence() == 1.0;
            finite && (sum - 1.0).abs() < 1e-4 && (0..NX).all(|i| g.cov.get(i, i).is_some_and(|v| v >= 0.0))
        });
        if !sound {
            self.is_wrong("a track is not sound".into());
        }
        self.life.most = self.life.most.max(self.state.tracks().count());
    }

    /// A scan from before the last one.
    fn offer_older(&mut self, plots: &[Detection<f32, NZ>]) {
        let refused = self.life.refused;
        if let Some(last) = self.state.time() {
            self.offer(last.as_micros() - 1, plots);
            if self.life.refused == refused {
                self.is_wrong("a scan from before the last one was taken in".into());
            }
        }
    }

    /// Counts the targets that a confirmed track is near to.
    fn judge(&mut self, world: &World, scans: u64) {
        let tenth = scans.div_ceil(10);
        let part = match self.scans {
            first if first < tenth => 0,
            last if last >= scans - tenth => 1,
            _ => return,
        };
        let followed = |target: &Target| self.confirmed().any(|at| (at[0] - target.at[0]).hypot(at[1] - target.at[1]) < 500.0);
        let known: Vec<bool> = world.targets.iter().filter(|target| target.age >= 10).map(followed).collect();
        self.life.followed[part][0] += known.iter().filter(|followed| **followed).count() as u64;
        self.life.followed[part][1] += known.len() as u64;
    }

    fn confirmed(&self) -> impl Iterator<Item = [f64; 2]> {
        let sure = self.state.estimates().filter(|estimate| estimate.status != Status::Tentative);
        sure.map(|estimate| [0, STRIDE].map(|k| f64::from(estimate.state.mean[k])))
    }

    /// Nothing for a while, then as many targets as there are slots: all tracks must end, and all targets be followed.
    fn fill(&mut self, world: &mut World) {
        for _ in 0..12 {
            self.micros += 1_000_000;
            self.offer(self.micros, &[]);
        }
        if self.state.tracks().next().is_some() {
            self.is_wrong("tracks live on without detections".into());
        }
        let place = |k: usize| (4000.0 + 300.0 * k as f64, 2.0 * PI * k as f64 / TRACKS as f64);
        let target = |k| {
            let (range, azimuth) = place(k);
            Target { at: [range * f64::cos(azimuth), range * f64::sin(azimuth)], velocity: [100.0, 0.0], force: [0.0; 2], age: 0 }
        };
        let mut targets: Vec<Target> = (0..TRACKS).map(target).collect();
        for _ in 0..12 {
            self.micros += 1_000_000;
            targets.iter_mut().for_each(|target| target.at[0] += target.velocity[0]);
            let plots: Vec<_> = targets.iter().map(|target| world.plot(target, &self.parameters)).collect();
            self.offer(self.micros, &plots);
        }
        match self.confirmed().count() {
            TRACKS => self.life.filled += 1,
            count => self.is_wrong(format!("{count} of {TRACKS} targets are followed where there are as many slots")),
        }
    }

    fn is_wrong(&mut self, what: String) {
        let scan = self.scans;
        self.life.fault.get_or_insert_with(|| format!("scan {scan}: {what}"));
    }
}
