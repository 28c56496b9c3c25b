//! Pictures of scenes that are hard on trees, stacks and f32.

use super::frames::{exact, look, scene_of, small};
use super::support::{assert_alike, draw, draw_reference, renderer, storage_renderer};
use glam::{DMat4, DVec3, Vec3};
use glimt::bvh::Quality;
use glimt::render::ray_sets::SetKind;
use glimt::render::{Met, Prepared, Ray};
use glimt::scene::{built_in, shapes, Instance, Instancing, Light, Material, Mesh};
use glimt::{Options, Scene};

#[test]
fn rays_that_overflow_their_stack_are_traced_again() {
    // Needles that pass by one point: most boxes hold it, so that rays near it enter both children of most nodes.
    let mut needles = Mesh::default();
    for index in 0..4096_u32 {
        let (height, angle) = (1.0 - 2.0 * (index as f32 + 0.5) / 4096.0, 2.399_963 * index as f32);
        let radius = (1.0 - height * height).sqrt();
        let direction = Vec3::new(radius * angle.cos(), height, radius * angle.sin());
        let across = direction.any_orthonormal_vector();
        let center = across.cross(direction) * (index as f32 * 0.618_034).fract() * 0.2;
        needles.triangles.push([0, 1, 2].map(|corner| 3 * index + corner));
        needles.positions.extend([direction, -direction, across * 0.01].map(|corner| center + corner));
    }
    let mirror = Material { double_sided: true, ..exact(0.2, 0.5, 0.2, 20.0, 0.3) };
    let light = Light::point(DVec3::new(3.0, 4.0, 5.0), DVec3::splat(60.0));
    let scene = scene_of(vec![(needles, DMat4::IDENTITY, mirror)], vec![light]);
    let camera = look(DVec3::new(0.5, 0.4, 2.5), DVec3::ZERO);
    let options = Options { camera, max_depth: 1, size: (80, 60), bvh: Some(Quality::Fast), ..Options::default() };
    // Where needles all but touch, shadows and reflections are a matter of rounding: the reference judges the first hits.
    let dark = Scene { lights: Vec::new(), ..scene.clone() };
    let first_hits = Options { max_depth: 0, ..options.clone() };
    assert_alike("needles", &draw_reference(&dark, &first_hits), &draw(&dark, &first_hits).0);
    let (film, report) = draw(&scene, &options);
    let other_tree = Options { bvh: Some(Quality::Best), ..options.clone() };
    assert_eq!(film, draw(&scene, &other_tree).0, "the tree's shape never shows");
    let retraced = report.passes.iter().find(|pass| pass.name == "retrace").expect("rays are traced again");
    println!("needles: {} rays traced again in {} dispatches", retraced.items, retraced.dispatches);
    assert!(retraced.items > 100);
    let primary = report.passes.iter().find(|pass| pass.name == "primary").map(|pass| pass.dispatches);
    assert_eq!(primary, Some(1), "the wave is not run again");
    // In several waves.
    let waves = Options { samples_in_flight: 640, samples: 3, ..options.clone() };
    assert_eq!(draw(&scene, &waves).0, draw(&scene, &Options { samples: 3, ..options.clone() }).0);
    assert_eq!(film, storage_renderer().render(&scene, &options).unwrap().0);
    // The first light reaches nothing, so that the kernel is not made after its pass. Before it is there, the others leave more rays than the queue holds.
    let mut lit = scene.clone();
    let around = |index: u32| DVec3::new(f64::from(index).cos(), f64::from(index).sin(), 1.0);
    lit.lights = (0..64).map(|index| Light::point(4.0 * around(index), DVec3::ONE)).collect();
    lit.lights[0].range = Some(0.01);
    let options_of_lit = Options { size: (40, 30), ..options.clone() };
    let (film, report) = draw(&lit, &options_of_lit);
    let retraced = report.passes.iter().find(|pass| pass.name == "retrace").map_or(0, |pass| pass.items);
    assert!(retraced > 3 * 40 * 30, "{retraced} rays are traced again");
    let primary = report.passes.iter().find(|pass| pass.name == "primary").map(|pass| pass.dispatches);
    assert_eq!(primary, Some(2), "the wave is run again");
    assert_eq!(film, draw(&lit, &Options { bvh: Some(Quality::Best), ..options_of_lit }).0);
    // Through instances of the needles, the way back to the nodes of the world's tree among what waits on the stack. Of so many a ray may meet more than
    // this driver's loops allow, depending on which rays are its neighbours.
    let mut many = scene.clone();
    let moved = |x: f64| Instance { mesh: 0, world_from_object: DMat4::from_translation(DVec3::X * x) };
    many.instances = (-24..=24).map(|place| moved(0.02 * f64::from(place))).collect();
    let shared = Options { instancing: Instancing::Shared, size: (40, 30), ..options.clone() };
    let (film, report) = draw(&many, &shared);
    assert!(report.passes.iter().any(|pass| pass.name == "retrace" && pass.items > 100));
    assert_eq!(film, draw(&many, &Options { bvh: Some(Quality::Best), ..shared }).0, "the trees' shapes never show");
    // A flat tree has no such need.
    let flat = draw(&built_in("cornell").unwrap(), &small()).1;
    assert!(flat.passes.iter().all(|pass| pass.name != "retrace"));
}

