//! Scene → picture on a Vulkan device: what is needed ([`Plan`]), where it lies (`upload`), in which order it runs (`frame`).

mod frame;
mod next_tree;
mod options;
mod plan;
mod progressive;
mod queues;
pub mod ray_sets;
mod subtrees;
mod textures;
mod totals;
mod trace;
mod tracers;
mod tree;
mod upload;
mod work;

pub use options::{Options, Progress, Sabotage};
pub use plan::{LeftOut, Plan, PlannedBuffer, PlannedPass};
pub use trace::{Met, Ray, Trace, Tracer};
pub use tree::{Rebase, Tree, TreeSize};

use crate::bvh::Quality;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::layout::{binding, kernels, BindingKind, Features, KernelCode, RayItem, Step};
use crate::report::{self, Report};
use crate::scene::{Scene, Soup, View};
use crate::vulkan::{
    Ahead, BindingSlot, Cache, Compiled, Device, DeviceChoice, Fetch, Habits, Instance, Kernel, Layout, SlotKind,
    Source,
};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

/// Renders a scene: opens the device, computes the picture, reports what it did.
///
/// To render several scenes, keep a [`Renderer`].
///
/// # Errors
/// `Usage` for options that make no sense, `NoDevice`, `Vulkan` or `Device` when there is no device or it fails,
/// `Validation` when validation is on and the layers complain.
pub fn render(scene: &Scene, options: &Options) -> Result<(Film, Report)> {
    Renderer::new(&options.device, options.validate)?.render(scene, options)
}

/// Most kernels that are kept: those of some forty sets of features.
const MOST_KERNELS: usize = 256;

/// An open device with its kernels, for any number of scenes.
pub struct Renderer {
    device: Arc<Device>,
    layout: Arc<Layout>,
    cache: Cache,
    /// The same for all features.
    prepare: Arc<Kernel>,
    ahead: Ahead,
    /// Compiled kernels by name and features: a second pipeline of the same code would be compiled again. Scenes of all kinds have
    /// some dozen sets of features; [`MOST_KERNELS`] bounds what a long life may gather.
    kernels: Mutex<HashMap<(&'static str, Features), Arc<Kernel>>>,
    /// One frame at a time: a frame takes the whole device anyway, and the validation layers of 1.3.239 crash when one
    /// thread frees its commands while another waits for the queue.
    frames: Mutex<()>,
    opened_in_ms: f64,
}

/// A scene made ready for any renderer: its triangles and what it needs.
pub struct Prepared {
    /// Triangles in world space.
    pub soup: Soup,
    /// Camera, lights, picture.
    pub view: View,
    /// What it needs.
    pub features: Features,
}

impl Prepared {
    /// Makes the soup, resolves the camera, finds the features.
    ///
    /// # Errors
    /// As [`Options::check_triangles`], [`Options::view`] and [`Soup::of`].
    pub fn new(scene: &Scene, options: &Options) -> Result<Self> {
        options.check_triangles(scene)?;
        let mut soup = Soup::with(scene, options.instancing)?;
        let view = options.view(scene, &soup)?;
        let sabotage = |one| options.sabotage == Some(one);
        if !sabotage(Sabotage::NoRebase) {
            soup.dice(view.camera.eye);
        }
        let own = crate::scene::features::of(scene, &soup, &view);
        let own = Features { thin_triangles: own.thin_triangles && !sabotage(Sabotage::SureOfThin), ..own };
        let features = Features {
            // Not needs: what was chosen.
            sobol: own.sobol,
            independent: own.independent,
            filter: own.filter,
            retrace: false,
            fixed_epsilon: sabotage(Sabotage::FixedEpsilon),
            moller_trumbore: sabotage(Sabotage::MollerTrumbore),
            plain_sums: sabotage(Sabotage::PlainSums),
            ..if options.all_features { Features::ALL } else { own }
        };
        Ok(Self { soup, view, features })
    }

    /// Builds its tree.
    pub fn tree(&self, options: &Options) -> Tree {
        let mut tree = Tree::build(&self.soup, self.rebase(options), self.quality(options));
        tree.rounds_outward = options.sabotage != Some(Sabotage::TightBoxes);
        tree
    }

    /// Its tree, made of the one of the frame before if that pays: see [`Tree::next`]. The picture is the same.
    pub fn next_tree(&self, options: &Options, last: &Tree) -> Tree {
        last.next(&self.soup, self.rebase(options), self.quality(options))
    }

