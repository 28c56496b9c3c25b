//! The frame: the order of the passes, wave by wave, and what comes back.

use super::{upload, Options, Plan, Renderer};
use crate::error::{Error, Result};
use crate::film::Film;
use crate::layout::{
    binding, kernels, Step, COUNTERS, COUNTER_LOST, COUNTER_TOTAL, QUEUE_HIT, QUEUE_REFLECTION, QUEUE_SHADOW, TILE,
    WORKGROUP,
};
use crate::report;
use crate::scene::{Background, View};
use crate::vulkan::{Access, Bindings, Buffer, Commands, Kernel, Memory, Usage};
use std::sync::atomic::Ordering;
use std::sync::Arc;

/// A scene on the device, ready to run.
pub(super) struct Frame<'a> {
    pub renderer: &'a Renderer,
    view: &'a View,
    plan: Plan,
    pub kernels: Kernels,
    // Dropped before the buffers it names.
    pub bindings: Bindings,
    /// By slot.
    pub buffers: Vec<Buffer>,
    /// Where the host reads: the counters of a wave, then the film of a band.
    read_back: Buffer,
}

/// The kernels of the passes that this frame has.
pub(super) struct Kernels {
    pub primary: Arc<Kernel>,
    prepare: Arc<Kernel>,
    shade: Arc<Kernel>,
    pub shadow: Option<Arc<Kernel>>,
    pub reflection: Option<Arc<Kernel>>,
    resolve: Arc<Kernel>,
}

/// What a frame tells besides its pixels.
pub(super) struct Outcome {
    pub passes: Vec<report::Pass>,
    pub rays: report::Rays,
    pub queue_bytes: u64,
}

/// Bytes of all counters, padded so that pixels behind them are aligned.
const COUNTER_BYTES: usize = (4 * COUNTERS as usize).next_multiple_of(PIXEL_BYTES);
/// Bytes of a pixel.
const PIXEL_BYTES: usize = size_of::<[f32; 4]>();
/// Most dispatches of a wave that are timed one by one.
const MOST_TIMED: u64 = 16_384;

impl<'a> Frame<'a> {
    /// Allocates and fills the buffers of the plan and makes its kernels.
    pub fn new(renderer: &'a Renderer, view: &'a View, scene: upload::Scene, plan: Plan) -> Result<Self> {
        let features = plan.features;
        let kernel = |code| renderer.kernel(code, features);
        let kernels = Kernels {
            primary: kernel(&kernels::PRIMARY)?,
            prepare: kernel(&kernels::PREPARE)?,
            shade: kernel(&kernels::SHADE)?,
            shadow: features.shadows.then(|| kernel(&kernels::SHADOW)).transpose()?,
            reflection: features.reflections.then(|| kernel(&kernels::REFLECTION)).transpose()?,
            resolve: kernel(&kernels::RESOLVE)?,
        };
        let buffers = plan
            .buffers
            .iter()
            .zip(binding::ALL)
            .map(|(planned, slot)| {
                assert_eq!(planned.name, slot.name, "the plan lists buffers in the order of their slots");
                let filled = scene.buffer(renderer, slot.slot, features);
                filled.unwrap_or_else(|| upload::frame_buffer(renderer, slot.slot, slot.name, planned.bytes))
            })
            .collect::<Result<Vec<_>>>()?;
        let bindings = Bindings::new(&renderer.layout, |slot| &buffers[slot as usize])?;
        let read_back = COUNTER_BYTES as u64 + u64::from(plan.band_pixels) * PIXEL_BYTES as u64;
        let read_back = Buffer::new(&renderer.device, "read back", read_back, Usage::Storage, Memory::ReadBack)?;
        Ok(Self { renderer, view, plan, kernels, bindings, buffers, read_back })
    }

