//! Pictures.

use super::support::{assert_alike, draw, draw_reference, renderer, storage_renderer};
use glam::{DMat4, DVec3, Vec3};
use glimt::bvh::Quality;
use glimt::scene::{
    built_in, shapes, Background, CameraChoice, Filter, Instance, Instancing, Light, LightKind, Material, Mesh,
    Sampler, Soup, Whitted, BUILT_IN,
};
use glimt::{Options, Scene};

pub fn small() -> Options {
    Options { size: (160, 120), ..Options::default() }
}

pub fn exact(ambient: f64, diffuse: f64, specular: f64, shininess: f64, mirror: f64) -> Material {
    let splat = DVec3::splat;
    let whitted = Whitted {
        ambient: splat(ambient),
        diffuse: splat(diffuse),
        specular: splat(specular),
        shininess,
        mirror: splat(mirror),
    };
    Material::exact("exact", whitted)
}

pub fn scene_of(parts: Vec<(Mesh, DMat4, Material)>, lights: Vec<Light>) -> Scene {
    let mut scene = Scene { name: "test".into(), lights, has_lights: true, ..Scene::default() };
    for (index, (mesh, world_from_object, material)) in parts.into_iter().enumerate() {
        scene.meshes.push(Mesh { material: index, ..mesh });
        scene.materials.push(material);
        scene.instances.push(Instance { mesh: index, world_from_object });
    }
    scene
}

pub fn look(eye: DVec3, target: DVec3) -> CameraChoice {
    CameraChoice::LookAt { eye, target: Some(target) }
}

#[test]
fn built_in_scenes_agree_with_the_reference() {
    for (name, _) in BUILT_IN {
        let scene = built_in(name).unwrap();
        assert_alike(name, &draw_reference(&scene, &small()), &draw(&scene, &small()).0);
    }
}

#[test]
fn samples_lie_where_the_reference_puts_them() {
    let scene = built_in("cornell").unwrap();
    for samples in [2, 5, 16, 35] {
        let options = Options { samples, ..small() };
        assert_alike(
            &format!("cornell/{samples} samples"),
            &draw_reference(&scene, &options),
            &draw(&scene, &options).0,
        );
    }
    for sampler in [Sampler::Independent, Sampler::Stratified, Sampler::Sobol] {
        for filter in [Filter::Box, Filter::Tent, Filter::BlackmanHarris, Filter::Mitchell] {
            let options = Options { samples: 6, sampler, filter, seed: 7, size: (80, 60), ..Options::default() };
            let (name, film) = (format!("cornell/{sampler:?}/{filter:?}"), draw(&scene, &options).0);
            assert_alike(&name, &draw_reference(&scene, &options), &film);
            let other_seed = draw(&scene, &Options { seed: 8, ..options.clone() }).0;
            assert_ne!(film, other_seed, "{name}: the seed changes the picture");
        }
    }
}

