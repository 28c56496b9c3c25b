//! The tree as the kernels walk it: 64 bytes a wide node, boxes on a grid of some 2¹⁸ quanta an axis over the whole scene.
//!
//! A node: its four children's boxes along x, those along y, those along z, and their references: an inner node's index, or `!(first << 4 | count)` for a
//! leaf. A box along an axis is `(middle − 2¹⁷) << 14 | reach`. As a signed integer it is the box's middle in 16384ths of a quantum, the reach being
//! a known fraction; the reach is a small float without a sign, five bits of exponent and nine of mantissa, how far the box goes to either side:
//! `2^(reach >> 9) · (1 + (reach & 511) / 512)` in 2⁻¹⁵ quanta. Small boxes thus grow by about a quantum and large ones by 1 in
//! 1024; a kernel converts one number and shifts the other, and needs no comparison to tell a box's near plane from its far one.
//! Example: `0x8000e080` reaches 2¹⁶ · (1 + 128 / 512) · 2⁻¹⁵ = 2.5 quanta to either side of 3 + 0x2080 / 16384 = 3.5078: the best there is for
//! 2 to 6.
//!
//! Boxes are rounded outward, by more than the slab test's own error: about 4e-7 of the distance to the origin of the ray in
//! quanta, so the further away a camera stands, the wider.

use super::{Aabb, Bvh, Child, WideChild, WideNode, WIDTH};
use crate::layout::{GRID_MIDDLE, GRID_PARTS, GRID_REACH, REACH_EXPONENT, REACH_MASK, REACH_SHIFT};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Largest coordinate: a box from 0 to here is one that the largest reach holds.
const LAST: f64 = 261_882.0;
/// Slab error in quanta, for each quantum between ray origin and box: five roundings of 2⁻²⁴ and a reciprocal, doubled.
const SLAB_ERROR: f64 = 9e-7;
/// Largest code of a reach.
const LAST_REACH: u32 = REACH_MASK >> REACH_SHIFT;

/// The grid: coordinate = (position − origin) · scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Position of coordinate 0.
    pub origin: Vec3,
    /// Quanta per world unit.
    pub scale: Vec3,
}

/// A wide node for the device: its children's boxes along x, y and z, and their references.
pub type DeviceNode = [[u32; WIDTH]; 4];

/// A tree for the device.
#[derive(Clone, Debug)]
pub struct Quantised {
    /// One for each wide node.
    pub nodes: Vec<DeviceNode>,
    /// Their grid.
    pub grid: Grid,
}

/// In place of a child that is not there: a leaf without triangles, in the corner of the grid where nothing is.
const NO_CHILD: [u32; 4] = [1 << 31, 1 << 31, 1 << 31, !0];

/// How far a box with this code of a reach goes to either side, quanta.
fn reach(code: u32) -> f64 {
    f64::from(GRID_REACH) * f64::from(f32::from_bits((code << REACH_SHIFT) | REACH_EXPONENT))
}

/// The code of the least reach that is not below `needed` quanta, or without `outward` of one beside it.
fn code_of(needed: f64, outward: bool) -> u32 {
    let cut = f64::MANTISSA_DIGITS - f32::MANTISSA_DIGITS + REACH_SHIFT;
    let least = reach(0);
    let round = if outward { (1 << cut) - 1 } else { 1 << (cut - 1) };
    let code = ((needed.max(least).to_bits() + round) >> cut) - (least.to_bits() >> cut);
    code.min(LAST_REACH.into()) as u32
}

