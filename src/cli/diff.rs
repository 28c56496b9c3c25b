//! `glimt diff`.

use super::{Context, Outcome};
use clap::{Args, ValueHint};
use glimt::film::{self, Format, Metrics};
use glimt::{Error, Result};
use std::path::PathBuf;
use std::sync::atomic::Ordering;

/// Flags of `glimt diff`.
#[derive(Args)]
pub struct DiffArgs {
    /// The reference: PNG, WebP, OpenEXR or Radiance HDR
    #[arg(value_hint = ValueHint::FilePath)]
    reference: PathBuf,
    /// The picture to judge, of the same size
    #[arg(value_hint = ValueHint::FilePath)]
    picture: PathBuf,
    /// Fail above this root mean squared difference (of 1)
    #[arg(long, value_name = "X")]
    max_rmse: Option<f64>,
    /// Fail above this difference of any channel (of 1)
    #[arg(long, value_name = "X")]
    max_difference: Option<f64>,
    /// Fail above this share of pixels that differ by more than 1/255
    #[arg(long, value_name = "X")]
    max_share: Option<f64>,
    /// Fail above this mean FLIP error
    #[arg(long, value_name = "X")]
    max_flip: Option<f64>,
    /// Fail below this peak signal-to-noise ratio in dB
    #[arg(long, value_name = "X")]
    min_psnr: Option<f64>,
    /// Fail below this structural similarity
    #[arg(long, value_name = "X")]
    min_ssim: Option<f64>,
    /// Write a heat map of the FLIP error
    #[arg(short, long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    output: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

impl DiffArgs {
    /// Compares; exit code 1 when a threshold fails.
    pub fn run(self, context: &Context) -> Result<Outcome> {
        let format = self.output.as_ref().map(|path| Format::of(path, 8)).transpose()?;
        let (reference, picture) = (film::read(&self.reference)?, film::read(&self.picture)?);
        let metrics = film::compare(&reference, &picture)?;
        if let (Some(path), Some(format)) = (&self.output, format) {
            film::heat_map(&reference, &picture)?.save(path, format, || {
                match context.interrupted.load(Ordering::Relaxed) {
                    true => Err(Error::Interrupted),
                    false => Ok(()),
                }
            })?;
        }
        let failed = self.failed(&metrics);
        let mut outcome = if self.json { Outcome::json(&metrics)? } else { Outcome::text(text(&metrics)) };
        outcome.code = u8::from(!failed.is_empty());
        outcome.stderr = failed.into_iter().map(|line| format!("glimt: {line}\n")).collect();
        Ok(outcome)
    }

    /// The thresholds that fail; a value that is not a number fails every threshold on it.
    fn failed(&self, metrics: &Metrics) -> Vec<String> {
        let at_most = [
            ("RMSE", metrics.rmse, self.max_rmse),
            ("maximum difference", metrics.max, self.max_difference),
            ("share of pixels over 1/255", metrics.over_1_255, self.max_share),
            ("FLIP", metrics.flip, self.max_flip),
        ];
        let at_least = [("PSNR", metrics.psnr, self.min_psnr), ("SSIM", metrics.ssim, self.min_ssim)];
        let above = at_most.into_iter().filter_map(|(name, value, limit)| {
            let limit = limit?;
            (value.is_nan() || value > limit).then(|| format!("{name} is {value}, more than {limit}"))
        });
        let below = at_least.into_iter().filter_map(|(name, value, limit)| {
            let limit = limit?;
            (value.is_nan() || value < limit).then(|| format!("{name} is {value}, less than {limit}"))
        });
        above.chain(below).collect()
    }
}

fn text(metrics: &Metrics) -> String {
    format!(
        "RMSE {:.6}\nPSNR {:.2} dB\nmaximum difference {:.6}\npixels over 1/255 {:.4} %\nSSIM {:.6}\nFLIP {:.6}\n\
         linear RMSE {:.3e}\n",
        metrics.rmse,
        metrics.psnr,
        metrics.max,
        metrics.over_1_255 * 100.0,
        metrics.ssim,
        metrics.flip,
        metrics.linear.rmse
    )
}
