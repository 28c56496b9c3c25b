//! Skins, and morph targets below them, against values computed by hand.

use super::documents::{message, Builder};
use super::poses::{assert_close, has_warning, open, still};
use glam::{DVec3, Vec3};
use glimt::scene::gltf::{self, Asset, ReadOptions};
use glimt::Scene;
use serde_json::{json, Value};
use std::f64::consts::FRAC_1_SQRT_2;

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
