//! The command line: `list`, `run`, `replay`, `replay-log`, `telemetry`, `soak`, `solve`, `twin`, `budget`, `compare`, `guide`.
//!
//! ```text
//! host-tests list
//! host-tests run SCENARIO [--runs N] [--seed BASE] [--filters "A,B"] [--precision f32|f64] [--out DIR] [--json FILE]
//! host-tests replay PLOTS [--config FILE.toml] [--precision f32|f64] [--out DIR] [--json FILE]
//! host-tests replay-log FILE
//! host-tests telemetry FILE
//! host-tests soak [--scans N] [--seed BASE]
//! host-tests solve IN.json OUT.json [--precision f32|f64]
//! host-tests twin [--check]                                (from the repository root)
//! host-tests budget [--check] [--only NAME]                (from the repository root)
//! host-tests compare [--check | --refresh] [--runs N] [--seed BASE] [--json FILE]   (from the repository root)
//! host-tests guide [--runs N]                              (from the repository root)
//! ```
//!
//! Exit status 0: done; 1: a check failed; 2: bad usage or input, told in one line.

use crate::{Failure, Precision, budget, compare, guide, output, replay, replay_log, scenario, soak, solve, telemetry, twin};
use clap::error::ErrorKind;
use clap::{Parser, Subcommand};
use std::ffi::OsString;
use std::path::PathBuf;

/// The desk side of boresight: published scenarios, recorded plots, reference cases.
#[derive(Debug, Parser)]
#[command(name = "host-tests")]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// List the scenarios and their filters
    List,
    /// Run a scenario by Monte Carlo and compare its filters
    Run {
        /// Name of the scenario, see `list`
        scenario: String,
        /// Number of runs (each scenario has its own default)
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
        runs: Option<u64>,
        /// Base seed: run i uses BASE + i
        #[arg(long, value_name = "BASE", default_value_t = 0)]
        seed: u64,
        /// Run only these filters, separated by commas
        #[arg(long, value_name = "A,B")]
        filters: Option<String>,
        /// Scalar type of the filters
        #[arg(long, value_enum, default_value_t = Precision::F32)]
        precision: Precision,
        /// Write pictures and results into this directory
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Write the results as JSON
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// Replay recorded plots (CSV or JSON)
    Replay {
        /// The recorded plots
        plots: PathBuf,
        /// Sensors and tracker, described in TOML
        #[arg(long, value_name = "FILE.toml")]
        config: Option<PathBuf>,
        /// Scalar type of the tracker
        #[arg(long, value_enum, default_value_t = Precision::F32)]
        precision: Precision,
        /// Write tracks, pictures and results into this directory
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Write the results as JSON
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// Replay a log that a target has written, to the same bits, beside double precision
    ReplayLog {
        /// The log
        file: PathBuf,
    },
    /// Print what a target has told of itself at work
    Telemetry {
        /// The records, one behind the other
        file: PathBuf,
    },
    /// Let the ready trackers live long, under faults of all kinds
    Soak {
        /// Scans that each of them lives for
        #[arg(long, value_name = "N", default_value_t = 1_000_000, value_parser = clap::value_parser!(u64).range(1000..))]
        scans: u64,
        /// Base seed: tracker i uses BASE + i
        #[arg(long, value_name = "BASE", default_value_t = 0)]
        seed: u64,
    },
    /// Make the data of the firmware example: scans, reference cases and the bits of their results
    Twin {
        /// Only check that they are current
        #[arg(long)]
        check: bool,
    },
    /// Count what trackers and kernels cost on the target, and publish it in the firmware example's README
    Budget {
        /// Only check that nothing has grown beyond what is published
        #[arg(long)]
        check: bool,
        /// Only trackers whose names contain this, and no kernels; publishes nothing
        #[arg(long, value_name = "NAME")]
        only: Option<String>,
    },
    /// Run every tracker on the same scenarios and write the page WHICH-TRACKER.md
    Compare {
        /// Only check that the page is that of its record and of the budget, and that the first run comes out as recorded
        #[arg(long, conflicts_with_all = ["refresh", "runs", "seed", "json"])]
        check: bool,
        /// Only make the page anew from its record and the budget
        #[arg(long, conflicts_with_all = ["runs", "seed", "json"])]
        refresh: bool,
        /// Number of runs of each scenario
        #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
        runs: u64,
        /// Base seed: run i uses BASE + i
        #[arg(long, value_name = "BASE", default_value_t = 0)]
        seed: u64,
        /// Write the results there as JSON, and leave the page as it is
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// Run the lessons of GUIDE.md and write their tables and pictures
    Guide {
        /// Number of runs of each setting
        #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..=100_000))]
        runs: u64,
    },
    /// Solve reference cases and write them with their results filled in
    Solve {
        /// The cases
        #[arg(value_name = "IN.json")]
        input: PathBuf,
        /// Where the solved cases go
        #[arg(value_name = "OUT.json")]
        output: PathBuf,
        /// Scalar type of the library's code
        #[arg(long, value_enum, default_value_t = Precision::F64)]
        precision: Precision,
    },
}

/// Parses the arguments (program name first) and carries the command out.
pub fn execute<A: Into<OsString> + Clone>(arguments: impl IntoIterator<Item = A>) -> Result<(), Failure> {
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(error) if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) => {
            return output::print(&error.to_string());
        }
        Err(error) => return Err(usage(&error)),
    };
    match cli.command {
        Command::List => scenario::list(scenario::SCENARIOS),
        Command::Run { scenario, runs, seed, filters, precision, out, json } => {
            scenario::run(scenario::SCENARIOS, &scenario::Request { scenario, runs, seed, filters, precision, out, json })
        }
        Command::Replay { plots, config, precision, out, json } => replay::run(&replay::Request { plots, config, precision, out, json }),
        Command::ReplayLog { file } => replay_log::run(&file),
        Command::Telemetry { file } => telemetry::run(&file),
        Command::Soak { scans, seed } => soak::run(scans, seed),
        Command::Twin { check } => twin::run(&PathBuf::from("."), check),
        Command::Budget { check, only } => budget::run(&PathBuf::from("."), &budget::Request { check, only }),
        Command::Compare { check: true, .. } => compare::check(&PathBuf::from(".")),
        Command::Compare { refresh: true, .. } => compare::refresh(&PathBuf::from(".")),
        Command::Compare { runs, seed, json, .. } => compare::run(&PathBuf::from("."), &compare::Request { runs, seed, json }),
        Command::Guide { runs } => guide::run(&PathBuf::from("."), runs),
        Command::Solve { input, output, precision } => solve::run(&input, &output, precision),
    }
}

/// A usage error in one line: the parser's first paragraph, which says what is wrong.
fn usage(error: &clap::Error) -> Failure {
    if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        return Failure::input("no command given; see --help");
    }
    let text = error.to_string();
    let first = text.split("\n\n").next().unwrap_or_default();
    Failure::input(format!("{}; see --help", first.trim_start_matches("error:").trim()))
}

#[cfg(test)]
mod tests {
    use super::*;

    // Only this: what calls the commands stands with the integration tests, or all trackers would be compiled once more for it.
    #[test]
    fn definition_is_sound() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }
}
