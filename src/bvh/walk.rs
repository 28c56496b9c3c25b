//! The kernels' walk through a quantised tree of one level, done again on the host to be counted: what rays visit, alone and in step with others.

use super::{DeviceNode, Quantised};
use crate::layout::{GRID_MIDDLE, GRID_PARTS, GRID_REACH, REACH_EXPONENT, REACH_MASK, REACH_SHIFT};
use glam::{Vec3, Vec4};
use std::iter::Sum;
use std::ops::{Add, Range};

/// Steps of a walk, or of several.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Steps {
    /// Visits to wide nodes.
    pub nodes: u64,
    /// Tests of primitives.
    pub primitives: u64,
}

impl Add for Steps {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { nodes: self.nodes + other.nodes, primitives: self.primitives + other.primitives }
    }
}

impl Sum for Steps {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::default(), Add::add)
    }
}

impl Steps {
    /// The rounds that walks take in step, while-while (Aila and Laine, HPG 2009): all visit nodes until each has come to a leaf, then all test
    /// primitives until each has done with its own. Those that have nothing to do wait.
    pub fn in_step(walks: &[Vec<Self>]) -> Self {
        let turn = |turn: usize| {
            let turns = walks.iter().filter_map(|walk| walk.get(turn));
            turns.fold(Self::default(), |most, own| Self {
                // A loop runs at least once for those that come to it.
                nodes: most.nodes.max(own.nodes).max(1),
                primitives: most.primitives.max(own.primitives),
            })
        };
        (0..walks.iter().map(Vec::len).max().unwrap_or(0)).map(turn).sum()
    }
}

/// In place of a distance: the box is missed.
const MISSED: i32 = i32::MAX;

/// The ray as boxes need it, see `shaders/shared/traverse.glsl`.
struct GridRay {
    origin: Vec3,
    inverse: Vec3,
    reach_inverse: Vec3,
}

impl GridRay {
    fn new(tree: &Quantised, origin: Vec3, direction: Vec3) -> Self {
        let direction = Vec3::select(direction.abs().cmplt(Vec3::splat(1e-20)), Vec3::splat(1e-20), direction);
        let inverse = 1.0 / GRID_PARTS / (direction * tree.grid.scale);
        let origin = ((origin - tree.grid.origin) * tree.grid.scale - GRID_MIDDLE) * GRID_PARTS;
        Self { origin, inverse, reach_inverse: inverse.abs() * (GRID_PARTS * GRID_REACH) }
    }

    /// Distances at which a node's children are entered, as integers, or `MISSED`, and the children's references: the nearest first.
    fn visit(&self, node: &DeviceNode, t_max: f32) -> [(i32, i32); 4] {
        let [boxes @ .., references] = node;
        let (mut near, mut far) = ([i32::MIN; 4], [t_max.to_bits() as i32; 4]);
        for (axis, words) in boxes.iter().enumerate() {
            let middles = Vec4::from(words.map(|word| word as i32 as f32));
            let reaches = words.map(|word| f32::from_bits((word << REACH_SHIFT & REACH_MASK) | REACH_EXPONENT));
            let middles = (middles - self.origin[axis]) * self.inverse[axis];
            let reaches = Vec4::from(reaches) * self.reach_inverse[axis];
            for (child, (lower, upper)) in
                (middles - reaches).to_array().into_iter().zip((middles + reaches).to_array()).enumerate()
            {
                near[child] = near[child].max(lower.to_bits() as i32);
                far[child] = far[child].min(upper.to_bits() as i32);
            }
        }
        let entry = |child: usize| if near[child] > far[child] { MISSED } else { near[child] };
        let mut children = [0, 1, 2, 3].map(|child| (entry(child), references[child] as i32));
        children.sort_by_key(|(entry, _)| *entry);
        children
    }
}

impl Quantised {
    /// Walks from the root for a ray, in the tree's space, up to the distance `t_max`, the nearest child first. `leaf` gets a leaf's primitives, as places in
    /// the tree's order, and t_max, which it lowers where the ray meets one; true ends the walk. The steps to each leaf and in it; the last are those
    /// after the last leaf.
    pub fn walk(
        &self,
        origin: Vec3,
        direction: Vec3,
        mut t_max: f32,
        mut leaf: impl FnMut(Range<usize>, &mut f32) -> bool,
    ) -> Vec<Steps> {
        let ray = GridRay::new(self, origin, direction);
        let (mut walk, mut turn, mut stack) = (Vec::new(), Steps::default(), vec![0]);
        while let Some(reference) = stack.pop() {
            if reference >= 0 {
                turn.nodes += 1;
                let children = ray.visit(&self.nodes[reference as usize], t_max);
                stack.extend(children.iter().rev().filter(|child| child.0 != MISSED).map(|child| child.1));
                continue;
            }
            let (first, count) = ((!reference >> 4) as usize, (!reference & 15) as usize);
            turn.primitives += count as u64;
            walk.push(std::mem::take(&mut turn));
            if leaf(first..first + count, &mut t_max) {
                return walk;
            }
        }
        walk.push(turn);
        walk
    }
}

#[cfg(test)]
mod tests {
    use super::super::{quantise, reference, Aabb, Bvh};
    use super::*;

