//! What a scene gets: features, passes, buffers; and what was left out and why. Computed without any device, and the only
//! source from which the frame is recorded and buffers are allocated.

use super::textures::Textures;
use super::{Prepared, TreeSize};
use crate::error::Result;
use crate::layout::{
    Features, HitItem, Light, RayItem, Texture, FILTER_STEPS, INSTANCE_TEXELS, MATERIAL_TEXELS, MAX_LAYERS,
    NODE_TEXELS, TILE, TRIANGLE_TEXELS, WORKGROUP,
};
use crate::scene::{Scene, Soup, View};

/// Bytes of a texel.
const TEXEL: u64 = 16;
/// Bytes of a pixel or sample: RGBA in f32.
const PIXEL: u64 = 16;
/// Largest grid of workgroups that every device allows, as samples.
const MOST_IN_FLIGHT: u32 = 65_535 * WORKGROUP;
/// Most samples of a pixel in a wave: `resolve` adds them in a loop, whose rounds and those of what it calls for a sample (where it lies, up to some
/// twenty) must stay far below the 65 535 that software Vulkan allows.
const MOST_SAMPLES_A_WAVE: u32 = 1024;

/// A pass of the frame.
#[derive(Clone, Debug)]
pub struct PlannedPass {
    /// Kernel.
    pub name: &'static str,
    /// Dispatches in the whole picture.
    pub dispatches: u64,
    /// What it does, in a few words.
    pub purpose: &'static str,
}

/// A buffer on the device.
#[derive(Clone, Debug)]
pub struct PlannedBuffer {
    /// Name in the shaders.
    pub name: &'static str,
    /// Bytes before padding; 0 when left out.
    pub bytes: u64,
    /// It is a queue.
    pub is_queue: bool,
}

/// Something that this scene does not need.
#[derive(Clone, Debug)]
pub struct LeftOut {
    /// Pass, buffer or feature.
    pub name: &'static str,
    /// Why.
    pub reason: String,
}

/// What is done for a view of a scene.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Features compiled in.
    pub features: Features,
    /// Pixels of the picture in tile order, with those beyond its edges.
    pub padded_pixels: u64,
    /// Pixels in a band.
    pub band_pixels: u32,
    /// Samples of each pixel in a wave; a band takes as many waves as its samples need.
    pub wave_samples: u32,
    /// Rounds of shading: the camera's and one a reflection.
    pub rounds: u32,
    /// Runs of the shade pass in a round: one a light, at least one.
    pub lights: u32,
    /// Passes in the order of the frame.
    pub passes: Vec<PlannedPass>,
    /// Buffers in the order of their slots, without those that are views of others.
    pub buffers: Vec<PlannedBuffer>,
    /// What was left out.
    pub left_out: Vec<LeftOut>,
}

impl Plan {
    /// The plan for a view of a scene with a tree of this size.
    ///
    /// # Errors
    /// `Content` when its textures are too large.
    pub fn new(prepared: &Prepared, scene: &Scene, features: Features, tree: TreeSize, in_flight: u32) -> Result<Self> {
        let textures = Textures::of(scene, features.textures, u64::MAX)?;
        Ok(Self::with_textures(prepared, scene, features, tree, in_flight, &textures))
    }

