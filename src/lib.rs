//! Trackers for manoeuvring targets in clutter, for microcontrollers: plots in, tracks out, no heap, no `std`.
//!
//! A radar's plots (detections) of one scan go in; tracks with identity, state and covariance come out. Every size is a
//! const generic, all memory is one struct that the caller owns, and the same code runs in `f32` on a Cortex-M4F and in
//! `f32` or `f64` on a desk, in `f32` to the same bits.
//!
//! ```
//! use boresight::association::Gate;
//! use boresight::gaussian::Gaussian;
//! use boresight::initiation::{Initiation, Rule};
//! use boresight::model::motion::{ConstantAcceleration, ConstantVelocity, ProcessNoise};
//! use boresight::model::radar::{Component, Radar};
//! use boresight::scan::{Detection, Scan};
//! use boresight::sensor::{Clutter, UniformSensor};
//! use boresight::symmetric::Symmetric;
//! use boresight::time::{Duration, Instant};
//! use boresight::track::{Logic, Status};
//! use boresight::tracker::{ImmPdaf, State};
//! use nalgebra::SVector;
//!
//! // States (x, vx, ax, y, vy, ay), 2 modes, room for 16 tracks and 32 detections.
//! type Modes = (ConstantVelocity<f32, 2, 3>, ConstantAcceleration<f32, 2>);
//! type Tracker = ImmPdaf<f32, Modes, 6, 2, 16, 32>;
//! type Memory = State<f32, 6, 2, 16, 32>;
//! const _: () = assert!(size_of::<Memory>() < 12 * 1024);
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let modes = (
//!     ConstantVelocity::new(ProcessNoise::Discrete(0.1))?,      // (m/s²)²
//!     ConstantAcceleration::new(ProcessNoise::Discrete(30.0))?,
//! );
//! let prior = Gaussian::new(SVector::zeros(), Symmetric::from_diagonal([1.0, 1e4, 25.0, 1.0, 1e4, 25.0]));
//! let pairs = Rule::TwoPoint { max_speed: 300.0, max_gap: Duration::from_millis(2500) };
//! let logic = Logic::new(3, 4, 5)?; // confirmed by 3 hits of 4, deleted after 5 misses
//! let tracker = Tracker::new(modes, [[0.9, 0.1], [0.1, 0.9]], [0.9, 0.1], logic)?.with_initiation(Initiation::new(pairs, prior)?);
//!
//! let noise = Symmetric::from_diagonal([20.0 * 20.0, 0.002 * 0.002]); // m², rad²
//! let radar = Radar::<f32, 2, 2, 3>::new([Component::Range, Component::Azimuth], noise)?; // 2 components, 2 axes of 3 states
//! let sensor = UniformSensor::new(radar, 0.95, Clutter::Poisson(1e-5), Gate::new::<2>(16.0)?)?;
//!
//! let mut memory = Memory::new();
//! for k in 0..6 {
//!     // One target, 5 km east, flying north at 200 m/s.
//!     let north = 200.0 * k as f32;
//!     let plots = [Detection::new([5000f32.hypot(north), north.atan2(5000.0)])];
//!     tracker.step(&mut memory, &sensor, &Scan::new(Instant::from_millis(1000 * k), &plots))?;
//! }
//! let track = memory.estimates().find(|e| e.status == Status::Confirmed).ok_or("no track")?;
//! assert!((track.state.mean[4] - 200.0).abs() < 1.0, "north at {} m/s", track.state.mean[4]);
//! # Ok(())
//! # }
//! ```
//!
//! # Which tracker when
//!
//! | tracker | targets | state |
//! |---|---|---|
//! | [`ImmPdaf`](tracker::ImmPdaf) | manoeuvring, in clutter, apart from each other most of the time | here |
//! | [`ImmJpda`](tracker::ImmJpda) | the same, close to each other and crossing | here |
//! | [`LmsJpda`](tracker::LmsJpda) | the same with many modes, of which each track runs the likely ones | here |
//! | [`ImmCoupled`](tracker::ImmCoupled) | two that the sensor may not tell apart, with what they have in common | here |
//! | [`JmsGlmb`](tracker::JmsGlmb) | manoeuvring, coming and going in heavy clutter, with an identity each | here |
//! | any of them a sensor, and a [`Combiner`](fusion::Combiner) | seen by several sensors whose tracks, not plots, can be had | here |
//!
//! WHICH-TRACKER.md in the repository has all of them on the same scenarios, beside what they cost; GUIDE.md how to find their numbers.
//!
//! `ImmPdaf` with one mode is the PDAF; with [`NearestNeighbour`](association::NearestNeighbour) the nearest-neighbour
//! filter. `ImmJpda` takes [`Jpda`](association::Jpda), or [`Gnn`](association::Gnn) as a baseline; with one mode it is the
//! JPDAF. Where two targets may give one plot between them, a sensor that states its [`Resolution`](model::resolution::Resolution)
//! and the association [`MergingJpda`](association::MergingJpda) are all that it takes. [`Logic`](track::Logic) ends tracks by
//! counting misses, or by the probability that their targets exist: then they are the IPDA and the JIPDA. `JmsGlmb` keeps
//! hypotheses of which targets there are and which detections were theirs, instead of tracks one by one: their number and their
//! identities are decided together. Wrap a model in [`Unscented`](model::unscented::Unscented) and it filters by sigma points.
//!
//! # Layers
//!
//! A module uses those above it only, but for identity and status of a track, which `scan` tells.
//!
//! | module | what it holds |
//! |---|---|
//! | [`scalar`], [`symmetric`], [`time`], [`error`] | `f32` or `f64` with our own transcendentals; covariances; microseconds; the flat errors |
//! | [`gaussian`] | densities, predicted measurements, the correction x += G w, P −= G E G' |
//! | [`model`] | motion (CV, CA, Singer, turns) and measurement (position, radar) by three plain functions and one fast override |
//! | [`mode`] | several models at once: the mode bank, the interacting multiple model, the set of likely modes |
//! | [`association`] | gates; from likelihood ratios to probabilities, knowing no state: single, joint, assignment |
//! | [`scan`], [`sensor`] | what goes in and comes out; P_D and clutter |
//! | [`coupled`] | two targets as one density, and what a scan says of both |
//! | [`evidence`] | what a scan says of one track: gate, score, absorb |
//! | [`track`], [`initiation`] | identity, confirmation, deletion; starting tracks from plots |
//! | [`glmb`] | labelled random finite sets: densities, hypotheses, truncation |
//! | [`tracker`] | complete trackers, each with its equations, its memory and its `step` |
//! | [`plots`], [`ready`] | a scan gathered plot by plot; trackers of chosen sizes whose configuration is a flat structure |
//! | [`telemetry`] | one record a scan: tracks, report, cost |
//! | `link` | a sensor that sends its detections over SPI (feature `link`) |
//! | [`log`] | scans and tracks recorded in bytes, to be replayed on a desk |
//! | [`fusion`] | tracks of several trackers: registered, associated, fused; messages between nodes |
//!
//! # What it promises
//!
//! - **No panic, no heap,** and no `unsafe` but for one instruction, the square root of the FPU. Bad configuration does not
//!   compile or returns a [`ConfigError`](error::ConfigError). A scan that is not finite or goes back in time returns a
//!   [`ScanError`](error::ScanError) and changes nothing.
//! - **Load is data.** A full tracker drops by a stated rule and counts it in the [`Report`](scan::Report); joint events that
//!   are given up are reported with a bound on what that changes. Loops are bounded by the const parameters.
//! - **Single precision holds.** Covariances are symmetric by type and formed from deviations, likelihoods relative where they would underflow;
//!   a correction that would break a covariance is refused and counted, and the second one deletes that track only.
//! - **Sensors differ, tracks do not.** The dimension of a measurement belongs to a step and its sensor; radars, direction
//!   finders and cameras feed the same tracks, at any times that do not go back.
//!
//! Work near a local origin: in `f32` a coordinate beyond 1e5 m has a resolution of centimetres.
#![no_std]
#![deny(unsafe_code, missing_docs)]

#[macro_use]
mod unrolled;
mod bytes;
mod counter;
mod order;

pub mod association;
pub mod coupled;
pub mod error;
pub mod evidence;
pub mod fusion;
pub mod gaussian;
pub mod glmb;
pub mod initiation;
#[cfg(feature = "link")]
pub mod link;
pub mod log;
pub mod mode;
pub mod model;
pub mod plots;
pub mod ready;
pub mod scalar;
pub mod scan;
pub mod sensor;
pub mod symmetric;
pub mod telemetry;
pub mod time;
pub mod track;
pub mod tracker;

/// The README's code, compiled and run as documentation tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