    /// Records one wave: the whole algorithm.
    fn record(&self, commands: &mut Commands, wave: Step) {
        let Plan { rounds, lights, .. } = self.plan;
        let kernels = &self.kernels;
        let arguments = &self.buffers[binding::DISPATCHES as usize];
        let samples = wave.pixels * wave.samples;
        let bit = |queue: u32, needed: bool| u32::from(needed) << queue;

        commands.clear(&self.buffers[binding::COUNTERS as usize]);
        // Counters: the fill wrote, kernels count on.
        commands.barrier(Access::Transfer, Access::ShaderReadWrite);
        commands.bind(&kernels.primary, &self.bindings);
        commands.dispatch(&kernels.primary, bytemuck::bytes_of(&wave), samples.div_ceil(WORKGROUP));

        for round in 0..rounds {
            let reflect = kernels.reflection.is_some() && round + 1 < rounds;
            self.prepare(commands, bit(QUEUE_HIT, true));
            for light in 0..lights {
                let (first, last) = (light == 0, light + 1 == lights);
                let step = Step { light, first_light: first.into(), reflect: reflect.into(), ..wave };
                commands.dispatch_indirect(&kernels.shade, bytemuck::bytes_of(&step), arguments, QUEUE_HIT.into());
                if kernels.shadow.is_some() || (reflect && last) {
                    let filled = bit(QUEUE_SHADOW, kernels.shadow.is_some()) | bit(QUEUE_REFLECTION, reflect && last);
                    self.prepare(commands, filled);
                }
                if let Some(shadow) = &kernels.shadow {
                    commands.dispatch_indirect(shadow, bytemuck::bytes_of(&wave), arguments, QUEUE_SHADOW.into());
                    // Radiance and shadow queue: this light's shadow rays before the next pass on the same samples.
                    commands.barrier(Access::ShaderWrite, Access::ShaderReadWrite);
                }
            }
            if let (Some(reflection), true) = (&kernels.reflection, reflect) {
                commands.dispatch_indirect(reflection, bytemuck::bytes_of(&wave), arguments, QUEUE_REFLECTION.into());
            }
        }
        // Radiance: every pass wrote, resolve reads. Film: the wave before wrote, resolve adds.
        commands.barrier(Access::ShaderWrite, Access::ShaderReadWrite);
        commands.dispatch(&kernels.resolve, bytemuck::bytes_of(&wave), wave.pixels.div_ceil(WORKGROUP));
        // Film and counters: kernels wrote, copies read.
        commands.barrier(Access::ShaderWrite, Access::Transfer);
        commands.copy(&self.buffers[binding::COUNTERS as usize], &self.read_back, 0, COUNTER_BYTES as u64);
        if wave.finish != 0 {
            let bytes = u64::from(wave.pixels) * PIXEL_BYTES as u64;
            commands.copy(&self.buffers[binding::FILM as usize], &self.read_back, COUNTER_BYTES as u64, bytes);
        }
        // What was read back: copies wrote, the host reads.
        commands.barrier(Access::Transfer, Access::HostRead);
    }

    /// Makes filled queues ready, with a barrier on either side.
    pub fn prepare(&self, commands: &mut Commands, queues: u32) {
        // Queues and counters: the pass before filled them, prepare reads.
        commands.barrier(Access::ShaderWrite, Access::ShaderReadWrite);
        commands.dispatch(&self.kernels.prepare, bytemuck::bytes_of(&Step { queues, ..Step::default() }), 1);
        // Arguments: prepare wrote, indirect dispatches read them and their kernels the counters.
        commands.barrier(Access::ShaderWrite, Access::ShaderAndIndirect);
    }

    /// Runs all waves of all bands and collects the film.
    pub fn run(self, options: &Options) -> Result<(Film, Outcome)> {
        let Plan { padded_pixels, band_pixels, wave_samples, .. } = self.plan;
        let samples = self.view.samples;
        let dispatches: u64 = self.plan.passes.iter().map(|pass| pass.dispatches).sum();
        let timed = (dispatches / self.plan.waves(samples)).min(MOST_TIMED) as usize;
        let mut film = Film::new(self.view.width, self.view.height, self.view.background == Background::Transparent);
        let mut totals = Totals::new(&self.plan);
        for first_pixel in (0..padded_pixels).step_by(band_pixels as usize) {
            let pixels = u64::from(band_pixels).min(padded_pixels - first_pixel) as u32;
            for first_sample in (0..samples).step_by(wave_samples as usize) {
                if options.interrupted.load(Ordering::Relaxed) {
                    return Err(Error::Interrupted);
                }
                let count = wave_samples.min(samples - first_sample);
                let wave = Step {
                    first_pixel: first_pixel as u32,
                    pixels,
                    first_sample,
                    samples: count,
                    finish: u32::from(first_sample + count == samples),
                    ..Step::default()
                };
                let mut commands = Commands::new(&self.renderer.device, timed)?;
                self.record(&mut commands, wave);
                totals.add_times(&commands.submit_and_wait()?);
                totals.add_counters(bytemuck::cast_slice(&self.read_back.read()?[..COUNTER_BYTES]))?;
                if let Some(progress) = &options.progress {
                    let done = first_pixel * u64::from(samples) + u64::from(pixels) * u64::from(first_sample + count);
                    progress(done, padded_pixels * u64::from(samples));
                }
            }
            self.collect(&mut film, first_pixel, pixels)?;
        }
        Ok((film, totals.outcome(self.view, &self.plan)))
    }

