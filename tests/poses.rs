//! What a file shows at a time: animations, skins, morph targets; variants and visibility.

use super::gltf::{message, Builder, TRIANGLE};
use super::support::renderer;
use glam::{DQuat, DVec3, Vec3};
use glimt::render::Prepared;
use glimt::scene::gltf::{self, Asset, ReadOptions};
use glimt::scene::{CameraChoice, Instance, Mesh};
use glimt::{Options, Result, Scene};
use serde_json::{json, Value};
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI};

fn open(document: &Value, options: &ReadOptions) -> Result<Asset> {
    gltf::open_bytes(document.to_string().as_bytes(), "test".into(), "test.gltf", None, options)
}

fn playing(document: &Value) -> Asset {
    open(document, &ReadOptions { at: Some(0.0), ..ReadOptions::default() }).unwrap_or_else(|error| panic!("{error}"))
}

fn still(document: &Value) -> Scene {
    open(document, &ReadOptions::default()).and_then(Asset::into_scene).unwrap_or_else(|error| panic!("{error}"))
}

fn has_warning(scene: &Scene, text: &str) -> bool {
    scene.warnings.iter().any(|warning| warning.contains(text))
}

fn assert_close(what: &str, own: DVec3, expected: DVec3) {
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

/// Three vertices at x = 2 that look along x; joint 0 at the origin, joint 1 at x = 1 turned by 90° about z. The mesh's own node
/// is somewhere else, which has no influence.
struct Skinned {
    builder: Builder,
    attributes: Value,
    more: Value,
}

impl Skinned {
    fn new() -> Self {
        let mut builder = Builder::default();
        let positions = builder.floats("VEC3", &[2.0, 0.0, 0.0, 2.0, 0.0, 0.0, 2.0, 0.0, 1.0]);
        let normals = builder.floats("VEC3", &[1.0, 0.0, 0.0].repeat(3));
        let moved = |x: f32| [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, x, 0.0, 0.0, 1.0];
        let inverse = builder.floats("MAT4", &[moved(0.0), moved(-1.0)].concat());
        let more = json!({
            "nodes": [{"mesh": 0, "skin": 0, "translation": [100, 0, 0]}, {"children": [2]},
                {"translation": [1, 0, 0], "rotation": [0, 0, FRAC_1_SQRT_2, FRAC_1_SQRT_2]}],
            "scenes": [{"nodes": [0, 1]}],
            "skins": [{"joints": [1, 2], "inverseBindMatrices": inverse}]});
        Self { builder, attributes: json!({"POSITION": positions, "NORMAL": normals}), more }
    }

    /// One set of joints 0 and 1 with these weights.
    fn weights(mut self, set: usize, joints: [u8; 4], weights: [[f32; 4]; 3]) -> Self {
        let view = self.builder.view(&joints.repeat(3), None);
        let joints = json!({"bufferView": view, "componentType": 5121, "type": "VEC4", "count": 3});
        self.attributes[format!("JOINTS_{set}")] = self.builder.accessor(joints).into();
        self.attributes[format!("WEIGHTS_{set}")] = self.builder.floats("VEC4", &weights.concat()).into();
        self
    }

    fn document(&self) -> Value {
        self.builder.document(json!({"attributes": self.attributes}), self.more.clone())
    }

    fn check(&self, expected: [DVec3; 3]) -> Scene {
        let scene = still(&self.document());
        assert_eq!(scene.instances[0].world_from_object, glam::DMat4::IDENTITY);
        let mesh = &scene.meshes[scene.instances[0].mesh];
        for (own, expected) in mesh.positions.iter().zip(expected) {
            assert_close("vertex", own.as_dvec3(), expected);
        }
        scene
    }
}

const FIRST: [f32; 4] = [1.0, 0.0, 0.0, 0.0];
const SECOND: [f32; 4] = [0.0, 1.0, 0.0, 0.0];
const HALF: [f32; 4] = [0.5, 0.5, 0.0, 0.0];

#[test]
fn vertices_follow_two_joints() {
    let scene = Skinned::new().weights(0, [0, 1, 0, 0], [FIRST, HALF, SECOND]).check([
        DVec3::new(2.0, 0.0, 0.0),
        DVec3::new(1.5, 0.5, 0.0),
        DVec3::new(1.0, 1.0, 1.0),
    ]);
    let normals = &scene.meshes[0].normals;
    assert!(normals[0].distance(Vec3::X) < 1e-6 && normals[2].distance(Vec3::Y) < 1e-6, "{normals:?}");
    assert!((normals[1].length() - 1.0).abs() < 1e-6, "{normals:?}");
    assert!(scene.warnings.iter().all(|warning| !warning.contains("weights")), "{:?}", scene.warnings);
    // Without inverse bind matrices the joint's own transform is all: turned, then moved by 1.
    let mut bare = Skinned::new().weights(0, [0, 1, 0, 0], [FIRST, FIRST, SECOND]);
    bare.more["skins"][0].as_object_mut().unwrap().remove("inverseBindMatrices");
    bare.check([DVec3::X * 2.0, DVec3::X * 2.0, DVec3::new(1.0, 2.0, 1.0)]);
}

#[test]
fn normals_by_the_inverse_transpose() {
    let mut skinned = Skinned::new().weights(0, [0, 1, 0, 0], [FIRST; 3]);
    let diagonal = builder_normals(&mut skinned, [1.0, 1.0, 0.0]);
    skinned.attributes["NORMAL"] = diagonal.into();
    // Twice as wide: what looked along (1, 1) looks along (½, 1).
    skinned.more["nodes"][1]["scale"] = json!([2, 1, 1]);
    let scene = still(&skinned.document());
    let expected = Vec3::new(0.5, 1.0, 0.0).normalize();
    assert!(scene.meshes[0].normals[0].distance(expected) < 1e-6, "{:?}", scene.meshes[0].normals);
    assert_eq!(scene.meshes[0].triangles, [[0, 1, 2]]);
    // Mirrored: the front stays outside, so the corners turn round and the normals are mirrored as the shape is.
    skinned.more["nodes"][1]["scale"] = json!([-2, 1, 1]);
    let scene = still(&skinned.document());
    let expected = Vec3::new(-0.5, 1.0, 0.0).normalize();
    assert!(scene.meshes[0].normals[0].distance(expected) < 1e-6, "{:?}", scene.meshes[0].normals);
    assert_eq!(scene.meshes[0].triangles, [[0, 2, 1]]);
}

fn builder_normals(skinned: &mut Skinned, normal: [f32; 3]) -> usize {
    skinned.builder.floats("VEC3", &normal.repeat(3))
}

#[test]
fn weights_that_do_not_sum_to_one() {
    let scene = Skinned::new().weights(0, [0, 1, 0, 0], [[2.0, 2.0, 0.0, 0.0], [0.1; 4], [0.0; 4]]).check([
        DVec3::new(1.5, 0.5, 0.0),
        // Joint 0 three times, joint 1 once.
        DVec3::new(1.75, 0.25, 0.0),
        DVec3::new(2.0, 0.0, 1.0),
    ]);
    assert!(has_warning(&scene, "1 vertices have no weights") && has_warning(&scene, "2 vertices do not sum to 1"));
}

#[test]
fn more_than_four_joints_and_quantised_weights() {
    let quarter = [0.25, 0.0, 0.0, 0.0];
    let rest = [0.75, 0.0, 0.0, 0.0];
    Skinned::new().weights(0, [0; 4], [quarter; 3]).weights(1, [1, 0, 0, 0], [rest; 3]).check([
        DVec3::new(1.25, 0.75, 0.0),
        DVec3::new(1.25, 0.75, 0.0),
        DVec3::new(1.25, 0.75, 1.0),
    ]);
    let mut skinned = Skinned::new().weights(0, [0, 1, 0, 0], [FIRST; 3]);
    let view = skinned.builder.view(&[51, 204, 0, 0].repeat(3), None);
    let weights = json!({"bufferView": view, "componentType": 5121, "normalized": true, "type": "VEC4", "count": 3});
    skinned.attributes["WEIGHTS_0"] = skinned.builder.accessor(weights).into();
    skinned.check([DVec3::new(1.2, 0.8, 0.0), DVec3::new(1.2, 0.8, 0.0), DVec3::new(1.2, 0.8, 1.0)]);
}

#[test]
fn faults_of_skins() {
    let beyond = Skinned::new().weights(0, [0, 2, 0, 0], [SECOND; 3]);
    assert!(message(open(&beyond.document(), &ReadOptions::default()).and_then(Asset::into_scene))
        .contains("joint 2, but skins[0] has 2 joints"));
    // One that moves nothing may be any.
    let _ = still(&Skinned::new().weights(0, [0, 2, 0, 0], [FIRST; 3]).document());
    let mut few = Skinned::new().weights(0, [0, 1, 0, 0], [FIRST; 3]);
    few.more["skins"][0]["joints"] = json!([1, 2, 1]);
    assert!(message(open(&few.document(), &ReadOptions::default()).and_then(Asset::into_scene))
        .contains("skins[0] has 3 joints, but 2 inverse bind matrices"));
    let mut apart = Skinned::new().weights(0, [0, 1, 0, 0], [FIRST; 3]);
    apart.more["nodes"][1].as_object_mut().unwrap().remove("children");
    assert!(has_warning(&still(&apart.document()), "no common root"));
    let mut outside = Skinned::new().weights(0, [0, 1, 0, 0], [FIRST, FIRST, SECOND]);
    outside.more["scenes"] = json!([{"nodes": [0]}]);
    let scene = outside.check([DVec3::X * 2.0, DVec3::X * 2.0, DVec3::new(1.0, 1.0, 1.0)]);
    assert!(has_warning(&scene, "do not belong to the scene"));
}

#[test]
fn morphed_before_skinned() {
    let mut skinned = Skinned::new().weights(0, [0, 1, 0, 0], [FIRST, SECOND, SECOND]);
    let target = skinned.builder.floats("VEC3", &[1.0, 0.0, 0.0].repeat(3));
    let mut document = skinned.document();
    document["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": target}]);
    document["meshes"][0]["weights"] = json!([0.5]);
    let mesh = &still(&document).meshes[0];
    for (own, expected) in
        mesh.positions.iter().zip([DVec3::new(2.5, 0.0, 0.0), DVec3::new(1.0, 1.5, 0.0), DVec3::new(1.0, 1.5, 1.0)])
    {
        assert_close("vertex", own.as_dvec3(), expected);
    }
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
fn any_change_of_a_document_has_an_answer() {
    let mut skinned = Skinned::new().weights(0, [0, 1, 0, 0], [FIRST, HALF, SECOND]);
    let target = skinned.builder.floats("VEC3", &[1.0, 0.0, 0.0].repeat(3));
    let (input, output) =
        (skinned.builder.floats("SCALAR", &[0.0, 1.0]), skinned.builder.floats("SCALAR", &[0.0, 1.0]));
    let turns = skinned.builder.floats("VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0]);
    let mut document = skinned.document();
    document["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": target}]);
    document["animations"] = json!([{"channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}},
        {"sampler": 1, "target": {"node": 2, "path": "rotation"}}],
        "samplers": [{"input": input, "output": output}, {"input": input, "output": turns}]}]);
    let text = document.to_string();
    let play = |text: &[u8]| {
        let options = ReadOptions { at: Some(0.5), ..ReadOptions::default() };
        let asset = gltf::open_bytes(text, "test".into(), "test.gltf", None, &options)?;
        [-1.0, 0.3, 7.0].into_iter().try_for_each(|at| asset.scene(at).map(drop))
    };
    play(text.as_bytes()).unwrap();
    let mut refused = 0;
    for at in 0..text.len() {
        for byte in [b'0', b'7', b'-', b'n'] {
            let mut bytes = text.clone().into_bytes();
            bytes[at] = byte;
            // Either answer is right; what counts is that there is one.
            refused += usize::from(play(&bytes).is_err());
        }
    }
    println!("{refused} of {} documents refused", 4 * text.len());
    assert!(refused > 0);
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

