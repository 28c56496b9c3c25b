//! Ray sets through the very kernels that render: `primary` makes its own rays, `reflection` and `shadow` get theirs in their
//! queues, filled by the host instead of `shade`.

use super::frame::Frame;
use super::queues::{filling, filling_back, workgroups_for};
use super::ray_sets::{BenchRay, SetKind};
use super::textures::Textures;
use super::tracers::Tracers;
use super::{upload, Options, Plan, Rebase, Renderer};
use crate::error::{Error, Result};
use crate::layout::{
    binding, Features, HitItem, RayItem, Step, COUNTERS, FAR, QUEUE_HIT, QUEUE_PRIMARY_AGAIN, QUEUE_REFLECTION,
    QUEUE_REFLECTION_AGAIN, QUEUE_SHADOW, QUEUE_SHADOW_AGAIN,
};
use crate::scene::{Scene, View};
use crate::vulkan::{Access, Buffer, Commands, Usage};
use glam::{DVec3, Vec3};
use std::sync::{MutexGuard, PoisonError};
use std::time::Instant;

/// A scene on the device, ready to trace rays.
pub struct Tracer<'a> {
    frame: Frame<'a>,
    prepared: &'a super::Prepared,
    rebase: Rebase,
    /// Primitives in leaf order.
    order: Vec<u32>,
    /// A renderer does one frame at a time. Dropped last.
    _alone: MutexGuard<'a, ()>,
}

/// A ray in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start.
    pub origin: DVec3,
    /// Unit direction.
    pub direction: DVec3,
    /// Hits beyond this do not count.
    pub t_max: f64,
}

impl From<&BenchRay> for Ray {
    fn from(ray: &BenchRay) -> Self {
        let [origin, direction] = [ray.origin, ray.direction].map(|vector| DVec3::from(Vec3::from(vector)));
        Self { origin, direction, t_max: ray.t_max.into() }
    }
}

/// What a ray met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Met {
    /// Nothing.
    Nothing,
    /// Something, somewhere: shadow rays do not ask for more.
    Something,
    /// This triangle is the nearest.
    Triangle {
        /// Distance.
        t: f32,
        /// Its number in the soup.
        primitive: u32,
        /// λ2, λ3.
        barycentrics: [f32; 2],
    },
}

/// A set traced several times.
#[derive(Clone, Debug)]
pub struct Trace {
    /// What each ray met, in the order of the rays.
    pub met: Vec<Met>,
    /// Wall-clock milliseconds of each run, submission and waiting included.
    pub wall_ms: Vec<f64>,
    /// Device milliseconds of each run by timestamps; empty where the device has none.
    pub device_ms: Vec<f64>,
}

impl Renderer {
    /// Puts a prepared scene and its tree on the device, with queues for one ray a pixel of the view. As long as the tracer lives, other
    /// frames of this renderer wait.
    ///
    /// # Errors
    /// As [`super::render`].
    pub fn tracer<'a>(
        &'a self,
        scene: &'a Scene,
        prepared: &'a super::Prepared,
        tree: &'a super::Tree,
    ) -> Result<Tracer<'a>> {
        let alone = self.frames.lock().unwrap_or_else(PoisonError::into_inner);
        let View { width, height, .. } = prepared.view;
        let Features { moller_trumbore, thin_triangles, .. } = prepared.features;
        let features =
            Features { shadows: true, reflections: true, moller_trumbore, thin_triangles, ..Features::default() };
        let features = tree.features(features);
        let textures = Textures::of(scene, features.textures, self.device.fetch_limit())?;
        let plan = Plan::with_textures(prepared, scene, features, tree.size(), width * height, &textures);
        if plan.waves(1) != 1 {
            return Err(Error::Usage(format!("{width}x{height} rays do not fit into one wave")));
        }
        let (soup, view) = (&prepared.soup, &prepared.view);
        let device_tree = tree.for_device(soup, view.camera.eye);
        let on_device =
            upload::Scene { scene, soup, view, tree: &device_tree, rebase: tree.rebase, textures: &textures };
        let frame = Frame::new(self, view, on_device, plan, Box::new(|| tree.in_parts(soup)))?;
        Ok(Tracer { frame, prepared, rebase: tree.rebase, order: device_tree.order, _alone: alone })
    }
}

