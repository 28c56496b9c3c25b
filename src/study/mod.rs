//! Error against run time: a scene, knobs that are turned, and for each setting how far the picture is from a reference and what it took.

use crate::bvh::Quality;
use crate::error::{Error, Result};
use crate::film::{self, Film};
use crate::render::{Options, Prepared, Renderer};
use crate::report::study::{Measured, Series, Study};
use crate::report::{log_log_slope, Spread};
use crate::scene::{Filter, Sampler, Scene, MAX_SAMPLES};
use std::fmt::{Display, Formatter};
use std::time::Instant;

/// One setting of one knob.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Setting {
    /// Samples a pixel.
    Samples(u32),
    /// Where samples lie.
    Sampler(Sampler),
    /// Reflections one after the other.
    MaxDepth(u32),
    /// How much work goes into the tree: changes time alone.
    Bvh(Quality),
    /// How samples are weighed.
    Filter(Filter),
}

impl Setting {
    fn apply(self, options: &mut Options) {
        match self {
            Self::Samples(samples) => options.samples = samples,
            Self::Sampler(sampler) => options.sampler = sampler,
            Self::MaxDepth(depth) => options.max_depth = depth,
            Self::Bvh(quality) => options.bvh = Some(quality),
            Self::Filter(filter) => options.filter = filter,
        }
    }

    /// The position on an axis, for a knob that is a number.
    fn number(self) -> Option<f64> {
        match self {
            Self::Samples(number) | Self::MaxDepth(number) => Some(number.into()),
            _ => None,
        }
    }
}

impl Display for Setting {
    fn fmt(&self, f: &mut Formatter) -> std::fmt::Result {
        match self {
            Self::Samples(number) | Self::MaxDepth(number) => write!(f, "{number}"),
            Self::Sampler(sampler) => f.write_str(&format!("{sampler:?}").to_lowercase()),
            Self::Bvh(quality) => f.write_str(quality.name()),
            Self::Filter(Filter::BlackmanHarris) => f.write_str("blackman-harris"),
            Self::Filter(filter) => f.write_str(&format!("{filter:?}").to_lowercase()),
        }
    }
}

/// A knob and the settings it is turned to.
#[derive(Clone, Debug, PartialEq)]
pub struct Knob {
    /// Its name: spp, sampler, max-depth, bvh, filter.
    pub name: &'static str,
    /// At least one; all of that name.
    pub settings: Vec<Setting>,
}

/// What pictures are compared with.
#[derive(Clone, Debug)]
pub enum Reference {
    /// Rendered with 16 times the most samples, at least 1024.
    Rendered,
    /// Rendered with so many samples.
    Samples(u32),
    /// A picture.
    Given(Film),
}

/// What is to be studied.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The first is drawn along the axis; each setting of the others is a series of its own.
    pub knobs: Vec<Knob>,
    /// What pictures are compared with.
    pub reference: Reference,
    /// Pictures of each setting, each with a seed of its own.
    pub repeats: u32,
    /// Error for which the cheapest setting is looked up.
    pub target_rmse: Option<f64>,
}

/// Seeds of the reference's two halves: no picture has them.
const REFERENCE_SEEDS: [u32; 2] = [0x9e37_79b9, 0x7f4a_7c15];
/// Samples of a reference that is rendered, as a multiple of the most that a picture has; and at least.
const REFERENCE_SAMPLES: (u32, u32) = (16, 1024);

/// A picture with what it is measured by.
pub struct Pictures {
    /// Series and setting.
    pub name: String,
    /// The picture of the first repeat.
    pub film: Film,
    /// What it is compared with: index into [`Outcome::references`].
    pub reference: usize,
}

/// What a study gives.
pub struct Outcome {
    /// The figures.
    pub study: Study,
    /// The references.
    pub references: Vec<Film>,
    /// One picture of each setting.
    pub pictures: Vec<Pictures>,
}

/// A reference with its own noise.
struct Known {
    /// What of the options changes the picture that is approached.
    filter: Filter,
    film: Film,
    samples: u32,
    noise: f64,
}

