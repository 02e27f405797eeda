//! The first difference between a record and what the same scan makes here: by scan, track and field.

use boresight::error::ScanError;
use boresight::log::{Record, Seen};
use boresight::ready::{DETS, MODES, State, TRACKS};
use std::fmt;

/// Where a log and the desk part.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Divergence {
    /// Number of the scan
    pub scan: u32,
    /// Number of the track's identity; none where it is not one track's
    pub track: Option<u32>,
    /// The field of the track, or of the state
    pub field: String,
    /// What the log holds
    pub recorded: String,
    /// What comes out here
    pub replayed: String,
}

impl fmt::Display for Divergence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { scan, track, field, recorded, replayed } = self;
        let track = track.map_or(String::new(), |track| format!(", track {track}"));
        write!(f, "first divergence in scan {scan}{track}, {field}: recorded {recorded}, replayed {replayed}")
    }
}

impl Divergence {
    /// A scan that was taken in on the target and is refused here.
    pub fn of_outcome<const NX: usize, const NZ: usize>(
        record: &Record<NX, MODES, NZ, TRACKS, DETS>,
        refusal: Option<ScanError>,
    ) -> Option<Self> {
        let (field, recorded) = ("outcome".into(), "taken in".into());
        refusal.map(|error| Self { scan: record.number, track: None, field, recorded, replayed: format!("refused: {error}") })
    }

    /// The first difference between `record` and the state after the same scan.
    pub fn find<const NX: usize, const NZ: usize>(record: &Record<NX, MODES, NZ, TRACKS, DETS>, state: &State<f32, NX>) -> Option<Self> {
        let here: Vec<Seen<NX, MODES>> = state.tracks().filter_map(Seen::new).collect();
        let differs = |track: Option<u32>, field: String, (recorded, replayed): (String, String)| {
            (recorded != replayed).then_some(Self { scan: record.number, track, field, recorded, replayed })
        };
        let ids = |tracks: &[Seen<NX, MODES>]| format!("{:?}", tracks.iter().map(|track| track.id).collect::<Vec<_>>());
        differs(None, "identities of the tracks".into(), (ids(&record.tracks), ids(&here)))
            .or_else(|| {
                record.tracks.iter().zip(&here).find_map(|(there, here)| {
                    let pairs = fields(there).into_iter().zip(fields(here));
                    pairs
                        .map(|((field, recorded), (_, replayed))| (field, (recorded, replayed)))
                        .find_map(|(field, values)| differs(Some(there.id), field, values))
                })
            })
            .or_else(|| {
                let word = |digest: u32| format!("digest {digest:#010x}");
                differs(None, "detections that wait for a partner".into(), (word(record.digest), word(state.digest())))
            })
    }
}

/// All fields of a track by name and value; numbers with their bits.
fn fields<const NX: usize>(track: &Seen<NX, MODES>) -> Vec<(String, String)> {
    let number = |x: f32| format!("{x:?} ({:#010x})", x.to_bits());
    let mut all = vec![("status".into(), format!("{:?}", track.status)), ("existence".into(), number(track.existence))];
    all.extend(track.prob.iter().enumerate().map(|(r, p)| (format!("mode probability {r}"), number(*p))));
    all.extend(track.mean.iter().enumerate().map(|(i, x)| (format!("mean {i}"), number(*x))));
    all.push(("covariance, modes or history".into(), format!("digest {:#010x}", track.digest)));
    all
}
