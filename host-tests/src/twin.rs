//! The command `twin`: makes the data of the firmware example, or checks that they are current.
//!
//! Three things go into `firmware-example/twin/src/data.rs`: simulated radar scans, the inputs of some reference cases,
//! and the bits that the library gives for all of them here, in single precision. The self-test on the target
//! computes them again and compares.
//!
//! The scans: four targets for 60 scans of 1 s, P_D, noise and clutter as the tracker of the example assumes.
//!
//! ```text
//! target 1   from (9, 3) km at (-200, 60) m/s; turns right at 0.08 rad/s during 20..35 s
//! target 2   from (-4, 8) km at (150, -120) m/s; accelerates by 8 m/s² along its flight during 25..40 s
//! target 3   from (-6, 6) km at (200, 0) m/s
//! target 4   from (-6, 6.6) km at (200, -20) m/s: crosses the path of 3 beside it, within 100 m during 25..35 s
//! clutter    Poisson in range 1..12 km, azimuth of the whole turn
//! ```

use crate::solve::field::Field;
use crate::{Failure, monte_carlo, output};
use rand::RngExt;
use rand_distr::{Distribution, Poisson, StandardNormal};
use std::fmt::Write;
use std::path::Path;
use twin::{Label, Sink, radar};

const SCANS: usize = 60;
const SEED: u64 = 3_000_000;
const RANGES: [f64; 2] = [1_000.0, 12_000.0];
/// Expected false plots of a scan.
const CLUTTER: f64 = 6.0;

/// Writes the data, or with `check` fails where they differ from what would be written.
pub fn run(root: &Path, check: bool) -> Result<(), Failure> {
    let file = root.join("firmware-example/twin/src/data.rs");
    let cases = root.join("host-tests/cases");
    let mut text = inputs(&cases)?;
    // The expected bits belong to the scans compiled in: after a change of these, run the command once more.
    let mut bits = Bits::default();
    twin::run(&mut bits, &mut Box::default()).map_err(|fault| Failure::input(format!("{fault:?}")))?;
    let _ = writeln!(text, "\n/// The bits of all results, in order.\npub static EXPECTED: [u32; {}] = [", bits.0.len());
    for line in bits.0.chunks(8) {
        let line: Vec<String> = line.iter().map(|b| format!("{b:#010x}")).collect();
        let _ = writeln!(text, "    {},", line.join(", "));
    }
    text.push_str("];\n");
    let committed = std::fs::read_to_string(&file).unwrap_or_default();
    match (check, committed == text) {
        (_, true) => output::print("twin data are current\n"),
        (true, false) => Err(Failure::check(format!("{}: not what this library gives; run `twin`", file.display()))),
        (false, false) => {
            output::write_file(&file, text.as_bytes())?;
            output::print("twin data written; if scans or cases changed, run once more for the expected bits\n")
        }
    }
}

/// Collects the bits of all results.
#[derive(Default)]
struct Bits(Vec<u32>);

impl Sink for Bits {
    fn take(&mut self, _: Label, value: f32) {
        self.0.push(value.to_bits());
    }
}

fn inputs(cases: &Path) -> Result<String, Failure> {
    let mut text = String::from(
        "//! Written by `cargo run --release -p host-tests -- twin`: scans, reference cases and the bits of their results.\n\n\
         use crate::kernels::{Nonlinear, Switching};\n\n",
    );
    let _ = writeln!(text, "/// Time between scans in milliseconds\npub const PERIOD_MILLIS: u64 = 1000;\n");
    let _ = writeln!(text, "/// Plots of every scan: range in metres, azimuth in radians\npub static SCANS: [&[[f32; 2]]; {SCANS}] = [");
    for scan in simulate() {
        let _ = writeln!(text, "    &{scan:?},");
    }
    let _ = writeln!(text, "];\n");
    nonlinear(&mut text, cases, "EKF_TURN", "ekf.json", "ct_unknown_rate_n5")?;
    nonlinear(&mut text, cases, "EKF_SPACE", "ekf.json", "range_az_n9")?;
    nonlinear(&mut text, cases, "UKF_PLANE", "ukf.json", "range_bearing_n4")?;
    switching(&mut text, cases)?;
    Ok(text)
}

