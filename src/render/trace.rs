//! Ray sets through the very kernels that render: `primary` makes its own rays, `reflection` and `shadow` get theirs in their
//! queues, filled by the host instead of `shade`.

use super::frame::Frame;
use super::ray_sets::{BenchRay, SetKind};
use super::{upload, Options, Plan, Renderer};
use crate::bvh::quantise;
use crate::error::{Error, Result};
use crate::layout::{
    binding, Features, HitItem, ReflectionItem, ShadowItem, Step, COUNTERS, COUNTER_FILLING, QUEUE_HIT,
    QUEUE_REFLECTION, QUEUE_SHADOW, WORKGROUP,
};
use crate::scene::{Scene, View};
use crate::vulkan::{Access, Commands};
use glam::{DVec3, Vec3};
use std::time::Instant;

/// A scene on the device, ready to trace rays.
pub struct Tracer<'a> {
    frame: Frame<'a>,
    prepared: &'a super::Prepared,
    tree: &'a super::Tree,
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
    /// Puts a prepared scene and its tree on the device, with queues for one ray a pixel of the view.
    ///
    /// # Errors
    /// As [`super::render`].
    pub fn tracer<'a>(
        &'a self,
        scene: &'a Scene,
        prepared: &'a super::Prepared,
        tree: &'a super::Tree,
    ) -> Result<Tracer<'a>> {
        let View { width, height, .. } = prepared.view;
        let features = Features { shadows: true, reflections: true, ..Features::default() };
        let plan = Plan::new(scene, &prepared.soup, &prepared.view, features, tree.bvh.nodes.len(), width * height);
        if plan.waves(1) != 1 {
            return Err(Error::Usage(format!("{width}x{height} rays do not fit into one wave")));
        }
        let (soup, view) = (&prepared.soup, &prepared.view);
        let quantised = quantise(&tree.bvh, (view.camera.eye - tree.center).abs().as_vec3());
        let frame = Frame::new(self, view, upload::Scene { scene, soup, view, tree, quantised: &quantised }, plan)?;
        Ok(Tracer { frame, prepared, tree })
    }
}