    /// As [`Plan::new`], with textures that are ready for the device.
    pub(super) fn with_textures(
        Prepared { soup, view, .. }: &Prepared,
        scene: &Scene,
        features: Features,
        tree: TreeSize,
        in_flight: u32,
        textures: &Textures,
    ) -> Self {
        let tiles = u64::from(view.width.div_ceil(TILE)) * u64::from(view.height.div_ceil(TILE));
        let padded_pixels = tiles * u64::from(TILE * TILE);
        let in_flight = in_flight.clamp(WORKGROUP, MOST_IN_FLIGHT) / WORKGROUP * WORKGROUP;
        // Whole tiles; all samples of a pixel at once if a tile's fit.
        let at_once = view.samples.min(MOST_SAMPLES_A_WAVE);
        let band_pixels = (in_flight / at_once / WORKGROUP * WORKGROUP).max(WORKGROUP);
        let band_pixels = u64::from(band_pixels).min(padded_pixels) as u32;
        let wave_samples = (in_flight / band_pixels).min(at_once);
        let mut plan = Self {
            features,
            padded_pixels,
            band_pixels,
            wave_samples,
            rounds: 1
                + if features.reflections { view.max_depth } else { 0 }
                + if features.layers { MAX_LAYERS } else { 0 },
            lights: if features.shadows { (view.lights.len() as u32).max(1) } else { 1 },
            passes: Vec::new(),
            buffers: Vec::new(),
            left_out: Vec::new(),
        };
        plan.plan_passes(view);
        plan.plan_buffers(scene, soup, view, tree, textures);
        plan.explain_left_out(view);
        plan
    }

    /// Waves in the whole picture.
    pub fn waves(&self, samples: u32) -> u64 {
        self.bands() * u64::from(samples.div_ceil(self.wave_samples))
    }

    /// Bands that the picture is made in.
    pub(super) fn bands(&self) -> u64 {
        self.padded_pixels.div_ceil(u64::from(self.band_pixels))
    }

    /// Pixel samples in flight.
    fn in_flight(&self) -> u64 {
        u64::from(self.band_pixels) * u64::from(self.wave_samples)
    }

    fn plan_passes(&mut self, view: &View) {
        let waves = self.waves(view.samples);
        let (rounds, lights) = (u64::from(self.rounds), u64::from(self.lights));
        let mut pass = |name, dispatches, purpose| {
            if dispatches > 0 {
                self.passes.push(PlannedPass { name, dispatches: waves * dispatches, purpose });
            }
        };
        let (shadows, goes_on) = (self.features.shadows, self.features.rays_go_on());
        pass("primary", 1, "camera rays → nearest hits or background");
        // Hits before each round; after each light its shadow rays, after the last one the reflected rays too.
        let after_shading = if shadows {
            rounds * lights
        } else if goes_on {
            rounds - 1
        } else {
            0
        };
        pass("prepare", rounds + after_shading, "queue counts → dispatch arguments");
        pass("shade", rounds * lights, "ambient, emission, one light each → shadow and reflection queues");
        pass(
            "shadow",
            if shadows { rounds * lights } else { 0 },
            "shadow rays → the light's part, where nothing blocks it",
        );
        let reflection = "rays that were reflected, or go on behind a surface → nearest hits or background";
        pass("reflection", if goes_on { rounds - 1 } else { 0 }, reflection);
        pass("resolve", 1, "samples → pixels");
    }