/// All that materials, lights and cameras can be, in one small scene.
fn everything() -> Scene {
    let mut colored = shapes::sphere(12);
    colored.colors =
        colored.positions.iter().map(|p| (*p * 0.5 + 0.5).clamp(Vec3::ZERO, Vec3::ONE).extend(1.0)).collect();
    let at = |x, y, z| DMat4::from_translation(DVec3::new(x, y, z));
    let metal =
        Material { roughness: 0.2, base_color: DVec3::new(0.9, 0.7, 0.3), double_sided: true, ..Material::default() };
    let plastic = Material { metallic: 0.0, roughness: 0.35, ..Material::default() };
    let open = Mesh { triangles: shapes::cube().triangles[2..].to_vec(), ..shapes::cube() };
    let glowing = Material { emission: DVec3::new(0.1, 0.3, 0.1), metallic: 0.0, ..Material::default() };
    let spot = LightKind::Spot { inner_cosine: 0.95, outer_cosine: 0.8 };
    let spot =
        Light { kind: spot, direction: DVec3::NEG_Y, ..Light::point(DVec3::new(0.0, 4.0, 0.5), DVec3::splat(40.0)) };
    let point = Light { range: Some(6.0), ..Light::point(DVec3::new(-3.0, 2.0, 3.0), DVec3::new(20.0, 5.0, 5.0)) };
    scene_of(
        vec![
            (shapes::ground(), at(0.0, -0.5, 0.0) * DMat4::from_scale(DVec3::splat(8.0)), plastic.clone()),
            (colored, at(-1.2, 0.1, 0.0) * DMat4::from_scale(DVec3::new(0.6, 0.6, -0.6)), plastic),
            (shapes::sphere(16), at(0.0, 0.1, -0.5) * DMat4::from_scale(DVec3::splat(0.6)), metal),
            (open, at(1.3, 0.0, 0.2) * DMat4::from_rotation_y(0.7), glowing),
        ],
        vec![spot, point, Light::directional(DVec3::new(-1.0, -1.0, -0.5), DVec3::splat(0.8))],
    )
}

#[test]
fn every_light_material_and_camera_agrees_with_the_reference() {
    let scene = everything();
    let camera = look(DVec3::new(1.0, 1.2, 4.0), DVec3::ZERO);
    for max_depth in [0, 1, 8] {
        let options = Options { camera: camera.clone(), max_depth, ..small() };
        assert_alike(
            &format!("everything/depth {max_depth}"),
            &draw_reference(&scene, &options),
            &draw(&scene, &options).0,
        );
    }
    let mut orthographic = scene.clone();
    let view = small().view(&scene, &Soup::of(&scene).unwrap()).unwrap();
    let projection = glimt::scene::Projection::Orthographic { half_height: 1.5 };
    orthographic.cameras = vec![("flat".into(), glimt::scene::Camera { projection, ..view.camera })];
    assert_alike("everything/orthographic", &draw_reference(&orthographic, &small()), &draw(&orthographic, &small()).0);
}

#[test]
fn bands_fetching_and_unneeded_features_change_no_pixel() {
    let dark = Scene { lights: Vec::new(), ..everything() };
    let scenes = [everything(), dark, built_in("teapot").unwrap(), built_in("cornell").unwrap()];
    for scene in scenes {
        let once = Options { size: (203, 97), ..Options::default() };
        let forced = Options { all_features: true, ..once.clone() };
        assert!(draw(&scene, &once).0 == draw(&scene, &forced).0, "{}: all features, one sample", scene.name);
        let options = Options { samples: 6, ..once };
        let film = draw(&scene, &options).0;
        assert_eq!(film, draw(&scene, &options).0, "{}: twice", scene.name);
        for samples_in_flight in [640, 10_000, u32::MAX] {
            assert_eq!(
                film,
                draw(&scene, &Options { samples_in_flight, ..options.clone() }).0,
                "{samples_in_flight} in flight"
            );
        }
        let (forced, report) = draw(&scene, &Options { all_features: true, ..options.clone() });
        assert_eq!(film, forced, "{}: all features", scene.name);
        let chosen = ["independent", "filter"];
        assert!(report.features.iter().all(|(name, on)| *on != chosen.contains(name)), "{:?}", report.features);
        assert_eq!(film, storage_renderer().render(&scene, &options).unwrap().0, "{}: storage buffers", scene.name);
    }
}

#[test]
fn samples_are_added_in_loops_that_the_driver_does_not_cut_short() {
    // Where a sample of 20 011 lies is found in four short loops, which the loop over a pixel's samples goes through for each.
    let options = Options {
        size: (8, 8),
        samples: 20_011,
        sampler: Sampler::Stratified,
        filter: Filter::Mitchell,
        ..Options::default()
    };
    let picture =
        |samples_in_flight| draw(&built_in("teapot").unwrap(), &Options { samples_in_flight, ..options.clone() }).0;
    assert!(picture(u32::MAX) == picture(1 << 14), "all at once is the same as a few at a time");
}

