//! glTF primitives → [`Mesh`]: attributes and triangles.

use super::accessor::Elements;
use super::pose::Shape;
use super::skin::Influences;
use super::{draco, short, Document};
use crate::error::Result;
use crate::scene::{Maps, Mesh, Scene};
use ::gltf::json::mesh::{Mode, Primitive};
use ::gltf::json::validation::Checked;
use glam::{Vec2, Vec3, Vec4};
use std::collections::BTreeSet;

/// Numbers that the tangents of a triangle take.
const TANGENT_NUMBERS: u64 = 12;

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
                let of_variant = variant.and_then(|variant| self.material_in(variant, &primitive));
                let material = of_variant.or(primitive.material.map(|material| material.value()));
                let material = material.unwrap_or(default_material);
                let maps = scene.materials[material].drawn_maps();
                let Some(mut mesh) = self.primitive(&place, &primitive, &maps)? else { continue };
                mesh.name = short(self.root.meshes[index].name.as_deref().unwrap_or(&place)).into_owned();
                mesh.material = material;
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
        let targets = self.targets(place, primitive, mesh)?;
        let influences =
            if is_skinned { self.influences(place, primitive, mesh.positions.len())? } else { Influences::default() };
        Ok(Shape { targets, influences })
    }

    /// A primitive's triangles, with what these maps of its material need; `None`, with a warning, when it has none.
    fn primitive(&mut self, place: &str, primitive: &Primitive, maps: &Maps) -> Result<Option<Mesh>> {
        let mode = match primitive.mode {
            Checked::Valid(mode) => mode,
            Checked::Invalid => return Err(self.refuse(format!("{place}: its mode is unknown"))),
        };
        if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            self.warnings.add("ignored: points or lines, only triangles are drawn");
            return Ok(None);
        }
        // Compressed ones are decoded to a list, whatever they were.
        let mode = if draco::is_compressed(primitive) { Mode::Triangles } else { mode };
        let Some(positions) = self.vectors(place, primitive, "POSITION", None)? else {
            self.warnings.add(format!("ignored: {place} has no POSITION"));
            return Ok(None);
        };
        let count = positions.len();
        let normals = self.vectors(place, primitive, "NORMAL", Some(count))?.unwrap_or_default();
        let colors = self.colors(place, primitive, count)?;
        let texcoords = |set: usize| match maps.list().iter().any(|(map, _)| map.is_some_and(|map| map.texcoord == set))
        {
            true => self.texcoords(place, primitive, set, count),
            false => Ok(None),
        };
        let texcoords = both_sets(texcoords(0)?, texcoords(1)?);
        if maps.any() && texcoords.is_empty() {
            self.warnings.add(format!("{place}: its material has textures, but it has no texture coordinates"));
        }
        let given = maps.normal.is_some().then(|| self.tangents(place, primitive, count)).transpose()?.flatten();
        let corners = self.corners(primitive)?.unwrap_or_else(|| (0..count as u32).collect());
        if let Some(beyond) = corners.iter().find(|corner| **corner as usize >= count) {
            return Err(self.refuse(format!("{place}: index {beyond} lies beyond its {count} vertices")));
        }
        // Of strips and fans nearly every corner becomes a triangle; a normal map adds tangents.
        let most = if mode == Mode::Triangles { corners.len() / 3 } else { corners.len() } as u64;
        self.spend_numbers(most * if maps.normal.is_some() { 3 + TANGENT_NUMBERS } else { 3 })?;
        let corner_count = corners.len();
        let triangles = triangles(mode, corners);
        if triangles.is_empty() || (mode == Mode::Triangles && corner_count % 3 != 0) {
            self.warnings.add(format!("ignored: {place} has {corner_count} corners, not whole triangles"));
        }
        let in_range = |color: &Vec4| color.cmpge(Vec4::ZERO).all() && color.cmple(Vec4::ONE).all();
        if !colors.iter().all(in_range) {
            self.warnings.add(format!("{place}: COLOR_0 has values outside 0 to 1; they were clamped"));
        }
        let tangents = given.map_or(Vec::new(), |tangents| {
            triangles.iter().map(|corners| corners.map(|corner| tangents[corner as usize])).collect()
        });
        let colors = colors.into_iter().map(|color| finite(color).clamp(Vec4::ZERO, Vec4::ONE)).collect();
        let mut mesh = Mesh { positions, normals, colors, texcoords, tangents, triangles, ..Mesh::default() };
        if let Some(map) = maps.normal.filter(|_| mesh.tangents.is_empty()) {
            mesh.tangents = mesh.tangents_for(&map).unwrap_or_default();
        }
        Ok(Some(mesh))
    }

    /// Elements of an attribute if there is one, `count` of them, of as many components as allowed.
    fn checked(
        &self,
        place: &str,
        primitive: &Primitive,
        name: &str,
        components: &[usize],
        count: usize,
    ) -> Result<Option<Elements<f32>>> {
        let Some(elements) = self.attribute(primitive, name)? else { return Ok(None) };
        let refuse = |message: String| Err(self.refuse(format!("{place}: {name} {message}")));
        if !components.contains(&elements.components) {
            return refuse(format!("has {} components", elements.components));
        }
        match elements.values.len() / elements.components {
            own if own != count => refuse(format!("has {own} elements, POSITION has {count}")),
            _ => Ok(Some(elements)),
        }
    }

    /// Colours; alpha is 1 where there is none.
    fn colors(&self, place: &str, primitive: &Primitive, count: usize) -> Result<Vec<Vec4>> {
        let Some(elements) = self.checked(place, primitive, "COLOR_0", &[3, 4], count)? else { return Ok(Vec::new()) };
        let color = |own: &[f32]| Vec4::new(own[0], own[1], own[2], own.get(3).copied().unwrap_or(1.0));
        Ok(elements.values.chunks_exact(elements.components).map(color).collect())
    }

    fn texcoords(&self, place: &str, primitive: &Primitive, set: usize, count: usize) -> Result<Option<Vec<Vec2>>> {
        let elements = self.checked(place, primitive, &format!("TEXCOORD_{set}"), &[2], count)?;
        Ok(elements.map(|elements| elements.values.chunks_exact(2).map(Vec2::from_slice).collect()))
    }

    fn tangents(&self, place: &str, primitive: &Primitive, count: usize) -> Result<Option<Vec<Vec4>>> {
        let elements = self.checked(place, primitive, "TANGENT", &[4], count)?;
        Ok(elements.map(|elements| elements.values.chunks_exact(4).map(Vec4::from_slice).collect()))
    }

    /// An attribute of three components, `count` of them if given.
    fn vectors(
        &self,
        place: &str,
        primitive: &Primitive,
        name: &str,
        count: Option<usize>,
    ) -> Result<Option<Vec<Vec3>>> {
        let elements = self.attribute(primitive, name)?;
        elements.map(|elements| self.vectors_of(place, name, elements, count)).transpose()
    }

    /// Elements of three components.
    pub fn vectors_of(
        &self,
        place: &str,
        name: &str,
        elements: Elements<f32>,
        count: Option<usize>,
    ) -> Result<Vec<Vec3>> {
        let refuse = |message: String| self.refuse(format!("{place}: {name} {message}"));
        let Elements { components, values } = elements;
        if components != 3 {
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

fn finite(v: Vec4) -> Vec4 {
    Vec4::from_array(v.to_array().map(|value| if value.is_finite() { value } else { 0.0 }))
}

/// Two sets of texture coordinates, vertex by vertex; one that is missing is 0.
fn both_sets(first: Option<Vec<Vec2>>, second: Option<Vec<Vec2>>) -> Vec<[Vec2; 2]> {
    match (first, second) {
        (None, None) => Vec::new(),
        (Some(first), None) => first.into_iter().map(|first| [first, Vec2::ZERO]).collect(),
        (None, Some(second)) => second.into_iter().map(|second| [Vec2::ZERO, second]).collect(),
        (Some(first), Some(second)) => first.into_iter().zip(second).map(|(first, second)| [first, second]).collect(),
    }
}

/// Triangles of a list, strip or fan (glTF 2.0, 3.7.2.1); every second one of a strip is turned round.
fn triangles(mode: Mode, corners: Vec<u32>) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => corners
            .windows(3)
            .enumerate()
            .map(|(index, w)| if index % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] })
            .collect(),
        Mode::TriangleFan => corners.windows(2).skip(1).map(|w| [corners[0], w[0], w[1]]).collect(),
        // The very memory where that is possible.
        _ => bytemuck::try_cast_vec(corners)
            .unwrap_or_else(|(_, corners)| corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_turn_and_fans_share_their_first_corner() {
        assert_eq!(triangles(Mode::TriangleStrip, vec![0, 1, 2, 3]), [[0, 1, 2], [1, 3, 2]]);
        assert_eq!(triangles(Mode::TriangleFan, vec![5, 1, 2, 3]), [[5, 1, 2], [5, 2, 3]]);
        assert_eq!(triangles(Mode::Triangles, vec![0, 1, 2, 3, 4, 5]), [[0, 1, 2], [3, 4, 5]]);
        assert_eq!(triangles(Mode::Triangles, vec![0, 1, 2, 3, 4]), [[0, 1, 2]]);
        assert!(triangles(Mode::TriangleFan, vec![]).is_empty() && triangles(Mode::TriangleStrip, vec![1]).is_empty());
    }
}