    fn plan_buffers(&mut self, scene: &Scene, soup: &Soup, view: &View, tree: TreeSize, textures: &Textures) {
        let features = self.features;
        let triangles = soup.len() as u64;
        let in_flight = self.in_flight();
        let goes_on = features.rays_go_on();
        let queue = |needed: bool, item: usize| if needed { in_flight * item as u64 } else { 0 };
        let mut buffer = |name, bytes, is_queue| self.buffers.push(PlannedBuffer { name, bytes, is_queue });
        buffer("nodes", tree.nodes as u64 * u64::from(NODE_TEXELS) * TEXEL, false);
        buffer("triangles", tree.triangles as u64 * u64::from(TRIANGLE_TEXELS) * TEXEL, false);
        let attributes = super::upload::attribute_kinds(features) * triangles * u64::from(TRIANGLE_TEXELS) * TEXEL;
        buffer("attributes", attributes, false);
        buffer("materials", scene.materials.len() as u64 * u64::from(MATERIAL_TEXELS) * TEXEL, false);
        let lights = if features.shadows { view.lights.len().max(1) * size_of::<Light>() } else { 0 };
        buffer("lights", lights as u64, false);
        buffer("instances", tree.instances as u64 * u64::from(INSTANCE_TEXELS) * TEXEL, false);
        buffer("textures", (textures.records.len() * size_of::<Texture>()) as u64, false);
        buffer("pixels", textures.bytes(), false);
        buffer("frame", size_of::<crate::layout::Frame>() as u64, false);
        buffer("hit_queue", queue(true, size_of::<HitItem>()), true);
        buffer("shadow_queue", queue(features.shadows, size_of::<RayItem>()), true);
        buffer("reflection_queue", queue(goes_on, size_of::<RayItem>()), true);
        buffer("retrace_queue", queue(true, size_of::<u32>()), true);
        buffer("counters", (4 * u64::from(crate::layout::COUNTERS)).next_multiple_of(PIXEL), false);
        buffer("dispatches", 12 * u64::from(crate::layout::QUEUES), false);
        buffer("shadow_radiance", queue(features.shadows, PIXEL as usize), true);
        buffer("throughput", queue(goes_on, PIXEL as usize), true);
        buffer("radiance", in_flight * PIXEL, false);
        buffer("film", u64::from(self.band_pixels) * PIXEL, false);
        let rests = u64::from(features.multisampling) * if features.layers { 2 } else { 1 };
        buffer("film_rest", rests * u64::from(self.band_pixels) * PIXEL, false);
        buffer("filter_steps", if features.filter { u64::from(FILTER_STEPS) * TEXEL } else { 0 }, false);
        // Made when a walk was too long for one dispatch.
        buffer("partial_hits", 0, false);
    }

    fn explain_left_out(&mut self, view: &View) {
        let features = self.features;
        let no_light = if view.lights.is_empty() { "no light shines" } else { "no material answers to light" };
        let no_mirror = if view.max_depth == 0 { "the maximum depth is 0" } else { "no material mirrors" };
        let mut leave = |needed: bool, names: &[&'static str], reason: &str| {
            if !needed {
                self.left_out.extend(names.iter().map(|name| LeftOut { name, reason: reason.into() }));
            }
        };
        leave(features.shadows, &["shadow pass", "shadow_queue", "shadow_radiance", "lights"], no_light);
        leave(features.specular, &["specular term"], if features.shadows { "no material is glossy" } else { no_light });
        let no_way_on = format!("{no_mirror}, and no surface lets light through");
        leave(features.rays_go_on(), &["reflection pass", "reflection_queue", "throughput"], &no_way_on);
        leave(features.smooth_normals, &["vertex normals"], "all triangles are flat");
        leave(features.vertex_colors, &["vertex colours"], "no mesh has any");
        leave(features.textures, &["texture coordinates", "textures", "pixels"], "no material has a texture");
        leave(features.normal_maps, &["tangents"], "no material has a normal map");
        leave(features.alpha, &["alpha tests"], "all materials are opaque");
        leave(features.layers, &["rays behind surfaces"], "no surface lets light through");
        leave(features.single_sided, &["back-face culling"], "all materials are double-sided");
        leave(features.instances, &["instances"], "no mesh is shared, or that would save little");
        leave(features.thin_triangles, &["watch over thin triangles"], "no triangle is 32 times as long as high");
        leave(features.multisampling, &["sample positions", "film_rest"], "one sample a pixel goes through its centre");
        let even = if features.multisampling {
            "the pixel's area counts evenly"
        } else {
            "one sample a pixel goes through its centre"
        };
        leave(features.filter, &["filter_steps"], even);
        leave(false, &["partial_hits"], "no ray is known to meet more than one dispatch may walk through");
    }

    /// Bytes of the queues.
    pub fn queue_bytes(&self) -> u64 {
        self.buffers.iter().filter(|buffer| buffer.is_queue).map(|buffer| buffer.bytes).sum()
    }
}