    /// Light that passes a triangle must meet it once: none may lie in two leaves.
    fn quality(&self, options: &Options) -> Quality {
        if self.features.layers {
            Quality::Fast
        } else {
            options.quality(self.soup.len())
        }
    }

    fn rebase(&self, options: &Options) -> Rebase {
        match options.sabotage {
            Some(Sabotage::NoRebase) => Rebase::NONE,
            _ => Rebase::for_view(self.soup.lo, self.soup.hi, &self.view),
        }
    }
}

impl Renderer {
    /// Opens Vulkan and a device.
    ///
    /// # Errors
    /// `NoDevice` when there is none; `Vulkan` when the driver refuses.
    pub fn new(choice: &DeviceChoice, validate: bool) -> Result<Self> {
        Self::with_habits(choice, validate, Habits::default())
    }

    /// As [`Renderer::new`], with wishes how the device is used.
    ///
    /// # Errors
    /// As [`Renderer::new`].
    pub fn with_habits(choice: &DeviceChoice, validate: bool, habits: Habits) -> Result<Self> {
        let start = Instant::now();
        let instance = Instance::new(validate)?;
        let device = Device::open(&instance, choice, habits)?;
        let slots: Vec<BindingSlot> = binding::ALL
            .iter()
            .map(|binding| BindingSlot {
                slot: binding.slot,
                kind: match binding.kind {
                    BindingKind::Fetch => SlotKind::Fetch,
                    BindingKind::Storage => SlotKind::Storage,
                    BindingKind::Uniform => SlotKind::Uniform,
                },
            })
            .collect();
        let layout = Layout::new(&device, &slots, size_of::<Step>() as u32)?;
        let cache = Cache::open(&device, &kernels::CODE_HASH.to_le_bytes());
        let prepare = source(&device, &kernels::PREPARE, Features::default());
        let kernel = Arc::new(Kernel::new(&layout, &cache, &prepare)?);
        Ok(Self {
            ahead: Ahead::new(&kernel, prepare),
            prepare: kernel,
            cache,
            device,
            layout,
            kernels: Mutex::default(),
            frames: Mutex::default(),
            opened_in_ms: milliseconds(start),
        })
    }

    /// The open device.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Makes kernels with these features, side by side, as far as they are not there yet.
    fn make_kernels(&self, codes: &[&KernelCode], features: Features) -> Result<Compiled> {
        let kernels = || self.kernels.lock().unwrap_or_else(PoisonError::into_inner);
        let is_missing = |code: &&KernelCode| !kernels().contains_key(&(code.name, features));
        let missing: Vec<_> = codes.iter().copied().filter(is_missing).collect();
        let make = |code: &&KernelCode| {
            let source = source(&self.device, code, features);
            let kernel = Arc::new(Kernel::new(&self.layout, &self.cache, &source)?);
            Ok((kernel, source))
        };
        let made = missing.par_iter().map(make).collect::<Result<Vec<_>>>()?;
        if kernels().len() >= MOST_KERNELS {
            // Frames hold on to those they use.
            kernels().clear();
        }
        let named = missing.iter().zip(&made).map(|(code, (kernel, _))| ((code.name, features), kernel.clone()));
        kernels().extend(named);
        Ok(self.ahead.compile(made))
    }

    /// The kernel with these features, made once.
    fn kernel(&self, code: &KernelCode, features: Features) -> Result<Arc<Kernel>> {
        loop {
            let kernels = self.kernels.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(kernel) = kernels.get(&(code.name, features)) {
                return Ok(kernel.clone());
            }
            drop(kernels);
            self.make_kernels(&[code], features)?;
        }
    }

    /// Renders a scene on this device.
    ///
    /// # Errors
    /// As [`render`].
    pub fn render(&self, scene: &Scene, options: &Options) -> Result<(Film, Report)> {
        let start = Instant::now();
        let prepared = Prepared::new(scene, options)?;
        let load = milliseconds(start);
        self.render_prepared(scene, &prepared, options).map(|(film, mut report)| {
            report.times_ms.load = load;
            report.times_ms.total = milliseconds(start) + self.opened_in_ms;
            (film, report)
        })
    }

    /// Renders a scene that was prepared with the same options.
    ///
    /// # Errors
    /// As [`render`].
    pub fn render_prepared(&self, scene: &Scene, prepared: &Prepared, options: &Options) -> Result<(Film, Report)> {
        let start = Instant::now();
        let tree = prepared.tree(options);
        let bvh_ms = milliseconds(start);
        self.render_with_tree(scene, prepared, options, &tree).map(|(film, mut report)| {
            report.times_ms.bvh = bvh_ms;
            (film, report)
        })
    }