impl Tracer<'_> {
    /// Traces a set once to warm up and then `runs` times. Primary rays are the view's own, whatever `rays` says.
    ///
    /// # Errors
    /// `Device` when the rays do not fit or one is lost; `Vulkan` when the device fails.
    pub fn trace(&mut self, kind: SetKind, rays: &[Ray], runs: usize, options: &Options) -> Result<Trace> {
        let input = Input::new(self.frame.renderer, kind, rays, self.rebase)?;
        if rays.len() > (self.prepared.view.width * self.prepared.view.height) as usize {
            return Err(Error::Device(format!("{} rays do not fit into the queue", rays.len())));
        }
        let mut trace = Trace { met: Vec::new(), wall_ms: Vec::new(), device_ms: Vec::new() };
        let mut run = 0;
        while run <= runs {
            options.go_on()?;
            self.fill(&input)?;
            let (wall, device) = self.run(kind, rays.len() as u32, options)?;
            let counters = upload::read_back(self.frame.renderer, self.frame.buffer(binding::COUNTERS))?;
            let counters: &[u32] = bytemuck::cast_slice(counters.read()?);
            if self.frame.must_run_again(counters)? {
                continue;
            }
            if run > 0 {
                trace.wall_ms.push(wall);
                trace.device_ms.extend((device > 0.0).then_some(device));
            }
            run += 1;
        }
        trace.met = self.answers(kind, rays)?;
        Ok(trace)
    }

    /// Puts rays into their queue and everything else to its start.
    fn fill(&self, input: &Input) -> Result<()> {
        let frame = &self.frame;
        let mut commands = Commands::new(&frame.renderer.device, 0)?;
        commands.copy(&input.counters, frame.buffer(binding::COUNTERS), 0, 4 * u64::from(COUNTERS));
        commands.clear(frame.buffer(binding::RADIANCE));
        if let Some(slot) = input.slot {
            let target = frame.buffer(slot);
            commands.copy(&input.items, target, 0, input.items.bytes.min(target.bytes));
        }
        let ones = frame.buffer(binding::SHADOW_RADIANCE);
        commands.copy(&input.ones, ones, 0, input.ones.bytes.min(ones.bytes));
        // Counters, radiance, queue: copies wrote, kernels of the next submission read and write.
        commands.barrier(Access::Transfer, Access::ShaderReadWrite);
        commands.submit_and_wait().map(drop)
    }

    /// One timed submission: wall-clock and device milliseconds.
    fn run(&mut self, kind: SetKind, rays: u32, options: &Options) -> Result<(f64, f64)> {
        let frame = &mut self.frame;
        let Tracers { primary, shadow, reflection } = &frame.kernels.trace.clone();
        let wave = Step { pixels: rays, samples: 1, finish: 1, most_a_thread: frame.most_a_thread, ..Step::default() };
        let start = Instant::now();
        let mut commands = Commands::new(&frame.renderer.device, 4)?;
        commands.bind(primary, &frame.bindings);
        let (from_queue, again) = match kind {
            SetKind::Primary => (None, QUEUE_PRIMARY_AGAIN),
            SetKind::Shadow => (shadow.as_ref().map(|kernel| (kernel, QUEUE_SHADOW)), QUEUE_SHADOW_AGAIN),
            SetKind::Mirror | SetKind::Diffuse => {
                (reflection.as_ref().map(|kernel| (kernel, QUEUE_REFLECTION)), QUEUE_REFLECTION_AGAIN)
            }
        };
        if let Some((kernel, queue)) = from_queue {
            frame.prepare(&mut commands, &[queue], options)?;
            frame.dispatch_queue(&mut commands, kernel, wave, queue);
        } else if kind == SetKind::Primary {
            commands.dispatch(primary, bytemuck::bytes_of(&wave), workgroups_for(rays, wave.most_a_thread));
        }
        frame.trace_again(&mut commands, wave, again, options)?;
        // Queues, radiance, counters: kernels wrote, copies of the next submission read.
        commands.barrier(Access::ShaderWrite, Access::Transfer);
        let spans = commands.submit_and_wait()?;
        let wall = start.elapsed().as_secs_f64() * 1e3;
        Ok((wall, spans.iter().filter(|(name, _)| *name != "prepare").map(|(_, ms)| ms).sum()))
    }

    /// Reads what the last run left behind.
    fn answers(&self, kind: SetKind, rays: &[Ray]) -> Result<Vec<Met>> {
        let read_back = |slot| upload::read_back(self.frame.renderer, self.frame.buffer(slot));
        let mut met = vec![Met::Nothing; rays.len()];
        if kind == SetKind::Shadow {
            let radiance = read_back(binding::RADIANCE)?;
            let radiance: &[[f32; 4]] = bytemuck::cast_slice(radiance.read()?);
            for (met, radiance) in met.iter_mut().zip(radiance) {
                *met = if radiance[0] > 0.5 { Met::Nothing } else { Met::Something };
            }
            return Ok(met);
        }
        let counters = read_back(binding::COUNTERS)?;
        let counters: &[u32] = bytemuck::cast_slice(counters.read()?);
        let front = counters[filling(QUEUE_HIT)] as usize;
        let back = counters[filling_back(QUEUE_HIT)] as usize;
        let queue = read_back(binding::HIT_QUEUE)?;
        let items: &[HitItem] = bytemuck::cast_slice(&queue.read()?[..rays.len() * size_of::<HitItem>()]);
        for item in items[..front].iter().chain(&items[items.len() - back..]) {
            let primitive = self.order[item.triangle as usize];
            let ray = &rays[item.sample_index as usize];
            let corners = self.prepared.soup.positions[primitive as usize];
            let [l2, l3] = item.barycentrics.map(f64::from);
            let point = corners[0] * (1.0 - l2 - l3) + corners[1] * l2 + corners[2] * l3;
            let t = ((point - ray.origin).dot(ray.direction) / ray.direction.length_squared()) as f32;
            met[item.sample_index as usize] = Met::Triangle { t, primitive, barycentrics: item.barycentrics };
        }
        Ok(met)
    }
}

