//! `glimt render`.

use super::machine::MachineArgs;
use super::view::ViewArgs;
use super::{load_scene, milliseconds, progress, sequence, stop_if_interrupted, Context, Outcome};
use clap::{Args, ValueHint};
use glimt::film::{Film, Format, Saved};
use glimt::render::{describe, Prepared, Renderer, Tree};
use glimt::scene::{Background, Soup};
use glimt::vulkan::DeviceChoice;
use glimt::{reference, report, Error, Options, Report, Result, Scene};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Flags of `glimt render`.
#[derive(Args)]
pub struct RenderArgs {
    /// A .gltf or .glb file, - for standard input, or a built-in scene: table, cornell, mirrors, teapot
    #[arg(value_hint = ValueHint::FilePath, default_value = "table")]
    pub(super) scene: String,
    /// File to write: .png, .exr or .hdr; - writes PNG to standard output; with --frames {} or {:04} in its name is the frame's
    /// number [default: the scene's name with .png]
    #[arg(short, long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(super) output: Option<PathBuf>,
    /// Render a sequence: frames A, A + 1, … up to but without B, each at its number / --fps seconds; a camera that frames the
    /// scene by itself stays where the first frame has it
    #[arg(long, value_name = "A..B", value_parser = sequence::frames, conflicts_with_all = ["at", "max_time"])]
    frames: Option<std::ops::Range<u32>>,
    /// Frames a second
    #[arg(long, value_name = "N", default_value_t = 24.0, value_parser = sequence::fps, requires = "frames")]
    pub(super) fps: f64,
    /// Bits a channel of a PNG
    #[arg(long, value_name = "8|16", default_value_t = 8, value_parser = bits)]
    pub(super) bits: u8,
    /// Add samples until the estimated RMSE in linear RGB is this small, instead of --spp
    #[arg(long, value_name = "RMSE")]
    target_error: Option<f64>,
    /// Add samples until so many seconds after the start, instead of --spp
    #[arg(long, value_name = "SECONDS")]
    max_time: Option<f64>,
    #[command(flatten)]
    pub(super) machine: MachineArgs,
    /// Print one JSON object on standard output, nothing else
    #[arg(long)]
    pub(super) json: bool,
    /// Say nothing but errors
    #[arg(short, long)]
    pub(super) quiet: bool,
    #[command(flatten)]
    pub(super) view: ViewArgs,
}

fn bits(text: &str) -> Result<u8, String> {
    match text {
        "8" => Ok(8),
        "16" => Ok(16),
        _ => Err("a PNG has 8 or 16 bits a channel".into()),
    }
}

impl RenderArgs {
    /// Renders, writes, reports.
    pub fn run(self, context: &Context) -> Result<Outcome> {
        let mut options = self.options(context.started)?;
        options.validate = self.machine.validate;
        options.interrupted = context.interrupted.clone();
        options.progress = if self.quiet { None } else { progress::bar() };
        if let Some(frames) = &self.frames {
            return self.run_sequence(frames.clone(), options, context);
        }
        let mut outcome = Outcome::default();
        let may_finish = || stop_if_interrupted(&options);
        let report = self.picture(&options, context.started, &mut outcome.stdout, may_finish, || {
            self.machine.set_threads()?;
            match self.machine.choice() {
                None => self.on_reference(&options),
                Some(device) => self.on_device(&device, &options),
            }
        })?;
        if self.json {
            outcome.stdout = Outcome::json(&report)?.stdout;
        } else if report.image.path != "-" && !self.quiet {
            outcome.stdout = format!("{}\n", report.image.path).into_bytes();
        }
        if !self.quiet && !self.json {
            outcome.stderr = report.text() + "\n";
        }
        Ok(outcome)
    }

    /// Options of a picture that is begun at `started`, without a device.
    pub(super) fn options(&self, started: Instant) -> Result<Options> {
        let mut options = self.view.options()?;
        options.target_error = self.target_error;
        options.deadline = self.max_time.map(|seconds| deadline(started, seconds)).transpose()?;
        Ok(options)
    }

