//! Faults in the data of accessors that leave the picture's meaning intact: each is a warning.

use super::accessor::Elements;
use super::Document;
use ::gltf::json::mesh::{Primitive, Semantic};
use ::gltf::json::validation::Checked;
use std::collections::BTreeMap;

/// Most numbers that are checked: beyond that a check would take longer than the picture.
const MOST_CHECKED: u64 = 1 << 28;
/// How far the length of a direction or a rotation may be from 1. Those of 8 bits miss it by less.
const NEARLY: f32 = 0.02;

/// What the numbers of an accessor are.
#[derive(Clone, Copy, PartialEq)]
enum Role {
    /// Directions of length 1.
    Directions,
    /// Directions of length 1, and signs.
    Tangents,
    /// Times of keys.
    Times,
    /// Rotations; of every `1` or `3` elements the middle one.
    Rotations(usize),
}

impl Role {
    /// What is wrong with numbers that have this role.
    fn fault(self, Elements { components, values }: &Elements<f32>) -> Option<String> {
        let length = |own: &[f32]| own.iter().map(|value| value * value).sum::<f32>().sqrt();
        let bad_length = |own: &&[f32]| (length(own) - 1.0).abs() > NEARLY;
        let mut elements = values.chunks_exact(*components);
        match (self, *components) {
            (Role::Directions, 3) => {
                elements.find(bad_length).map(|own| format!("a normal has length {}, not 1", length(own)))
            }
            (Role::Tangents, 4) => elements.find_map(|own| match own[3].abs() == 1.0 {
                true if !bad_length(&&own[..3]) => None,
                true => Some(format!("a tangent has length {}, not 1", length(&own[..3]))),
                false => Some(format!("a tangent has the sign {}, not 1 or -1", own[3])),
            }),
            (Role::Rotations(step), 4) => {
                let found = elements.skip(step / 2).step_by(step).find(bad_length);
                found.map(|own| format!("a rotation has length {}, not 1", length(own)))
            }
            (Role::Times, 1) => {
                let falls = values.windows(2).find(|pair| pair[0] >= pair[1]);
                let falls = falls.map(|pair| format!("the time {} comes after {}", pair[1], pair[0]));
                let negative = values.first().filter(|first| **first < 0.0);
                negative.map(|first| format!("the time {first} is negative")).or(falls)
            }
            _ => None,
        }
    }
}

fn attribute(primitive: &Primitive, semantic: Semantic) -> Option<usize> {
    primitive.attributes.get(&Checked::Valid(semantic)).map(|accessor| accessor.value())
}

