//! [`Failure`]: the one error of the desk side, a single line plus an exit status.
//!
//! The line reads from the outside in, separated by colons:
//!
//! ```text
//! plots.csv, line 12: column t_us: "1.5" is not a whole number of microseconds
//! kf.json: case cv_4: steps[3].z[1]: a string where a number belongs
//! ```
//!
//! Code that finds a fault knows only the fault; each caller on the way out adds what it knows with
//! [`Failure::within`] or [`Failure::in_file`]. Exit status: 2 for bad usage or input, 1 for a failed check.

use std::fmt::Display;
use std::path::Path;
use std::process::ExitCode;

/// Most characters of a message.
const LONGEST: usize = 1000;

/// What went wrong, in one line, and the exit status it ends the program with.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct Failure {
    message: String,
    status: Status,
}

/// The two kinds of failure that a script calling the harness must tell apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Status {
    /// A check that the command was asked to make does not hold.
    Check = 1,
    /// The command line or an input file is not usable.
    Input = 2,
}

impl Failure {
    /// Bad usage or input (exit status 2): `reason` says what is wrong, the callers add where.
    pub fn input(reason: impl Display) -> Self {
        Self::new(Status::Input, reason)
    }

    /// A check that does not hold (exit status 1).
    pub fn check(reason: impl Display) -> Self {
        Self::new(Status::Check, reason)
    }

    /// Bad input in the named field, column or key.
    pub fn at_field(field: impl Display, reason: impl Display) -> Self {
        Self::input(reason).within(field)
    }

    /// Bad input on a line (counted from 1) of a file.
    pub fn at_line(file: &Path, line: u64, reason: impl Display) -> Self {
        Self::input(reason).on_line(file, line)
    }

    /// A name that is not among `known`: names all that are, so that the reader can pick one.
    pub fn unknown<'a>(what: &str, name: &str, known: impl IntoIterator<Item = &'a str>) -> Self {
        let known: Vec<_> = known.into_iter().collect();
        match known.as_slice() {
            [] => Self::input(format!("unknown {what} \"{name}\"; there is none yet")),
            names => Self::input(format!("unknown {what} \"{name}\"; known: {}", names.join(", "))),
        }
    }

    /// The same failure, seen from the part it is contained in.
    #[must_use]
    pub fn within(self, place: impl Display) -> Self {
        Self::new(self.status, format!("{place}: {}", self.message))
    }

    /// The same failure, seen from the file it is contained in.
    #[must_use]
    pub fn in_file(self, file: &Path) -> Self {
        self.within(file.display())
    }

    /// The same failure, seen from the line (counted from 1) of the file it is contained in.
    #[must_use]
    pub fn on_line(self, file: &Path, line: u64) -> Self {
        self.within(format!("{}, line {line}", file.display()))
    }

    /// Which kind of failure this is.
    #[must_use]
    pub fn status(&self) -> Status {
        self.status
    }

    /// The exit status of a program that ends with this failure.
    #[must_use]
    pub fn exit_code(&self) -> ExitCode {
        ExitCode::from(self.status as u8)
    }

    /// The only constructor: folds every run of white space, so that a message is one line
    /// whatever a parser or a file name put into it.
    fn new(status: Status, message: impl Display) -> Self {
        let message = message.to_string();
        let words: Vec<_> = message.split(|c: char| c.is_whitespace() || c.is_control()).filter(|word| !word.is_empty()).collect();
        let mut message = words.join(" ");
        // A binary file taken for a table has "names" of any length.
        if let Some((end, _)) = message.char_indices().nth(LONGEST) {
            message.truncate(end);
            message.push_str(" ..");
        }
        Self { message, status }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn message_grows_outwards_and_keeps_its_status() {
        let failure = Failure::at_field("z[1]", "not a number").within("case cv_4").in_file(Path::new("kf.json"));
        assert_eq!(failure.to_string(), "kf.json: case cv_4: z[1]: not a number");
        assert_eq!(failure.status(), Status::Input);
        assert_eq!(Failure::check("too many lost").within("kashyap-a").status(), Status::Check);
    }

    #[test]
    fn message_is_one_line() {
        let failure = Failure::at_line(Path::new("a\nb.csv"), 3, "first\n\n  second\u{1b}[1m");
        assert_eq!(failure.to_string(), "a b.csv, line 3: first second [1m");
    }

    #[test]
    fn message_has_an_end() {
        let failure = Failure::input("ä".repeat(5000));
        assert_eq!(failure.to_string().chars().count(), LONGEST + 3);
    }

    #[test]
    fn unknown_name_lists_the_known_ones() {
        let failure = Failure::unknown("filter", "KF", ["NN CV", "NN CA"]);
        assert_eq!(failure.to_string(), "unknown filter \"KF\"; known: NN CV, NN CA");
    }
}
