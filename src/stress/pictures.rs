//! Cases judged by whole pictures, beside the f64 reference or each other.

use super::rays::leaving_faces;
use super::scenes::{elsewhere, grey, scene_of, tilt};
use super::{exceeds, Finding, Stress};
use crate::error::{Error, Result};
use crate::film::Film;
use crate::reference;
use crate::render::Options;
use crate::scene::{built_in, shapes, Background, CameraChoice, Light, Mesh, Scene, Soup};
use glam::{DMat4, DVec3, Vec3};

/// Pixels that may differ by more than 1/255 of white: those whose centre lies within rounding of an edge.
const EDGE_PIXELS: f64 = 1e-3;

impl Stress<'_> {
    /// A picture on the device.
    fn draw(&self, scene: &Scene, options: &Options) -> Result<Film> {
        self.renderer.render(scene, options).map(|(film, _)| film)
    }

    /// The same picture by the reference.
    fn witness(&self, scene: &Scene, options: &Options) -> Result<Film> {
        let soup = Soup::of(scene)?;
        let view = options.view(scene, &soup)?;
        reference::render(scene, &soup, &view, &options.interrupted, None)
    }

    /// Device and reference must agree.
    fn as_witness(&self, scene: &Scene, options: &Options) -> Result<Finding> {
        alike(&self.witness(scene, options)?, &self.draw(scene, options)?)
    }

    /// Options of a small picture from a camera.
    fn small(&self, eye: DVec3, target: DVec3) -> Options {
        let camera = CameraChoice::LookAt { eye, target: Some(target) };
        Options { size: (96, 72), camera, ..self.options.clone() }
    }
}

/// Few enough pixels differ.
fn alike(expected: &Film, film: &Film) -> Result<Finding> {
    let metrics = crate::film::compare(expected, film)?;
    let pixels = film.pixels.len() as f64;
    let is_finite = film.pixels.iter().flatten().all(|value| value.is_finite());
    let error = if is_finite { metrics.over_1_255 } else { f64::INFINITY };
    let wrong = (metrics.over_1_255 * pixels).round() as u64;
    Ok(Finding { rays: pixels as u64, wrong, error, bound: EDGE_PIXELS })
}

/// The RMSE of the pictures as shown is below 1/255, and few enough pixels differ.
fn as_home(home: &Film, film: &Film) -> Result<Finding> {
    let share = alike(home, film)?;
    let rmse = crate::film::compare(home, film)?.rmse;
    let error = if exceeds(share.error, share.bound) { f64::INFINITY } else { rmse };
    Ok(Finding { error, bound: 1.0 / 255.0, ..share })
}

/// Rays that leave a cube.
pub(super) fn self_hit(stress: &mut Stress) -> Result<()> {
    for scale in stress.few(&[1e-6, 1e-3, 1.0, 1e3, 1e6], &[1e-6, 1.0, 1e6]) {
        stress.row("outward, scale", scale, |stress| outward(stress, scale, 0.0, 0.05))?;
        stress.row("inward, scale", scale, |stress| inward(stress, scale, 0.0, 0.2))?;
    }
    for offset in stress.few(&[1e1, 1e3, 1e5, 1e7], &[1e3, 1e7]) {
        stress.row("outward, offset", offset, |stress| outward(stress, 1.0, offset, 0.05))?;
        stress.row("inward, offset", offset, |stress| inward(stress, 1.0, offset, 0.2))?;
    }
    for angle in stress.few(&[1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6], &[1e-2, 1e-4, 1e-6]) {
        stress.row("outward, grazing angle", angle, |stress| outward(stress, 1.0, 0.0, angle))?;
        stress.row("inward, grazing angle", angle, |stress| inward(stress, 1.0, 0.0, angle))?;
    }
    leaving_faces(stress)
}

