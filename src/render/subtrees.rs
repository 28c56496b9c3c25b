//! The tree in pieces, for rays that meet more than one dispatch may walk through: Mesa 22.3 ends all loops of a subgroup after 65 535 rounds.

use super::tree::Tree;
use crate::bvh::{reference, Bvh, Child};
use crate::layout::LEAF_IS_INSTANCE;
use crate::scene::Soup;

/// Rounds of loops that no driver cuts short.
const MOST_ROUNDS: u64 = 60_000;
/// Rays that such a driver runs side by side at most.
const LANES: u64 = 16;
/// Rounds on the way into an instance and back.
const IN_AND_OUT: u64 = 2;

/// A part of the tree, as kernels refer to it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Subtree {
    /// Reference of a node or a leaf of the tree that rays enter first.
    pub root: u32,
    /// Where that is an instance, the reference of the only part of its own tree that is meant; 0 for all of it, which no part of it is called.
    pub below: u32,
}

impl Tree {
    /// Subtrees that together are the tree, each small enough that no walk through it is cut short.
    pub(super) fn in_parts(&self, soup: &Soup) -> Vec<Subtree> {
        self.in_parts_of(MOST_ROUNDS, soup)
    }

    /// As [`Tree::in_parts`], of so many rounds each, or of one leaf.
    fn in_parts_of(&self, most: u64, soup: &Soup) -> Vec<Subtree> {
        let in_world = |root: u32| Subtree { root, below: 0 };
        let Some(upper) = &self.upper else {
            let whole = self.parts.iter().map(|part| Pieces::of(&part.bvh, rounds_of_leaf));
            return whole.flat_map(|pieces| pieces.references(most, 0, 0)).map(in_world).collect();
        };
        // Where each part's nodes and triangles begin on the device.
        let (mut first_node, mut first_primitive) = (upper.wide.nodes.len() as u32, 0);
        let mut lower = Vec::new();
        for part in &self.parts {
            let pieces = Pieces::of(&part.bvh, rounds_of_leaf);
            let small = pieces.references(most.saturating_sub(IN_AND_OUT), first_node, first_primitive);
            lower.push((IN_AND_OUT + pieces.all(), small));
            first_node += part.bvh.wide.nodes.len() as u32;
            first_primitive += part.bvh.order.len() as u32;
        }
        let part_of = |first: u32| soup.placements[upper.order[first as usize] as usize].part;
        let pieces = Pieces::of(upper, |first, _| lower[part_of(first)].0);
        let instance = |first: u32| !(first << 4 | LEAF_IS_INSTANCE);
        let subtrees = pieces.list(most).into_iter().flat_map(|(child, rounds)| match child {
            Child::Node(node) => vec![in_world(node)],
            Child::Leaf { first, .. } if rounds <= most => vec![in_world(instance(first))],
            Child::Leaf { first, .. } => {
                let parts = lower[part_of(first)].1.iter();
                parts.map(|below| Subtree { root: instance(first), below: *below }).collect()
            }
        });
        subtrees.collect()
    }
}

/// Rounds in a leaf of triangles: one for it and, as each ray of a subgroup may be in another, one for each triangle and ray.
fn rounds_of_leaf(_first: u32, count: u32) -> u64 {
    1 + u64::from(count) * LANES
}

/// A tree with the rounds that a walk through any part of it takes at most.
struct Pieces<'a, F> {
    bvh: &'a Bvh,
    rounds_of_leaf: F,
    /// By wide node.
    rounds: Vec<u64>,
}

impl<'a, F: Fn(u32, u32) -> u64> Pieces<'a, F> {
    fn of(bvh: &'a Bvh, rounds_of_leaf: F) -> Self {
        let mut pieces = Self { bvh, rounds_of_leaf, rounds: vec![0; bvh.wide.nodes.len()] };
        // Nodes come before what is below them.
        for index in (0..pieces.rounds.len()).rev() {
            pieces.rounds[index] = 1 + pieces.children(index).map(|child| pieces.rounds(child)).sum::<u64>();
        }
        pieces
    }

