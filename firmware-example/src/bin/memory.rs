//! Sizes of states on this target, for all capacities of the budget: a table to be read, not a program.

#![no_std]
#![no_main]

use boresight::association::{Gnn, Jpda, MergingJpda};
use boresight::tracker::{JointState, LmsState, State};
use core::panic::PanicInfo;
use cortex_m_rt::entry;

type Pdaf<const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize> = State<f32, NX, MODES, TRACKS, DETS>;
type Nearest<const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize> = JointState<f32, NX, MODES, TRACKS, DETS, Gnn>;
type Joint<const NODES: usize, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize> =
    JointState<f32, NX, MODES, TRACKS, DETS, Jpda<NODES>>;
type Merging<const NODES: usize, const PAIRS: usize, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize> =
    JointState<f32, NX, MODES, TRACKS, DETS, MergingJpda<NODES, PAIRS>>;
type Likely<const NODES: usize, const NX: usize, const MODES: usize, const TRACKS: usize, const DETS: usize> =
    LmsState<f32, NX, MODES, TRACKS, DETS, Jpda<NODES>>;

/// Bytes of a state with room for 4, 16 and 32 tracks and, in each of these rows, 8, 32 and 64 detections.
macro_rules! sizes {
    ($state:ident, $($parameter:literal),*) => {
        sizes!(@rows $state, [$($parameter),*], [4, 16, 32])
    };
    (@rows $state:ident, $parameters:tt, [$($tracks:literal),*]) => {
        [$(sizes!(@row $state, $parameters, $tracks)),*]
    };
    (@row $state:ident, [$($parameter:literal),*], $tracks:literal) => {
        [
            size_of::<$state<$($parameter,)* $tracks, 8>>() as u32,
            size_of::<$state<$($parameter,)* $tracks, 32>>() as u32,
            size_of::<$state<$($parameter,)* $tracks, 64>>() as u32,
        ]
    };
}

/// IMM-PDAF with 4 states in 3 modes, then with 6 in 2; IMM-JPDA with `Gnn` and 4 states in 3 modes; IMM-JPDA with 64 nodes and with
/// 256, each with 4 states in 3 modes, then with 6 in 2. Then IMM-JPDA and LMS-JPDA with 64 nodes and 4 states in 7 modes. Then IMM-JPDA with 256 nodes, four unresolved pairs and 4 states in 3 modes.
#[used]
#[unsafe(no_mangle)]
static STATES: [[[u32; 3]; 3]; 10] = [
    sizes!(Pdaf, 4, 3),
    sizes!(Pdaf, 6, 2),
    sizes!(Nearest, 4, 3),
    sizes!(Joint, 64, 4, 3),
    sizes!(Joint, 64, 6, 2),
    sizes!(Joint, 256, 4, 3),
    sizes!(Joint, 256, 6, 2),
    sizes!(Joint, 64, 4, 7),
    sizes!(Likely, 64, 4, 7),
    sizes!(Merging, 256, 4, 4, 3),
];

/// The picture of the image `fusion`: two sensors with 16 tracks each, 6 states in 2 modes.
#[used]
#[unsafe(no_mangle)]
static PICTURE: u32 = size_of::<twin::fusion::Picture>() as u32;

// 16 tracks, 32 detections and 3 modes of 6 states in 128 kB.
const _: () = assert!(size_of::<Joint<256, 6, 3, 16, 32>>() <= 128 * 1024);

#[entry]
fn main() -> ! {
    loop {
        cortex_m::asm::wfi();
    }
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    loop {
        cortex_m::asm::wfi();
    }
}
