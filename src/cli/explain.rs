//! `glimt explain`.

use super::view::ViewArgs;
use super::{load_scene, Outcome};
use clap::{Args, ValueEnum, ValueHint};
use glimt::render::{Plan, Prepared};
use glimt::Result;
use serde_json::json;
use std::fmt::Write;

/// Flags of `glimt explain`.
#[derive(Args)]
pub struct ExplainArgs {
    /// A .gltf or .glb file, - for standard input, or a built-in scene
    #[arg(value_hint = ValueHint::FilePath, default_value = "table")]
    scene: String,
    /// How to say it
    #[arg(long, value_enum, default_value_t = Form::Text)]
    format: Form,
    /// The same as --format json
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    view: ViewArgs,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Form {
    /// Lists for people
    Text,
    /// A Mermaid flow chart
    Mermaid,
    /// One JSON object
    Json,
}

impl ExplainArgs {
    /// Plans the scene without any device.
    pub fn run(self) -> Result<Outcome> {
        let scene = load_scene(&self.scene, &self.view.read.options())?;
        let options = self.view.options()?;
        let prepared = Prepared::new(&scene, &options)?;
        let tree = prepared.tree(&options);
        let (features, size) = (tree.features(prepared.features), tree.size());
        let plan = Plan::new(&prepared, &scene, features, size, options.samples_in_flight)?;
        let view = &prepared.view;
        match if self.json { Form::Json } else { self.format } {
            Form::Text => Ok(Outcome::text(text(&plan, &scene.name, view.samples))),
            Form::Mermaid => Ok(Outcome::text(mermaid(&plan))),
            Form::Json => Outcome::json(&json!({
                "scene": scene.name,
                "features": features.needs().collect::<std::collections::BTreeMap<_, _>>(),
                "passes": plan.passes.iter().map(|pass| json!({"name": pass.name, "dispatches": pass.dispatches})).collect::<Vec<_>>(),
                "buffers": plan.buffers.iter().map(|buffer| json!({"name": buffer.name, "bytes": buffer.bytes})).collect::<Vec<_>>(),
                "left_out": plan.left_out.iter().map(|left| json!({"name": left.name, "reason": left.reason})).collect::<Vec<_>>(),
            })),
        }
    }
}

/// Bytes with a unit.
fn size(bytes: u64) -> String {
    match bytes {
        0..10_240 => format!("{bytes} B"),
        10_240..10_485_760 => format!("{} KiB", bytes >> 10),
        _ => format!("{} MiB", bytes >> 20),
    }
}

fn text(plan: &Plan, name: &str, samples: u32) -> String {
    let mut text = format!(
        "{name}: {} wave(s) of {} pixels × {} of {samples} sample(s), {} round(s) of shading\n",
        plan.waves(samples),
        plan.band_pixels,
        plan.wave_samples,
        plan.rounds
    );
    let _ = writeln!(text, "passes:");
    for pass in &plan.passes {
        let _ = writeln!(text, "  {:<12}{:>6} dispatches  {}", pass.name, pass.dispatches, pass.purpose);
    }
    let _ = writeln!(text, "buffers:");
    for buffer in plan.buffers.iter().filter(|buffer| buffer.bytes > 0) {
        let _ = writeln!(text, "  {:<18}{:>10}", buffer.name, size(buffer.bytes));
    }
    let _ = writeln!(text, "features:");
    for (feature, on) in plan.features.needs() {
        let _ = writeln!(text, "  {feature:<18}{:>10}", if on { "on" } else { "off" });
    }
    let _ = writeln!(text, "left out:");
    for left in &plan.left_out {
        let _ = writeln!(text, "  {:<18}because {}", left.name, left.reason);
    }
    if plan.left_out.is_empty() {
        let _ = writeln!(text, "  nothing");
    }
    text
}

/// Passes as boxes, queues as the arrows between them.
fn mermaid(plan: &Plan) -> String {
    let (shadows, goes_on) = (plan.features.shadows, plan.features.rays_go_on());
    let mut lines = vec![
        "flowchart LR".to_owned(),
        "  scene[(nodes, triangles)] --> primary".to_owned(),
        "  primary -- hit_queue --> shade".to_owned(),
        "  primary -- background --> resolve".to_owned(),
        "  shade -- ambient, emission --> resolve".to_owned(),
    ];
    if shadows {
        lines.push("  shade -- shadow_queue --> shadow".into());
        lines.push("  shadow -- visible light --> resolve".into());
    }
    if goes_on {
        lines.push("  shade -- reflection_queue --> reflection".into());
        lines.push(format!("  reflection -- hit_queue, {} times --> shade", plan.rounds - 1));
        lines.push("  reflection -- background --> resolve".into());
    }
    lines.push("  resolve --> film[(film)]".into());
    lines.join("\n") + "\n"
}