/// Renders all settings of all knobs and measures them. `on_step` is told the steps done and in all.
///
/// # Errors
/// `Usage` for knobs that make no sense; what rendering answers.
pub fn run(
    renderer: &Renderer,
    scene: &Scene,
    options: &Options,
    plan: &Plan,
    on_step: &mut dyn FnMut(usize, usize),
) -> Result<Outcome> {
    let (axis, others) = plan.knobs.split_first().ok_or_else(|| Error::Usage("a study needs a --knob".into()))?;
    let combinations = others.iter().fold(vec![Vec::new()], |combinations: Vec<Vec<Setting>>, knob| {
        let with = |before: &Vec<Setting>| {
            let before = before.clone();
            knob.settings.iter().map(move |setting| [before.clone(), vec![*setting]].concat())
        };
        combinations.iter().flat_map(with).collect()
    });
    let steps = combinations.len() * axis.settings.len() * plan.repeats as usize;
    let mut done = 0;
    let mut known: Vec<Known> = Vec::new();
    let mut outcome = Outcome { study: Study::default(), references: Vec::new(), pictures: Vec::new() };
    for combination in &combinations {
        let name = combination.iter().map(Setting::to_string).collect::<Vec<_>>().join(", ");
        let mut series = Series { name: name.clone(), ..Series::default() };
        for setting in &axis.settings {
            let mut own = options.clone();
            combination.iter().chain([setting]).for_each(|setting| setting.apply(&mut own));
            let reference = match known.iter().position(|known| known.filter == own.filter) {
                Some(index) => index,
                None => {
                    known.push(reference(renderer, scene, options, &own, plan)?);
                    known.len() - 1
                }
            };
            let (measured, film) = measure(renderer, scene, &own, plan, &known[reference], *setting, &mut || {
                done += 1;
                on_step(done, steps);
            })?;
            series.noise_of_reference = known[reference].noise;
            series.settings.push(measured);
            let setting = format!("{} {setting}", axis.name);
            let name = if name.is_empty() { setting } else { format!("{name}, {setting}") };
            outcome.pictures.push(Pictures { name, film, reference });
        }
        summarise(&mut series, plan.target_rmse);
        outcome.study.series.push(series);
    }
    outcome.study.scene = scene.name.clone();
    outcome.study.axis = axis.name.into();
    outcome.study.repeats = plan.repeats;
    outcome.study.target_rmse = plan.target_rmse;
    outcome.study.reference_samples = known.iter().map(|known| known.samples).max().unwrap_or(0);
    outcome.references = known.into_iter().map(|known| known.film).collect();
    Ok(outcome)
}

/// The picture that settings with these options approach, and how noisy it still is.
fn reference(renderer: &Renderer, scene: &Scene, base: &Options, own: &Options, plan: &Plan) -> Result<Known> {
    let most = |of: fn(&Setting) -> Option<u32>, least: u32| {
        plan.knobs.iter().flat_map(|knob| &knob.settings).filter_map(of).max().unwrap_or(0).max(least)
    };
    let samples = match &plan.reference {
        Reference::Given(film) => {
            return Ok(Known { filter: own.filter, film: film.clone(), samples: 0, noise: 0.0 });
        }
        Reference::Samples(samples) => *samples,
        Reference::Rendered => {
            let most = most(
                |setting| if let Setting::Samples(samples) = setting { Some(*samples) } else { None },
                base.samples,
            );
            most.saturating_mul(REFERENCE_SAMPLES.0).clamp(REFERENCE_SAMPLES.1, MAX_SAMPLES)
        }
    };
    let max_depth =
        most(|setting| if let Setting::MaxDepth(depth) = setting { Some(*depth) } else { None }, base.max_depth);
    let half = |seed| {
        let samples = (samples / 2).max(2);
        let options = Options {
            samples,
            seed,
            max_depth,
            filter: own.filter,
            sampler: Sampler::Sobol,
            progress: None,
            ..base.clone()
        };
        renderer.render(scene, &options).map(|(film, _)| film)
    };
    let (a, b) = (half(REFERENCE_SEEDS[0])?, half(REFERENCE_SEEDS[1])?);
    let noise = film::compare_linear(&a, &b)?.rmse / 2.0;
    let mean = |(a, b): (&[f32; 4], &[f32; 4])| std::array::from_fn(|channel| (a[channel] + b[channel]) / 2.0);
    let film = Film { pixels: a.pixels.iter().zip(&b.pixels).map(mean).collect(), ..a };
    Ok(Known { filter: own.filter, film, samples, noise })
}

