//! Counts, in QEMU, what every call of chosen functions costs: instructions, estimated Cortex-M4 cycles, stack.
//!
//! ```text
//! instruction.rs   what the cycle model has to know of an instruction
//! calls.rs         from blocks of instructions as they run, to counts per call
//! plugin.rs        QEMU's plugin interface, and the only unsafe code
//! ```
//!
//! Loaded by `qemu-system-arm -plugin libcounter.so,out=FILE,call=NAME:ADDRESS,...` with the address of every function to be
//! counted. The file then holds one line a call, in the order of their ends, and one a function with the addresses where the
//! blocks of instructions begin that its calls ran:
//!
//! ```text
//! NAME instructions cycles stack
//! NAME code ADDRESS ...
//! ```
//!
//! A call lasts from the function's first instruction until its caller resumes; what it calls is included. Calls within a
//! counted call count with it.
//!
//! Instructions are exact and the same in every run. Cycles are an estimate by the tables of the Cortex-M4 Technical
//! Reference Manual, for memory without wait states, and have not been compared with silicon.

mod calls;
mod instruction;
#[cfg(not(test))]
mod plugin;
