//! `glimt bench`.

use super::machine::MachineArgs;
use super::reading::ReadArgs;
use super::values::BvhChoice;
use super::{load_scene, milliseconds, Context, Outcome};
use clap::{Args, ValueEnum, ValueHint};
use glam::{DVec3, Vec3};
use glimt::render::ray_sets::{BenchRay, BenchView, PrimaryHit, SetKind};
use glimt::render::{describe_device, Met, Prepared, Ray, Renderer, Trace, Tracer};
use glimt::report::{Bench, BenchTree, Mismatches, Set, Spread, Work};
use glimt::scene::{Camera, Instancing, LightKind, Projection};
use glimt::vulkan::DeviceChoice;
use glimt::{reference, Error, Options, Result, Scene};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Flags of `glimt bench`.
#[derive(Args)]
pub struct BenchArgs {
    /// A .gltf or .glb file, - for standard input, or a built-in scene
    #[arg(value_hint = ValueHint::FilePath, default_value = "table")]
    scene: String,
    /// Camera, light and size as JSON: eye, target, up, vfov_deg, width, height, light_pos, bbox_min, bbox_max
    /// [default: the scene's own camera at 1024x768]
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    view: Option<PathBuf>,
    /// Ray sets to trace
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = [Sets::Primary, Sets::Shadow, Sets::Mirror, Sets::Diffuse])]
    sets: Vec<Sets>,
    /// Timed runs of each set
    #[arg(long, value_name = "N", default_value_t = 7, value_parser = clap::value_parser!(u32).range(1..=1000))]
    runs: u32,
    /// Write NAME.bin (triangles), NAME.json (view), NAME.SET.rays and our answers NAME.SET.ref to a folder
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    export: Option<PathBuf>,
    /// Trace the rays of DIR/NAME.SET.rays and count answers that differ from DIR/NAME.SET.ref
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath, conflicts_with = "export")]
    compare: Option<PathBuf>,
    #[command(flatten)]
    read: ReadArgs,
    /// How much work goes into the tree
    #[arg(long, value_enum, default_value_t = BvhChoice::Best)]
    bvh: BvhChoice,
    #[command(flatten)]
    machine: MachineArgs,
    /// Also count on the host what the rays ask of the tree: nodes and triangles, alone and as many rays in step as the device's subgroups have
    #[arg(long)]
    work: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Sets {
    /// From the eye, nearest hit
    Primary,
    /// To the light, any hit
    Shadow,
    /// Mirrored at what the primary ray hits, nearest hit
    Mirror,
    /// Scattered at what the primary ray hits, nearest hit
    Diffuse,
}

impl Sets {
    fn kind(self) -> SetKind {
        match self {
            Self::Primary => SetKind::Primary,
            Self::Shadow => SetKind::Shadow,
            Self::Mirror => SetKind::Mirror,
            Self::Diffuse => SetKind::Diffuse,
        }
    }
}

/// Builds of the tree, of which the median is told.
const BUILDS: usize = 3;

