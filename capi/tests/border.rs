//! The border as C crosses it: the same tracks as in Rust, to the bit, and every misuse that can be told refused.
//!
//! Also under Miri, which watches every access but knows no assembly, so for an ARM without floating point unit:
//! `cargo +nightly miri test --target arm-unknown-linux-gnueabi --test border` in `capi/`.

use boresight::plots::Plots;
use boresight::ready::{DETS, Parameters};
use boresight::scan::Detection as Plot;
use boresight::sensor::Sensor;
use boresight::symmetric::Symmetric;
use boresight::time::{Duration, Instant};
use boresight::tracker::Tracker as _;
use boresight_capi::*;
use core::ptr::{null, null_mut};
use twin::data::{PERIOD_MILLIS, SCANS};

const PERIOD_US: u64 = 1000 * PERIOD_MILLIS;
/// Miri takes its time.
const MOST_SCANS: usize = if cfg!(miri) { 3 } else { 60 };

/// As C would have it: bytes, aligned.
#[repr(C, align(8))]
struct Memory([u8; BORESIGHT_ACCELERATING_RAR_SIZE]);

fn memory() -> Box<Memory> {
    Box::new(Memory([0; _]))
}

fn defaults(kind: &'static Kind) -> Parameters {
    let mut parameters = Parameters::from_words(&[0; _]);
    // SAFETY: both are valid.
    assert_eq!(unsafe { boresight_defaults(kind, &mut parameters) }, Status::Ok);
    parameters
}

fn create(kind: &'static Kind, memory: &mut Memory) -> *mut Tracker {
    let mut tracker = null_mut();
    let memory = (&raw mut *memory).cast();
    // SAFETY: all are valid, and the memory is the tracker's from now on.
    let status = unsafe { boresight_create(kind, memory, size_of::<Memory>(), &defaults(kind), &mut tracker) };
    assert_eq!(status, Status::Ok);
    tracker
}

/// The recorded plots of scan `k`, each with a range-rate, some with a noise, an amplitude and a time of their own.
fn detections(k: usize) -> Vec<Detection> {
    let plot = |(i, [range, azimuth]): (usize, &[f32; 2])| Detection {
        z: [*range, *azimuth, (*azimuth * 9.0).sin() * 200.0, 0.0],
        sigma: [20.0, 0.004, 2.0, 0.0],
        amplitude: (i % 4) as f32,
        offset_us: if i % 3 == 0 { 20_000 } else { 0 },
        given: i as u32 % 4,
    };
    SCANS[k].iter().enumerate().map(plot).collect()
}

fn step(tracker: *mut Tracker, time_us: u64, detections: &[Detection]) -> (Status, Report) {
    let mut report = Report::default();
    // SAFETY: a tracker, a slice and a report.
    let status = unsafe { boresight_step(tracker, time_us, detections.as_ptr(), detections.len(), &mut report) };
    (status, report)
}

fn tracks(tracker: *mut Tracker) -> Vec<Track> {
    let (mut tracks, mut count) = (Vec::with_capacity(16), 0);
    // SAFETY: room for as many tracks as the vector has; as many as are there have been written.
    unsafe {
        assert_eq!(boresight_tracks(tracker, tracks.as_mut_ptr(), tracks.capacity(), &mut count), Status::Ok);
        tracks.set_len(count.min(tracks.capacity()));
    }
    tracks
}

fn density(tracker: *mut Tracker, id: u32) -> Result<Density, Status> {
    let mut density = core::mem::MaybeUninit::uninit();
    // SAFETY: both are valid; where the status says so the density has been written.
    unsafe {
        match boresight_track_density(tracker, id, density.as_mut_ptr()) {
            Status::Ok => Ok(density.assume_init()),
            status => Err(status),
        }
    }
}

