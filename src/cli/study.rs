//! `glimt study`.

use super::machine::MachineArgs;
use super::values::{BvhChoice, FilterChoice, SamplerChoice};
use super::view::ViewArgs;
use super::{command_line, load_scene, progress, Context, Outcome};
use clap::{Args, ValueEnum, ValueHint};
use glimt::film::{self, Film, Format};
use glimt::render::{describe_device, Renderer};
use glimt::study::{run, Knob, Plan, Reference, Setting};
use glimt::vulkan::DeviceChoice;
use glimt::{Error, Result};
use std::path::{Path, PathBuf};

/// Flags of `glimt study`.
#[derive(Args)]
pub struct StudyArgs {
    /// A .gltf or .glb file, - for standard input, or a built-in scene
    #[arg(value_hint = ValueHint::FilePath, default_value = "table")]
    scene: String,
    /// What is varied: spp, sampler, max-depth, bvh or filter, and the values; the first knob is drawn along the axis, each setting of the others is a
    /// series of its own
    #[arg(long = "knob", value_name = "NAME=V1,V2,…", required = true, value_parser = knob)]
    knobs: Vec<Knob>,
    /// What pictures are compared with: a number of samples, or a picture (EXR for full precision) [default: rendered with 16 times the most samples, at least 1024]
    #[arg(long, value_name = "SPP|FILE")]
    reference: Option<String>,
    /// Pictures of each setting, each with a seed of its own
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    repeats: u32,
    /// Say which setting reaches this RMSE in the least time
    #[arg(long, value_name = "RMSE")]
    target_rmse: Option<f64>,
    /// Folder for study.csv, study.json and study.html
    #[arg(short, long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    output: Option<PathBuf>,
    /// Print one JSON object on standard output, nothing else
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    machine: MachineArgs,
    #[command(flatten)]
    view: ViewArgs,
}

/// `NAME=V1,V2,…`.
fn knob(text: &str) -> Result<Knob, String> {
    let (name, values) = text.split_once('=').ok_or("give a name and values, as in spp=1,4,16")?;
    let number = |value: &str, least: u32| {
        let number = value.parse().map_err(|_| format!("{name}: '{value}' is no whole number"))?;
        if number < least {
            Err(format!("{name}: {value} is below {least}"))
        } else {
            Ok(number)
        }
    };
    let setting = |value: &str| -> Result<Setting, String> {
        Ok(match name {
            "spp" => Setting::Samples(number(value, 1)?),
            "max-depth" => Setting::MaxDepth(number(value, 0)?),
            "sampler" => Setting::Sampler(choice::<SamplerChoice>(name, value)?.into()),
            "bvh" => Setting::Bvh(choice::<BvhChoice>(name, value)?.into()),
            "filter" => Setting::Filter(choice::<FilterChoice>(name, value)?.into()),
            _ => return Err(format!("no knob '{name}'; there is spp, sampler, max-depth, bvh, filter")),
        })
    };
    let name =
        ["spp", "sampler", "max-depth", "bvh", "filter"].into_iter().find(|own| *own == name).unwrap_or_default();
    Ok(Knob { settings: values.split(',').map(|value| setting(value.trim())).collect::<Result<_, _>>()?, name })
}

fn choice<T: ValueEnum>(name: &str, value: &str) -> Result<T, String> {
    T::from_str(value, true).map_err(|_| {
        let names = T::value_variants().iter().filter_map(|variant| variant.to_possible_value());
        let names: Vec<String> = names.map(|value| value.get_name().to_owned()).collect();
        format!("{name}: no '{value}'; there is {}", names.join(", "))
    })
}

/// Widths of pictures on the page.
const NARROWEST: u32 = 240;
const WIDEST: u32 = 560;

