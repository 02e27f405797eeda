//! Recorded plots as CSV: a header, then one detection a row.
//!
//! | column | holds |
//! |---|---|
//! | `t_us` | time in integer microseconds, never decreasing |
//! | `sensor` | name of the sensor |
//! | `x`, `y` and perhaps `z`; or any of `range`, `azimuth`, `elevation`, `range_rate` | the detection (m, rad, m/s), see [`super::recording`] |
//! | `amplitude` | strength, optional |
//! | `sigma_x`, `sigma_range`, .. | standard deviation of that component for this detection, optional, > 0 |
//!
//! Consecutive rows with the same time and sensor are one scan. A scan without detections is one row
//! with nothing but time and sensor. A sensor that does not measure a polar component leaves it empty.

use super::recording::{Component, Frame, Plot, Recording, ScanRecord};
use crate::Failure;
use ::csv::{Position, ReaderBuilder, StringRecord};
use std::path::Path;

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Column {
    Time,
    Sensor,
    Amplitude,
    Value(Component),
    Sigma(Component),
}

impl Column {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "t_us" => Self::Time,
            "sensor" => Self::Sensor,
            "amplitude" => Self::Amplitude,
            _ => match name.strip_prefix("sigma_") {
                Some(component) => Self::Sigma(Component::named(component)?),
                None => Self::Value(Component::named(name)?),
            },
        })
    }
}

/// Reads the text of `file`.
pub(super) fn parse(file: &Path, text: &str) -> Result<Recording, Failure> {
    let text = text.trim_start_matches('\u{feff}');
    let mut reader = ReaderBuilder::new().trim(::csv::Trim::All).from_reader(text.as_bytes());
    let broken = |error: ::csv::Error| Failure::at_line(file, line_number(text, error.position()), parser_reason(&error));
    let header = reader.headers().map_err(broken)?.clone();
    let columns = columns(&header).map_err(|failure| failure.on_line(file, 1))?;
    let mut scans: Vec<ScanRecord> = Vec::new();
    for record in reader.records() {
        let record = record.map_err(broken)?;
        add_row(&mut scans, &columns, &record).map_err(|failure| failure.on_line(file, line_number(text, record.position())))?;
    }
    match scans.is_empty() {
        true => Err(Failure::input("no scans").in_file(file)),
        false => Ok(Recording { frame: Frame::XRight, scans }),
    }
}

/// The meaning of every column, once the header is found complete and free of contradictions.
fn columns(header: &StringRecord) -> Result<Vec<Column>, Failure> {
    let mut columns = Vec::new();
    for name in header {
        let column = Column::named(name).ok_or_else(|| Failure::input(format!("unknown column \"{name}\"")))?;
        if columns.contains(&column) {
            return Err(Failure::input(format!("column \"{name}\" twice")));
        }
        columns.push(column);
    }
    let has = |column| columns.contains(&column);
    let measured: Vec<Component> = Component::ALL.into_iter().filter(|&component| has(Column::Value(component))).collect();
    let cartesian = measured.iter().filter(|component| component.is_cartesian()).count();
    let missing = |what: &str| Err(Failure::input(format!("missing column {what}")));
    if !has(Column::Time) {
        return missing("\"t_us\"");
    }
    if !has(Column::Sensor) {
        return missing("\"sensor\"");
    }
    if measured.is_empty() {
        return missing("x,y or any of range, azimuth, elevation, range_rate");
    }
    if cartesian != 0 && cartesian != measured.len() {
        let names: Vec<_> = measured.iter().map(|component| component.name()).collect();
        let names = names.join(", ");
        return Err(Failure::input(format!("Cartesian and polar columns mixed: {names}")));
    }
    if cartesian != 0 && !(has(Column::Value(Component::X)) && has(Column::Value(Component::Y))) {
        return missing("\"x\" or \"y\"");
    }
    match Component::ALL.into_iter().find(|&c| has(Column::Sigma(c)) && !has(Column::Value(c))) {
        Some(c) => Err(Failure::input(format!("column \"sigma_{0}\" without \"{0}\"", c.name()))),
        None => Ok(columns),
    }
}

