//! Labelled random finite sets, to be counted: 100 scans each of three forms of the jump-Markov GLMB.
//!
//! `step_linear`, `step_unscented` and `step_particles` are exported by these names, for any tool that traces calls. Scans and
//! forms are those of the module `twin::glmb`: the image ends with status 0 if the bits of all estimates are those of the desk,
//! otherwise with 1. As in `budget`, nothing here prints.

#![no_std]
#![no_main]

use boresight::error::ConfigError;
use boresight::scan::Scan;
use cortex_m_rt::entry;
use firmware_example::exit;
use twin::glmb::{self, Checksum, Linear, LinearForm, Points, PointsForm, Scans, Sigma, SigmaForm};

/// Bytes of the states, in this order
#[used]
#[unsafe(no_mangle)]
static STATES: [u32; 3] = [size_of::<Linear>() as u32, size_of::<Sigma>() as u32, size_of::<Points>() as u32];

const _: () = assert!(size_of::<Linear>() <= 96 * 1024, "the linear form needs more memory than it may");

#[unsafe(no_mangle)]
#[inline(never)]
fn step_linear(form: &mut LinearForm, state: &mut Linear, scan: &Scan<'_, f32, 2>) -> bool {
    form.step(state, scan)
}

#[unsafe(no_mangle)]
#[inline(never)]
fn step_unscented(form: &mut SigmaForm, state: &mut Sigma, scan: &Scan<'_, f32, 2>) -> bool {
    form.step(state, scan)
}

#[unsafe(no_mangle)]
#[inline(never)]
fn step_particles(form: &mut PointsForm, state: &mut Points, scan: &Scan<'_, f32, 2>) -> bool {
    form.step(state, scan)
}

#[entry]
fn main() -> ! {
    static mut LINEAR: Linear = Linear::new();
    static mut SIGMA: Sigma = Sigma::new();
    static mut POINTS: Points = Points::new();
    exit(run(LINEAR, SIGMA, POINTS) == Ok(true))
}

fn run(linear: &mut Linear, sigma: &mut Sigma, points: &mut Points) -> Result<bool, ConfigError> {
    let (mut sums, mut passed) = ([Checksum::default(); 3], true);
    let (mut form, mut scans) = (glmb::linear()?, Scans::new());
    while let Some(scan) = scans.next(false) {
        passed &= step_linear(&mut form, linear, &scan);
        sums[0].add(linear);
    }
    let (mut form, mut scans) = (glmb::unscented()?, Scans::new());
    while let Some(scan) = scans.next(true) {
        passed &= step_unscented(&mut form, sigma, &scan);
        sums[1].add(sigma);
    }
    let (mut form, mut scans) = (glmb::particles()?, Scans::new());
    while let Some(scan) = scans.next(true) {
        passed &= step_particles(&mut form, points, &scan);
        sums[2].add(points);
    }
    Ok(passed && sums == glmb::CHECKSUMS)
}

firmware_example::silent!();
