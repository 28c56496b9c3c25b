//! Documents that ask for too much, and documents changed at random, written by the tests themselves.

use super::documents::{message, Builder, TRIANGLE};
use glam::DVec3;
use glimt::scene::{gltf, Instancing, Soup};
use glimt::{Result, Scene};
use serde_json::{json, Value};
use std::io::Cursor;
use std::time::{Duration, Instant};

fn read_within(document: &Value, most: u64) -> Result<Scene> {
    let options = gltf::ReadOptions { max_memory: Some(most), ..gltf::ReadOptions::default() };
    gltf::parse(document.to_string().as_bytes(), "test".into(), "test.gltf", None, &options)
}

/// Refused within so many bytes, read within a thousand times as many.
fn refused_within(document: &Value, most: u64, fault: &str) {
    let message = message(read_within(document, most));
    assert!(message.contains(fault), "{message}");
    read_within(document, 1000 * most).unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn joints_are_counted_before_they_are_read() {
    // Many sets of joints that are too short, on many vertices without data.
    let mut builder = Builder::default();
    let positions = builder.accessor(json!({"componentType": 5126, "type": "VEC3", "count": 1 << 20}));
    let short = builder.accessor(json!({"componentType": 5121, "type": "VEC4", "count": 1}));
    let mut attributes = json!({"POSITION": positions});
    for set in 0..5000 {
        attributes[format!("JOINTS_{set}")] = short.into();
        attributes[format!("WEIGHTS_{set}")] = short.into();
    }
    let more = json!({"skins": [{"joints": [0]}], "nodes": [{"mesh": 0, "skin": 0}]});
    let document = builder.document(json!({"attributes": attributes}), more);
    let message = message(read_within(&document, 1 << 30));
    assert!(message.contains("take more than 1073741824 bytes"), "{message}");
}

#[test]
fn instances_and_poses_count() {
    let mut builder = Builder::default();
    let positions = builder.floats("VEC3", &TRIANGLE);
    let moved = builder.floats("VEC3", &[1.0; 9]);
    let nodes = |node: Value| json!({"nodes": vec![node; 500], "scenes": [{"nodes": (0..500).collect::<Vec<_>>()}]});
    let primitive = json!({"attributes": {"POSITION": positions}, "targets": [{"POSITION": moved}]});
    refused_within(
        &builder.document(primitive, nodes(json!({"mesh": 0, "weights": [1]}))),
        1000,
        "take more than 1000 bytes",
    );
    let places = builder.accessor(json!({"componentType": 5126, "type": "VEC3", "count": 1000}));
    let node = json!({"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}}});
    let more = json!({"nodes": [node], "extensionsUsed": ["EXT_mesh_gpu_instancing"]});
    // 12 bytes an instance as they are read, 416 as they are kept.
    refused_within(
        &builder.document(json!({"attributes": {"POSITION": positions}}), more),
        100_000,
        "take more than 100000 bytes",
    );
}

#[test]
fn triangles_of_all_instances_count() {
    let mut builder = Builder::default();
    let positions = builder.accessor(json!({"componentType": 5126, "type": "VEC3", "count": 60}));
    let nodes = json!({"nodes": vec![json!({"mesh": 0}); 200], "scenes": [{"nodes": (0..200).collect::<Vec<_>>()}]});
    let document = builder.document(json!({"attributes": {"POSITION": positions}}), nodes);
    let mut scene = read_within(&document, 1 << 20).unwrap();
    scene.max_memory = Some(100_000);
    let error = Soup::of(&scene).unwrap_err().to_string();
    assert!(error.contains("4000 triangles take 324000 bytes, more than 100000 (see --max-memory)"), "{error}");
    assert_eq!(Soup::with(&scene, Instancing::Shared).unwrap().placed, 4000);
    scene.max_memory = Some(324_000);
    assert_eq!(Soup::of(&scene).unwrap().len(), 4000);
}

/// A PNG of one colour.
fn png(side: u32) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image::DynamicImage::new_rgb8(side, side).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// A triangle with these pictures on as many materials, of which it shows the first ones.
fn pictures(bytes: &[u8], count: usize, shown: usize) -> Value {
    let mut builder = Builder::default();
    let positions = builder.floats("VEC3", &TRIANGLE);
    let coordinates = builder.view(&[0; 24], None);
    let coordinates =
        builder.accessor(json!({"bufferView": coordinates, "componentType": 5126, "type": "VEC2", "count": 3}));
    let view = builder.view(bytes, None);
    let primitive = |material: usize| json!({"attributes": {"POSITION": positions, "TEXCOORD_0": coordinates}, "material": material});
    let each = |make: &dyn Fn(usize) -> Value| (0..count).map(make).collect::<Vec<Value>>();
    let more = json!({
        "meshes": [{"primitives": (0..shown).map(primitive).collect::<Vec<Value>>()}],
        "materials": each(&|index| json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": index}}})),
        "textures": each(&|index| json!({"source": index})),
        "images": each(&|_| json!({"bufferView": view, "mimeType": "image/png"})),
    });
    builder.document(json!({}), more)
}

#[test]
fn pictures_are_counted_together_before_any_is_decoded() {
    let bytes = png(256);
    let document = pictures(&bytes, 8, 8);
    let message = message(read_within(&document, 1 << 20));
    assert!(message.contains("take more than 1048576 bytes"), "{message}");
    let scene = read_within(&document, 3 << 20).unwrap();
    assert!(scene.images.iter().all(Option::is_some));
    // Halved they fit, decoded a few at a time.
    let options =
        gltf::ReadOptions { max_memory: Some(1 << 20), max_texture_size: Some(64), ..gltf::ReadOptions::default() };
    let scene = gltf::parse(document.to_string().as_bytes(), "test".into(), "test.gltf", None, &options).unwrap();
    assert!(
        scene.images.iter().flatten().all(|image| image.width == 64) && scene.images.len() == 8,
        "{:?}",
        scene.warnings
    );
}

#[test]
fn pictures_that_nothing_shows_are_looked_at() {
    let warnings = |bytes: &[u8]| read_within(&pictures(bytes, 1, 0), 1 << 20).unwrap().warnings;
    let says = |bytes: &[u8], text: &str| {
        let warnings = warnings(bytes);
        assert!(warnings.iter().any(|warning| warning.contains(text)), "{text}: {warnings:?}");
    };
    let whole = png(8);
    assert!(!warnings(&whole).iter().any(|warning| warning.contains("images")), "{:?}", warnings(&whole));
    says(&whole[..20], "images[0]: it is cut off or broken before its size");
    says(b"GIF89a..", "images[0]: it is none of");
    says(b"\xff\xd8\xff\xc0\0\x11\x08\0\x07\0\x09", "images[0]: it is image/jpeg, but declared as image/png");
    says(b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR\0\0\0\0\0\0\0\x07", "images[0]: 0 × 7 is no size");
}

#[test]
fn many_buffers_may_not_name_one_file() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("b.bin"), vec![0; 1 << 16]).unwrap();
    let buffers = vec![json!({"byteLength": 1 << 16, "uri": "b.bin"}); 20];
    let document = json!({"asset": {"version": "2.0"}, "buffers": buffers}).to_string();
    let read = |most| {
        let options = gltf::ReadOptions { max_memory: Some(most), ..gltf::ReadOptions::default() };
        gltf::parse(document.as_bytes(), "test".into(), "test.gltf", Some(folder.path()), &options).unwrap().warnings
    };
    assert!(read(10 << 16)
        .iter()
        .any(|text| text == "buffers[10]: it takes more memory than is left (see --max-memory)"));
    assert!(!read(20 << 16).iter().any(|text| text.contains("buffers[")));
}

#[test]
fn warnings_end() {
    let nodes: Vec<Value> = (0..5000).map(|_| json!({"rotation": [0, 0, 0, 2]})).collect();
    let scene = read_within(&json!({"asset": {"version": "2.0"}, "nodes": nodes}), 1 << 20).unwrap();
    assert_eq!(scene.warnings.len(), 1001);
    assert!(scene.warnings[1000].starts_with("and 4001 more warnings"), "{}", scene.warnings[1000]);
}

#[test]
fn a_million_nodes_deep() {
    let count = 1_000_000;
    let nodes: Vec<Value> =
        (0..count).map(|i| if i + 1 < count { json!({"children": [i + 1]}) } else { json!({"mesh": 0}) }).collect();
    let mut builder = Builder::default();
    let positions = builder.floats("VEC3", &TRIANGLE);
    let document = builder.document(json!({"attributes": {"POSITION": positions}}), json!({"nodes": nodes}));
    assert_eq!(read_within(&document, 1 << 20).unwrap().instances.len(), 1);
    let deep = format!("{}1{}", "[".repeat(100_000), "]".repeat(100_000));
    let deep = format!(r#"{{"asset": {{"version": "2.0"}}, "extras": {deep}}}"#);
    let parsed = gltf::parse(deep.as_bytes(), "test".into(), "test.gltf", None, &gltf::ReadOptions::default());
    assert!(message(parsed).contains("recursion limit"));
}

/// A skinned, morphed, animated triangle with a texture.
fn lively() -> Value {
    let mut document = pictures(&png(4), 1, 1);
    let mut builder = Builder::default();
    let moved = builder.floats("VEC3", &[0.5; 9]);
    let joints = builder.view(&[0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0], None);
    let joints = builder.accessor(json!({"bufferView": joints, "componentType": 5121, "type": "VEC4", "count": 3}));
    let weights = builder.floats("VEC4", &[0.5, 0.5, 0.0, 0.0].repeat(3));
    let identity: Vec<f32> = (0..32).map(|i| if i % 5 == 0 && i < 16 || i % 16 % 5 == 0 { 1.0 } else { 0.0 }).collect();
    let bind = builder.floats("MAT4", &identity);
    let times = builder.floats("SCALAR", &[0.0, 1.0]);
    let turns = builder.floats("VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0]);
    let amounts = builder.floats("SCALAR", &[0.0, 1.0]);
    // The two documents are joined: the second one's buffer, views and accessors come behind.
    let mut second = builder.document(json!({}), json!({}));
    let (views, accessors) =
        (document["bufferViews"].as_array().unwrap().len(), document["accessors"].as_array().unwrap().len());
    for view in second["bufferViews"].as_array_mut().unwrap() {
        view["buffer"] = 1.into();
        document["bufferViews"].as_array_mut().unwrap().push(view.take());
    }
    for accessor in second["accessors"].as_array_mut().unwrap() {
        accessor["bufferView"] = (accessor["bufferView"].as_u64().unwrap() as usize + views).into();
        document["accessors"].as_array_mut().unwrap().push(accessor.take());
    }
    document["buffers"].as_array_mut().unwrap().push(second["buffers"][0].take());
    let primitive = &mut document["meshes"][0]["primitives"][0];
    primitive["attributes"]["JOINTS_0"] = (joints + accessors).into();
    primitive["attributes"]["WEIGHTS_0"] = (weights + accessors).into();
    primitive["targets"] = json!([{"POSITION": moved + accessors}]);
    document["skins"] = json!([{"joints": [1, 2], "inverseBindMatrices": bind + accessors}]);
    document["nodes"] = json!([{"mesh": 0, "skin": 0, "children": [1]}, {"children": [2]}, {"translation": [0, 1, 0]}]);
    document["animations"] = json!([{
        "samplers": [{"input": times + accessors, "output": turns + accessors}, {"input": times + accessors, "output": amounts + accessors}],
        "channels": [{"sampler": 0, "target": {"node": 1, "path": "rotation"}}, {"sampler": 1, "target": {"node": 0, "path": "weights"}}]}]);
    document
}

/// Positions compressed by meshopt, standing in three places, beside a camera and a light.
fn compressed() -> Value {
    let view = json!({"buffer": 1, "byteLength": 34, "byteStride": 12, "count": 3, "mode": "ATTRIBUTES"});
    let data = super::compressed::MESHOPT;
    json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
        "extensionsUsed": ["EXT_meshopt_compression", "EXT_mesh_gpu_instancing", "KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point"}]}},
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}],
        "nodes": [{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}}}},
            {"camera": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3, "min": [0, 0, 0], "max": [1, 1, 0]}],
        "bufferViews": [{"buffer": 0, "byteLength": 36, "byteStride": 12, "extensions": {"EXT_meshopt_compression": view}}],
        "buffers": [{"byteLength": 36}, {"byteLength": 34, "uri": format!("data:application/octet-stream;base64,{data}")}],
    })
}

