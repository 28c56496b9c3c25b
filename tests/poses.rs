//! What a file shows at a time: animations, skins, morph targets; variants and visibility.

use super::documents::{Builder, TRIANGLE};
use glam::{DQuat, DVec3, Vec3};
use glimt::scene::gltf::{self, Asset, ReadOptions};
use glimt::{Result, Scene};
use serde_json::{json, Value};
use std::f64::consts::{FRAC_PI_2, PI};

pub fn open(document: &Value, options: &ReadOptions) -> Result<Asset> {
    gltf::open_bytes(document.to_string().as_bytes(), "test".into(), "test.gltf", None, options)
}

pub fn playing(document: &Value) -> Asset {
    open(document, &ReadOptions { at: Some(0.0), ..ReadOptions::default() }).unwrap_or_else(|error| panic!("{error}"))
}

pub fn still(document: &Value) -> Scene {
    open(document, &ReadOptions::default()).and_then(Asset::into_scene).unwrap_or_else(|error| panic!("{error}"))
}

pub fn has_warning(scene: &Scene, text: &str) -> bool {
    scene.warnings.iter().any(|warning| warning.contains(text))
}

pub fn assert_close(what: &str, own: DVec3, expected: DVec3) {
    assert!(own.distance(expected) < 1e-6, "{what}: {own}, not {expected}");
}

/// A triangle whose node has one animated property, by three sampler values a key.
fn animated(path: &str, interpolation: &str, shape: &str, times: &[f32], values: &[f32]) -> Value {
    let mut builder = Builder::default();
    let positions = builder.floats("VEC3", &TRIANGLE);
    let (input, output) = (builder.floats("SCALAR", times), builder.floats(shape, values));
    let more = json!({"animations": [{"channels": [{"sampler": 0, "target": {"node": 0, "path": path}}],
        "samplers": [{"input": input, "output": output, "interpolation": interpolation}]}]});
    builder.document(json!({"attributes": {"POSITION": positions}}), more)
}

fn moved(asset: &Asset, at: f64, point: DVec3) -> DVec3 {
    asset.scene(at).unwrap().instances[0].world_from_object.transform_point3(point)
}

#[test]
fn translations_by_each_interpolation() {
    let x = |values: &[f32]| values.iter().flat_map(|x| [*x, 0.0, 0.0]).collect::<Vec<f32>>();
    // Before, on, between and after keys at 1 s and 3 s; the spline's tangents are a second's, the keys two seconds apart:
    // at 2 s it is 2·⅛·1 + ½·4 − 2·⅛·2 = 1.75, at 1.5 s 2·0.140625·1 + 0.15625·4 − 2·0.046875·2 = 0.71875.
    let cases: [(&str, Vec<f32>, [f64; 6]); 3] = [
        ("STEP", x(&[0.5, 4.0]), [0.5, 0.5, 0.5, 0.5, 4.0, 4.0]),
        ("LINEAR", x(&[0.5, 4.0]), [0.5, 0.5, 1.375, 2.25, 4.0, 4.0]),
        ("CUBICSPLINE", x(&[9.0, 0.0, 1.0, 2.0, 4.0, 9.0]), [0.0, 0.0, 0.71875, 1.75, 4.0, 4.0]),
    ];
    for (interpolation, values, expected) in cases {
        let asset = playing(&animated("translation", interpolation, "VEC3", &[1.0, 3.0], &values));
        assert_eq!(asset.duration(), 3.0);
        for (at, expected) in [-5.0, 1.0, 1.5, 2.0, 3.0, 99.0].into_iter().zip(expected) {
            let place = moved(&asset, at, DVec3::ZERO);
            assert_close(&format!("{interpolation} at {at}"), place, DVec3::X * expected);
        }
    }
    let scaled = playing(&animated("scale", "LINEAR", "VEC3", &[0.0, 1.0], &[1.0, 1.0, 1.0, 3.0, 5.0, 7.0]));
    assert_close("scale", moved(&scaled, 0.5, DVec3::ONE), DVec3::new(2.0, 3.0, 4.0));
}

