//! Animations: key frames → what a channel's target is at a time (glTF 2.0, 3.11 and appendix C).

use super::accessor::Elements;
use super::nodes::unit;
use super::{Document, Warnings};
use crate::error::Result;
use glam::DQuat;
use serde::Deserialize;
use serde_json::Value;
use std::collections::BTreeMap;

/// An animation as the file declares it.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Declared {
    pub name: String,
    pub channels: Vec<Channel>,
    samplers: Vec<Sampler>,
}

impl Declared {
    /// Accessors of the times of channels.
    fn inputs(&self) -> impl Iterator<Item = usize> + '_ {
        self.channels.iter().filter_map(|channel| self.samplers.get(channel.sampler?)?.input)
    }

    /// What each channel moves, whether by a cubic spline, and the accessors of its times and values.
    pub fn uses(&self) -> impl Iterator<Item = (&str, bool, usize, usize)> {
        self.channels.iter().filter_map(|channel| {
            let sampler = self.samplers.get(channel.sampler?)?;
            let is_cubic = sampler.interpolation.as_deref() == Some("CUBICSPLINE");
            Some((channel.target.path.as_str(), is_cubic, sampler.input?, sampler.output?))
        })
    }
}

/// A property of a node, and the sampler that moves it.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Channel {
    sampler: Option<usize>,
    target: Target,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Target {
    node: Option<usize>,
    path: String,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Sampler {
    input: Option<usize>,
    output: Option<usize>,
    interpolation: Option<String>,
}

/// The animations of a document; one that makes no sense is empty, with a warning.
pub(super) fn declared(root: &Value, warnings: &mut Warnings) -> Vec<Declared> {
    let animations = root.get("animations").and_then(Value::as_array);
    let read = |(index, animation): (usize, &Value)| {
        Declared::deserialize(animation).unwrap_or_else(|error| {
            warnings.add(format!("ignored: animations[{index}]: {error}"));
            Declared::default()
        })
    };
    animations.into_iter().flatten().enumerate().map(read).collect()
}

/// What a track moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Path {
    Translation,
    Rotation,
    Scale,
    Weights,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Interpolation {
    Step,
    Linear,
    Cubic,
}

/// A property of a node over time.
#[derive(Debug)]
pub(super) struct Track {
    pub node: usize,
    pub path: Path,
    /// Seconds, not decreasing; at least one.
    times: Vec<f32>,
    /// Numbers of a value.
    width: usize,
    /// Values, one a key; for cubic splines three: tangent in, value, tangent out.
    values: Vec<f32>,
    interpolation: Interpolation,
}

impl Track {
    /// The value at a time; that of the first or last key outside of them. Rotations have length 1.
    pub fn at(&self, time: f64) -> Vec<f64> {
        let after = self.times.partition_point(|key| f64::from(*key) <= time);
        let value = match after.checked_sub(1) {
            None => self.key(0),
            Some(last) if after == self.times.len() => self.key(last),
            Some(before) => self.between(before, time),
        };
        match <[f64; 4]>::try_from(value.as_slice()) {
            Ok(xyzw) if self.path == Path::Rotation => unit(&xyzw).to_array().into(),
            _ => value,
        }
    }

    fn between(&self, before: usize, time: f64) -> Vec<f64> {
        let (start, end) = (f64::from(self.times[before]), f64::from(self.times[before + 1]));
        let (step, t) = (end - start, (time - start) / (end - start));
        let (a, b) = (self.key(before), self.key(before + 1));
        match self.interpolation {
            Interpolation::Step => a,
            Interpolation::Linear if self.path == Path::Rotation => turned(&a, &b, t),
            Interpolation::Linear => a.iter().zip(&b).map(|(a, b)| a + (b - a) * t).collect(),
            Interpolation::Cubic => {
                let (out_of_a, into_b) = (self.element(3 * before + 2), self.element(3 * (before + 1)));
                let (t2, t3) = (t * t, t * t * t);
                let hermite = |i: usize| {
                    (2.0 * t3 - 3.0 * t2 + 1.0) * a[i]
                        + step * (t3 - 2.0 * t2 + t) * out_of_a[i]
                        + (3.0 * t2 - 2.0 * t3) * b[i]
                        + step * (t3 - t2) * into_b[i]
                };
                (0..self.width).map(hermite).collect()
            }
        }
    }

    /// The value of a key.
    fn key(&self, index: usize) -> Vec<f64> {
        self.element(if self.interpolation == Interpolation::Cubic { 3 * index + 1 } else { index })
    }

    fn element(&self, index: usize) -> Vec<f64> {
        self.values[index * self.width..][..self.width].iter().map(|value| f64::from(*value)).collect()
    }

    /// Time of the last key.
    pub fn end(&self) -> f64 {
        self.times.last().map_or(0.0, |time| f64::from(*time))
    }
}

/// From one rotation to another on the shorter arc.
fn turned(a: &[f64], b: &[f64], t: f64) -> Vec<f64> {
    let rotation = |xyzw: &[f64]| <[f64; 4]>::try_from(xyzw).map_or(DQuat::IDENTITY, |xyzw| unit(&xyzw));
    let (a, b) = (rotation(a), rotation(b));
    let b = if a.dot(b) < 0.0 { -b } else { b };
    let angle = a.dot(b).min(1.0).acos();
    // Rotations that nearly agree have no arc to divide by; a straight line is the same to rounding.
    let (of_a, of_b) = match angle.sin() {
        sine if sine > 1e-9 => (((1.0 - t) * angle).sin() / sine, (t * angle).sin() / sine),
        _ => (1.0 - t, t),
    };
    (a * of_a + b * of_b).to_array().into()
}

impl Document<'_> {
    /// Time of each animation's last key: of all its samplers whose times can be read.
    pub fn durations(&self) -> Vec<f64> {
        // Many may name the same times, of which nothing is kept.
        let mut ends: BTreeMap<usize, f64> = BTreeMap::new();
        let mut end = |input: usize| {
            *ends.entry(input).or_insert_with(|| {
                let times = self.glance(input, true).and_then(|times| checked_times(times).ok());
                times.and_then(|times| times.last().copied()).map_or(0.0, f64::from)
            })
        };
        let mut duration = |own: &Declared| own.inputs().map(&mut end).fold(0.0, f64::max);
        self.animations.iter().map(&mut duration).collect()
    }

    /// The tracks of an animation; channels that cannot be used are left out with a warning.
    pub fn tracks(&mut self, animation: usize) -> Vec<Track> {
        let mut tracks = Vec::new();
        for index in 0..self.animations[animation].channels.len() {
            match self.track(animation, index) {
                Ok(track) => tracks.extend(track),
                Err(fault) => {
                    self.warnings.add(format!("ignored: animations[{animation}].channels[{index}]: {fault}"));
                }
            }
        }
        tracks
    }

    /// The track of a channel; `None` for one that an extension defines, which is reported as ignored.
    fn track(&self, animation: usize, channel: usize) -> Result<Option<Track>, String> {
        let declared = &self.animations[animation];
        let Channel { sampler, target } = &declared.channels[channel];
        let path = match target.path.as_str() {
            "translation" => Path::Translation,
            "rotation" => Path::Rotation,
            "scale" => Path::Scale,
            "weights" => Path::Weights,
            "pointer" => return Ok(None),
            other => return Err(format!("its path is '{other}'")),
        };
        let Some(node) = target.node else { return Err("it names no node".into()) };
        let sampler = sampler.and_then(|index| declared.samplers.get(index)).ok_or("it has no sampler")?;
        let (Some(input), Some(output)) = (sampler.input, sampler.output) else {
            return Err("its sampler has no input or output".into());
        };
        let interpolation = match sampler.interpolation.as_deref() {
            None | Some("LINEAR") => Interpolation::Linear,
            Some("STEP") => Interpolation::Step,
            Some("CUBICSPLINE") => Interpolation::Cubic,
            Some(other) => return Err(format!("its interpolation is '{other}'")),
        };
        let times = self.times(input)?;
        let output = self.floats(output).map_err(|error| error.to_string())?;
        let elements = times.len() * if interpolation == Interpolation::Cubic { 3 } else { 1 };
        let components = match path {
            Path::Translation | Path::Scale => 3,
            Path::Rotation => 4,
            Path::Weights => 1,
        };
        let width = output.values.len() / elements;
        let fits = width * elements == output.values.len() && (width == components || path == Path::Weights);
        if output.components != components || width == 0 || !fits {
            return Err(format!("its {} times do not fit its {} numbers", times.len(), output.values.len()));
        }
        if !output.values.iter().all(|value| value.is_finite()) {
            return Err("a value is not a finite number".into());
        }
        Ok(Some(Track { node, path, times, width, values: output.values, interpolation }))
    }

    /// Times of keys.
    fn times(&self, accessor: usize) -> Result<Vec<f32>, String> {
        checked_times(self.floats(accessor).map_err(|error| error.to_string())?)
    }
}

/// Times of keys: finite, not decreasing, at least one.
fn checked_times(Elements { components, values }: Elements<f32>) -> Result<Vec<f32>, String> {
    if components != 1 || values.is_empty() {
        return Err("its times are no scalars".into());
    }
    let increase = values.windows(2).all(|pair| pair[0] <= pair[1]);
    if !increase || !values.iter().all(|time| time.is_finite()) {
        return Err("its times do not increase".into());
    }
    Ok(values)
}
