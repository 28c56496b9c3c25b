//! The oracle: the same picture in f64, by plain recursion over every triangle. No tree, no queues, no GPU, and no line in
//! common with the kernels: where both agree, two independent programs do.
//!
//! Intersection is by Möller and Trumbore (JGT 2(1) 1997), not by the kernels' method; vectors, lights and sampling are
//! written down again from their sources.

mod sampling;
mod surface;
mod texture;
mod verdict;

pub use verdict::allows;

use crate::error::{Error, Result};
use crate::film::Film;
use crate::scene::{precedence, Background, Crossing, Light, LightKind, Projection, Scene, Soup, View};
use glam::DVec3;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Called with rows done and rows in all.
pub type Progress<'a> = &'a (dyn Fn(u64, u64) + Sync);

/// Renders the view; one row after the other on all threads.
///
/// # Errors
/// `Interrupted` when the flag is set.
pub fn render(
    scene: &Scene,
    soup: &Soup,
    view: &View,
    interrupted: &AtomicBool,
    progress: Option<Progress>,
) -> Result<Film> {
    let precedence = precedence(scene, soup);
    let spread = sampling::Spread::new(view);
    let (library, scale) = (texture::Library::new(scene), (soup.hi - soup.lo).length().max(1e-30));
    let tracer = Tracer { scene, soup, view, spread, precedence, library, scale };
    let mut film = Film::new(view.width, view.height, view.background == Background::Transparent);
    let done = AtomicU64::new(0);
    film.pixels.par_chunks_mut(view.width as usize).enumerate().try_for_each(|(y, row)| {
        if interrupted.load(Ordering::Relaxed) {
            return Err(Error::Interrupted);
        }
        for (x, pixel) in row.iter_mut().enumerate() {
            *pixel = tracer.pixel(x as u32, y as u32);
        }
        if let Some(progress) = progress {
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, view.height.into());
        }
        Ok(())
    })?;
    Ok(film)
}

struct Tracer<'a> {
    scene: &'a Scene,
    soup: &'a Soup,
    view: &'a View,
    spread: sampling::Spread,
    /// Which of several hits at the same distance is seen.
    precedence: Vec<u32>,
    library: texture::Library<'a>,
    /// Size of the scene, to which offsets are relative.
    scale: f64,
}

#[derive(Clone, Copy)]
struct Ray {
    origin: DVec3,
    direction: DVec3,
}

struct Hit {
    t: f64,
    primitive: usize,
    front: bool,
    /// λ2, λ3.
    barycentrics: (f64, f64),
}

impl Hit {
    /// λ1, λ2, λ3.
    fn weights(&self) -> [f64; 3] {
        weights_of(self.barycentrics)
    }
}

fn weights_of((u, v): (f64, f64)) -> [f64; 3] {
    [1.0 - u - v, u, v]
}

/// Most surfaces that are seen through one behind the other.
const LAYERS: u32 = 32;
/// Less than this share of light is none.
const NO_LIGHT: f64 = 1.0 / 4096.0;

/// What a ray has behind it.
#[derive(Clone, Copy, Default)]
struct Way {
    travelled: f64,
    mirrors: u32,
    layers: u32,
}