/// A cube's face under light that grazes it: every pixel of it is lit.
fn outward(stress: &Stress, scale: f64, offset: f64, angle: f64) -> Result<Finding> {
    let tilt = tilt();
    let light = tilt.transform_vector3(DVec3::new(0.6 * angle.cos(), -angle.sin(), 0.8 * angle.cos()));
    let lights = vec![Light::directional(light, DVec3::splat(1.0 / angle.sin()))];
    let scene = scene_of([(shapes::cube(), tilt, grey(0.0, 1.0, 0.0))], lights);
    let offset = DVec3::splat(offset * scale);
    let place = |point: DVec3| offset + tilt.transform_point3(point) * scale;
    let options = stress.small(place(DVec3::new(0.1, 1.5, 0.05)), place(DVec3::Y * 0.5));
    // Nothing but the face is in the picture.
    let options = Options { fov: Some(0.55), size: (256, 192), ..options };
    let film = stress.draw(&elsewhere(&scene, scale, offset), &options)?;
    // The normal is known to some 1e-7, which is much of a small angle.
    let tolerance = 1e-3 + 4e-7 / angle;
    let wrong = film.pixels.iter().filter(|pixel| exceeds((f64::from(pixel[0]) - 1.0).abs(), tolerance)).count();
    Ok(Finding::none_of(film.pixels.len() as u64, wrong as u64))
}

/// Reflections of reflections in a closed box.
const BOUNCES: u32 = 32;

/// A closed box of mirrors seen from inside, first along a wall: no light comes in.
fn inward(stress: &Stress, scale: f64, offset: f64, angle: f64) -> Result<Finding> {
    let tilt = tilt();
    let scene = scene_of([(shapes::cube(), tilt, grey(0.0, 0.0, 1.0))], Vec::new());
    let offset = DVec3::splat(offset * scale);
    let place = |point: DVec3| offset + tilt.transform_point3(point) * scale;
    let eye = DVec3::new(-0.45, -0.5 + 0.5 * angle, -0.3);
    let options = stress.small(place(eye), place(eye + DVec3::new(0.8, -angle, 0.6)));
    let background = Background::Constant(DVec3::ONE);
    let options = Options { fov: Some((4.0 * angle).min(1.0)), max_depth: BOUNCES, background, ..options };
    let film = stress.draw(&elsewhere(&scene, scale, offset), &options)?;
    let wrong = film.pixels.iter().filter(|pixel| pixel[0] != 0.0).count();
    Ok(Finding::none_of(film.pixels.len() as u64 * u64::from(BOUNCES + 1), wrong as u64))
}

/// Small things beside large ones.
pub(super) fn stiff_scales(stress: &mut Stress) -> Result<()> {
    let exponents = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12];
    for exponent in stress.few(&exponents, &[0, 3, 6, 9, 12]) {
        let ratio = 10_f64.powi(exponent);
        stress.row("ground : cube", ratio, |stress| on_ground(stress, ratio))?;
    }
    for levels in stress.few(&[1, 2, 4, 6, 8, 10, 12], &[4, 12]) {
        stress.row("levels, each ten times smaller", f64::from(levels), |stress| nested(stress, levels))?;
    }
    Ok(())
}

/// A millimetre cube on a tilted ground `ratio` times as large.
fn on_ground(stress: &Stress, ratio: f64) -> Result<Finding> {
    let (size, tilt) = (1e-3, tilt());
    let ground = (shapes::ground(), tilt * DMat4::from_scale(DVec3::splat(4.0 * size * ratio)), grey(0.1, 0.5, 0.0));
    let standing = tilt * DMat4::from_scale(DVec3::splat(size)) * DMat4::from_translation(DVec3::Y * 0.5);
    let cube = (shapes::cube(), standing, grey(0.2, 0.3, 0.1));
    let sun = Light::directional(tilt.transform_vector3(DVec3::new(1.0, -1.0, 0.3)), DVec3::ONE);
    let place = |point: DVec3| tilt.transform_point3(point * size);
    let options = stress.small(place(DVec3::new(2.0, 3.0, 4.0)), place(DVec3::ZERO));
    stress.as_witness(&scene_of([ground, cube], vec![sun]), &options)
}

