//! glTF primitives → [`Mesh`]: attributes and triangles.

use super::accessor::Elements;
use super::pose::Shape;
use super::skin::Influences;
use super::Document;
use crate::error::Result;
use crate::scene::{Mesh, Scene};
use ::gltf::json::mesh::{Mode, Primitive, Semantic};
use ::gltf::json::validation::Checked;
use glam::Vec3;
use std::collections::BTreeSet;

impl Document<'_> {
    /// Adds every primitive that can be drawn, with the materials of a variant; answers, for each glTF mesh, the indices of
    /// what it became, and for each of these what can change its shape.
    pub fn add_meshes(&mut self, scene: &mut Scene, variant: Option<usize>) -> Result<(Vec<Vec<usize>>, Vec<Shape>)> {
        let default_material = scene.materials.len() - 1;
        let (mut of_mesh, mut shapes) = (Vec::new(), Vec::new());
        let skinned: BTreeSet<usize> =
            self.root.nodes.iter().filter_map(|node| node.skin.and(node.mesh)).map(|mesh| mesh.value()).collect();
        for index in 0..self.root.meshes.len() {
            let mut indices = Vec::new();
            let count = self.root.meshes[index].primitives.len();
            for part in 0..count {
                let place = format!("meshes[{index}].primitives[{part}]");
                let primitive = self.root.meshes[index].primitives[part].clone();
                let Some(mut mesh) = self.primitive(&place, &primitive)? else { continue };
                mesh.name = self.root.meshes[index].name.clone().unwrap_or(place.clone());
                let of_variant = variant.and_then(|variant| self.material_in(variant, &primitive));
                let material = of_variant.or(primitive.material.map(|material| material.value()));
                mesh.material = material.unwrap_or(default_material);
                shapes.push(self.shape(&place, &primitive, &mesh, skinned.contains(&index))?);
                indices.push(scene.meshes.len());
                scene.meshes.push(mesh);
            }
            of_mesh.push(indices);
        }
        Ok((of_mesh, shapes))
    }

    /// What can change a primitive's shape.
    fn shape(&mut self, place: &str, primitive: &Primitive, mesh: &Mesh, is_skinned: bool) -> Result<Shape> {
        let count = mesh.positions.len();
        let targets = self.targets(place, primitive, count, !mesh.normals.is_empty())?;
        let influences = if is_skinned { self.influences(place, primitive, count)? } else { Influences::default() };
        Ok(Shape { targets, influences })
    }

    /// A primitive's triangles; `None`, with a warning, when it has none.
    fn primitive(&mut self, place: &str, primitive: &Primitive) -> Result<Option<Mesh>> {
        let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(|index| index.value());
        let mode = match primitive.mode {
            Checked::Valid(mode) => mode,
            Checked::Invalid => return Err(self.refuse(format!("{place}: its mode is unknown"))),
        };
        if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            self.warnings.add("left out: points or lines, only triangles are drawn");
            return Ok(None);
        }
        let extension = |name: &str| primitive.extensions.as_ref().is_some_and(|all| all.others.contains_key(name));
        if extension("KHR_draco_mesh_compression") {
            self.warnings.add("ignored: KHR_draco_mesh_compression, the uncompressed fallback is drawn");
        }
        let Some(positions) = attribute(Semantic::Positions) else {
            self.warnings.add(format!("left out: {place} has no POSITION"));
            return Ok(None);
        };
        let positions = self.vectors(place, "POSITION", positions, None)?;
        let count = positions.len();
        let normals = attribute(Semantic::Normals).map(|index| self.vectors(place, "NORMAL", index, Some(count)));
        let colors = attribute(Semantic::Colors(0)).map(|index| self.vectors(place, "COLOR_0", index, Some(count)));
        let corners = match primitive.indices {
            Some(index) => self.indices(index.value())?,
            None => (0..count as u32).collect(),
        };
        if let Some(beyond) = corners.iter().find(|corner| **corner as usize >= count) {
            return Err(self.refuse(format!("{place}: index {beyond} lies beyond its {count} vertices")));
        }
        let triangles = triangles(mode, &corners);
        if triangles.is_empty() || (mode == Mode::Triangles && corners.len() % 3 != 0) {
            self.warnings.add(format!("dropped: {place} has {} corners, not whole triangles", corners.len()));
        }
        let (normals, colors) = (normals.transpose()?.unwrap_or_default(), colors.transpose()?.unwrap_or_default());
        let in_range = |color: &Vec3| color.cmpge(Vec3::ZERO).all() && color.cmple(Vec3::ONE).all();
        if !colors.iter().all(in_range) {
            self.warnings.add(format!("{place}: COLOR_0 has values outside 0 to 1; they were clamped"));
        }
        Ok(Some(Mesh {
            positions,
            normals,
            colors: colors.into_iter().map(|color| finite(color).clamp(Vec3::ZERO, Vec3::ONE)).collect(),
            triangles,
            ..Mesh::default()
        }))
    }

    /// An attribute of three components (or four, of which the last is dropped), `count` of them if given.
    pub fn vectors(&self, place: &str, name: &str, accessor: usize, count: Option<usize>) -> Result<Vec<Vec3>> {
        let refuse = |message: String| self.refuse(format!("{place}: {name} (accessors[{accessor}]) {message}"));
        let Elements { components, values } = self.floats(accessor)?;
        if components != 3 && !(components == 4 && name == "COLOR_0") {
            return Err(refuse(format!("has {components} components")));
        }
        let vectors: Vec<Vec3> = values.chunks_exact(components).map(Vec3::from_slice).collect();
        match count {
            Some(count) if vectors.len() != count => {
                Err(refuse(format!("has {} elements, POSITION has {count}", vectors.len())))
            }
            _ => Ok(vectors),
        }
    }
}

fn finite(v: Vec3) -> Vec3 {
    Vec3::from_array(v.to_array().map(|value| if value.is_finite() { value } else { 0.0 }))
}

/// Triangles of a list, strip or fan (glTF 2.0, 3.7.2.1); every second one of a strip is turned round.
fn triangles(mode: Mode, corners: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => corners
            .windows(3)
            .enumerate()
            .map(|(index, w)| if index % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] })
            .collect(),
        Mode::TriangleFan => corners.windows(2).skip(1).map(|w| [corners[0], w[0], w[1]]).collect(),
        _ => corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_turn_and_fans_share_their_first_corner() {
        assert_eq!(triangles(Mode::TriangleStrip, &[0, 1, 2, 3]), [[0, 1, 2], [1, 3, 2]]);
        assert_eq!(triangles(Mode::TriangleFan, &[5, 1, 2, 3]), [[5, 1, 2], [5, 2, 3]]);
        assert_eq!(triangles(Mode::Triangles, &[0, 1, 2, 3, 4]), [[0, 1, 2]]);
        assert!(triangles(Mode::TriangleFan, &[]).is_empty() && triangles(Mode::TriangleStrip, &[1]).is_empty());
    }
}
