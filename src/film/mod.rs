//! Pictures: linear pixels, their files, and metrics between two of them.

mod metrics;
mod read;
mod write;

pub use metrics::{compare, compare_linear, heat_map, LinearMetrics, Metrics};
pub use read::read;
pub use write::{check_writable, write_whole, Format, Saved};

use crate::srgb;

/// Linear pixels, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Linear RGB (sRGB primaries) times alpha, and alpha = coverage.
    pub pixels: Vec<[f32; 4]>,
    /// Alpha is worth keeping: the background is transparent.
    pub has_alpha: bool,
}

impl Film {
    /// A black picture.
    pub fn new(width: u32, height: u32, has_alpha: bool) -> Self {
        Self { width, height, pixels: vec![[0.0; 4]; width as usize * height as usize], has_alpha }
    }

    /// 8-bit sRGB of a pixel, alpha not multiplied in.
    pub fn srgb8(&self, pixel: usize) -> [u8; 4] {
        let [r, g, b, a] = self.straight(pixel);
        [srgb::code(r), srgb::code(g), srgb::code(b), (a * 255.0 + 0.5) as u8]
    }

    /// sRGB (IEC 61966-2-1) of a pixel, 0 to 1, alpha not multiplied in.
    pub fn srgb(&self, pixel: usize) -> [f32; 4] {
        let [r, g, b, a] = self.straight(pixel);
        let encode = |light: f32| srgb::encode(light.into()) as f32;
        [encode(r), encode(g), encode(b), a]
    }

    /// A pixel, still linear; alpha, which is 0 to 1, not multiplied in.
    fn straight(&self, pixel: usize) -> [f32; 4] {
        let [r, g, b, a] = self.pixels[pixel];
        if !self.has_alpha {
            return [r, g, b, 1.0];
        }
        let straight = |value: f32| if a > 0.0 { value / a } else { 0.0 };
        [straight(r), straight(g), straight(b), a.clamp(0.0, 1.0)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_8_bit_color_survives_being_linear() {
        for value in 0..=255_u8 {
            let linear = srgb::decode(f64::from(value) / 255.0) as f32;
            let film = Film { width: 1, height: 1, pixels: vec![[linear, linear, linear, 1.0]], has_alpha: false };
            assert_eq!(film.srgb8(0), [value, value, value, 255]);
        }
    }
}
