//! New boxes for an old tree, when triangles have moved but are still the same ones.

use super::{Aabb, Bvh, Child};
use glam::Vec3;
use rayon::prelude::*;

impl Bvh {
    /// Gives every node the boxes of triangles that have moved, from the leaves up; which triangles are in which leaf stays. A
    /// triangle that spatial splits had cut lies whole in each of its leaves, so that a tree with many cuts becomes loose.
    ///
    /// # Panics
    /// When there are fewer triangles than the tree was built over.
    pub fn refit(&mut self, triangles: &[[Vec3; 3]]) {
        let boxes: Vec<Aabb> = triangles.par_iter().map(|corners| Aabb::of(*corners)).collect();
        // Around everything below each node. A node comes before what is below it.
        let mut around = vec![Aabb::EMPTY; self.nodes.len()];
        for index in (0..self.nodes.len()).rev() {
            let node = &mut self.nodes[index];
            for (bounds, child) in node.bounds.iter_mut().zip(&node.children) {
                *bounds = match *child {
                    Child::Node(below) => around[below as usize],
                    Child::Leaf { first, count } => {
                        let own = &self.order[first as usize..(first + count) as usize];
                        own.iter().fold(Aabb::EMPTY, |all, primitive| all.union(&boxes[*primitive as usize]))
                    }
                };
            }
            // What holds nothing gets its neighbour's box, as in a tree that was built.
            let [left, right] = node.bounds;
            let holds_nothing = |child: &Child| matches!(child, Child::Leaf { count: 0, .. });
            if holds_nothing(&node.children[1]) {
                node.bounds[1] = left;
            } else if holds_nothing(&node.children[0]) {
                node.bounds[0] = right;
            }
            around[index] = left.union(&right);
        }
        self.bounds = around.first().copied().unwrap_or(Aabb::EMPTY);
    }
}