/// A number of `below` possible ones, always the same sequence.
struct Random(u64);

impl Random {
    fn below(&mut self, below: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % below
    }
}

/// Changes one value somewhere in a document.
fn change(value: &mut Value, random: &mut Random) {
    let numbers =
        [json!(-1), json!(0), json!(1), json!(2), json!(3), json!(7), json!(0.5), json!(1e30), json!(u64::MAX)];
    let odd = [json!(null), json!([]), json!({}), json!("x"), json!(true), json!(4)];
    let deeper = random.below(100) > 0;
    match value {
        Value::Array(items) if deeper && !items.is_empty() => {
            let at = random.below(items.len());
            match random.below(12) {
                0 => drop(items.remove(at)),
                1 => items.push(items[at].clone()),
                _ => change(&mut items[at], random),
            }
        }
        Value::Object(members) if deeper && !members.is_empty() => {
            let name = members.keys().nth(random.below(members.len())).cloned().unwrap_or_default();
            match random.below(20) {
                0 => drop(members.remove(&name)),
                _ => members.get_mut(&name).into_iter().for_each(|member| change(member, random)),
            }
        }
        Value::Number(number) if random.below(30) > 0 => {
            let near = number.as_i64().map(|number| json!(number + random.below(3) as i64 - 1));
            let any = numbers[random.below(numbers.len())].clone();
            *value = near.filter(|_| random.below(2) == 0).unwrap_or(any);
        }
        other => *other = odd[random.below(odd.len())].clone(),
    }
}

