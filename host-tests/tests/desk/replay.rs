//! The command `replay` from plots to files: synthetic plots whose truth is known, and the recorded boats.
//!
//! A track is right where its position is within 4 σ of the truth by its own covariance, and at the end its velocity
//! too. The recordings are not part of the repository: `BORESIGHT_DATA` names their directory,
//! and without it the test says so and passes.

use host_tests::Precision;
use host_tests::replay::Request;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::{Value, json};
use std::error::Error;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

type Outcome = Result<(), Box<dyn Error>>;

/// Position at time zero \[m\] and velocity \[m/s\].
#[derive(Clone, Copy)]
struct Target {
    start: [f64; 3],
    velocity: [f64; 3],
}

impl Target {
    fn at(&self, t: f64) -> [f64; 3] {
        std::array::from_fn(|a| self.start[a] + t * self.velocity[a])
    }
}

/// Times of `count` scans, about 2 s apart \[us\].
fn times(count: usize, rng: &mut ChaCha8Rng) -> Vec<u64> {
    let mut now = 500_000;
    let step = |_| {
        now += rng.random_range(1_500_000..2_500_000);
        now
    };
    (0..count).map(step).collect()
}

fn noise(rng: &mut ChaCha8Rng, sigma: f64) -> f64 {
    let normal: f64 = StandardNormal.sample(rng);
    sigma * normal
}

fn replay(arguments: &[&str], dir: &Path) -> std::io::Result<Output> {
    Command::new(env!("CARGO_BIN_EXE_host-tests")).arg("replay").args(arguments).current_dir(dir).output()
}

fn read(file: &Path) -> Result<Value, Box<dyn Error>> {
    Ok(serde_json::from_str(&fs::read_to_string(file)?)?)
}

/// Runs `replay` over the file `name` holding `plots`, described by `config` if it says anything, and gives back the
/// tracks and the summary.
fn replayed(name: &str, plots: &str, config: &str, precision: &str) -> Result<(Value, Value), Box<dyn Error>> {
    let dir = tempfile::tempdir()?;
    let path = |name: &str| dir.path().join(name);
    fs::write(path(name), plots)?;
    fs::write(path("config.toml"), config)?;
    let mut arguments = vec![name, "--precision", precision, "--out", "out", "--json", "summary.json"];
    if !config.is_empty() {
        arguments.extend(["--config", "config.toml"]);
    }
    let output = replay(&arguments, dir.path())?;
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(fs::read_to_string(path("out/tracks.svg"))?.ends_with("</svg>\n"));
    assert_eq!(read(&path("summary.json"))?, read(&path("out/replay.json"))?);
    Ok((read(&path("out/tracks.json"))?, read(&path("summary.json"))?))
}

/// Every target has one confirmed track from scan `from` on, within 4 σ of it in at least nine of ten scans, and in
/// position and velocity at the end. No other track is confirmed in the last scan.
fn assert_tracked(tracks: &Value, targets: &[Target], times: &[u64], from: usize) -> Outcome {
    let states = tracks["states"].as_array().ok_or("no states")?;
    let index = |name: &str| states.iter().position(|state| state == name);
    let (axes, names) = if index("z").is_some() { (3, ["x", "y", "z"]) } else { (2, ["x", "y", "z"]) };
    let tracks = tracks["tracks"].as_array().ok_or("no tracks")?;
    let confirmed_at = |track: &Value, time: u64| -> Option<Value> {
        let points = track["points"].as_array()?;
        points.iter().find(|p| p["t_us"] == time && p["status"] != "tentative").cloned()
    };
    let near = |point: &Value, target: &Target, time: u64, rate: bool| {
        let (truth, prefix) = if rate { (target.velocity, "v") } else { (target.at(time as f64 * 1e-6), "") };
        (0..axes).all(|a| {
            let value = |list: &str| index(&format!("{prefix}{}", names[a])).and_then(|i| point[list][i].as_f64());
            value("mean").zip(value("std")).is_some_and(|(mean, std)| (mean - truth[a]).abs() < 4.0 * std)
        })
    };
    let last = *times.last().ok_or("no scans")?;
    for (number, target) in targets.iter().enumerate() {
        let held =
            |track: &&Value| confirmed_at(track, last).is_some_and(|p| near(&p, target, last, false) && near(&p, target, last, true));
        let track = tracks.iter().find(held).ok_or(format!("target {number} has no track at the end"))?;
        let on = times.iter().skip(from).filter(|time| confirmed_at(track, **time).is_some_and(|p| near(&p, target, **time, false)));
        let (on, of) = (on.count(), times.len() - from);
        assert!(10 * on >= 9 * of, "target {number}: on it in {on} of {of} scans");
    }
    let alive = tracks.iter().filter(|track| confirmed_at(track, last).is_some()).count();
    assert_eq!(alive, targets.len(), "confirmed at the end");
    Ok(())
}

