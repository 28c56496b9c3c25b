//! What each safeguard prevents, as pictures: left with it, right without.

use super::scenes::{elsewhere, grey, scene_of};
use crate::error::{Error, Result};
use crate::film::{Film, Format};
use crate::render::{Options, Renderer, Sabotage};
use crate::scene::{built_in, shapes, CameraChoice, Light, Scene};
use glam::{DMat4, DVec3};
use std::path::{Path, PathBuf};

/// Size of each of the two halves.
const SIZE: (u32, u32) = (320, 240);

/// A safeguard with a scene that shows what is wrong without it.
struct Failure {
    name: &'static str,
    sabotage: Sabotage,
    scene: Scene,
    options: Options,
}

/// The pictures: by name, with the scene.
fn failures() -> Result<Vec<Failure>> {
    let table = built_in("table")?;
    let options = Options { size: SIZE, samples: 4, ..Options::default() };
    let ground = (shapes::ground(), DMat4::from_scale(DVec3::splat(1e6)), grey(0.1, 0.5, 0.0));
    let cube = (shapes::cube(), DMat4::from_translation(DVec3::Y * 0.5), grey(0.2, 0.3, 0.1));
    let sun = Light::directional(DVec3::new(1.0, -1.0, 0.3), DVec3::ONE);
    let plain = scene_of([ground, cube], vec![sun]);
    let on_plain = CameraChoice::LookAt { eye: DVec3::new(2.0, 1.5, 3.0), target: Some(DVec3::Y * 0.3) };
    let failure =
        |name, sabotage, scene, options: &Options| Failure { name, sabotage, scene, options: options.clone() };
    Ok(vec![
        failure("fixed-epsilon", Sabotage::FixedEpsilon, elsewhere(&table, 1e4, DVec3::ZERO), &options),
        failure("far-away", Sabotage::NoRebase, elsewhere(&table, 1.0, DVec3::new(1e5, 0.0, -1e5)), &options),
        failure("vast-ground", Sabotage::NoRebase, plain, &Options { camera: on_plain, ..options.clone() }),
    ])
}

/// Writes a PNG for each safeguard into a folder; returns their paths.
///
/// # Errors
/// What rendering and writing answer.
pub fn write(renderer: &Renderer, base: &Options, folder: &Path) -> Result<Vec<PathBuf>> {
    std::fs::create_dir_all(folder).map_err(|error| Error::write(folder, error))?;
    let mut paths = Vec::new();
    for Failure { name, sabotage, scene, options } in failures()? {
        let options = Options { interrupted: base.interrupted.clone(), ..options };
        let with = renderer.render(&scene, &options)?.0;
        let without = renderer.render(&scene, &Options { sabotage: Some(sabotage), ..options })?.0;
        let path = folder.join(format!("{name}.png"));
        beside(&with, &without).save(&path, Format::Png8, || Ok(()))?;
        paths.push(path);
    }
    Ok(paths)
}

/// Two pictures of one size side by side.
fn beside(left: &Film, right: &Film) -> Film {
    let rows = left.pixels.chunks(left.width as usize).zip(right.pixels.chunks(right.width as usize));
    let pixels = rows.flat_map(|(left, right)| left.iter().chain(right)).copied().collect();
    Film { width: left.width + right.width, height: left.height, pixels, has_alpha: false }
}
