//! How far two pictures are apart.
//!
//! [`compare`] looks at the picture as it is shown: sRGB, 0 to 1, transparent parts on black. FLIP (Andersson et al., HPG
//! 2020) is by the `nv-flip` crate at 67 pixels a degree, SSIM (Wang et al. 2004) by `image-compare`. [`compare_linear`] looks at
//! radiance.

use super::Film;
use crate::error::{Error, Result};
use image::RgbImage;
use rayon::prelude::*;
use serde::Serialize;

/// Distances between two pictures; 0 means equal, except for `psnr` (infinite, `null` in JSON) and `ssim` (1).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Metrics {
    /// Root of the mean squared difference.
    pub rmse: f64,
    /// Peak signal-to-noise ratio in dB.
    pub psnr: f64,
    /// Largest difference of any channel.
    pub max: f64,
    /// Share of pixels with a channel more than 1/255 apart.
    pub over_1_255: f64,
    /// Structural similarity, least of the three channels.
    pub ssim: f64,
    /// Mean FLIP error.
    pub flip: f64,
    /// The same in linear RGB, not clamped.
    pub linear: LinearMetrics,
}

/// Distances in linear RGB times alpha, as rendered.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LinearMetrics {
    /// Root of the mean squared difference.
    pub rmse: f64,
    /// Mean of the squared difference over the reference's square plus 0.01 (Rousselle, Knaus and Zwicker, SIGGRAPH Asia 2011).
    pub rel_mse: f64,
    /// Largest difference of any channel.
    pub max: f64,
}

/// Linear metrics of `test` against `reference`.
///
/// # Errors
/// `Usage` when the sizes differ.
pub fn compare_linear(reference: &Film, test: &Film) -> Result<LinearMetrics> {
    same_size(reference, test)?;
    let (mut squares, mut relative, mut max) = (0.0_f64, 0.0_f64, 0.0_f64);
    for (a, b) in reference.pixels.iter().zip(&test.pixels) {
        for channel in 0..3 {
            let (a, b) = (f64::from(a[channel]), f64::from(b[channel]));
            let square = (a - b) * (a - b);
            squares += square;
            relative += square / (a * a + 0.01);
            max = max.max((a - b).abs());
        }
    }
    let count = 3.0 * reference.pixels.len() as f64;
    Ok(LinearMetrics { rmse: (squares / count).sqrt(), rel_mse: relative / count, max })
}

/// Shown value of every pixel, on black.
fn shown(film: &Film) -> Vec<[f32; 3]> {
    let pixel = |index| {
        let [r, g, b, a] = film.srgb(index);
        [r * a, g * a, b * a]
    };
    (0..film.pixels.len()).into_par_iter().map(pixel).collect()
}

/// The same in 8 bits.
fn rgb8(film: &Film, shown: &[[f32; 3]]) -> RgbImage {
    let bytes = shown.as_flattened().iter().map(|value| (value * 255.0 + 0.5) as u8).collect();
    RgbImage::from_raw(film.width, film.height, bytes).unwrap_or_default()
}

fn same_size(a: &Film, b: &Film) -> Result<()> {
    if (a.width, a.height) == (b.width, b.height) {
        return Ok(());
    }
    Err(Error::Usage(format!("pictures differ in size: {} × {} and {} × {}", a.width, a.height, b.width, b.height)))
}

/// FLIP error of every pixel, 0 to 1.
fn flip_map(reference: &RgbImage, test: &RgbImage) -> Vec<f32> {
    let flip = |image: &RgbImage| nv_flip::FlipImageRgb8::with_data(image.width(), image.height(), image.as_raw());
    nv_flip::flip(flip(reference), flip(test), nv_flip::DEFAULT_PIXELS_PER_DEGREE).to_vec()
}

/// All metrics of `test` against `reference`.
///
/// # Errors
/// `Usage` when the sizes differ.
pub fn compare(reference: &Film, test: &Film) -> Result<Metrics> {
    same_size(reference, test)?;
    let (mut squares, mut max, mut over) = (0.0_f64, 0.0_f64, 0_usize);
    let (shown_reference, shown_test) = (shown(reference), shown(test));
    for (a, b) in shown_reference.iter().zip(&shown_test) {
        let differences = [0, 1, 2].map(|channel| f64::from(a[channel] - b[channel]).abs());
        let largest = differences.into_iter().fold(0.0, f64::max);
        squares += differences.iter().map(|difference| difference * difference).sum::<f64>();
        max = max.max(largest);
        // A little over 1/255, so that 8-bit neighbours count as within it.
        over += usize::from(largest > 1.0001 / 255.0);
    }
    let pixels = reference.pixels.len() as f64;
    let rmse = (squares / (3.0 * pixels)).sqrt();
    let (image, test_image) = (rgb8(reference, &shown_reference), rgb8(test, &shown_test));
    let similarity =
        image_compare::rgb_similarity_structure(&image_compare::Algorithm::MSSIMSimple, &image, &test_image)
            .map_err(|error| Error::Usage(format!("structural similarity: {error}")))?;
    let flip = flip_map(&image, &test_image);
    Ok(Metrics {
        rmse,
        psnr: -20.0 * rmse.log10(),
        max,
        over_1_255: over as f64 / pixels,
        ssim: similarity.score,
        flip: flip.iter().map(|value| f64::from(*value)).sum::<f64>() / pixels,
        linear: compare_linear(reference, test)?,
    })
}

/// FLIP error as colours from black over red and yellow to white, one pixel a pixel.
///
/// # Errors
/// `Usage` when the sizes differ.
pub fn heat_map(reference: &Film, test: &Film) -> Result<Film> {
    same_size(reference, test)?;
    let color = |error: f32| {
        let ramp = |from: f32| ((error - from) * 3.0).clamp(0.0, 1.0);
        [ramp(0.0), ramp(1.0 / 3.0), ramp(2.0 / 3.0), 1.0]
    };
    let image = |film: &Film| rgb8(film, &shown(film));
    let pixels = flip_map(&image(reference), &image(test)).into_iter().map(color).collect();
    Ok(Film { width: reference.width, height: reference.height, pixels, has_alpha: false })
}
