//! The glTF reader, on files that the tests write themselves.

use super::documents::{message, read, Builder, TRIANGLE};
use glam::{DVec3, Vec3};
use glimt::scene::{gltf, LightKind, Projection, Soup};
use glimt::{Result, Scene};
use serde_json::{json, Value};

fn triangle(more: Value) -> Result<Scene> {
    let mut builder = Builder::default();
    let positions = builder.floats("VEC3", &TRIANGLE);
    read(&builder.document(json!({"attributes": {"POSITION": positions}}), more))
}

#[test]
fn every_component_type_normalised_and_not() {
    // Type, bytes of three vertices of which the second has its largest value in x, that value, divisor.
    let cases: [(u32, Vec<u8>, f32, f32); 5] = [
        (
            5120,
            [[0_i8, 0, 0, 0], [127, 0, 0, 0], [0, -127, 0, 0]].concat().iter().map(|v| *v as u8).collect(),
            127.0,
            127.0,
        ),
        (5121, [[0_u8, 0, 0, 0], [255, 0, 0, 0], [0, 9, 0, 0]].concat(), 255.0, 255.0),
        (
            5122,
            [[0_i16, 0, 0, 0], [32767, 0, 0, 0], [0, 5, 0, 0]].concat().iter().flat_map(|v| v.to_le_bytes()).collect(),
            32767.0,
            32767.0,
        ),
        (
            5123,
            [[0_u16, 0, 0, 0], [65535, 0, 0, 0], [0, 5, 0, 0]].concat().iter().flat_map(|v| v.to_le_bytes()).collect(),
            65535.0,
            65535.0,
        ),
        (5126, TRIANGLE.iter().flat_map(|v| v.to_le_bytes()).collect(), 1.0, 1.0),
    ];
    for (kind, bytes, value, divisor) in cases {
        for normalized in [false, true] {
            let mut builder = Builder::default();
            let view = builder.view(&bytes, Some(bytes.len() / 3));
            let positions = builder.accessor(json!({
                "bufferView": view, "componentType": kind, "type": "VEC3", "count": 3, "normalized": normalized && kind != 5126}));
            let extensions =
                json!({"extensionsUsed": ["KHR_mesh_quantization"], "extensionsRequired": ["KHR_mesh_quantization"]});
            let scene = read(&builder.document(json!({"attributes": {"POSITION": positions}}), extensions)).unwrap();
            let expected = if normalized { value / divisor } else { value };
            assert_eq!(scene.meshes[0].positions[1], Vec3::new(expected, 0.0, 0.0), "{kind} {normalized}");
        }
    }
}

#[test]
fn interleaved_attributes_with_offsets() {
    let mut builder = Builder::default();
    let vertex = |p: [f32; 3], n: [f32; 3]| p.iter().chain(&n).flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let bytes: Vec<u8> = TRIANGLE.chunks(3).flat_map(|p| vertex([p[0], p[1], p[2]], [0.0, 0.0, 1.0])).collect();
    let view = builder.view(&bytes, Some(24));
    let attribute = |offset: usize| json!({"bufferView": view, "byteOffset": offset, "componentType": 5126, "type": "VEC3", "count": 3});
    let (positions, normals) = (builder.accessor(attribute(0)), builder.accessor(attribute(12)));
    let scene =
        read(&builder.document(json!({"attributes": {"POSITION": positions, "NORMAL": normals}}), json!({}))).unwrap();
    assert_eq!(scene.meshes[0].positions[2], Vec3::Y);
    assert_eq!(scene.meshes[0].normals, [Vec3::Z; 3]);
}

#[test]
fn sparse_accessors_with_and_without_a_base() {
    for with_base in [true, false] {
        let mut builder = Builder::default();
        let bytes: Vec<u8> = TRIANGLE.iter().flat_map(|v| v.to_le_bytes()).collect();
        let base = builder.view(&bytes, None);
        let indices = builder.view(&[1, 2], None);
        let values = builder.view(&[5.0_f32, 6.0, 7.0, 8.0, 9.0, 10.0].map(f32::to_le_bytes).concat(), None);
        let mut accessor = json!({"componentType": 5126, "type": "VEC3", "count": 3, "sparse": {
            "count": 2, "indices": {"bufferView": indices, "componentType": 5121}, "values": {"bufferView": values}}});
        if with_base {
            accessor["bufferView"] = base.into();
        }
        let positions = builder.accessor(accessor);
        let scene = read(&builder.document(json!({"attributes": {"POSITION": positions}}), json!({}))).unwrap();
        let expected = [Vec3::ZERO, Vec3::new(5.0, 6.0, 7.0), Vec3::new(8.0, 9.0, 10.0)];
        assert_eq!(scene.meshes[0].positions, expected, "base {with_base}");
    }
}