/// What a set puts on the device before each run.
struct Input {
    /// The queue that its rays wait in; none for primary rays, which have no items.
    slot: Option<u32>,
    items: Buffer,
    counters: Buffer,
    /// What shadow rays add where they are not blocked.
    ones: Buffer,
}

impl Input {
    fn new(renderer: &Renderer, kind: SetKind, rays: &[Ray], rebase: Rebase) -> Result<Self> {
        let item = |(ray, sample_index): (&Ray, u32)| RayItem {
            origin: rebase.point(ray.origin).into(),
            sample_index,
            direction: rebase.direction(ray.direction).into(),
            distance: (ray.t_max * rebase.scale).min(f64::from(FAR)) as f32,
        };
        let queue = match kind {
            SetKind::Primary => None,
            SetKind::Shadow => Some((binding::SHADOW_QUEUE, QUEUE_SHADOW)),
            SetKind::Mirror | SetKind::Diffuse => Some((binding::REFLECTION_QUEUE, QUEUE_REFLECTION)),
        };
        let mut counters = vec![0_u32; COUNTERS as usize];
        let items: Vec<RayItem> = match queue {
            Some((_, queue)) => {
                counters[filling(queue)] = rays.len() as u32;
                rays.iter().zip(0..).map(item).collect()
            }
            None => Vec::new(),
        };
        let source = |name, bytes: &[u8]| Buffer::with_data(&renderer.device, name, bytes, Usage::Storage);
        Ok(Self {
            slot: queue.map(|(slot, _)| slot),
            items: source("rays", bytemuck::cast_slice(&items))?,
            counters: source("first counters", bytemuck::cast_slice(&counters))?,
            ones: source("ones", bytemuck::cast_slice(&vec![[1.0_f32; 4]; rays.len()]))?,
        })
    }
}