impl BenchArgs {
    /// Traces, times, compares.
    pub fn run(self, context: &Context) -> Result<Outcome> {
        self.machine.set_threads()?;
        // Rays are compared with programs that know triangles alone.
        let instancing = Instancing::Flat;
        let mut options = Options {
            interrupted: context.interrupted.clone(),
            instancing,
            bvh: Some(self.bvh.into()),
            ..Options::default()
        };
        options.device = self.machine.device.clone().map_or(DeviceChoice::Best, DeviceChoice::Named);
        if let Some(folder) = &self.export {
            std::fs::create_dir_all(folder).map_err(|error| Error::write(folder, error))?;
        }
        let scene = load_scene(&self.scene, &self.read.options())?;
        let (prepared, view) = self.prepare(&scene, &options)?;
        let renderer = Renderer::new(&options.device, self.machine.validate)?;
        let build = || {
            let start = Instant::now();
            let tree = prepared.tree(&options);
            (tree, milliseconds(start))
        };
        let (tree, first_ms) = build();
        let build_ms = Spread::of(std::iter::once(first_ms).chain((1..BUILDS).map(|_| build().1))).median;
        let mut tracer = renderer.tracer(&scene, &prepared, &tree)?;
        let mut files = Files::of(&self, &scene.name);
        let lanes = renderer.device().info.subgroup_size as usize;
        let work = |kind, rays: &[Ray]| tree.work(&prepared, kind, rays, lanes);
        let sets = self.trace(&mut tracer, &prepared, &view, &options, &mut files, work)?;
        if self.machine.validate && !renderer.device().instance.messages().is_empty() {
            return Err(Error::Validation(renderer.device().instance.messages()));
        }
        files.write(&prepared, &view)?;
        let (size, report) = (tree.size(), tree.report());
        let bench = Bench {
            scene: scene.name.clone(),
            triangles: prepared.soup.placed,
            sets,
            bvh: BenchTree {
                builder: tree.quality.name(),
                build_ms,
                nodes: report.nodes,
                bytes: report.bytes,
                triangle_bytes: 48 * size.triangles as u64,
                sah_cost: report.sah_cost,
                depth: report.depth,
            },
            device: describe_device(renderer.device()),
        };
        if self.json {
            return Outcome::json(&bench);
        }
        Ok(Outcome::text(bench.text() + "\n"))
    }

    /// The scene as the rays meet it, and where they come from.
    fn prepare(&self, scene: &Scene, options: &Options) -> Result<(Prepared, BenchView)> {
        let mut prepared = Prepared::new(scene, options)?;
        let Some(path) = &self.view else {
            let view = own_view(&prepared);
            return Ok((prepared, view));
        };
        let text = std::fs::read(path).map_err(|source| Error::Read { path: path.clone(), source })?;
        let refuse = |message: String| Error::content(path.display().to_string(), message);
        let view: BenchView = serde_json::from_slice(&text).map_err(|error| refuse(error.to_string()))?;
        let tiled = |side: u32| (8..=4096).contains(&side) && side.is_multiple_of(8);
        if !tiled(view.width) || !tiled(view.height) {
            return Err(refuse("width and height must be multiples of 8 from 8 to 4096".into()));
        }
        if !(view.vfov_deg > 0.0 && view.vfov_deg < 180.0) {
            return Err(refuse(format!("vfov_deg {}: must be between 0 and 180", view.vfov_deg)));
        }
        let [eye, target, up] = [view.eye, view.target, view.up].map(|vector| DVec3::from(Vec3::from(vector)));
        let fov = f64::from(view.vfov_deg).to_radians();
        prepared.view.camera = Camera::looking(eye, target - eye, up, Projection::Perspective { fov })?;
        (prepared.view.width, prepared.view.height) = (view.width, view.height);
        Ok((prepared, view))
    }

