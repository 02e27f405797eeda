//! Many sensors, each with a tracker of its own: which tracks are one target's, and one estimate made of them.
//!
//! | file | holds |
//! |---|---|
//! | `rules.rs` | two estimates made one: convex combination, covariance intersection; mode probabilities |
//! | `correlated.rs` | the same with a known cross-covariance (Bar-Shalom and Campo); the test of two tracks |
//! | `registration.rs` | a sensor's own frame, brought to the common one |
//! | `combiner.rs` | a list of tracks from every sensor made one picture |
//! | `picture.rs` | what that remembers: the lists, and fused tracks with an identity each |
//! | `message.rs` | a track in bytes, for the link between two nodes |
//! | `inverse.rs` | covariances that may be singular |
//! | `work.rs` | the most work that an update can make |
//!
//! # Which rule when
//!
//! | rule | needs | errors of one target's tracks share process noise and prior, and so |
//! |---|---|---|
//! | [`Rule::NaiveConvex`] | nothing | overconfident: it counts twice what both know from the same source |
//! | [`Rule::Intersection`] | nothing | consistent for any correlation, and cautious where there is little |
//! | [`CrossCovariance::fuse`] | the gains of both filters, scan by scan | consistent, and the least that two estimates allow |
//!
//! Two Kalman filters of one target, with process noise that matters: the mean normalised error squared of four states is 5.7 by
//! the first rule, 3.6 by the second and 4.0, as it should be, by the third. Where the filters assume far more process noise than
//! there is, the first may pass for honest.
//!
//! A list goes in once and replaces the one before, and a fused estimate is never fed back: every sensor's track counts once.
//!
//! ```
//! use boresight::fusion::{Combiner, Frame, FusedPicture, Limits, Rule, TrackMessage, Weight};
//! use boresight::gaussian::Gaussian;
//! use boresight::model::motion::{ConstantVelocity, ProcessNoise};
//! use boresight::symmetric::Symmetric;
//! use boresight::time::{Duration, Instant};
//! use boresight::track::Logic;
//! use boresight::tracker::{ImmPdaf, State};
//! use nalgebra::SVector;
//!
//! type Message = TrackMessage<f32, 4, 1>;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let modes = (ConstantVelocity::<f32, 2>::new(ProcessNoise::Continuous(1.0))?,);
//! let limits = Limits { join: 13.3, part: 18.5, max_age: Duration::from_millis(5000) }; // 99 % and 99.9 % of χ² with 4
//! let combiner = Combiner::new(modes, [[1.0]], Rule::Intersection(Weight::Determinant), limits)?;
//! let mut picture = FusedPicture::<f32, 4, 1, 2, 8>::new(); // 2 sensors, 8 tracks
//!
//! // One target, seen by a node at the origin and by another one 1 km east of it, each better in one axis.
//! let tracker = ImmPdaf::<f32, _, 4, 1, 8, 16>::new(modes, [[1.0]], [1.0], Logic::new(3, 4, 5)?)?;
//! let now = Instant::from_millis(1000);
//! for (sensor, east, variances) in [(0, 0.0, [1.0, 1.0, 25.0, 1.0]), (1, 1000.0, [25.0, 1.0, 1.0, 1.0])] {
//!     let mut state = State::new();
//!     tracker.start(&mut state, Gaussian::new(SVector::from([300.0 - east, 0.0, 400.0, 0.0]), Symmetric::from_diagonal(variances)), now);
//!
//!     // Over a link, track by track.
//!     let mut bytes = [0; Message::SIZE];
//!     let track = state.tracks().next().ok_or("no track")?;
//!     Message::new(sensor, now, track).ok_or("no track")?.encode(&mut bytes)?;
//!     let told = Message::decode(&bytes)?;
//!     let frame = Frame::new([east, 0.0, 0.0], 0.0)?;
//!     combiner.receive(&mut picture, usize::from(told.sensor), &frame, told.time, [(told.id, &told.bank)])?;
//! }
//! let report = combiner.update(&mut picture);
//! assert_eq!((report.tracks, report.joined), (1, 1));
//! let fused = picture.tracks().next().ok_or("no track")?;
//! assert!(fused.state.cov.upper()[0][0] < 2.1 && fused.state.cov.upper()[2][2] < 2.1); // each was 25 to one of them
//! # Ok(())
//! # }
//! ```

mod combiner;
mod correlated;
mod inverse;
mod message;
mod picture;
mod registration;
mod rules;
mod work;

pub use combiner::{Combiner, FusionReport, Limits};
pub use correlated::{CrossCovariance, Distance, distance};
pub use message::{MessageError, TrackMessage};
pub use picture::{FusedPicture, FusedTrack, ListError};
pub use registration::Frame;
pub use rules::{Rule, Weight, fuse_probabilities};
pub use work::FusionWork;
#[cfg(feature = "count")]
pub use work::take_work;