#[test]
fn rotations_take_the_short_way_at_even_speed() {
    let about_z = |degrees: f64| DQuat::from_rotation_z(degrees.to_radians()).as_quat().to_array();
    let at = |interpolation: &str, keys: &[[f32; 4]], time: f64| {
        let asset = playing(&animated("rotation", interpolation, "VEC4", &[0.0, 1.0], &keys.concat()));
        let x = moved(&asset, time, DVec3::X);
        (x.y.atan2(x.x).to_degrees(), x.length())
    };
    let negated = about_z(90.0).map(|value| -value);
    let long = about_z(90.0).map(|value| value * 3.0);
    for (name, end, expected) in [
        ("90", about_z(90.0), 30.0),
        ("90 by the other quaternion", negated, 30.0),
        ("270 is −90", about_z(270.0), -30.0),
        ("not of length 1", long, 30.0),
        ("the same", about_z(0.0), 0.0),
    ] {
        let (angle, length) = at("LINEAR", &[about_z(0.0), end], 1.0 / 3.0);
        assert!((angle - expected).abs() < 1e-4 && (length - 1.0).abs() < 1e-6, "{name}: {angle}, {length}");
    }
    // Halfway between 0 and 90 degrees without tangents lies the mean of the quaternions, which is shorter than 1.
    let none = [0.0; 4];
    let (angle, length) = at("CUBICSPLINE", &[none, about_z(0.0), none, none, about_z(90.0), none], 0.5);
    assert!((angle - 45.0).abs() < 1e-4 && (length - 1.0).abs() < 1e-6, "{angle}, {length}");
    let (angle, length) = at("STEP", &[long, about_z(0.0)], 0.5);
    assert!((angle - 90.0).abs() < 1e-4 && (length - 1.0).abs() < 1e-6, "{angle}, {length}");
}

#[test]
fn normalised_integers_as_key_values() {
    let mut builder = Builder::default();
    let positions = builder.floats("VEC3", &TRIANGLE);
    let input = builder.floats("SCALAR", &[0.0]);
    let view = builder.view(&[0, 0, 127, 0], None);
    let output = json!({"bufferView": view, "componentType": 5120, "normalized": true, "type": "VEC4", "count": 1});
    let output = builder.accessor(output);
    let more = json!({"animations": [{"channels": [{"sampler": 0, "target": {"node": 0, "path": "rotation"}}],
        "samplers": [{"input": input, "output": output}]}]});
    let asset = playing(&builder.document(json!({"attributes": {"POSITION": positions}}), more));
    assert_close("half a turn about z", moved(&asset, 0.0, DVec3::X), DVec3::NEG_X);
}

#[test]
fn which_animation_plays_and_when() {
    let mut document = animated("translation", "LINEAR", "VEC3", &[0.0, 2.0], &[1.0, 0.0, 0.0, 3.0, 0.0, 0.0]);
    let mut second = document["animations"][0].clone();
    second["name"] = "second".into();
    second["channels"][0]["target"]["path"] = "scale".into();
    document["animations"].as_array_mut().unwrap().push(second);
    document["nodes"][0]["translation"] = json!([7, 0, 0]);
    let shown = |animation: Option<&str>, at: Option<f64>| {
        let options = ReadOptions { animation: animation.map(str::to_owned), at, ..ReadOptions::default() };
        let asset = open(&document, &options)?;
        let duration = asset.duration();
        asset.into_scene().map(|scene| (scene.instances[0].world_from_object.transform_point3(DVec3::X), duration))
    };
    let expected = [
        (None, None, DVec3::X * 8.0, 0.0),
        (None, Some(1.0), DVec3::X * 3.0, 2.0),
        (Some("0"), None, DVec3::X * 2.0, 2.0),
        (Some("second"), Some(1.0), DVec3::X * 9.0, 2.0),
        (Some("1"), Some(2.0), DVec3::X * 10.0, 2.0),
    ];
    for (animation, at, point, duration) in expected {
        let (own, own_duration) = shown(animation, at).unwrap();
        assert_close(&format!("{animation:?} {at:?}"), own, point);
        assert_eq!(own_duration, duration, "{animation:?} {at:?}");
    }
    assert!(has_warning(&still(&document), "not played: 2 animations"));
    for (animation, at, fault) in [
        (Some("third"), None, "no animation 'third'; it has 0 '', 1 'second'"),
        (None, Some(f64::NAN), "must be a number of seconds"),
    ] {
        let error = shown(animation, at).err().map(|error| error.to_string()).unwrap_or_default();
        assert!(error.contains(fault), "{error}");
    }
    document["animations"] = json!([]);
    assert!(has_warning(&playing(&document).scene(0.0).unwrap(), "has no animation"));
}