/// A wavy sheet of 800 triangles from x = 0 to 2 whose far half is turned by the second joint, up to half a turn in 1 s.
fn bending_sheet() -> Value {
    const SIDE: u32 = 21;
    let mut builder = Builder::default();
    let grid = || (0..SIDE * SIDE).map(|i| ((i % SIDE) as f32 / 10.0, (i / SIDE) as f32 / 10.0));
    let positions: Vec<f32> = grid().flat_map(|(x, z)| [x, 0.1 * (7.0 * z).sin(), z]).collect();
    let weights: Vec<f32> = grid().flat_map(|(x, _)| [1.0 - (x / 2.0), x / 2.0, 0.0, 0.0]).collect();
    let quads = (0..SIDE * (SIDE - 1)).filter(|i| i % SIDE + 1 < SIDE);
    let corners = quads.flat_map(|i| [i, i + SIDE, i + 1, i + 1, i + SIDE, i + SIDE + 1]);
    let indices: Vec<u8> = corners.flat_map(|i| (i as u16).to_le_bytes()).collect();
    let (count, positions) = (indices.len() / 2, builder.floats("VEC3", &positions));
    let view = builder.view(&indices, None);
    let indices = json!({"bufferView": view, "componentType": 5123, "type": "SCALAR", "count": count});
    let indices = builder.accessor(indices);
    let view = builder.view(&[0, 1, 0, 0].repeat((SIDE * SIDE) as usize), None);
    let joints = json!({"bufferView": view, "componentType": 5121, "type": "VEC4", "count": SIDE * SIDE});
    let joints = builder.accessor(joints);
    let weights = builder.floats("VEC4", &weights);
    let input = builder.floats("SCALAR", &[0.0, 1.0]);
    let output = builder.floats("VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0]);
    let attributes = json!({"POSITION": positions, "JOINTS_0": joints, "WEIGHTS_0": weights});
    builder.document(
        json!({"attributes": attributes, "indices": indices, "material": 0}),
        json!({"materials": [{"doubleSided": true}], "nodes": [{"mesh": 0, "skin": 0, "children": [1]}, {}],
            "skins": [{"joints": [0, 1]}],
            "animations": [{"channels": [{"sampler": 0, "target": {"node": 1, "path": "rotation"}}],
                "samplers": [{"input": input, "output": output}]}]}),
    )
}

#[test]
fn a_sequence_is_its_single_pictures() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("sheet.gltf"), bending_sheet().to_string()).unwrap();
    let view = ["--size", "48x32", "--spp", "4", "--orbit", "30,50,6", "--target", "0,0,1", "--bvh", "fast"];
    let run = |more: &[&str]| {
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_glimt"))
            .current_dir(folder.path())
            .args(["render", "sheet.gltf"])
            .args(view)
            .args(more)
            .output()
            .unwrap();
        assert!(output.status.success(), "{more:?}: {}", String::from_utf8_lossy(&output.stderr));
        output
    };
    let output = run(&["--frames", "0..9", "--fps", "8", "-o", "frame_{:03}.png", "--json"]);
    let reports: Vec<Value> = output
        .stdout
        .split_inclusive(|byte| *byte == b'\n')
        .map(|line| serde_json::from_slice(line).unwrap())
        .collect();
    assert_eq!(reports.len(), 9);
    let mut refitted = 0;
    for (frame, report) in reports.iter().enumerate() {
        assert_eq!(
            (&report["frame"]["number"], &report["frame"]["seconds"]),
            (&json!(frame), &json!(frame as f64 / 8.0))
        );
        let update = &report["bvh"]["update"];
        println!("frame {frame}: {update}");
        assert_eq!(update.is_null(), frame == 0);
        refitted += usize::from(update["action"] == "refitted");
        let at = (frame as f64 / 8.0).to_string();
        run(&["--at", &at, "-o", "single.png", "-q"]);
        let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
        let picture = read(&format!("frame_{frame:03}.png"));
        assert!(picture == read("single.png"), "frame {frame}");
        assert!(frame == 0 || frame == 8 || picture != read("frame_000.png"), "frame {frame} is the first again");
    }
    assert!(refitted >= 3, "{refitted} trees refitted");
    // A camera that frames the scene by itself stands where the first frame has it.
    let framed = ["--size", "48x32", "--frames", "0..8", "--fps", "8", "-o", "auto_{}.png"];
    let run = |args: &[&str]| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_glimt"));
        command.current_dir(folder.path()).args(["render", "sheet.gltf"]).args(args).output().unwrap()
    };
    assert!(run(&framed).status.success());
    let single = run(&["--size", "48x32", "--at", "0.5", "-o", "own.png"]);
    assert!(single.status.success());
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert!(read("auto_4.png") != read("own.png"), "the camera of frame 4 is not its own");
    for (wrong, fault) in [
        (&["--frames", "0..3", "-o", "a.png"][..], "must have {} or {:04}"),
        (&["--frames", "3..3", "-o", "{}.png"], "must be A..B"),
        (&["--frames", "0..3", "-o", "-"], "must have {} or {:04}"),
        (&["--frames", "0..3", "--at", "1", "-o", "{}.png"], "cannot be used with"),
        (&["--frames", "0..3", "-o", "{}.jpg"], "cannot tell the format"),
        (&["--fps", "3"], "--frames"),
    ] {
        let output = run(wrong);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(2) && message.contains(fault), "{wrong:?}: {message}");
    }
}

