//! Axis-aligned bounding boxes.

use glam::Vec3;

/// A box; empty when a side is negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Lower corner.
    pub lo: Vec3,
    /// Upper corner.
    pub hi: Vec3,
}

impl Aabb {
    /// The box of nothing.
    pub const EMPTY: Self = Self { lo: Vec3::INFINITY, hi: Vec3::NEG_INFINITY };

    /// The smallest box around points.
    pub fn of(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |all, point| Self { lo: all.lo.min(point), hi: all.hi.max(point) })
    }

    /// The smallest box around both.
    pub fn union(&self, other: &Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    /// Half the surface; 0 when empty.
    pub fn half_area(&self) -> f32 {
        let size = (self.hi - self.lo).max(Vec3::ZERO);
        size.x * size.y + size.y * size.z + size.z * size.x
    }

    /// The other box lies inside.
    pub fn contains(&self, other: &Self) -> bool {
        self.lo.cmple(other.lo).all() && self.hi.cmpge(other.hi).all()
    }
}
