//! The binary tree with up to four children a node, as the kernels walk it: half as many steps, and four boxes are fetched
//! and tested while software Vulkan waits for each other's results.

use super::{Aabb, Bvh, Child, Node};

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

/// The binary tree with up to four children a node.
#[derive(Clone, Debug, Default)]
pub struct Wide {
    /// In depth-first order; node 0 is the root.
    pub nodes: Vec<WideNode>,
    /// Levels.
    pub depth: u32,
}

/// The least surface of all wide nodes at and below a binary node that becomes at most 1, 2, … children of a wide node.
type ForestCost = [f32; WIDTH - 1];

/// A leaf's.
const NO_COST: ForestCost = [0.0; WIDTH - 1];

/// Smaller subtrees are looked at by one thread.
const PARALLEL: usize = 4096;

impl Wide {
    /// Leaves those binary nodes out that make the surfaces of the rest, and so the visits of a random ray, fewest (by the
    /// dynamic programme of Ylitie, Karras and Laine, HPG 2017).
    pub(super) fn of(bvh: &Bvh) -> Self {
        let costs = bvh.forest_costs();
        let mut wide = Self { nodes: Vec::with_capacity(bvh.nodes.len() / 2), depth: 0 };
        // Binary nodes that become wide ones, with the wide child that waits for the index, and their level.
        let mut open = vec![(0, None, 1)];
        while let Some((node, parent, level)) = open.pop() {
            let index = wide.nodes.len() as u32;
            if let Some((parent, place)) = parent {
                let child: &mut Option<WideChild> = &mut wide.nodes[parent as usize][place];
                *child = child.map(|it| WideChild { child: Child::Node(index), ..it });
            }
            let children = bvh.children_of(node, &costs);
            wide.depth = wide.depth.max(level);
            for (place, child) in children.into_iter().enumerate().rev() {
                if let Some(WideChild { child: Child::Node(below), .. }) = child {
                    open.push((below, Some((index, place)), level + 1));
                }
            }
            wide.nodes.push(children);
        }
        wide
    }
}

impl Bvh {
    /// The box of a binary node's child.
    pub fn bounds_of(&self, Side { node, side }: Side) -> &Aabb {
        &self.nodes[node as usize].bounds[usize::from(side)]
    }

    fn child_of(&self, Side { node, side }: Side) -> Child {
        self.nodes[node as usize].children[usize::from(side)]
    }

    /// For each binary node.
    fn forest_costs(&self) -> Vec<ForestCost> {
        let mut costs = vec![NO_COST; self.nodes.len()];
        self.find_costs(0, &mut costs);
        costs
    }

    /// Finds the costs of a subtree, of its root first: nodes are in depth-first order.
    fn find_costs(&self, root: u32, costs: &mut [ForestCost]) {
        let Node { bounds, children } = &self.nodes[root as usize];
        let left_end = match children[1] {
            Child::Node(right) => (right - root) as usize,
            Child::Leaf { .. } => costs.len(),
        };
        let is_large = costs.len() > PARALLEL;
        let (lefts, rights) = costs.split_at_mut(left_end);
        let Some((own, lefts)) = lefts.split_first_mut() else { return };
        let below = |child: Child, costs: &mut [ForestCost]| match child {
            Child::Node(node) => {
                self.find_costs(node, costs);
                costs[0]
            }
            Child::Leaf { .. } => NO_COST,
        };
        let both = if is_large {
            rayon::join(|| below(children[0], lefts), || below(children[1], rights))
        } else {
            (below(children[0], lefts), below(children[1], rights))
        };
        own[0] = bounds[0].union(&bounds[1]).half_area() + best_split(&both.into(), WIDTH).0;
        for trees in 2..WIDTH {
            own[trees - 1] = best_split(&both.into(), trees).0.min(own[trees - 2]);
        }
    }

    /// How many of a node's so many trees its first child becomes.
    fn trees_of_first(&self, node: u32, trees: usize, costs: &[ForestCost]) -> usize {
        let both = self.nodes[node as usize].children.map(|child| match child {
            Child::Node(below) => costs[below as usize],
            Child::Leaf { .. } => NO_COST,
        });
        best_split(&both, trees).1
    }

    /// The children of a wide node over a binary one, their nodes still numbered as in the binary tree.
    fn children_of(&self, node: u32, costs: &[ForestCost]) -> WideNode {
        let mut children = [None; WIDTH];
        let mut filled = 0;
        let first = self.trees_of_first(node, WIDTH, costs);
        let mut open = vec![(Side { node, side: 1 }, WIDTH - first), (Side { node, side: 0 }, first)];
        while let Some((side, trees)) = open.pop() {
            let child = self.child_of(side);
            match child {
                Child::Leaf { count: 0, .. } => {}
                Child::Node(below) if trees > 1 => {
                    let fewer =
                        (1..trees).find(|fewer| costs[below as usize][fewer - 1] == costs[below as usize][trees - 1]);
                    match fewer {
                        Some(fewer) => open.push((side, fewer)),
                        None => {
                            let first = self.trees_of_first(below, trees, costs);
                            open.push((Side { node: below, side: 1 }, trees - first));
                            open.push((Side { node: below, side: 0 }, first));
                        }
                    }
                }
                _ => {
                    children[filled] = Some(WideChild { side, child });
                    filled += 1;
                }
            }
        }
        children
    }
}

