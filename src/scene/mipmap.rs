//! Mipmaps: a picture, then the same half as wide and high, down to one pixel.

use super::{Image, Pixels};
use crate::srgb;
use rayon::prelude::*;
use std::borrow::Cow;

/// A picture in levels, each half as wide and high as the one before, rounded down, but at least 1.
#[derive(Clone, Debug)]
pub struct Mipmaps<'a> {
    /// Width, height and pixels of each level.
    pub levels: Vec<(u32, u32, Cow<'a, Pixels>)>,
}

impl<'a> Mipmaps<'a> {
    /// The levels of a picture: the mean of the pixels that each covers, by area. Colours in sRGB are averaged as the light that they stand for.
    pub fn of(image: &'a Image, is_srgb: bool) -> Self {
        let light: Vec<f32> = (0..=255_u8).map(|value| decode(f32::from(value) / 255.0, is_srgb)).collect();
        let mut levels = Self::whole(image).levels;
        while let Some((width, height, pixels)) = levels.last().filter(|(width, height, _)| *width > 1 || *height > 1) {
            let size = (*width, *height);
            let smaller = match pixels.as_ref() {
                Pixels::Rgba8(pixels) => {
                    let decoded = |[r, g, b, a]: [u8; 4]| {
                        [light[r as usize], light[g as usize], light[b as usize], f32::from(a) / 255.0]
                    };
                    Pixels::Rgba8(halved(size, pixels, decoded, |[r, g, b, a]| {
                        let plain = |value: f32| (255.0 * value).round() as u8;
                        let code = |light: f32| if is_srgb { srgb::code(light) } else { plain(light) };
                        [code(r), code(g), code(b), plain(a)]
                    }))
                }
                Pixels::Rgba16(pixels) => {
                    let decoded = |pixel: [u16; 4]| {
                        let [r, g, b, a] = pixel.map(|value| f32::from(value) / 65535.0);
                        [decode(r, is_srgb), decode(g, is_srgb), decode(b, is_srgb), a]
                    };
                    Pixels::Rgba16(halved(size, pixels, decoded, |mean| {
                        encoded(mean, is_srgb).map(|value| (65535.0 * value).round() as u16)
                    }))
                }
            };
            levels.push(((width / 2).max(1), (height / 2).max(1), Cow::Owned(smaller)));
        }
        Self { levels }
    }

    /// The picture alone.
    pub fn whole(image: &'a Image) -> Self {
        Self { levels: vec![(image.width, image.height, Cow::Borrowed(&image.pixels))] }
    }
}

/// The part of one pixel of a side of `to` that pixels of a side of `from` fill: first of them and their weights.
fn covered(place: u32, from: u32, to: u32) -> (u32, [f32; 3]) {
    let ratio = from as f32 / to as f32;
    let (start, end) = (place as f32 * ratio, (place + 1) as f32 * ratio);
    let first = start.floor();
    let share = |index: f32| ((end.min(first + index + 1.0) - start.max(first + index)) / ratio).max(0.0);
    (first as u32, [share(0.0), share(1.0), share(2.0)])
}

/// A level half as wide and high.
fn halved<T: Copy + Send + Sync>(
    (width, height): (u32, u32),
    pixels: &[T],
    decoded: impl Fn(T) -> [f32; 4] + Sync,
    encoded: impl Fn([f32; 4]) -> T + Sync,
) -> Vec<T> {
    let (across, down) = ((width / 2).max(1), (height / 2).max(1));
    let columns: Vec<(u32, [f32; 3])> = (0..across).map(|x| covered(x, width, across)).collect();
    let row = |y: u32| {
        let (top, rows) = covered(y, height, down);
        let (pixels, columns, decoded, encoded) = (&pixels, &columns, &decoded, &encoded);
        columns.iter().map(move |(left, columns)| {
            let mut mean = [0.0_f32; 4];
            for (dy, row_weight) in rows.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
                for (dx, weight) in columns.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
                    let (x, y) = ((left + dx as u32).min(width - 1), (top + dy as u32).min(height - 1));
                    let pixel = decoded(pixels[y as usize * width as usize + x as usize]);
                    for (sum, value) in mean.iter_mut().zip(pixel) {
                        *sum += row_weight * weight * value;
                    }
                }
            }
            encoded(mean)
        })
    };
    (0..down).into_par_iter().flat_map_iter(row).collect()
}

/// Light of a channel, both 0 to 1.
fn decode(value: f32, is_srgb: bool) -> f32 {
    if is_srgb {
        srgb::decode(value.into()) as f32
    } else {
        value
    }
}

/// Undoes [`decode`] on a pixel's colours.
fn encoded([r, g, b, a]: [f32; 4], is_srgb: bool) -> [f32; 4] {
    let encode = |light: f32| if is_srgb { srgb::encode(light.into()) as f32 } else { light };
    [encode(r), encode(g), encode(b), a]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, height: u32, pixels: Vec<[u8; 4]>) -> Image {
        let pixels = Pixels::Rgba8(pixels);
        Image { name: String::new(), format: String::new(), width, height, pixels, bytes: 0 }
    }

    #[test]
    fn levels_halve_down_to_one_pixel() {
        let grey = image(5, 2, vec![[9, 9, 9, 255]; 10]);
        let mipmaps = Mipmaps::of(&grey, true);
        let sizes: Vec<(u32, u32)> = mipmaps.levels.iter().map(|(width, height, _)| (*width, *height)).collect();
        assert_eq!(sizes, [(5, 2), (2, 1), (1, 1)]);
        assert!(mipmaps.levels.iter().all(|(_, _, pixels)| {
            matches!(pixels.as_ref(), Pixels::Rgba8(pixels) if pixels.iter().all(|pixel| *pixel == [9, 9, 9, 255]))
        }));
    }

    #[test]
    fn black_and_white_are_half_the_light() {
        let checker = vec![[0, 0, 0, 0], [255, 255, 255, 255], [255, 255, 255, 255], [0, 0, 0, 0]];
        let checker = image(2, 2, checker);
        let mean = |is_srgb| match Mipmaps::of(&checker, is_srgb).levels[1].2.as_ref() {
            Pixels::Rgba8(pixels) => pixels[0],
            Pixels::Rgba16(_) => unreachable!(),
        };
        assert_eq!(mean(true), [188, 188, 188, 128]);
        assert_eq!(mean(false), [128; 4]);
    }

    #[test]
    fn odd_sides_are_weighed_by_area() {
        let row = vec![[0, 0, 0, 0], [30, 0, 0, 0], [60, 0, 0, 0]];
        let row = image(3, 1, row);
        let mipmaps = Mipmaps::of(&row, false);
        let Pixels::Rgba8(last) = mipmaps.levels[1].2.as_ref() else { unreachable!() };
        assert_eq!(last[0][0], 30);
        assert_eq!(covered(0, 5, 2), (0, [0.4, 0.4, 0.2]));
    }
}
