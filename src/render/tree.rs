//! A soup's tree in the device's world.

use crate::bvh::{Bvh, Quality};
use crate::layout::{Features, STACK_REGISTERS};
use crate::scene::Soup;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// A tree over a soup.
pub struct Tree {
    /// The tree.
    pub bvh: Bvh,
    /// Origin of the device's world, in world space: the soup's centre.
    pub center: DVec3,
    /// How it was built.
    pub quality: Quality,
}

impl Tree {
    /// Builds the tree over a soup.
    pub fn build(soup: &Soup, quality: Quality) -> Self {
        let center = soup.center();
        let local = |corners: &[DVec3; 3]| corners.map(|corner| (corner - center).as_vec3());
        let triangles: Vec<[Vec3; 3]> = soup.positions.par_iter().map(local).collect();
        Self { bvh: Bvh::over_triangles(&triangles, quality), center, quality }
    }

    /// The features with what the tree itself needs.
    pub fn features(&self, features: Features) -> Features {
        let deep_tree = features.deep_tree || self.bvh.stats().depth > STACK_REGISTERS;
        Features { deep_tree, ..features }
    }
}