#[test]
fn indices_of_every_size_and_faults_in_them() {
    let with = |kind: u32, bytes: &[u8], count: usize| {
        let mut builder = Builder::default();
        let positions = builder.floats("VEC3", &TRIANGLE);
        let view = builder.view(bytes, None);
        let indices =
            builder.accessor(json!({"bufferView": view, "componentType": kind, "type": "SCALAR", "count": count}));
        read(&builder.document(json!({"attributes": {"POSITION": positions}, "indices": indices}), json!({})))
    };
    for (kind, bytes) in
        [(5121, vec![0, 1, 2]), (5123, vec![0, 0, 1, 0, 2, 0]), (5125, vec![0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0])]
    {
        assert_eq!(with(kind, &bytes, 3).unwrap().meshes[0].triangles, [[0, 1, 2]], "{kind}");
    }
    assert!(message(with(5121, &[0, 1, 3], 3)).contains("index 3 lies beyond its 3 vertices"));
    assert!(message(with(5121, &[0, 1, 255], 3)).contains("primitive restart"));
    assert!(message(with(5121, &[0, 1, 2], 30)).contains("30 elements do not fit"));
    assert!(message(with(5126, &[0; 12], 3)).contains("unsigned integer"));
    assert!(with(5121, &[0, 1, 2, 0], 4)
        .unwrap()
        .warnings
        .iter()
        .any(|warning| warning.contains("not whole triangles")));
}

#[test]
fn modes() {
    let corners: Vec<f32> = (0..12).map(|i| i as f32).collect();
    let with = |mode: u32| {
        let mut builder = Builder::default();
        let positions = builder.floats("VEC3", &corners);
        read(&builder.document(json!({"attributes": {"POSITION": positions}, "mode": mode}), json!({})))
    };
    assert_eq!(with(5).unwrap().meshes[0].triangles, [[0, 1, 2], [1, 3, 2]]);
    assert_eq!(with(6).unwrap().meshes[0].triangles, [[0, 1, 2], [0, 2, 3]]);
    for mode in 0..4 {
        let scene = with(mode).unwrap();
        assert!(
            scene.meshes.is_empty() && scene.warnings.iter().any(|warning| warning.contains("points or lines")),
            "{mode}"
        );
    }
    assert!(message(with(7)).contains("mode"));
}

#[test]
fn hierarchies_compose_and_cycles_are_refused() {
    let nodes = json!({"nodes": [
        {"children": [1], "translation": [1, 0, 0], "scale": [2, 2, 2]},
        {"mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 3, 0, 1]}]});
    let scene = triangle(nodes).unwrap();
    let placed = scene.instances[0].world_from_object.transform_point3(DVec3::X);
    assert!(placed.distance(DVec3::new(3.0, 6.0, 0.0)) < 1e-12, "{placed}");
    for (nodes, fault) in [
        (json!([{"children": [1]}, {"children": [0], "mesh": 0}]), "its own ancestor"),
        (json!([{"children": [0], "mesh": 0}]), "its own ancestor"),
        (json!([{"children": [1, 1]}, {"mesh": 0}]), "is a child of"),
        (json!([{"children": [7]}]), "there are 1 nodes"),
        (json!([{"mesh": 3}]), "there are 1 meshes"),
    ] {
        let message = message(triangle(json!({"nodes": nodes})));
        assert!(message.contains(fault), "{message}");
    }
}

#[test]
fn scenes_by_name_and_index() {
    let mut builder = Builder::default();
    let positions = builder.floats("VEC3", &TRIANGLE);
    let more =
        json!({"scenes": [{"nodes": [0]}, {"nodes": [0, 1], "name": "both"}], "nodes": [{"mesh": 0}, {"mesh": 0}]});
    let document = builder.document(json!({"attributes": {"POSITION": positions}}), more).to_string();
    let read = |choice: Option<&str>| {
        let options = gltf::ReadOptions { scene: choice.map(str::to_owned), ..gltf::ReadOptions::default() };
        gltf::parse(document.as_bytes(), "test".into(), "test.gltf", None, &options)
    };
    assert_eq!(read(None).unwrap().instances.len(), 1);
    assert_eq!(read(Some("1")).unwrap().instances.len(), 2);
    assert_eq!(read(Some("both")).unwrap().instances.len(), 2);
    assert!(message(read(Some("2"))).contains("no scene '2'"));
}

#[test]
fn cameras_and_lights() {
    let more = json!({
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [
            {"type": "spot", "intensity": 10, "color": [1, 0.5, 0], "range": 4, "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.5}},
            {"type": "directional"}, {"type": "point", "intensity": 0}]}},
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}},
                    {"type": "orthographic", "orthographic": {"xmag": 2, "ymag": 3, "znear": 0, "zfar": 9}}],
        "nodes": [{"mesh": 0, "children": [1, 2, 3, 4, 5]}, {"camera": 0, "name": "first"}, {"camera": 1},
            {"extensions": {"KHR_lights_punctual": {"light": 0}}, "translation": [0, 5, 0], "rotation": [-0.707_106_77, 0, 0, 0.707_106_77]},
            {"extensions": {"KHR_lights_punctual": {"light": 1}}}, {"extensions": {"KHR_lights_punctual": {"light": 2}}}],
    });
    let scene = triangle(more).unwrap();
    assert_eq!(scene.cameras[0].0, "first");
    assert!(matches!(scene.cameras[0].1.projection, Projection::Perspective { fov } if (fov - 1.0).abs() < 1e-6));
    assert!(matches!(scene.cameras[1].1.projection, Projection::Orthographic { half_height } if half_height == 3.0));
    let spot = scene.lights[0];
    assert!(matches!(spot.kind, LightKind::Spot { inner_cosine, .. } if (inner_cosine - 0.1_f64.cos()).abs() < 1e-6));
    assert!(spot.direction.distance(DVec3::NEG_Y) < 1e-6 && spot.position.distance(DVec3::Y * 5.0) < 1e-12);
    assert_eq!((spot.intensity, spot.range), (DVec3::new(10.0, 5.0, 0.0), Some(4.0)));
    assert_eq!(scene.lights.len(), 3);
    assert!(scene.has_lights && scene.lights[2].is_dark());
}

