//! What a render did: counts, times, bytes; as one JSON object for machines and as text for people.

mod bench;
pub mod page;
pub mod plot;
mod slope;
mod stress;
pub mod study;

pub use bench::{Bench, BenchTree, Mismatches, Set, Spread, Work};
pub use slope::{log_log_slope, Slope};
pub use stress::{stress_page, StressRow};

use serde::Serialize;
use std::collections::BTreeMap;

/// All that `--json` prints.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    /// Which of a sequence.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame: Option<Frame>,
    /// The picture written.
    pub image: Image,
    /// Where it was computed.
    pub device: Device,
    /// What was rendered.
    pub scene: Scene,
    /// Feature → needed (or forced on).
    pub features: BTreeMap<&'static str, bool>,
    /// Passes in the order of the frame; those that the scene does not need are absent.
    pub passes: Vec<Pass>,
    /// Rays traced.
    pub rays: Rays,
    /// What was reached, where an error or a time was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub convergence: Option<Convergence>,
    /// The tree.
    pub bvh: Tree,
    /// Wall-clock milliseconds.
    pub times_ms: Times,
    /// Kernels compiled before the frame's first dispatch.
    pub compiled_ahead: CompiledAhead,
    /// Bytes on the device.
    pub memory_bytes: Memory,
}

/// A picture of a sequence.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Frame {
    /// Its number.
    pub number: u32,
    /// Its time.
    pub seconds: f64,
}

/// The picture written.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Image {
    /// File, `-` for standard output, empty for none.
    pub path: String,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// SHA-256 of the pixels as written: row by row from the top, channels interleaved, u8 or little-endian u16 or f32.
    pub sha256: String,
}

/// Where it was computed.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Device {
    /// Device name, `reference` for the reference renderer.
    pub name: String,
    /// Driver and its version.
    pub driver: String,
    /// Vulkan version.
    pub api: String,
    /// discrete, integrated, virtual, cpu, other.
    #[serde(rename = "type")]
    pub kind: String,
    /// Invocations in a subgroup.
    pub subgroup_size: u32,
}

/// What was rendered.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Scene {
    /// Triangles of all instances.
    pub triangles: usize,
    /// Instances of meshes.
    pub instances: usize,
    /// Lights that shine.
    pub lights: usize,
    /// Materials.
    pub materials: usize,
    /// What was approximated, ignored or dropped.
    pub warnings: Vec<String>,
}

/// A pass over the whole frame.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Pass {
    /// Kernel.
    pub name: &'static str,
    /// Dispatches.
    pub dispatches: u64,
    /// Items worked on: samples, queue items, pixels.
    pub items: u64,
    /// Device time by timestamps, of at most 16 384 dispatches a wave; 0 where the device has none.
    pub ms: f64,
}

/// Rays traced.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Rays {
    /// From the camera.
    pub primary: u64,
    /// To lights.
    pub shadow: u64,
    /// From mirrors.
    pub reflection: u64,
}

/// How far a picture in passes came.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Convergence {
    /// Samples a pixel.
    pub samples: u32,
    /// Estimated root of the mean squared error in linear RGB.
    pub error: f64,
    /// Seconds of rendering.
    pub seconds: f64,
    /// What ended it: `error`, `time`, or the most `samples` there may be.
    pub reached: &'static str,
}

/// The tree.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Tree {
    /// Inner nodes.
    pub nodes: usize,
    /// Levels.
    pub depth: u32,
    /// Expected cost of a ray, in triangle tests.
    pub sah_cost: f64,
    /// Bytes of nodes on the device.
    pub bytes: u64,
    /// How it came from the tree of the frame before, in a sequence.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub update: Option<TreeUpdate>,
}

/// What became of the tree of the frame before. Costs are those of the part of the tree that has become loosest, in triangle tests
/// a ray that meets it; null where the triangles are not the same.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TreeUpdate {
    /// `refitted` or `rebuilt`.
    pub action: &'static str,
    /// When it was last built.
    pub built_cost: Option<f64>,
    /// Refitted to this frame.
    pub refitted_cost: Option<f64>,
}

/// Wall-clock milliseconds. Device start-up runs beside loading, so the parts may add up to more than the total.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Times {
    /// Reading the file, building the triangle soup.
    pub load: f64,
    /// Building the tree.
    pub bvh: f64,
    /// Opening Vulkan and the device.
    pub device: f64,
    /// Buffers and kernels.
    pub upload: f64,
    /// From the first dispatch to the last pixel read back; contains what the driver compiles then.
    pub render: f64,
    /// Encoding and writing.
    pub save: f64,
    /// Everything, from the start of the process, or the end of the frame before.
    pub total: f64,
}

/// Kernels compiled before the frame's first dispatch, side by side: none where the driver seems to have them on disk, or is better at it.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct CompiledAhead {
    /// How many.
    pub kernels: usize,
    /// Of these, on twins of the device.
    pub on_twins: usize,
    /// Milliseconds, a part of `times_ms.upload`.
    pub ms: f64,
}

/// Bytes on the device.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Memory {
    /// Most at one time.
    pub device_peak: u64,
    /// Of these, queues.
    pub queues: u64,
}

impl Report {
    /// A few lines for people.
    pub fn text(&self) -> String {
        let ms = |value: f64| format!("{value:.0} ms");
        let CompiledAhead { kernels, ms: compiling, .. } = self.compiled_ahead;
        let compiling =
            if kernels > 0 { format!(" (compiling {kernels} kernels: {})", ms(compiling)) } else { String::new() };
        let rays = self.rays.primary + self.rays.shadow + self.rays.reflection;
        let mut lines = vec![
            format!("{} × {} pixels on {}", self.image.width, self.image.height, self.device.name),
            format!(
                "{} triangles, {} lights; {rays} rays ({} primary, {} shadow, {} reflection)",
                self.scene.triangles, self.scene.lights, self.rays.primary, self.rays.shadow, self.rays.reflection
            ),
            format!(
                "load {}, tree {}, device {}, upload {}{compiling}, render {}, save {}; total {}",
                ms(self.times_ms.load),
                ms(self.times_ms.bvh),
                ms(self.times_ms.device),
                ms(self.times_ms.upload),
                ms(self.times_ms.render),
                ms(self.times_ms.save),
                ms(self.times_ms.total)
            ),
        ];
        if let Some(reached) = &self.convergence {
            lines.push(format!(
                "{} samples a pixel, estimated RMSE {:.2e}, in {:.2} s: stopped by {}",
                reached.samples, reached.error, reached.seconds, reached.reached
            ));
        }
        lines.extend(self.scene.warnings.iter().map(|warning| format!("warning: {warning}")));
        lines.join("\n")
    }
}