/// One row: appends its detection to the last scan, or begins a new one.
fn add_row(scans: &mut Vec<ScanRecord>, columns: &[Column], record: &StringRecord) -> Result<(), Failure> {
    let mut time_us = 0;
    let mut sensor = "";
    let mut plot = Plot::default();
    for (column, cell) in columns.iter().zip(record) {
        match column {
            Column::Time => time_us = microseconds(cell)?,
            Column::Sensor if cell.is_empty() => return Err(fault("sensor", "empty")),
            Column::Sensor => sensor = cell,
            _ if cell.is_empty() => {}
            Column::Amplitude => plot.amplitude = Some(number("amplitude", cell)?),
            Column::Value(component) => {
                let value = number(component.name(), cell)?;
                if let Some(reason) = component.objection(value) {
                    return Err(fault(component.name(), format!("{value} is {reason}")));
                }
                plot.values.set(*component, value);
            }
            Column::Sigma(component) => {
                let name = format!("sigma_{}", component.name());
                let sigma = number(&name, cell)?;
                if sigma <= 0.0 {
                    return Err(fault(&name, format!("{sigma} is not positive")));
                }
                plot.sigma.set(*component, sigma);
            }
        }
    }
    let detection = detection(plot)?;
    let last = scans.last_mut();
    if let Some(last) = &last
        && time_us < last.time_us
    {
        let reason = format!("{time_us} is before {}, the time of the row above", last.time_us);
        return Err(fault("t_us", reason));
    }
    match (last, detection) {
        (Some(last), detection) if last.time_us == time_us && last.sensor == sensor => {
            let plot = detection
                .filter(|_| !last.detections.is_empty())
                .ok_or_else(|| Failure::input("a row without a detection must be the only one of its scan"))?;
            last.detections.push(plot);
        }
        (_, detection) => scans.push(ScanRecord {
            time_us,
            sensor: sensor.to_owned(),
            own: None,
            detections: detection.into_iter().collect(),
            truth: Vec::new(),
        }),
    }
    Ok(())
}

/// The plot of a row, `None` for an empty scan; a failure if cells that belong together are missing.
fn detection(plot: Plot) -> Result<Option<Plot>, Failure> {
    use Component::{X, Y, Z};
    let has = |component| plot.values.get(component).is_some();
    if let Some((lonely, _)) = plot.sigma.iter().find(|&(component, _)| !has(component)) {
        let name = lonely.name();
        return Err(fault(&format!("sigma_{name}"), format!("given without {name}")));
    }
    if plot.values.is_empty() {
        return match plot.amplitude {
            Some(_) => Err(fault("amplitude", "given without a detection")),
            None => Ok(None),
        };
    }
    let cartesian = has(X) || has(Y) || has(Z);
    match [X, Y].into_iter().find(|&component| cartesian && !has(component)) {
        Some(missing) => Err(fault(missing.name(), "empty, but the row has other coordinates")),
        None => Ok(Some(plot)),
    }
}

fn microseconds(cell: &str) -> Result<u64, Failure> {
    cell.parse().map_err(|_| fault("t_us", format!("\"{cell}\" is not a whole, non-negative number of microseconds")))
}

fn number(column: &str, cell: &str) -> Result<f64, Failure> {
    match cell.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => Err(fault(column, format!("\"{cell}\" is not finite"))),
        Err(_) => Err(fault(column, format!("\"{cell}\" is not a number"))),
    }
}

fn fault(column: &str, reason: impl std::fmt::Display) -> Failure {
    Failure::at_field(format!("column {column}"), reason)
}

/// The line, counted from 1, on which a record begins. The parser's own count stops before blank lines.
fn line_number(text: &str, position: Option<&Position>) -> u64 {
    let start = position.map_or(0, |position| position.byte() as usize);
    let (before, rest) = text.split_at_checked(start).unwrap_or((text, ""));
    let blank = rest.bytes().take_while(|byte| matches!(byte, b'\n' | b'\r'));
    before.bytes().chain(blank).filter(|&byte| byte == b'\n').count() as u64 + 1
}

