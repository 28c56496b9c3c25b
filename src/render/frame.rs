//! The frame: the order of the passes, wave by wave, and what comes back.

use super::queues::{filling, most_a_thread, workgroups_for};
use super::subtrees::Subtree;
use super::totals::{Outcome, Totals};
use super::tracers::{Again, Kernels, Tracers};
use super::{upload, Options, Plan, Renderer};
use crate::error::{Error, Result};
use crate::film::Film;
use crate::layout::{
    binding, Step, COUNTERS, COUNTER_CUT, COUNTER_LOST, PARTIAL_HIT_TEXELS, QUEUE_HIT, QUEUE_PRIMARY_AGAIN,
    QUEUE_REFLECTION, QUEUE_REFLECTION_AGAIN, QUEUE_SHADOW, QUEUE_SHADOW_AGAIN, TILE, WORKGROUP,
};
use crate::scene::{Background, View};
use crate::vulkan::{Access, Bindings, Buffer, Commands, Kernel, Memory, Usage};
use std::collections::BTreeMap;
use std::ops::Range;

/// A scene on the device, ready to run.
pub(super) struct Frame<'a> {
    pub renderer: &'a Renderer,
    view: &'a View,
    plan: Plan,
    pub kernels: Kernels,
    /// Traces again what overflowed or was uncertain.
    again: Again,
    /// Queues of such rays of which it is known whether the first pass left anything in them.
    asked: Vec<u32>,
    /// Subtrees that tracing again walks through one by one: the whole tree, unless that is too much for one dispatch.
    parts: Vec<Subtree>,
    /// What to do then; `None` when it was done.
    smaller_parts: Option<Parts<'a>>,
    // Dropped before the buffers it names.
    pub bindings: Bindings,
    /// By slot; views have none of their own.
    buffers: BTreeMap<u32, Buffer>,
    /// Where the host reads: the counters of a wave, then the film of a band. Bands take turns where there are several.
    read_back: Vec<Buffer>,
    /// Items that a thread works on one after the other.
    pub most_a_thread: u32,
    totals: Totals,
}

/// Finds the subtrees for rays that are too long for one dispatch, when there are such.
pub(super) type Parts<'a> = Box<dyn FnOnce() -> Vec<Subtree> + 'a>;

/// Bytes of all counters, padded so that pixels behind them are aligned.
const COUNTER_BYTES: usize = (4 * COUNTERS as usize).next_multiple_of(PIXEL_BYTES);
/// Bytes of a pixel.
const PIXEL_BYTES: usize = size_of::<[f32; 4]>();
/// Bytes of what a ray that is traced again has hit so far: no more than of an item in any queue.
const PARTIAL_HIT_BYTES: u64 = 16 * PARTIAL_HIT_TEXELS as u64;
/// From so many dispatches on they are submitted before more are recorded.
const MOST_AT_ONCE: usize = 256;

impl<'a> Frame<'a> {
    /// Allocates and fills the buffers of the plan and makes its kernels.
    pub fn new(
        renderer: &'a Renderer,
        view: &'a View,
        scene: upload::Scene,
        plan: Plan,
        smaller_parts: Parts<'a>,
    ) -> Result<Self> {
        let features = plan.features;
        let owners = binding::ALL.iter().filter(|slot| slot.view_of.is_none());
        let buffers = plan.buffers.iter().zip(owners).map(|(planned, slot)| {
            assert_eq!(planned.name, slot.name, "the plan lists buffers in the order of their slots");
            let filled = scene.buffer(renderer, slot.slot, features);
            let buffer = filled.unwrap_or_else(|| upload::frame_buffer(renderer, slot.slot, slot.name, planned.bytes));
            buffer.map(|buffer| (slot.slot, buffer))
        });
        // Kernels are made while other threads write what they will read.
        let (kernels, buffers) =
            rayon::join(|| Kernels::new(renderer, features), || buffers.collect::<Result<BTreeMap<_, _>>>());
        let (kernels, buffers) = (kernels?, buffers?);
        let bindings = bind(renderer, &buffers)?;
        let read_back = COUNTER_BYTES as u64 + u64::from(plan.band_pixels) * PIXEL_BYTES as u64;
        let read_back = (0..plan.bands().min(2))
            .map(|_| Buffer::new(&renderer.device, "read back", read_back, Usage::Storage, Memory::ReadBack))
            .collect::<Result<_>>()?;
        Ok(Self {
            renderer,
            view,
            kernels,
            again: Again::default(),
            asked: Vec::new(),
            parts: vec![Subtree::default()],
            smaller_parts: Some(smaller_parts),
            most_a_thread: most_a_thread(renderer.device.info.kind),
            totals: Totals::new(&plan),
            plan,
            bindings,
            buffers,
            read_back,
        })
    }

