//! The `host-tests` binary: runs one command of [`host_tests::cli`] and maps its outcome to an exit status.
//!
//! Status 0: done; 1: a check failed; 2: bad usage or input. A failure is exactly one line on stderr.

use std::io::Write;
use std::process::ExitCode;

fn main() -> ExitCode {
    match host_tests::cli::execute(std::env::args_os()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            // With stderr closed there is nobody left to tell; the exit status still speaks.
            let _ = writeln!(std::io::stderr(), "error: {failure}");
            failure.exit_code()
        }
    }
}