#[test]
fn trees_are_rebuilt_when_they_become_loose_and_no_picture_shows_it() {
    // The same number of triangles, in another order each time: a tree for the one is useless for the other.
    let scene = |salt: u32| {
        let noise = |i: u32| ((i + 977 * salt).wrapping_mul(2_654_435_761) >> 8) as f32 / (1 << 24) as f32;
        let corner = |i: u32| Vec3::new(noise(3 * (i / 3)), noise(3 * (i / 3) + 1), noise(3 * (i / 3) + 2)) * 4.0;
        let offset = |i: u32| [Vec3::ZERO, Vec3::X * 0.3, Vec3::new(0.0, 0.3, 0.1)][i as usize % 3];
        Scene {
            meshes: vec![Mesh {
                positions: (0..1500).map(|i| corner(i) + offset(i)).collect(),
                triangles: (0..500).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
                ..Mesh::default()
            }],
            instances: vec![Instance { mesh: 0, world_from_object: glam::DMat4::IDENTITY }],
            materials: vec![glimt::scene::Material::default()],
            ..Scene::default()
        }
    };
    let camera = CameraChoice::LookAt { eye: DVec3::new(8.0, 5.0, 9.0), target: Some(DVec3::splat(2.0)) };
    let options = Options { size: (64, 48), camera, ..Options::default() };
    let (first, second) = (scene(1), scene(2));
    let first_tree = Prepared::new(&first, &options).unwrap().tree(&options);
    assert_eq!(first_tree.report().update, None);
    let same = Prepared::new(&first, &options).unwrap().next_tree(&options, &first_tree);
    let kept = same.report().update.unwrap();
    println!("{kept:?}");
    let prepared = Prepared::new(&second, &options).unwrap();
    let tree = prepared.next_tree(&options, &first_tree);
    let update = tree.report().update.unwrap();
    println!("{update:?}");
    assert!(update.action == "rebuilt" && update.refitted_cost > update.built_cost.map(|built| 1.3 * built));
    let fewer = {
        let mut scene = scene(1);
        scene.meshes[0].triangles.pop();
        scene
    };
    let other = Prepared::new(&fewer, &options).unwrap().next_tree(&options, &first_tree).report().update.unwrap();
    assert_eq!((other.action, other.refitted_cost), ("rebuilt", None));
    let (film, _) = renderer().render_with_tree(&second, &prepared, &options, &tree).unwrap();
    let (fresh, _) = renderer().render(&second, &options).unwrap();
    assert!(film.pixels == fresh.pixels);
}
