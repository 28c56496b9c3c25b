//! The command line: one file a subcommand, each turning flags into options and results into text.

mod batch;
mod bench;
mod completions;
mod devices;
mod diff;
mod explain;
mod info;
mod job;
mod lines;
mod machine;
mod progress;
mod reading;
mod render;
mod sequence;
mod stress;
mod study;
mod values;
mod view;

use clap::{Parser, Subcommand};
use glimt::scene::gltf::{Asset, ReadOptions};
use glimt::{scene, Error, Options, Result, Scene};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::time::Instant;

/// What every command gets.
pub struct Context {
    /// Start of the process.
    pub started: Instant,
    /// Set by Ctrl-C.
    pub interrupted: Arc<AtomicBool>,
    /// Prints results at once, for commands that go on after them.
    pub print: fn(&[u8]) -> std::io::Result<()>,
}

impl Context {
    /// Prints results at once; false when nobody reads them any more.
    fn tell(&self, results: &[u8]) -> Result<bool> {
        match (self.print)(results) {
            Ok(()) => Ok(true),
            Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(false),
            Err(error) => Err(Error::write(Path::new("standard output"), error)),
        }
    }
}

/// What a command leaves to be printed.
#[derive(Default)]
pub struct Outcome {
    /// Results.
    pub stdout: Vec<u8>,
    /// What is said about them.
    pub stderr: String,
    /// Exit code: 0, or 1 when a check said no.
    pub code: u8,
}

impl Outcome {
    fn text(text: impl Into<String>) -> Self {
        Self { stdout: text.into().into_bytes(), ..Self::default() }
    }

    fn json(value: &impl serde::Serialize) -> Result<Self> {
        let mut text = serde_json::to_string(value).map_err(|error| Error::Usage(format!("JSON: {error}")))?;
        text.push('\n');
        Ok(Self::text(text))
    }
}

const EXAMPLES: &str = "\
Examples:
  glimt render                                      the built-in table → table.png
  glimt render model.glb -o picture.png             a glTF file, its own camera and lights
  glimt render model.glb --size 512x512 --spp 16 --background transparent
  glimt render cornell --json | jq .times_ms        one JSON object on standard output
  cat model.glb | glimt render - -o - > out.png     from a pipe to a pipe
  glimt render model.glb --frames 0..48 --fps 24 -o 'frame_{:04}.png'    a sequence of its animation
  glimt batch < jobs.jsonl                          many pictures in one process: a JSON job a line
  glimt explain model.glb                           what is computed, what is left out, and why
  glimt bench model.glb --sets primary,shadow        how fast rays of a view are traced
  glimt stress --quick                              which extreme cases hold on this device
  glimt study table --size 160x120 --knob spp=4,16,64 --knob sampler=sobol,independent -o study
  glimt diff a.png b.png --max-rmse 0.004           exit code 1 when they differ more

Exit codes: 0 done · 1 a check said no · 2 bad usage or input · 3 no usable device, or it failed · 4 output not written ·
130 interrupted";

/// Headless Vulkan ray tracer for glTF scenes: the same picture on every device, GPU or none.
#[derive(Parser)]
#[command(name = "glimt", version, after_help = EXAMPLES, max_term_width = 120)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Render a scene to a PNG, OpenEXR or Radiance HDR file
    Render(render::RenderArgs),
    /// Render many pictures in one process: a JSON job a line on standard input, a JSON answer a line on standard output
    Batch(batch::BatchArgs),
    /// Say what is in a scene, what will be used, approximated and ignored
    Info(info::InfoArgs),
    /// Say what the renderer does for a scene: passes, buffers, features, and what it leaves out and why
    Explain(explain::ExplainArgs),
    /// List the Vulkan devices
    Devices(devices::DevicesArgs),
    /// Measure how fast rays are traced and trees are built
    Bench(bench::BenchArgs),
    /// Run extreme and stiff cases and say which hold: leaks, self-hits, needles, far away, bad transforms, …
    Stress(stress::StressArgs),
    /// Report error against run time: turn knobs, compare with a reference, fit slopes
    Study(study::StudyArgs),
    /// Compare two pictures: RMSE, PSNR, maximum difference, SSIM, FLIP
    Diff(diff::DiffArgs),
    /// Print a completion script for a shell
    Completions(completions::CompletionsArgs),
}