#[test]
fn channels_that_make_no_sense_are_left_out() {
    let good = animated("translation", "LINEAR", "VEC3", &[0.0, 1.0], &[1.0; 6]);
    for (pointer, value, fault) in [
        ("/animations/0/channels/0/target/path", json!("colour"), "its path is 'colour'"),
        ("/animations/0/channels/0/target/path", json!("rotation"), "do not fit"),
        ("/animations/0/samplers/0/interpolation", json!("CUBICSPLINE"), "do not fit"),
        ("/animations/0/samplers/0/interpolation", json!("BEZIER"), "interpolation is 'BEZIER'"),
        ("/animations/0/samplers/0/input", json!(2), "no scalars"),
        ("/animations/0/channels", json!(7), "ignored: animations[0]"),
    ] {
        let mut document = good.clone();
        *document.pointer_mut(pointer).unwrap() = value;
        let scene = playing(&document).scene(1.0).unwrap();
        assert!(has_warning(&scene, fault), "{pointer}: {:?}", scene.warnings);
        assert_eq!(scene.instances[0].world_from_object, glam::DMat4::IDENTITY);
    }
    let backward = playing(&animated("translation", "LINEAR", "VEC3", &[1.0, 0.0], &[1.0; 6])).scene(0.5).unwrap();
    assert!(has_warning(&backward, "times do not increase"));
    // A pointer has no node: the rest of the document is read all the same, in types too.
    let mut document = good.clone();
    let channels = document["animations"][0]["channels"].as_array_mut().unwrap();
    channels.push(json!({"sampler": 0, "target": {"path": "pointer", "extensions": {"KHR_animation_pointer": {}}}}));
    document["extensionsUsed"] = json!(["KHR_animation_pointer"]);
    let asset = playing(&document);
    assert!(has_warning(&asset.scene(0.0).unwrap(), "ignored: extension KHR_animation_pointer"));
    assert_close("the other channel", moved(&asset, 0.0, DVec3::ZERO), DVec3::ONE);
}

#[test]
fn weights_of_morph_targets_by_precedence() {
    let mut builder = Builder::default();
    let positions = builder.floats("VEC3", &TRIANGLE);
    let (up, along) =
        (builder.floats("VEC3", &[0.0, 0.0, 1.0].repeat(3)), builder.floats("VEC3", &[0.0, 1.0, 0.0].repeat(3)));
    let (input, output) = (builder.floats("SCALAR", &[0.0, 1.0]), builder.floats("SCALAR", &[0.0, 0.0, 1.0, 2.0]));
    let primitive = json!({"attributes": {"POSITION": positions}, "targets": [{"POSITION": up}, {"POSITION": along}]});
    let mut document = builder.document(primitive, json!({"nodes": [{"mesh": 0}, {"mesh": 0}, {"mesh": 0, "translation": [5, 0, 0]}],
        "scenes": [{"nodes": [0, 1, 2]}], "animations": [{"channels": [{"sampler": 0, "target": {"node": 2, "path": "weights"}}],
        "samplers": [{"input": input, "output": output}]}]}));
    let first_corner = |scene: &Scene, instance: usize| {
        let instance = &scene.instances[instance];
        instance.world_from_object.transform_point3(scene.meshes[instance.mesh].positions[0].as_dvec3())
    };
    // Nothing is morphed: one mesh, shared.
    let scene = still(&document);
    assert_eq!((scene.meshes.len(), scene.instances.iter().all(|instance| instance.mesh == 0)), (1, true));
    document["meshes"][0]["weights"] = json!([0.25, 0.0]);
    document["nodes"][1]["weights"] = json!([0.5, 0.0]);
    let scene = still(&document);
    let heights: Vec<f64> = (0..3).map(|instance| first_corner(&scene, instance).z).collect();
    assert_eq!((heights, scene.meshes.len()), (vec![0.25, 0.5, 0.25], 3));
    assert!(scene.meshes.iter().all(|mesh| mesh.normals.is_empty()), "flat stays flat");
    let asset = playing(&document);
    assert_close("animated", first_corner(&asset.scene(0.5).unwrap(), 2), DVec3::new(5.0, 1.0, 0.5));
    assert_close("by its node", first_corner(&asset.scene(0.5).unwrap(), 1), DVec3::Z * 0.5);
    // At 0 s the animation takes all weights away: this node has the mesh as it is.
    let scene = asset.scene(0.0).unwrap();
    assert_close("at rest", first_corner(&scene, 2), DVec3::X * 5.0);
    assert_eq!(scene.meshes.len(), 3);
    assert_eq!(asset.contents().morphs, [("meshes[0]".to_owned(), 2)]);
}

