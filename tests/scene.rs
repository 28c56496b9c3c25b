//! Shapes, the soup, cameras, materials.

use glam::{DMat4, DVec3, Vec3};
use glimt::scene::{built_in, shapes, CameraChoice, Instance, Material, Mesh, Soup, BUILT_IN};
use glimt::{Options, Scene};
use std::collections::HashMap;

/// Every directed edge has its opposite exactly once: closed and consistently wound. Vertices are equal by position.
fn assert_closed(mesh: &Mesh) {
    let key = |corner: u32| mesh.positions[corner as usize].to_array().map(|x| (x * 1e5).round() as i64);
    let mut edges: HashMap<_, i32> = HashMap::new();
    for [a, b, c] in &mesh.triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            *edges.entry((key(*from), key(*to))).or_default() += 1;
            *edges.entry((key(*to), key(*from))).or_default() -= 1;
        }
    }
    assert!(edges.values().all(|count| *count == 0), "{}", mesh.name);
}

/// Six times the volume enclosed; positive when faces look outward.
fn volume(mesh: &Mesh) -> f32 {
    let corner = |i: u32| mesh.positions[i as usize];
    mesh.triangles.iter().map(|[a, b, c]| corner(*a).dot(corner(*b).cross(corner(*c)))).sum()
}

#[test]
fn shapes_are_made_of_their_triangles() {
    let square = shapes::square([Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y]);
    assert_eq!(square.triangles, [[0, 1, 2], [0, 2, 3]], "A B C and A C D");
    let cube = shapes::cube();
    assert_eq!((cube.positions.len(), cube.triangles.len()), (8, 12));
    assert_closed(&cube);
    assert!((volume(&cube) / 6.0 - 1.0).abs() < 1e-6);
    let sphere = shapes::sphere(32);
    assert_closed(&sphere);
    let exact = 4.0 / 3.0 * std::f32::consts::PI;
    assert!((volume(&sphere) / 6.0 - exact).abs() < 0.01 * exact);
    assert!(sphere.positions.iter().zip(&sphere.normals).all(|(p, n)| p.dot(*n) > 0.999_99));
}

#[test]
fn built_in_scenes_are_whole() {
    for (name, _) in BUILT_IN {
        let scene = built_in(name).unwrap();
        let soup = Soup::of(&scene).unwrap();
        assert!(soup.len() == scene.triangle_count() && soup.warnings.is_empty(), "{name}: {:?}", soup.warnings);
        assert!(!scene.lights.is_empty() && scene.cameras.len() == 1, "{name}");
    }
    let table = built_in("table").unwrap();
    let cubes: Vec<&Instance> = table.instances.iter().filter(|i| table.meshes[i.mesh].name == "cube").collect();
    assert_eq!(cubes.len(), 5, "top and four legs");
    assert!(cubes.iter().all(|cube| cube.mesh == cubes[0].mesh), "are one cube");
    assert!(built_in("nothing").is_err());
}

fn one_mesh(mesh: Mesh, world_from_object: DMat4) -> Scene {
    Scene {
        meshes: vec![mesh],
        instances: vec![Instance { mesh: 0, world_from_object }],
        materials: vec![Material::default()],
        ..Scene::default()
    }
}

#[test]
fn normals_follow_the_inverse_transpose_and_mirrors_keep_the_front() {
    let cases = [
        DMat4::from_scale(DVec3::new(1.0, 2.0, 1e-6)),
        DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0)),
        DMat4::from_scale(DVec3::new(1e-9, 1e9, 1.0)) * DMat4::from_rotation_x(0.5),
        DMat4::from_translation(DVec3::splat(1e8))
            * DMat4::from_rotation_y(1.0)
            * DMat4::from_scale(DVec3::new(3.0, -0.1, 7.0)),
    ];
    for matrix in cases {
        let soup = Soup::of(&one_mesh(shapes::sphere(16), matrix)).unwrap();
        let inverse_transpose = glam::DMat3::from_mat4(matrix).inverse().transpose();
        let sphere = shapes::sphere(16);
        for (triangle, normals) in soup.normals.iter().enumerate() {
            let corners = sphere.triangles[triangle].map(|corner| corner as usize);
            let expected = (inverse_transpose * sphere.normals[corners[0]].as_dvec3()).normalize();
            assert!(normals[0].as_dvec3().dot(expected) > 1.0 - 1e-6, "{matrix}: {} {expected}", normals[0]);
            let [a, b, c] = soup.positions[triangle];
            let face = (b - a).normalize().cross((c - a).normalize());
            let mean: DVec3 = normals.iter().map(|normal| normal.as_dvec3()).sum();
            assert!(face.dot(mean) > 0.0, "{matrix}: the front faces the other way");
        }
    }
}

#[test]
fn flattened_and_broken_instances_are_dropped_with_a_warning() {
    let soup = Soup::of(&one_mesh(shapes::cube(), DMat4::from_scale(DVec3::new(1.0, 0.0, 1.0)))).unwrap();
    assert!(soup.is_empty() && soup.warnings.len() == 2, "{:?}", soup.warnings);
    let mut mesh = shapes::cube();
    mesh.positions[0].x = f32::NAN;
    let soup = Soup::of(&one_mesh(mesh, DMat4::IDENTITY)).unwrap();
    assert_eq!(soup.len(), 12 - shapes::cube().triangles.iter().filter(|t| t.contains(&0)).count());
    assert!(soup.warnings[0].contains("not a finite number"), "{:?}", soup.warnings);
}