/// Runs the configuration `C` both ways.
fn agrees<C: Configuration<NX, 3, NZ>, const NX: usize, const NZ: usize>(kind: &'static Kind) {
    let mut memory = memory();
    let there = create(kind, &mut memory);
    let parameters = C::defaults();
    assert_eq!(defaults(kind), parameters);
    let (tracker, sensor) = C::build(&parameters).unwrap();
    let mut state = <C::Tracker as boresight::tracker::Tracker<f32, NX, 3>>::State::default();
    let mut followed = 0;
    for k in 0..MOST_SCANS {
        let time_us = k as u64 * PERIOD_US;
        let detections = detections(k);
        let (status, report) = step(there, time_us, &detections);
        assert_eq!(status, Status::Ok);

        let mut plots = Plots::<f32, NZ, DETS>::new();
        for d in &detections {
            let mut plot = Plot::new(core::array::from_fn(|i| d.z[i])).with_offset(Duration::from_micros(d.offset_us.into()));
            if d.given & BORESIGHT_SIGMA != 0 {
                plot = plot.with_noise(Symmetric::from_diagonal(core::array::from_fn(|i| d.sigma[i] * d.sigma[i])));
            }
            plots.push(if d.given & BORESIGHT_AMPLITUDE != 0 { plot.with_amplitude(d.amplitude) } else { plot });
        }
        let here = tracker.step(&mut state, &sensor, &plots.scan(Instant::from_micros(time_us))).unwrap();
        assert_eq!(report, here.into());
        let theirs = tracks(there);
        assert!(theirs.iter().map(|track| track.id).eq(tracker.estimates(&state).map(|e| e.id.number())));
        for (theirs, track) in theirs.iter().zip(tracker.tracks(&state)) {
            let all = density(there, theirs.id).unwrap();
            let g = track.bank().combined();
            let (stride, upper) = (NX / 2, g.cov.to_matrix());
            assert_eq!((all.states, all.modes, all.mode_probability[..3] == track.bank().prob), (NX as u32, 3, true));
            assert_eq!(all.mean[..NX], *g.mean.as_slice());
            assert_eq!(all.covariance[NX - 1], upper[(0, NX - 1)]);
            assert_eq!(theirs.position, [g.mean[0], g.mean[stride], 0.0]);
            assert_eq!(theirs.velocity, [g.mean[1], g.mean[stride + 1], 0.0]);
            assert_eq!(theirs.covariance, [upper[(0, 0)], upper[(0, stride)], 0.0, upper[(stride, stride)], 0.0, 0.0]);
            followed += 1;
        }
    }
    assert!(followed > 0 && sensor.gate().dimension() == NZ);
}

#[test]
fn every_ready_tracker_is_that_of_rust() {
    agrees::<Turns, 4, 2>(&boresight_turning_ra);
    agrees::<Turns, 4, 3>(&boresight_turning_rar);
    agrees::<Accelerates, 6, 2>(&boresight_accelerating_ra);
    agrees::<Accelerates, 6, 3>(&boresight_accelerating_rar);
}

