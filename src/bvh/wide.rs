//! The binary tree with up to four children a node, as the kernels walk it: half as many steps, and four boxes are fetched
//! and tested while software Vulkan waits for each other's results.

use super::{Aabb, Bvh, Child};

/// Children of a wide node.
pub const WIDTH: usize = 4;

/// One of the two children of a binary node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Side {
    /// The binary node.
    pub node: u32,
    /// 0 or 1.
    pub side: u8,
}

/// A child of a wide node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WideChild {
    /// Where its box is, in the binary tree.
    pub side: Side,
    /// What it is; a node by its index among the wide ones.
    pub child: Child,
}

/// A wide node: children where there are any, those without primitives left out.
pub type WideNode = [Option<WideChild>; WIDTH];

impl Bvh {
    /// The box of a binary node's child.
    pub fn bounds_of(&self, Side { node, side }: Side) -> &Aabb {
        &self.nodes[node as usize].bounds[usize::from(side)]
    }

    fn child_of(&self, Side { node, side }: Side) -> Child {
        self.nodes[node as usize].children[usize::from(side)]
    }

    /// Makes the wide nodes anew, in depth-first order: in each, the child with the largest surface, which most rays would enter anyway, is
    /// replaced by its own children until there are four.
    pub(super) fn widen(&mut self) {
        let mut wide: Vec<WideNode> = Vec::with_capacity(self.nodes.len() / 2);
        // Binary nodes that become wide ones, with the wide child that waits for the index, their level and what waits on the
        // stack of a walk that comes to them.
        let mut open = vec![(0, None, 1, 0)];
        (self.wide_depth, self.wide_stack) = (0, 0);
        while let Some((node, parent, level, waiting)) = open.pop() {
            let index = wide.len() as u32;
            if let Some((parent, place)) = parent {
                let child: &mut Option<WideChild> = &mut wide[parent as usize][place];
                *child = child.map(|it| WideChild { child: Child::Node(index), ..it });
            }
            let children = self.four_below(node);
            let waiting = waiting + (children.iter().flatten().count() as u32).saturating_sub(1);
            self.wide_depth = self.wide_depth.max(level);
            self.wide_stack = self.wide_stack.max(waiting);
            for (place, child) in children.into_iter().enumerate().rev() {
                if let Some(WideChild { child: Child::Node(below), .. }) = child {
                    open.push((below, Some((index, place)), level + 1, waiting));
                }
            }
            wide.push(children);
        }
        self.wide = wide;
    }

    /// Up to four children of a wide node over a binary one, their nodes still numbered as in the binary tree.
    fn four_below(&self, node: u32) -> WideNode {
        let sides = |node| [0, 1].map(|side| Some(Side { node, side }));
        let [left, right] = sides(node);
        let mut four = [left, right, None, None];
        for free in 2..WIDTH {
            let surface = |place: &usize| four[*place].map_or(0.0, |side| self.bounds_of(side).half_area());
            let is_node =
                |place: &usize| four[*place].is_some_and(|side| matches!(self.child_of(side), Child::Node(_)));
            let largest = (0..free).filter(is_node).max_by(|a, b| surface(a).total_cmp(&surface(b)));
            let Some((place, Child::Node(below))) =
                largest.and_then(|place| Some((place, self.child_of(four[place]?))))
            else {
                break;
            };
            [four[place], four[free]] = sides(below);
        }
        let is_filled = |side: &Side| !matches!(self.child_of(*side), Child::Leaf { count: 0, .. });
        four.map(|side| side.filter(is_filled).map(|side| WideChild { side, child: self.child_of(side) }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn row(count: usize) -> Bvh {
        let boxes: Vec<Aabb> = (0..count)
            .map(|i| Aabb { lo: Vec3::X * i as f32 * 2.0, hi: Vec3::X * i as f32 * 2.0 + Vec3::ONE })
            .collect();
        Bvh::over_boxes(&boxes, 1)
    }

    /// Each primitive is below the root once, in a box that holds it, and each node is met once, after its parent.
    #[test]
    fn holds_what_the_binary_tree_holds() {
        for count in [1, 2, 3, 4, 5, 17, 1000] {
            let bvh = row(count);
            let mut seen = vec![0; bvh.wide.len()];
            let mut leaves = Vec::new();
            for (index, node) in bvh.wide.iter().enumerate() {
                assert!(count < 4 || node.iter().flatten().count() >= 2, "{count}: node {index} is nearly empty");
                for WideChild { side, child } in node.iter().flatten() {
                    match *child {
                        Child::Node(below) => {
                            assert!(below as usize > index);
                            seen[below as usize] += 1;
                            let around = |child: &WideChild| bvh.bounds_of(child.side);
                            for inner in bvh.wide[below as usize].iter().flatten().map(around) {
                                assert_eq!(bvh.bounds_of(*side).union(inner), *bvh.bounds_of(*side));
                            }
                        }
                        Child::Leaf { first, count } => leaves.extend(first..first + count),
                    }
                }
            }
            leaves.sort_unstable();
            assert_eq!(leaves, (0..count as u32).collect::<Vec<_>>());
            assert!(seen[1..].iter().all(|times| *times == 1) && seen[0] == 0, "{seen:?}");
        }
    }

    #[test]
    fn has_half_the_levels() {
        let bvh = row(1024);
        assert!(bvh.wide_depth <= bvh.depth.div_ceil(2) + 1, "{} of {}", bvh.wide_depth, bvh.depth);
        assert!(bvh.wide.len() < bvh.nodes.len() / 2);
    }
}
