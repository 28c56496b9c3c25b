//! The tree as the kernels walk it: one 16-byte record a child, boxes on a grid of 65 536 quanta an axis over the whole scene.
//!
//! A record: `x`, `y`, `z`, the box along each axis, and `w`, the child: an inner node's index, or `!(first << 4 | count)` for a
//! leaf. An axis is `(middle − 32768) << 16 | reach`: as a signed integer it is the box's middle in 65536ths of a quantum, with
//! its own lower half for a fraction, and its lower half is how many half quanta the box reaches to either side. The kernels
//! convert both to floats as they are: nothing is shifted, and a box's near and far planes need no comparison.
//! Example: from 2 to 6 quanta, reach 5 for the rounding: `(4 − 32768) << 16 | 5` is `0x80040005`, which is 4.00008 ± 2.5.
//!
//! Boxes are rounded outward, by more than the slab test's own error: about 4e-7 of the distance to the origin of the ray in
//! quanta, so the further away a camera stands, the wider.

use super::{Aabb, Bvh, Child, WideChild};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Largest coordinate.
const LAST: f64 = 65535.0;
/// Slab error in quanta, for each quantum between ray origin and box: five roundings of 2⁻²⁴ and a reciprocal, doubled.
const SLAB_ERROR: f64 = 9e-7;
/// Parts of a quantum in which middles are counted.
const PARTS: f64 = 65536.0;
/// The middle of the grid, where middles are 0.
const MIDDLE: i32 = 32768;

/// The grid: coordinate = (position − origin) · scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Position of coordinate 0.
    pub origin: Vec3,
    /// Quanta per world unit.
    pub scale: Vec3,
}

/// A tree for the device.
#[derive(Clone, Debug)]
pub struct Quantised {
    /// One for each child of a wide node, WIDTH a node.
    pub records: Vec<[u32; 4]>,
    /// Their grid.
    pub grid: Grid,
}

/// In place of a child that is not there: a leaf without triangles, in the corner of the grid where nothing is.
const NO_CHILD: [u32; 4] = [1 << 31, 1 << 31, 1 << 31, !0];

/// The word of an axis along which a box lies between two coordinates: the smallest that holds it, or without `outward` the nearest.
fn axis(lower: f64, upper: f64, outward: bool) -> u32 {
    let (lower, upper) = (lower.clamp(0.0, LAST), upper.clamp(0.0, LAST));
    let width = upper - lower;
    let mut reach = if outward { width.ceil() } else { width.round() };
    loop {
        let middle = (0.5 * (lower + upper) - reach / PARTS).round().clamp(0.0, LAST);
        let off = (middle + reach / PARTS - 0.5 * (lower + upper)).abs();
        if !outward || reach >= LAST || reach >= width + 2.0 * off {
            return ((middle as i32 - MIDDLE) << 16) as u32 | reach.min(LAST) as u32;
        }
        reach += 1.0;
    }
}

impl Grid {
    /// A grid over `bounds` with room for `margin` quanta around it.
    fn over(bounds: &Aabb, margin: f64) -> Self {
        let size = (bounds.hi - bounds.lo).max(Vec3::ZERO).as_dvec3();
        // An axis without extent still needs a scale that is finite.
        let size = size.max(DVec3::splat((size.max_element() * 1e-6).max(1e-30)));
        let inner = LAST - 2.0 * margin.min(LAST / 4.0).ceil();
        let scale = (DVec3::splat(inner) / size).as_vec3();
        let origin = (bounds.lo.as_dvec3() - DVec3::splat(margin.min(LAST / 4.0).ceil()) / scale.as_dvec3()).as_vec3();
        Self { origin, scale }
    }

    fn coordinate(&self, position: Vec3) -> DVec3 {
        (position.as_dvec3() - self.origin.as_dvec3()) * self.scale.as_dvec3()
    }
}

/// A child's reference in a tree whose nodes and primitives begin at these places of the device's arrays.
pub fn reference(child: Child, first_node: u32, first_primitive: u32) -> u32 {
    match child {
        Child::Node(index) => first_node + index,
        Child::Leaf { first, count } => !((first_primitive + first) << 4 | count),
    }
}

/// Quantises a tree for rays that start at most `reach` away from the origin (units of its boxes, per axis). `refer` makes the
/// children's references, see [`reference()`]. Without `outward` boxes are rounded to the nearest, and rays are lost.
pub fn quantise(bvh: &Bvh, reach: Vec3, outward: bool, refer: impl Fn(Child) -> u32 + Sync) -> Quantised {
    let empty = bvh.order.is_empty();
    let bounds = if empty { Aabb { lo: Vec3::ZERO, hi: Vec3::ZERO } } else { bvh.bounds };
    let far = bounds.lo.abs().max(bounds.hi.abs()).as_dvec3();
    let reach = reach.as_dvec3().max(far);
    // In quanta, as the slab test meets them: distance from the ray's origin to the far side of the grid.
    let rough = Grid::over(&bounds, 1.0);
    let margin = 0.05 + ((reach + far) * rough.scale.as_dvec3()).max_element() * SLAB_ERROR;
    let grid = Grid::over(&bounds, margin + 1.0);
    let record = |child: &Option<WideChild>| {
        let Some(WideChild { side, child }) = child else { return NO_CHILD };
        let bounds = bvh.bounds_of(*side);
        let margin = if outward { margin } else { 0.0 };
        let (lo, hi) = (grid.coordinate(bounds.lo) - margin, grid.coordinate(bounds.hi) + margin);
        [axis(lo.x, hi.x, outward), axis(lo.y, hi.y, outward), axis(lo.z, hi.z, outward), refer(*child)]
    };
    let records = bvh.wide.nodes.par_iter().flat_map_iter(|node| node.each_ref().map(record));
    Quantised { records: records.collect(), grid }
}