    /// Where a ray enters a box, if it does.
    fn entered(bounds: &Aabb, origin: Vec3, direction: Vec3) -> Option<f32> {
        let (a, b) = ((bounds.lo - origin) / direction, (bounds.hi - origin) / direction);
        let (near, far) = (a.min(b).max_element(), a.max(b).min_element());
        (near <= far && far >= 0.0).then_some(near.max(0.0))
    }

    /// Boxes on hills over the unit square, `side` in a row.
    fn hills(side: u32) -> Vec<Aabb> {
        let hill = |cell: u32| {
            let (x, y) = ((cell % side) as f32 / side as f32, (cell / side) as f32 / side as f32);
            let lo = Vec3::new(x, y, 0.1 * (9.0 * x).sin() * (7.0 * y).cos());
            Aabb { lo, hi: lo + 0.9 / side as f32 }
        };
        (0..side * side).map(hill).collect()
    }

    /// What all rays from above do: from points of a grid, aslant.
    fn walk_over(boxes: &[Aabb], mut each: impl FnMut(Vec3, Vec3, Option<f32>, &[Steps])) {
        let bvh = Bvh::over_boxes(boxes, 4);
        let tree = quantise(&bvh, Vec3::splat(2.0), true, |child| reference(child, 0, 0));
        for index in 0..1024_u32 {
            let origin = Vec3::new((index % 32) as f32 / 32.0 + 0.011, (index / 32) as f32 / 32.0 + 0.007, 1.0);
            let direction = Vec3::new(0.3 * (index as f32).sin(), 0.3 * (index as f32).cos(), -1.0);
            let mut met = None;
            let walk = tree.walk(origin, direction, 10.0, |places, t_max| {
                for place in places {
                    let t = entered(&boxes[bvh.order[place] as usize], origin, direction);
                    if let Some(t) = t.filter(|t| *t < *t_max) {
                        (*t_max, met) = (t, Some(t));
                    }
                }
                false
            });
            each(origin, direction, met, &walk);
        }
    }

    #[test]
    fn walks_find_the_nearest() {
        let boxes = hills(30);
        let mut hits = 0;
        walk_over(&boxes, |origin, direction, met, _| {
            let all = boxes.iter().filter_map(|bounds| entered(bounds, origin, direction));
            assert_eq!(met, all.min_by(f32::total_cmp));
            hits += u32::from(met.is_some());
        });
        assert!((100..1024).contains(&hits), "{hits}");
    }

    /// In a column of boxes the first that a ray comes to is the first that it is tested with, and what lies behind a hit is not visited.
    #[test]
    fn walks_go_to_the_nearest_first() {
        let boxes: Vec<Aabb> = (0..64)
            .map(|floor| {
                let lo = Vec3::new(0.0, 0.0, floor as f32);
                Aabb { lo, hi: lo + Vec3::new(1.0, 1.0, 0.5) }
            })
            .collect();
        let bvh = Bvh::over_boxes(&boxes, 4);
        let tree = quantise(&bvh, Vec3::splat(100.0), true, |child| reference(child, 0, 0));
        for (z, up, first) in [(99.0, -1.0, 63), (-9.0, 1.0, 0)] {
            let mut tested = Vec::new();
            tree.walk(Vec3::new(0.4, 0.6, z), Vec3::new(0.001, 0.002, up), 200.0, |places, _| {
                tested.extend(places.map(|place| bvh.order[place]));
                true
            });
            assert!(tested.contains(&first) && tested.len() <= 4, "{tested:?}");
            // Met there, the ray leaves alone what lies behind, but for what waited on the stack beside its way.
            let mut tested = 0;
            tree.walk(Vec3::new(0.4, 0.6, z), Vec3::new(0.001, 0.002, up), 200.0, |places, t_max| {
                tested += places.len();
                *t_max = 40.0;
                false
            });
            assert!(tested < boxes.len(), "{tested}");
        }
    }

    /// What a ray asks of a tree grows as the logarithm of what the tree is over, or less.
    #[test]
    fn work_grows_no_more_than_the_logarithm() {
        let work = |side: u32| {
            let mut all = Steps::default();
            walk_over(&hills(side), |_, _, _, walk| all = all + walk.iter().copied().sum());
            (all.nodes + all.primitives) as f64
        };
        let sides = [32, 100, 316];
        for pair in sides.windows(2) {
            let logarithm = f64::from(pair[1]).ln() / f64::from(pair[0]).ln();
            let growth = work(pair[1]) / work(pair[0]);
            assert!(growth > 1.0 && growth <= logarithm, "{pair:?}: {growth} {logarithm}");
        }
    }

    #[test]
    fn rays_in_step_wait_for_the_slowest() {
        let steps = |nodes, primitives| Steps { nodes, primitives };
        let long = vec![steps(3, 2), steps(0, 4), steps(5, 0)];
        let short = vec![steps(4, 1), steps(2, 0)];
        assert_eq!(Steps::in_step(&[long.clone(), short]), steps(4 + 2 + 5, 2 + 4));
        // A leaf right after a leaf takes a round of nodes all the same.
        assert_eq!(Steps::in_step(&[long]), steps(3 + 1 + 5, 6));
        assert_eq!(Steps::in_step(&[]), Steps::default());
    }
}