#[test]
fn misuse_is_refused() {
    let kind = &boresight_turning_ra;
    let (mut memory, mut tracker) = (memory(), null_mut());
    let parameters = defaults(kind);
    let start: *mut u8 = (&raw mut *memory).cast();
    let size = size_of::<Memory>();
    // SAFETY: every address is NULL, or within memory of the size that is told.
    unsafe {
        assert_eq!(boresight_step(start.cast(), 0, null(), 0, null_mut()), Status::NoTracker);
        assert_eq!(boresight_create(null(), start.cast(), size, &parameters, &mut tracker), Status::Null);
        assert_eq!(boresight_create(kind, null_mut(), size, &parameters, &mut tracker), Status::Null);
        assert_eq!(boresight_create(kind, start.cast(), size, null(), &mut tracker), Status::Null);
        assert_eq!(boresight_create(kind, start.cast(), size, &parameters, null_mut()), Status::Null);
        assert_eq!(boresight_create(kind, start.cast(), kind.size() - 1, &parameters, &mut tracker), Status::Memory);
        assert_eq!(boresight_create(kind, start.add(4).cast(), size - 4, &parameters, &mut tracker), Status::Memory);
        let bad = Parameters { p_detect: 2.0, ..parameters };
        assert_eq!(boresight_create(kind, start.cast(), size, &bad, &mut tracker), Status::ConfigNotAProbability);
        assert!(tracker.is_null());
        // What was refused has not left a tracker behind.
        assert_eq!(boresight_step(start.cast(), 0, null(), 0, null_mut()), Status::NoTracker);
        assert_eq!(boresight_create(kind, start.cast(), kind.size(), &parameters, &mut tracker), Status::Ok);

        assert_eq!(boresight_step(null_mut(), 0, null(), 0, null_mut()), Status::Null);
        assert_eq!(boresight_step(tracker, 0, null(), 3, null_mut()), Status::Null);
        let one = Detection::default();
        assert_eq!(boresight_step(tracker, 0, &one, usize::MAX, null_mut()), Status::Count);
        assert_eq!(boresight_step(tracker, 5, null(), 0, null_mut()), Status::Ok);
        assert_eq!(boresight_step(tracker, 4, null(), 0, null_mut()), Status::ScanTimeReversed);
        assert_eq!(boresight_tracks(tracker, null_mut(), 0, null_mut()), Status::Null);
        assert_eq!(boresight_tracks(tracker, null_mut(), 1, &mut 0), Status::Null);
        assert_eq!(boresight_track_density(tracker, 1, null_mut()), Status::Null);
        assert_eq!(boresight_configure(tracker, null()), Status::Null);
        assert_eq!(boresight_configure(tracker, &bad), Status::ConfigNotAProbability);
        assert_eq!(boresight_defaults(kind, null_mut()), Status::Null);
    }
    let with = |d: Detection| step(tracker, 6, &[d]).0;
    let plot = Detection { z: [1000.0, 0.1, 0.0, 0.0], ..Detection::default() };
    assert_eq!(with(Detection { z: [f32::NAN; 4], ..plot }), Status::ScanDetectionNotFinite);
    assert_eq!(with(Detection { given: BORESIGHT_AMPLITUDE, amplitude: f32::INFINITY, ..plot }), Status::ScanDetectionNotFinite);
    assert_eq!(with(Detection { given: BORESIGHT_SIGMA, ..plot }), Status::ScanNoiseNotDefinite);
    assert_eq!(with(Detection { offset_us: i32::MIN, ..plot }), Status::ScanOffsetTooLarge);
    assert_eq!(with(plot), Status::Ok);
    assert_eq!(density(tracker, 77), Err(Status::NoTrack));
}

#[test]
fn addresses_that_are_not_aligned_are_refused() {
    let (mut memory, mut place) = (memory(), memory());
    let kind: *const Kind = &boresight_turning_ra;
    let (tracker, parameters) = (create(&boresight_turning_ra, &mut memory), defaults(&boresight_turning_ra));
    let odd: *mut u8 = (&raw mut place.0).cast::<u8>().wrapping_add(1);
    let (mut made, mut count) = (null_mut(), 0);
    let size = size_of::<Memory>();
    // SAFETY: every address is valid but for its alignment.
    unsafe {
        assert_eq!(boresight_defaults(kind, odd.cast()), Status::Memory);
        assert_eq!(boresight_defaults(kind.wrapping_byte_add(1), &mut parameters.clone()), Status::Memory);
        assert_eq!(boresight_create(kind, (&raw mut place.0).cast(), size, odd.cast(), &mut made), Status::Memory);
        assert_eq!(boresight_create(kind, (&raw mut place.0).cast(), size, &parameters, odd.cast()), Status::Memory);
        assert_eq!(boresight_configure(tracker, odd.cast()), Status::Memory);
        assert_eq!(boresight_configure(odd.cast(), &parameters), Status::Memory);
        assert_eq!(boresight_step(tracker, 9, odd.cast(), 1, null_mut()), Status::Memory);
        assert_eq!(boresight_step(tracker, 9, null(), 0, odd.cast()), Status::Memory);
        assert_eq!(boresight_tracks(tracker, odd.cast(), 1, &mut count), Status::Memory);
        assert_eq!(boresight_tracks(tracker, null_mut(), 0, odd.cast()), Status::Memory);
        assert_eq!(boresight_track_density(tracker, 1, odd.cast()), Status::Memory);
        assert_eq!(boresight_log_scan(tracker, place.0.as_mut_ptr(), size, odd.cast()), Status::Memory);
        // Nothing was taken in: the first time is still free.
        assert_eq!(boresight_step(tracker, 0, null(), 0, null_mut()), Status::Ok);
    }
}

