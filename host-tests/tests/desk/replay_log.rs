//! Logs written by the library, replayed: to the same bits, with a planted divergence, and damaged in every byte.

use boresight::log::{Header, LogError, Record, Recorder, Seen};
use boresight::plots::Plots;
use boresight::ready::{DETS, MODES, Parameters, Sensor, State, TRACKS, TURNING, WORDS};
use boresight::scan::{Detection, Scan};
use boresight::symmetric::Symmetric;
use boresight::time::{Duration, Instant};
use host_tests::error::Status;
use host_tests::replay_log::replay;
use proptest::prelude::*;
use twin::record::{self, MOST, Memory};

type Demo = Record<6, MODES, 2, TRACKS, DETS>;

/// The log that the image `record` writes, by the same code.
fn log() -> Vec<u8> {
    let mut log = Vec::new();
    assert!(record::run(&mut Memory::new(), &mut [0; MOST], |part| log.extend_from_slice(part)).is_ok());
    log
}

/// Where the records begin and end.
fn records(log: &[u8]) -> Vec<std::ops::Range<usize>> {
    let (mut at, mut all) = (Header::size(WORDS), Vec::new());
    while at < log.len() {
        let length = usize::from(u16::from_le_bytes([log[at], log[at + 1]]));
        all.push(at..at + length);
        at += length;
    }
    all
}

fn crc(bytes: &[u8]) -> [u8; 4] {
    let bit = |crc: u32| crc >> 1 ^ if crc & 1 == 1 { 0xedb8_8320 } else { 0 };
    (!bytes.iter().fold(!0, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), |crc, _| bit(crc)))).to_le_bytes()
}

/// The log with the lowest bit of the byte `at` of the record number `scan` flipped, and a checksum that agrees.
fn planted(log: &[u8], scan: usize, at: usize) -> Vec<u8> {
    let (mut log, range) = (log.to_vec(), records(log)[scan].clone());
    let record = &mut log[range];
    record[at] ^= 1;
    let (body, checksum) = record.split_at_mut(record.len() - 4);
    checksum.copy_from_slice(&crc(body));
    log
}

#[test]
fn the_desk_gives_the_same_bits() {
    let (text, divergence) = replay(&log()).unwrap();
    assert_eq!(divergence, None);
    assert!(text.contains("62 scans, 2 of them refused, ") && text.contains("the same tracks in all scans"), "{text}");
}

#[test]
fn a_planted_divergence_is_found_at_its_scan_track_and_field() {
    let log = log();
    let at = |scan: usize| Demo::decode(&log[records(&log)[scan].clone()]).unwrap().0;
    // A track behind the detections, of 9 bytes before its probabilities, 12 of these, 24 of its mean, and its digest.
    let track = |scan: usize, number: usize| 28 + 9 * at(scan).plots.as_slice().len() + 49 * number;
    for (scan, number, byte, field) in [
        (30, 1, 4, "status"),
        (30, 1, 5, "existence"),
        (31, 0, 9 + 4, "mode probability 1"),
        (45, 2, 21 + 12, "mean 3"),
        (61, 1, 45, "covariance, modes or history"),
    ] {
        let found = replay(&planted(&log, scan, track(scan, number) + byte)).unwrap().1.unwrap();
        let expected = (scan as u32, Some(at(scan).tracks[number].id), field);
        assert_eq!((found.scan, found.track, found.field.as_str()), expected, "{found}");
    }
    // The identity is one of a list; the digest of the state tells of what no track shows.
    let found = replay(&planted(&log, 30, track(30, 0))).unwrap().1.unwrap();
    assert_eq!((found.scan, found.track, found.field.as_str()), (30, None, "identities of the tracks"));
    let found = replay(&planted(&log, 5, 24)).unwrap().1.unwrap();
    assert_eq!((found.scan, found.track, found.field.as_str()), (5, None, "detections that wait for a partner"));
    // The range of a target's detection in scan 33, one unit in the last place off: the track that it updates is the first to tell.
    let before = at(32);
    let of = |t: &Seen<6, MODES>, d: &Detection<f32, 2>| {
        (t.mean[0].hypot(t.mean[3]) - d.z[0]).abs() < 300.0 && (t.mean[3].atan2(t.mean[0]) - d.z[1]).abs() < 0.05
    };
    let near = |d: &Detection<f32, 2>| before.tracks.iter().any(|t| of(t, d));
    let detection = at(33).plots.as_slice().iter().position(near).unwrap();
    let found = replay(&planted(&log, 33, 28 + 9 * detection + 1)).unwrap().1.unwrap();
    assert!(found.scan == 33 && found.track.is_some(), "{found}");
}

