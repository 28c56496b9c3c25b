//! What the extreme cases gave.

use super::page::Page;
use super::plot::{log_log, Series};
use serde::{Serialize, Serializer};

/// One value of a case's parameter.
#[derive(Clone, Debug, Serialize)]
pub struct StressRow {
    /// The case.
    pub case: &'static str,
    /// What was varied.
    pub parameter: String,
    /// Its value.
    pub value: f64,
    /// Rays, or pixels, that were judged.
    pub rays: u64,
    /// Those that are wrong.
    pub wrong: u64,
    /// The figure that is judged: the share of wrong rays, or a relative error. Infinite (`null`) where nothing could be computed.
    #[serde(serialize_with = "finite")]
    pub error: f64,
    /// The most it may be.
    pub bound: f64,
    /// Wall-clock milliseconds, with making the scene and judging.
    pub ms: f64,
    /// error ≤ bound.
    pub holds: bool,
    /// Why nothing could be computed.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub note: String,
}

fn finite<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    value.is_finite().then_some(*value).serialize(serializer)
}

impl StressRow {
    /// Column headings of [`StressRow::text`].
    pub const HEADINGS: &'static str =
        "case             parameter                               value        rays    wrong      error      bound        ms";

    /// A line of a table.
    pub fn text(&self) -> String {
        let holds = if self.holds { "" } else { "   DOES NOT HOLD" };
        let note = if self.note.is_empty() { String::new() } else { format!("   {}", self.note) };
        format!(
            "{:<16} {:<36} {:>8.1e} {:>11} {:>8} {:>10.2e} {:>10.2e} {:>9.1}{holds}{note}",
            self.case, self.parameter, self.value, self.rays, self.wrong, self.error, self.bound, self.ms
        )
    }
}

/// The page of a run: a plot of each parameter of each case, with all rows. `about` is one line for each case.
pub fn stress_page(rows: &[StressRow], about: &[(&str, &str)], subject: &str) -> String {
    let mut page = Page::new("Extreme and stiff cases");
    page.about(subject);
    let failed = rows.iter().filter(|row| !row.holds).count();
    page.text(&format!(
        "{} of {} values hold. Each case is a scene made by code, swept over a parameter and judged by f64 arithmetic or a closed form. Left: \
         the share of rays or pixels that are wrong, or the relative error; what is exactly 0 lies on the lower edge, and the most that is \
         allowed is drawn beside it where it is not 0. Right: run time with making the scene and judging it; below, where there is an error at all, error over run time.",
        rows.len() - failed,
        rows.len()
    ));
    for (case, about) in about {
        let rows: Vec<&StressRow> = rows.iter().filter(|row| row.case == *case).collect();
        if rows.is_empty() {
            continue;
        }
        page.heading(case);
        page.text(about);
        let mut parameters: Vec<&str> = rows.iter().map(|row| row.parameter.as_str()).collect();
        parameters.dedup();
        parameters.sort_unstable();
        parameters.dedup();
        let swept = |parameter: &&&str| {
            let values = rows.iter().filter(|row| row.parameter == ***parameter).map(|row| row.value);
            values.clone().count() > 1 && values.clone().all(|value| value > 0.0 && value.is_finite())
        };
        let series = |figure: fn(&StressRow) -> f64, suffix: &str| -> Vec<Series> {
            let of_parameter = |parameter: &&str| Series {
                name: format!("{parameter}{suffix}"),
                points: rows
                    .iter()
                    .filter(|row| row.parameter == **parameter)
                    .map(|row| (row.value, if figure(row).is_finite() { figure(row) } else { 1.0 }))
                    .collect(),
                is_line: true,
            };
            parameters.iter().filter(swept).map(of_parameter).collect()
        };
        let mut errors = series(|row| row.error, "");
        if !errors.is_empty() {
            if rows.iter().all(|row| row.bound == rows[0].bound) && rows[0].bound > 0.0 {
                let ends = errors.iter().flat_map(|series| series.points.iter().map(|point| point.0));
                let (lo, hi) = ends.fold((f64::INFINITY, 0.0_f64), |(lo, hi), x| (lo.min(x), hi.max(x)));
                let points = vec![(lo, rows[0].bound), (hi, rows[0].bound)];
                errors.push(Series { name: "most that is allowed".into(), points, is_line: true });
            }
            let over_time: Vec<Series> = parameters
                .iter()
                .map(|parameter| Series {
                    name: (*parameter).into(),
                    points: rows
                        .iter()
                        .filter(|row| row.parameter == *parameter && row.error > 0.0 && row.error.is_finite())
                        .map(|row| (row.ms, row.error))
                        .collect(),
                    is_line: false,
                })
                .filter(|series| series.points.len() > 1)
                .collect();
            let mut plots = vec![
                log_log("value of the parameter", "error", &errors),
                log_log("value of the parameter", "run time, ms", &series(|row| row.ms, "")),
            ];
            if !over_time.is_empty() {
                plots.push(log_log("run time, ms", "error", &over_time));
            }
            page.row(&plots);
        }
        let cells = |row: &&StressRow| {
            let cells = vec![
                row.parameter.clone(),
                format!("{:e}", row.value),
                row.rays.to_string(),
                row.wrong.to_string(),
                if row.error.is_finite() { format!("{:.2e}", row.error) } else { "-".into() },
                format!("{:.2e}", row.bound),
                format!("{:.1}", row.ms),
                if row.holds { "yes".into() } else { format!("NO {}", row.note) },
            ];
            (cells, !row.holds)
        };
        let headings = ["parameter", "value", "rays", "wrong", "error", "most allowed", "ms", "holds"];
        page.table(&headings, &rows.iter().map(cells).collect::<Vec<_>>());
    }
    page.html()
}
