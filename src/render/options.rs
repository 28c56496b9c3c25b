//! What a caller may choose.

use crate::bvh::Quality;
use crate::error::{Error, Result};
use crate::scene::{Background, CameraChoice, Filter, Instancing, Sampler, Scene, Soup, View};
use crate::vulkan::DeviceChoice;
use glam::DVec3;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::time::Instant;

/// Called with the samples done and the samples in all, some times a second.
pub type Progress = Arc<dyn Fn(u64, u64) + Send + Sync>;

/// A safeguard that can be switched off to see what it prevents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sabotage {
    /// Rays start a fixed distance off surfaces, not the bound of the position's error.
    FixedEpsilon,
    /// Triangles are tested by Möller and Trumbore's method, which is not watertight.
    MollerTrumbore,
    /// Hits on thin triangles are believed however near the ray's start they are.
    SureOfThin,
    /// Boxes in the tree are rounded to the nearest, not outward.
    TightBoxes,
    /// The device's world is the file's, neither moved nor scaled nor diced.
    NoRebase,
    /// Samples are added up without compensation.
    PlainSums,
}

/// Options of a picture. [`Options::default`] is what `glimt render` does without flags.
#[derive(Clone)]
pub struct Options {
    /// Pixels across and down. Default 1024 × 768.
    pub size: (u32, u32),
    /// Samples a pixel. Default 1: through the centre.
    pub samples: u32,
    /// Reflections one after the other. Default 8.
    pub max_depth: u32,
    /// Camera. Default: the file's first, or one that frames the scene.
    pub camera: CameraChoice,
    /// Up of cameras that are not the file's. Default +y.
    pub up: DVec3,
    /// Vertical field of view in radians, instead of the camera's own.
    pub fov: Option<f64>,
    /// Default: a soft gradient.
    pub background: Background,
    /// A light where the file has none. Default true.
    pub default_light: bool,
    /// Where samples lie. Default: the one that converges fastest.
    pub sampler: Sampler,
    /// How samples are weighed. Default: evenly over the pixel.
    pub filter: Filter,
    /// Chooses between samplers' sequences. Default 0.
    pub seed: u32,
    /// Passes of more and more samples until the estimated RMSE in linear RGB is this, instead of `samples`.
    pub target_error: Option<f64>,
    /// Passes of more and more samples until then, instead of `samples`. The first pass is always run.
    pub deadline: Option<Instant>,
    /// Device. Default: the best.
    pub device: DeviceChoice,
    /// Validation layers on; any message is an error. Default false.
    pub validate: bool,
    /// Pixel samples traced at once: bounds the queues' memory, changes no pixel. Default 2¹⁷.
    pub samples_in_flight: u32,
    /// How much work goes into the tree; `None`: as much as the rays will save. Changes no pixel.
    pub bvh: Option<Quality>,
    /// Whether instances share the triangles of their mesh.
    pub instancing: Instancing,
    /// Scenes of more triangles, all instances counted, are refused. Default: none are.
    pub max_triangles: Option<u64>,
    /// Every feature on, needed or not: slower, the same picture. For tests.
    pub all_features: bool,
    /// A safeguard switched off, to see what it prevents. For tests.
    pub sabotage: Option<Sabotage>,
    /// Progress.
    pub progress: Option<Progress>,
    /// Set to stop early with `Error::Interrupted`.
    pub interrupted: Arc<AtomicBool>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            size: (1024, 768),
            samples: 1,
            max_depth: 8,
            camera: CameraChoice::Auto,
            up: DVec3::Y,
            fov: None,
            background: Background::default(),
            default_light: true,
            sampler: Sampler::default(),
            filter: Filter::default(),
            seed: 0,
            target_error: None,
            deadline: None,
            device: DeviceChoice::Best,
            validate: false,
            samples_in_flight: 1 << 17,
            bvh: None,
            instancing: Instancing::Auto,
            max_triangles: None,
            all_features: false,
            sabotage: None,
            progress: None,
            interrupted: Arc::default(),
        }
    }
}

impl Options {
    /// The quality of the tree over so many triangles.
    pub fn quality(&self, triangles: usize) -> Quality {
        let rays = u64::from(self.size.0) * u64::from(self.size.1) * u64::from(self.samples);
        self.bvh.unwrap_or(match rays / (triangles as u64).max(1) {
            0..2 => Quality::Fast,
            2..8 => Quality::Balanced,
            _ => Quality::Best,
        })
    }

    /// Whether to go on.
    ///
    /// # Errors
    /// `Interrupted` when not.
    pub fn go_on(&self) -> Result<()> {
        if self.interrupted.load(Ordering::Relaxed) {
            return Err(Error::Interrupted);
        }
        Ok(())
    }

    /// Refuses a scene of too many triangles, before anything is made of them.
    ///
    /// # Errors
    /// `Content` with their number and the limit.
    pub fn check_triangles(&self, scene: &Scene) -> Result<()> {
        let count = scene.triangle_count();
        match self.max_triangles {
            Some(most) if count as u64 > most => {
                Err(Error::content(&scene.name, format!("{count} triangles: the limit is {most} (--max-triangles)")))
            }
            _ => Ok(()),
        }
    }

    /// The view of `scene`, whose triangles are `soup`, that these options mean.
    ///
    /// # Errors
    /// `Usage` when the camera or a number makes no sense.
    pub fn view(&self, scene: &Scene, soup: &Soup) -> Result<View> {
        let aspect = f64::from(self.size.0.max(1)) / f64::from(self.size.1.max(1));
        let camera = scene.camera(soup, &self.camera, self.up, self.fov, aspect)?;
        let in_passes = super::progressive::is_wanted(self);
        let samples = if in_passes { super::progressive::PLANNED } else { self.samples };
        let mut view = View::new(scene, camera, self.size, samples, self.max_depth)?;
        view.background = self.background;
        (view.sampler, view.filter, view.seed) = (self.sampler, self.filter, self.seed);
        Ok(if self.default_light { view.with_default_light(scene) } else { view })
    }
}