    /// The buffer of a slot.
    pub fn buffer(&self, slot: u32) -> &Buffer {
        &self.buffers[&slot]
    }

    /// Records one wave: the whole algorithm.
    fn record(&mut self, commands: &mut Commands, wave: Step, options: &Options) -> Result<()> {
        let Plan { rounds, lights, .. } = self.plan;
        let Tracers { primary, shadow, reflection } = &self.kernels.trace.clone();
        let samples = wave.pixels * wave.samples;

        commands.clear(self.buffer(binding::COUNTERS));
        // Counters: the fill wrote, kernels count on.
        commands.barrier(Access::Transfer, Access::ShaderReadWrite);
        commands.bind(primary, &self.bindings);
        commands.dispatch(primary, bytemuck::bytes_of(&wave), workgroups_for(samples, wave.most_a_thread));
        self.trace_again(commands, wave, QUEUE_PRIMARY_AGAIN, options)?;

        for round in 0..rounds {
            let goes_on = reflection.is_some() && round + 1 < rounds;
            self.prepare(commands, &[QUEUE_HIT], options)?;
            for light in 0..lights {
                // In the last round of layers, too: what is behind the last one is the background.
                let is_last = light + 1 == lights;
                let reflect = goes_on && is_last;
                let step = Step {
                    light,
                    first_light: u32::from(light == 0),
                    reflect: (is_last && (goes_on || self.plan.features.layers)).into(),
                    round,
                    ..wave
                };
                self.dispatch_queue(commands, &self.kernels.shade, step, QUEUE_HIT);
                match (shadow.is_some(), reflect) {
                    (true, true) => self.prepare(commands, &[QUEUE_SHADOW, QUEUE_REFLECTION], options)?,
                    (true, false) => self.prepare(commands, &[QUEUE_SHADOW], options)?,
                    (false, true) => self.prepare(commands, &[QUEUE_REFLECTION], options)?,
                    (false, false) => {}
                }
                if let Some(shadow) = shadow {
                    self.dispatch_queue(commands, shadow, wave, QUEUE_SHADOW);
                    self.trace_again(commands, wave, QUEUE_SHADOW_AGAIN, options)?;
                    // Radiance and shadow queue: this light's shadow rays before the next pass on the same samples.
                    commands.barrier(Access::ShaderWrite, Access::ShaderReadWrite);
                }
            }
            if let (Some(reflection), true) = (reflection, goes_on) {
                self.dispatch_queue(commands, reflection, wave, QUEUE_REFLECTION);
                self.trace_again(commands, wave, QUEUE_REFLECTION_AGAIN, options)?;
            }
        }
        // Radiance: every pass wrote, resolve reads. Film: the wave before wrote, resolve adds.
        commands.barrier(Access::ShaderWrite, Access::ShaderReadWrite);
        commands.dispatch(&self.kernels.resolve, bytemuck::bytes_of(&wave), wave.pixels.div_ceil(WORKGROUP));
        // Film and counters: kernels wrote, copies read.
        commands.barrier(Access::ShaderWrite, Access::Transfer);
        let read_back = self.read_back(wave.first_pixel.into());
        commands.copy(self.buffer(binding::COUNTERS), read_back, 0, COUNTER_BYTES as u64);
        if wave.finish != 0 {
            let bytes = u64::from(wave.pixels) * PIXEL_BYTES as u64;
            commands.copy(self.buffer(binding::FILM), read_back, COUNTER_BYTES as u64, bytes);
        }
        // What was read back: copies wrote, the host reads.
        commands.barrier(Access::Transfer, Access::HostRead);
        Ok(())
    }

    /// Before a barrier: runs what is recorded when that is much, so that no submission takes so long that the system takes the device for dead, and
    /// looks whether to go on.
    fn breathe(&self, commands: &mut Commands, options: &Options) -> Result<()> {
        if commands.dispatches() < MOST_AT_ONCE {
            return Ok(());
        }
        commands.flush()?;
        commands.bind(&self.kernels.trace.primary, &self.bindings);
        options.go_on()
    }

    /// Runs a kernel for all items that are ready in a queue.
    pub fn dispatch_queue(&self, commands: &mut Commands, kernel: &Kernel, step: Step, queue: u32) {
        commands.dispatch_indirect(kernel, bytemuck::bytes_of(&step), self.buffer(binding::DISPATCHES), queue.into());
    }