#[test]
fn positions_in_clutter_become_tracks_without_any_description() -> Outcome {
    let targets = [
        Target { start: [-700.0, 300.0, 0.0], velocity: [8.0, 2.0, 0.0] },
        Target { start: [500.0, -600.0, 0.0], velocity: [-3.0, 9.0, 0.0] },
    ];
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let times = times(60, &mut rng);
    let mut plots = "t_us,sensor,x,y\n".to_owned();
    for time in &times {
        let mut rows = Vec::new();
        for target in targets {
            let [x, y, _] = target.at(*time as f64 * 1e-6);
            let seen = rng.random_bool(0.9);
            let plot = [x + noise(&mut rng, 6.0), y + noise(&mut rng, 6.0)];
            rows.extend(seen.then_some(plot));
        }
        for _ in 0..rng.random_range(0..10) {
            rows.push([rng.random_range(-1000.0..1000.0), rng.random_range(-1000.0..1000.0)]);
        }
        for [x, y] in &rows {
            writeln!(plots, "{time},radar,{x:.2},{y:.2}")?;
        }
        if rows.is_empty() {
            writeln!(plots, "{time},radar,,")?;
        }
    }
    let (tracks, summary) = replayed("plots.csv", &plots, "", "f32")?;
    assert_tracked(&tracks, &targets, &times, 12)?;
    assert_eq!((&summary["tracker"]["confirmed"], &summary["judgement"]), (&2.into(), &Value::Null));
    let (wide, _) = replayed("plots.csv", &plots, "", "f64")?;
    assert_tracked(&wide, &targets, &times, 12)
}

/// Plots of a radar at `origin` that measures range, azimuth, range rate and, with `elevation`, that too; every second
/// plot brings its own standard deviation of range. A direction finder at the coordinate origin helps.
fn polar_plots(
    targets: &[Target],
    times: &[u64],
    origin: [f64; 3],
    elevation: bool,
    rng: &mut ChaCha8Rng,
) -> Result<String, std::fmt::Error> {
    let mut plots = "t_us,sensor,range,azimuth,elevation,range_rate,sigma_range\n".to_owned();
    for (number, time) in times.iter().enumerate() {
        for target in targets {
            let p = target.at(*time as f64 * 1e-6);
            let d: [f64; 3] = std::array::from_fn(|a| p[a] - origin[a]);
            let range = d.iter().map(|d| d * d).sum::<f64>().sqrt();
            let rate = (0..3).map(|a| d[a] * target.velocity[a]).sum::<f64>() / range + noise(rng, 0.5);
            let azimuth = d[1].atan2(d[0]) + noise(rng, 0.003);
            let above = d[2].atan2(d[0].hypot(d[1])) + noise(rng, 0.003);
            let sigma = if number % 2 == 0 { 10.0 } else { 30.0 };
            let range = range + noise(rng, sigma);
            let own = if number % 2 == 0 { String::new() } else { sigma.to_string() };
            let above = if elevation { format!("{above:.6}") } else { String::new() };
            if rng.random_bool(0.95) {
                writeln!(plots, "{time},radar,{range:.3},{azimuth:.6},{above},{rate:.3},{own}")?;
            }
        }
        for target in targets {
            let [x, y, _] = target.at(*time as f64 * 1e-6);
            writeln!(plots, "{time},finder,,{:.6},,,", y.atan2(x) + noise(rng, 0.002))?;
        }
    }
    Ok(plots)
}

const SENSORS: &str = "
[sensors.radar]
position = [200.0, -100.0, 30.0]
sigma = { range = 10.0, azimuth = 0.003, elevation = 0.003, range_rate = 0.5 }
p_detect = 0.95
[sensors.finder]
sigma = { azimuth = 0.002 }
p_detect = 0.99
[tracker.life]
hits = 3
window = 4
";

const TURNING: &str = "
[tracker]
state = \"cv-2d\"
initiation = { max_speed = 150.0 }
[[tracker.modes]]
model = \"constant-velocity\"
acceleration_density = 0.1
[[tracker.modes]]
model = \"turn\"
turn_rate = 0.05
acceleration_std = 0.5
[[tracker.modes]]
model = \"turn\"
turn_rate = -0.05
acceleration_std = 0.5
";

