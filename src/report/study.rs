//! What a study found: CSV, JSON and a page.

use super::page::{picture, Page};
use super::plot;
use super::{Device, Slope, Spread};
use serde::Serialize;
use std::fmt::Write;

/// All that `study.json` holds.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Study {
    /// The scene's name.
    pub scene: String,
    /// The command line.
    pub command: String,
    /// Where it was computed.
    pub device: Device,
    /// Knob along the axis.
    pub axis: String,
    /// Pictures of each setting.
    pub repeats: u32,
    /// Samples a pixel of the reference; 0 for a picture that was given.
    pub reference_samples: u32,
    /// The wanted error.
    pub target_rmse: Option<f64>,
    /// One for each setting of the other knobs.
    pub series: Vec<Series>,
}

/// The settings along the axis, the other knobs left alone.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Series {
    /// Settings of the other knobs; empty when there are none.
    pub name: String,
    /// Estimated RMSE of the reference itself; 0 for one that was given.
    pub noise_of_reference: f64,
    /// In the order of the command line.
    pub settings: Vec<Measured>,
    /// log RMSE over log device time.
    pub slope_over_time: Option<Slope>,
    /// log RMSE over the logarithm of the knob, if it is a number.
    pub slope_over_axis: Option<Slope>,
    /// The setting that reaches the wanted error in the least time; `None` if none does.
    pub cheapest_for_target: Option<String>,
}

/// One setting.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Measured {
    /// As on the command line.
    pub setting: String,
    /// As a number, if it is one.
    pub number: Option<f64>,
    /// Root of the mean squared error of all repeats in linear RGB.
    pub rmse: f64,
    /// The RMSE of each repeat.
    pub rmse_of_repeats: Vec<f64>,
    /// Mean squared error over the reference's square + 0.01.
    pub rel_mse: f64,
    /// Mean FLIP error.
    pub flip: f64,
    /// Largest error of any channel in any repeat.
    pub max: f64,
    /// 1 / (MSE · seconds).
    pub efficiency: f64,
    /// From buffers to the last pixel.
    pub wall_ms: Spread,
    /// By timestamps; zeros where the device has none.
    pub device_ms: Spread,
    /// Building the tree.
    pub build_ms: Spread,
    /// Rays of a picture.
    pub rays: u64,
    /// The RMSE is less than twice the reference's own: it says little.
    pub is_below_noise: bool,
}

impl Study {
    /// One line for each setting.
    pub fn csv(&self) -> String {
        let mut csv = format!(
            "series,{},rmse,rel_mse,flip,max,efficiency,wall_ms,wall_ms_min,wall_ms_max,device_ms,device_ms_min,device_ms_max,\
             build_ms,rays,noise_of_reference\n",
            self.axis
        );
        for series in &self.series {
            for m in &series.settings {
                let errors = [m.rmse, m.rel_mse, m.flip, m.max, m.efficiency].map(|value| format!("{value:e}"));
                let times = [m.wall_ms, m.device_ms].map(|ms| format!("{},{},{}", ms.median, ms.min, ms.max));
                let (errors, times) = (errors.join(","), times.join(","));
                let (build, noise) = (m.build_ms.median, series.noise_of_reference);
                let _ =
                    writeln!(csv, "\"{}\",{},{errors},{times},{build},{},{noise:e}", series.name, m.setting, m.rays);
            }
        }
        csv
    }

    /// A table for people.
    pub fn text(&self) -> String {
        let mut text = format!(
            "{:<28} {:>16} {:>10} {:>10} {:>10} {:>10} {:>10} {:>10} {:>12}\n",
            "series", self.axis, "RMSE", "relMSE", "FLIP", "max", "wall ms", "device ms", "1/(MSE·s)"
        );
        for series in &self.series {
            for m in &series.settings {
                let _ = writeln!(
                    text,
                    "{:<28} {:>16} {:>10.2e} {:>10.2e} {:>10.2e} {:>10.2e} {:>10.1} {:>10.1} {:>12.3e}{}",
                    series.name,
                    m.setting,
                    m.rmse,
                    m.rel_mse,
                    m.flip,
                    m.max,
                    m.wall_ms.median,
                    m.device_ms.median,
                    m.efficiency,
                    if m.is_below_noise { "   within the reference's noise" } else { "" }
                );
            }
        }
        for series in &self.series {
            let _ = writeln!(text, "{}", self.summary(series));
        }
        text
    }

    /// Slopes and the cheapest setting of a series, in a sentence.
    fn summary(&self, series: &Series) -> String {
        let slope = |slope: &Option<Slope>| match slope {
            None => "-".into(),
            Some(Slope { slope, confidence_95: Some(interval), .. }) => format!("{slope:.3} ± {interval:.3}"),
            Some(slope) => format!("{:.3}", slope.slope),
        };
        let name = if series.name.is_empty() { "all" } else { &series.name };
        let mut text = format!(
            "{name}: slope of log RMSE over log device time {}, over log {} {} (95 %); the reference's own RMSE {:.1e}",
            slope(&series.slope_over_time),
            self.axis,
            slope(&series.slope_over_axis),
            series.noise_of_reference
        );
        if let Some(target) = self.target_rmse {
            let reached = match &series.cheapest_for_target {
                Some(setting) => format!("; RMSE {target:e} reached at least cost by {} {setting}", self.axis),
                None => format!("; RMSE {target:e} not reached"),
            };
            text.push_str(&reached);
        }
        text
    }