impl Document<'_> {
    /// Warns of accessors whose data do not keep to their min and max, are not finite, or are not what they are used for.
    pub fn check_data(&mut self) {
        let mut left = MOST_CHECKED.min(self.most_numbers);
        let mut faults = Vec::new();
        let roles = self.roles();
        for index in 0..self.root.accessors.len() {
            if self.is_worth(index, &mut left) {
                faults.extend(self.data_fault(index));
                let own = roles.get(&index).and_then(|role| role.fault(&self.glance(index, true)?));
                faults.extend(own.map(|fault| format!("accessors[{index}]: {fault}")));
            }
        }
        let joints = self.fewest_joints();
        for (mesh, own) in self.root.meshes.iter().enumerate() {
            for (part, primitive) in own.primitives.iter().enumerate() {
                let fault = self.influence_fault(primitive, joints.get(&mesh).copied(), &mut left);
                faults.extend(fault.map(|fault| format!("meshes[{mesh}].primitives[{part}]: {fault}")));
            }
        }
        faults.into_iter().for_each(|fault| self.warnings.add(fault));
    }

    /// An accessor has data and is not too much to be checked.
    fn is_worth(&self, index: usize, left: &mut u64) -> bool {
        let accessor = &self.root.accessors[index];
        let rest = left.checked_sub(self.numbers(index));
        *left = rest.unwrap_or(0);
        rest.is_some() && (accessor.buffer_view.is_some() || accessor.sparse.is_some())
    }

    fn roles(&self) -> BTreeMap<usize, Role> {
        let mut roles = BTreeMap::new();
        for primitive in self.root.meshes.iter().flat_map(|mesh| &mesh.primitives) {
            roles.extend(attribute(primitive, Semantic::Normals).map(|accessor| (accessor, Role::Directions)));
            roles.extend(attribute(primitive, Semantic::Tangents).map(|accessor| (accessor, Role::Tangents)));
        }
        for animation in &self.animations {
            for (path, cubic, input, output) in animation.uses() {
                roles.insert(input, Role::Times);
                if path == "rotation" {
                    roles.insert(output, Role::Rotations(if cubic { 3 } else { 1 }));
                }
            }
        }
        roles.retain(|accessor, _| *accessor < self.root.accessors.len());
        roles
    }

    fn data_fault(&self, index: usize) -> Option<String> {
        let accessor = &self.root.accessors[index];
        let Elements { components, values } = self.glance(index, false)?;
        if let Some(bad) = values.iter().find(|value| !value.is_finite()) {
            return Some(format!("accessors[{index}]: its data contain {bad}"));
        }
        for (name, declared, pick) in
            [("min", &accessor.min, f32::min as fn(f32, f32) -> f32), ("max", &accessor.max, f32::max)]
        {
            let Some(declared) = declared.as_ref().and_then(|bounds| bounds.as_array()) else { continue };
            for (component, declared) in declared.iter().enumerate().take(components) {
                let own = values.iter().skip(component).step_by(components).copied().reduce(pick)?;
                let declared = declared.as_f64()? as f32;
                if own != declared {
                    return Some(format!(
                        "accessors[{index}].{name}[{component}] is {declared}, but its data say {own}"
                    ));
                }
            }
        }
        None
    }

    /// For each mesh that some node has with a skin the joints of the smallest such skin.
    fn fewest_joints(&self) -> BTreeMap<usize, usize> {
        let mut fewest = BTreeMap::new();
        for (mesh, skin) in self.root.nodes.iter().filter_map(|node| node.mesh.zip(node.skin)) {
            let joints = self.skins.get(skin.value()).map_or(0, |skin| skin.joints.len());
            fewest.entry(mesh.value()).and_modify(|least: &mut usize| *least = joints.min(*least)).or_insert(joints);
        }
        fewest
    }

    /// What is wrong with the joints and weights of a primitive.
    fn influence_fault(&self, primitive: &Primitive, joints: Option<usize>, left: &mut u64) -> Option<String> {
        let mut all: Vec<Vec<(u32, f32)>> = Vec::new();
        for set in 0.. {
            let pair = attribute(primitive, Semantic::Joints(set)).zip(attribute(primitive, Semantic::Weights(set)));
            let Some((joints, weights)) =
                pair.filter(|pair| self.is_worth(pair.0, left) && self.is_worth(pair.1, left))
            else {
                break;
            };
            let (joints, weights) = (self.glance(joints, false)?, self.glance(weights, true)?);
            let pairs = joints.values.iter().map(|joint| *joint as u32).zip(weights.values);
            let pairs: Vec<(u32, f32)> = pairs.collect();
            all.resize_with(all.len().max(pairs.len() / 4), Vec::new);
            all.iter_mut().zip(pairs.chunks_exact(4)).for_each(|(own, four)| own.extend(four));
        }
        for mut own in all {
            own.retain(|(_, weight)| *weight != 0.0);
            own.sort_unstable_by_key(|(joint, _)| *joint);
            if let Some((joint, weight)) = own.iter().find(|(_, weight)| *weight < 0.0) {
                return Some(format!("joint {joint} has the negative weight {weight}"));
            }
            if let Some(twice) = own.windows(2).find(|pair| pair[0].0 == pair[1].0) {
                return Some(format!("joint {} moves a vertex twice", twice[0].0));
            }
            let beyond = own.last().filter(|(joint, _)| joints.is_some_and(|joints| *joint as usize >= joints));
            if let Some((joint, _)) = beyond {
                return Some(format!("there is no joint {joint} in a skin that it is shown with"));
            }
        }
        None
    }
}
