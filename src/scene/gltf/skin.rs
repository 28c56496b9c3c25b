//! Skins: vertices that follow several joints at once (glTF 2.0, 3.7.3).

use super::accessor::Elements;
use super::nodes::Hierarchy;
use super::{draco, Document};
use crate::error::Result;
use ::gltf::json::mesh::{Primitive, Semantic};
use ::gltf::json::validation::Checked;
use glam::{DMat3, DMat4, DVec3, DVec4, Vec4};
use serde::Deserialize;
use serde_json::Value;

/// A skin as the file declares it.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Declared {
    pub name: String,
    pub joints: Vec<usize>,
    inverse_bind_matrices: Option<usize>,
}

/// The skins of a document; one that makes no sense has no joints.
pub(super) fn declared(root: &Value) -> Vec<Declared> {
    let skins = root.get("skins").and_then(Value::as_array);
    skins.into_iter().flatten().map(|skin| Declared::deserialize(skin).unwrap_or_default()).collect()
}

/// Joints and how a mesh lies among them.
#[derive(Debug)]
pub(super) struct Skin {
    /// Nodes.
    pub joints: Vec<usize>,
    /// From the mesh's space to each joint's, as the mesh was bound.
    joint_from_mesh: Vec<DMat4>,
}

impl Skin {
    /// From the mesh's space to world space for each joint, where nodes stand as given.
    pub fn world_from_mesh(&self, world_from_node: &[DMat4]) -> Vec<DMat4> {
        let pairs = self.joints.iter().zip(&self.joint_from_mesh);
        pairs.map(|(joint, joint_from_mesh)| world_from_node[*joint] * *joint_from_mesh).collect()
    }
}

/// Which joints move the vertices of a mesh, and how much.
#[derive(Debug, Default)]
pub(super) struct Influences {
    /// Influences of a vertex, a multiple of four.
    per_vertex: usize,
    joints: Vec<u32>,
    /// They sum to 1 at each vertex, or are all 0.
    weights: Vec<f32>,
}

impl Influences {
    /// No vertex has joints.
    pub fn is_empty(&self) -> bool {
        self.per_vertex == 0
    }

    /// The largest joint that moves anything.
    pub fn last_joint(&self) -> Option<u32> {
        let used = self.joints.iter().zip(&self.weights).filter(|(_, weight)| **weight > 0.0);
        used.map(|(joint, _)| *joint).max()
    }

    /// The weighted mean of the joints' matrices at a vertex; `None` where no joint moves it.
    pub fn blend(&self, vertex: usize, joints: &[DMat4]) -> Option<Blend> {
        let own = vertex * self.per_vertex..(vertex + 1) * self.per_vertex;
        let used = self.joints[own.clone()].iter().zip(&self.weights[own]).filter(|(_, weight)| **weight > 0.0);
        let mut matrix: Option<DMat4> = None;
        for (joint, weight) in used {
            let weighted = *joints.get(*joint as usize)? * f64::from(*weight);
            matrix = Some(matrix.map_or(weighted, |sum| sum + weighted));
        }
        matrix.map(Blend::new)
    }
}

/// What becomes of a vertex.
pub(super) struct Blend {
    matrix: DMat4,
    cofactors: DMat3,
    /// It turns shapes inside out.
    pub mirrors: bool,
}

impl Blend {
    fn new(matrix: DMat4) -> Self {
        let linear = DMat3::from_mat4(matrix);
        let cofactors = DMat3::from_cols(
            linear.y_axis.cross(linear.z_axis),
            linear.z_axis.cross(linear.x_axis),
            linear.x_axis.cross(linear.y_axis),
        );
        Self { matrix, cofactors, mirrors: linear.determinant() < 0.0 }
    }

    /// A point.
    pub fn point(&self, point: DVec3) -> DVec3 {
        self.matrix.transform_point3(point)
    }

    /// A normal, by the inverse transpose up to a positive factor: the cofactors exist for every matrix. Not of length 1.
    pub fn normal(&self, normal: DVec3) -> DVec3 {
        let turned = self.cofactors * normal;
        if self.mirrors {
            -turned
        } else {
            turned
        }
    }

    /// A tangent, which moves with the surface; a mirroring turns its bitangent round.
    pub fn tangent(&self, tangent: Vec4) -> Vec4 {
        let turned = self.matrix.transform_vector3(tangent.truncate().as_dvec3()).as_vec3();
        turned.extend(if self.mirrors { -tangent.w } else { tangent.w })
    }
}