#[test]
fn every_damaged_byte_is_found() {
    let log = log();
    let ends = records(&log);
    for at in (0..log.len()).step_by(97).chain(0..Header::size(WORDS)) {
        let mut damaged = log.clone();
        damaged[at] ^= 0x10;
        let failure = replay(&damaged).unwrap_err();
        assert_eq!(failure.status(), Status::Input);
        let place = ends.iter().position(|range| range.contains(&at)).map_or("header".into(), |k| format!("record {k}"));
        assert!(failure.to_string().starts_with(&format!("{place}: ")), "byte {at}: {failure}");
    }
    let cut = replay(&log[..log.len() - 5]).unwrap_err();
    assert_eq!(cut.to_string(), format!("record 61: {}", LogError::Length));
    let mut without = log.clone();
    without.drain(ends[7].clone());
    assert_eq!(replay(&without).unwrap_err().to_string(), "record 7: scan 8 where 7 belongs: records are missing");
}

/// Any plot that a radar of this kind may send.
fn plot() -> impl Strategy<Value = Detection<f32, 3>> {
    let part = (100f32..9000.0, -3.1f32..3.1, -200f32..200.0);
    let brings =
        (proptest::option::of((1f32..50.0, 0.001f32..0.01, 0.1f32..3.0)), proptest::option::of(0f32..9.0), -60_000_000i64..=60_000_000);
    (part, brings).prop_map(|((range, azimuth, rate), (noise, amplitude, offset))| {
        let mut plot = Detection::new([range, azimuth, rate]).with_offset(Duration::from_micros(offset % 50_000));
        if let Some((a, b, c)) = noise {
            plot = plot.with_noise(Symmetric::from_diagonal([a * a, b * b, c * c]));
        }
        amplitude.map_or(plot, |amplitude| plot.with_amplitude(amplitude))
    })
}

#[test]
fn a_record_that_contradicts_itself_is_refused() {
    let log = log();
    let of = |scan: usize, at: usize, byte: u8| {
        let mut record = log[records(&log)[scan].clone()].to_vec();
        record[at] = byte;
        let (body, checksum) = record.split_at_mut(record.len() - 4);
        checksum.copy_from_slice(&crc(body));
        Demo::decode(&record).map(|_| ()).err()
    };
    // Neither taken in nor refused; refused, and yet with detections; of another number of detections than there are.
    let count = Demo::decode(&log[records(&log)[5].clone()]).unwrap().0.plots.as_slice().len() as u8;
    assert_eq!(
        [of(5, 3, 2), of(5, 3, 1), of(5, 16, count + 1), of(5, 16, count)],
        [Some(LogError::Content), Some(LogError::Content), Some(LogError::Content), None]
    );
}

/// A radar that moves: its tracker gets other numbers while it lives, and the log another header.
#[test]
fn a_log_goes_on_with_other_numbers() {
    type Log = Recorder<4, MODES, 2, TRACKS, DETS>;
    let (mut state, mut recorder, mut out) = (Box::new(State::<f32, 4>::new()), Log::new(), vec![0; Log::MOST]);
    let (mut whole, mut silent) = (Vec::new(), Vec::new());
    for leg in 0..3u8 {
        let parameters =
            Parameters { position: [40.0 * f32::from(leg), 0.0, 0.0], p_detect: 0.9 - 0.1 * f32::from(leg), ..Parameters::turning() };
        let (tracker, sensor): (_, Sensor<f32, 2, 2>) = (parameters.turning_tracker::<f32>().unwrap(), parameters.sensor().unwrap());
        let length = recorder.header(TURNING, &parameters.words(), &mut out).unwrap();
        whole.extend_from_slice(&out[..length]);
        silent.extend_from_slice(if leg == 0 { &out[..length] } else { &[] });
        for k in 0..5u8 {
            let plots = [Detection::new([3000.0 + 20.0 * f32::from(5 * leg + k), 0.5])];
            let scan = Scan::new(Instant::from_millis(1000 * u64::from(5 * leg + k)), &plots);
            let outcome = tracker.step(&mut state, &sensor, &scan);
            let length = recorder.record(&scan, &outcome, &tracker, &state, &mut out).unwrap();
            whole.extend_from_slice(&out[..length]);
            silent.extend_from_slice(&out[..length]);
        }
    }
    assert_eq!(replay(&whole).unwrap().1, None);
    // Where nobody has told of the change, it is found in the first scan after it.
    assert_eq!(replay(&silent).unwrap().1.map(|divergence| divergence.scan), Some(5));
    let other = Recorder::<6, MODES, 2, TRACKS, DETS>::new();
    let length = other.header(*b"accl", &Parameters::accelerating().words(), &mut out).unwrap();
    whole.extend_from_slice(&out[..length]);
    assert_eq!(replay(&whole).err().map(|failure| failure.to_string()).as_deref(), Some("record 15: a header of another tracker"));
}

