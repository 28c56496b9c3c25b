//! Boxes → a binary bounding volume hierarchy over them. Knows boxes, not meshes.
//!
//! [`Bvh::build`] makes the tree in f32 by the surface area heuristic; [`quantise`] turns it into the 16-byte child records
//! that the kernels walk. The tree's depth is bounded, hard, by `MAX_TREE_DEPTH`: the traversal's stack relies on it.

mod aabb;
mod binned_sah;
mod quantise;
mod stats;

pub use aabb::Aabb;
pub use quantise::{quantise, Grid, Quantised};
pub use stats::Stats;

use crate::layout::{MAX_LEAF_TRIANGLES, MAX_TREE_DEPTH};

/// What a child is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Child {
    /// An inner node, by index.
    Node(u32),
    /// Primitives `first..first + count` of [`Bvh::order`].
    Leaf {
        /// First place in the order.
        first: u32,
        /// At most `MAX_LEAF_TRIANGLES`; 0 for nothing.
        count: u32,
    },
}

/// An inner node: two children and their boxes.
#[derive(Clone, Copy, Debug)]
pub struct Node {
    /// Boxes of the children.
    pub bounds: [Aabb; 2],
    /// The children.
    pub children: [Child; 2],
}

/// A tree. Node 0 is the root and always exists; nodes are in depth-first order.
#[derive(Clone, Debug)]
pub struct Bvh {
    /// Inner nodes.
    pub nodes: Vec<Node>,
    /// Primitives in leaf order.
    pub order: Vec<u32>,
    /// Box around everything.
    pub bounds: Aabb,
}

impl Bvh {
    /// Builds a tree over boxes by binned surface area heuristic, in parallel; the same boxes give the same tree on any
    /// number of threads.
    pub fn build(boxes: &[Aabb]) -> Self {
        binned_sah::build(boxes)
    }

    /// Checks every invariant: each primitive in exactly one leaf, boxes that hold what is below them, leaf sizes, depth,
    /// order of nodes.
    ///
    /// # Errors
    /// The first broken invariant, in words.
    pub fn validate(&self, boxes: &[Aabb]) -> Result<(), String> {
        let mut seen = vec![false; boxes.len()];
        let mut visited = 0;
        let mut stack = vec![(0_u32, self.bounds, 1_u32)];
        while let Some((index, bounds, depth)) = stack.pop() {
            visited += 1;
            if depth > MAX_TREE_DEPTH {
                return Err(format!("node {index} lies {depth} deep"));
            }
            let node = self.nodes.get(index as usize).ok_or(format!("no node {index}"))?;
            for (child, child_bounds) in node.children.iter().zip(node.bounds) {
                match *child {
                    Child::Leaf { count: 0, .. } => continue,
                    Child::Leaf { count, .. } if count > MAX_LEAF_TRIANGLES => {
                        return Err(format!("a leaf of {count} primitives below node {index}"));
                    }
                    Child::Leaf { first, count } => {
                        for place in first..first + count {
                            let primitive = self.order[place as usize] as usize;
                            if std::mem::replace(&mut seen[primitive], true) {
                                return Err(format!("primitive {primitive} lies in two leaves"));
                            }
                            if !child_bounds.contains(&boxes[primitive]) {
                                return Err(format!("primitive {primitive} sticks out of its leaf"));
                            }
                        }
                    }
                    Child::Node(below) if below <= index => return Err(format!("node {below} lies below {index}")),
                    Child::Node(below) => stack.push((below, child_bounds, depth + 1)),
                }
                if !bounds.contains(&child_bounds) {
                    return Err(format!("a child of node {index} sticks out of it"));
                }
            }
        }
        if visited != self.nodes.len() {
            return Err(format!("{visited} of {} nodes can be reached", self.nodes.len()));
        }
        match seen.iter().position(|seen| !seen) {
            Some(primitive) => Err(format!("primitive {primitive} lies in no leaf")),
            None => Ok(()),
        }
    }
}
