//! Sequences of an animation: every picture is the one of its time, whatever became of the tree.

use super::documents::Builder;
use super::support::renderer;
use glam::{DVec3, Vec3};
use glimt::render::Prepared;
use glimt::scene::{CameraChoice, Instance, Mesh};
use glimt::{Options, Scene};
use serde_json::{json, Value};

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