    /// A page with plots, tables and pictures. `pictures`: name, PNG of the picture, PNG of its FLIP map; `references`: PNGs.
    pub fn html(&self, pictures: &[(String, Vec<u8>, Vec<u8>)], references: &[Vec<u8>], width: u32) -> String {
        let mut page = Page::new(&format!("{}: error against run time", self.scene));
        page.about(&format!("{} ({}) · {}", self.device.name, self.device.driver, self.command));
        let of = match self.reference_samples {
            0 => "the picture that was given".into(),
            samples => format!("a reference of {samples} Sobol samples a pixel with other seeds"),
        };
        page.text(&format!(
            "Each setting of {} was rendered {} times with different seeds and compared with {of}. RMSE is the root of the mean squared \
             error in linear RGB; below the line “reference's own” nothing can be known. Device time is the sum of the passes \
             by timestamps. The fitted slope says by how much the error falls: −½ means that four times the time halves it.",
            self.axis, self.repeats
        ));
        let line = |name: &str, points: Vec<(f64, f64)>, is_line| plot::Series { name: name.into(), points, is_line };
        let named = |series: &Series| if series.name.is_empty() { "RMSE".to_owned() } else { series.name.clone() };
        let over = |x: &dyn Fn(&Measured) -> Option<f64>, y: &dyn Fn(&Measured) -> f64| -> Vec<plot::Series> {
            let points = |series: &Series| {
                series.settings.iter().filter_map(|m| x(m).map(|x| (x, y(m)))).collect::<Vec<(f64, f64)>>()
            };
            self.series.iter().map(|series| line(&named(series), points(series), true)).collect()
        };
        let noise = self.series.iter().map(|series| series.noise_of_reference).fold(0.0, f64::max);
        let mut over_time = over(&|m| Some(m.device_ms.median), &|m| m.rmse);
        let mut over_axis = over(&|m| m.number, &|m| m.rmse);
        for plotted in [&mut over_time, &mut over_axis] {
            let xs = plotted.iter().flat_map(|series| series.points.iter().map(|point| point.0));
            let (lo, hi) = xs.fold((f64::INFINITY, 0.0_f64), |(lo, hi), x| (lo.min(x), hi.max(x)));
            if noise > 0.0 && hi > lo {
                plotted.push(line("reference's own", vec![(lo, noise), (hi, noise)], true));
            }
        }
        let axis_has_numbers = over_axis.iter().any(|series| series.points.len() > 1);
        let mut row = vec![plot::log_log("device time, ms", "RMSE", &over_time)];
        if axis_has_numbers {
            row.push(plot::log_log(&self.axis, "RMSE", &over_axis));
            row.push(plot::log_log(&self.axis, "mean FLIP", &over(&|m| m.number, &|m| m.flip)));
            row.push(plot::log_log(&self.axis, "efficiency 1/(MSE·s)", &over(&|m| m.number, &|m| m.efficiency)));
        }
        page.heading("Error against run time");
        page.row(&row);
        for series in &self.series {
            page.text(&self.summary(series));
        }
        page.heading("Figures");
        let cells = |series: &Series, m: &Measured| {
            let spread = |spread: &Spread| format!("{:.1} ({:.1} – {:.1})", spread.median, spread.min, spread.max);
            let cells = vec![
                series.name.clone(),
                m.setting.clone(),
                format!("{:.3e}", m.rmse),
                format!("{:.3e}", m.rel_mse),
                format!("{:.4}", m.flip),
                format!("{:.3}", m.max),
                spread(&m.wall_ms),
                spread(&m.device_ms),
                format!("{:.1}", m.build_ms.median),
                m.rays.to_string(),
                format!("{:.2e}", m.efficiency),
            ];
            (cells, m.is_below_noise)
        };
        let rows: Vec<_> =
            self.series.iter().flat_map(|series| series.settings.iter().map(move |m| cells(series, m))).collect();
        page.table(
            &[
                "series",
                &self.axis,
                "RMSE",
                "relMSE",
                "FLIP",
                "max",
                "wall ms (min – max)",
                "device ms (min – max)",
                "tree ms",
                "rays",
                "1/(MSE·s)",
            ],
            &rows,
        );
        page.heading("Pictures and their FLIP maps");
        page.text("FLIP shows where a person who flips between picture and reference sees a difference: black none, white most.");
        let references: Vec<String> = references.iter().map(|png| picture(png, width, "reference")).collect();
        page.row(&references);
        let pairs = pictures.iter().flat_map(|(name, film, map)| {
            [picture(film, width, name), picture(map, width, &format!("FLIP of {name}"))]
        });
        page.row(&pairs.collect::<Vec<_>>());
        page.html()
    }
}
