//! Tangents for normal maps on meshes that have none: MikkTSpace, as glTF demands (2.0, 3.7.2.1).

use super::{Map, Mesh};
use bevy_mikktspace::{generate_tangents, Geometry, TangentSpace};
use glam::{Vec3, Vec4};

/// A mesh as the algorithm sees it: corners of triangles.
struct Corners<'a> {
    mesh: &'a Mesh,
    /// By which coordinates the normal map is placed.
    map: &'a Map,
    tangents: Vec<[Vec4; 3]>,
}

impl Corners<'_> {
    fn vertex(&self, triangle: usize, corner: usize) -> usize {
        self.mesh.triangles[triangle][corner] as usize
    }

    fn flat_normal(&self, triangle: usize) -> Vec3 {
        let [a, b, c] = [0, 1, 2].map(|corner| self.mesh.positions[self.vertex(triangle, corner)]);
        (b - a).cross(c - a).normalize_or_zero()
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.mesh.triangles.len()
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, triangle: usize, corner: usize) -> [f32; 3] {
        self.mesh.positions[self.vertex(triangle, corner)].to_array()
    }

    fn normal(&self, triangle: usize, corner: usize) -> [f32; 3] {
        let given = self.mesh.normals.get(self.vertex(triangle, corner));
        given.copied().unwrap_or_else(|| self.flat_normal(triangle)).to_array()
    }

    fn tex_coord(&self, triangle: usize, corner: usize) -> [f32; 2] {
        let [u, v] = self.mesh.texcoords[self.vertex(triangle, corner)][self.map.texcoord].to_array().map(f64::from);
        self.map.transform.map(|row| (row[0] * u + row[1] * v + row[2]) as f32)
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, triangle: usize, corner: usize) {
        // The algorithm's v grows upward, glTF's downward: the bitangent is turned round.
        let tangent = space.map(|space| Vec4::from_array(space.tangent_encoded()) * Vec4::new(1.0, 1.0, 1.0, -1.0));
        self.tangents[triangle][corner] = tangent.unwrap_or(Vec4::X + Vec4::W);
    }
}

impl Mesh {
    /// Tangents at the corners of all triangles for a normal map; `None` without texture coordinates.
    pub fn tangents_for(&self, map: &Map) -> Option<Vec<[Vec4; 3]>> {
        if self.texcoords.is_empty() {
            return None;
        }
        let tangents = vec![[Vec4::X + Vec4::W; 3]; self.triangles.len()];
        let mut corners = Corners { mesh: self, map, tangents };
        generate_tangents(&mut corners).ok()?;
        Some(corners.tangents)
    }
}