    fn children(&self, index: usize) -> impl Iterator<Item = Child> + '_ {
        self.bvh.wide.nodes[index].iter().flatten().map(|wide| wide.child)
    }

    fn rounds(&self, child: Child) -> u64 {
        match child {
            Child::Node(index) => self.rounds[index as usize],
            Child::Leaf { first, count } => (self.rounds_of_leaf)(first, count),
        }
    }

    /// Rounds in the whole tree.
    fn all(&self) -> u64 {
        self.rounds[0]
    }

    /// The largest parts of at most so many rounds, and leaves, with their rounds.
    fn list(&self, most: u64) -> Vec<(Child, u64)> {
        let mut parts = Vec::new();
        let mut open = vec![Child::Node(0)];
        while let Some(child) = open.pop() {
            match child {
                Child::Node(index) if self.rounds(child) > most => open.extend(self.children(index as usize)),
                _ => parts.push((child, self.rounds(child))),
            }
        }
        parts
    }

    /// References to them, on a device where the tree's nodes and primitives begin there.
    fn references(&self, most: u64, first_node: u32, first_primitive: u32) -> Vec<u32> {
        self.list(most).into_iter().map(|(child, _)| reference(child, first_node, first_primitive)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::DeviceNode;
    use crate::layout::Instance;
    use crate::render::{Options, Prepared};
    use crate::scene::{built_in, Instancing};
    use glam::{DMat4, DVec3};

    /// What of the device's tree lies below a reference, leaf by leaf, with the instance it is in, and the rounds at most.
    fn leaves_below(nodes: &[DeviceNode], instances: &[Instance], subtree: Subtree) -> (Vec<(u32, u32)>, u64) {
        let (mut leaves, mut rounds) = (Vec::new(), 0);
        let mut open = vec![(subtree.root, 0)];
        while let Some((reference, instance)) = open.pop() {
            rounds += 1;
            let leaf = !reference;
            if reference >> 31 == 0 {
                let present = |child: &&u32| **child != !0;
                open.extend(nodes[reference as usize][3].iter().filter(present).map(|child| (*child, instance)));
            } else if leaf & 15 == LEAF_IS_INSTANCE {
                rounds += 1;
                let all = instances[(leaf >> 4) as usize].root;
                open.push((if subtree.below != 0 { subtree.below } else { all }, leaf));
            } else {
                rounds += u64::from(leaf & 15) * LANES;
                leaves.push((instance, reference));
            }
        }
        (leaves, rounds)
    }

    #[test]
    fn parts_are_together_the_tree_and_none_too_long() {
        let mut scene = built_in("table").unwrap();
        let moved = |it: &crate::scene::Instance| crate::scene::Instance {
            world_from_object: DMat4::from_translation(DVec3::Y) * it.world_from_object,
            ..*it
        };
        let copies: Vec<_> = scene.instances.iter().map(moved).collect();
        scene.instances.extend(copies);
        for instancing in [Instancing::Flat, Instancing::Shared] {
            let options = Options { instancing, ..Options::default() };
            let prepared = Prepared::new(&scene, &options).unwrap();
            let tree = prepared.tree(&options);
            assert_eq!(tree.upper.is_some(), instancing == Instancing::Shared);
            let device = tree.for_device(&prepared.soup, DVec3::ZERO);
            let (mut whole, _) = leaves_below(&device.nodes, &device.instances, Subtree::default());
            whole.sort_unstable();
            for most in (0..24).map(|power| 1 << power).chain([u64::MAX]) {
                let parts = tree.in_parts_of(most, &prepared.soup);
                let mut together = Vec::new();
                for part in &parts {
                    let (leaves, rounds) = leaves_below(&device.nodes, &device.instances, *part);
                    assert!(rounds <= most || leaves.len() == 1, "{instancing:?} {part:?}: {rounds} of {most} rounds");
                    together.extend(leaves);
                }
                together.sort_unstable();
                assert!(together == whole, "{instancing:?}: {} parts of {most} are not the tree", parts.len());
                assert!(most < u64::MAX || parts == [Subtree::default()]);
                assert!(most > 2_000 || parts.len() > 20, "{instancing:?}: {} parts of {most}", parts.len());
            }
        }
    }
}
