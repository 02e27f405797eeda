//! The binary as a script sees it: exit status, one line on stderr, nothing half-written.
//!
//! Status 0: done; 2: bad usage or input. Every failure below is bad input of one kind.

use host_tests::cli::execute;
use host_tests::error::Status;
use std::error::Error;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn host_tests(arguments: &[&str], dir: &Path) -> std::io::Result<Output> {
    Command::new(env!("CARGO_BIN_EXE_host-tests")).args(arguments).current_dir(dir).output()
}

#[test]
fn failures_are_one_line_and_status_2() -> Result<(), Box<dyn Error>> {
    let dir = tempfile::tempdir()?;
    let write = |name: &str, text: &[u8]| fs::write(dir.path().join(name), text);
    write("broken.json", b"{\"meta\": {\"file\": \"metrics\"}, \"cases\": [")?;
    write("strange.json", b"{\"meta\": {\"file\": \"cookery\"}, \"cases\": []}")?;
    write("short.json", b"{\"meta\": {\"file\": \"metrics\"}, \"cases\": [{\"name\": \"a\", \"dim\": 2}]}")?;
    write("late.csv", b"t_us,sensor,x,y\n5,r,1,2\n4,r,1,2\n")?;
    write("binary.csv", &[0xff, 0x00, 0xfe])?;
    write("ok.csv", b"t_us,sensor,x,y\n5,r,1,2\n")?;
    write("config.toml", b"[sensors.r]\nrange = 5\n")?;
    let cases: &[(&[&str], &str)] = &[
        (&[], "no command"),
        (&["dance"], "dance"),
        (&["run", "no-such-scenario"], "no-such-scenario"),
        (&["solve", "missing.json", "out.json"], "missing.json: no such file"),
        (&["solve", "broken.json", "out.json"], "broken.json, line 1"),
        (&["solve", "strange.json", "out.json"], "meta.file: unknown kind \"cookery\"; known: "),
        (&["solve", "short.json", "out.json"], "short.json: case a: X: missing"),
        (&["solve", "short.json", "nowhere/out.json"], "nowhere/out.json: no directory"),
        (&["replay", "missing.csv"], "missing.csv: no such file"),
        (&["replay", "late.csv", "--json", "out.json"], "late.csv, line 3: column t_us"),
        (&["replay", "binary.csv"], "binary.csv: not UTF-8 text"),
        (&["replay", "ok.csv", "--config", "config.toml", "--out", "out.json"], "config.toml, line 2"),
        (&["replay", "ok.csv", "--out", "ok.csv"], "ok.csv"),
        (&["replay-log"], "<FILE>"),
        (&["replay-log", "missing.log"], "missing.log: no such file"),
        (&["replay-log", "binary.csv"], "binary.csv: header: it ends early"),
        (&["replay-log", "ok.csv"], "ok.csv: header: it does not begin as it must"),
        (&["telemetry"], "<FILE>"),
        (&["telemetry", "binary.csv"], "binary.csv: no record of telemetry"),
        (&["compare"], "budget.toml: no such file"),
        (&["compare", "--check", "--runs", "3"], "cannot be used with"),
        (&["guide"], "GUIDE.md: no such file"),
        (&["soak", "--scans", "10"], "10 is not in 1000.."),
    ];
    for (arguments, expected) in cases {
        let output = host_tests(arguments, dir.path())?;
        let stderr = String::from_utf8(output.stderr)?;
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert_eq!(stderr.lines().count(), 1, "{arguments:?}: {stderr}");
        assert!(stderr.contains(expected), "{arguments:?}: {stderr}");
        assert!(output.stdout.is_empty(), "{arguments:?}");
        assert!(!dir.path().join("out.json").exists(), "{arguments:?} left something behind");
    }
    Ok(())
}

#[test]
fn help_and_list_succeed() -> Result<(), Box<dyn Error>> {
    let dir = tempfile::tempdir()?;
    for arguments in [["--help"], ["list"]] {
        let output = host_tests(&arguments, dir.path())?;
        assert_eq!(output.status.code(), Some(0), "{arguments:?}");
        assert!(output.stderr.is_empty(), "{arguments:?}");
    }
    Ok(())
}

#[test]
fn replay_writes_its_results() -> Result<(), Box<dyn Error>> {
    let dir = tempfile::tempdir()?;
    fs::write(dir.path().join("p.csv"), "t_us,sensor,x,y\n5,r,1,2\n5,r,3,4\n9,r,,\n")?;
    let output = host_tests(&["replay", "p.csv", "--out", "a/b", "--json", "r.json"], dir.path())?;
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(dir.path().join("a/b/tracks.svg").is_file());
    let result: serde_json::Value = serde_json::from_str(&fs::read_to_string(dir.path().join("r.json"))?)?;
    assert_eq!(result["sensors"][0], serde_json::json!({"name": "r", "scans": 2, "detections": 2}));
    Ok(())
}

/// What the arguments of `line` are refused for.
fn refusal(line: &str) -> Option<String> {
    let arguments = std::iter::once("host-tests").chain(line.split_whitespace());
    let failure = execute(arguments).err()?;
    assert_eq!(failure.status(), Status::Input, "{line}");
    Some(failure.to_string())
}

#[test]
fn usage_errors_are_one_line() {
    for line in [
        "",
        "fly",
        "run",
        "run kashyap-a --runs 0",
        "run kashyap-a --runs many",
        "solve a.json",
        "solve a.json b.json --precision f16",
        "list --nonsense",
        "replay",
        "run x --seed -1",
    ] {
        let told = refusal(line);
        assert!(told.as_ref().is_some_and(|m| !m.contains('\n') && m.ends_with("see --help")), "{line}: {told:?}");
    }
}

#[test]
fn usage_errors_name_what_is_wrong() {
    let of = |line| refusal(line).unwrap_or_default();
    assert!(of("fly").contains("'fly'"));
    assert!(of("run").contains("<SCENARIO>"));
    assert!(of("solve a b --precision f16").contains("[possible values: f32, f64]"));
}

#[test]
fn unknown_scenario_is_bad_usage() {
    assert!(refusal("run no-such-scenario").is_some_and(|m| m.contains("\"no-such-scenario\"")));
}
