//! Geometry compressed by meshopt and Draco.

use super::documents::{message, read};
use glam::{Vec3, Vec4};
use serde_json::{json, Value};

/// A view of three positions, compressed by meshopt.
pub const MESHOPT: &str = "oerqqgB/fwAAfwAAAAAAAAAAAAAAAAAAAAAAAAAAABIBAA==";

#[test]
fn compressed_views_replace_the_fallback() {
    for (name, fallback) in [("KHR", json!({"fallback": true})), ("EXT", json!({}))] {
        let name = format!("{name}_meshopt_compression");
        let view = json!({"buffer": 1, "byteLength": 34, "byteStride": 12, "count": 3, "mode": "ATTRIBUTES"});
        let mut document = json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "extensionsUsed": [name], "extensionsRequired": [name],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3, "min": [0, 0, 0], "max": [1, 1, 0]}],
            "bufferViews": [{"buffer": 0, "byteLength": 36, "byteStride": 12, "extensions": {&name: view}}],
            "buffers": [{"byteLength": 36, "extensions": {&name: fallback}},
                {"byteLength": 34, "uri": format!("data:application/octet-stream;base64,{MESHOPT}")}],
        });
        let scene = read(&document).unwrap();
        assert_eq!(scene.warnings, [""; 0]);
        assert_eq!(scene.meshes[0].positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
        document["bufferViews"][0]["extensions"][&name]["count"] = 4.into();
        let message = message(read(&document));
        assert!(message.contains(&format!("bufferViews[0].extensions.{name}")), "{message}");
    }
}

/// Four vertices with a colour each and two triangles, compressed by Draco.
const DRACO: &str =
    "RFJBQ08CAgEAAAACBAEAAQICAQMBAgAJAwAAAgIEAAEAAQAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAAAAAAAgD8AAIA/AAAAPwABA\
    QAJAwEQASATARADAJCQaYBhxrxcBgAAAAD/AAAA";

#[test]
fn compressed_primitives_replace_their_accessors() {
    let document = |extension: Value| {
        json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "extensionsUsed": ["KHR_draco_mesh_compression"], "extensionsRequired": ["KHR_draco_mesh_compression"],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "COLOR_0": 1}, "indices": 2,
                "extensions": {"KHR_draco_mesh_compression": extension}}]}],
            "accessors": [
                {"componentType": 5126, "type": "VEC3", "count": 4, "min": [0, 0, 0], "max": [1, 1, 0.5]},
                {"componentType": 5121, "type": "VEC4", "count": 4, "normalized": true},
                {"componentType": 5123, "type": "SCALAR", "count": 6}],
            "bufferViews": [{"buffer": 0, "byteLength": 114}],
            "buffers": [{"byteLength": 114, "uri": format!("data:application/octet-stream;base64,{DRACO}")}],
        })
    };
    let scene = read(&document(json!({"bufferView": 0, "attributes": {"POSITION": 0, "COLOR_0": 1}}))).unwrap();
    assert_eq!(scene.warnings, [""; 0]);
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(1.0, 1.0, 0.5)]);
    let opaque = [Vec3::X, Vec3::Y, Vec3::Z].map(|color| color.extend(1.0));
    assert_eq!(mesh.colors, [opaque[0], opaque[1], opaque[2], Vec4::new(0.2, 0.4, 0.6, 0.8)]);
    assert_eq!(mesh.triangles, [[0, 1, 2], [2, 1, 3]]);
    // What is not in the compressed data comes from its accessor: here one without data, which is black.
    let scene = read(&document(json!({"bufferView": 0, "attributes": {"POSITION": 0}}))).unwrap();
    assert_eq!(scene.meshes[0].colors, [Vec4::ZERO; 4]);
    for (extension, fault) in [
        (json!({"bufferView": 0, "attributes": {"POSITION": 7}}), "POSITION has number 7"),
        (json!({"bufferView": 1, "attributes": {"POSITION": 0}}), "bufferView"),
        (json!({"attributes": {"POSITION": 0}}), "bufferView"),
        (json!({}), "bufferView"),
    ] {
        let message = message(read(&document(extension)));
        assert!(message.contains(fault), "{message}");
    }
}