#[test]
fn rays_that_the_driver_would_cut_short_are_traced_part_by_part() {
    // Copies of one sliver along the diagonal of the picture: every ray meets all their boxes and none of the triangles.
    let mut mesh =
        shapes::square([(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)].map(|(x, y)| Vec3::new(x, y, -1.0)));
    mesh.positions.extend([Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, 1.0, 0.0), Vec3::new(1.0, 1.001, 0.0)]);
    // Alone; shared and too large to be walked through at once; small and shared by many.
    for (copies, instances) in [(1_000, 1), (100_000, 1), (100_000, 3), (100, 1_500)] {
        mesh.triangles.truncate(2);
        mesh.triangles.extend(std::iter::repeat_n([4, 5, 6], copies));
        let mut scene = scene_of(vec![(mesh.clone(), DMat4::IDENTITY, exact(0.25, 0.0, 0.0, 1.0, 0.0))], Vec::new());
        let behind = |place: i32| DMat4::from_translation(DVec3::NEG_Z * 1e-4 * f64::from(place));
        scene.instances = (0..instances).map(|place| Instance { mesh: 0, world_from_object: behind(place) }).collect();
        let instancing = if instances > 1 { Instancing::Shared } else { Instancing::Flat };
        let camera = look(DVec3::new(0.01, 0.0, 5.0), DVec3::ZERO);
        let options = Options { size: (16, 16), camera, instancing, ..Options::default() };
        let (film, report) = draw(&scene, &options);
        let hits = film.pixels.iter().filter(|pixel| pixel[0] == 0.25).count();
        assert_eq!(hits, 144, "{instances} × {copies}: as many pixels as show the square");
        let again = report.passes.iter().find(|pass| pass.name == "retrace").map_or(0, |pass| pass.dispatches);
        println!("{instances} × {copies}: traced again in {again} dispatches");
        assert!(copies * instances as usize == 1_000 || again > 20, "{instances} × {copies}: {again} parts");
    }
}