    /// Finds out where the picture goes, has it drawn, writes it unless it may not be finished, reports.
    pub(super) fn picture(
        &self,
        options: &Options,
        started: Instant,
        stdout: &mut Vec<u8>,
        may_finish: impl FnOnce() -> Result<()>,
        draw: impl FnOnce() -> Result<(Film, Report)>,
    ) -> Result<Report> {
        let target = Target::of(self)?;
        if target.format == Format::Hdr && options.background == Background::Transparent {
            return Err(Error::Usage("Radiance HDR has no alpha: write a transparent picture as .png or .exr".into()));
        }
        let (film, mut report) = draw()?;
        let start = Instant::now();
        let saved = target.save(&film, &notes(&report), stdout, may_finish)?;
        report.times_ms.save = milliseconds(start);
        report.times_ms.total = milliseconds(started);
        report.image.path = target.path.display().to_string();
        report.image.sha256 = saved.sha256;
        Ok(report)
    }

    /// The scene is read and its tree built while the device opens.
    fn on_device(&self, device: &DeviceChoice, options: &Options) -> Result<(Film, Report)> {
        std::thread::scope(|threads| {
            let renderer = threads.spawn(|| Renderer::new(device, options.validate));
            let ready = self.ready(options)?;
            let renderer = renderer.join().map_err(|_| Error::Device("opening it failed".into()))??;
            ready.draw(&renderer, options)
        })
    }

    /// On a device that is open.
    pub(super) fn on_renderer(&self, renderer: &Renderer, options: &Options) -> Result<(Film, Report)> {
        self.ready(options)?.draw(renderer, options)
    }

    /// By the reference renderer.
    pub(super) fn on_reference(&self, options: &Options) -> Result<(Film, Report)> {
        if options.target_error.is_some() || options.deadline.is_some() {
            return Err(Error::Usage(
                "the reference renders --spp samples, not until an error or a time is reached".into(),
            ));
        }
        let start = Instant::now();
        let scene = load_scene(&self.scene, &self.view.read.options())?;
        options.check_triangles(&scene)?;
        // Not prepared for any device: every triangle as it is.
        let soup = Soup::of(&scene)?;
        let view = options.view(&scene, &soup)?;
        let load = milliseconds(start);
        let start = Instant::now();
        let progress = options.progress.as_deref().map(|progress| progress as reference::Progress);
        let film = reference::render(&scene, &soup, &view, &options.interrupted, progress)?;
        let report = Report {
            image: report::Image { width: view.width, height: view.height, ..Default::default() },
            device: report::Device { name: "reference".into(), kind: "cpu".into(), ..Default::default() },
            scene: describe(&scene, &soup, &view),
            times_ms: report::Times { load, render: milliseconds(start), ..Default::default() },
            ..Default::default()
        };
        Ok((film, report))
    }

    /// Reads the scene and builds its tree.
    fn ready(&self, options: &Options) -> Result<Ready> {
        let start = Instant::now();
        let scene = load_scene(&self.scene, &self.view.read.options())?;
        stop_if_interrupted(options)?;
        let prepared = Prepared::new(&scene, options)?;
        let load = milliseconds(start);
        let start = Instant::now();
        let tree = prepared.tree(options);
        let bvh = milliseconds(start);
        stop_if_interrupted(options)?;
        Ok(Ready { scene, prepared, tree, load, bvh })
    }
}

/// What can be done of a picture without a device, and the milliseconds it took.
struct Ready {
    scene: Scene,
    prepared: Prepared,
    tree: Tree,
    load: f64,
    bvh: f64,
}

impl Ready {
    fn draw(&self, renderer: &Renderer, options: &Options) -> Result<(Film, Report)> {
        let (film, mut report) = renderer.render_with_tree(&self.scene, &self.prepared, options, &self.tree)?;
        (report.times_ms.load, report.times_ms.bvh) = (self.load, self.bvh);
        Ok((film, report))
    }
}