/// Renders a setting several times.
fn measure(
    renderer: &Renderer,
    scene: &Scene,
    options: &Options,
    plan: &Plan,
    reference: &Known,
    setting: Setting,
    on_step: &mut dyn FnMut(),
) -> Result<(Measured, Film)> {
    let mut prepared = Prepared::new(scene, options)?;
    let mut first = None;
    let mut errors = Vec::new();
    let (mut wall, mut device, mut build) = (Vec::new(), Vec::new(), Vec::new());
    let mut rays = 0;
    // One more than counts, so that nothing is compiled in a measurement.
    for repeat in 0..=plan.repeats {
        options.go_on()?;
        let own = Options { seed: options.seed.wrapping_add(repeat), progress: None, ..options.clone() };
        prepared.view.seed = own.seed;
        let start = Instant::now();
        let tree = prepared.tree(&own);
        let build_ms = start.elapsed().as_secs_f64() * 1e3;
        let (film, report) = renderer.render_with_tree(scene, &prepared, &own, &tree)?;
        if repeat == 0 && plan.repeats > 0 {
            continue;
        }
        build.push(build_ms);
        wall.push(report.times_ms.upload + report.times_ms.render);
        device.push(report.passes.iter().map(|pass| pass.ms).sum());
        rays = report.rays.primary + report.rays.shadow + report.rays.reflection;
        errors.push((film::compare_linear(&reference.film, &film)?, film::compare(&reference.film, &film)?));
        first.get_or_insert(film);
        on_step();
    }
    let film = first.ok_or_else(|| Error::Usage("a study needs at least one repeat".into()))?;
    let count = errors.len() as f64;
    let mean = |of: &dyn Fn(&(film::LinearMetrics, film::Metrics)) -> f64| errors.iter().map(of).sum::<f64>() / count;
    let rmse = mean(&|(linear, _)| linear.rmse * linear.rmse).sqrt();
    let wall_ms = Spread::of(wall);
    let measured = Measured {
        setting: setting.to_string(),
        number: setting.number(),
        rmse,
        rmse_of_repeats: errors.iter().map(|(linear, _)| linear.rmse).collect(),
        rel_mse: mean(&|(linear, _)| linear.rel_mse),
        flip: mean(&|(_, shown)| shown.flip),
        max: errors.iter().map(|(linear, _)| linear.max).fold(0.0, f64::max),
        efficiency: 1.0 / (rmse * rmse * wall_ms.median / 1e3),
        wall_ms,
        device_ms: Spread::of(device),
        build_ms: Spread::of(build),
        rays,
        is_below_noise: rmse < 2.0 * reference.noise,
    };
    Ok((measured, film))
}

/// Slopes, and the cheapest setting that reaches the target.
fn summarise(series: &mut Series, target: Option<f64>) {
    // What is below the reference's own noise says nothing about the sampler.
    let trusted: Vec<&Measured> =
        series.settings.iter().filter(|measured| !measured.is_below_noise && measured.rmse > 0.0).collect();
    let over_time: Vec<(f64, f64)> =
        trusted.iter().map(|measured| (measured.device_ms.median, measured.rmse)).collect();
    let over_number: Vec<(f64, f64)> = trusted.iter().filter_map(|m| m.number.map(|number| (number, m.rmse))).collect();
    series.slope_over_time = log_log_slope(&over_time);
    series.slope_over_axis = log_log_slope(&over_number);
    let reached = |target: f64| {
        let mut cheap: Vec<&Measured> = series.settings.iter().filter(|measured| measured.rmse <= target).collect();
        cheap.sort_by(|a, b| a.wall_ms.median.total_cmp(&b.wall_ms.median));
        cheap.first().map(|measured| measured.setting.clone())
    };
    series.cheapest_for_target = target.and_then(reached);
}