#[test]
fn threads_whose_items_are_too_long_for_them_take_one_each() {
    // Where the slivers are, a ray meets 1 000; in a wave of this size a thread takes 64 rays, one after the other.
    let mut mesh =
        shapes::square([(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)].map(|(x, y)| Vec3::new(x, y, -1.0)));
    mesh.positions.extend([Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, 1.0, 0.0), Vec3::new(1.0, 1.001, 0.0)]);
    let camera = look(DVec3::new(0.01, 0.0, 6.0), DVec3::ZERO);
    let options = Options { size: (512, 512), samples_in_flight: 512 * 512, camera, ..Options::default() };
    let picture = |slivers: usize| {
        let mut mesh = mesh.clone();
        mesh.triangles.extend(std::iter::repeat_n([4, 5, 6], slivers));
        let scene = scene_of(vec![(mesh, DMat4::IDENTITY, exact(0.25, 0.0, 0.0, 1.0, 0.0))], Vec::new());
        let (film, report) = draw(&scene, &options);
        (film, report.passes.iter().find(|pass| pass.name == "primary").map(|pass| pass.dispatches))
    };
    let (square, once) = picture(0);
    let (behind_slivers, twice) = picture(1_000);
    // Other drivers let a thread work as long as it takes.
    let is_cut_short = renderer().device().info.name.contains("llvmpipe");
    assert_eq!((once, twice), (Some(1), Some(1 + u64::from(is_cut_short))), "the wave is run again");
    assert!(square == behind_slivers, "no pixel is missing");
}

#[test]
fn the_order_of_the_file_does_not_decide_between_copies() {
    let colors = [0.1, 0.3, 0.5, 0.7, 0.9];
    let picture = |order: &[usize]| {
        let copy = |index: &usize| (shapes::ground(), DMat4::IDENTITY, exact(colors[*index], 0.0, 0.0, 1.0, 0.0));
        let scene = scene_of(order.iter().map(copy).collect(), Vec::new());
        let film = draw(&scene, &small()).0;
        assert_alike("copies", &draw_reference(&scene, &small()), &film);
        film
    };
    let first = picture(&[0, 1, 2, 3, 4]);
    assert!([[4, 3, 2, 1, 0], [2, 0, 4, 1, 3]].iter().all(|order| picture(order) == first));
}

#[test]
fn of_equal_triangles_the_first_of_the_file_is_met() {
    // Leaves have them in whatever order the tree likes.
    let different = 97;
    let mut mesh = Mesh::default();
    for index in 0..3 * different {
        let shift = |step: f32| ((index % different) as f32 * step).fract() - 0.5;
        mesh.triangles.push([0, 1, 2].map(|corner| 3 * index + corner));
        let corners = [(-0.9, -0.8), (0.9, -0.8), (0.0, 0.9)];
        mesh.positions
            .extend(corners.map(|(x, y)| Vec3::new(x + shift(0.618_034), y + shift(0.754_878), x * shift(0.569_84))));
    }
    let scene = scene_of(vec![(mesh, DMat4::IDENTITY, exact(0.2, 0.5, 0.2, 20.0, 0.3))], Vec::new());
    let eye = DVec3::new(0.1, 0.2, 2.0);
    let ray = |index: u32| {
        let aim = DVec3::new(f64::from(index % 32) / 32.0 - 0.5, f64::from(index / 32) / 32.0 - 0.5, 0.0);
        Ray { origin: eye, direction: (aim - eye).as_vec3().as_dvec3(), t_max: f64::MAX }
    };
    let rays: Vec<Ray> = (0..1024).map(ray).collect();
    for quality in [Quality::Fast, Quality::Balanced, Quality::Best] {
        let options = Options { bvh: Some(quality), camera: look(eye, DVec3::ZERO), size: (32, 32), ..small() };
        let prepared = Prepared::new(&scene, &options).unwrap();
        let tree = prepared.tree(&options);
        let mut tracer = renderer().tracer(&scene, &prepared, &tree).unwrap();
        let met = tracer.trace(SetKind::Diffuse, &rays, 1, &options).unwrap().met;
        let is_first = |met: &&Met| matches!(met, Met::Triangle { primitive, .. } if *primitive < different);
        let (first, none) =
            (met.iter().filter(is_first).count(), met.iter().filter(|met| **met == Met::Nothing).count());
        assert!(none < 512 && first + none == 1024, "{quality:?}: {first} of {} hits", 1024 - none);
    }
}

