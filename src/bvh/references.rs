//! What the builder sorts into leaves: a primitive, or a part of one, and its box.

use super::Aabb;
use glam::{Vec3, Vec4};
use rayon::prelude::*;

/// A box in SIMD registers, the fourth lane meaning nothing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Box4 {
    pub lo: Vec4,
    pub hi: Vec4,
}

impl Box4 {
    pub const EMPTY: Self = Self { lo: Vec4::INFINITY, hi: Vec4::NEG_INFINITY };

    pub fn union(&self, other: &Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    pub fn intersection(&self, other: &Self) -> Self {
        Self { lo: self.lo.max(other.lo), hi: self.hi.min(other.hi) }
    }

    pub fn with_point(&self, point: Vec4) -> Self {
        Self { lo: self.lo.min(point), hi: self.hi.max(point) }
    }

    /// Half the surface; 0 when empty.
    pub fn half_area(&self) -> f32 {
        let size = (self.hi - self.lo).max(Vec4::ZERO);
        size.x * size.y + size.y * size.z + size.z * size.x
    }

    pub fn is_empty(&self) -> bool {
        self.lo.truncate().cmpgt(self.hi.truncate()).any()
    }

    pub fn aabb(&self) -> Aabb {
        Aabb { lo: self.lo.truncate(), hi: self.hi.truncate() }
    }
}

impl From<Aabb> for Box4 {
    fn from(bounds: Aabb) -> Self {
        Self { lo: bounds.lo.extend(0.0), hi: bounds.hi.extend(0.0) }
    }
}

/// Cells per unit of length along each axis; 0 where the axis has no extent.
pub(super) fn cells_per_unit(cells: usize, size: Vec4) -> Vec4 {
    let scale = Vec4::splat(cells as f32) / size;
    Vec4::select(scale.is_finite_mask() & size.cmpgt(Vec4::ZERO), scale, Vec4::ZERO)
}

/// A reference: 32 bytes, the primitive's number and its emptiness in the lanes that the box does not need.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reference {
    lo: Vec4,
    hi: Vec4,
}

impl Reference {
    pub const NONE: Self = Self { lo: Vec4::ZERO, hi: Vec4::ZERO };

    pub fn new(lo: Vec3, hi: Vec3, primitive: u32) -> Self {
        Self { lo: lo.extend(f32::from_bits(primitive)), hi: hi.extend(0.0) }
    }

    /// A triangle. Its emptiness is the share of its box's surface that it does not fill, seen along the axes.
    pub fn of_triangle([a, b, c]: &[Vec3; 3], primitive: u32) -> Self {
        let mut reference = Self::new(a.min(*b).min(*c), a.max(*b).max(*c), primitive);
        let filled = (*b - *a).cross(*c - *a).abs().element_sum();
        let box_area = reference.bounds().half_area();
        reference.hi.w = if box_area > 0.0 { (1.0 - filled / box_area).clamp(0.0, 1.0) } else { 0.0 };
        reference
    }

    /// The same primitive with another box.
    pub fn with_bounds(&self, bounds: &Box4) -> Self {
        Self { lo: bounds.lo.truncate().extend(self.lo.w), hi: bounds.hi.truncate().extend(self.hi.w) }
    }

    /// Empty surface of the box: what splits of space could save.
    pub fn empty_area(&self) -> f32 {
        self.bounds().half_area() * self.hi.w
    }

    pub fn primitive(&self) -> u32 {
        self.lo.w.to_bits()
    }

    pub fn bounds(&self) -> Box4 {
        Box4 { lo: self.lo, hi: self.hi }
    }

    /// Twice the centre: enough to compare, and exact where the centre would round.
    pub fn doubled_center(&self) -> Vec4 {
        self.lo + self.hi
    }
}

/// References of a node that are worth more than one thread, and how many each looks at.
const CHUNK: usize = 1 << 15;

/// Computes something of all references; of large nodes in chunks, which do not depend on the number of threads and are merged
/// in their order.
pub(super) fn in_chunks<T: Send>(
    references: &[Reference],
    compute: impl Fn(&[Reference]) -> T + Sync,
    merge: impl Fn(T, T) -> T,
) -> T {
    if references.len() < 2 * CHUNK {
        return compute(references);
    }
    let (first, rest) = references.split_at(CHUNK);
    let (first, rest): (T, Vec<T>) = rayon::join(|| compute(first), || rest.par_chunks(CHUNK).map(&compute).collect());
    rest.into_iter().fold(first, merge)
}

/// What lies in a node.
pub(super) struct Summary {
    /// Box around the references.
    pub bounds: Box4,
    /// Box around their doubled centres.
    pub centers: Box4,
    /// Sum of their boxes' empty surfaces.
    pub empty_area: f32,
}

impl Summary {
    const NOTHING: Self = Self { bounds: Box4::EMPTY, centers: Box4::EMPTY, empty_area: 0.0 };

    pub fn of(references: &[Reference]) -> Self {
        in_chunks(references, Self::of_chunk, |all, part| Self {
            bounds: all.bounds.union(&part.bounds),
            centers: all.centers.union(&part.centers),
            empty_area: all.empty_area + part.empty_area,
        })
    }

    fn of_chunk(references: &[Reference]) -> Self {
        let mut summary = Self::NOTHING;
        for reference in references {
            summary.bounds = summary.bounds.union(&reference.bounds());
            summary.centers = summary.centers.with_point(reference.doubled_center());
            summary.empty_area += reference.empty_area();
        }
        summary
    }
}