/// Either answer is right; what counts is that there is one, and soon.
fn answer(bytes: &[u8]) -> bool {
    let options = gltf::ReadOptions { max_memory: Some(1 << 22), at: Some(0.3), ..gltf::ReadOptions::default() };
    let start = Instant::now();
    let scene = gltf::parse(bytes, "test".into(), "test.gltf", None, &options);
    let soup = scene.and_then(|scene| Soup::with(&scene, Instancing::Shared));
    assert!(start.elapsed() < Duration::from_secs(10), "{}", String::from_utf8_lossy(bytes));
    soup.is_ok_and(|mut soup| {
        soup.dice(DVec3::ONE);
        true
    })
}

#[test]
fn changed_documents_are_answered() {
    let mut random = Random(1);
    for document in [pictures(&png(4), 2, 1), lively(), compressed()] {
        assert!(answer(document.to_string().as_bytes()));
        let (mut read, mut all) = (0, 0);
        for _ in 0..1200 {
            let mut changed = document.clone();
            (0..=random.below(3)).for_each(|_| change(&mut changed, &mut random));
            let mut bytes = changed.to_string().into_bytes();
            if random.below(4) == 0 {
                let at = random.below(bytes.len());
                bytes[at] ^= 1 << random.below(8);
            }
            read += usize::from(answer(&bytes));
            all += 1;
        }
        println!("{read} of {all} changed documents are read");
        assert!(read > all / 20 && read < all, "{read} of {all}: the changes are too coarse or too fine");
    }
}
