//! What a ray that hits nothing sees.

use crate::error::{Error, Result};
use crate::srgb::decode;
use glam::DVec3;
use std::str::FromStr;

/// Radiance of directions in which nothing lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Background {
    /// From straight down to straight up, linear in the direction's y.
    Gradient {
        /// Linear RGB straight down.
        nadir: DVec3,
        /// Linear RGB straight up.
        zenith: DVec3,
    },
    /// The same everywhere, linear RGB.
    Constant(DVec3),
    /// Black with alpha 0, in the picture and in mirrors.
    Transparent,
}

impl Default for Background {
    fn default() -> Self {
        Background::Gradient { nadir: DVec3::new(0.62, 0.60, 0.58), zenith: DVec3::new(0.18, 0.32, 0.60) }
    }
}

impl Background {
    /// Radiance in a unit direction.
    pub fn radiance(&self, direction: DVec3) -> DVec3 {
        match *self {
            Background::Gradient { nadir, zenith } => nadir + (zenith - nadir) * (0.5 + 0.5 * direction.y),
            Background::Constant(color) => color,
            Background::Transparent => DVec3::ZERO,
        }
    }

    /// Alpha of a pixel that sees only background.
    pub fn alpha(&self) -> f64 {
        if *self == Background::Transparent {
            0.0
        } else {
            1.0
        }
    }
}

/// Linear value of an 8-bit sRGB one.
fn linear(code: u8) -> f64 {
    decode(f64::from(code) / 255.0)
}

impl FromStr for Background {
    type Err = Error;

    /// `gradient`, `transparent`, `black`, `white`, `#rrggbb` (sRGB) or `r,g,b` (linear).
    fn from_str(text: &str) -> Result<Self> {
        let bad = || {
            Error::Usage(format!(
                "background '{text}': give gradient, transparent, black, white, #rrggbb (sRGB) or r,g,b (linear, 0 or more)"
            ))
        };
        match text {
            "gradient" => return Ok(Background::default()),
            "transparent" => return Ok(Background::Transparent),
            "black" => return Ok(Background::Constant(DVec3::ZERO)),
            "white" => return Ok(Background::Constant(DVec3::ONE)),
            _ => {}
        }
        if let Some(hex) = text.strip_prefix('#') {
            let number = u32::from_str_radix(hex, 16).ok().filter(|_| hex.len() == 6).ok_or_else(bad)?;
            let [_, r, g, b] = number.to_be_bytes();
            return Ok(Background::Constant(DVec3::new(linear(r), linear(g), linear(b))));
        }
        let parts: Vec<f64> =
            text.split(',').map(|part| part.trim().parse().map_err(|_| bad())).collect::<Result<_>>()?;
        match parts[..] {
            [r, g, b] if [r, g, b].iter().all(|value| (0.0..=1e30).contains(value)) => {
                Ok(Background::Constant(DVec3::new(r, g, b)))
            }
            _ => Err(bad()),
        }
    }
}