#[test]
fn what_a_scene_does_not_need_is_left_out() {
    let passes = |scene: &Scene, options: &Options| -> Vec<&'static str> {
        draw(scene, options).1.passes.iter().map(|pass| pass.name).collect()
    };
    let table = built_in("table").unwrap();
    assert_eq!(passes(&table, &small()), ["primary", "prepare", "shade", "shadow", "reflection", "resolve"]);
    let flat = passes(&table, &Options { max_depth: 0, ..small() });
    assert_eq!(flat, ["primary", "prepare", "shade", "shadow", "resolve"], "depth 0");
    let teapot = draw(&built_in("teapot").unwrap(), &small()).1;
    assert!(!teapot.features["reflections"] && teapot.rays.reflection == 0, "no mirror");
    let dark = Scene { lights: Vec::new(), ..table.clone() };
    assert_eq!(passes(&dark, &small()), ["primary", "prepare", "shade", "reflection", "resolve"], "no light");
    let unlit = scene_of(
        vec![(shapes::cube(), DMat4::IDENTITY, exact(0.5, 0.0, 0.0, 1.0, 0.0))],
        vec![Light::point(DVec3::Y, DVec3::ONE)],
    );
    let (film, report) = draw(&unlit, &small());
    assert_eq!(
        report.passes.iter().map(|pass| pass.name).collect::<Vec<_>>(),
        ["primary", "prepare", "shade", "resolve"]
    );
    assert_eq!(film.pixels[60 * 160 + 80], [0.5, 0.5, 0.5, 1.0]);
    let queues = |scene: &Scene| draw(scene, &small()).1.memory_bytes.queues;
    assert!(queues(&unlit) < queues(&dark) && queues(&dark) < queues(&table), "queues that are not allocated");
}

#[test]
fn a_lambert_plane_under_a_point_light() {
    let light = Light::point(DVec3::new(0.0, 2.0, 0.0), DVec3::splat(8.0));
    let ground = (shapes::ground(), DMat4::from_scale(DVec3::splat(4.0)), exact(0.05, 0.25, 0.0, 1.0, 0.0));
    let scene = scene_of(vec![ground], vec![light]);
    let options =
        Options { size: (33, 33), camera: look(DVec3::Y * 3.0, DVec3::ZERO), up: DVec3::NEG_Z, ..Options::default() };
    let (film, _) = draw(&scene, &options);
    // E = I cosθ / d²; the middle pixel looks straight down: 8/4 · 0.25 + 0.05.
    assert!((film.pixels[16 * 33 + 16][0] - 0.55).abs() < 1e-6, "{:?}", film.pixels[16 * 33 + 16]);
    let blocker = (
        shapes::cube(),
        DMat4::from_translation(DVec3::Y) * DMat4::from_scale(DVec3::splat(0.1)),
        exact(0.0, 0.0, 0.0, 1.0, 0.0),
    );
    let mut shadowed = scene.clone();
    shadowed.meshes.push(Mesh { material: 1, ..blocker.0 });
    shadowed.materials.push(blocker.2);
    shadowed.instances.push(Instance { mesh: 1, world_from_object: blocker.1 });
    let options = Options { camera: look(DVec3::new(0.0, 0.4, 0.4), DVec3::ZERO), ..options };
    let (film, _) = draw(&shadowed, &options);
    assert_eq!(film.pixels[16 * 33 + 16][0], 0.05, "in the shadow the ambient part is left");
}