/// The least cost of two children that together become so many trees, and how many of them the first does.
fn best_split([first, second]: &[ForestCost; 2], trees: usize) -> (f32, usize) {
    let split = |own: usize| (first[own - 1] + second[trees - own - 1], own);
    (1..trees).map(split).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default()
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

    /// Levels at and below a wide node.
    fn levels(bvh: &Bvh, node: u32) -> u32 {
        let below = bvh.wide.nodes[node as usize].iter().flatten().filter_map(|wide| match wide.child {
            Child::Node(below) => Some(levels(bvh, below)),
            Child::Leaf { .. } => None,
        });
        below.max().unwrap_or(0) + 1
    }

    /// Each primitive is below the root once, in a box that holds it, and each node is met once, after its parent.
    #[test]
    fn holds_what_the_binary_tree_holds() {
        for count in [1, 2, 3, 4, 5, 17, 1000] {
            let bvh = row(count);
            let mut seen = vec![0; bvh.wide.nodes.len()];
            let mut leaves = Vec::new();
            for (index, node) in bvh.wide.nodes.iter().enumerate() {
                assert!(count < 4 || node.iter().flatten().count() >= 2, "{count}: node {index} is nearly empty");
                for WideChild { side, child } in node.iter().flatten() {
                    match *child {
                        Child::Node(below) => {
                            assert!(below as usize > index);
                            seen[below as usize] += 1;
                            let around = |child: &WideChild| bvh.bounds_of(child.side);
                            for inner in bvh.wide.nodes[below as usize].iter().flatten().map(around) {
                                assert_eq!(bvh.bounds_of(*side).union(inner), *bvh.bounds_of(*side));
                            }
                        }
                        Child::Leaf { first, count } => leaves.extend(first..first + count),
                    }
                }
            }
            assert_eq!(bvh.wide.depth, levels(&bvh, 0));
            leaves.sort_unstable();
            assert_eq!(leaves, (0..count as u32).collect::<Vec<_>>());
            assert!(seen[1..].iter().all(|times| *times == 1) && seen[0] == 0, "{seen:?}");
        }
    }

    /// Boxes of many sizes all over a cube.
    fn cloud(count: u32) -> Bvh {
        let noise = |i: u32| (i.wrapping_mul(2_654_435_761) >> 8).wrapping_mul(0x9e37_79b1) as f32 / u32::MAX as f32;
        let at = |i: u32| Vec3::new(noise(3 * i), noise(3 * i + 1), noise(3 * i + 2));
        let boxes: Vec<Aabb> =
            (0..count).map(|i| Aabb { lo: at(i), hi: at(i) + at(i + count) * noise(i).powi(8) }).collect();
        Bvh::over_boxes(&boxes, 1)
    }

    /// Half area of all wide nodes.
    fn surface(bvh: &Bvh) -> f32 {
        let own = |node: &WideNode| {
            let boxes = node.iter().flatten().map(|child| bvh.bounds_of(child.side));
            boxes.fold(Aabb::EMPTY, |all, child| all.union(child)).half_area()
        };
        bvh.wide.nodes.iter().map(own).sum()
    }

    #[test]
    fn surfaces_are_as_small_as_was_found_and_smaller_than_with_the_largest_child_replaced() {
        let bvh = cloud(5000);
        let found = bvh.forest_costs()[0][0];
        assert!((surface(&bvh) / found - 1.0).abs() < 1e-3, "{} {found}", surface(&bvh));
        // The same, top down: the child with the largest surface gives way to its children.
        let mut greedy = 0.0;
        let mut open = vec![0];
        while let Some(node) = open.pop() {
            let [left, right] = bvh.nodes[node as usize].bounds;
            greedy += left.union(&right).half_area();
            let mut four = [0, 1].map(|side| Side { node, side }).to_vec();
            while four.len() < WIDTH {
                let is_node = |place: &usize| matches!(bvh.child_of(four[*place]), Child::Node(_));
                let area = |place: &usize| bvh.bounds_of(four[*place]).half_area();
                let Some(largest) = (0..four.len()).filter(is_node).max_by(|a, b| area(a).total_cmp(&area(b))) else {
                    break;
                };
                let Child::Node(below) = bvh.child_of(four.swap_remove(largest)) else { break };
                four.extend([0, 1].map(|side| Side { node: below, side }));
            }
            open.extend(four.into_iter().filter_map(|side| match bvh.child_of(side) {
                Child::Node(below) => Some(below),
                Child::Leaf { .. } => None,
            }));
        }
        assert!(found < 0.99 * greedy, "{found} {greedy}");
    }

    #[test]
    fn has_half_the_levels() {
        let bvh = row(1024);
        assert!(bvh.wide.depth <= bvh.depth.div_ceil(2) + 1, "{} of {}", bvh.wide.depth, bvh.depth);
        assert!(bvh.wide.nodes.len() < bvh.nodes.len() / 2);
    }
}
