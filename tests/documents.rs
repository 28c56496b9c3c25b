//! glTF documents that tests write themselves.

use glimt::scene::gltf;
use glimt::{Result, Scene};
use serde_json::{json, Value};

/// A document under construction: accessors over one buffer.
#[derive(Default)]
pub struct Builder {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Builder {
    pub fn view(&mut self, bytes: &[u8], stride: Option<usize>) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view = json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()});
        if let Some(stride) = stride {
            view["byteStride"] = stride.into();
        }
        self.bytes.extend(bytes);
        self.views.push(view);
        self.views.len() - 1
    }

    pub fn accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    pub fn floats(&mut self, shape: &str, values: &[f32]) -> usize {
        let components =
            [("SCALAR", 1), ("VEC3", 3), ("VEC4", 4), ("MAT4", 16)].iter().find(|own| own.0 == shape).unwrap().1;
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        let view = self.view(&bytes, None);
        let count = values.len() / components;
        self.accessor(json!({"bufferView": view, "componentType": 5126, "type": shape, "count": count}))
    }

    /// A document with one node for one mesh of one primitive; `more` overrides top-level members.
    pub fn document(&self, primitive: Value, more: Value) -> Value {
        use base64::Engine;
        let data = base64::engine::general_purpose::STANDARD.encode(&self.bytes);
        let mut document = json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [primitive]}], "accessors": self.accessors, "bufferViews": self.views,
            "buffers": [{"byteLength": self.bytes.len(), "uri": format!("data:application/octet-stream;base64,{data}")}],
        });
        more.as_object().unwrap().iter().for_each(|(key, value)| document[key] = value.clone());
        document
    }
}

pub fn read(document: &Value) -> Result<Scene> {
    gltf::parse(document.to_string().as_bytes(), "test".into(), "test.gltf", None, &gltf::ReadOptions::default())
}

pub const TRIANGLE: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];

pub fn message(result: Result<Scene>) -> String {
    let Err(error) = result else { panic!("must be refused") };
    assert_eq!(error.exit_code(), 2, "{error}");
    error.to_string()
}
