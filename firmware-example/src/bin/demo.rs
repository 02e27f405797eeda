//! Recorded radar scans through IMM-JPDAF on the microcontroller: frames in over SPI, tracks out over defmt. Then the same scans
//! through LMS-JPDAF, which has seven modes and runs the likely ones. Then two aircraft that meet and are one plot for a while, through
//! the coupled filter and through an IMM-JPDAF that pairs them; and scans of another radar through a jump-Markov GLMB, to the bits of
//! the desk.
//!
//! `cargo run --release --bin demo` runs it in QEMU and decodes the log. The tracker's configuration and scans are those of the
//! crate `twin`, so the desk can compute the same; the radar on the bus is its `simulated` one, which now and then makes a mistake.

#![no_std]
#![no_main]

use boresight::link::{Link, LinkError};
use boresight::telemetry::Telemetry;
use boresight::track::Status;
use cortex_m_rt::entry;
use defmt_semihosting as _;
use twin::coupled::{self, Meeting, Memory, Pairs, Tracks};
use twin::glmb::{self, CHECKSUMS, Checksum, Linear, Scans};
use twin::radar::{self, DETS, LikelyState, State, TRACKS};
use twin::simulated::Radar;

type Wire = Link<Radar, 2, DETS>;

#[entry]
fn main() -> ! {
    // The entry attribute makes this a static and hands out the one reference to it: all zero bits, so .bss.
    static mut STATE: State = State::new();
    static mut LIKELY: LikelyState = LikelyState::new();
    static mut COUPLED: Memory = Memory::new();
    static mut PAIRED: Tracks = Tracks::new();
    static mut SETS: Linear = Linear::new();
    static mut BUFFER: [u8; Wire::FRAME] = [0; Wire::FRAME];
    defmt::info!("boresight demo: {=usize} scans, state of {=usize} bytes", radar::scans(), size_of::<State>());
    let mut all = || -> Result<_, twin::Fault> {
        Ok([track(STATE, BUFFER)?, track_by_turns(LIKELY)?, track_as_one(COUPLED, PAIRED)?, track_sets(SETS)?])
    };
    let passed = match all() {
        Ok(confirmed) => confirmed.iter().all(|tracks| *tracks > 0),
        Err(fault) => {
            defmt::error!("{}", defmt::Debug2Format(&fault));
            false
        }
    };
    firmware_example::exit(passed)
}

/// Fetches scans until the radar is silent; returns the number of confirmed tracks at the end.
fn track(state: &mut State, buffer: &mut [u8]) -> Result<usize, twin::Fault> {
    let (tracker, sensor) = (radar::tracker()?, radar::sensor::<3>()?);
    let mut link = Wire::new(Radar::default());
    loop {
        let scan = match link.poll(buffer) {
            Ok(scan) => scan,
            Err(LinkError::Empty) => break,
            Err(error) => {
                defmt::warn!("{}", error);
                continue;
            }
        };
        let seconds = scan.time.as_micros() / 1_000_000;
        let report = tracker.step(state, &sensor, &scan)?;
        // The instructions of a scan are counted from outside, see the README: no cost is told here.
        let told = Telemetry::<TRACKS>::new(scan.time, 0, report, tracker.layout(), state.estimates());
        defmt::debug!("{}", told);
        for estimate in state.estimates().filter(|e| e.status != Status::Tentative) {
            let x = &estimate.state.mean;
            defmt::info!(
                "{=u64} s  {}  {}  position ({=f32}, {=f32}) m  velocity ({=f32}, {=f32}) m/s",
                seconds,
                estimate.id,
                estimate.status,
                x[0],
                x[3],
                x[1],
                x[4]
            );
        }
    }
    defmt::info!("{}", link.counts());
    Ok(state.estimates().filter(|e| e.status != Status::Tentative).count())
}

/// The same scans with seven turns for modes; returns the number of confirmed tracks at the end.
fn track_by_turns(state: &mut LikelyState) -> Result<usize, twin::Fault> {
    let (tracker, sensor) = (radar::likely_tracker()?, radar::sensor::<2>()?);
    let (mut tracks, mut modes) = (0, 0);
    for k in 0..radar::scans() {
        radar::step(&tracker, &sensor, state, k)?;
        for track in state.tracks() {
            (tracks, modes) = (tracks + 1, modes + track.active().len());
        }
    }
    let confirmed = state.tracks().filter(|track| track.status() != Status::Tentative).count();
    let run = modes as f32 / tracks.max(1) as f32;
    defmt::info!(
        "of seven turns: {=usize} tracks, {=f32} modes run each, state of {=usize} bytes",
        confirmed,
        run,
        size_of::<LikelyState>()
    );
    Ok(confirmed)
}

/// Two aircraft that are one plot while they meet; returns the number of tracks that both trackers have at the end.
fn track_as_one(coupled: &mut Memory, paired: &mut Tracks) -> Result<usize, twin::Fault> {
    let (meeting, pairs) = (Meeting::new()?, Pairs::new()?);
    let mut started = meeting.start(coupled) && pairs.start(paired);
    for k in 1..=coupled::SCANS {
        for sensor in 0..2 {
            meeting.step(coupled, sensor, k, &coupled::plots(sensor, k))?;
        }
        pairs.step(paired, k)?;
        let y = |state: Option<f32>| state.unwrap_or(f32::NAN);
        let (mut both, mut each) = (coupled.estimates().map(|e| e.state.mean[3]), paired.estimates().map(|e| e.state.mean[3]));
        defmt::info!(
            "{=usize} s  one plot with probability {=f32}, y of both {=f32} and {=f32} m; paired {=bool}, y {=f32} and {=f32} m",
            k,
            coupled.unresolved_probability(),
            y(both.next()),
            y(both.next()),
            paired.tracks().any(|track| track.is_unresolved()),
            y(each.next()),
            y(each.next())
        );
        started &= coupled.bank().is_some();
    }
    defmt::info!("coupled filter of {=usize} bytes, tracker of pairs of {=usize}", size_of::<Memory>(), size_of::<Tracks>());
    Ok(if started { paired.estimates().count() } else { 0 })
}

/// Three targets that come, turn and go in heavy clutter, as a labelled set; returns how many there are in the end, none where the
/// estimates are not those of the desk.
fn track_sets(state: &mut Linear) -> Result<usize, twin::Fault> {
    let (mut form, mut scans) = (glmb::linear()?, Scans::new());
    let (mut sum, mut targets) = (Checksum::default(), 0);
    while let Some(scan) = scans.next(false) {
        let (seconds, plots) = (scan.time.as_micros() / 1_000_000, scan.detections.len());
        form.step(state, &scan);
        sum.add(state);
        let now = state.estimates::<4, 3>().count();
        if now != targets {
            let hypotheses = state.hypotheses().count();
            defmt::info!("{=u64} s  {=usize} targets in {=usize} plots, {=usize} hypotheses", seconds, now, plots, hypotheses);
        }
        targets = now;
    }
    for target in state.estimates::<4, 3>() {
        let x = &target.state.mean;
        defmt::info!(
            "{}  exists with {=f32}  flies straight with {=f32}  position ({=f32}, {=f32}) m",
            target.label,
            target.existence,
            target.modes[0],
            x[0],
            x[2]
        );
    }
    let same = sum == CHECKSUMS[0];
    defmt::info!("labelled sets: the bits of the desk: {=bool}, state of {=usize} bytes", same, size_of::<Linear>());
    Ok(if same { targets } else { 0 })
}

firmware_example::reporting!();