/// So many seconds after the start.
fn deadline(start: Instant, seconds: f64) -> Result<Instant> {
    let after = Duration::try_from_secs_f64(seconds).ok().and_then(|after| start.checked_add(after));
    after.ok_or_else(|| Error::Usage(format!("--max-time {seconds}: must be a number of seconds from 0")))
}

/// What the file says of a picture that was made until an error or a time was reached.
pub(super) fn notes(report: &Report) -> Vec<(&'static str, String)> {
    let Some(reached) = report.convergence else { return Vec::new() };
    vec![
        ("Software", format!("glimt {}", env!("CARGO_PKG_VERSION"))),
        ("glimt:samples", reached.samples.to_string()),
        ("glimt:rmse", format!("{:.6e}", reached.error)),
        ("glimt:seconds", format!("{:.3}", reached.seconds)),
        ("glimt:stopped-by", reached.reached.into()),
        ("glimt:device", format!("{} ({})", report.device.name, report.device.driver)),
    ]
}

/// Where the picture goes.
pub(super) struct Target {
    pub path: PathBuf,
    pub format: Format,
    is_stdout: bool,
}

impl Target {
    /// The target of a command line; what could be known to fail later fails now.
    fn of(args: &RenderArgs) -> Result<Self> {
        let is_stdout = args.output.as_deref() == Some(Path::new("-"));
        if is_stdout && args.json {
            return Err(Error::Usage("--json and -o - both want standard output: write the picture to a file".into()));
        }
        if is_stdout {
            let format = if args.bits == 8 { Format::Png8 } else { Format::Png16 };
            return Ok(Self { path: "-".into(), format, is_stdout });
        }
        let path = args.output.clone().unwrap_or_else(|| {
            let name = if args.scene == "-" { "stdin".as_ref() } else { Path::new(&args.scene) };
            let mut file = name.file_stem().unwrap_or("picture".as_ref()).to_owned();
            file.push(".png");
            PathBuf::from(file)
        });
        Self::in_file(path, args.bits)
    }

    /// A file that can be written.
    pub fn in_file(path: PathBuf, bits: u8) -> Result<Self> {
        let format = Format::of(&path, bits)?;
        glimt::film::check_writable(&path)?;
        Ok(Self { path, format, is_stdout: false })
    }

    pub fn save(
        &self,
        film: &Film,
        notes: &[(&str, String)],
        stdout: &mut Vec<u8>,
        may_finish: impl FnOnce() -> Result<()>,
    ) -> Result<Saved> {
        if self.is_stdout {
            return film.encode(stdout, self.format, notes, &self.path);
        }
        film.save_with_notes(&self.path, self.format, notes, may_finish)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Only {
        #[command(flatten)]
        render: RenderArgs,
    }

    fn target(flags: &str) -> Result<Target> {
        let only = Only::try_parse_from(std::iter::once("x").chain(flags.split_whitespace()));
        Target::of(&only.map_err(|error| Error::Usage(error.to_string()))?.render)
    }

    #[test]
    fn the_picture_is_named_after_the_scene() {
        assert_eq!(target("").unwrap().path, Path::new("table.png"));
        assert_eq!(target("some/where/model.glb").unwrap().path, Path::new("model.png"));
        assert_eq!(target("chair.v2.glb").unwrap().path, Path::new("chair.v2.png"));
        assert_eq!(target("-").unwrap().path, Path::new("stdin.png"));
    }

    #[test]
    fn the_extension_is_the_format() {
        assert_eq!(target("-o a.PNG").unwrap().format, Format::Png8);
        assert_eq!(target("-o a.png --bits 16").unwrap().format, Format::Png16);
        assert_eq!(target("-o a.exr").unwrap().format, Format::Exr);
        assert_eq!(target("-o a.hdr").unwrap().format, Format::Hdr);
        assert!(target("-o -").unwrap().is_stdout);
        for flags in ["-o a.jpg", "-o a", "-o a.exr --bits 16", "--bits 12", "-o - --json"] {
            assert_eq!(target(flags).err().map(|error| error.exit_code()), Some(2), "{flags}");
        }
        assert_eq!(target("-o no/such/folder/a.png").err().map(|error| error.exit_code()), Some(4));
    }
}