/// The word of an axis along which a box lies between two coordinates: one that holds it, or without `outward` one near it.
fn axis(lower: f64, upper: f64, outward: bool) -> u32 {
    let (lower, upper) = (lower.clamp(0.0, LAST), upper.clamp(0.0, LAST));
    let (middle, half) = (0.5 * (lower + upper), 0.5 * (upper - lower));
    let mut code = code_of(half, outward);
    loop {
        let fraction = f64::from(code) / f64::from(GRID_PARTS);
        let whole = (middle - fraction).round().clamp(0.0, LAST);
        let needed = half + (whole + fraction - middle).abs();
        if !outward || code == LAST_REACH || reach(code) >= needed {
            return ((whole - f64::from(GRID_MIDDLE)) * f64::from(GRID_PARTS)) as i32 as u32 | code;
        }
        // The fraction is the code's own: the next ones differ by little.
        code = code_of(needed, true).max(code + 1);
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
    let record = |child: Option<WideChild>| {
        let Some(WideChild { side, child }) = child else { return NO_CHILD };
        let bounds = bvh.bounds_of(side);
        let margin = if outward { margin } else { 0.0 };
        let (lo, hi) = (grid.coordinate(bounds.lo) - margin, grid.coordinate(bounds.hi) + margin);
        [axis(lo.x, hi.x, outward), axis(lo.y, hi.y, outward), axis(lo.z, hi.z, outward), refer(child)]
    };
    let node = |node: &WideNode| {
        let children = node.map(record);
        [0, 1, 2, 3].map(|row| children.map(|child| child[row]))
    };
    Quantised { nodes: bvh.wide.nodes.par_iter().map(node).collect(), grid }
}

#[cfg(test)]
mod tests {
    use super::super::{Side, Wide};
    use super::*;

    /// Where an axis' word says that a box begins and ends, quanta; what the kernels do.
    fn ends(word: u32) -> (f64, f64) {
        let middle = f64::from(word as i32) / f64::from(GRID_PARTS) + f64::from(GRID_MIDDLE);
        let reach =
            f64::from(GRID_REACH) * f64::from(f32::from_bits((word << REACH_SHIFT & REACH_MASK) | REACH_EXPONENT));
        (middle - reach, middle + reach)
    }

    #[test]
    fn axes_hold_their_boxes_and_little_more() {
        assert_eq!(axis(2.0, 6.0, true), 0x8000_e080);
        assert_eq!(ends(0x8000_e080), (3.507_812_5 - 2.5, 3.507_812_5 + 2.5));
        let random = |index: u32| f64::from(index.wrapping_mul(2_654_435_769) >> 8) / f64::from(1 << 24);
        for index in 0..100_000 {
            let width = LAST * random(3 * index).powi(8);
            let lower = (LAST - width) * random(3 * index + 1);
            let word = axis(lower, lower + width, true);
            let (begin, end) = ends(word);
            assert!(begin <= lower && lower + width <= end, "{lower} + {width}: {begin} {end}");
            // The middle is off by half a quantum at most, and reaches are rounded by one part in 512.
            assert!(end - begin <= 1.002 * (width + 1.01) + 0.01, "{lower} + {width}: {begin} {end}");
            assert!(reach(word & LAST_REACH) * 2.0 == end - begin, "{word:x}");
        }
        assert!(reach(LAST_REACH) >= 0.5 * LAST + 1.0);
        // What is clamped, and what is not there.
        let (begin, end) = ends(axis(-1e9, 1e9, true));
        assert!(begin <= 0.0 && end >= LAST, "{begin} {end}");
        assert!(ends(NO_CHILD[0]).1 < 0.001);
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
            wide: Wide { nodes: vec![[wide(0), wide(1), None, None]], depth: 1 },
        };
        let quantised = quantise(&bvh, Vec3::ZERO, true, |child| reference(child, 0, 0));
        let [boxes @ .., references] = quantised.nodes[0];
        assert_eq!(references, [0xffff_ff5c, 7, 0xffff_ffff, 0xffff_ffff]);
        for along in boxes {
            assert_eq!(along[2..], [0x8000_0000; 2]);
        }
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
            for (node, [x, y, z, _]) in bvh.wide.nodes.iter().zip(&quantised.nodes) {
                for (place, child) in node.iter().flatten().enumerate() {
                    let bounds = bvh.bounds_of(child.side);
                    let [(x_lo, x_hi), (y_lo, y_hi), (z_lo, z_hi)] = [x, y, z].map(|along| ends(along[place]));
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