#[cfg(test)]
mod tests {
    use super::super::{Side, Wide, WIDTH};
    use super::*;

    /// Where an axis' word says that a box begins and ends, in quanta.
    fn ends(word: u32) -> (f64, f64) {
        let middle = f64::from(word as i32) / PARTS + f64::from(MIDDLE);
        let reach = 0.5 * f64::from(word & 0xffff);
        (middle - reach, middle + reach)
    }

    #[test]
    fn axes_hold_their_boxes_and_little_more() {
        assert_eq!(axis(2.0, 6.0, true), 0x8004_0005);
        assert_eq!(axis(2.0, 6.0, false), 0x8004_0004);
        let random = |index: u32| f64::from(index.wrapping_mul(2_654_435_769) >> 8) / f64::from(1 << 24);
        let mut spare = 0.0;
        for index in 0..10_000 {
            let width = LAST * random(3 * index).powi(8);
            let lower = (LAST - width) * random(3 * index + 1);
            let (begin, end) = ends(axis(lower, lower + width, true));
            let most = if end - begin < LAST { 2.1 } else { 2.0 * LAST };
            assert!(
                begin <= lower && lower + width <= end && end - begin <= width + most,
                "{lower} + {width}: {begin} {end}"
            );
            spare += end - begin - width;
        }
        // As much as if both ends were rounded outward: half a quantum each.
        assert!((spare / 10_000.0 - 1.0).abs() < 0.05, "{spare}");
        assert_eq!(ends(axis(-1e9, 1e9, true)), (0.499_984_741_210_937_5, 65_535.499_984_741_21));
        assert_eq!(NO_CHILD[..3].iter().map(|word| ends(*word)).collect::<Vec<_>>(), [(0.0, 0.0); 3]);
    }

    #[test]
    fn the_example_of_the_bit_layout() {
        let bounds = Aabb { lo: Vec3::ZERO, hi: Vec3::splat(60000.0) };
        let children = [Child::Leaf { first: 10, count: 3 }, Child::Node(7)];
        let wide = |side: u8| Some(WideChild { side: Side { node: 0, side }, child: children[usize::from(side)] });
        let bvh = Bvh {
            nodes: vec![super::super::Node { bounds: [bounds; 2], children }],
            order: vec![0],
            bounds,
            depth: 1,
            wide: Wide { nodes: vec![[wide(0), wide(1), None, None]], depth: 1, stack: 1 },
        };
        let quantised = quantise(&bvh, Vec3::ZERO, true, |child| reference(child, 0, 0));
        assert_eq!(quantised.records[0][3], 0xffff_ff5c);
        assert_eq!(quantised.records[1][3], 7);
        assert_eq!(quantised.records[2..], [[0x8000_0000, 0x8000_0000, 0x8000_0000, 0xffff_ffff]; 2]);
    }

    #[test]
    fn boxes_grow_outward_and_stay_on_the_grid() {
        let boxes: Vec<Aabb> = (0..500)
            .map(|i| {
                let at = Vec3::new((i * 7919 % 499) as f32, (i * 104_729 % 491) as f32, 0.25);
                Aabb { lo: at, hi: at + Vec3::new(1.0, 0.001, 0.0) }
            })
            .collect();
        let bvh = Bvh::over_boxes(&boxes, 6);
        for reach in [0.0, 1e3, 1e6, 1e9] {
            let quantised = quantise(&bvh, Vec3::splat(reach), true, |child| reference(child, 0, 0));
            let world =
                |coordinates: DVec3| coordinates / quantised.grid.scale.as_dvec3() + quantised.grid.origin.as_dvec3();
            for (node, records) in bvh.wide.nodes.iter().zip(quantised.records.chunks(WIDTH)) {
                for (child, [x, y, z, _]) in node.iter().flatten().zip(records) {
                    let bounds = bvh.bounds_of(child.side);
                    let [(x_lo, x_hi), (y_lo, y_hi), (z_lo, z_hi)] = [*x, *y, *z].map(ends);
                    let (lo, hi) = (world(DVec3::new(x_lo, y_lo, z_lo)), world(DVec3::new(x_hi, y_hi, z_hi)));
                    assert!(
                        lo.cmplt(bounds.lo.as_dvec3()).all() && hi.cmpgt(bounds.hi.as_dvec3()).all(),
                        "reach {reach}: {lo} {hi} {bounds:?}"
                    );
                }
            }
        }
    }
}