/// What the CSV parser itself objects to.
fn parser_reason(error: &::csv::Error) -> String {
    match error.kind() {
        ::csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            format!("{len} cells where the header has {expected_len}")
        }
        _ => error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<Recording, Failure> {
        parse(Path::new("p.csv"), text)
    }

    #[test]
    fn rows_become_scans() -> Result<(), Failure> {
        let recording = parsed(
            "t_us, sensor, x, y, amplitude, sigma_x\n\
             0,radar,1,2,,\n0,radar,3,4,9.5,0.5\n0,lidar,5,6,,\n1000,radar,,,,\n1000,lidar,,,,\n",
        )?;
        let shape: Vec<_> = recording.scans.iter().map(|scan| (scan.time_us, scan.sensor.as_str(), scan.detections.len())).collect();
        assert_eq!(shape, [(0, "radar", 2), (0, "lidar", 1), (1000, "radar", 0), (1000, "lidar", 0)]);
        let second = &recording.scans[0].detections[1];
        assert_eq!(second.relative_position(), Some([3.0, 4.0, 0.0]));
        assert_eq!((second.amplitude, second.sigma.get(Component::X)), (Some(9.5), Some(0.5)));
        assert_eq!((recording.sensors(), recording.duration_s()), (vec!["radar", "lidar"], 1e-3));
        assert!(!recording.has_truth());
        Ok(())
    }

    #[test]
    fn sensors_may_measure_different_polar_components() -> Result<(), Failure> {
        let recording = parsed(
            "\u{feff}sensor,t_us,range,azimuth,elevation,range_rate\n\
             radar,5,1000,0.5,,-12.5\nirst,5,,0.5,0.1,\n",
        )?;
        let measured = |scan: usize| -> Vec<_> { recording.scans[scan].detections[0].values.iter().map(|(c, _)| c.name()).collect() };
        assert_eq!(measured(0), ["range", "azimuth", "range_rate"]);
        assert_eq!(measured(1), ["azimuth", "elevation"]);
        Ok(())
    }

    #[test]
    fn complaints_name_line_column_and_reason() {
        for (text, expected) in [
            ("", "line 1: missing column \"t_us\""),
            ("t_us,x,y\n", "line 1: missing column \"sensor\""),
            ("t_us,sensor\n", "line 1: missing column x,y or any of range, azimuth, elevation, range_rate"),
            ("t_us,sensor,x\n", "line 1: missing column \"x\" or \"y\""),
            ("t_us,sensor,x,y,range\n", "line 1: Cartesian and polar columns mixed: x, y, range"),
            ("t_us,sensor,x,y,speed\n", "line 1: unknown column \"speed\""),
            ("t_us,sensor,x,y,x\n", "line 1: column \"x\" twice"),
            ("t_us,sensor,x,y,sigma_z\n", "line 1: column \"sigma_z\" without \"z\""),
            ("t_us,sensor,x,y\n1,r,2\n", "line 2: 3 cells where the header has 4"),
            ("t_us,sensor,x,y\n1.5,r,1,2\n", "line 2: column t_us: \"1.5\" is not a whole, non-negative number of microseconds"),
            ("t_us,sensor,x,y\n-1,r,1,2\n", "line 2: column t_us: \"-1\" is not a whole, non-negative number of microseconds"),
            ("t_us,sensor,x,y\n1,r,1,NaN\n", "line 2: column y: \"NaN\" is not finite"),
            ("t_us,sensor,x,y\n1,r,1,2\n\n2,r,inf,2\n", "line 4: column x: \"inf\" is not finite"),
            ("t_us,sensor,x,y\n1,r,1,2m\n", "line 2: column y: \"2m\" is not a number"),
            ("t_us,sensor,x,y\n1,,1,2\n", "line 2: column sensor: empty"),
            ("t_us,sensor,x,y\n1,r,,2\n", "line 2: column x: empty, but the row has other coordinates"),
            ("t_us,sensor,x,y\n2,r,1,2\n1,r,1,2\n", "line 3: column t_us: 1 is before 2, the time of the row above"),
            ("t_us,sensor,x,y\n2,r,1,2\n2,r,,\n", "line 3: a row without a detection must be the only one of its scan"),
            ("t_us,sensor,x,y\n2,r,,\n2,r,1,2\n", "line 3: a row without a detection must be the only one of its scan"),
            ("t_us,sensor,x,y,amplitude\n2,r,,,5\n", "line 2: column amplitude: given without a detection"),
            ("t_us,sensor,x,y,sigma_x\n2,r,1,1,0\n", "line 2: column sigma_x: 0 is not positive"),
            ("t_us,sensor,range,sigma_range\n2,r,,1\n", "line 2: column sigma_range: given without range"),
            ("t_us,sensor,range\n2,r,-4\n", "line 2: column range: -4 is negative"),
            ("t_us,sensor,range,azimuth\n2,r,4,90\n", "line 2: column azimuth: 90 is beyond a full turn; radians are wanted"),
        ] {
            let told = parsed(text).err().map(|failure| failure.to_string());
            assert_eq!(told, Some(format!("p.csv, {expected}")), "{text}");
        }
        let empty = parsed("t_us,sensor,x,y\n").err().map(|failure| failure.to_string());
        assert_eq!(empty.as_deref(), Some("p.csv: no scans"));
    }
}