/// Cubes around the eye, each ten times as large and as far away as the one before.
fn nested(stress: &Stress, levels: u32) -> Result<Finding> {
    let cube = |level: u32| {
        let size = 1e-6 * 10_f64.powi(level as i32);
        let (column, row) = (f64::from(level % 4) - 1.5, f64::from(level / 4) - 1.0);
        let place = DVec3::new(0.35 * column, 0.35 * row, -1.0) * size;
        let transform = DMat4::from_translation(place) * tilt() * DMat4::from_scale(DVec3::splat(0.17 * size));
        (shapes::cube(), transform, grey(0.1, 0.3 + 0.04 * f64::from(level), 0.2))
    };
    let sun = Light::directional(DVec3::new(0.5, -1.0, -0.7), DVec3::splat(2.0));
    let scene = scene_of((0..levels).map(cube), vec![sun]);
    stress.as_witness(&scene, &stress.small(DVec3::ZERO, DVec3::NEG_Z))
}

/// The table elsewhere and in other units.
pub(super) fn far_away(stress: &mut Stress) -> Result<()> {
    let scene = built_in("table")?;
    let options = Options { size: (160, 120), ..stress.options.clone() };
    let home = stress.draw(&scene, &Options { sabotage: None, ..options.clone() })?;
    // The table stands in a square of this width.
    let size = 14.0;
    let powers = stress.few(&[0, 1, 2, 3, 4, 5, 6, 7, 8], &[0, 4, 8]);
    for offset in powers.iter().map(|power| 10_f64.powi(*power)) {
        let moved = elsewhere(&scene, 1.0, DVec3::new(0.8, 0.0, -0.6) * offset * size);
        stress.row("offset, of its size", offset, |stress| as_home(&home, &stress.draw(&moved, &options)?))?;
    }
    for scale in
        stress.few(&[-6, -5, -4, -3, -2, -1, 1, 2, 3, 4, 5, 6], &[-6, 6]).iter().map(|power| 10_f64.powi(*power))
    {
        let scaled = elsewhere(&scene, scale, DVec3::ZERO);
        stress.row("scale", scale, |stress| as_home(&home, &stress.draw(&scaled, &options)?))?;
    }
    Ok(())
}

/// Matrices that are hard on normals.
pub(super) fn transforms(stress: &mut Stress) -> Result<()> {
    let exponents = stress.few(&[0, 1, 2, 3, 4, 6, 8, 10, 12], &[0, 3, 6, 12]);
    let shear =
        |amount: f64| DMat4::from_cols_array(&[1., 0., 0., 0., amount, 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.]);
    let kinds: [(&str, &dyn Fn(f64) -> DMat4); 3] = [
        ("flattened, 1 : ratio", &|ratio| DMat4::from_scale(DVec3::new(1.0, 1.0, 1.0 / ratio))),
        ("sheared by ratio, as flat as that", &|ratio| {
            shear(ratio) * DMat4::from_scale(DVec3::new(1.0, 1.0 / ratio, 1.0))
        }),
        ("mirrored and flattened, 1 : ratio", &|ratio| DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0 / ratio))),
    ];
    for (name, matrix) in kinds {
        for exponent in &exponents {
            let ratio = 10_f64.powi(*exponent);
            // At the rim of what is flatter than f32 can tell, the two sides of a sheared ball have different vertex normals in one place.
            let scene = transformed(tilt() * matrix(ratio), !name.starts_with("sheared"));
            let options = stress.small(DVec3::new(1.0, 2.0, 4.0), DVec3::ZERO);
            stress.row(name, ratio, |stress| stress.as_witness(&scene, &options))?;
        }
    }
    let flat = transformed(DMat4::from_scale(DVec3::new(1.0, 0.0, 1.0)), true);
    stress.row("without volume", 0.0, |stress| {
        let options =
            Options { background: Background::Constant(DVec3::splat(0.5)), ..stress.small(DVec3::Z, DVec3::ZERO) };
        let (film, report) = stress.renderer.render(&flat, &options)?;
        let says = report.scene.warnings.iter().any(|warning| warning.contains("flatten"));
        Ok(Finding::check(says && film.pixels.iter().all(|pixel| pixel[0] == 0.5)))
    })
}

