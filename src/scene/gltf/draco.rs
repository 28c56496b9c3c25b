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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::scene::gltf::tests::{bytes_of, corpus, hurt, with_document};

    /// Four vertices with a colour each and two triangles, stored in sequence and by Edgebreaker.
    const MESHES: [&str; 2] = [
        "445241434f02020100000002040100010202010301020009030000020204000100010000000000000000000000000000803f0000000000\
         000000000000000000803f000000000000803f0000803f0000003f0001010009030110012013011003009090698061c6bc5c0600000000\
         ff000000",
        "445241434f02020101000000040201020000011fff0111ff011102ff00000000000100090300000001020204000101000000000000803f\
         000000000000803f00000000000000000000803f0000803f0000003f000000000000000000000000010101000903011001101301200300\
         50914c62e6dc5c16e0bc0c0000000000ff000000",
    ];

    /// The corners' positions and colours, whatever the order of the vertices.
    fn corners(decoded: &Decoded) -> Vec<(Vec<f32>, Vec<f32>)> {
        let of = |number: u32, corner: u32| {
            let Elements { components, values } = &decoded.attributes[&number];
            values.chunks(*components).nth(corner as usize).unwrap().to_vec()
        };
        decoded.corners.iter().map(|corner| (of(0, *corner), of(1, *corner))).collect()
    }

    #[test]
    fn both_methods_give_the_mesh() {
        let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.5]];
        let colours =
            [[255.0, 0.0, 0.0, 255.0], [0.0, 255.0, 0.0, 255.0], [0.0, 0.0, 255.0, 255.0], [51.0, 102.0, 153.0, 204.0]];
        for text in MESHES {
            let decoded = decode(&bytes_of(text), 1000).unwrap();
            let own = corners(&decoded);
            assert_eq!(own.len(), 6);
            for vertex in 0..4 {
                let vertex = (positions[vertex].to_vec(), colours[vertex].to_vec());
                let times = own.iter().filter(|corner| **corner == vertex).count();
                assert_eq!(times, if vertex.0[0] + vertex.0[1] == 1.0 { 2 } else { 1 }, "{vertex:?} in {own:?}");
            }
        }
    }

    #[test]
    fn hurt_data_are_answered() {
        for text in MESHES {
            let bytes = bytes_of(text);
            // The last bytes are a transform that such attributes do not have.
            for end in 0..bytes.len() - 16 {
                assert!(decode(&bytes[..end], 1000).is_err(), "cut at {end} of {}", bytes.len());
            }
            hurt(&bytes, 500, |bytes| {
                if let Ok(decoded) = decode(bytes, 10_000) {
                    assert!(decoded.corners.len() <= 10_000);
                }
            });
            assert!(decode(&bytes, 27).is_err(), "28 numbers of vertices are more than 27");
        }
    }

    /// Every compressed primitive of the corpus: as many vertices and components as the accessors say, normals and weights
    /// of length and sum 1; and each answers when its data are hurt.
    #[test]
    fn the_corpus_attributes() {
        let Some(corpus) = corpus() else { return };
        for model in ["Box", "CesiumMan", "RiggedFigure", "RiggedSimple", "MorphPrimitivesTest"] {
            let path = corpus.join(format!("models/{model}/glTF-Draco/{model}.gltf"));
            with_document(&path, |document| {
                for primitive in document.root.meshes.iter().flat_map(|mesh| &mesh.primitives) {
                    let indices = primitive.indices.unwrap().value();
                    let corners = document.corners(primitive).unwrap().unwrap();
                    assert_eq!(corners.len() as u64, document.root.accessors[indices].count.0, "{model}");
                    for (semantic, accessor) in &primitive.attributes {
                        let (name, accessor) = (semantic.to_string(), &document.root.accessors[accessor.value()]);
                        let Elements { components, values } = document.attribute(primitive, &name).unwrap().unwrap();
                        let Checked::Valid(shape) = accessor.type_ else { panic!("{model}: {name}") };
                        assert_eq!(components, shape.multiplicity(), "{model}: {name}");
                        assert_eq!(values.len() as u64, accessor.count.0 * components as u64, "{model}: {name}");
                        assert!(corners.iter().all(|corner| u64::from(*corner) < accessor.count.0), "{model}");
                        for element in values.chunks(components) {
                            let (sum, squares) =
                                (element.iter().sum::<f32>(), element.iter().map(|v| v * v).sum::<f32>());
                            let fits = match name.as_str() {
                                "NORMAL" => (squares - 1.0).abs() < 1e-3,
                                "WEIGHTS_0" => (sum - 1.0).abs() < 1e-2,
                                "JOINTS_0" => {
                                    element.iter().all(|joint| (0.0..64.0).contains(joint) && joint.fract() == 0.0)
                                }
                                _ => element.iter().all(|value| value.is_finite()),
                            };
                            assert!(fits, "{model}: {name} {element:?}");
                        }
                    }
                    let view = extension(primitive).unwrap()["bufferView"].as_u64().unwrap() as usize;
                    hurt(document.view_bytes(view).unwrap(), 200, |bytes| drop(decode(bytes, 1 << 20)));
                }
            });
        }
    }
}
