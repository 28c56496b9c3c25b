//! `glimt render --frames`: an animation as a sequence of pictures. The file is read and the device opened once.

use super::render::{RenderArgs, Target};
use super::{milliseconds, open_source, stop_if_interrupted, Context, Outcome, Source};
use glimt::film::Format;
use glimt::render::{Prepared, Renderer, Tree};
use glimt::scene::gltf::Asset;
use glimt::scene::{Background, CameraChoice};
use glimt::{report, Error, Options, Report, Result};
use std::fmt::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// Reads `A..B`.
pub fn frames(text: &str) -> Result<Range<u32>, String> {
    let ends = text.split_once("..").and_then(|(first, end)| Some(first.parse().ok()?..end.parse().ok()?));
    let wrong = || format!("'{text}': must be A..B with whole numbers from 0, A less than B; B itself is left out");
    ends.filter(|range| !range.is_empty()).ok_or_else(wrong)
}

/// Reads frames a second.
pub fn fps(text: &str) -> Result<f64, String> {
    let fps = text.parse().ok().filter(|fps: &f64| *fps > 0.0 && fps.is_finite());
    fps.ok_or_else(|| format!("'{text}': must be a number of frames a second above 0"))
}

/// A file name with a place for the frame's number.
#[derive(Debug, PartialEq)]
struct Pattern {
    folder: PathBuf,
    before: String,
    /// Digits at least.
    digits: usize,
    after: String,
}

impl Pattern {
    /// A pattern of a path: its file name has `{}`, or `{:0N}` for at least N digits, once.
    fn of(path: &Path) -> Result<Self> {
        let wrong = || {
            let path = path.display();
            Error::Usage(format!("{path}: with --frames the file name must have {{}} or {{:04}} once, for the number"))
        };
        let name = path.file_name().and_then(|name| name.to_str()).ok_or_else(wrong)?;
        let (before, rest) = name.split_once('{').ok_or_else(wrong)?;
        let (format, after) = rest.split_once('}').ok_or_else(wrong)?;
        let digits = match format.strip_prefix(":0") {
            None if format.is_empty() => Some(1),
            None => None,
            Some(digits) => digits.parse().ok().filter(|digits| (1..=20).contains(digits)),
        };
        let digits = digits.filter(|_| !before.contains('}') && !after.contains(['{', '}'])).ok_or_else(wrong)?;
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        Ok(Self { folder, before: before.into(), digits, after: after.into() })
    }

    fn path(&self, frame: u32) -> PathBuf {
        self.folder.join(format!("{}{frame:0digits$}{}", self.before, self.after, digits = self.digits))
    }
}

/// What is the same for all frames, and what one hands to the next.
struct Sequence<'a> {
    args: &'a RenderArgs,
    frames: Range<u32>,
    pattern: Pattern,
    options: Options,
    tree: Option<Tree>,
}

impl RenderArgs {
    /// Renders and writes a picture for each frame; the picture of frame F is that of `--at F/fps`.
    pub(super) fn run_sequence(&self, frames: Range<u32>, options: Options, context: &Context) -> Result<Outcome> {
        let output = self.output.clone().unwrap_or_else(|| {
            let name = Path::new(if self.scene == "-" { "stdin" } else { &self.scene });
            PathBuf::from(format!("{}_{{:04}}.png", name.file_stem().unwrap_or_default().to_string_lossy()))
        });
        let pattern = Pattern::of(&output)?;
        let format = Target::in_file(pattern.path(frames.start), self.bits)?.format;
        if format == Format::Hdr && options.background == Background::Transparent {
            return Err(Error::Usage("Radiance HDR has no alpha: write transparent pictures as .png or .exr".into()));
        }
        let device = self
            .machine
            .choice()
            .ok_or_else(|| Error::Usage("the reference renders one picture, not --frames".into()))?;
        self.machine.set_threads()?;
        let (first, validate) = (self.time(frames.start), options.validate);
        let mut sequence = Sequence { args: self, frames: frames.clone(), pattern, options, tree: None };
        std::thread::scope(|threads| {
            let renderer = threads.spawn(|| Renderer::new(&device, validate));
            let mut read = self.view.read.options();
            read.at = Some(first);
            let asset = match open_source(&self.scene, &read)? {
                Source::File(asset) => asset,
                Source::BuiltIn(scene) => return Err(Error::Usage(format!("'{}' has no animation", scene.name))),
            };
            let renderer = renderer.join().map_err(|_| Error::Device("opening it failed".into()))??;
            let (mut outcome, mut started) = (Outcome::default(), context.started);
            let mut told = Vec::new();
            for frame in frames {
                let report = sequence.frame(&renderer, &asset, frame, started)?;
                started = Instant::now();
                match self.json {
                    true => drop(context.tell(&Outcome::json(&report)?.stdout)?),
                    false => self.tell(&report, &mut told, &mut outcome),
                }
            }
            Ok(outcome)
        })
    }

