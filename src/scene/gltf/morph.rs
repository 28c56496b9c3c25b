//! Morph targets: what is added to a mesh's vertices, each times its weight (glTF 2.0, 3.7.2.2).

use super::Document;
use crate::error::Result;
use crate::scene::Mesh;
use ::gltf::json::mesh::Primitive;
use glam::{DVec3, Vec3};

/// What a target adds at full weight; a list is empty where the target does not change that attribute.
#[derive(Clone, Debug, Default)]
pub(super) struct Target {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    /// What is added to tangents; their signs stay.
    pub tangents: Vec<Vec3>,
}

/// Vectors plus what the targets add to them.
pub(super) fn morphed<'a>(
    base: &[Vec3],
    targets: &'a [Target],
    weights: &[f64],
    of: impl Fn(&'a Target) -> &'a [Vec3],
) -> Vec<DVec3> {
    let mut vectors: Vec<DVec3> = base.iter().map(|vector| vector.as_dvec3()).collect();
    for (target, weight) in targets.iter().zip(weights).filter(|(_, weight)| **weight != 0.0) {
        for (vector, added) in vectors.iter_mut().zip(of(target)) {
            *vector += added.as_dvec3() * *weight;
        }
    }
    vectors
}

impl Document<'_> {
    /// The targets of a primitive that has become a mesh; of normals and tangents only where that has some itself.
    pub fn targets(&self, place: &str, primitive: &Primitive, mesh: &Mesh) -> Result<Vec<Target>> {
        let (has_normals, has_tangents) = (!mesh.normals.is_empty(), !mesh.tangents.is_empty());
        let declared = primitive.targets.iter().flatten().enumerate();
        let read = |(index, target): (usize, &::gltf::json::mesh::MorphTarget)| {
            let place = format!("{place}.targets[{index}]");
            let vectors = |name: &str, accessor: Option<usize>| match accessor {
                Some(accessor) => self.vectors_of(&place, name, self.floats(accessor)?, Some(mesh.positions.len())),
                None => Ok(Vec::new()),
            };
            Ok(Target {
                positions: vectors("POSITION", target.positions.map(|accessor| accessor.value()))?,
                normals: vectors("NORMAL", target.normals.map(|accessor| accessor.value()).filter(|_| has_normals))?,
                tangents: vectors(
                    "TANGENT",
                    target.tangents.map(|accessor| accessor.value()).filter(|_| has_tangents),
                )?,
            })
        };
        declared.map(read).collect()
    }
}
