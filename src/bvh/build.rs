//! Top-down building: each node is split where the surface area heuristic expects the cheapest rays, until leaves are small.
//!
//! The references of a subtree lie at the front of a piece of one array; the free space behind them is what spatial splits may
//! fill, and is handed down in proportion, so that every subtree knows its budget and the tree is the same on any number of
//! threads.

use super::references::{Box4, Reference, Summary};
use super::reinsert::reinsert;
use super::share::share_leaves;
use super::{object_split, spatial_split, Bvh, Child, Node};
use crate::layout::MAX_TREE_DEPTH;
use glam::Vec3;
use rayon::prelude::*;

/// Cost of visiting a node, in triangle tests.
pub(super) const VISIT_COST: f32 = 1.2;
/// Below this many references a subtree is built by one thread.
const PARALLEL: usize = 16384;

/// Splits of space are tried where the boxes' empty surfaces, together, are so many times the node's: on a
/// scanned mesh they hardly reach it, among long diagonal triangles it is almost one a triangle.
const EMPTY: f32 = 1.0;

/// What kind of tree to build.
#[derive(Clone, Copy)]
pub(super) struct Recipe<'a> {
    /// So few references are a leaf, whatever a split would cost.
    pub smallest: usize,
    /// Most references in a leaf that a split could separate.
    pub leaf: usize,
    /// Corners, for spatial splits, with the share of the root's area that children must overlap before one is tried.
    pub spatial: Option<(&'a [[Vec3; 3]], f32)>,
    /// Whether subtrees then move to better places.
    pub reinsert: bool,
}

/// Builds trees by a recipe.
pub(super) struct Builder<'a> {
    recipe: Recipe<'a>,
    /// Half the area of the root.
    whole: f32,
}

/// What is built over some references.
pub(super) struct Tree {
    pub bounds: Box4,
    pub root: Child,
    /// In depth-first order; leaves are numbered by their places among the references.
    pub nodes: Vec<Node>,
}

/// Builds over the first `count` references of `space`.
pub(super) fn build(space: &mut [Reference], count: usize, recipe: Recipe) -> Bvh {
    let builder = Builder::new(recipe, &Summary::of(&space[..count]).bounds);
    let built = builder.large(space, count, 0, 1);
    let (bounds, mut root) = (built.bounds, built.root);
    let mut nodes = built.nodes();
    if recipe.reinsert && !nodes.is_empty() {
        nodes = reinsert(&nodes);
    }
    // Now the gaps between the leaves are closed.
    let mut order = Vec::with_capacity(count);
    let mut closed = |child: &mut Child| {
        if let Child::Leaf { first, count } = child {
            let place = *first as usize;
            *first = order.len() as u32;
            order.extend(space[place..][..*count as usize].iter().map(Reference::primitive));
        }
    };
    if nodes.is_empty() {
        closed(&mut root);
    }
    nodes.iter_mut().flat_map(|node| &mut node.children).for_each(closed);
    if order.len() > count {
        order = share_leaves(&mut nodes, order, count);
    }
    Bvh::new(root, nodes, order, bounds.aabb())
}

/// A subtree, in pieces that were built side by side.
struct Built {
    bounds: Box4,
    root: Child,
    pieces: Vec<Piece>,
}

/// Nodes that lie together; they number each other from the first on.
struct Piece {
    /// Where they begin among the nodes of the subtree.
    first: u32,
    nodes: Vec<Node>,
}

impl Built {
    fn node_count(&self) -> u32 {
        self.pieces.last().map_or(0, |last| last.first + last.nodes.len() as u32)
    }

    /// Its pieces as those of a subtree in which it begins at node `at`.
    fn behind(self, at: u32) -> impl Iterator<Item = Piece> {
        self.pieces.into_iter().map(move |piece| Piece { first: piece.first + at, ..piece })
    }

