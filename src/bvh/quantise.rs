//! The tree as the kernels walk it: one 16-byte record a child, boxes as u16 on a grid over the whole scene.
//!
//! A record: `x = lo.x | lo.y << 16`, `y = lo.z | hi.x << 16`, `z = hi.y | hi.z << 16`, `w =` the child: an inner node's
//! index, or `!(first << 4 | count)` for a leaf. Example: `lo = (1, 2, 3)`, `hi = (4, 5, 6)`, leaf of 3 from 10 on:
//! `0x00020001 0x00040003 0x00060005 0xffffff5c`.
//!
//! Boxes are rounded outward, by more than the slab test's own error: about 4e-7 of the distance to the origin of the ray in
//! quanta, so the further away a camera stands, the wider.

use super::{Aabb, Bvh, Child, WideChild};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Largest coordinate.
const LAST: f64 = 65535.0;
/// Slab error in quanta, for each quantum between ray origin and box: three roundings of 2⁻²⁴ and a reciprocal, doubled.
const SLAB_ERROR: f64 = 8e-7;

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
const NO_CHILD: [u32; 4] = [0, 0, 0, !0];

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
        let round = |lower: DVec3, upper: DVec3| match outward {
            true => ((lower - margin).floor(), (upper + margin).ceil()),
            false => (lower.round(), upper.round()),
        };
        let (lo, hi) = round(grid.coordinate(bounds.lo), grid.coordinate(bounds.hi));
        let lo = lo.clamp(DVec3::ZERO, DVec3::splat(LAST)).as_uvec3();
        let hi = hi.clamp(DVec3::ZERO, DVec3::splat(LAST)).as_uvec3();
        [lo.x | lo.y << 16, lo.z | hi.x << 16, hi.y | hi.z << 16, refer(*child)]
    };
    let records = bvh.wide.nodes.par_iter().flat_map_iter(|node| node.each_ref().map(record));
    Quantised { records: records.collect(), grid }
}

#[cfg(test)]
mod tests {
    use super::super::{Side, Wide, WIDTH};
    use super::*;

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
        assert_eq!(quantised.records[2..], [[0, 0, 0, 0xffff_ffff]; 2]);
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
            let world = |coordinates: [u32; 3]| {
                DVec3::from_array(coordinates.map(f64::from)) / quantised.grid.scale.as_dvec3()
                    + quantised.grid.origin.as_dvec3()
            };
            for (node, records) in bvh.wide.nodes.iter().zip(quantised.records.chunks(WIDTH)) {
                for (child, [x, y, z, _]) in node.iter().flatten().zip(records) {
                    let bounds = bvh.bounds_of(child.side);
                    let lo = world([x & 0xffff, x >> 16, y & 0xffff]);
                    let hi = world([y >> 16, z & 0xffff, z >> 16]);
                    assert!(
                        lo.cmplt(bounds.lo.as_dvec3()).all() && hi.cmpgt(bounds.hi.as_dvec3()).all(),
                        "reach {reach}: {lo} {hi} {bounds:?}"
                    );
                }
            }
        }
    }
}