    /// Copies a band from tile order to the rows of the film.
    fn collect(&self, film: &mut Film, first_pixel: u64, pixels: u32) -> Result<()> {
        let bytes = &self.read_back.read()?[COUNTER_BYTES..][..pixels as usize * PIXEL_BYTES];
        let band: &[[f32; 4]] = bytemuck::cast_slice(bytes);
        let (side, across) = (TILE as usize, self.view.width.div_ceil(TILE) as usize);
        let (width, height) = (self.view.width as usize, self.view.height as usize);
        // Bands are whole tiles.
        for (index, tile_pixels) in band.chunks_exact(side * side).enumerate() {
            let tile = first_pixel as usize / (side * side) + index;
            let (left, top) = (tile % across * side, tile / across * side);
            for (code, pixel) in tile_pixels.iter().enumerate() {
                let (x, y) = (left + even_bits(code), top + even_bits(code >> 1));
                if x < width && y < height {
                    film.pixels[y * width + x] = *pixel;
                }
            }
        }
        Ok(())
    }
}

/// Every second bit of the lower six, packed: undoes the Morton interleave of a tile.
fn even_bits(code: usize) -> usize {
    code & 1 | code >> 1 & 2 | code >> 2 & 4
}

/// Refuses the answers of a wave in which a walk was cut short.
pub(super) fn all_complete(counters: &[u32]) -> Result<()> {
    match counters[COUNTER_LOST as usize] {
        0 => Ok(()),
        lost => Err(Error::Device(format!(
            "{lost} rays meet more boxes and triangles than this driver's loops allow; \
             the picture would be wrong and was not written"
        ))),
    }
}

/// Sums over waves.
struct Totals {
    passes: Vec<report::Pass>,
    hits: u64,
    shadow: u64,
    reflection: u64,
}

impl Totals {
    fn new(plan: &Plan) -> Self {
        let pass = |planned: &super::PlannedPass| report::Pass {
            name: planned.name,
            dispatches: planned.dispatches,
            ..Default::default()
        };
        Self { passes: plan.passes.iter().map(pass).collect(), hits: 0, shadow: 0, reflection: 0 }
    }

    fn add_times(&mut self, times: &[(&'static str, f64)]) {
        for (name, ms) in times {
            if let Some(pass) = self.passes.iter_mut().find(|pass| pass.name == *name) {
                pass.ms += ms;
            }
        }
    }

    fn add_counters(&mut self, counters: &[u32]) -> Result<()> {
        let total = |queue: u32| u64::from(counters[(COUNTER_TOTAL + queue) as usize]);
        self.hits += total(QUEUE_HIT);
        self.shadow += total(QUEUE_SHADOW);
        self.reflection += total(QUEUE_REFLECTION);
        all_complete(counters)
    }

    fn outcome(mut self, view: &View, plan: &Plan) -> Outcome {
        let pixels = u64::from(view.width) * u64::from(view.height);
        let primary = pixels * u64::from(view.samples);
        for pass in &mut self.passes {
            pass.items = match pass.name {
                "primary" => primary,
                "shade" => self.hits * u64::from(plan.lights),
                "shadow" => self.shadow,
                "reflection" => self.reflection,
                "resolve" => pixels * u64::from(view.samples.div_ceil(plan.wave_samples)),
                _ => pass.dispatches,
            };
        }
        let rays = report::Rays { primary, shadow: self.shadow, reflection: self.reflection };
        Outcome { passes: self.passes, rays, queue_bytes: plan.queue_bytes() }
    }
}
