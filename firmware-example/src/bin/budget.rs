//! Four kernels to be counted: cycles, instructions, stack and code of what a tracker spends its time on.
//!
//! `imm6_step`, `imm4_step`, `jpda_marginals` and `kf4_step` are exported by these names, for any tool that traces calls. They set
//! up nothing and only call the library; each is called once a scan, five scans. The inputs are those of the module
//! `twin::workloads`, and so are the references: the image ends with status 0 if every result agrees, otherwise with 1.
//!
//! Nothing here prints, and no panic is linked.

#![no_std]
#![no_main]

use boresight::association::{Associator, Completeness, Jpda, JpdaMemory};
use boresight::error::ConfigError;
use boresight::gaussian::Gaussian;
use boresight::scan::{Candidates, Detection};
use cortex_m_rt::entry;
use firmware_example::exit;
use nalgebra::SVector;
use twin::workloads::{self, DETS, Imm4, Imm6, Kf4, Matrix, TRACKS, Track, data};

const NODES: usize = 128;
const NUMBERS: [u16; 4] = [0, 1, 2, 3];
type Joint = JpdaMemory<f32, TRACKS, DETS, NODES>;

#[unsafe(no_mangle)]
#[inline(never)]
fn imm6_step(imm: &Imm6, track: &mut Track<6, 2>, plots: &[Detection<f32, 2>], candidates: Candidates<'_>) {
    imm.step(track, plots, candidates);
}

#[unsafe(no_mangle)]
#[inline(never)]
fn imm4_step(imm: &Imm4, track: &mut Track<4, 3>, plots: &[Detection<f32, 2>], candidates: Candidates<'_>) {
    imm.step(track, plots, candidates);
}

#[unsafe(no_mangle)]
#[inline(never)]
fn jpda_marginals(matrix: &mut Matrix, memory: &mut Joint) -> Completeness {
    Jpda::<NODES>::new().associate(matrix, memory)
}

#[unsafe(no_mangle)]
#[inline(never)]
fn kf4_step(filter: &Kf4, g: &mut Gaussian<f32, 4>, z: &SVector<f32, 2>) -> bool {
    filter.step(g, z)
}

#[entry]
fn main() -> ! {
    static mut TRACK6: Track<6, 2> = Track::new();
    static mut TRACK4: Track<4, 3> = Track::new();
    static mut MATRIX: Matrix = Matrix::new();
    static mut JOINT: Joint = <Jpda<NODES> as Associator<f32, TRACKS, DETS>>::MEMORY;
    let passed = filters(TRACK6, TRACK4) == Ok(true) && association(MATRIX, JOINT);
    exit(passed)
}

/// The three filters; whether all results agree.
fn filters(track6: &mut Track<6, 2>, track4: &mut Track<4, 3>) -> Result<bool, ConfigError> {
    let (imm6, imm4, kf4) = (Imm6::new()?, Imm4::new()?, Kf4::new()?);
    let mut passed = true;
    track6.start(&data::IMM6_START);
    for (plots, expected) in data::IMM6_PLOTS.iter().zip(&data::IMM6_EXPECTED) {
        let plots = plots.map(Detection::new);
        imm6_step(&imm6, track6, &plots, Candidates::new(&plots, &NUMBERS));
        passed &= track6.agrees(expected);
    }
    track4.start(&data::IMM4_START);
    for (plots, expected) in data::IMM4_PLOTS.iter().zip(&data::IMM4_EXPECTED) {
        let plots = plots.map(Detection::new);
        imm4_step(&imm4, track4, &plots, Candidates::new(&plots, &NUMBERS));
        passed &= track4.agrees(expected);
    }
    let mut g = data::IMM4_START.modes[0].gaussian();
    for ([z, ..], expected) in data::IMM4_PLOTS.iter().zip(&data::KF4_EXPECTED) {
        passed &= kf4_step(&kf4, &mut g, &SVector::from(*z)) && expected.agrees(&g);
    }
    Ok(passed)
}

/// The joint association, on fresh weights every time; whether all results agree.
fn association(matrix: &mut Matrix, memory: &mut Joint) -> bool {
    (0..data::IMM6_PLOTS.len()).fold(true, |passed, _| {
        workloads::weigh(matrix);
        passed & jpda_marginals(matrix, memory).is_exact() & workloads::marginals_agree(matrix)
    })
}

firmware_example::silent!();