impl StudyArgs {
    /// Studies, writes, prints.
    pub fn run(self, context: &Context) -> Result<Outcome> {
        let mut options = self.view.options()?;
        options.validate = self.machine.validate;
        options.interrupted = context.interrupted.clone();
        self.machine.set_threads()?;
        if self.target_rmse.is_some_and(|target| target.is_nan() || target <= 0.0) {
            return Err(Error::Usage("--target-rmse must be above 0".into()));
        }
        for (index, knob) in self.knobs.iter().enumerate() {
            if self.knobs[..index].iter().any(|other| other.name == knob.name) {
                return Err(Error::Usage(format!("--knob {} is given twice", knob.name)));
            }
        }
        let reference = match &self.reference {
            None => Reference::Rendered,
            Some(text) => match text.parse() {
                Ok(samples) => Reference::Samples(samples),
                Err(_) => Reference::Given(film::read(Path::new(text))?),
            },
        };
        if let Reference::Given(film) = &reference {
            if (film.width, film.height) != options.size {
                let (width, height) = options.size;
                return Err(Error::Usage(format!(
                    "the reference is {}x{} pixels, the study {width}x{height}: give --size {0}x{1}",
                    film.width, film.height
                )));
            }
        }
        if let Some(folder) = &self.output {
            std::fs::create_dir_all(folder).map_err(|error| Error::write(folder, error))?;
            film::check_writable(&folder.join("study.html"))?;
        }
        let scene = load_scene(&self.scene, &self.view.read.options())?;
        let device = self.machine.device.clone().map_or(DeviceChoice::Best, DeviceChoice::Named);
        let renderer = Renderer::new(&device, options.validate)?;
        let plan = Plan { knobs: self.knobs.clone(), reference, repeats: self.repeats, target_rmse: self.target_rmse };
        let bar = progress::bar();
        let mut on_step = |done: usize, all: usize| {
            if let Some(bar) = &bar {
                bar(done as u64, all as u64);
            }
        };
        let mut outcome = run(&renderer, &scene, &options, &plan, &mut on_step)?;
        outcome.study.device = describe_device(renderer.device());
        outcome.study.command = command_line();
        if let Some(folder) = &self.output {
            let mut pictures = Vec::new();
            for own in &outcome.pictures {
                let map = film::heat_map(&outcome.references[own.reference], &own.film)?;
                pictures.push((own.name.clone(), png(&own.film)?, png(&map)?));
            }
            let references = outcome.references.iter().map(png).collect::<Result<Vec<_>>>()?;
            let width = options.size.0.clamp(NARROWEST, WIDEST);
            let json = serde_json::to_vec_pretty(&outcome.study).map_err(|error| Error::write(folder, error))?;
            film::write_whole(&folder.join("study.csv"), outcome.study.csv().as_bytes())?;
            film::write_whole(&folder.join("study.json"), &json)?;
            let html = outcome.study.html(&pictures, &references, width);
            film::write_whole(&folder.join("study.html"), html.as_bytes())?;
        }
        if self.json {
            return Outcome::json(&outcome.study);
        }
        Ok(Outcome::text(outcome.study.text()))
    }
}

/// A picture as a PNG file.
fn png(film: &Film) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    film.encode(&mut bytes, Format::Png8, &[], Path::new("study.html"))?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glimt::scene::{Filter, Sampler};

    #[test]
    fn knobs_are_names_and_values() {
        assert_eq!(knob("spp=1,4").unwrap().settings, [Setting::Samples(1), Setting::Samples(4)]);
        let filters = knob("filter=box, mitchell").unwrap();
        assert_eq!(filters.settings, [Setting::Filter(Filter::Box), Setting::Filter(Filter::Mitchell)]);
        assert_eq!(knob("sampler=independent").unwrap().settings, [Setting::Sampler(Sampler::Independent)]);
        for wrong in ["spp", "spp=", "spp=0", "spp=x", "speed=1", "sampler=random", "bvh=1", "max-depth=-1"] {
            assert!(knob(wrong).is_err(), "{wrong}");
        }
    }
}
