//! The decoders of pictures: bytes of a picture, shown on a triangle.
#![no_main]

mod common;

use libfuzzer_sys::fuzz_target;

/// A triangle whose material shows the picture that the BIN chunk is.
fn document(picture: &[u8]) -> Vec<u8> {
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1}},"material":0}}]}}],
        "accessors":[{{"componentType":5126,"type":"VEC3","count":3}},{{"componentType":5126,"type":"VEC2","count":3}}],
        "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],"textures":[{{"source":0}}],
        "images":[{{"bufferView":0,"mimeType":"image/png"}}],"bufferViews":[{{"buffer":0,"byteLength":{0}}}],
        "buffers":[{{"byteLength":{0}}}]}}"#,
        picture.len()
    );
    common::glb(json, picture)
}

fuzz_target!(init: common::init(), |picture: &[u8]| common::read(&document(picture)));