fn simulate() -> Vec<Vec<[f32; 2]>> {
    let mut rng = monte_carlo::streams(SEED, 0).data;
    let mut targets = [
        [9_000.0, -200.0, 3_000.0, 60.0],
        [-4_000.0, 150.0, 8_000.0, -120.0f64],
        [-6_000.0, 200.0, 6_000.0, 0.0],
        [-6_000.0, 200.0, 6_600.0, -20.0],
    ];
    let mut scans = Vec::with_capacity(SCANS);
    for k in 0..SCANS {
        let mut plots = Vec::new();
        for [x, _, y, _] in targets {
            let noise: [f64; 2] = [StandardNormal.sample(&mut rng), StandardNormal.sample(&mut rng)];
            let range = x.hypot(y) + f64::from(radar::SIGMA_RANGE) * noise[0];
            let azimuth = y.atan2(x) + f64::from(radar::SIGMA_AZIMUTH) * noise[1];
            if rng.random_bool(radar::P_DETECT.into()) {
                plots.push([range, azimuth]);
            }
        }
        let count = Poisson::new(CLUTTER).map_or(0.0, |p| p.sample(&mut rng)) as usize;
        for _ in 0..count {
            plots.push([rng.random_range(RANGES[0]..RANGES[1]), rng.random_range(-std::f64::consts::PI..std::f64::consts::PI)]);
        }
        plots.sort_by(|a, b| a[1].total_cmp(&b[1]));
        scans.push(plots.iter().map(|p| p.map(|v| v as f32)).collect());
        if (20..35).contains(&k) {
            let (sin, cos) = (-0.08f64).sin_cos();
            let [_, vx, _, vy] = targets[0];
            (targets[0][1], targets[0][3]) = (cos * vx - sin * vy, sin * vx + cos * vy);
        }
        if (25..40).contains(&k) {
            let speed = targets[1][1].hypot(targets[1][3]);
            let faster = 1.0 + 8.0 / speed;
            (targets[1][1], targets[1][3]) = (targets[1][1] * faster, targets[1][3] * faster);
        }
        for target in &mut targets {
            target[0] += target[1];
            target[2] += target[3];
        }
    }
    scans
}

/// One case of a file in `cases`, handed to `write`.
fn with_case<R>(cases: &Path, file: &str, name: &str, write: impl FnOnce(&Field<'_>) -> Result<R, Failure>) -> Result<R, Failure> {
    let path = cases.join(file);
    let value: serde_json::Value = serde_json::from_str(&output::read_text(&path)?).map_err(|e| Failure::input(e).in_file(&path))?;
    let root = Field::root(&value, "");
    let list = root.get("cases")?;
    let items = list.items()?;
    let mut found = items.iter().filter(|case| case.value()["name"].as_str() == Some(name));
    let case = found.next().ok_or_else(|| Failure::input(format!("no case {name}")).in_file(&path))?;
    write(case).map_err(|failure| failure.in_file(&path))
}

fn nonlinear(text: &mut String, cases: &Path, constant: &str, file: &str, name: &str) -> Result<(), Failure> {
    with_case(cases, file, name, |case| {
        let n = case.get("n")?.count()?;
        let rows = |key: &str| -> Result<Vec<Vec<f32>>, Failure> {
            case.find(key)?.map_or_else(|| Ok(vec![vec![0.0; n]; n]), |field| field.rows())
        };
        let _ = writeln!(text, "/// The case {name} of {file}\npub static {constant}: Nonlinear<{n}> = Nonlinear {{");
        let _ = writeln!(text, "    dt: {:?},\n    f: {:?},\n    q: {:?},", case.get("T")?.number::<f32>()?, rows("F")?, rows("Q")?);
        let _ = writeln!(
            text,
            "    r: {:?},\n    x0: {:?},\n    p0: {:?},\n    z: &[",
            rows("R")?,
            case.get("x0")?.numbers::<f32>()?,
            rows("P0")?
        );
        for step in case.get("steps")?.items()? {
            let z = step.find("z")?.map(|z| z.numbers::<f32>()).transpose()?;
            let _ = writeln!(text, "        {z:?},");
        }
        let _ = writeln!(text, "    ],\n}};\n");
        Ok(())
    })
}

fn switching(text: &mut String, cases: &Path) -> Result<(), Failure> {
    let (file, name) = ("immpdaf.json", "two_models_parametric_Pd0.7");
    with_case(cases, file, name, |case| {
        let (n, r) = (case.get("n")?.count()?, case.get("n_models")?.count()?);
        let rows = |key: &str| case.get(key)?.rows::<f32>();
        let list = |key: &str| -> Result<Vec<Vec<Vec<f32>>>, Failure> { case.get(key)?.items()?.iter().map(|m| m.rows()).collect() };
        let vector = |key: &str| case.get(key)?.numbers::<f32>();
        let number = |key: &str| case.get(key)?.number::<f32>();
        let _ = writeln!(text, "/// The case {name} of {file}\npub static IMM_PDAF: Switching<{n}, {r}> = Switching {{");
        let _ = writeln!(text, "    f: {:?},\n    q: {:?},\n    h: {:?},\n    r: {:?},", list("F")?, list("Q")?, rows("H")?, rows("R")?);
        let _ = writeln!(
            text,
            "    jump: {:?},\n    prob: {:?},\n    x0: {:?},\n    p0: {:?},",
            rows("pi")?,
            vector("mu0")?,
            vector("x0")?,
            rows("P0")?
        );
        let _ = writeln!(
            text,
            "    threshold: {:?},\n    p_detect: {:?},\n    density: {:?},\n    plots: &[",
            number("gamma")?,
            number("Pd")?,
            number("lam")?
        );
        for step in case.get("steps")?.items()? {
            let _ = writeln!(text, "        &{:?},", step.get("z")?.rows::<f32>()?);
        }
        let _ = writeln!(text, "    ],\n}};");
        Ok(())
    })
}
