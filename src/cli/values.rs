//! Values of flags.

use clap::ValueEnum;
use glam::DVec3;
use glimt::bvh::Quality;
use glimt::scene::{Filter, Instancing, Sampler};
use std::time::Duration;

/// How much work goes into the tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BvhChoice {
    /// Object splits only
    Fast,
    /// Spatial splits where boxes overlap much
    Balanced,
    /// Spatial splits wherever they help, subtrees moved to better places
    Best,
}

impl From<BvhChoice> for Quality {
    fn from(choice: BvhChoice) -> Self {
        match choice {
            BvhChoice::Fast => Self::Fast,
            BvhChoice::Balanced => Self::Balanced,
            BvhChoice::Best => Self::Best,
        }
    }
}

/// Whether instances share the triangles of their mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum InstancingChoice {
    /// Where that saves much memory
    Auto,
    /// Wherever that saves any memory: rays take longer
    Shared,
    /// Never: every instance has its own triangles
    Flat,
}

impl From<InstancingChoice> for Instancing {
    fn from(choice: InstancingChoice) -> Self {
        match choice {
            InstancingChoice::Auto => Self::Auto,
            InstancingChoice::Shared => Self::Shared,
            InstancingChoice::Flat => Self::Flat,
        }
    }
}

/// Where samples lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SamplerChoice {
    /// Sobol's sequence, scrambled
    Sobol,
    /// One sample in each cell, column and row of the pixel
    Stratified,
    /// Independent of each other
    Independent,
}

impl From<SamplerChoice> for Sampler {
    fn from(choice: SamplerChoice) -> Self {
        match choice {
            SamplerChoice::Sobol => Self::Sobol,
            SamplerChoice::Stratified => Self::Stratified,
            SamplerChoice::Independent => Self::Independent,
        }
    }
}

/// How samples are weighed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FilterChoice {
    /// Evenly over the pixel
    Box,
    /// A triangle two pixels wide
    Tent,
    /// Four pixels wide, soft
    BlackmanHarris,
    /// Four pixels wide, sharp
    Mitchell,
}

impl From<FilterChoice> for Filter {
    fn from(choice: FilterChoice) -> Self {
        match choice {
            FilterChoice::Box => Self::Box,
            FilterChoice::Tent => Self::Tent,
            FilterChoice::BlackmanHarris => Self::BlackmanHarris,
            FilterChoice::Mitchell => Self::Mitchell,
        }
    }
}

/// `WxH`, pixels.
pub fn size(text: &str) -> Result<(u32, u32), String> {
    let parts = text.split_once(['x', 'X', '×']).ok_or("give width and height, as in 640x480")?;
    let side = |part: &str| part.trim().parse::<u32>().map_err(|_| format!("'{part}' is no number of pixels"));
    Ok((side(parts.0)?, side(parts.1)?))
}

/// `x,y,z`.
pub fn vector(text: &str) -> Result<DVec3, String> {
    let numbers: Vec<f64> = text
        .split(',')
        .map(|part| part.trim().parse().map_err(|_| format!("'{part}' is no number")))
        .collect::<Result<_, _>>()?;
    match numbers[..] {
        [x, y, z] if numbers.iter().all(|number| number.is_finite()) => Ok(DVec3::new(x, y, z)),
        _ => Err("give three finite numbers, as in 0,1.5,3".into()),
    }
}

/// A number of bytes: `500M` is 500 · 2²⁰.
pub fn bytes(text: &str) -> Result<u64, String> {
    let (digits, unit) = match text.strip_suffix(['K', 'M', 'G']) {
        Some(digits) if text.ends_with('K') => (digits, 10),
        Some(digits) if text.ends_with('M') => (digits, 20),
        Some(digits) => (digits, 30),
        None => (text, 0),
    };
    let count = digits.parse::<u64>().ok().and_then(|count| count.checked_mul(1 << unit));
    count.filter(|count| *count > 0).ok_or_else(|| format!("'{text}' is no size such as 500M"))
}

/// A time in seconds above 0.
pub fn seconds(text: &str) -> Result<Duration, String> {
    let seconds = text.trim().parse().ok().filter(|seconds| *seconds > 0.0);
    let seconds = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    seconds.ok_or_else(|| format!("'{text}' is no number of seconds above 0"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes() {
        assert_eq!(size("640x480"), Ok((640, 480)));
        assert_eq!(size("1X2"), Ok((1, 2)));
        assert!(size("640").is_err() && size("x").is_err() && size("-1x2").is_err() && size("1.5x2").is_err());
    }

    #[test]
    fn times() {
        assert_eq!(seconds("1.5"), Ok(Duration::from_millis(1500)));
        for wrong in ["0", "-1", "inf", "NaN", "1e300", "soon", ""] {
            assert!(seconds(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn vectors() {
        assert_eq!(vector("0,-1.5,3e2"), Ok(DVec3::new(0.0, -1.5, 300.0)));
        assert!(vector("1,2").is_err() && vector("1,2,x").is_err() && vector("1,2,inf").is_err());
    }
}