#[test]
fn exact_coefficients_in_extras() {
    let mut builder = Builder::default();
    let positions = builder.floats("VEC3", &TRIANGLE);
    let primitive = json!({"attributes": {"POSITION": positions}, "material": 0});
    let with = |extras: Value| {
        let more = json!({"materials": [{"extras": extras}]});
        read(&builder.document(primitive.clone(), more)).unwrap()
    };
    let scene = with(
        json!({"whitted": {"ambient": 0.1, "diffuse": [0.1, 0.2, 0.3], "specular": 0.4, "shininess": 50, "mirror": 0.5}}),
    );
    let whitted = scene.materials[0].whitted.unwrap();
    assert_eq!(
        (whitted.ambient.x, whitted.diffuse.z, whitted.specular.y, whitted.shininess, whitted.mirror.x),
        (0.1, 0.3, 0.4, 50.0, 0.5)
    );
    for bad in [json!({"whitted": {"mirror": -1}}), json!({"whitted": {"unknown": 1}}), json!({"whitted": 3})] {
        let scene = with(bad);
        assert!(
            scene.materials[0].whitted.is_none() && scene.warnings.iter().any(|w| w.contains("extras.whitted")),
            "{:?}",
            scene.warnings
        );
    }
    assert!(with(json!({"other": 1})).materials[0].whitted.is_none());
}

#[test]
fn what_is_not_shown_is_said() {
    let scene = triangle(json!({"extensionsUsed": ["EXT_unheard_of"], "animations": []})).unwrap();
    assert!(
        scene.warnings.iter().any(|warning| warning == "ignored: extension EXT_unheard_of"),
        "{:?}",
        scene.warnings
    );
    let required = triangle(json!({"extensionsUsed": ["EXT_x"], "extensionsRequired": ["EXT_x"]}));
    assert!(message(required).contains("requires EXT_x"));
    assert!(message(triangle(json!({"asset": {"version": "1.0"}}))).contains("only glTF 2.0"));
    let network = triangle(json!({"buffers": [{"byteLength": 36, "uri": "http://example.com/a.bin"}]}));
    assert!(message(network).contains("network address"));
}

#[test]
fn hostile_bytes_are_refused_without_panic() {
    let scene = || -> Vec<u8> {
        let json = br#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[]}],"scene":0}   "#;
        let mut glb = b"glTF\x02\0\0\0".to_vec();
        glb.extend((20 + json.len() as u32).to_le_bytes());
        glb.extend((json.len() as u32).to_le_bytes());
        glb.extend(b"JSON");
        glb.extend(json);
        glb
    };
    let parse = |bytes: &[u8]| gltf::parse(bytes, "test".into(), "test.glb", None, &gltf::ReadOptions::default());
    assert!(parse(&scene()).is_ok());
    for end in 0..scene().len() {
        assert!(parse(&scene()[..end]).is_err(), "cut at {end}");
    }
    for at in 0..scene().len() {
        for value in [0, 0x7f, 0xff] {
            let mut bytes = scene();
            bytes[at] = value;
            // Either answer is right; what counts is that there is one.
            let _ = parse(&bytes);
        }
    }
    // A count that nothing backs allocates nothing.
    let huge = json!({"accessors": [{"componentType": 5126, "type": "VEC3", "count": 4_000_000_000_u64}]});
    assert!(message(triangle(huge)).contains("take more than"));
}

