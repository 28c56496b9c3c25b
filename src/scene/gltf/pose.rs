//! A mesh in a pose: morphed, then skinned.

use super::morph::{morphed, Target};
use super::skin::{Blend, Influences};
use crate::scene::Mesh;
use glam::{DMat4, DVec3, Vec3};
use rayon::prelude::*;

/// What can change the shape of a mesh.
#[derive(Debug, Default)]
pub(super) struct Shape {
    /// Morph targets.
    pub targets: Vec<Target>,
    /// Joints of its vertices; empty unless some node has it with a skin.
    pub influences: Influences,
}

impl Shape {
    /// The weights move vertices.
    pub fn is_morphed(&self, weights: &[f64]) -> bool {
        self.targets.iter().zip(weights).any(|(_, weight)| *weight != 0.0)
    }
}

/// A mesh with these weights of its morph targets, in its own space; with `joints`, each from the mesh's space to world space,
/// in world space. One without normals stays without. Where the joints mirror all corners of a triangle it is turned round,
/// so that its front stays outside.
pub(super) fn posed(mesh: &Mesh, shape: &Shape, weights: &[f64], joints: Option<&[DMat4]>) -> Mesh {
    let mut positions = morphed(&mesh.positions, &shape.targets, weights, |target| &target.positions);
    let mut normals = morphed(&mesh.normals, &shape.targets, weights, |target| &target.normals);
    let mut mesh = mesh.clone();
    morph_tangents(&mut mesh, shape, weights);
    if let Some(joints) = joints {
        let blend = |vertex| shape.influences.blend(vertex, joints);
        let blends: Vec<Option<Blend>> = (0..positions.len()).into_par_iter().map(blend).collect();
        for (position, blend) in positions.iter_mut().zip(&blends) {
            *position = blend.as_ref().map_or(*position, |blend| blend.point(*position));
        }
        for (normal, blend) in normals.iter_mut().zip(&blends) {
            *normal = blend.as_ref().map_or(*normal, |blend| blend.normal(*normal));
        }
        for (tangents, corners) in mesh.tangents.iter_mut().zip(&mesh.triangles) {
            for (tangent, corner) in tangents.iter_mut().zip(corners) {
                *tangent = blends[*corner as usize].as_ref().map_or(*tangent, |blend| blend.tangent(*tangent));
            }
        }
        let mirrors = |vertex: u32| blends[vertex as usize].as_ref().is_some_and(|blend| blend.mirrors);
        for (index, corners) in mesh.triangles.iter_mut().enumerate() {
            if corners.iter().all(|corner| mirrors(*corner)) {
                corners.swap(1, 2);
                if let Some(tangents) = mesh.tangents.get_mut(index) {
                    tangents.swap(1, 2);
                }
            }
        }
    }
    mesh.positions = positions.into_iter().map(DVec3::as_vec3).collect();
    mesh.normals = normals.into_iter().map(unit).collect();
    mesh
}

fn morph_tangents(mesh: &mut Mesh, shape: &Shape, weights: &[f64]) {
    for (target, weight) in shape.targets.iter().zip(weights).filter(|(_, weight)| **weight != 0.0) {
        if target.tangents.is_empty() {
            continue;
        }
        for (tangents, corners) in mesh.tangents.iter_mut().zip(&mesh.triangles) {
            for (tangent, corner) in tangents.iter_mut().zip(corners) {
                *tangent += (target.tangents[*corner as usize] * *weight as f32).extend(0.0);
            }
        }
    }
}

/// A direction of length 1; zero, which means none, where there is none.
fn unit(direction: DVec3) -> Vec3 {
    let largest = direction.abs().max_element();
    (direction / largest).try_normalize().unwrap_or(DVec3::ZERO).as_vec3()
}