    /// Renders a prepared scene whose tree was built beside the opening of the device.
    ///
    /// # Errors
    /// As [`render`].
    pub fn render_with_tree(
        &self,
        scene: &Scene,
        prepared: &Prepared,
        options: &Options,
        tree: &Tree,
    ) -> Result<(Film, Report)> {
        let _frame = self.frames.lock().unwrap_or_else(PoisonError::into_inner);
        let Prepared { soup, view, features } = prepared;
        let features = tree.features(*features);
        // No queue may be larger than what the device binds at once.
        let most = self.device.info.max_storage_bytes / size_of::<RayItem>() as u64;
        let in_flight = options.samples_in_flight.min(u32::try_from(most).unwrap_or(u32::MAX));
        progressive::check(options)?;
        self.device.forget_peak_memory();
        let start = Instant::now();
        let textures = textures::Textures::of(scene, features.textures, self.device.fetch_limit())?;
        let plan = Plan::with_textures(prepared, scene, features, tree.size(), in_flight, &textures);
        let device_tree = tree.for_device(soup, view.camera.eye);
        let on_device =
            upload::Scene { scene, soup, view, tree: &device_tree, rebase: tree.rebase, textures: &textures };
        let mut frame = frame::Frame::new(self, view, on_device, plan, Box::new(|| tree.in_parts(soup)))?;
        let upload = milliseconds(start);
        let compiled = frame.kernels.compiled;
        let start = Instant::now();
        let (film, convergence) = if progressive::is_wanted(options) {
            let (film, convergence) = progressive::run(&mut frame, view, options)?;
            (film, Some(convergence))
        } else {
            let samples = view.first_sample..view.first_sample + view.samples;
            (frame.run(samples, view.seed, options)?, None)
        };
        let outcome = frame.outcome();
        let render = milliseconds(start);
        let messages = self.device.instance.messages();
        if !messages.is_empty() {
            return Err(Error::Validation(messages));
        }
        let mut scene_report = describe(scene, soup, view);
        if textures.halved > 0 {
            let (times, device) = (textures.halved, &self.device.info.name);
            let why = format!("{device} can bind no more than {} bytes at once", self.device.fetch_limit());
            scene_report.warnings.push(format!("approximated: textures were halved {times} times: {why}"));
        }
        let report = Report {
            frame: None,
            image: report::Image { width: view.width, height: view.height, ..Default::default() },
            device: describe_device(&self.device),
            scene: scene_report,
            features: features.needs().collect(),
            passes: outcome.passes,
            rays: outcome.rays,
            convergence,
            bvh: tree.report(),
            compiled_ahead: report::CompiledAhead {
                kernels: compiled.kernels,
                on_twins: compiled.on_twins,
                ms: compiled.time.as_secs_f64() * 1e3,
            },
            times_ms: report::Times { device: self.opened_in_ms, upload, render, ..Default::default() },
            memory_bytes: report::Memory { device_peak: self.device.peak_memory(), queues: outcome.queue_bytes },
        };
        Ok((film, report))
    }
}

/// A kernel with these features, as this device fetches.
fn source(device: &Device, code: &KernelCode, features: Features) -> Source {
    let spirv = match device.fetch {
        Fetch::Texel => code.texel_fetch,
        Fetch::Storage => code.storage_fetch,
    };
    let name = if features.retrace { "retrace" } else { code.name };
    Source { name, spirv: spirv.with(features), constants: features.list().map(|(_, on)| on).to_vec() }
}

/// The scene's part of a report.
pub fn describe(scene: &Scene, soup: &Soup, view: &View) -> report::Scene {
    report::Scene {
        triangles: soup.placed,
        instances: scene.instances.len(),
        lights: view.lights.len(),
        materials: scene.materials.len(),
        warnings: scene.warnings.iter().chain(&soup.warnings).cloned().collect(),
    }
}

/// The device's part of a report.
pub fn describe_device(device: &Device) -> report::Device {
    let info = &device.info;
    report::Device {
        name: info.name.clone(),
        driver: info.driver.clone(),
        api: info.api.clone(),
        kind: info.kind.name().into(),
        subgroup_size: info.subgroup_size,
    }
}

/// Milliseconds since `start`.
fn milliseconds(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}