/// A ball, smooth or flat, and a cube under one matrix, and a light that does not move.
fn transformed(matrix: DMat4, smooth: bool) -> Scene {
    let cube = matrix * DMat4::from_translation(DVec3::X * 2.4) * DMat4::from_scale(DVec3::splat(0.8));
    // An odd number of rings: with vertices on the equator a flattened ball's two sides have different normals at one place.
    let mut ball = shapes::sphere(13);
    if !smooth {
        ball.normals.clear();
    }
    let parts = [(ball, matrix, grey(0.1, 0.4, 0.0)), (shapes::cube(), cube, grey(0.1, 0.6, 0.0))];
    scene_of(parts, vec![Light::point(DVec3::new(3.0, 5.0, 6.0), DVec3::splat(40.0))])
}

/// Views.
pub(super) fn cameras(stress: &mut Stress) -> Result<()> {
    let target = bulls_eye();
    for degrees in stress.few(&[1e-3, 1e-2, 0.1, 1.0, 10.0, 60.0, 120.0, 170.0, 179.0, 179.9], &[1e-3, 1.0, 179.9]) {
        let options =
            Options { fov: Some(f64::to_radians(degrees)), ..stress.small(DVec3::ZERO, DVec3::new(0.2, 0.3, -1.0)) };
        stress.row("field of view, degrees", degrees, |stress| stress.as_witness(&target, &options))?;
    }
    let room = built_in("cornell")?;
    let on_floor = stress.small(DVec3::new(0.1, 0.0, 0.9), DVec3::new(0.0, 0.3, -0.5));
    stress.row("eye on a surface", 0.0, |stress| stress.as_witness(&room, &on_floor))?;
    let ball = scene_of(
        [(shapes::sphere(16), tilt(), grey(0.1, 0.4, 0.3))],
        vec![Light::point(DVec3::splat(0.2), DVec3::ONE)],
    );
    let in_ball = Options { max_depth: 2, ..stress.small(DVec3::new(0.1, 0.0, 0.3), DVec3::X) };
    stress.row("eye in a solid", 0.0, |stress| stress.as_witness(&ball, &in_ball))?;
    let along_up = stress.small(DVec3::Y * 3.0, DVec3::ZERO);
    stress.row("view along up", 0.0, |stress| match stress.draw(&room, &along_up) {
        Err(Error::Usage(message)) if message.contains("parallel to its up") => Ok(Finding::check(true)),
        _ => Ok(Finding::check(false)),
    })
}

/// Squares one before the other, each a third of the size of the one behind it, so that every field of view sees edges.
fn bulls_eye() -> Scene {
    let toward = DVec3::new(0.2, 0.3, -1.0).normalize();
    let right = toward.cross(DVec3::Y).normalize();
    let up = right.cross(toward);
    let square = |level: i32| {
        let size = 30.0 * 3_f64.powi(-level);
        let turned = DMat4::from_axis_angle(toward, 0.3 + f64::from(level));
        // Its corners are rounded to f32 in its own space, where it has size 1, and placed in f64.
        let axes = DMat4::from_cols(right.extend(0.0), up.extend(0.0), (-toward).extend(0.0), glam::DVec4::W);
        let place = DMat4::from_translation(toward * (1.0 - 0.01 * f64::from(level)));
        let mesh: Mesh =
            shapes::square([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(x, y)| Vec3::new(x, y, 0.0)));
        (
            mesh,
            place * turned * axes * DMat4::from_scale(DVec3::splat(size)),
            grey(0.1 + 0.8 * f64::from(level % 2), 0.0, 0.0),
        )
    };
    scene_of((0..16).map(square), Vec::new())
}