    /// All nodes in one array.
    fn nodes(mut self) -> Vec<Node> {
        if self.pieces.len() == 1 {
            return self.pieces.swap_remove(0).nodes;
        }
        let node = |index: usize| {
            let piece = &self.pieces[self.pieces.partition_point(|piece| piece.first as usize <= index) - 1];
            let node = &piece.nodes[index - piece.first as usize];
            Node { children: node.children.map(|child| renumbered(child, piece.first)), ..*node }
        };
        (0..self.node_count() as usize).into_par_iter().map(node).collect()
    }
}

fn leaf(first: usize, count: usize) -> Child {
    Child::Leaf { first: first as u32, count: count as u32 }
}

/// How the references of a node are divided: the right ones lie behind the left ones and the left side's free space.
struct Halves {
    left_count: usize,
    right_count: usize,
    /// Where the right side begins.
    middle: usize,
}

impl<'a> Builder<'a> {
    /// For a tree over references in these bounds.
    pub fn new(recipe: Recipe<'a>, bounds: &Box4) -> Self {
        Self { recipe, whole: bounds.half_area() }
    }

    /// Builds over references without free space; no node is at a level before `depth`.
    pub fn tree(&self, references: &mut [Reference], depth: u32) -> Tree {
        let built = self.large(references, references.len(), 0, depth);
        Tree { bounds: built.bounds, root: built.root, nodes: built.nodes() }
    }

    /// Builds the subtree over the first `count` references of `space`, whose place in the whole is `first`, in parallel.
    fn large(&self, space: &mut [Reference], count: usize, first: usize, depth: u32) -> Built {
        if count <= PARALLEL {
            let mut nodes = Vec::new();
            let (bounds, root) = self.subtree(space, count, first, depth, &mut nodes);
            let pieces = if nodes.is_empty() { Vec::new() } else { vec![Piece { first: 0, nodes }] };
            return Built { bounds, root, pieces };
        }
        let (bounds, halves) = self.halves(space, count, depth);
        let Halves { left_count, right_count, middle } = match halves {
            Ok(halves) => halves,
            Err(count) => return Built { bounds, root: leaf(first, count), pieces: Vec::new() },
        };
        let (left, right) = space.split_at_mut(middle);
        let (left, right) = rayon::join(
            || self.large(left, left_count, first, depth + 1),
            || self.large(right, right_count, first + middle, depth + 1),
        );
        let behind_left = 1 + left.node_count();
        let node = Node {
            bounds: [left.bounds.aabb(), right.bounds.aabb()],
            children: [renumbered(left.root, 1), renumbered(right.root, behind_left)],
        };
        let own = Piece { first: 0, nodes: vec![node] };
        let pieces = std::iter::once(own).chain(left.behind(1)).chain(right.behind(behind_left)).collect();
        Built { bounds, root: Child::Node(0), pieces }
    }

    /// Builds the subtree over the first `count` references of `space`, whose place in the whole is `first`, and appends
    /// its nodes.
    fn subtree(
        &self,
        space: &mut [Reference],
        count: usize,
        first: usize,
        depth: u32,
        nodes: &mut Vec<Node>,
    ) -> (Box4, Child) {
        let (bounds, halves) = self.halves(space, count, depth);
        let Halves { left_count, right_count, middle } = match halves {
            Ok(halves) => halves,
            Err(count) => return (bounds, leaf(first, count)),
        };
        let (left, right) = space.split_at_mut(middle);
        let own = nodes.len();
        // Its children are written once they are known.
        nodes.push(Node::NOTHING);
        let left = self.subtree(left, left_count, first, depth + 1, nodes);
        let right = self.subtree(right, right_count, first + middle, depth + 1, nodes);
        nodes[own] = Node { bounds: [left.0.aabb(), right.0.aabb()], children: [left.1, right.1] };
        (bounds, Child::Node(own as u32))
    }