#[test]
fn a_hall_of_mirrors_sums_its_geometric_series() {
    for s in [0.5, 0.9, 0.99] {
        for depth in [0, 1, 10, 200] {
            let room = (shapes::cube(), DMat4::from_scale(DVec3::splat(3.0)), exact(0.01, 0.0, 0.0, 1.0, s));
            let camera = look(DVec3::new(0.3, 0.2, 0.1), DVec3::new(1.0, 0.7, 0.4));
            let options = Options { size: (16, 16), max_depth: depth, camera, ..Options::default() };
            let (film, _) = draw(&scene_of(vec![room], Vec::new()), &options);
            let exact = 0.01 * (1.0 - s.powi(depth as i32 + 1)) / (1.0 - s);
            for pixel in &film.pixels {
                let error = (f64::from(pixel[0]) / exact - 1.0).abs();
                assert!(error < 1e-5, "s {s}, depth {depth}: {} instead of {exact}", pixel[0]);
            }
        }
    }
}

#[test]
fn backgrounds() {
    let nothing = scene_of(Vec::new(), Vec::new());
    for (text, expected) in [
        ("#336699", [0x33, 0x66, 0x99, 255]),
        ("#010203", [1, 2, 3, 255]),
        ("white", [255; 4]),
        ("black", [0, 0, 0, 255]),
    ] {
        let background = text.parse().unwrap();
        let (film, report) = draw(&nothing, &Options { size: (9, 5), background, ..Options::default() });
        assert!((0..45).all(|pixel| film.srgb8(pixel) == expected), "{text}: {:?}", film.srgb8(0));
        assert!(report.scene.warnings.iter().any(|warning| warning.contains("only the background")));
    }
    let ball = scene_of(vec![(shapes::sphere(32), DMat4::IDENTITY, exact(0.5, 0.0, 0.0, 1.0, 0.0))], Vec::new());
    let background = Background::Transparent;
    let options = Options {
        size: (64, 64),
        samples: 16,
        background,
        camera: look(DVec3::Z * 4.0, DVec3::ZERO),
        ..Options::default()
    };
    let (film, _) = draw(&ball, &options);
    assert_eq!((film.pixels[0], film.pixels[32 * 64 + 32]), ([0.0; 4], [0.5, 0.5, 0.5, 1.0]));
    let coverage: f32 = film.pixels.iter().map(|pixel| pixel[3]).sum::<f32>() / 4096.0;
    // A sphere of radius 1 from 4 away: its outline is a circle of tangent 1/√15 on a picture of half height tan 22.5°.
    let exact = std::f32::consts::PI / 15.0 / (2.0 * 22.5_f32.to_radians().tan()).powi(2);
    assert!((coverage / exact - 1.0).abs() < 0.01, "{coverage} {exact}");
}

#[test]
fn single_sided_triangles_are_seen_from_the_front_but_shade_from_both() {
    let wall =
        |z: f32| shapes::square([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Vec3::new(x, y, z)));
    let mut front_only = exact(1.0, 0.0, 0.0, 1.0, 0.0);
    front_only.double_sided = false;
    let scene = scene_of(vec![(wall(0.0), DMat4::IDENTITY, front_only)], Vec::new());
    let middle = |z: f64| {
        let options = Options {
            size: (8, 8),
            background: Background::Transparent,
            camera: look(DVec3::Z * z, DVec3::ZERO),
            ..Options::default()
        };
        draw(&scene, &options).0.pixels[36][3]
    };
    assert_eq!((middle(3.0), middle(-3.0)), (1.0, 0.0));
}

