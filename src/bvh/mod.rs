//! Boxes or triangles → a binary bounding volume hierarchy over them. Knows no meshes.
//!
//! [`Bvh::over_boxes`] makes the tree in f32 by the surface area heuristic, [`Bvh::over_triangles`] may also cut triangles; [`quantise`] turns it, four children a node, into what
//! the kernels walk. The tree's depth is bounded, hard, by `MAX_TREE_DEPTH`: the traversal's stack relies on it.

mod aabb;
mod build;
mod mini_trees;
mod object_split;
mod quantise;
mod references;
mod refit;
mod reinsert;
mod share;
mod spatial_split;
mod stats;
mod walk;
mod wide;

pub use aabb::Aabb;
pub use quantise::{quantise, reference, DeviceNode, Grid, Quantised};
pub use stats::Stats;
pub use walk::Steps;
pub use wide::{Side, Wide, WideChild, WideNode, WIDTH};

use crate::layout::{MAX_LEAF_TRIANGLES, MAX_TREE_DEPTH};
use build::Recipe;
use glam::Vec3;
use rayon::prelude::*;
use references::Reference;

/// Larger leaves appear only where nothing separates their triangles; smaller ones wherever that is cheaper.
const LEAF: usize = 6;
/// So few triangles are a leaf unless the tree is to be the best: dividing them takes a quarter of a build and makes a third of all nodes, and rays are
/// hardly faster.
const SMALL_LEAF: usize = 4;
/// So many triangles get a fast tree by way of mini trees.
const MANY: usize = 8192;

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
    /// Primitives in leaf order. One that spatial splits cut is in several leaves, most of which share its place: see `share.rs`.
    pub order: Vec<u32>,
    /// Box around everything.
    pub bounds: Aabb,
    /// Levels of inner nodes.
    pub depth: u32,
    /// The same tree with up to four children a node, as the kernels walk it.
    pub wide: Wide,
}

/// How much work goes into a tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quality {
    /// Object splits only; over many triangles, above the trees of a grid's cells.
    Fast,
    /// Spatial splits where boxes overlap much, for up to 3 in 10 more references.
    Balanced,
    /// Spatial splits wherever they help, for up to as many references again; then subtrees move to better places.
    Best,
}

impl Quality {
    /// Lower-case name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fast => "fast",
            Self::Balanced => "balanced",
            Self::Best => "best",
        }
    }

    /// Free space for references that spatial splits make, and the share of the root's area that must overlap for one.
    fn spatial(self, count: usize) -> (usize, f32) {
        match self {
            Self::Fast => (0, 0.0),
            Self::Balanced => (3 * count / 10, 1e-4),
            Self::Best => (count, 1e-5),
        }
    }
}

impl Node {
    /// Without primitives.
    const NOTHING: Self = Self { bounds: [Aabb::EMPTY; 2], children: [Child::Leaf { first: 0, count: 0 }; 2] };
}

impl Bvh {
    /// Builds a tree over boxes with leaves of at most `leaf` where anything separates them, in parallel; the same boxes give
    /// the same tree on any number of threads.
    pub fn over_boxes(boxes: &[Aabb], leaf: usize) -> Self {
        let mut references: Vec<Reference> =
            (0..).zip(boxes).map(|(primitive, bounds)| Reference::new(bounds.lo, bounds.hi, primitive)).collect();
        let recipe = Recipe { smallest: 1, leaf, spatial: None, reinsert: false };
        build::build(&mut references, boxes.len(), recipe)
    }

    /// Builds a tree over triangles, as [`Bvh::over_boxes`]; one that is long may lie in several leaves.
    pub fn over_triangles(triangles: &[[Vec3; 3]], quality: Quality) -> Self {
        Self::over(triangles.len(), |primitive| triangles[primitive], quality)
    }