impl Tracer<'_> {
    /// Traces a set once to warm up and then `runs` times. Primary rays are the view's own, whatever `rays` says.
    ///
    /// # Errors
    /// `Device` when the rays do not fit or one is lost; `Vulkan` when the device fails.
    pub fn trace(&self, kind: SetKind, rays: &[BenchRay], runs: usize, options: &Options) -> Result<Trace> {
        let Frame { renderer, buffers, .. } = &self.frame;
        let device = &renderer.device;
        let (queue, items) = self.items(kind, rays);
        let slot = match kind {
            SetKind::Primary => None,
            SetKind::Shadow => Some(binding::SHADOW_QUEUE),
            SetKind::Mirror | SetKind::Diffuse => Some(binding::REFLECTION_QUEUE),
        };
        let target = slot.map(|slot| &buffers[slot as usize]);
        if target.is_some_and(|target| (items.len() as u64) > target.bytes) {
            return Err(Error::Device(format!("{} rays do not fit into the queue", rays.len())));
        }
        let mut counters = vec![0_u32; COUNTERS as usize];
        counters[(COUNTER_FILLING + queue) as usize] = if slot.is_some() { rays.len() as u32 } else { 0 };
        let counters = upload::staging(renderer, bytemuck::cast_slice(&counters))?;
        let items = upload::staging(renderer, &items)?;
        let mut trace = Trace { met: Vec::new(), wall_ms: Vec::new(), device_ms: Vec::new() };
        for run in 0..=runs {
            if options.interrupted.load(std::sync::atomic::Ordering::Relaxed) {
                return Err(Error::Interrupted);
            }
            let mut commands = Commands::new(device, 0)?;
            commands.copy(&counters, &buffers[binding::COUNTERS as usize], 0, 4 * u64::from(COUNTERS));
            commands.clear(&buffers[binding::RADIANCE as usize]);
            if let Some(target) = target {
                commands.copy(&items, target, 0, items.bytes.min(target.bytes));
            }
            // Counters, radiance, queue: copies wrote, kernels of the next submission read and write.
            commands.barrier(Access::Transfer, Access::ShaderReadWrite);
            commands.submit_and_wait()?;
            let (wall, spans) = self.run(kind, queue, rays.len() as u32)?;
            if run > 0 {
                trace.wall_ms.push(wall);
                let pass = spans.iter().filter(|(name, _)| *name != "prepare").map(|(_, ms)| ms);
                trace.device_ms.extend((!spans.is_empty()).then(|| pass.sum::<f64>()));
            }
        }
        trace.met = self.answers(kind, rays)?;
        Ok(trace)
    }

    /// One timed submission: wall-clock milliseconds and the spans of its dispatches.
    fn run(&self, kind: SetKind, queue: u32, rays: u32) -> Result<(f64, Vec<(&'static str, f64)>)> {
        let Frame { renderer, kernels, bindings, buffers, .. } = &self.frame;
        let wave = Step { pixels: rays, samples: 1, finish: 1, ..Step::default() };
        let start = Instant::now();
        let mut commands = Commands::new(&renderer.device, 2)?;
        commands.bind(&kernels.primary, bindings);
        let kernel = match kind {
            SetKind::Primary => {
                commands.dispatch(&kernels.primary, bytemuck::bytes_of(&wave), rays.div_ceil(WORKGROUP));
                None
            }
            SetKind::Shadow => kernels.shadow.as_ref(),
            SetKind::Mirror | SetKind::Diffuse => kernels.reflection.as_ref(),
        };
        if let Some(kernel) = kernel {
            self.frame.prepare(&mut commands, 1 << queue);
            let arguments = &buffers[binding::DISPATCHES as usize];
            commands.dispatch_indirect(kernel, bytemuck::bytes_of(&wave), arguments, queue.into());
        }
        // Queues, radiance, counters: kernels wrote, copies of the next submission read.
        commands.barrier(Access::ShaderWrite, Access::Transfer);
        let spans = commands.submit_and_wait()?;
        Ok((start.elapsed().as_secs_f64() * 1e3, spans))
    }

    /// The queue that rays of this kind wait in, and its content.
    fn items(&self, kind: SetKind, rays: &[BenchRay]) -> (u32, Vec<u8>) {
        let origin = |ray: &BenchRay| (DVec3::from(Vec3::from(ray.origin)) - self.tree.center).as_vec3().into();
        let rays = rays.iter().zip(0..);
        match kind {
            SetKind::Primary => (QUEUE_HIT, Vec::new()),
            SetKind::Shadow => {
                let items: Vec<_> = rays
                    .map(|(ray, sample_index)| ShadowItem {
                        sample_index,
                        origin: origin(ray),
                        direction: ray.direction,
                        distance: ray.t_max,
                        radiance: [1.0; 3],
                    })
                    .collect();
                (QUEUE_SHADOW, bytemuck::cast_slice(&items).to_vec())
            }
            SetKind::Mirror | SetKind::Diffuse => {
                let items: Vec<_> = rays
                    .map(|(ray, sample_index)| ReflectionItem {
                        sample_index,
                        origin: origin(ray),
                        direction: ray.direction,
                        throughput: [1.0; 3],
                    })
                    .collect();
                (QUEUE_REFLECTION, bytemuck::cast_slice(&items).to_vec())
            }
        }
    }

    /// Reads what the last run left behind.
    fn answers(&self, kind: SetKind, rays: &[BenchRay]) -> Result<Vec<Met>> {
        let buffers = &self.frame.buffers;
        let counters = upload::read_back(self.frame.renderer, &buffers[binding::COUNTERS as usize])?;
        let counters: &[u32] = bytemuck::cast_slice(counters.read()?);
        super::frame::all_complete(counters)?;
        let mut met = vec![Met::Nothing; rays.len()];
        if kind == SetKind::Shadow {
            let radiance = upload::read_back(self.frame.renderer, &buffers[binding::RADIANCE as usize])?;
            let radiance: &[[f32; 4]] = bytemuck::cast_slice(radiance.read()?);
            for (met, radiance) in met.iter_mut().zip(radiance) {
                *met = if radiance[0] > 0.5 { Met::Nothing } else { Met::Something };
            }
            return Ok(met);
        }
        let hits = counters[(COUNTER_FILLING + QUEUE_HIT) as usize] as usize;
        let queue = upload::read_back(self.frame.renderer, &buffers[binding::HIT_QUEUE as usize])?;
        let items: &[HitItem] = bytemuck::cast_slice(&queue.read()?[..hits * size_of::<HitItem>()]);
        for item in items {
            let primitive = self.tree.bvh.order[item.triangle as usize];
            let ray = &rays[item.sample_index as usize];
            let corners = self.prepared.soup.positions[primitive as usize];
            let [l2, l3] = item.barycentrics.map(f64::from);
            let point = corners[0] * (1.0 - l2 - l3) + corners[1] * l2 + corners[2] * l3;
            let offset = point - DVec3::from(Vec3::from(ray.origin));
            let direction = DVec3::from(Vec3::from(ray.direction));
            let t = (offset.dot(direction) / direction.length_squared()) as f32;
            met[item.sample_index as usize] = Met::Triangle { t, primitive };
        }
        Ok(met)
    }
}
