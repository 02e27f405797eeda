//! What the coupled filter costs: both forms of the image `coupled`, twelve scans of either sensor.

use super::bound;
use super::count::Call;
use super::figures::Load;
use super::image::Image;
use super::table::{ms, row};
use crate::Failure;
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};
use std::fmt::Write;
use twin::coupled::Meeting;

/// What it is, in the order of the sizes in `STATES`; and what the image exports for a scan of the radar, which moves the targets, and
/// one of the infrared sensor at the same time.
const FORMS: [(&str, [&str; 2]); 2] =
    [("with the cross covariance", ["coupled18_first", "coupled18_second"]), ("without", ["apart18_first", "apart18_second"])];

/// The functions to be counted.
pub fn functions() -> [&'static str; 4] {
    let [(_, [a, b]), (_, [c, d])] = FORMS;
    [a, b, c, d]
}

/// What one form costs. Memory in bytes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Form {
    pub ram: u64,
    pub stack: u64,
    pub radar: Load,
    pub infrared: Load,
}

/// What the coupled filter costs. Memory in bytes.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Coupled {
    /// Code and constants of both forms
    pub flash: u64,
    pub forms: IndexMap<String, Form>,
}

impl Coupled {
    /// From the calls of the image; `empty` is the flash of one without a tracker.
    pub fn of(image: &Image, calls: &[Call], empty: u64) -> Result<Self, Failure> {
        let states = image.data("STATES")?;
        let sizes = states.as_chunks::<4>().0.iter().map(|word| u64::from(u32::from_le_bytes(*word)));
        let form = |((name, functions), ram): ((&str, [&str; 2]), u64)| {
            let [radar, infrared] = functions.map(|function| calls.iter().filter(|call| call.function == function).cloned().collect());
            let (radar, infrared): (Vec<Call>, Vec<Call>) = (radar, infrared);
            let stack = radar.iter().chain(&infrared).map(|call| call.stack).max();
            let stack = stack.ok_or_else(|| Failure::input(format!("no scan of the form {name} has been counted")))?;
            Ok((name.to_owned(), Form { ram, stack, radar: Load::of(&radar), infrared: Load::of(&infrared) }))
        };
        let forms = FORMS.into_iter().zip(sizes).map(form).collect::<Result<_, Failure>>()?;
        Ok(Self { flash: image.flash()?.saturating_sub(empty), forms })
    }

    /// Every figure with its full name.
    pub fn list(&self) -> impl Iterator<Item = (String, u64)> {
        let forms = self.forms.iter().flat_map(|(name, Form { ram, stack, radar, infrared })| {
            let sensor = |sensor: &'static str, load: &Load| load.figures().map(|(figure, value)| (format!("{sensor} {figure}"), value));
            let memory = [("ram".to_owned(), *ram), ("stack".to_owned(), *stack)];
            let all = memory.into_iter().chain(sensor("radar", radar)).chain(sensor("infrared", infrared));
            all.map(move |(figure, value)| (format!("coupled filter {name}, {figure}"), value))
        });
        std::iter::once(("coupled filter, flash".to_owned(), self.flash)).chain(forms)
    }

    /// The table of both forms.
    pub fn render(&self, text: &mut String) -> Result<(), Failure> {
        if self.forms.is_empty() {
            return Ok(());
        }
        let bound = bound::coupled_cycles(&Meeting::MOST);
        let _ = write!(
            text,
            "\n### Two targets in one plot\n\n\
             The coupled filter on two targets of 9 states that meet, 9 pairs of modes, room for 16 detections: three plots a scan of the \
             radar, which moves the targets, then of an infrared sensor. Both forms together take {} bytes of flash. At most {:.1}k steps \
             a scan, {:.2} million cycles.\n\n\
             | coupled filter | RAM | stack | radar: instructions/k mean | worst | cycles/k worst | infrared: instructions/k mean | worst | \
             cycles/k worst | ms both worst |\n\
             |---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n",
            self.flash,
            Meeting::MOST.steps() as f64 / 1e3,
            bound as f64 / 1e6,
        );
        for (name, _) in FORMS {
            let Some(Form { ram, stack, radar, infrared }) = self.forms.get(name) else { continue };
            if radar.worst_cycles.max(infrared.worst_cycles) > bound {
                return Err(Failure::check("more cycles observed than the bound gives: calibrate it anew").within(name));
            }
            let kilo = |load: &Load| {
                [load.mean_instructions, load.worst_instructions, load.worst_cycles].map(|n| format!("{:.1}", n as f64 / 1e3))
            };
            let memory = [name.to_owned(), ram.to_string(), stack.to_string()];
            let both = ms(radar.worst_cycles + infrared.worst_cycles);
            row(text, memory.into_iter().chain(kilo(radar)).chain(kilo(infrared)).chain([both]));
        }
        Ok(())
    }
}