impl Document<'_> {
    /// Warns of inverse bind matrices that are no affine transforms.
    pub fn check_bind_matrices(&mut self) {
        let accessors: Vec<usize> = self.skins.iter().filter_map(|skin| skin.inverse_bind_matrices).collect();
        for accessor in accessors {
            let is_affine = |matrix: &DMat4| matrix.row(3) == DVec4::W;
            if self.matrices(accessor).is_ok_and(|matrices| !matrices.iter().all(is_affine)) {
                self.warnings
                    .add(format!("accessors[{accessor}]: an inverse bind matrix has a last row other than 0 0 0 1"));
            }
        }
    }

    /// Reads a skin that a node of the scene uses.
    pub fn skin(&mut self, index: usize, hierarchy: &Hierarchy) -> Result<Skin> {
        let Declared { joints, inverse_bind_matrices, .. } = &self.skins[index];
        let joint_from_mesh = match inverse_bind_matrices {
            Some(accessor) => self.matrices(*accessor)?,
            None => vec![DMat4::IDENTITY; joints.len()],
        };
        if joint_from_mesh.len() < joints.len() {
            let (matrices, joints) = (joint_from_mesh.len(), joints.len());
            return Err(
                self.refuse(format!("skins[{index}] has {joints} joints, but {matrices} inverse bind matrices"))
            );
        }
        let joints = joints.clone();
        let root = joints.first().map(|joint| hierarchy.nodes[*joint].root);
        if root.is_some_and(|root| !hierarchy.is_member[root]) {
            self.warnings.add(format!("skins[{index}]: its joints do not belong to the scene that is shown"));
        }
        Ok(Skin { joints, joint_from_mesh })
    }

    /// The joints of a primitive's vertices and their weights, made to sum to 1.
    pub fn influences(&mut self, place: &str, primitive: &Primitive, count: usize) -> Result<Influences> {
        let accessor = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(|index| index.value());
        let pair = |set| accessor(Semantic::Joints(set)).zip(accessor(Semantic::Weights(set)));
        let pairs: Vec<(usize, usize)> = (0..).map_while(pair).collect();
        let per_vertex = 4 * pairs.len();
        // Before they are there: the pairs may be many, and their accessors short.
        self.spend_numbers(2 * per_vertex as u64 * count as u64)?;
        let mut influences =
            Influences { per_vertex, joints: vec![0; per_vertex * count], weights: vec![0.0; per_vertex * count] };
        for (set, (joints, weights)) in pairs.into_iter().enumerate() {
            let (own_joints, own_weights) = match self.compressed_influences(primitive, set as u32)? {
                Some(compressed) => compressed,
                None => (self.joints(joints)?, self.floats(weights)?),
            };
            if own_joints.len() != 4 * count || own_weights.components != 4 || own_weights.values.len() != 4 * count {
                let message = format!("{place}: JOINTS_{set} and WEIGHTS_{set} must be four numbers for each POSITION");
                return Err(self.refuse(message));
            }
            for vertex in 0..count {
                let (from, to) = (4 * vertex, vertex * per_vertex + 4 * set);
                influences.joints[to..to + 4].copy_from_slice(&own_joints[from..from + 4]);
                influences.weights[to..to + 4].copy_from_slice(&own_weights.values[from..from + 4]);
            }
        }
        self.normalise(place, &mut influences);
        Ok(influences)
    }

    /// Joints and weights of a compressed primitive.
    fn compressed_influences(&self, primitive: &Primitive, set: u32) -> Result<Option<(Vec<u32>, Elements<f32>)>> {
        if !draco::is_compressed(primitive) {
            return Ok(None);
        }
        let attribute = |name: &str| self.attribute(primitive, &format!("{name}_{set}"));
        let (joints, weights) = (attribute("JOINTS")?, attribute("WEIGHTS")?);
        let whole = |joints: Elements<f32>| joints.values.into_iter().map(|joint| joint as u32).collect();
        Ok(joints.map(whole).zip(weights))
    }

    /// Makes weights sum to 1 and warns where they were far from it.
    fn normalise(&mut self, place: &str, influences: &mut Influences) {
        /// Quantised weights may miss 1 by half a step each.
        const NEARLY: f32 = 0.02;
        let (mut without, mut far) = (0, 0);
        for weights in influences.weights.chunks_exact_mut(influences.per_vertex.max(1)) {
            weights
                .iter_mut()
                .filter(|weight| !(**weight > 0.0 && weight.is_finite()))
                .for_each(|weight| *weight = 0.0);
            let sum: f32 = weights.iter().sum();
            without += usize::from(sum == 0.0);
            far += usize::from(sum != 0.0 && (sum - 1.0).abs() > NEARLY);
            if sum > 0.0 {
                weights.iter_mut().for_each(|weight| *weight /= sum);
            }
        }
        if without > 0 {
            self.warnings.add(format!("{place}: {without} vertices have no weights, no joint moves them"));
        }
        if far > 0 {
            self.warnings.add(format!("{place}: the weights of {far} vertices do not sum to 1; they were made to"));
        }
    }
}
