//! Which meshes are stored once, however many instances of them there are.

use super::Scene;
use glam::{DMat3, DMat4};

/// Whether instances share the triangles of their mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Instancing {
    /// Where that saves much memory: rays through shared meshes take longer.
    #[default]
    Auto,
    /// Wherever that saves any memory.
    Shared,
    /// Never: every instance has its own triangles.
    Flat,
}

/// Bytes that a triangle takes on the device: corners and its share of the tree; one of its attributes.
const TRIANGLE_BYTES: usize = 48 + 16;
const ATTRIBUTE_BYTES: usize = 48;
/// Bytes that an instance takes on the device: its transforms and its share of the upper tree.
const INSTANCE_BYTES: usize = 128 + 32;
/// Bytes that sharing must save before rays are made to pay for it.
const WORTH_SHARING: usize = 64 << 20;

/// For each mesh whether it is to be shared, where triangles have so many attributes.
pub(super) fn shared_meshes(scene: &Scene, instancing: Instancing, attributes: usize) -> Vec<bool> {
    let mut instances = vec![0_usize; scene.meshes.len()];
    let mut may_share = vec![instancing != Instancing::Flat; scene.meshes.len()];
    for instance in &scene.instances {
        instances[instance.mesh] += usize::from(!is_flat(&instance.world_from_object));
        // Positions that overflow are dropped one by one, which needs them one by one.
        let elements = instance.world_from_object.to_cols_array();
        may_share[instance.mesh] &= elements.iter().all(|element| element.abs() < 1e12);
    }
    let triangle = TRIANGLE_BYTES + ATTRIBUTE_BYTES * attributes;
    let saved = |mesh: usize| {
        let (bytes, count) = (scene.meshes[mesh].triangles.len() * triangle, instances[mesh]);
        (bytes * count).saturating_sub(bytes + count * INSTANCE_BYTES)
    };
    let all_saved: usize = (0..scene.meshes.len()).filter(|mesh| may_share[*mesh]).map(saved).sum();
    let worth = instancing == Instancing::Shared
        || (all_saved > WORTH_SHARING && all_saved > scene.triangle_count() * triangle / 2);
    (0..scene.meshes.len()).map(|mesh| worth && may_share[mesh] && instances[mesh] > 1 && saved(mesh) > 0).collect()
}

/// The transform has no volume.
pub(super) fn is_flat(world_from_object: &DMat4) -> bool {
    let determinant = DMat3::from_mat4(*world_from_object).determinant();
    determinant == 0.0 || !determinant.is_finite()
}