#[test]
fn the_orbit_convention() {
    let scene = built_in("table").unwrap();
    let soup = Soup::of(&scene).unwrap();
    let at = |theta, phi, radius| {
        let choice = CameraChoice::Orbit { theta, phi, radius, target: Some(DVec3::ONE) };
        scene.camera(&soup, &choice, DVec3::Y, None, 1.0).unwrap()
    };
    let near = |a: DVec3, b: DVec3| a.distance(b) < 1e-12;
    assert!(near(at(0.0, 90.0, 2.0).eye, DVec3::new(1.0, 1.0, 3.0)), "theta 0: +z");
    assert!(near(at(90.0, 90.0, 2.0).eye, DVec3::new(3.0, 1.0, 1.0)), "theta 90: +x");
    assert!(near(at(0.0, 90.0, 2.0).forward, DVec3::NEG_Z));
    let inside = at(0.0, 90.0, 0.0);
    assert!(
        near(inside.eye, DVec3::ONE) && near(inside.forward, DVec3::NEG_Z),
        "radius 0 looks outward from the target"
    );
    let parallel = CameraChoice::LookAt { eye: DVec3::Y, target: Some(DVec3::ZERO) };
    assert!(scene.camera(&soup, &parallel, DVec3::Y, None, 1.0).is_err(), "view parallel to up");
}

#[test]
fn a_scene_without_a_camera_is_framed() {
    let scene = one_mesh(shapes::sphere(8), DMat4::from_translation(DVec3::new(50.0, 0.0, -20.0)));
    for size in [(100, 100), (300, 100), (100, 300)] {
        let (film, _) = super::support::draw(
            &scene,
            &Options { size, background: "transparent".parse().unwrap(), ..Options::default() },
        );
        let (width, height) = (size.0 as usize, size.1 as usize);
        let covered = |x: usize, y: usize| film.pixels[y * width + x][3] > 0.0;
        assert!(covered(width / 2, height / 2), "{size:?}: in the middle");
        let border = (0..width)
            .flat_map(|x| [(x, 0), (x, height - 1)])
            .chain((0..height).flat_map(|y| [(0, y), (width - 1, y)]));
        assert!(border.into_iter().all(|(x, y)| !covered(x, y)), "{size:?}: all of it");
    }
}

#[test]
fn framing_heeds_what_is_drawn_and_what_is_up() {
    let mut stray = shapes::cube();
    stray.positions.push(Vec3::X * 1e5);
    let transparent = Options { size: (32, 32), background: "transparent".parse().unwrap(), ..Options::default() };
    let (film, _) = super::support::draw(&one_mesh(stray, DMat4::IDENTITY), &transparent);
    assert_eq!(film.pixels[16 * 32 + 16][3], 1.0, "a vertex that no triangle uses moved the camera away");
    let flat = one_mesh(shapes::cube(), DMat4::from_scale(DVec3::new(1.0, 3.0, 1.0)));
    let upright = super::support::draw(&flat, &transparent).0;
    let lying = super::support::draw(&flat, &Options { up: DVec3::X, ..transparent }).0;
    assert_ne!(upright, lying, "--up turns the camera that frames a scene");
}

#[test]
fn scenes_beyond_f32_are_refused() {
    for scale in [1e-31, 1.5e30] {
        let error = Soup::of(&one_mesh(shapes::cube(), DMat4::from_scale(DVec3::splat(scale)))).unwrap_err();
        assert!(error.exit_code() == 2 && error.to_string().contains("can be computed"), "{error}");
    }
}

#[test]
fn the_material_rule() {
    let metal = |roughness| Material { roughness, ..Material::default() }.whitted(DVec3::ONE);
    assert_eq!(metal(0.0).mirror, DVec3::ONE, "a smooth white metal is a mirror");
    assert_eq!(metal(0.5).mirror, DVec3::ZERO, "from roughness ½ on nothing is mirrored");
    assert!(metal(0.2).mirror.x > metal(0.4).mirror.x && metal(0.2).shininess > metal(0.4).shininess);
    let plastic = Material { metallic: 0.0, base_color: DVec3::new(1.0, 0.5, 0.0), ..Material::default() };
    let whitted = plastic.whitted(DVec3::ONE);
    assert!((whitted.diffuse - plastic.base_color / std::f64::consts::PI).length() < 1e-12);
    // Linear in the tint: what the device relies on.
    let [zero, half, one] = [0.0, 0.5, 1.0].map(|tint| plastic.whitted(DVec3::splat(tint)));
    for (a, b, c) in [
        (zero.ambient, half.ambient, one.ambient),
        (zero.diffuse, half.diffuse, one.diffuse),
        (zero.specular, half.specular, one.specular),
    ] {
        assert!(((a + c) / 2.0 - b).length() < 1e-12);
    }
}