    /// Makes filled queues ready, with a barrier on either side.
    pub fn prepare(&self, commands: &mut Commands, queues: &[u32], options: &Options) -> Result<()> {
        self.breathe(commands, options)?;
        let queues = queues.iter().map(|queue| 1 << queue).sum();
        // Queues and counters: the pass before filled them, prepare reads.
        commands.barrier(Access::ShaderWrite, Access::ShaderReadWrite);
        commands.dispatch(
            &self.kernels.prepare,
            bytemuck::bytes_of(&Step { queues, most_a_thread: self.most_a_thread, ..Step::default() }),
            1,
        );
        // Arguments: prepare wrote, indirect dispatches read them and their kernels the counters.
        commands.barrier(Access::ShaderWrite, Access::ShaderAndIndirect);
        Ok(())
    }

    /// Traces again what the pass before left in `queue`. After the first such pass it is looked whether that is anything, before the passes that
    /// build on it are recorded; what only later ones leave makes [`Self::must_run_again`].
    pub fn trace_again(&mut self, commands: &mut Commands, wave: Step, queue: u32, options: &Options) -> Result<()> {
        if !self.asked.contains(&queue) {
            self.asked.push(queue);
            self.ask(commands, wave, queue)?;
        }
        let Some(kernel) = self.again.kernel(queue) else { return Ok(()) };
        self.prepare(commands, &[queue], options)?;
        for (index, Subtree { root, below }) in self.parts.iter().copied().enumerate() {
            let (first_part, last_part) = (u32::from(index == 0), u32::from(index + 1 == self.parts.len()));
            let step = Step { root, below, first_part, last_part, ..wave };
            self.dispatch_queue(commands, kernel, step, queue);
            self.breathe(commands, options)?;
            // Partial hits: this part wrote, the next reads.
            commands.barrier(Access::ShaderWrite, Access::ShaderReadWrite);
        }
        Ok(())
    }

    /// Runs what is recorded, and makes the kernel that traces a queue's rays again if there are any.
    fn ask(&mut self, commands: &mut Commands, wave: Step, queue: u32) -> Result<()> {
        let read_back = self.read_back(wave.first_pixel.into());
        // Counters: the pass wrote, the copy reads.
        commands.barrier(Access::ShaderWrite, Access::Transfer);
        commands.copy(self.buffer(binding::COUNTERS), read_back, 0, COUNTER_BYTES as u64);
        // What was read back: the copy wrote, the host reads.
        commands.barrier(Access::Transfer, Access::HostRead);
        commands.flush()?;
        let counters: &[u32] = bytemuck::cast_slice(&read_back.read()?[..4 * COUNTERS as usize]);
        // Where threads were cut short the wave is worth nothing, and which rays need it is not known.
        if counters[filling(queue)] != 0 && counters[COUNTER_CUT as usize] == 0 {
            self.make_again(&[queue])?;
        }
        commands.bind(&self.kernels.trace.primary, &self.bindings);
        Ok(())
    }

    /// Makes kernels that trace the rays in some queues again, and what they need.
    fn make_again(&mut self, queues: &[u32]) -> Result<()> {
        if self.again.is_empty() {
            self.make_partial_hits()?;
        }
        self.again.make(self.renderer, queues, self.plan.features)
    }

    /// Whether threads were cut short, or a pass left rays that nobody traced again, or they were cut short again: the wave is worth nothing and must
    /// be run once more.
    ///
    /// # Errors
    /// `Device` when it would not help.
    pub fn must_run_again(&mut self, counters: &[u32]) -> Result<bool> {
        if counters[COUNTER_CUT as usize] != 0 {
            // The driver's loops do not allow as many rounds as a thread's items need together, here or, likely, in other waves.
            self.most_a_thread = 1;
            self.asked.clear();
            return Ok(true);
        }
        let is_filled = |queue: &u32| counters[filling(*queue)] != 0;
        let filled: Vec<_> = Again::QUEUES.into_iter().filter(is_filled).collect();
        if !filled.is_empty() {
            self.make_again(&filled)?;
            return Ok(true);
        }
        let lost = counters[COUNTER_LOST as usize];
        if lost == 0 {
            return Ok(false);
        }
        let parts = self.smaller_parts.take().ok_or_else(|| {
            Error::Device(format!(
                "{lost} rays meet more boxes and triangles than this driver's loops allow; the picture would be wrong \
                 and was not written"
            ))
        })?;
        self.parts = parts();
        Ok(true)
    }