impl Tracer<'_> {
    fn pixel(&self, x: u32, y: u32) -> [f32; 4] {
        let view = self.view;
        let (mut color, mut alpha, mut weights) = (DVec3::ZERO, 0.0, 0.0);
        for index in view.first_sample..view.first_sample + view.samples {
            let (dx, dy, weight) = if view.samples == 1 {
                (0.5, 0.5, 1.0)
            } else {
                sampling::position(view, &self.spread, y * view.width + x, index)
            };
            weights += weight;
            let ray = self.camera_ray(f64::from(x) + dx, f64::from(y) + dy);
            let (radiance, coverage) = self.seen(&ray, Way::default());
            color += weight * radiance;
            alpha += weight * coverage;
        }
        let expected = f64::from(view.samples) * self.spread.mean_weight;
        let divisor = if weights > 0.5 * expected { weights } else { expected };
        let mean = (color / divisor).as_vec3();
        [mean.x, mean.y, mean.z, (alpha / divisor) as f32]
    }

    fn camera_ray(&self, x: f64, y: f64) -> Ray {
        let (width, height) = (f64::from(self.view.width), f64::from(self.view.height));
        let camera = &self.view.camera;
        let (right, up) = camera.half_axes(width / height);
        let offset = right * (2.0 * x / width - 1.0) + up * (1.0 - 2.0 * y / height);
        match camera.projection {
            Projection::Perspective { .. } => {
                Ray { origin: camera.eye, direction: (camera.forward + offset).normalize() }
            }
            Projection::Orthographic { .. } => Ray { origin: camera.eye + offset, direction: camera.forward },
        }
    }

    /// λ2, λ3, t and whether the front is hit; for a ray that meets the triangle in front of its origin.
    fn intersect(&self, ray: &Ray, primitive: usize) -> Option<(f64, f64, f64, bool)> {
        let crossing = Crossing::of(&self.soup.positions[primitive], ray.origin, ray.direction);
        let Crossing { u, v, t, determinant } = crossing;
        crossing.is_hit().then_some((u, v, t, determinant > 0.0))
    }

    /// The nearest hit of all triangles; of several at the same distance a front before a back, then the one that takes precedence, then the first in the soup.
    fn nearest(&self, ray: &Ray) -> Option<Hit> {
        let mut nearest: Option<Hit> = None;
        for primitive in 0..self.soup.len() {
            let Some((u, v, t, front)) = self.intersect(ray, primitive) else { continue };
            let seen = front || !self.soup.flags[primitive].single_sided;
            let before = |hit: &Hit| {
                t < hit.t
                    || (t == hit.t
                        && (!front, self.precedence[primitive]) < (!hit.front, self.precedence[hit.primitive]))
            };
            let is_there =
                || !self.soup.flags[primitive].see_through || self.veil(primitive, weights_of((u, v))).alpha > 0.0;
            if seen && nearest.as_ref().is_none_or(before) && is_there() {
                nearest = Some(Hit { t, primitive, front, barycentrics: (u, v) });
            }
        }
        nearest
    }

    /// What of light comes through all that lies on the ray closer than `distance`, fronts and backs.
    fn passed(&self, ray: &Ray, distance: f64) -> DVec3 {
        let mut passed = DVec3::ONE;
        for primitive in 0..self.soup.len() {
            let Some((u, v, _, _)) = self.intersect(ray, primitive).filter(|(_, _, t, _)| *t < distance) else {
                continue;
            };
            if !self.soup.flags[primitive].see_through {
                return DVec3::ZERO;
            }
            let veil = self.veil(primitive, weights_of((u, v)));
            let clear = 1.0 - veil.alpha;
            let stained = DVec3::ONE * clear + veil.color * veil.alpha;
            passed *= clear * stained + veil.alpha * veil.transmission * veil.inside;
            if passed.max_element() < NO_LIGHT {
                return DVec3::ZERO;
            }
        }
        passed
    }

    /// Radiance and coverage along a ray.
    fn seen(&self, ray: &Ray, way: Way) -> (DVec3, f64) {
        match self.nearest(ray) {
            Some(hit) => self.shade(ray, &hit, Way { travelled: way.travelled + hit.t, ..way }),
            None => (self.view.background.radiance(ray.direction), self.view.background.alpha()),
        }
    }

    /// Ambient + emission + lights + mirror + what is behind, as seen along the ray, and how much of that is something.
    fn shade(&self, ray: &Ray, hit: &Hit, way: Way) -> (DVec3, f64) {
        let surface = self.surface(ray, hit, way.travelled);
        let (point, plane_normal, normal) = (surface.point, surface.plane_normal, surface.normal);
        let whitted = surface.material.whitted(surface.tint);
        // Far above f64's rounding, far below whatever can be seen.
        let off = 1e-10 * hit.t + 2e-15 * self.scale;
        let leave = |direction: DVec3| {
            let side = if plane_normal.dot(direction) < 0.0 { -1.0 } else { 1.0 };
            Ray { origin: point + plane_normal * (side * off), direction }
        };

        let from_curve = |direction: DVec3| Ray { origin: surface.raised + plane_normal * off, direction };
        let mut color = whitted.ambient * surface.occlusion + surface.material.emission;
        let to_viewer = -ray.direction;
        for light in &self.view.lights {
            let (to_light, distance, irradiance) = arriving(light, point);
            let cosine = normal.dot(to_light);
            if cosine <= 0.0 || irradiance == DVec3::ZERO {
                continue;
            }
            let passed = self.passed(&from_curve(to_light), distance);
            if passed == DVec3::ZERO {
                continue;
            }
            let halfway = (to_light + to_viewer).normalize();
            let gloss = normal.dot(halfway).max(0.0).powf(whitted.shininess);
            color += irradiance * passed * (whitted.diffuse * cosine + whitted.specular * gloss);
        }
        let (alpha, through) = if self.soup.flags[hit.primitive].see_through {
            let veil = self.veil(hit.primitive, hit.weights());
            (veil.alpha, DVec3::splat(1.0 - veil.alpha) + veil.inside * (veil.alpha * veil.transmission))
        } else {
            (1.0, DVec3::ZERO)
        };
        if way.mirrors < self.view.max_depth && whitted.mirror.max_element() > 0.0 {
            // r = 2(n·v)n − v, out of the surface.
            let mut reflected = normal * (2.0 * normal.dot(to_viewer)) - to_viewer;
            if self.scene.materials[self.soup.materials[hit.primitive] as usize].drawn_maps().normal.is_some() {
                reflected -= plane_normal * (2.0 * reflected.dot(plane_normal).min(0.0));
            }
            let reflected = reflected.normalize();
            let seen = if through.max_element() > 0.0 {
                // A ray goes on one way only.
                self.view.background.radiance(reflected)
            } else {
                self.seen(&leave(reflected), Way { mirrors: way.mirrors + 1, ..way }).0
            };
            color += whitted.mirror * seen;
        }
        let mut coverage = alpha;
        color *= alpha;
        if through.max_element() > 0.0 {
            let (behind, covered) = if way.layers < LAYERS {
                self.seen(&leave(ray.direction), Way { layers: way.layers + 1, ..way })
            } else {
                (self.view.background.radiance(ray.direction), 0.0)
            };
            color += through * behind;
            coverage += (1.0 - alpha) * covered;
        }
        (color, coverage)
    }
}

/// Direction to the light, distance, and irradiance on a surface that faces it (KHR_lights_punctual).
fn arriving(light: &Light, point: DVec3) -> (DVec3, f64, DVec3) {
    if light.kind == LightKind::Directional {
        return (-light.direction, f64::INFINITY, light.intensity);
    }
    let to_light = light.position - point;
    let distance = to_light.length();
    let direction = to_light / distance;
    let mut strength = 1.0 / (distance * distance);
    if let Some(range) = light.range {
        strength *= (1.0 - (distance / range).powi(4)).clamp(0.0, 1.0);
    }
    if let LightKind::Spot { inner_cosine, outer_cosine } = light.kind {
        let cosine = light.direction.dot(-direction);
        let cone = ((cosine - outer_cosine) / (inner_cosine - outer_cosine).max(0.001)).clamp(0.0, 1.0);
        strength *= cone * cone;
    }
    (direction, distance, light.intensity * strength)
}
