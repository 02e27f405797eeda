//! The jump-Markov GLMB filter by listing everything: every set of (label, history), every sequence of modes. Slow and plain.

use super::{NOISE, Problem, VARIANCES};
use boresight::glmb::Label;
use boresight::model::linear::LinearMotion;
use nalgebra::{Matrix2, Matrix2x4, Matrix4, Vector2, Vector4};
use std::collections::BTreeMap;

/// A Gaussian in a mode with its weight.
type Component = (f64, usize, Vector4<f64>, Matrix4<f64>);
/// Label, detections since birth (0: missed)
type Track = (Label, Vec<usize>);

/// What is known after some scans.
pub struct Enumeration {
    /// The weight of every set of tracks
    pub hypotheses: BTreeMap<Vec<Track>, f64>,
    /// The density of every track
    pub densities: BTreeMap<Track, Vec<Component>>,
}

/// Existence, mean, covariance and mode probabilities of a label.
pub struct Marginal {
    pub existence: f64,
    pub mean: Vector4<f64>,
    pub cov: Matrix4<f64>,
    pub modes: [f64; 2],
}

fn predicted(problem: &Problem, density: &[Component]) -> Vec<Component> {
    let motion: [LinearMotion<f64, 4>; 2] = problem.motion();
    let mut moved = Vec::new();
    for (weight, from, x, p) in density {
        for (to, model) in motion.iter().enumerate() {
            let f = model.transition;
            moved.push((weight * problem.jump[*from][to], to, f * x, f * p * f.transpose() + model.process_noise.to_matrix()));
        }
    }
    moved
}

/// What a density becomes by a detection, or without one, unnormalised.
fn updated(problem: &Problem, density: &[Component], z: Option<[f64; 2]>) -> Vec<Component> {
    let h = Matrix2x4::new(1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0);
    let one = |(weight, mode, x, p): &Component| {
        let p_detect = problem.visibility[*mode];
        let Some(z) = z else { return Some((weight * (1.0 - p_detect), *mode, *x, *p)) };
        let s = h * p * h.transpose() + Matrix2::identity() * NOISE;
        let (inverse, nu) = (s.try_inverse()?, Vector2::from(z) - h * x);
        let nis = (nu.transpose() * inverse * nu)[0];
        let likelihood = (-0.5 * nis).exp() / (2.0 * std::f64::consts::PI * s.determinant().sqrt());
        let gain = p * h.transpose() * inverse;
        Some((weight * p_detect * likelihood / problem.clutter, *mode, x + gain * nu, (Matrix4::identity() - gain * h) * p))
    };
    density.iter().filter_map(one).collect()
}

impl Enumeration {
    /// After the first `scans` scans.
    pub fn new(problem: &Problem, scans: usize) -> Self {
        let mut now = Self { hypotheses: BTreeMap::from([(Vec::new(), 1.0)]), densities: BTreeMap::new() };
        for k in 0..scans {
            now = now.next(problem, k);
        }
        now
    }

    fn next(&self, problem: &Problem, k: usize) -> Self {
        let mut next = Self { hypotheses: BTreeMap::new(), densities: BTreeMap::new() };
        let plots = &problem.scans[k];
        for (tracks, weight) in &self.hypotheses {
            // Of every target: exists with, and its density.
            let mut targets: Vec<(Track, f64, Vec<Component>)> =
                tracks.iter().map(|track| (track.clone(), problem.p_survive, predicted(problem, &self.densities[track]))).collect();
            for (number, (r, place, modes)) in problem.births.iter().enumerate() {
                let label = Label { birth_scan: k as u32, index: number as u16 };
                let x = Vector4::new(place[0], 3.0, place[1], -2.0);
                let p = Matrix4::from_diagonal(&Vector4::from(VARIANCES));
                targets.push(((label, Vec::new()), *r, modes.iter().enumerate().map(|(mode, w)| (*w, mode, x, p)).collect()));
            }
            next.list(problem, plots, &targets, &mut Vec::new(), *weight);
        }
        let sum: f64 = next.hypotheses.values().sum();
        next.hypotheses.values_mut().for_each(|weight| *weight /= sum);
        next
    }

    /// All choices of the first target, with all of the others.
    fn list(
        &mut self,
        problem: &Problem,
        plots: &[[f64; 2]],
        targets: &[(Track, f64, Vec<Component>)],
        chosen: &mut Vec<Track>,
        weight: f64,
    ) {
        let Some((((label, history), alive, density), others)) = targets.split_first() else {
            let mut set = chosen.clone();
            set.sort();
            *self.hypotheses.entry(set).or_default() += weight;
            return;
        };
        self.list(problem, plots, others, chosen, weight * (1.0 - alive));
        for choice in 0..=plots.len() {
            if choice > 0 && chosen.iter().any(|(_, history)| history.last() == Some(&choice)) {
                continue;
            }
            let mut density = updated(problem, density, choice.checked_sub(1).map(|j| plots[j]));
            let sum: f64 = density.iter().map(|c| c.0).sum();
            density.iter_mut().for_each(|c| c.0 /= sum);
            let track = (*label, history.iter().copied().chain([choice]).collect::<Vec<_>>());
            self.densities.entry(track.clone()).or_insert(density);
            chosen.push(track);
            self.list(problem, plots, others, chosen, weight * alive * sum);
            chosen.pop();
        }
    }

    /// The probability of every set of labels.
    pub fn sets(&self) -> super::Sets {
        let mut sets = super::Sets::new();
        for (tracks, weight) in &self.hypotheses {
            *sets.entry(tracks.iter().map(|track| track.0).collect()).or_default() += weight;
        }
        sets
    }

    /// All that is known of a label.
    pub fn marginal(&self, label: Label) -> Option<Marginal> {
        let having = self.hypotheses.iter().filter_map(|(tracks, weight)| Some((weight, tracks.iter().find(|t| t.0 == label)?)));
        let components: Vec<Component> = having
            .flat_map(|(weight, track)| self.densities[track].iter().map(move |(w, mode, x, p)| (w * weight, *mode, *x, *p)))
            .collect();
        let existence: f64 = components.iter().map(|c| c.0).sum();
        let mean = components.iter().fold(Vector4::zeros(), |sum, c| sum + c.2 * (c.0 / existence));
        let cov =
            components.iter().fold(Matrix4::zeros(), |sum, c| sum + (c.3 + (c.2 - mean) * (c.2 - mean).transpose()) * (c.0 / existence));
        let modes = [0, 1].map(|mode| components.iter().filter(|c| c.1 == mode).map(|c| c.0).sum::<f64>() / existence);
        (existence > 0.0).then_some(Marginal { existence, mean, cov, modes })
    }
}