    /// Divides a node's references, the first `count` of `space`; or leaves them as a leaf's.
    fn halves(&self, space: &mut [Reference], count: usize, depth: u32) -> (Box4, Result<Halves, usize>) {
        let summary = Summary::of(&space[..count]);
        let Some((left_count, count)) = self.split(space, count, &summary, depth) else {
            return (summary.bounds, Err(count));
        };
        let right_count = count - left_count;
        // The right side's references move behind the left side's free space.
        let left_free = left_share(&space[..count], left_count, space.len() - count);
        let moved = left_free.min(right_count);
        space.copy_within(left_count..left_count + moved, left_count + left_free + right_count - moved);
        (summary.bounds, Ok(Halves { left_count, right_count, middle: left_count + left_free }))
    }

    /// Partitions the first `count` references and returns how many go left and how many there are now, or `None` for a
    /// leaf.
    fn split(&self, space: &mut [Reference], count: usize, summary: &Summary, depth: u32) -> Option<(usize, usize)> {
        let Summary { bounds, centers, empty_area } = summary;
        let Recipe { smallest, leaf, .. } = self.recipe;
        if count <= smallest {
            return None;
        }
        // Halving from here on would just fit: no more choice.
        let levels_needed = |count: usize| usize::BITS - (count - 1).leading_zeros();
        if depth + levels_needed(count) >= MAX_TREE_DEPTH {
            return (count > leaf).then(|| (halve(&mut space[..count], centers), count));
        }
        let references = &space[..count];
        let object = object_split::cheapest(references, centers);
        let spatial = self.recipe.spatial.and_then(|(triangles, overlap)| {
            let worthwhile = *empty_area > EMPTY * bounds.half_area()
                && object.is_none_or(|object| object.overlap > overlap * self.whole)
                && space.len() > count
                && depth + levels_needed(space.len()) < MAX_TREE_DEPTH;
            let split = worthwhile.then(|| spatial_split::cheapest(references, bounds, triangles)).flatten()?;
            let best_object = object.map_or(f32::INFINITY, |object| object.cost);
            (split.cost < best_object && split.cut <= space.len() - count).then_some((split, triangles))
        });
        let split_cost = spatial.map(|(split, _)| split.cost).or(object.map(|object| object.cost));
        let split_cost = split_cost.map(|cost| VISIT_COST + cost / bounds.half_area().max(f32::MIN_POSITIVE));
        if count <= leaf && split_cost.is_none_or(|cost| count as f32 <= cost) {
            return None;
        }
        if let Some((split, triangles)) = spatial {
            let (left, total) = split.partition(space, count, triangles);
            // Rounding may have put all on one side.
            if left > 0 && left < total {
                return Some((left, total));
            }
        }
        let references = &mut space[..count];
        let left = object.map_or(0, |object| object.partition(references));
        Some((if left == 0 || left == count { halve(references, centers) } else { left }, count))
    }
}

/// How much of the free space the left side gets: in proportion to what splits of space could save on each side.
fn left_share(references: &[Reference], left_count: usize, free: usize) -> usize {
    if free == 0 {
        return 0;
    }
    let empty = |references: &[Reference]| references.iter().map(Reference::empty_area).sum::<f32>();
    let (left, right) = references.split_at(left_count);
    let (left, right) = (empty(left), empty(right));
    if left + right > 0.0 {
        (free as f32 * (left / (left + right))) as usize
    } else {
        0
    }
}

/// Halves by the centres along their longest axis.
fn halve(references: &mut [Reference], centers: &Box4) -> usize {
    let size = centers.hi - centers.lo;
    let axis = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    let middle = references.len() / 2;
    let key = |reference: &Reference| reference.doubled_center()[axis];
    references.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)).then(a.primitive().cmp(&b.primitive())));
    middle
}

/// The child with its node's number moved by `at`.
fn renumbered(child: Child, at: u32) -> Child {
    match child {
        Child::Node(index) => Child::Node(index + at),
        leaf => leaf,
    }
}
