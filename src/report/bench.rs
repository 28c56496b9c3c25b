//! What a benchmark measured.

use super::Device;
use serde::Serialize;

/// All that `glimt bench --json` prints.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Bench {
    /// The scene's name.
    pub scene: String,
    /// Triangles of all instances.
    pub triangles: usize,
    /// Ray sets in the order asked for.
    pub sets: Vec<Set>,
    /// The tree.
    pub bvh: BenchTree,
    /// Where it was computed.
    pub device: Device,
}

/// A ray set.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Set {
    /// primary, shadow, mirror or diffuse.
    pub name: &'static str,
    /// Rays.
    pub rays: usize,
    /// Rays that hit something.
    pub hits: usize,
    /// Millions of rays a second by the wall clock, submission and waiting included.
    pub mrays_per_s: Spread,
    /// Device milliseconds by timestamps; zeros where the device has none.
    pub device_ms: Spread,
    /// Wall-clock milliseconds.
    pub wall_ms: Spread,
    /// Against the answers of another program, where asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mismatches: Option<Mismatches>,
    /// What the rays ask of the tree, where asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub work: Option<Work>,
}

/// What rays ask of the tree, means.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Work {
    /// Wide nodes that a ray visits.
    pub nodes: f64,
    /// Triangles that it is tested with.
    pub triangles: f64,
    /// Rays that walk in step: a subgroup of the device.
    pub lanes: usize,
    /// Rounds in which so many rays visit nodes.
    pub node_rounds: f64,
    /// Rounds in which they test triangles.
    pub triangle_rounds: f64,
}

/// Rays whose answer differs from another program's: hit or not, or a distance that differs by more than 1e-3 of it.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Mismatches {
    /// In all.
    pub count: usize,
    /// Of these, the other program hits something and we do not.
    pub missed: usize,
    /// We hit something and the other program does not.
    pub extra: usize,
    /// Of all, those whose answer here f64 arithmetic does not allow, even when edges are widened by 1e-4.
    pub wrong: usize,
}

/// Median and extremes.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Spread {
    /// Median; of an even number, the upper one.
    pub median: f64,
    /// Least.
    pub min: f64,
    /// Most.
    pub max: f64,
}

impl Spread {
    /// Of any number of values; zeros of none.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        let at = |index: usize| values.get(index).copied().unwrap_or(0.0);
        Self { median: at(values.len() / 2), min: at(0), max: at(values.len().saturating_sub(1)) }
    }
}

/// The tree.
#[derive(Clone, Debug, Default, Serialize)]
pub struct BenchTree {
    /// How it was built.
    pub builder: &'static str,
    /// From world-space triangles to what the device gets, milliseconds; median of several builds.
    pub build_ms: f64,
    /// Inner nodes.
    pub nodes: usize,
    /// Bytes of nodes on the device.
    pub bytes: u64,
    /// Bytes of triangles on the device, as traversal reads them.
    pub triangle_bytes: u64,
    /// Expected cost of a ray, in triangle tests.
    pub sah_cost: f64,
    /// Levels.
    pub depth: u32,
}

impl Bench {
    /// A table for people.
    pub fn text(&self) -> String {
        let tree = &self.bvh;
        let mut lines = vec![
            format!("{}: {} triangles on {}", self.scene, self.triangles, self.device.name),
            format!(
                "tree: {}, built in {:.1} ms; {} nodes, {} + {} bytes, SAH cost {:.1}, depth {}",
                tree.builder, tree.build_ms, tree.nodes, tree.bytes, tree.triangle_bytes, tree.sah_cost, tree.depth
            ),
            format!(
                "{:<10}{:>9}{:>9}{:>12}{:>9}{:>9}{:>12}{:>10}",
                "set", "rays", "hits", "Mrays/s", "min", "max", "device ms", "wall ms"
            ),
        ];
        for set in &self.sets {
            let speed = set.mrays_per_s;
            let mut line = format!(
                "{:<10}{:>9}{:>9}{:>12.3}{:>9.3}{:>9.3}{:>12.2}{:>10.2}",
                set.name,
                set.rays,
                set.hits,
                speed.median,
                speed.min,
                speed.max,
                set.device_ms.median,
                set.wall_ms.median
            );
            if let Some(Mismatches { count, missed, extra, wrong }) = set.mismatches {
                line += &format!("  mismatches {count} ({missed} missed, {extra} extra), wrong {wrong}");
            }
            lines.push(line);
        }
        for (set, work) in self.sets.iter().filter_map(|set| Some((set.name, set.work?))) {
            let Work { nodes, triangles, lanes, node_rounds, triangle_rounds } = work;
            let busy = |steps: f64, rounds: f64| 100.0 * steps / rounds.max(1.0);
            lines.push(format!(
                "{set:<10}visits {nodes:.1} nodes and {triangles:.1} triangles a ray; {lanes} rays in step: {node_rounds:.1} and {triangle_rounds:.1} \
                 rounds, {:.0} and {:.0} % of them at work",
                busy(nodes, node_rounds),
                busy(triangles, triangle_rounds)
            ));
        }
        lines.join("\n")
    }
}
