//! A soup's tree in the device's world.

use crate::bvh::{Aabb, Bvh};
use crate::scene::Soup;
use glam::DVec3;
use rayon::prelude::*;

/// A tree over a soup.
pub struct Tree {
    /// The tree.
    pub bvh: Bvh,
    /// Origin of the device's world, in world space: the soup's centre.
    pub center: DVec3,
}

impl Tree {
    /// Builds the tree over a soup.
    pub fn build(soup: &Soup) -> Self {
        let center = soup.center();
        let corners = |corners: &[DVec3; 3]| Aabb::of(corners.map(|corner| (corner - center).as_vec3()));
        let boxes: Vec<Aabb> = soup.positions.par_iter().map(corners).collect();
        Self { bvh: Bvh::build(&boxes), center }
    }
}
