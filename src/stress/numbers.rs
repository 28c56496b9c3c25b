//! Cases judged by closed forms.

use super::scenes::{grey, scene_of};
use super::{Finding, Stress};
use crate::error::Result;
use crate::film::Film;
use crate::render::Options;
use crate::scene::{shapes, Background, CameraChoice, Light, Scene};
use glam::{DMat4, DVec3};

/// Relative error that is allowed.
const FIVE_DIGITS: f64 = 1e-5;

/// Radiance that each face of the box adds.
const ADDED: f64 = 0.01;

/// Largest relative error of any channel of any pixel.
fn worst(film: &Film, expected: f64) -> f64 {
    let error = |value: &f32| (f64::from(*value) / expected - 1.0).abs();
    // NaN is not below anything: it must not be lost.
    film.pixels
        .iter()
        .flat_map(|pixel| &pixel[..3])
        .map(error)
        .fold(0.0, |worst, error| if error <= worst { worst } else { error })
}

/// A picture of 16 × 16 pixels from inside the closed box.
fn in_box(stress: &Stress, reflectance: f64, depth: u32) -> Result<Film> {
    let room = (shapes::cube(), DMat4::from_scale(DVec3::splat(3.0)), grey(ADDED, 0.0, reflectance));
    let camera = CameraChoice::LookAt { eye: DVec3::new(0.3, 0.2, 0.1), target: Some(DVec3::new(1.0, 0.7, 0.4)) };
    let options = Options { size: (16, 16), max_depth: depth, camera, ..stress.options.clone() };
    stress.renderer.render(&scene_of([room], Vec::new()), &options).map(|(film, _)| film)
}

/// Reflectances and numbers of reflections.
fn halls(stress: &Stress) -> Vec<(f64, u32)> {
    let reflectances = stress.few(&[0.9, 0.99, 0.999, 0.9999], &[0.9, 0.9999]);
    let depths = stress.few(&[1, 10, 100, 1000], &[10, 1000]);
    reflectances.iter().flat_map(|s| depths.iter().map(|depth| (*s, *depth))).collect()
}

/// The sum of a geometric series.
pub(super) fn hall_of_mirrors(stress: &mut Stress) -> Result<()> {
    for (s, depth) in halls(stress) {
        stress.row(&format!("reflections, s = {s}"), f64::from(depth), |stress| {
            let film = in_box(stress, s, depth)?;
            let exact = ADDED * (1.0 - s.powi(depth as i32 + 1)) / (1.0 - s);
            let error = worst(&film, exact);
            let rays = film.pixels.len() as u64 * u64::from(depth + 1);
            Ok(Finding::figure(rays, error, FIVE_DIGITS))
        })?;
    }
    Ok(())
}

/// What stopping after so many reflections leaves out, measured: the part of the whole that is missing.
pub(super) fn truncation(stress: &mut Stress) -> Result<()> {
    for (s, depth) in halls(stress) {
        stress.row(&format!("reflections, s = {s}"), f64::from(depth), |stress| {
            let film = in_box(stress, s, depth)?;
            let missing = worst(&film, ADDED / (1.0 - s));
            let expected = s.powi(depth as i32 + 1);
            let rays = film.pixels.len() as u64 * u64::from(depth + 1);
            let bound = expected + FIVE_DIGITS;
            let is_less = missing < expected - FIVE_DIGITS;
            Ok(Finding::figure(rays, if is_less { f64::INFINITY } else { missing }, bound))
        })?;
    }
    Ok(())
}

/// Very dark, very bright, very many.
pub(super) fn radiance(stress: &mut Stress) -> Result<()> {
    for power in stress.few(&[-12, -9, -6, -3, 0, 3, 6, 9, 12], &[-12, 0, 12]) {
        let strength = 10_f64.powi(power);
        stress.row("parallel light, lux", strength, |stress| {
            let light = Light::directional(DVec3::new(0.0, -1.0, 0.0), DVec3::splat(strength));
            under(stress, light, 0.5 * strength)
        })?;
        stress.row("point light, candela", strength, |stress| {
            // So far away that it is the same everywhere in the picture.
            let light = Light::point(DVec3::Y * 1e4, DVec3::splat(strength));
            under(stress, light, 0.5 * strength / 1e8)
        })?;
    }
    for samples in stress.few(&[1, 10, 100, 1_000, 10_000, 100_000, 1_000_000], &[100, 1_000_000]) {
        stress.row("samples a pixel", f64::from(samples), |stress| many_samples(stress, samples))?;
    }
    Ok(())
}

/// A square of diffuse reflectance ½ seen from above.
fn square(ambient: f64, lights: Vec<Light>) -> Scene {
    scene_of([(shapes::ground(), DMat4::IDENTITY, grey(ambient, 0.5, 0.0))], lights)
}

fn from_above(stress: &Stress) -> Options {
    let camera = CameraChoice::LookAt { eye: DVec3::new(0.0, 0.3, 0.05), target: Some(DVec3::ZERO) };
    let background = Background::Constant(DVec3::ZERO);
    Options { size: (16, 12), camera, background, ..stress.options.clone() }
}

fn under(stress: &Stress, light: Light, expected: f64) -> Result<Finding> {
    let (film, report) = stress.renderer.render(&square(0.0, vec![light]), &from_above(stress))?;
    let error = worst(&film, expected);
    Ok(Finding::figure(report.rays.primary + report.rays.shadow, error, FIVE_DIGITS))
}

/// One pixel of one colour: its mean is that colour however many samples there are.
fn many_samples(stress: &Stress, samples: u32) -> Result<Finding> {
    let ambient = 0.1;
    let options = Options { size: (1, 1), samples, samples_in_flight: 1 << 20, ..from_above(stress) };
    let (film, report) = stress.renderer.render(&square(ambient, Vec::new()), &options)?;
    let error = worst(&film, ambient);
    Ok(Finding::figure(report.rays.primary, error, FIVE_DIGITS))
}