    fn time(&self, frame: u32) -> f64 {
        f64::from(frame) / self.fps
    }

    /// Adds a frame's report to what will be printed.
    fn tell(&self, report: &Report, told: &mut Vec<String>, outcome: &mut Outcome) {
        if !self.quiet {
            outcome.stdout.extend(format!("{}\n", report.image.path).into_bytes());
            let frame = report.frame.unwrap_or_default();
            let tree = match report.bvh.update {
                Some(report::TreeUpdate { action, built_cost: Some(built), refitted_cost: Some(refitted) }) => {
                    format!("tree {action} (cost {built:.1} as built, {refitted:.1} refitted)")
                }
                Some(update) => format!("tree {}", update.action),
                None => "tree built".into(),
            };
            let (number, seconds, total) = (frame.number, frame.seconds, report.times_ms.total);
            let _ = writeln!(outcome.stderr, "frame {number} at {seconds:.3} s: {tree}; {total:.0} ms");
            for warning in &report.scene.warnings {
                if !told.contains(warning) {
                    let _ = writeln!(outcome.stderr, "warning: {warning}");
                    told.push(warning.clone());
                }
            }
        }
    }
}

impl Sequence<'_> {
    /// Renders and writes a frame.
    fn frame(&mut self, renderer: &Renderer, asset: &Asset, frame: u32, started: Instant) -> Result<Report> {
        stop_if_interrupted(&self.options)?;
        let options = Options { progress: self.progress(frame), ..self.options.clone() };
        let start = Instant::now();
        let seconds = self.args.time(frame);
        let scene = asset.scene(seconds)?;
        let prepared = Prepared::new(&scene, &options)?;
        if options.camera.frames(&scene) {
            // From now on it stands still.
            self.options.camera = CameraChoice::Fixed(prepared.view.camera);
        }
        let load = milliseconds(start);
        let start = Instant::now();
        let tree = match &self.tree {
            Some(last) => prepared.next_tree(&options, last),
            None => prepared.tree(&options),
        };
        let bvh = milliseconds(start);
        let (film, mut report) = renderer.render_with_tree(&scene, &prepared, &options, &tree)?;
        self.tree = Some(tree);
        let start = Instant::now();
        let target = Target::in_file(self.pattern.path(frame), self.args.bits)?;
        let notes = super::render::notes(&report);
        let saved = target.save(&film, &notes, &mut Vec::new(), || stop_if_interrupted(&options))?;
        report.image.path = target.path.display().to_string();
        report.image.sha256 = saved.sha256;
        report.frame = Some(report::Frame { number: frame, seconds });
        (report.times_ms.load, report.times_ms.bvh) = (load, bvh);
        (report.times_ms.save, report.times_ms.total) = (milliseconds(start), milliseconds(started));
        Ok(report)
    }

    /// Progress of a frame as progress of all.
    fn progress(&self, frame: u32) -> Option<glimt::render::Progress> {
        let whole = self.options.progress.clone()?;
        let (before, all) = (u64::from(frame - self.frames.start), self.frames.len() as u64);
        Some(Arc::new(move |done, samples| {
            whole((before * samples.max(1)).saturating_add(done), all.saturating_mul(samples.max(1)));
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_a_range_without_its_end() {
        assert_eq!(frames("0..48"), Ok(0..48));
        assert_eq!(frames("7..8"), Ok(7..8));
        for wrong in ["", "5", "..5", "5..", "5..5", "5..4", "-1..4", "0..=3", "0...3", "a..b", "0..99999999999"] {
            assert!(frames(wrong).is_err(), "{wrong}");
        }
        assert_eq!(fps("29.97"), Ok(29.97));
        for wrong in ["0", "-24", "inf", "NaN", "x"] {
            assert!(fps(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn the_pattern_has_one_place_for_the_number() {
        let path = |pattern: &str, frame| Pattern::of(Path::new(pattern)).map(|pattern| pattern.path(frame));
        assert_eq!(path("frame_{:04}.png", 12).ok().as_deref(), Some(Path::new("frame_0012.png")));
        assert_eq!(path("a/b{}/{}.exr", 12).ok().as_deref(), Some(Path::new("a/b{}/12.exr")));
        assert_eq!(path("{:02}.png", 1234).ok().as_deref(), Some(Path::new("1234.png")));
        for wrong in
            ["a.png", "{}{}.png", "{:4}.png", "{:0}.png", "{:0x}.png", "{.png", "}{}.png", "{{}}.png", "{}/a.png"]
        {
            assert!(path(wrong, 0).is_err(), "{wrong}");
        }
    }
}
