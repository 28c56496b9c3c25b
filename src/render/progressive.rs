//! Passes of more and more samples, until an error or a time is reached.
//!
//! Two halves of the samples come from two sequences that know nothing of each other. Half their difference is then an unbiased
//! estimate of the error of their mean, whatever the sampler: Var((A + B)/2) = E[(A − B)²]/4.

use super::frame::Frame;
use super::Options;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::report::Convergence;
use crate::scene::{Sampler, View, MAX_SAMPLES};
use rayon::prelude::*;
use std::time::Instant;

/// Samples of each half in the first pass.
const FIRST: u32 = 2;
/// Samples that a frame for passes is planned for: a wave holds them all for as many pixels as fit.
pub(super) const PLANNED: u32 = 16;

/// Sum of a half's samples.
struct Half {
    seed: u32,
    sum: Vec<[f64; 4]>,
}

impl Half {
    fn add(&mut self, film: &Film, samples: u32) {
        let samples = f64::from(samples);
        self.sum.par_iter_mut().zip(&film.pixels).for_each(|(sum, pixel)| {
            (0..4).for_each(|channel| sum[channel] += f64::from(pixel[channel]) * samples);
        });
    }
}

/// Root of the mean squared error of the halves' mean, in linear RGB, estimated from how far they differ. `samples` each.
fn estimated_error(halves: &[Half; 2], samples: u32) -> f64 {
    let squares = |(a, b): (&[f64; 4], &[f64; 4])| (0..3).map(|channel| (a[channel] - b[channel]).powi(2)).sum::<f64>();
    // Chunks are summed in order, so that the figure is the same on any number of threads.
    let chunks: Vec<f64> = (halves[0].sum.par_chunks(4096).zip(halves[1].sum.par_chunks(4096)))
        .map(|(a, b)| a.iter().zip(b).map(squares).sum())
        .collect();
    let mean = chunks.iter().sum::<f64>() / (3 * halves[0].sum.len()) as f64;
    mean.sqrt() / 2.0 / f64::from(samples)
}

/// Whether a picture is made in passes.
pub(super) fn is_wanted(options: &Options) -> bool {
    options.target_error.is_some() || options.deadline.is_some()
}

/// Checks options that a picture in passes cannot have.
pub(super) fn check(options: &Options) -> Result<()> {
    if is_wanted(options) && options.sampler == Sampler::Stratified {
        return Err(Error::Usage(
            "stratified samples must be counted before they are placed: use --sampler sobol or independent until an error or \
             a time is reached"
                .into(),
        ));
    }
    if options.target_error.is_some_and(|error| error.is_nan() || error <= 0.0) {
        return Err(Error::Usage("the error to be reached must be above 0".into()));
    }
    Ok(())
}

/// Runs passes until the error or the time of the options is reached. The first pass is always run.
pub(super) fn run(frame: &mut Frame, view: &View, options: &Options) -> Result<(Film, Convergence)> {
    let start = Instant::now();
    let pixels = view.width as usize * view.height as usize;
    let half = |seed| Half { seed, sum: vec![[0.0; 4]; pixels] };
    let mut halves = [half(view.seed.wrapping_mul(2)), half(view.seed.wrapping_mul(2).wrapping_add(1))];
    // The first pass also compiles: the quickest one tells what a sample takes.
    let mut a_sample = f64::INFINITY;
    let (mut samples, mut next) = (0_u32, FIRST);
    loop {
        let pass = Instant::now();
        let mut has_alpha = false;
        for half in &mut halves {
            let film = frame.run(samples..samples + next, half.seed, options)?;
            has_alpha = film.has_alpha;
            half.add(&film, next);
        }
        samples += next;
        let error = estimated_error(&halves, samples);
        a_sample = a_sample.min(pass.elapsed().as_secs_f64() / f64::from(next));
        next = samples;
        let mut stop = None;
        if let Some(deadline) = options.deadline {
            let left = deadline.saturating_duration_since(Instant::now()).as_secs_f64();
            next = next.min((0.95 * left / a_sample) as u32);
            // Too few to change anything.
            if next == 0 || next < samples / 16 {
                stop = Some("time");
            }
        }
        if 2 * samples >= MAX_SAMPLES / 2 {
            stop = Some("samples");
        }
        if options.target_error.is_some_and(|target| error <= target) {
            stop = Some("error");
        }
        if let Some(reached) = stop {
            let mean = |(a, b): (&[f64; 4], &[f64; 4])| {
                std::array::from_fn(|channel| ((a[channel] + b[channel]) / f64::from(2 * samples)) as f32)
            };
            let pixels = halves[0].sum.iter().zip(&halves[1].sum).map(mean).collect();
            let film = Film { width: view.width, height: view.height, pixels, has_alpha };
            let seconds = start.elapsed().as_secs_f64();
            return Ok((film, Convergence { samples: 2 * samples, error, seconds, reached }));
        }
    }
}