    /// As [`Bvh::over_triangles`], over the triangles that `triangle` makes of numbers below `count`; it may be asked for each several times.
    pub fn over(count: usize, triangle: impl Fn(usize) -> [Vec3; 3] + Sync, quality: Quality) -> Self {
        let (free, overlap) = quality.spatial(count);
        let reference = |primitive: usize| match primitive < count {
            true => Reference::of_triangle(&triangle(primitive), primitive as u32),
            false => Reference::NONE,
        };
        let mut space: Vec<Reference> = (0..count + free).into_par_iter().map(reference).collect();
        // Only what may be cut is looked at again.
        let triangles: Vec<[Vec3; 3]> = (0..if free > 0 { count } else { 0 }).into_par_iter().map(&triangle).collect();
        let spatial = (free > 0).then_some((triangles.as_slice(), overlap));
        let is_best = quality == Quality::Best;
        let smallest = if is_best { 1 } else { SMALL_LEAF };
        let recipe = Recipe { smallest, leaf: LEAF, spatial, reinsert: is_best };
        if quality == Quality::Fast && count >= MANY {
            mini_trees::build(&space, recipe)
        } else {
            build::build(&mut space, count, recipe)
        }
    }

    /// From nodes in depth-first order, the first of them the root if there are any.
    fn new(root: Child, mut nodes: Vec<Node>, order: Vec<u32>, bounds: Aabb) -> Self {
        if nodes.is_empty() {
            // The root is always a node, so that traversal needs no special case for small scenes.
            nodes.push(Node { bounds: [bounds; 2], children: [root, Node::NOTHING.children[1]] });
        }
        let mut depths = vec![1_u8; nodes.len()];
        for (index, node) in nodes.iter().enumerate() {
            for child in node.children {
                if let Child::Node(below) = child {
                    // A node comes before what is below it.
                    depths[below as usize] = depths[index] + 1;
                }
            }
        }
        let depth = depths.into_iter().max().unwrap_or(0).into();
        let mut bvh = Self { nodes, order, bounds, depth, wide: Wide::default() };
        bvh.wide = Wide::of(&bvh);
        bvh
    }

    /// Checks every invariant: each primitive wholly in one leaf, boxes that hold what is below them, leaf sizes, depth, order
    /// of nodes, no place in the order of primitives that is no leaf's. Where `triangles` are given, a primitive may instead lie
    /// in parts in several leaves, and points all over it must be inside their boxes.
    ///
    /// # Errors
    /// The first broken invariant, in words.
    pub fn validate(&self, boxes: &[Aabb], triangles: Option<&[[Vec3; 3]]>) -> Result<(), String> {
        let mut leaves_of = vec![Vec::new(); boxes.len()];
        let mut is_used = vec![false; self.order.len()];
        let mut visited = 0;
        let mut stack = vec![(0_u32, self.bounds, 1_u32)];
        while let Some((index, bounds, depth)) = stack.pop() {
            visited += 1;
            if depth > MAX_TREE_DEPTH || depth > self.depth {
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
                        for place in first as usize..(first + count) as usize {
                            leaves_of[self.order[place] as usize].push(child_bounds);
                            is_used[place] = true;
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
        if let Some(place) = is_used.iter().position(|is_used| !is_used) {
            return Err(format!("place {place} of the order is in no leaf"));
        }
        for (primitive, leaves) in leaves_of.iter().enumerate() {
            match (leaves.as_slice(), triangles) {
                ([], _) => return Err(format!("primitive {primitive} lies in no leaf")),
                ([leaf], _) if leaf.contains(&boxes[primitive]) => {}
                (_, None) => return Err(format!("primitive {primitive} does not lie in one leaf")),
                (leaves, Some(triangles)) => {
                    // The points themselves are rounded, a few units in the last place.
                    let largest =
                        triangles[primitive].iter().fold(0.0_f32, |all, corner| all.max(corner.abs().max_element()));
                    let rounding = Vec3::splat(2.0 * f32::EPSILON * largest);
                    let inside = |point: Vec3| {
                        leaves.iter().any(|leaf| {
                            Aabb { lo: leaf.lo - rounding, hi: leaf.hi + rounding }
                                .contains(&Aabb { lo: point, hi: point })
                        })
                    };
                    if let Some(point) = points_of(&triangles[primitive]).find(|point| !inside(*point)) {
                        return Err(format!("{point} of primitive {primitive} lies in none of its leaves"));
                    }
                }
            }
        }
        Ok(())
    }
}

/// Points all over a triangle, edges and corners too.
fn points_of([a, b, c]: &[Vec3; 3]) -> impl Iterator<Item = Vec3> + '_ {
    const STEPS: u32 = 24;
    (0..=STEPS).flat_map(move |i| {
        (0..=STEPS - i).map(move |j| {
            let (u, v) = (i as f32 / STEPS as f32, j as f32 / STEPS as f32);
            *a * (1.0 - u - v) + *b * u + *c * v
        })
    })
}
