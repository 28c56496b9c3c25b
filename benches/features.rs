//! What each feature of a scene costs a frame that needs it, as a table: bytes on the device, dispatches, time, and the first
//! dispatches of its kernels on a device of their own. To see compilation, switch the driver's own cache off:
//! `MESA_SHADER_CACHE_DISABLE=true cargo bench --bench features`.

#![allow(missing_docs, clippy::print_stdout, clippy::unwrap_used)]

use glam::{DMat4, DVec3, Vec4};
use glimt::scene::{shapes, AlphaMode, Background, CameraChoice, Instance, Instancing, Light, Material, Mesh, Whitted};
use glimt::vulkan::Habits;
use glimt::{Options, Renderer, Scene};

/// Frames of which the median is told.
const FRAMES: usize = 7;

/// A ball of 36 000 flat triangles without light or mirror, on black.
fn ball() -> Scene {
    let mesh = Mesh { normals: Vec::new(), ..shapes::sphere(96) };
    let whitted = Whitted {
        ambient: DVec3::splat(0.1),
        diffuse: DVec3::splat(0.5),
        specular: DVec3::ZERO,
        shininess: 1.0,
        mirror: DVec3::ZERO,
    };
    Scene {
        meshes: vec![mesh],
        instances: vec![Instance { mesh: 0, world_from_object: DMat4::IDENTITY }],
        materials: vec![Material::exact("matt", whitted)],
        has_lights: true,
        ..Scene::default()
    }
}

/// The ball with something changed.
fn changed(change: impl Fn(&mut Scene)) -> Scene {
    let mut scene = ball();
    change(&mut scene);
    scene
}

fn light(index: usize) -> Light {
    Light::point(DVec3::new(3.0 - index as f64, 4.0, 5.0), DVec3::splat(60.0))
}

fn whitted(scene: &mut Scene) -> &mut Whitted {
    scene.materials[0].whitted.as_mut().unwrap()
}

fn rows() -> Vec<(&'static str, Scene, Options)> {
    let plain = Options {
        size: (512, 512),
        bvh: Some(glimt::bvh::Quality::Fast),
        camera: CameraChoice::LookAt { eye: DVec3::new(0.5, 0.6, 2.0), target: None },
        background: Background::Constant(DVec3::ZERO),
        ..Options::default()
    };
    let two = changed(|scene| {
        let beside = |x: f64| Instance { mesh: 0, world_from_object: DMat4::from_translation(DVec3::X * x) };
        scene.instances = vec![beside(0.0), beside(1e-3)];
    });
    let shiny = |scene: &mut Scene| {
        scene.lights.push(light(0));
        (whitted(scene).specular, whitted(scene).shininess) = (DVec3::splat(0.4), 20.0);
    };
    let glass = |scene: &mut Scene| {
        (scene.materials[0].alpha, scene.materials[0].alpha_mode) = (0.5, AlphaMode::Blend);
    };
    let instancing = |instancing| Options { instancing, ..plain.clone() };
    vec![
        ("none", ball(), plain.clone()),
        ("smooth_normals", changed(|scene| scene.meshes[0] = shapes::sphere(96)), plain.clone()),
        (
            "vertex_colors",
            changed(|scene| scene.meshes[0].colors = vec![Vec4::splat(0.5); scene.meshes[0].positions.len()]),
            plain.clone(),
        ),
        ("single_sided", changed(|scene| scene.materials[0].double_sided = false), plain.clone()),
        ("shadows", changed(|scene| scene.lights.push(light(0))), plain.clone()),
        ("shadows, specular", changed(shiny), plain.clone()),
        ("shadows, 8 lights", changed(|scene| scene.lights.extend((0..8).map(light))), plain.clone()),
        ("reflections", changed(|scene| whitted(scene).mirror = DVec3::splat(0.5)), plain.clone()),
        ("layers (alpha 0.5)", changed(glass), plain.clone()),
        ("multisampling (4)", ball(), Options { samples: 4, ..plain.clone() }),
        ("instances (2 balls)", two.clone(), instancing(Instancing::Shared)),
        ("the same, flat", two, instancing(Instancing::Flat)),
    ]
}

fn main() {
    println!("| feature needed | device bytes | of this queues | dispatches | render ms | first dispatches, ms |");
    println!("|---|---|---|---|---|---|");
    for (name, scene, options) in rows() {
        // Each at its own first dispatch, so that their times can be told.
        let habits = Habits { compile_ahead: Some(false), ..Habits::default() };
        let renderer = Renderer::with_habits(&options.device, false, habits).unwrap();
        let first = renderer.render(&scene, &Options { size: (8, 8), ..options.clone() }).unwrap().1;
        let mut reports: Vec<_> = (0..FRAMES).map(|_| renderer.render(&scene, &options).unwrap().1).collect();
        let ms = |report: &glimt::report::Report| report.passes.iter().map(|pass| pass.ms).sum::<f64>();
        reports.sort_by(|a, b| ms(a).total_cmp(&ms(b)));
        let median = &reports[FRAMES / 2];
        let compiled: Vec<String> = first.passes.iter().map(|pass| format!("{} {:.0}", pass.name, pass.ms)).collect();
        println!(
            "| {name} | {} | {} | {} | {:.1} | {} |",
            median.memory_bytes.device_peak,
            median.memory_bytes.queues,
            median.passes.iter().map(|pass| pass.dispatches).sum::<u64>(),
            ms(median),
            compiled.join(", ")
        );
    }
}
