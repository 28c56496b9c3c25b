//! The decoders of geometry: bytes of a meshopt stream or of a Draco mesh, by the first byte.
#![no_main]

mod common;

use libfuzzer_sys::fuzz_target;

const MODES: [(&str, usize); 4] = [("ATTRIBUTES", 4), ("ATTRIBUTES", 12), ("TRIANGLES", 2), ("INDICES", 4)];
const FILTERS: [&str; 5] = ["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"];

/// Positions and indices that one stream stands for: the first bytes are its kind, its filter and how many elements it has.
fn meshopt(kind: u8, filter: u8, count: u8, data: &[u8]) -> Vec<u8> {
    let (mode, stride) = MODES[usize::from(kind) % MODES.len()];
    let filter = FILTERS[usize::from(filter) % FILTERS.len()];
    let stride = if filter == "QUATERNION" { 8 } else { stride };
    let (count, length) = (3 * usize::from(count), data.len());
    let (component, shape) = match (mode, stride) {
        ("ATTRIBUTES", 12) => (5126, "VEC3"),
        ("ATTRIBUTES", _) => (5120, "VEC3"),
        ("TRIANGLES", _) => (5123, "SCALAR"),
        _ => (5125, "SCALAR"),
    };
    let primitive = match mode {
        "ATTRIBUTES" => r#"{"attributes":{"POSITION":0}}"#,
        _ => r#"{"attributes":{"POSITION":1},"indices":0}"#,
    };
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{primitive}]}}],
        "accessors":[{{"bufferView":0,"componentType":{component},"type":"{shape}","count":{count}}},
        {{"componentType":5126,"type":"VEC3","count":9}}],
        "bufferViews":[{{"buffer":1,"byteLength":{0},"byteStride":{stride},"extensions":{{"EXT_meshopt_compression":
        {{"buffer":0,"byteLength":{length},"byteStride":{stride},"count":{count},"mode":"{mode}","filter":"{filter}"}}}}}}],
        "buffers":[{{"byteLength":{length}}},{{"byteLength":{0}}}],
        "extensionsUsed":["EXT_meshopt_compression"],"extensionsRequired":["EXT_meshopt_compression"]}}"#,
        (count * stride).max(1)
    );
    common::glb(json, data)
}

/// A primitive that the stream stands for.
fn draco(data: &[u8]) -> Vec<u8> {
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":0,"COLOR_0":0}},"indices":1,
        "extensions":{{"KHR_draco_mesh_compression":{{"bufferView":0,"attributes":{{"POSITION":0,"COLOR_0":1}}}}}}}}]}}],
        "accessors":[{{"componentType":5126,"type":"VEC3","count":4}},{{"componentType":5123,"type":"SCALAR","count":6}}],
        "bufferViews":[{{"buffer":0,"byteLength":{0}}}],"buffers":[{{"byteLength":{0}}}],
        "extensionsUsed":["KHR_draco_mesh_compression"],"extensionsRequired":["KHR_draco_mesh_compression"]}}"#,
        data.len()
    );
    common::glb(json, data)
}

fuzz_target!(init: common::init(), |bytes: &[u8]| match bytes {
    [b'D', ..] => common::read(&draco(bytes)),
    [kind, filter, count, data @ ..] => common::read(&meshopt(*kind, *filter, *count, data)),
    _ => {}
});
