//! KHR_draco_mesh_compression: primitives whose vertices and triangles are compressed together. Here is also where an
//! attribute is looked for, in the compressed data first.

use super::accessor::Elements;
use super::Document;
use crate::error::Result;
use ::gltf::json::accessor::ComponentType;
use ::gltf::json::mesh::Primitive;
use ::gltf::json::validation::Checked;
use draco_core::{DecodeLimits, DecoderBuffer, Mesh, MeshDecoder};
use serde_json::Value;
use std::collections::BTreeMap;
use std::rc::Rc;

/// Most triangles of one primitive: a few bytes can stand for any number of them.
const MOST_TRIANGLES: u64 = 1 << 26;

/// A primitive as the decoder leaves it.
pub(super) struct Decoded {
    corners: Vec<u32>,
    /// By their numbers in the compressed data. Integers are as they are, not normalised.
    attributes: BTreeMap<u32, Elements<f32>>,
}

/// Whether a primitive is compressed; it then consists of a list of triangles.
pub(super) fn is_compressed(primitive: &Primitive) -> bool {
    extension(primitive).is_some()
}

fn extension(primitive: &Primitive) -> Option<&Value> {
    primitive.extensions.as_ref()?.others.get("KHR_draco_mesh_compression")
}

impl Document<'_> {
    /// An attribute by its name, such as `TEXCOORD_0`; `None` when the primitive has no such one.
    pub fn attribute(&self, primitive: &Primitive, name: &str) -> Result<Option<Elements<f32>>> {
        let named = primitive.attributes.iter().find(|(semantic, _)| semantic.to_string() == name);
        let accessor = named.map(|(_, accessor)| accessor.value());
        let compressed = extension(primitive).and_then(|own| Some((own, own.get("attributes")?.get(name)?)));
        let Some((extension, number)) = compressed else {
            return accessor.map(|accessor| self.floats(accessor)).transpose();
        };
        let decoded = self.decoded(extension)?;
        let elements = number.as_u64().and_then(|number| decoded.attributes.get(&u32::try_from(number).ok()?));
        let elements = elements
            .ok_or_else(|| self.refuse(format!("{name} has number {number}, which is not in its Draco data")))?;
        self.spend_numbers(elements.values.len() as u64)?;
        let mut elements = elements.clone();
        if let Some(largest) = accessor.and_then(|accessor| self.largest(accessor)) {
            elements.values.iter_mut().for_each(|value| *value = (*value / largest).max(-1.0));
        }
        Ok(Some(elements))
    }

    /// A vertex for each corner; `None` when the vertices themselves are the corners.
    pub fn corners(&self, primitive: &Primitive) -> Result<Option<Vec<u32>>> {
        match extension(primitive) {
            Some(extension) => {
                let decoded = self.decoded(extension)?;
                self.spend_numbers(decoded.corners.len() as u64)?;
                Ok(Some(decoded.corners.clone()))
            }
            None => primitive.indices.map(|accessor| self.indices(accessor.value())).transpose(),
        }
    }

    /// What 1 is stored as, if an accessor is normalised.
    fn largest(&self, accessor: usize) -> Option<f32> {
        let accessor = self.root.accessors.get(accessor).filter(|accessor| accessor.normalized)?;
        let Checked::Valid(kind) = &accessor.component_type else { return None };
        match kind.0 {
            ComponentType::I8 => Some(127.0),
            ComponentType::U8 => Some(255.0),
            ComponentType::I16 => Some(32767.0),
            ComponentType::U16 => Some(65535.0),
            _ => None,
        }
    }

    /// The mesh that a primitive's extension names, kept until another is asked for.
    fn decoded(&self, extension: &Value) -> Result<Rc<Decoded>> {
        let view = extension.get("bufferView").and_then(Value::as_u64).unwrap_or(u64::MAX) as usize;
        if let Some((_, decoded)) = self.mesh.borrow().as_ref().filter(|(own, _)| *own == view) {
            return Ok(Rc::clone(decoded));
        }
        let bytes = self.view_bytes(view).map_err(|fault| self.refuse(fault))?;
        let decoded = decode(bytes, self.numbers_left());
        let decoded = decoded.map_err(|fault| self.refuse(format!("bufferViews[{view}]: Draco: {fault}")))?;
        let attributes: usize = decoded.attributes.values().map(|elements| elements.values.len()).sum();
        self.spend_numbers((attributes + decoded.corners.len()) as u64)?;
        let decoded = Rc::new(decoded);
        *self.mesh.borrow_mut() = Some((view, Rc::clone(&decoded)));
        Ok(decoded)
    }
}

/// Decodes a mesh of `most` numbers in all. Another's code at work on what anybody may have written: should it panic, that
/// is one more fault of the file and no end of the program.
fn decode(bytes: &[u8], most: u64) -> Result<Decoded, String> {
    std::panic::catch_unwind(|| decode_unguarded(bytes, most))
        .unwrap_or_else(|_| Err("the decoder cannot read the compressed data".into()))
}

fn decode_unguarded(bytes: &[u8], most: u64) -> Result<Decoded, String> {
    let limits = DecodeLimits::default()
        .with_max_points(most)
        .with_max_faces(MOST_TRIANGLES.min(most / 3))
        .with_max_decoded_bytes(most.saturating_mul(4));
    let mut mesh = Mesh::new();
    MeshDecoder::new()
        .decode(&mut DecoderBuffer::new(bytes).with_limits(limits), &mut mesh)
        .map_err(|error| error.to_string())?;
    let points = mesh.num_points();
    let components: usize = (0..mesh.num_attributes()).map(|i| usize::from(mesh.attribute(i).num_components())).sum();
    if (points as u64).saturating_mul(components as u64) > most {
        return Err(format!("{points} vertices are more than the document may have"));
    }
    let corners: Vec<u32> = mesh.faces().iter().flatten().map(|point| point.0).collect();
    let read = |index: i32| {
        let attribute = mesh.attribute(index);
        let components = usize::from(attribute.num_components());
        (attribute.unique_id(), Elements { components, values: attribute.read_f32s(points, components) })
    };
    Ok(Decoded { corners, attributes: (0..mesh.num_attributes()).map(read).collect() })
}