fn header(kind: &'static Kind, parameters: &Parameters) -> Vec<u8> {
    let (mut bytes, mut length) = (vec![0; BORESIGHT_LOG_HEADER], 0);
    // SAFETY: all are valid.
    assert_eq!(unsafe { boresight_log_header(kind, parameters, bytes.as_mut_ptr(), bytes.len(), &mut length) }, Status::Ok);
    bytes.truncate(length);
    bytes
}

fn record(tracker: *mut Tracker) -> Result<Vec<u8>, Status> {
    let (mut bytes, mut length) = (vec![0; BORESIGHT_LOG_RECORD], 0);
    // SAFETY: all are valid.
    match unsafe { boresight_log_scan(tracker, bytes.as_mut_ptr(), bytes.len(), &mut length) } {
        Status::Ok => {
            bytes.truncate(length);
            Ok(bytes)
        }
        status => Err(status),
    }
}

/// The desk replays what Rust writes; so it replays what C writes, if the bytes are the same.
#[test]
fn a_log_written_by_c_is_that_of_rust() {
    let mut there = Vec::new();
    twin::record::run(&mut twin::record::Memory::new(), &mut [0; twin::record::MOST], |part| there.push(part.to_vec())).unwrap();
    let mut there = there.into_iter();
    let mut memory = memory();
    let tracker = create(&boresight_accelerating_ra, &mut memory);
    assert_eq!(Some(header(&boresight_accelerating_ra, &Parameters::accelerating())), there.next());
    assert_eq!(record(tracker), Err(Status::NoScan));
    let mut offer = |time_us: u64, plots: &[[f32; 2]]| {
        let detections: Vec<_> = plots.iter().map(|[r, a]| Detection { z: [*r, *a, 0.0, 0.0], ..Detection::default() }).collect();
        let (status, _) = step(tracker, time_us, &detections);
        assert_eq!(record(tracker).ok(), there.next());
        // One record a scan.
        assert_eq!(record(tracker), Err(Status::NoScan));
        status
    };
    for (k, plots) in SCANS.iter().enumerate().take(MOST_SCANS) {
        let now = k as u64 * PERIOD_US;
        assert_eq!(offer(now, plots), Status::Ok);
        match k {
            20 => assert_eq!(offer(now - 1000, plots), Status::ScanTimeReversed),
            40 => assert_eq!(offer(now + 1000, &[[f32::NAN, 0.0]]), Status::ScanDetectionNotFinite),
            _ => {}
        }
    }
    assert!(cfg!(miri) || there.next().is_none());
}