proptest! {
    /// Whatever a record holds under a checksum that agrees, and whatever bytes a log is made of, it is replayed or refused.
    #[test]
    fn any_content_is_replayed_or_refused(
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..20),
        scan in any::<prop::sample::Index>(),
        noise in proptest::collection::vec(any::<u8>(), 0..300),
    ) {
        static LOG: std::sync::OnceLock<Vec<u8>> = std::sync::OnceLock::new();
        let mut log = LOG.get_or_init(log).clone();
        let all = records(&log);
        let range = all[scan.index(all.len())].clone();
        let record = &mut log[range];
        let (body, checksum) = record.split_at_mut(record.len() - 4);
        // All but its length and what it begins with.
        changes.iter().for_each(|(at, byte)| body[3 + at.index(body.len() - 3)] = *byte);
        checksum.copy_from_slice(&crc(body));
        let _ = replay(&log);
        prop_assert!(replay(&noise).is_err());
        log.truncate(Header::size(WORDS));
        log.extend_from_slice(&noise);
        prop_assert!(replay(&log).is_err() || noise.is_empty());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// Whatever was recorded is read again, all of it, and replays to the same bits; what is cut or changed is refused.
    #[test]
    fn records_are_read_as_they_were_written(
        scans in proptest::collection::vec((proptest::collection::vec(plot(), 0..50), 0u64..3_000_000), 1..12),
        cut in any::<prop::sample::Index>(),
    ) {
        type Log = Recorder<4, MODES, 3, TRACKS, DETS>;
        let parameters = Parameters::turning();
        let (tracker, sensor): (_, Sensor<f32, 3, 2>) = (parameters.turning_tracker::<f32>().unwrap(), parameters.sensor().unwrap());
        let (mut state, mut recorder, mut log, mut out) = (Box::new(State::<f32, 4>::new()), Log::new(), Vec::new(), vec![0; Log::MOST]);
        let length = recorder.header(TURNING, &parameters.words(), &mut out).unwrap();
        log.extend_from_slice(&out[..length]);
        let mut time = 0;
        for (plots, gap) in &scans {
            time += gap;
            let scan = Scan::new(Instant::from_micros(time), plots);
            let outcome = tracker.step(&mut state, &sensor, &scan);
            let length = recorder.record(&scan, &outcome, &tracker, &state, &mut out).unwrap();
            let mut kept = Plots::<f32, 3, DETS>::new();
            plots.iter().for_each(|plot| kept.push(*plot));
            let (record, rest) = Record::<4, MODES, 3, TRACKS, DETS>::decode(&out[..length]).unwrap();
            prop_assert!(rest.is_empty() && record.plots.as_slice() == kept.as_slice() && record.dropped == kept.dropped());
            prop_assert_eq!((record.digest, record.tracks.len()), (state.digest(), state.tracks().count()));
            log.extend_from_slice(&out[..length]);
        }
        prop_assert_eq!(replay(&log).unwrap().1, None);
        let cut = cut.index(log.len());
        let ends = cut == Header::size(WORDS) || records(&log).iter().any(|range| range.end == cut);
        prop_assert_eq!(replay(&log[..cut]).is_ok(), ends);
    }
}
