//! File → film.

use super::Film;
use crate::error::{Error, Result};
use crate::srgb::decode;
use image::{DynamicImage, ImageReader};
use rayon::prelude::*;
use std::path::Path;

/// Reads PNG, WebP, OpenEXR or Radiance HDR; what it is, its content says.
///
/// # Errors
/// `Read` when the file cannot be read, `Content` when it is no picture.
pub fn read(path: &Path) -> Result<Film> {
    let file = path.display().to_string();
    let open = |source| Error::Read { path: path.to_owned(), source };
    let reader = ImageReader::open(path).map_err(open)?.with_guessed_format().map_err(open)?;
    let image = reader.decode().map_err(|error| Error::content(&file, error))?;
    let linear = matches!(image, DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_));
    let has_alpha = image.color().has_alpha();
    let image = image.into_rgba32f();
    let (width, height) = image.dimensions();
    // EXR stores colour times alpha, like the film; PNG and WebP do not.
    let pixel = |&[r, g, b, a]: &[f32; 4]| {
        if linear {
            [r, g, b, a]
        } else {
            let linear = |value: f32| decode(value.into()) as f32 * a;
            [linear(r), linear(g), linear(b), a]
        }
    };
    let pixels = image.into_raw().as_chunks().0.par_iter().map(pixel).collect();
    Ok(Film { width, height, pixels, has_alpha })
}