const ACCELERATING: &str = "
[tracker]
state = \"ca-2d\"
gate = { threshold = 12 }
initiation = { max_speed = 150.0, acceleration_std = 2.0 }
[[tracker.modes]]
model = \"constant-velocity\"
acceleration_std = 0.1
[[tracker.modes]]
model = \"constant-acceleration\"
jerk_density = 0.01
[[tracker.modes]]
model = \"singer\"
time_constant = 10
acceleration_std = 2
";

const CLIMBING: &str = "
[tracker]
sensors = [\"radar\"]
initiation = { rule = \"one-point\", max_speed = 150.0 }
[[tracker.modes]]
model = \"constant-velocity\"
acceleration_density = 0.1
";

#[test]
fn any_planar_state_is_fed_by_sensors_of_different_dimension() -> Outcome {
    let targets = [
        Target { start: [9000.0, 4000.0, 0.0], velocity: [-100.0, 20.0, 0.0] },
        Target { start: [-3000.0, 8000.0, 0.0], velocity: [40.0, -60.0, 0.0] },
    ];
    for tracker in [TURNING, ACCELERATING] {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let times = times(40, &mut rng);
        let plots = polar_plots(&targets, &times, [200.0, -100.0, 30.0], false, &mut rng)?;
        for precision in ["f32", "f64"] {
            let (tracks, _) = replayed("plots.csv", &plots, &format!("{tracker}{SENSORS}"), precision)?;
            assert_tracked(&tracks, &targets, &times, 8)?;
        }
    }
    Ok(())
}

#[test]
fn height_is_tracked_where_it_is_measured() -> Outcome {
    let targets = [Target { start: [9000.0, 4000.0, 3000.0], velocity: [-100.0, 20.0, 5.0] }];
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let times = times(40, &mut rng);
    let plots = polar_plots(&targets, &times, [200.0, -100.0, 30.0], true, &mut rng)?;
    let (tracks, summary) = replayed("plots.csv", &plots, &format!("{CLIMBING}{SENSORS}"), "f32")?;
    assert_eq!(summary["tracker"]["plan"]["state"], "cv-3d");
    assert_tracked(&tracks, &targets, &times, 8)
}

#[test]
fn a_moving_sensor_is_where_it_says_and_the_truth_judges() -> Outcome {
    let targets = [Target { start: [100.0, 300.0, 0.0], velocity: [-5.0, -2.0, 0.0] }];
    let carrier = Target { start: [-400.0, 0.0, 0.0], velocity: [6.0, 3.0, 0.0] };
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let times = times(50, &mut rng);
    let scans: Vec<Value> = times
        .iter()
        .map(|time| {
            let t = *time as f64 * 1e-6;
            let ([x, y, _], [own_x, own_y, _]) = (targets[0].at(t), carrier.at(t));
            let z = [x - own_x + noise(&mut rng, 6.0), y - own_y + noise(&mut rng, 6.0)];
            json!({"t": t, "sensor": "radar", "own": [own_x, own_y], "z": [z], "truth": [{"id": 4, "p": [x, y]}]})
        })
        .collect();
    let (tracks, summary) = replayed("plots.json", &json!({"scans": scans}).to_string(), "", "f32")?;
    assert_tracked(&tracks, &targets, &times, 10)?;
    let judgement = &summary["judgement"];
    let target = &judgement["targets"][0];
    assert_eq!((&target["covered_fraction"], &target["identity_changes"]), (&1.0.into(), &0.into()));
    assert!(target["rmse"].as_f64().is_some_and(|rmse| rmse < 6.0), "{target}");
    assert_eq!((&judgement["gospa"]["n_false"], &judgement["false_tracks"]), (&0.0.into(), &0.into()));
    Ok(())
}

#[test]
fn both_boats_of_both_recordings_are_tracked() -> Outcome {
    let Some(data) = std::env::var_os("BORESIGHT_DATA").map(PathBuf::from) else {
        eprintln!("BORESIGHT_DATA is not set: the recorded boats are not replayed");
        return Ok(());
    };
    let dir = tempfile::tempdir()?;
    for name in ["autoferry_scenario2.json", "autoferry_scenario4.json"] {
        let plots = data.join(name);
        let output = replay(&[plots.to_str().ok_or("not UTF-8")?, "--json", name], dir.path())?;
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let judgement = &read(&dir.path().join(name))?["judgement"];
        let targets = judgement["targets"].as_array().ok_or("no targets")?;
        assert_eq!(targets.len(), 2, "{name}");
        for target in targets {
            assert!(target["covered_fraction"].as_f64().is_some_and(|fraction| fraction >= 0.8), "{name}: {target}");
            assert!(target["rmse"].as_f64().is_some_and(|rmse| rmse < 8.0), "{name}: {target}");
        }
    }
    Ok(())
}

#[test]
fn descriptions_that_make_no_sense_are_refused_in_one_line() -> Outcome {
    let dir = tempfile::tempdir()?;
    fs::write(dir.path().join("plots.csv"), "t_us,sensor,x,y\n0,radar,100,50\n2000000,radar,100,50\n")?;
    for (text, expected) in [
        ("[tracker]\nstate = \"cv-3d\"\n", "config.toml: sensor radar: measures no z, which the state \"cv-3d\" wants"),
        (
            "[sensors.radar]\nsigma = { azimuth = 57.3 }\n",
            "config.toml: sensors.radar: sigma.azimuth: 57.3 is more than half a turn; radians are wanted",
        ),
        ("[sensors.radar]\np_detect = 90\n", "config.toml: sensors.radar: p_detect: 90 is not above 0 and at most 1"),
        ("[sensors.radar]\np_detect = \"90 %\"\n", "config.toml, line 2: p_detect = \"90 %\": invalid type: string \"90 %\", expected f64"),
        ("[tracker]\njump = [[0.5, 0.75], [0.5, 0.5]]\n", "config.toml: tracker: jump[0]: sums to 1.25, not to 1"),
        ("[tracker.life]\nmisses = -1\n", "config.toml, line 2: misses = -1: "),
        (
            "[[tracker.modes]]\nmodel = \"singer\"\ntime_constant = 5\nacceleration_std = 1\n",
            "config.toml: tracker: modes[0]: model: wants the state \"ca-2d\"",
        ),
        ("[tracker]\nspeed = 3\n", "config.toml, line 2: speed = 3: unknown field `speed`"),
    ] {
        fs::write(dir.path().join("config.toml"), text)?;
        let output = replay(&["plots.csv", "--config", "config.toml", "--out", "out", "--json", "r.json"], dir.path())?;
        let told = String::from_utf8(output.stderr)?;
        assert_eq!((output.status.code(), told.lines().count()), (Some(2), 1), "{text}: {told}");
        assert!(told.contains(expected), "{text}: {told}");
        assert!(!dir.path().join("out").exists() && !dir.path().join("r.json").exists(), "{text} left something behind");
    }
    Ok(())
}

/// To replay `plots`, given as text, in a directory.
fn request(dir: &Path, plots: &str) -> std::io::Result<Request> {
    let file = dir.join("plots.csv");
    std::fs::write(&file, plots)?;
    Ok(Request { plots: file, config: None, precision: Precision::F32, out: Some(dir.join("out")), json: None })
}

#[test]
fn all_results_are_there_even_of_nothing() -> Outcome {
    let dir = tempfile::tempdir()?;
    host_tests::replay::run(&request(dir.path(), "t_us,sensor,range,azimuth\n0,radar,100,0.1\n0,radar,90,0.2\n2000000,radar,,\n")?)?;
    let text = |name: &str| std::fs::read_to_string(dir.path().join("out").join(name));
    let summary: Value = serde_json::from_str(&text("replay.json")?)?;
    assert_eq!(summary["sensors"], json!([{"name": "radar", "scans": 2, "detections": 2}]));
    assert_eq!((&summary["duration_s"], &summary["judgement"]), (&2.0.into(), &Value::Null));
    let tracks: Value = serde_json::from_str(&text("tracks.json")?)?;
    assert_eq!(tracks["tracks"], json!([]));
    assert_eq!(text("tracks.csv")?.lines().count(), 1);
    assert!(text("tracks.svg")?.starts_with("<svg") && text("scene.svg")?.starts_with("<svg"));
    Ok(())
}

#[test]
fn bad_plots_leave_nothing_behind() -> Outcome {
    let dir = tempfile::tempdir()?;
    for (plots, told) in [
        ("t_us,sensor,x,y\n0,radar,1,two\n", "line 2: column y"),
        ("t_us,sensor,range,azimuth\n0,radar,1,\n0,radar,1,1\n", "plots.csv: sensor radar: range,azimuth at t = 0 us"),
    ] {
        let request = request(dir.path(), plots)?;
        assert!(host_tests::replay::run(&request).is_err_and(|failure| failure.to_string().contains(told)), "{told}");
        assert!(!dir.path().join("out").exists());
    }
    Ok(())
}