    fn trace(
        &self,
        tracer: &mut Tracer,
        prepared: &Prepared,
        view: &BenchView,
        options: &Options,
        files: &mut Files,
        work: impl Fn(SetKind, &[Ray]) -> Work,
    ) -> Result<Vec<Set>> {
        let order = view.order();
        let by_pixel = view.primary();
        let primary: Vec<Ray> = order.iter().map(|pixel| (&by_pixel[*pixel as usize]).into()).collect();
        let wanted = |kind: SetKind| self.sets.iter().any(|set| set.kind() == kind);
        let runs = |kind| if wanted(kind) { self.runs as usize } else { 0 };
        // The other sets start where the primary rays end.
        let trace = tracer.trace(SetKind::Primary, &primary, runs(SetKind::Primary), options)?;
        let mut hits = vec![None; by_pixel.len()];
        for (pixel, met) in order.iter().zip(&trace.met) {
            if let Met::Triangle { t, primitive, .. } = *met {
                let corners = prepared.soup.positions[primitive as usize].map(|corner| corner.as_vec3());
                hits[*pixel as usize] = Some(PrimaryHit { t, corners });
            }
        }
        let mut sets = Vec::new();
        for set in &self.sets {
            let kind = set.kind();
            let rays = match files.rays(kind)? {
                Some(rays) => rays,
                None if kind == SetKind::Primary => by_pixel.clone(),
                None => view.secondary(kind, &by_pixel, &hits),
            };
            if rays.len() != order.len() {
                return Err(Error::Usage(format!("{} {} rays for {} pixels", rays.len(), kind.name(), order.len())));
            }
            let pixels: Vec<u32> = order.iter().copied().filter(|pixel| rays[*pixel as usize].t_max >= 0.0).collect();
            let active: Vec<BenchRay> = pixels.iter().map(|pixel| rays[*pixel as usize]).collect();
            let walked: Vec<Ray> = active.iter().map(Ray::from).collect();
            let traced = if kind == SetKind::Primary {
                trace.clone()
            } else {
                tracer.trace(kind, &walked, runs(kind), options)?
            };
            let answers: Vec<f32> = traced.met.iter().map(answer).collect();
            let mismatches = files.compare(kind, prepared, &pixels, &active, &answers)?;
            let work = self.work.then(|| work(kind, &walked));
            sets.push(Set { work, ..described(kind, &traced, mismatches) });
            files.keep(kind, rays, &pixels, &answers);
        }
        Ok(sets)
    }
}

/// Distance, 1 for a blocked shadow ray, −1 for nothing.
fn answer(met: &Met) -> f32 {
    match *met {
        Met::Nothing => -1.0,
        Met::Something => 1.0,
        Met::Triangle { t, .. } => t,
    }
}

fn described(kind: SetKind, trace: &Trace, mismatches: Option<Mismatches>) -> Set {
    let rays = trace.met.len();
    Set {
        name: kind.name(),
        rays,
        hits: trace.met.iter().filter(|met| **met != Met::Nothing).count(),
        mrays_per_s: Spread::of(trace.wall_ms.iter().map(|ms| rays as f64 / ms / 1e3)),
        device_ms: Spread::of(trace.device_ms.iter().copied()),
        wall_ms: Spread::of(trace.wall_ms.iter().copied()),
        mismatches,
        work: None,
    }
}

/// The view of a prepared scene, with a light where its first one stands, or where the default light comes from.
fn own_view(prepared: &Prepared) -> BenchView {
    let (soup, view) = (&prepared.soup, &prepared.view);
    let camera = &view.camera;
    let f32s = |vector: DVec3| vector.as_vec3().to_array();
    let placed = view.lights.iter().find(|light| !matches!(light.kind, LightKind::Directional));
    let toward = (camera.forward + 0.5 * camera.right - 0.75 * camera.up).normalize();
    let light = placed.map_or(soup.center() - toward * (soup.hi - soup.lo).length(), |light| light.position);
    let fov = match camera.projection {
        Projection::Perspective { fov } => fov,
        Projection::Orthographic { .. } => std::f64::consts::FRAC_PI_4,
    };
    BenchView {
        eye: f32s(camera.eye),
        target: f32s(camera.eye + camera.forward),
        up: f32s(camera.up),
        vfov_deg: fov.to_degrees() as f32,
        width: view.width,
        height: view.height,
        light_pos: f32s(light),
        bbox_min: f32s(soup.lo),
        bbox_max: f32s(soup.hi),
    }
}

/// Files that are read or written beside the measurement.
struct Files<'a> {
    compare: Option<&'a Path>,
    export: Option<&'a Path>,
    name: String,
    kept: Vec<(PathBuf, Vec<u8>)>,
}

impl<'a> Files<'a> {
    fn of(args: &'a BenchArgs, name: &str) -> Self {
        Self { compare: args.compare.as_deref(), export: args.export.as_deref(), name: name.into(), kept: Vec::new() }
    }

