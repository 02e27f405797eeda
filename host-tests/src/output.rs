//! Output that is complete or not there at all.
//!
//! A file is written under a temporary name in its own directory, flushed to the disk and then
//! renamed over its target, so that a reader sees the old content or the new, never a part.
//! Targets are checked before a long run starts: finding out afterwards would cost the run.

use crate::Failure;
use serde::Serialize;
use std::fs;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Creates a directory for results, with its parents; one that exists is fine.
pub fn create_directory(dir: &Path) -> Result<(), Failure> {
    fs::create_dir_all(dir).map_err(|error| Failure::input(format!("cannot create the directory: {error}")).in_file(dir))
}

/// Whether `file` can become an output file: its directory exists, and the name is free or a file's.
pub fn check_target(file: &Path) -> Result<(), Failure> {
    let dir = directory_of(file);
    if !dir.is_dir() {
        return Err(Failure::input(format!("no directory {}", dir.display())).in_file(file));
    }
    match fs::metadata(file) {
        Ok(target) if !target.is_file() => Err(Failure::input("exists and is not a regular file").in_file(file)),
        _ if file.file_name().is_none() => Err(Failure::input("not a file name").in_file(file)),
        _ => Ok(()),
    }
}

/// Writes a whole file at once: after success it holds `content`, after failure what it held before.
pub fn write_file(file: &Path, content: &[u8]) -> Result<(), Failure> {
    check_target(file)?;
    // Renaming over a symbolic link would replace the link; its destination is what is meant.
    let target = fs::canonicalize(file).unwrap_or_else(|_| file.to_path_buf());
    replace(&target, content).map_err(|error| Failure::input(format!("cannot write: {error}")).in_file(file))
}

/// Writes `value` as indented JSON, ended by a newline.
pub fn write_json(file: &Path, value: &impl Serialize) -> Result<(), Failure> {
    let mut text =
        serde_json::to_vec_pretty(value).map_err(|error| Failure::input(format!("not expressible as JSON: {error}")).in_file(file))?;
    text.push(b'\n');
    write_file(file, &text)
}

/// Reads a whole text file; the failure names the file and whether it is missing, unreadable or not text.
pub fn read_text(file: &Path) -> Result<String, Failure> {
    fs::read_to_string(file).map_err(|error| unreadable(file, &error))
}

/// Reads a whole file of bytes; the failure names the file and whether it is missing or unreadable.
pub fn read_bytes(file: &Path) -> Result<Vec<u8>, Failure> {
    fs::read(file).map_err(|error| unreadable(file, &error))
}

fn unreadable(file: &Path, error: &std::io::Error) -> Failure {
    let reason = match error.kind() {
        ErrorKind::NotFound => "no such file".to_owned(),
        ErrorKind::IsADirectory => "is a directory, not a file".to_owned(),
        ErrorKind::InvalidData => "not UTF-8 text".to_owned(),
        _ => format!("cannot read: {error}"),
    };
    Failure::input(reason).in_file(file)
}

/// Prints to stdout. A reader that has seen enough (`| head`) is no failure.
pub fn print(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(Failure::input(format!("cannot write to stdout: {error}"))),
        _ => Ok(()),
    }
}

fn directory_of(file: &Path) -> PathBuf {
    match file.parent() {
        Some(dir) if !dir.as_os_str().is_empty() => dir.to_path_buf(),
        _ => PathBuf::from("."),
    }
}

fn replace(target: &Path, content: &[u8]) -> std::io::Result<()> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".host-tests-");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // Temporary files are private by default; results are ordinary files, subject to the umask.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let mut temporary = builder.tempfile_in(directory_of(target))?;
    temporary.write_all(content)?;
    temporary.as_file().sync_all()?;
    temporary.persist(target).map(drop).map_err(|error| error.error)
}

#[cfg(test)]
mod tests {
    use super::*;

    type Outcome = Result<(), Box<dyn std::error::Error>>;

    #[test]
    fn file_is_replaced_whole_and_nothing_else_is_left() -> Outcome {
        let dir = tempfile::tempdir()?;
        let file = dir.path().join("result.json");
        write_file(&file, b"old")?;
        write_json(&file, &serde_json::json!({"a": 1}))?;
        assert_eq!(fs::read_to_string(&file)?, "{\n  \"a\": 1\n}\n");
        assert_eq!(fs::read_dir(dir.path())?.count(), 1);
        Ok(())
    }

    #[test]
    fn unusable_targets_are_refused_by_name() -> Outcome {
        let dir = tempfile::tempdir()?;
        let lost = dir.path().join("nowhere/result.json");
        assert!(check_target(&lost).is_err_and(|f| f.to_string().contains("nowhere/result.json")));
        assert!(write_file(dir.path(), b"").is_err_and(|f| f.to_string().contains("regular file")));
        let occupied = dir.path().join("file");
        write_file(&occupied, b"")?;
        assert!(create_directory(&occupied).is_err());
        Ok(())
    }

    #[cfg(unix)]
    #[test]
    fn link_is_kept_and_its_destination_written() -> Outcome {
        let dir = tempfile::tempdir()?;
        let (real, link) = (dir.path().join("real"), dir.path().join("link"));
        write_file(&real, b"old")?;
        std::os::unix::fs::symlink(&real, &link)?;
        write_file(&link, b"new")?;
        assert_eq!(fs::read(&real)?, b"new");
        assert!(fs::symlink_metadata(&link)?.is_symlink());
        Ok(())
    }

    #[test]
    fn missing_input_is_named() {
        let failure = read_text(Path::new("no/such/plots.csv"));
        assert!(failure.is_err_and(|f| f.to_string() == "no/such/plots.csv: no such file"));
    }
}