impl Cli {
    /// The command writes a file, so that Ctrl-C must let it clean up.
    pub fn writes_files(&self) -> bool {
        matches!(
            self.command,
            Command::Render(_)
                | Command::Batch(_)
                | Command::Diff(_)
                | Command::Bench(_)
                | Command::Stress(_)
                | Command::Study(_)
        )
    }

    /// Runs the command.
    ///
    /// # Errors
    /// Whatever the command meets.
    pub fn run(self, context: &Context) -> Result<Outcome> {
        match self.command {
            Command::Render(args) => args.run(context),
            Command::Batch(args) => args.run(context),
            Command::Info(args) => args.run(),
            Command::Explain(args) => args.run(),
            Command::Devices(args) => args.run(),
            Command::Bench(args) => args.run(context),
            Command::Stress(args) => args.run(context),
            Command::Study(args) => args.run(context),
            Command::Diff(args) => args.run(context),
            Command::Completions(args) => args.run(),
        }
    }
}

/// What a scene argument names.
enum Source {
    BuiltIn(Box<Scene>),
    File(Box<Asset>),
}

/// Opens a scene by the name of a built-in one, by path, or `-` for standard input. A file wins over a built-in of its name.
fn open_source(name: &str, options: &ReadOptions) -> Result<Source> {
    let is_built_in = scene::BUILT_IN.iter().any(|(own, _)| *own == name);
    if is_built_in && (Path::new(name).is_dir() || !Path::new(name).exists()) {
        let ReadOptions { scene: choice, animation, variant, at, .. } = options;
        for (kind, choice) in [("scene", choice), ("animation", animation), ("variant", variant)] {
            if let Some(choice) = choice {
                return Err(Error::Usage(format!("the built-in scene '{name}' has no {kind} '{choice}' in it")));
            }
        }
        if at.is_some() {
            return Err(Error::Usage(format!(
                "the built-in scene '{name}' has no animation: it is the same at all times"
            )));
        }
        return scene::built_in(name).map(|scene| Source::BuiltIn(Box::new(scene)));
    }
    let asset = scene::gltf::open(Path::new(name), options).map_err(|error| match error {
        Error::Read { path, source } if source.kind() == std::io::ErrorKind::NotFound => Error::Usage(format!(
            "{}: no such file, and no built-in scene of that name ({})",
            path.display(),
            scene::BUILT_IN.map(|(own, _)| own).join(", ")
        )),
        error => error,
    })?;
    Ok(Source::File(Box::new(asset)))
}

/// The scene that a scene argument names.
fn load_scene(name: &str, options: &ReadOptions) -> Result<Scene> {
    match open_source(name, options)? {
        Source::BuiltIn(scene) => Ok(*scene),
        Source::File(asset) => asset.into_scene(),
    }
}

fn stop_if_interrupted(options: &Options) -> Result<()> {
    match options.interrupted.load(Ordering::Relaxed) {
        true => Err(Error::Interrupted),
        false => Ok(()),
    }
}

/// What is wrong with arguments and the tip, if there is one, without the usage.
pub fn one_line(error: &clap::Error) -> String {
    let text = error.to_string();
    let lines =
        text.lines().map(str::trim).take_while(|line| !line.starts_with("Usage") && !line.starts_with("For more"));
    let said: Vec<&str> =
        lines.filter(|line| !line.is_empty()).map(|line| line.trim_start_matches("error: ")).collect();
    said.join("; ")
}

/// What was typed, for pages that say how they were made.
fn command_line() -> String {
    let arguments = std::env::args().skip(1);
    std::iter::once("glimt".into()).chain(arguments).collect::<Vec<_>>().join(" ")
}

fn milliseconds(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent_and_every_flag_is_documented() {
        let command = Cli::command();
        command.clone().debug_assert();
        for sub in command.get_subcommands() {
            assert!(sub.get_about().is_some(), "{}", sub.get_name());
            for argument in sub.get_arguments() {
                assert!(argument.get_help().is_some(), "{} {}", sub.get_name(), argument.get_id());
            }
        }
    }
}