#[test]
fn what_a_log_leaves_out_can_be_told_from_it() {
    type Record = boresight::log::Record<4, 3, 2, 16, DETS>;
    let mut memory = memory();
    let tracker = create(&boresight_turning_ra, &mut memory);
    let crowd: Vec<Detection> =
        (0..40).map(|i| Detection { z: [5000.0 + 100.0 * i as f32, 1.0, 0.0, 0.0], ..Default::default() }).collect();
    let told = |bytes: Vec<u8>| Record::decode(&bytes).unwrap().0;
    assert_eq!(step(tracker, 0, &crowd).0, Status::Ok);
    let first = told(record(tracker).unwrap());
    assert_eq!((first.number, first.plots.as_slice().len(), first.dropped), (0, 32, 8));
    // Two scans without a record: the number says so.
    assert_eq!((step(tracker, PERIOD_US, &[]).0, step(tracker, 2 * PERIOD_US, &[]).0), (Status::Ok, Status::Ok));
    assert_eq!((step(tracker, 3 * PERIOD_US, &[]).0, told(record(tracker).unwrap()).number), (Status::Ok, 3));
    assert_eq!(step(tracker, 4 * PERIOD_US, &[]).0, Status::Ok);
    // Without room nothing is recorded, and the record can still be had.
    let mut length = 0;
    // SAFETY: all are valid.
    unsafe {
        let mut short = [0; 100];
        assert_eq!(boresight_log_scan(tracker, short.as_mut_ptr(), short.len(), &mut length), Status::Memory);
        assert_eq!(boresight_log_scan(tracker, null_mut(), 5000, &mut length), Status::Null);
        let kind: *const Kind = &boresight_turning_ra;
        assert_eq!(boresight_log_header(kind, &Parameters::turning(), short.as_mut_ptr(), short.len(), &mut length), Status::Memory);
    }
    assert_eq!(told(record(tracker).unwrap()).number, 4);
}

#[test]
fn a_copy_goes_on_like_the_original() {
    let (mut memory, mut copy) = (memory(), memory());
    let tracker = create(&boresight_accelerating_ra, &mut memory);
    (0..4).for_each(|k| assert_eq!(step(tracker, k as u64 * PERIOD_US, &detections(k)).0, Status::Ok));
    // SAFETY: both are as large; bytes that have no value are copied as they are.
    unsafe { (&raw mut *copy).copy_from_nonoverlapping(&raw const *memory, 1) };
    let other: *mut Tracker = (&raw mut *copy).cast();
    for tracker in [tracker, other] {
        assert_eq!(step(tracker, 4 * PERIOD_US, &detections(4)).0, Status::Ok);
    }
    assert_eq!(tracks(tracker), tracks(other));
    assert!(!tracks(other).is_empty());
}

#[test]
fn numbers_change_while_tracks_live_and_too_many_plots_are_counted() {
    let mut memory = memory();
    let tracker = create(&boresight_turning_ra, &mut memory);
    (0..4).for_each(|k| assert_eq!(step(tracker, k as u64 * PERIOD_US, &detections(k)).0, Status::Ok));
    let before = tracks(tracker);
    let blind = Parameters { p_detect: 0.0, ..defaults(&boresight_turning_ra) };
    // SAFETY: both are valid.
    assert_eq!(unsafe { boresight_configure(tracker, &blind) }, Status::Ok);
    assert_eq!(tracks(tracker), before);
    // A radar that sees nothing misses nothing: no track is deleted however often.
    (4..20).for_each(|k| assert_eq!(step(tracker, k * 10, &[]).0, Status::ScanTimeReversed));
    (4..20).for_each(|k| assert_eq!(step(tracker, k * PERIOD_US, &[]).1.tracks_deleted, 0));

    let crowd: Vec<Detection> =
        (0..40).map(|i| Detection { z: [5000.0 + 100.0 * i as f32, 1.0, 0.0, 0.0], ..Default::default() }).collect();
    let report = step(tracker, 20 * PERIOD_US, &crowd).1;
    assert_eq!((report.detections, report.detections_dropped), (32, 8));
    let mut count = 0;
    // SAFETY: no room is asked for.
    assert_eq!(unsafe { boresight_tracks(tracker, null_mut(), 0, &mut count) }, Status::Ok);
    assert_eq!(count, tracks(tracker).len());
}

#[test]
fn every_status_has_its_words() {
    // SAFETY: the text of a status is a static.
    let text = |status: u32| unsafe { core::ffi::CStr::from_ptr(boresight_text(status)) }.to_str().unwrap();
    assert_eq!(text(Status::ScanTimeReversed as u32), "the scan is older than the last one");
    assert_eq!(text(Status::Ok as u32), "done");
    assert_eq!((text(999), text(u32::MAX)), ("unknown status", "unknown status"));
}
