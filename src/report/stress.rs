//! What the extreme cases gave.

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