#[test]
fn a_small_thing_on_a_vast_ground_keeps_its_shadow() {
    for size in [1e2, 1e4, 1e6, 1e8] {
        let ground = (shapes::ground(), DMat4::from_scale(DVec3::splat(size)), exact(0.1, 0.5, 0.0, 1.0, 0.0));
        let tilt = DMat4::from_euler(glam::EulerRot::XYZ, 0.3, 0.2, 0.1);
        let placed = DMat4::from_translation(DVec3::Y * 0.006) * tilt * DMat4::from_scale(DVec3::splat(0.005));
        let parts = vec![ground, (shapes::cube(), placed, exact(0.2, 0.3, 0.0, 1.0, 0.0))];
        let scene = scene_of(parts, vec![Light::directional(DVec3::new(1.0, -1.0, 0.3), DVec3::ONE)]);
        let camera = look(DVec3::new(0.02, 0.03, 0.04), DVec3::ZERO);
        let options = Options { camera, ..small() };
        let (reference, film) = (draw_reference(&scene, &options), draw(&scene, &options).0);
        let metrics = glimt::film::compare(&reference, &film).unwrap();
        assert!(metrics.over_1_255 <= 1e-3, "{size} m: {metrics:?}");
    }
}

#[test]
fn pieces_of_a_vast_plane_do_not_shadow_each_other() {
    let ground = (shapes::ground(), DMat4::from_scale(DVec3::splat(1e6)), exact(0.1, 0.5, 0.0, 1.0, 0.0));
    let scene = scene_of(vec![ground], vec![Light::directional(DVec3::new(1.0, -1.0, 0.3), DVec3::ONE)]);
    let camera = look(DVec3::new(2.0, 1.5, 3.0), DVec3::Y * 0.3);
    let film = draw(&scene, &Options { size: (640, 480), camera, ..Options::default() }).0;
    let dark = film.pixels.iter().filter(|pixel| pixel[0] < 0.2).count();
    assert_eq!(dark, 0, "pixels in the shadow of nothing");
}

#[test]
fn a_vast_plane_does_not_shadow_itself() {
    // The rounding error of a hit grows with the triangle, while what is near the eye is small: up to 2 000 km of tilted
    // ground, seen from 40 cm away, under a sun that grazes it.
    let tilt = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.7, 0.4, 1.1);
    let sun = tilt * DVec3::new(1.0, -0.05, 0.2);
    for size in [2.0, 2e2, 2e4, 2e6] {
        let placed = DMat4::from_quat(tilt) * DMat4::from_scale(DVec3::splat(size));
        let ground = (shapes::ground(), placed, exact(0.1, 0.5, 0.0, 1.0, 0.0));
        let scene = scene_of(vec![ground], vec![Light::directional(sun, DVec3::ONE)]);
        let camera = look(tilt * DVec3::new(0.013, 0.4, 0.1), tilt * DVec3::new(0.0, 0.0, -0.02));
        let (film, _) = draw(&scene, &Options { size: (128, 96), camera, ..Options::default() });
        let lit = 0.1 + 0.5 * 0.05 / sun.length();
        let dark = film.pixels.iter().filter(|pixel| (f64::from(pixel[0]) - lit).abs() > 1e-4).count();
        assert_eq!(dark, 0, "{size} m: {dark} of 12288 pixels lie in the plane's own shadow");
    }
}

#[test]
fn of_two_sides_in_one_place_the_front_is_seen() {
    let sheet = |color, turn| (shapes::ground(), DMat4::from_rotation_x(turn), exact(color, 0.0, 0.0, 1.0, 0.0));
    let (up, down) = (sheet(0.2, 0.0), sheet(0.7, std::f64::consts::PI));
    for parts in [vec![up.clone(), down.clone()], vec![down, up]] {
        let scene = scene_of(parts, Vec::new());
        for (height, color) in [(0.5, 0.2), (-0.5, 0.7)] {
            let camera = look(DVec3::new(0.02, height, 0.01), DVec3::ZERO);
            let film = draw(&scene, &Options { size: (16, 16), camera, fov: Some(0.5), ..Options::default() }).0;
            assert!(film.pixels.iter().all(|pixel| pixel[0] == color), "from {height}: {:?}", film.pixels[0]);
        }
    }
}
