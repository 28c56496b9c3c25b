//! A picture to be taken of a scene: camera, lights that shine, size, samples, depth, background.

use super::{Background, Camera, Filter, Light, Projection, Sampler, Scene};
use crate::error::{Error, Result};
use std::f64::consts::PI;

/// Largest width or height of a picture.
pub const MAX_SIDE: u32 = 65_535;
/// Most pixels of a picture: 16384 × 16384.
pub const MAX_PIXELS: u64 = 1 << 28;
/// Most samples a pixel.
pub const MAX_SAMPLES: u32 = 1 << 20;
/// Most reflections.
pub const MAX_DEPTH: u32 = 1000;

/// What to take a picture of, and how.
#[derive(Clone, Debug)]
pub struct View {
    /// Camera.
    pub camera: Camera,
    /// Lights that are not dark.
    pub lights: Vec<Light>,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Samples a pixel; 1 goes through its centre.
    pub samples: u32,
    /// Reflections one after the other; 0 for none.
    pub max_depth: u32,
    /// What rays that hit nothing see.
    pub background: Background,
    /// Where samples lie.
    pub sampler: Sampler,
    /// How they are weighed.
    pub filter: Filter,
    /// Chooses between samplers' sequences.
    pub seed: u32,
    /// The first of the samples in their sequence; not for stratified ones, which are a set.
    pub first_sample: u32,
}

impl View {
    /// A view of `scene` with the lights that it has.
    ///
    /// # Errors
    /// `Usage` when size, samples or depth are out of bounds.
    pub fn new(scene: &Scene, camera: Camera, size: (u32, u32), samples: u32, max_depth: u32) -> Result<Self> {
        let (width, height) = size;
        if width == 0 || height == 0 || width > MAX_SIDE || height > MAX_SIDE {
            return Err(Error::Usage(format!("size {width}x{height}: each side must be 1 to {MAX_SIDE} pixels")));
        }
        if u64::from(width) * u64::from(height) > MAX_PIXELS {
            return Err(Error::Usage(format!("size {width}x{height}: at most {MAX_PIXELS} pixels (16384x16384)")));
        }
        if !(1..=MAX_SAMPLES).contains(&samples) {
            return Err(Error::Usage(format!("{samples} samples a pixel: must be 1 to {MAX_SAMPLES}")));
        }
        if max_depth > MAX_DEPTH {
            return Err(Error::Usage(format!("maximum depth {max_depth}: must be 0 to {MAX_DEPTH}")));
        }
        let lights = scene.lights.iter().copied().filter(|light| !light.is_dark()).collect();
        Ok(Self {
            camera,
            lights,
            width,
            height,
            samples,
            max_depth,
            background: Background::default(),
            sampler: Sampler::default(),
            filter: Filter::default(),
            seed: 0,
            first_sample: 0,
        })
    }

    /// Adds the default light if the file declares none: parallel light of π lux from above the camera's left shoulder, so
    /// that a white surface that faces it has radiance 1.
    pub fn with_default_light(mut self, scene: &Scene) -> Self {
        if !scene.has_lights {
            let camera = &self.camera;
            let direction = camera.forward + 0.5 * camera.right - 0.75 * camera.up;
            self.lights.push(Light::directional(direction, glam::DVec3::splat(PI)));
        }
        self
    }

    /// The cone of a camera ray: its diameter where it starts, world lengths, and by how much it grows with the ray's length. It covers a
    /// sample's share of the pixel, but no less than a 64th, which is finer than any picture shows.
    pub fn cone(&self) -> [f64; 2] {
        let (_, up) = self.camera.half_axes(f64::from(self.width) / f64::from(self.height));
        let diameter = 2.0 * up.length() / f64::from(self.height) / f64::from(self.samples.min(64)).sqrt();
        match self.camera.projection {
            Projection::Perspective { .. } => [0.0, diameter],
            Projection::Orthographic { .. } => [diameter, 0.0],
        }
    }

    /// Columns and rows of sample cells in a pixel: the most square factors of the number of samples.
    pub fn strata(&self) -> (u32, u32) {
        let root = f64::from(self.samples).sqrt() as u32;
        let columns = (1..=root.max(1)).rev().find(|columns| self.samples.is_multiple_of(*columns)).unwrap_or(1);
        (columns, self.samples / columns)
    }
}
