//! Top-down building by the surface area heuristic over bins (Wald, On fast construction of SAH-based bounding volume
//! hierarchies, RT 2007): sixteen bins along each of the three axes, the cheapest of the 45 planes, or a leaf.

use super::{Aabb, Bvh, Child, Node};
use crate::layout::MAX_TREE_DEPTH;
use glam::Vec3;

const BINS: usize = 16;
/// Leaves of up to four triangles were the fastest to trace; larger ones appear only where nothing separates them.
const LEAF: usize = 4;
/// Cost of visiting a node, in triangle tests.
const VISIT_COST: f32 = 1.2;
/// Below this many primitives a subtree is built by one thread.
const PARALLEL: usize = 8192;

/// A primitive on its way to a leaf.
#[derive(Clone, Copy)]
struct Item {
    bounds: Aabb,
    primitive: u32,
}

pub(super) fn build(boxes: &[Aabb]) -> Bvh {
    let mut items: Vec<Item> =
        boxes.iter().enumerate().map(|(index, bounds)| Item { bounds: *bounds, primitive: index as u32 }).collect();
    let mut nodes = Vec::new();
    let (bounds, root) = build_subtree(&mut items, 0, 1, &mut nodes);
    if nodes.is_empty() {
        // The root is always a node, so that traversal needs no special case for small scenes.
        nodes.push(Node { bounds: [bounds; 2], children: [root, Child::Leaf { first: 0, count: 0 }] });
    }
    Bvh { nodes, order: items.iter().map(|item| item.primitive).collect(), bounds }
}

/// Builds the subtree over `items`, which come to lie in leaf order, and appends its nodes; the first item has place
/// `first` in the whole.
fn build_subtree(items: &mut [Item], first: usize, depth: u32, nodes: &mut Vec<Node>) -> (Aabb, Child) {
    let bounds = items.iter().fold(Aabb::EMPTY, |all, item| all.union(&item.bounds));
    let count = items.len();
    let Some(middle) = split(items, &bounds, depth) else {
        return (bounds, Child::Leaf { first: first as u32, count: count as u32 });
    };
    let own = nodes.len();
    nodes.push(Node { bounds: [bounds; 2], children: [Child::Leaf { first: 0, count: 0 }; 2] });
    let (left, right) = items.split_at_mut(middle);
    let (left, right) = if count > PARALLEL {
        // The right half is numbered from 0 until it is known how many nodes the left half has.
        let mut right_nodes = Vec::new();
        let (left, right) = rayon::join(
            || build_subtree(left, first, depth + 1, nodes),
            || build_subtree(right, first + middle, depth + 1, &mut right_nodes),
        );
        let at = nodes.len() as u32;
        nodes.extend(
            right_nodes.into_iter().map(|node| Node { children: node.children.map(|child| moved(child, at)), ..node }),
        );
        (left, (right.0, moved(right.1, at)))
    } else {
        (build_subtree(left, first, depth + 1, nodes), build_subtree(right, first + middle, depth + 1, nodes))
    };
    nodes[own] = Node { bounds: [left.0, right.0], children: [left.1, right.1] };
    (bounds, Child::Node(own as u32))
}

/// The child with its node's number moved by `at`.
fn moved(child: Child, at: u32) -> Child {
    match child {
        Child::Node(index) => Child::Node(index + at),
        leaf => leaf,
    }
}