    /// Allocates what rays that are traced again keep between subtrees.
    fn make_partial_hits(&mut self) -> Result<()> {
        let bytes = PARTIAL_HIT_BYTES * u64::from(self.plan.band_pixels) * u64::from(self.plan.wave_samples);
        let slot = binding::PARTIAL_HITS;
        let made = upload::frame_buffer(self.renderer, slot, "partial hits", bytes)?;
        let old = self.buffers.insert(slot, made);
        // The old bindings name the old buffer: they go first.
        self.bindings = bind(self.renderer, &self.buffers)?;
        drop(old);
        Ok(())
    }

    /// Runs all waves of all bands for some samples of each pixel, of the sequence that `seed` chooses, and collects their mean.
    pub fn run(&mut self, samples: Range<u32>, seed: u32, options: &Options) -> Result<Film> {
        let Plan { padded_pixels, band_pixels, wave_samples, .. } = self.plan;
        let mut film = Film::new(self.view.width, self.view.height, self.view.background == Background::Transparent);
        let count = samples.end - samples.start;
        let mut finished = None;
        for first_pixel in (0..padded_pixels).step_by(band_pixels as usize) {
            let pixels = u64::from(band_pixels).min(padded_pixels - first_pixel) as u32;
            for first_sample in samples.clone().step_by(wave_samples as usize) {
                let in_wave = wave_samples.min(samples.end - first_sample);
                let wave = Step {
                    first_pixel: first_pixel as u32,
                    pixels,
                    first_sample,
                    samples: in_wave,
                    finish: u32::from(first_sample + in_wave == samples.end),
                    seed,
                    start: samples.start,
                    ..Step::default()
                };
                // While the device works on this band, the host takes the one before.
                let mut collect = |frame: &Self| finished.take().map_or(Ok(()), |band| frame.collect(&mut film, band));
                while !self.run_wave(wave, options, &mut collect)? {}
                if let Some(progress) = &options.progress {
                    let done = first_sample + in_wave - samples.start;
                    let done = first_pixel * u64::from(count) + u64::from(pixels) * u64::from(done);
                    progress(done, padded_pixels * u64::from(count));
                }
            }
            finished = Some((first_pixel, pixels));
        }
        finished.map_or(Ok(()), |band| self.collect(&mut film, band))?;
        self.totals.add_samples(count, wave_samples);
        Ok(film)
    }

    /// What all runs so far took.
    pub fn outcome(&self) -> Outcome {
        self.totals.outcome(self.view, &self.plan)
    }

    /// Where the band that begins with this pixel is read.
    fn read_back(&self, first_pixel: u64) -> &Buffer {
        let band = first_pixel / u64::from(self.plan.band_pixels);
        &self.read_back[band as usize % self.read_back.len()]
    }

    /// Runs one wave, and `host_work` beside it; false when it must be run once more.
    fn run_wave(
        &mut self,
        wave: Step,
        options: &Options,
        host_work: &mut impl FnMut(&Self) -> Result<()>,
    ) -> Result<bool> {
        options.go_on()?;
        let wave = Step { most_a_thread: self.most_a_thread, ..wave };
        let mut commands = Commands::new(&self.renderer.device, 2 * MOST_AT_ONCE)?;
        self.record(&mut commands, wave, options)?;
        let mut worked = Ok(());
        let times = commands.submit_and_wait_beside(|| worked = host_work(self))?;
        worked?;
        self.totals.add_times(&times);
        let mut counters = [0; COUNTERS as usize];
        counters.copy_from_slice(bytemuck::cast_slice(
            &self.read_back(wave.first_pixel.into()).read()?[..4 * COUNTERS as usize],
        ));
        if self.must_run_again(&counters)? {
            return Ok(false);
        }
        self.totals.add_counters(&counters);
        Ok(true)
    }

    /// Copies a band, its first pixel and how many it has, from tile order to the rows of the film.
    fn collect(&self, film: &mut Film, (first_pixel, pixels): (u64, u32)) -> Result<()> {
        let bytes = &self.read_back(first_pixel).read()?[COUNTER_BYTES..][..pixels as usize * PIXEL_BYTES];
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

/// Descriptors of all slots; views show their owner's buffer.
fn bind(renderer: &Renderer, buffers: &BTreeMap<u32, Buffer>) -> Result<Bindings> {
    let shown = |slot: u32| binding::ALL[slot as usize].view_of.unwrap_or(slot);
    Bindings::new(&renderer.layout, |slot| &buffers[&shown(slot)])
}
