//! The commands of the desk: what they make of good and of bad input.
//!
//! | module | what |
//! |---|---|
//! | [`commands`] | exit status and the one line on stderr, files left behind |
//! | [`kashyap`] | a scenario in short form |
//! | [`metrics_cases`], [`reference_cases`] | `solve` against cases computed elsewhere |
//! | [`replay`], [`replay_log`] | plots and logs of targets, replayed |
//! | [`soak`] | trackers that live long |

mod commands;
mod kashyap;
mod metrics_cases;
mod reference_cases;
mod replay;
mod replay_log;
mod soak;