#[test]
fn small_files_cannot_ask_for_much() {
    // Found by review: each of these took gigabytes.
    let mut builder = Builder::default();
    let positions = builder.floats("VEC3", &TRIANGLE);
    let places = builder.accessor(json!({"componentType": 5126, "type": "VEC3", "count": 1_u64 << 26}));
    let instancing = json!({"extensionsUsed": ["EXT_mesh_gpu_instancing"],
        "nodes": [{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}}}]});
    let primitive = json!({"attributes": {"POSITION": positions}});
    assert!(message(read(&builder.document(primitive, instancing))).contains("no data for so many"));

    let mut builder = Builder::default();
    let unbacked = builder.accessor(json!({"componentType": 5126, "type": "VEC3", "count": 1 << 20}));
    let primitives = vec![json!({"attributes": {"POSITION": unbacked}}); 1000];
    let many = json!({"meshes": [{"primitives": primitives}]});
    assert!(message(read(&builder.document(json!({}), many))).contains("take more than"));

    let places = json!(vec![json!({"mesh": 0}); 3000]);
    let all: Vec<usize> = (0..3000).collect();
    let mut builder = Builder::default();
    let positions = builder.floats("VEC3", &TRIANGLE);
    let primitives = vec![json!({"attributes": {"POSITION": positions}}); 2000];
    let many = json!({"meshes": [{"primitives": primitives}], "nodes": places, "scenes": [{"nodes": all}]});
    assert!(message(read(&builder.document(json!({}), many))).contains("instances of meshes"));
}

#[test]
fn buffers_lie_beside_the_document() {
    let outside = tempfile::tempdir().unwrap();
    let folder = outside.path().join("document");
    std::fs::create_dir(&folder).unwrap();
    // Readable and long enough: refused for its place alone.
    std::fs::write(outside.path().join("b.bin"), [0; 36]).unwrap();
    for uri in ["../b.bin", "../../../../dev/zero", "/dev/zero", ".", "missing.bin"] {
        let mut builder = Builder::default();
        let positions = builder.floats("VEC3", &TRIANGLE);
        let more = json!({"buffers": [{"byteLength": 36, "uri": uri}]});
        let document = builder.document(json!({"attributes": {"POSITION": positions}}), more).to_string();
        let result =
            gltf::parse(document.as_bytes(), "test".into(), "test.gltf", Some(&folder), &gltf::ReadOptions::default());
        assert!(message(result).contains("buffers[0]"), "{uri}");
    }
}

#[test]
fn unlit_is_the_base_color_alone() {
    let mut builder = Builder::default();
    let positions = builder.floats("VEC3", &TRIANGLE);
    let more = json!({"extensionsUsed": ["KHR_materials_unlit"],
        "materials": [{"emissiveFactor": [0, 1, 0], "extensions": {"KHR_materials_unlit": {}}}]});
    let scene = read(&builder.document(json!({"attributes": {"POSITION": positions}, "material": 0}), more)).unwrap();
    assert!(scene.materials[0].unlit && scene.materials[0].emission == DVec3::ZERO);
}

#[test]
fn many_elements_are_read_in_their_order() {
    // More than one thread reads at once, with a stride; some triangles are dropped on the way into the soup.
    let count = 50_001;
    let point = |i: usize| if i % 30_000 == 7 { [f32::MAX; 3] } else { [i as f32, -(i as f32), (i % 17) as f32] };
    let bytes: Vec<u8> = (0..count).flat_map(|i| [point(i), [9.0; 3]]).flatten().flat_map(f32::to_le_bytes).collect();
    let mut builder = Builder::default();
    let view = builder.view(&bytes, Some(24));
    let positions =
        builder.accessor(json!({"bufferView": view, "componentType": 5126, "type": "VEC3", "count": count}));
    let scene = read(&builder.document(json!({"attributes": {"POSITION": positions}}), json!({}))).unwrap();
    let own: Vec<[f32; 3]> = scene.meshes[0].positions.iter().map(|position| position.to_array()).collect();
    assert_eq!(own, (0..count).map(point).collect::<Vec<_>>());
    let soup = Soup::of(&scene).unwrap();
    let drawn = (0..count / 3).filter(|triangle| (0..3).all(|corner| point(3 * triangle + corner)[0] < 1e30));
    let expected = drawn.map(|triangle| [0, 1, 2].map(|corner| Vec3::from(point(3 * triangle + corner)).as_dvec3()));
    assert_eq!(soup.positions, expected.collect::<Vec<_>>());
    assert_eq!(soup.len(), count / 3 - 2, "two triangles have a corner that is too far away");
}