    fn read<T: bytemuck::Pod>(&self, folder: &Path, kind: SetKind, extension: &str) -> Result<Vec<T>> {
        let path = folder.join(format!("{}.{}.{extension}", self.name, kind.name()));
        let bytes = std::fs::read(&path).map_err(|source| Error::Read { path: path.clone(), source })?;
        if bytes.len() % size_of::<T>() != 0 {
            return Err(Error::content(path.display().to_string(), "it is no whole number of entries long"));
        }
        Ok(bytemuck::pod_collect_to_vec(&bytes))
    }

    /// The rays of the other program, row by row.
    fn rays(&self, kind: SetKind) -> Result<Option<Vec<BenchRay>>> {
        self.compare.map(|folder| self.read(folder, kind, "rays")).transpose()
    }

    /// Counts answers that differ from the other program's.
    fn compare(
        &self,
        kind: SetKind,
        prepared: &Prepared,
        pixels: &[u32],
        rays: &[BenchRay],
        answers: &[f32],
    ) -> Result<Option<Mismatches>> {
        let Some(folder) = self.compare else { return Ok(None) };
        let others: Vec<f32> = self.read(folder, kind, "ref")?;
        let mut mismatches = Mismatches::default();
        for ((pixel, ray), own) in pixels.iter().zip(rays).zip(answers) {
            let other = others.get(*pixel as usize).copied().unwrap_or(-1.0);
            let (hits, other_hits) = (*own > 0.0, other > 0.0);
            let differs = kind != SetKind::Shadow && (own - other).abs() > 1e-3 * other.abs().max(1.0);
            if hits == other_hits && !differs {
                continue;
            }
            mismatches.count += 1;
            mismatches.missed += usize::from(other_hits && !hits);
            mismatches.extra += usize::from(hits && !other_hits);
            let [origin, direction] = [ray.origin, ray.direction].map(|vector| DVec3::from(Vec3::from(vector)));
            let nearest = (kind != SetKind::Shadow).then_some(*own);
            let met = hits.then(|| nearest.map(f64::from));
            let allowed = reference::allows(&prepared.soup, origin, direction, ray.t_max.into(), met);
            mismatches.wrong += usize::from(!allowed);
        }
        Ok(Some(mismatches))
    }

    fn keep(&mut self, kind: SetKind, rays: Vec<BenchRay>, pixels: &[u32], answers: &[f32]) {
        let Some(folder) = self.export else { return };
        let mut by_pixel = vec![-1.0_f32; rays.len()];
        for (pixel, answer) in pixels.iter().zip(answers) {
            by_pixel[*pixel as usize] = *answer;
        }
        let path = |extension: &str| folder.join(format!("{}.{}.{extension}", self.name, kind.name()));
        self.kept.push((path("rays"), bytemuck::cast_slice(&rays).to_vec()));
        self.kept.push((path("ref"), bytemuck::cast_slice(&by_pixel).to_vec()));
    }

    /// Writes all that was kept, and the triangles and the view with it.
    fn write(mut self, prepared: &Prepared, view: &BenchView) -> Result<()> {
        let Some(folder) = self.export else { return Ok(()) };
        let mut triangles = (prepared.soup.len() as u32).to_le_bytes().to_vec();
        for corners in &prepared.soup.positions {
            triangles.extend(corners.iter().flat_map(|corner| corner.as_vec3().to_array()).flat_map(f32::to_le_bytes));
        }
        let json = serde_json::to_vec_pretty(view).map_err(|error| Error::write(folder, error))?;
        self.kept.push((folder.join(format!("{}.bin", self.name)), triangles));
        self.kept.push((folder.join(format!("{}.json", self.name)), json));
        self.kept.iter().try_for_each(|(path, bytes)| glimt::film::write_whole(path, bytes))
    }
}