#[test]
fn shared_meshes_give_the_same_picture() {
    let at = |x, y, z| DMat4::from_translation(DVec3::new(x, y, z));
    let plastic = Material { metallic: 0.0, roughness: 0.35, double_sided: true, ..Material::default() };
    let mut scene = scene_of(
        vec![
            (shapes::ground(), at(0.0, -0.5, 0.0) * DMat4::from_scale(DVec3::splat(8.0)), plastic.clone()),
            (shapes::sphere(16), at(0.0, 0.1, 0.0), exact(0.1, 0.6, 0.3, 40.0, 0.3)),
            (shapes::cube(), at(0.0, 0.1, 0.0), Material { double_sided: false, ..plastic }),
        ],
        vec![Light::point(DVec3::new(3.0, 6.0, 5.0), DVec3::splat(120.0))],
    );
    scene.meshes[2].triangles.truncate(10);
    scene.instances.truncate(1);
    for index in 0..48 {
        let (column, row) = (f64::from(index % 8), f64::from(index / 8));
        let turned = DMat4::from_rotation_y(0.7 * f64::from(index)) * DMat4::from_rotation_x(0.3 * f64::from(index));
        // Sheared, stretched, some mirrored, some tiny.
        let mirrored = if index % 3 == 0 { -1.0 } else { 1.0 };
        let size = DVec3::new(0.15 * mirrored, 0.1 + 0.1 * (row / 6.0), 0.12) * if index % 7 == 0 { 0.01 } else { 1.0 };
        let world_from_object = at(0.5 * column - 2.0, -0.2, 0.5 * row - 1.5) * turned * DMat4::from_scale(size);
        scene.instances.push(Instance { mesh: 1 + index as usize % 2, world_from_object });
    }
    let camera = look(DVec3::new(1.0, 2.5, 5.0), DVec3::ZERO);
    let flat = Options { camera, max_depth: 2, instancing: Instancing::Flat, ..small() };
    let shared = Options { instancing: Instancing::Shared, ..flat.clone() };
    let (film, report) = draw(&scene, &shared);
    assert_alike("shared meshes", &draw(&scene, &flat).0, &film);
    assert_alike("shared meshes/reference", &draw_reference(&scene, &shared), &film);
    assert!(report.features["instances"] && report.scene.triangles == scene.triangle_count());
    assert_eq!(film, draw(&scene, &Options { all_features: true, ..shared.clone() }).0, "all features");
    assert_eq!(film, draw(&scene, &Options { bvh: Some(Quality::Fast), ..shared.clone() }).0, "another tree");
    assert_eq!(film, draw(&scene, &Options { samples_in_flight: 640, ..shared.clone() }).0, "bands");
    assert_eq!(film, storage_renderer().render(&scene, &shared).unwrap().0, "storage buffers");
    // Few instances are not worth it, and then nothing of it is there.
    let (_, report) = draw(&scene, &Options { instancing: Instancing::Auto, ..flat });
    assert!(!report.features["instances"]);
}

#[test]
fn the_device_is_reusable_and_shared_between_threads() {
    let scene = built_in("cornell").unwrap();
    let first = draw(&scene, &small()).0;
    std::thread::scope(|threads| {
        let draws: Vec<_> = (0..4).map(|_| threads.spawn(|| draw(&scene, &small()).0)).collect();
        assert!(draws.into_iter().all(|film| film.join().unwrap() == first));
    });
}

#[test]
fn interrupting_stops_with_an_error() {
    let options = small();
    options.interrupted.store(true, std::sync::atomic::Ordering::Relaxed);
    let result = renderer().render(&built_in("table").unwrap(), &options);
    assert_eq!(result.err().map(|error| error.exit_code()), Some(130));
}

#[test]
fn a_wave_of_very_many_lights_can_be_stopped() {
    let mut scene = built_in("cornell").unwrap();
    let light = |index: i32| Light::point(DVec3::new(0.0, 0.5, 1e-4 * f64::from(index)), DVec3::splat(1e-3));
    scene.lights = (0..20_000).map(light).collect();
    let options = Options { size: (8, 8), ..small() };
    let interrupted = options.interrupted.clone();
    let stopped = std::thread::spawn(move || {
        std::thread::sleep(std::time::Duration::from_millis(200));
        interrupted.store(true, std::sync::atomic::Ordering::Relaxed);
    });
    // All lights are one wave.
    let outcome = renderer().render(&scene, &options);
    stopped.join().unwrap();
    assert!(matches!(outcome, Err(glimt::Error::Interrupted)), "{:?}", outcome.map(|(_, report)| report.rays));
}