#[test]
fn morphed_normals_have_length_one() {
    let mut builder = Builder::default();
    let positions = builder.floats("VEC3", &TRIANGLE);
    let normals = builder.floats("VEC3", &[0.0, 0.0, 1.0].repeat(3));
    let turned = builder.floats("VEC3", &[1.0, 0.0, -1.0].repeat(3));
    let primitive = json!({"attributes": {"POSITION": positions, "NORMAL": normals},
        "targets": [{"POSITION": positions, "NORMAL": turned, "TEXCOORD_0": positions}]});
    let mut document = builder.document(primitive, json!({}));
    document["meshes"][0]["weights"] = json!([0.5]);
    let scene = still(&document);
    assert!(scene.meshes[0].normals[0].distance(Vec3::new(1.0, 0.0, 1.0).normalize()) < 1e-6);
    assert!(has_warning(&scene, "ignored: morph targets of TEXCOORD_0"));
}

#[test]
fn variants_choose_materials() {
    let mut builder = Builder::default();
    let positions = builder.floats("VEC3", &TRIANGLE);
    let mapping = |material: usize, variants: &[usize]| json!({"material": material, "variants": variants});
    let primitive = json!({"attributes": {"POSITION": positions}, "material": 0, "extensions": {"KHR_materials_variants":
        {"mappings": [mapping(1, &[0]), mapping(2, &[1, 2]), mapping(9, &[3])]}}});
    let names = ["a", "b", "c", "broken", "unmapped"].map(|name| json!({"name": name}));
    let mut document = builder.document(primitive, json!({"materials": [{}, {}, {}], "extensionsUsed": ["KHR_materials_variants"],
        "extensionsRequired": ["KHR_materials_variants"], "extensions": {"KHR_materials_variants": {"variants": names}}}));
    let plain = json!({"attributes": {"POSITION": positions}, "material": 0});
    document["meshes"][0]["primitives"].as_array_mut().unwrap().push(plain);
    let materials = |variant: Option<&str>| {
        let options = ReadOptions { variant: variant.map(str::to_owned), ..ReadOptions::default() };
        let scene = open(&document, &options)?.into_scene()?;
        Ok::<_, glimt::Error>([scene.meshes[0].material, scene.meshes[1].material])
    };
    for (variant, expected) in
        [(None, 0), (Some("a"), 1), (Some("b"), 2), (Some("2"), 2), (Some("broken"), 0), (Some("unmapped"), 0)]
    {
        assert_eq!(materials(variant).unwrap(), [expected, 0], "{variant:?}");
    }
    let error = materials(Some("d")).unwrap_err();
    assert!(error.exit_code() == 2 && error.to_string().contains("no variant 'd'; it has 0 'a', 1 'b'"), "{error}");
}

#[test]
fn hidden_nodes_hide_what_is_below_but_no_camera() {
    let mut builder = Builder::default();
    let positions = builder.floats("VEC3", &TRIANGLE);
    let hidden = json!({"KHR_node_visibility": {"visible": false}});
    let shown = json!({"KHR_node_visibility": {"visible": true}});
    let document = builder.document(
        json!({"attributes": {"POSITION": positions}}),
        json!({"extensionsUsed": ["KHR_node_visibility", "KHR_lights_punctual"], "extensionsRequired": ["KHR_node_visibility"],
            "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point"}]}},
            "cameras": [{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}],
            "nodes": [{"mesh": 0, "extensions": shown}, {"mesh": 0, "extensions": hidden, "children": [2, 3, 4]},
                {"mesh": 0, "extensions": shown}, {"camera": 0}, {"extensions": {"KHR_lights_punctual": {"light": 0}}}],
            "scenes": [{"nodes": [0, 1]}]}),
    );
    let scene = still(&document);
    assert_eq!((scene.instances.len(), scene.cameras.len(), scene.lights.len()), (1, 1, 0));
    assert!(scene.has_lights);
}

#[test]
fn the_hands_of_a_clock() {
    // A chain of joints all turned by the same track adds up.
    let mut document = animated("rotation", "LINEAR", "VEC4", &[0.0, 1.0], &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0]);
    document["nodes"] = json!([{"children": [1]}, {"mesh": 0, "translation": [1, 0, 0]}]);
    let mut channel = document["animations"][0]["channels"][0].clone();
    channel["target"]["node"] = 1.into();
    document["animations"][0]["channels"].as_array_mut().unwrap().push(channel);
    let asset = playing(&document);
    let angle: f64 = PI / 4.0;
    let expected = DVec3::new(angle.cos() + FRAC_PI_2.cos(), angle.sin() + FRAC_PI_2.sin(), 0.0);
    assert_close("tip", moved(&asset, 0.25, DVec3::X), expected);
}
