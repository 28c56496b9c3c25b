//! Figures of a tree.

use super::build::VISIT_COST;
use super::{Bvh, Child};

/// What a tree looks like.
#[derive(Clone, Debug, PartialEq)]
pub struct Stats {
    /// Inner nodes.
    pub nodes: usize,
    /// Leaves that hold something.
    pub leaves: usize,
    /// Levels of inner nodes.
    pub depth: u32,
    /// Expected cost of a random ray that meets the root, in triangle tests: Σ area·(1.2 a node, 1 a triangle) / root area.
    pub sah_cost: f64,
    /// Primitives in leaves; one that was cut counts in each.
    pub references: usize,
}

impl Bvh {
    /// Counts the tree.
    pub fn stats(&self) -> Stats {
        let mut stats =
            Stats { nodes: self.nodes.len(), leaves: 0, depth: self.depth, sah_cost: VISIT_COST.into(), references: 0 };
        let whole = f64::from(self.bounds.half_area()).max(f64::MIN_POSITIVE);
        for node in &self.nodes {
            for (child, bounds) in node.children.iter().zip(&node.bounds) {
                let share = f64::from(bounds.half_area()) / whole;
                match *child {
                    Child::Node(_) => stats.sah_cost += f64::from(VISIT_COST) * share,
                    Child::Leaf { count, .. } => {
                        stats.references += count as usize;
                        stats.leaves += usize::from(count > 0);
                        stats.sah_cost += share * f64::from(count);
                    }
                }
            }
        }
        stats
    }
}