/// Partitions `items` and returns where the right part begins, or `None` for a leaf.
fn split(items: &mut [Item], bounds: &Aabb, depth: u32) -> Option<usize> {
    let count = items.len();
    if count <= 1 {
        return None;
    }
    // Halving from here on would just fit: no more choice.
    let levels_needed = usize::BITS - (count - 1).leading_zeros();
    if depth + levels_needed >= MAX_TREE_DEPTH {
        return (count > LEAF).then(|| halve(items));
    }
    let centers = Aabb::of(items.iter().map(|item| item.bounds.doubled_center()));
    let Some(plane) = cheapest_plane(items, &centers) else {
        // All centres coincide.
        return (count > LEAF).then_some(count / 2);
    };
    let leaf_cost = count as f32;
    let split_cost = VISIT_COST + plane.cost / bounds.half_area().max(f32::MIN_POSITIVE);
    if count <= LEAF && leaf_cost <= split_cost {
        return None;
    }
    let middle = partition(items, |item| plane.bin_of(item) <= plane.last_left);
    if middle == 0 || middle == count {
        Some(halve(items))
    } else {
        Some(middle)
    }
}

/// Halves by the centres along their longest axis.
fn halve(items: &mut [Item]) -> usize {
    let size = {
        let centers = Aabb::of(items.iter().map(|item| item.bounds.doubled_center()));
        centers.hi - centers.lo
    };
    let axis = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    let middle = items.len() / 2;
    let key = |item: &Item| item.bounds.doubled_center()[axis];
    items.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)).then(a.primitive.cmp(&b.primitive)));
    middle
}

/// Moves the items that `is_left` to the front; the order is a function of the items alone.
fn partition(items: &mut [Item], is_left: impl Fn(&Item) -> bool) -> usize {
    let (mut left, mut right) = (0, items.len());
    while left < right {
        if is_left(&items[left]) {
            left += 1;
        } else {
            right -= 1;
            items.swap(left, right);
        }
    }
    left
}

/// Bins along an axis: bin = (doubled centre − origin) · scale.
struct Plane {
    axis: usize,
    origin: f32,
    scale: f32,
    /// The last bin of the left side.
    last_left: usize,
    /// Σ half area · count of both sides.
    cost: f32,
}

impl Plane {
    fn bin_of(&self, item: &Item) -> usize {
        let place = (item.bounds.doubled_center()[self.axis] - self.origin) * self.scale;
        (place as usize).min(BINS - 1)
    }
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Aabb,
    count: usize,
}

fn cheapest_plane(items: &[Item], centers: &Aabb) -> Option<Plane> {
    let size = centers.hi - centers.lo;
    // Just below BINS, so that the upper end falls into the last bin; infinite or NaN where the axis has no extent.
    let scale = Vec3::splat(BINS as f32 * (1.0 - 1e-6)) / size;
    let axes = (0..3).filter(|axis| size[*axis] > 0.0 && scale[*axis].is_finite());
    let mut best: Option<Plane> = None;
    for axis in axes {
        let mut plane = Plane { axis, origin: centers.lo[axis], scale: scale[axis], last_left: 0, cost: f32::INFINITY };
        let mut bins = [Bin { bounds: Aabb::EMPTY, count: 0 }; BINS];
        for item in items {
            let bin = &mut bins[plane.bin_of(item)];
            bin.bounds = bin.bounds.union(&item.bounds);
            bin.count += 1;
        }
        // Right to left: what lies right of each plane; then left to right.
        let mut right_costs = [0.0; BINS];
        let mut side = Bin { bounds: Aabb::EMPTY, count: 0 };
        for index in (1..BINS).rev() {
            side = Bin { bounds: side.bounds.union(&bins[index].bounds), count: side.count + bins[index].count };
            right_costs[index - 1] = side.bounds.half_area() * side.count as f32;
        }
        side = Bin { bounds: Aabb::EMPTY, count: 0 };
        for index in 0..BINS - 1 {
            side = Bin { bounds: side.bounds.union(&bins[index].bounds), count: side.count + bins[index].count };
            let cost = side.bounds.half_area() * side.count as f32 + right_costs[index];
            if side.count > 0 && side.count < items.len() && cost < plane.cost {
                plane.cost = cost;
                plane.last_left = index;
            }
        }
        if best.as_ref().is_none_or(|best| plane.cost < best.cost) {
            best = Some(plane);
        }
    }
    best
}
