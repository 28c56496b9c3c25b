//! Textures and surfaces that are not opaque: against the reference and against closed forms.

use super::frames::{look, scene_of, small};
use super::support::{assert_alike, draw, draw_reference};
use glam::{DMat4, DVec3, Vec2, Vec3, Vec4};
use glimt::scene::{
    shapes, AlphaMode, Background, Image, Instancing, Light, Map, Maps, Material, Mesh, Minify, Pixels, Texture,
    Volume, Wrap,
};
use glimt::{Options, Scene};
use std::f64::consts::PI;
use std::sync::Arc;

/// A picture by a function of its pixels.
fn image(width: u32, height: u32, pixel: impl Fn(u32, u32) -> [u8; 4]) -> Option<Arc<Image>> {
    let pixels = (0..width * height).map(|index| pixel(index % width, index / width)).collect();
    let (name, format) = ("made".to_string(), "made".to_string());
    Some(Arc::new(Image { name, format, width, height, pixels: Pixels::Rgba8(pixels), bytes: 0 }))
}

/// A few colours that no wrong wrapping or mirroring leaves as they are.
fn motley(x: u32, y: u32) -> [u8; 4] {
    [(x * 50) as u8, (y * 60) as u8, ((x + 3 * y) % 5 * 60) as u8, 255 - (x * 20 + y * 10) as u8]
}

/// A unit square in the plane z = 0 whose texture coordinates run from `from` to `to`; the second set is turned round.
fn card(from: f32, to: f32) -> Mesh {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let mut mesh = shapes::square(corners.map(|(x, y)| Vec3::new(x, y, 0.0)));
    mesh.texcoords = [(from, to), (to, to), (to, from), (from, from)]
        .iter()
        .map(|(u, v)| [Vec2::new(*u, *v), Vec2::new(*v, to - *u)])
        .collect();
    mesh.normals = vec![Vec3::Z; 4];
    mesh
}

/// Shows its base colour.
fn unlit(base_color: Option<Map>) -> Material {
    Material { unlit: true, double_sided: true, maps: Maps { base_color, ..Maps::default() }, ..Material::default() }
}

/// One mesh of one material, nothing else.
fn alone(mesh: Mesh, material: Material) -> Scene {
    scene_of(vec![(mesh, DMat4::IDENTITY, material)], vec![])
}

fn frontal(options: Options) -> Options {
    Options { camera: look(DVec3::new(0.0, 0.0, 2.5), DVec3::ZERO), fov: Some(0.9), ..options }
}

#[test]
fn every_sampler_agrees_with_the_reference() {
    let wraps = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];
    let minifies = [(false, None), (true, None), (false, Some(false)), (true, Some(false)), (false, Some(true))];
    let minifies = minifies.map(|(linear, mipmap)| Minify { linear, mipmap });
    let best = Texture::of(0);
    let mut textures = vec![best, Texture { magnify_linear: false, ..best }];
    textures.extend(wraps.iter().flat_map(|u| wraps.map(|v| Texture { wrap: [*u, v], ..best })));
    textures.extend(minifies.map(|minify| Texture { minify, ..best }));
    for (number, texture) in textures.into_iter().enumerate() {
        // As large as the picture, and much smaller.
        for repeated in [1.7_f32, 40.0] {
            let mut scene = alone(card(-0.6, repeated), unlit(Some(Map::of(0))));
            scene.images = vec![image(5, 4, motley)];
            scene.textures = vec![texture];
            let options = frontal(small());
            let film = draw(&scene, &options).0;
            assert_alike(&format!("sampler {number}/{repeated}"), &draw_reference(&scene, &options), &film);
        }
    }
}

#[test]
fn maps_are_placed_by_either_set_and_moved() {
    let turned = Map { transform: [[0.6, -0.8, 0.3], [0.8, 0.6, -0.1]], ..Map::of(0) };
    for map in [Map { texcoord: 1, ..Map::of(0) }, turned, Map { texcoord: 1, ..turned }] {
        let mut scene = alone(card(0.0, 1.0), unlit(Some(map)));
        (scene.images, scene.textures) = (vec![image(4, 4, motley)], vec![Texture::of(0)]);
        let options = frontal(small());
        let film = draw(&scene, &options).0;
        assert_alike(&format!("{map:?}"), &draw_reference(&scene, &options), &film);
        scene.materials[0].maps.base_color = Some(Map::of(0));
        assert_ne!(film, draw(&scene, &options).0, "{map:?} changes the picture");
    }
}

#[test]
fn bits_and_colour_spaces() {
    let value = 100_u8;
    let mut scene = alone(card(0.0, 1.0), unlit(Some(Map::of(0))));
    scene.textures = vec![Texture::of(0)];
    let options = frontal(Options { size: (8, 8), ..Options::default() });
    let center = |scene: &Scene| f64::from(draw(scene, &options).0.pixels[8 * 4 + 4][0]);
    scene.images = vec![image(1, 1, |_, _| [value; 4])];
    let light = ((f64::from(value) / 255.0 + 0.055) / 1.055).powf(2.4);
    assert!((center(&scene) - light).abs() < 1e-6, "8 bit colours are sRGB: {}", center(&scene));
    // So are 16 bit ones.
    let wide =
        Image { pixels: Pixels::Rgba16(vec![[12345, 1, 2, 65535]]), ..scene.images[0].as_deref().unwrap().clone() };
    scene.images = vec![Some(Arc::new(wide))];
    let coded: f64 = 12345.0 / 65535.0;
    let light = ((coded + 0.055) / 1.055).powf(2.4);
    assert!((center(&scene) - light).abs() < 1e-5, "16 bit colours: {} not {light}", center(&scene));
}

#[test]
fn what_is_far_away_is_the_mean_and_not_noise() {
    // A chessboard to the horizon, finer than pixels: far away it is half the light, near by it is black and white.
    let mut scene = alone(card(0.0, 4000.0), unlit(Some(Map::of(0))));
    scene.instances[0].world_from_object = DMat4::from_rotation_x(-PI / 2.0) * DMat4::from_scale(DVec3::splat(500.0));
    let checker = |x: u32, y: u32| if (x + y).is_multiple_of(2) { [255; 4] } else { [0, 0, 0, 255] };
    scene.images = vec![image(2, 2, checker)];
    scene.textures = vec![Texture { magnify_linear: false, ..Texture::of(0) }];
    let camera = look(DVec3::new(0.0, 1.0, 0.0), DVec3::new(0.0, 0.9, -1.0));
    let options = Options { size: (200, 150), camera, ..Options::default() };
    let film = draw(&scene, &options).0;
    assert_alike("horizon", &draw_reference(&scene, &options), &film);
    let row = |y: usize| -> Vec<f32> { (0..200).map(|x| film.pixels[y * 200 + x][0]).collect() };
    // 188/255 in sRGB, decoded: half.
    assert!(row(60).iter().all(|value| (value - 0.5).abs() < 0.02), "{:?}", &row(60)[..8]);
    let (low, high) = row(149).iter().fold((1.0_f32, 0.0_f32), |(low, high), v| (low.min(*v), high.max(*v)));
    assert!(low < 0.05 && high > 0.95, "near by it is {low} to {high}");
    let alias = Texture { minify: Minify { linear: false, mipmap: None }, ..scene.textures[0] };
    scene.textures = vec![alias];
    let film = draw(&scene, &options).0;
    let noise = (0..200).filter(|x| (film.pixels[60 * 200 + x][0] - 0.5).abs() > 0.4).count();
    assert!(noise > 150, "without a mipmap it is noise: {noise} of 200");
}

/// A ball with texture coordinates and every map, over a ground that mirrors it.
fn mapped_scene() -> Scene {
    let mut ball = shapes::sphere(12);
    let around = |p: &Vec3| Vec2::new(p.x.atan2(p.z) * 0.6, p.y * 2.0);
    ball.texcoords = ball.positions.iter().map(|p| [around(p), around(p).yx_swapped()]).collect();
    let second = |texture| Some(Map { texcoord: 1, ..Map::of(texture) });
    let maps = Maps {
        base_color: Some(Map::of(0)),
        metallic_roughness: second(1),
        normal: Some(Map { transform: [[2.0, 0.0, 0.1], [0.0, 2.0, 0.0]], ..Map::of(2) }),
        occlusion: Some(Map::of(1)),
        emission: Some(Map::of(3)),
        specular: Some(Map::of(0)),
        specular_color: second(3),
        transmission: None,
    };
    ball.tangents = ball.tangents_for(&maps.normal.unwrap()).unwrap();
    let mapped = Material {
        maps,
        emission: DVec3::new(0.2, 0.1, 0.3),
        normal_scale: 0.7,
        occlusion_strength: 0.8,
        ..Material::default()
    };
    let mirror = Material { roughness: 0.1, base_color: DVec3::splat(0.8), double_sided: true, ..Material::default() };
    let at = |x| DMat4::from_translation(DVec3::new(x, 0.6, 0.0)) * DMat4::from_scale(DVec3::splat(0.7));
    let mut scene = scene_of(
        vec![
            (shapes::ground(), DMat4::from_scale(DVec3::splat(6.0)), mirror),
            (ball.clone(), at(-0.9), mapped.clone()),
            // Mirrored: the bitangents turn round.
            (ball, at(0.9) * DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0)), mapped),
        ],
        vec![Light::directional(DVec3::new(-0.5, -1.0, -0.7), DVec3::splat(2.5))],
    );
    let bumps = |x: u32, y: u32| [(100 + 40 * (x % 3)) as u8, (160 - 30 * (y % 3)) as u8, 230, 255];
    scene.images = vec![image(5, 4, motley), image(3, 3, motley), image(6, 6, bumps), image(2, 2, motley)];
    scene.textures = (0..4).map(Texture::of).collect();
    scene
}

trait Swapped {
    fn yx_swapped(self) -> Self;
}

impl Swapped for Vec2 {
    fn yx_swapped(self) -> Self {
        Vec2::new(self.y, self.x)
    }
}

#[test]
fn every_map_agrees_with_the_reference_also_in_a_mirror() {
    let scene = mapped_scene();
    let options = Options { camera: look(DVec3::new(0.4, 1.4, 3.4), DVec3::new(0.0, 0.4, 0.0)), ..small() };
    let (film, report) = draw(&scene, &options);
    assert!(report.rays.reflection > 0);
    assert_alike("every map", &draw_reference(&scene, &options), &film);
    // Each map matters.
    for index in 0..7 {
        let mut other = scene.clone();
        for material in &mut other.materials {
            let maps = &mut material.maps;
            let slot = [
                &mut maps.base_color,
                &mut maps.metallic_roughness,
                &mut maps.normal,
                &mut maps.occlusion,
                &mut maps.emission,
                &mut maps.specular,
                &mut maps.specular_color,
            ];
            *slot.into_iter().nth(index).unwrap() = None;
        }
        assert_ne!(film, draw(&other, &options).0, "without map {index}");
    }
    let shared = Options { instancing: Instancing::Shared, ..options.clone() };
    let mut twice = scene.clone();
    twice.meshes[2] = twice.meshes[1].clone();
    twice.instances[2].mesh = 1;
    assert_alike("shared meshes", &draw(&twice, &options).0, &draw(&twice, &shared).0);
    assert_eq!(film, draw(&scene, &Options { all_features: true, ..options }).0, "all features on");
}

/// Cards one behind the other along z, each with this alpha; nearest first.
fn layers(count: usize, alpha: f64, color: impl Fn(usize) -> DVec3) -> Scene {
    let card = |index: usize| {
        let material = Material { base_color: color(index), alpha, alpha_mode: AlphaMode::Blend, ..unlit(None) };
        (card(0.0, 1.0), DMat4::from_translation(DVec3::Z * (-0.01 * index as f64)), material)
    };
    scene_of((0..count).map(card).collect(), vec![])
}

#[test]
fn blended_layers_add_up_in_order() {
    let colors = [DVec3::X, DVec3::Y, DVec3::Z];
    let scene = layers(3, 0.5, |index| colors[index]);
    let behind = DVec3::new(0.2, 0.4, 0.6);
    let options = frontal(Options { size: (16, 16), background: Background::Constant(behind), ..Options::default() });
    let center = draw(&scene, &options).0.pixels[8 * 16 + 8];
    let expected = colors.iter().rev().fold(behind, |below, color| 0.5 * *color + 0.5 * below);
    let own = DVec3::new(center[0].into(), center[1].into(), center[2].into());
    assert!(own.distance(expected) < 1e-6, "{own} not {expected}");
    // The same from behind is the other order.
    let from_behind = Options { camera: look(DVec3::new(0.0, 0.0, -2.5), DVec3::ZERO), ..options.clone() };
    let center = draw(&scene, &from_behind).0.pixels[8 * 16 + 8];
    let expected = colors.iter().fold(behind, |below, color| 0.5 * *color + 0.5 * below);
    let own = DVec3::new(center[0].into(), center[1].into(), center[2].into());
    assert!(own.distance(expected) < 1e-6, "{own} not {expected}");
    // Without a background the picture's alpha is what they cover.
    let transparent = Options { background: Background::Transparent, ..options };
    assert!((draw(&scene, &transparent).0.pixels[8 * 16 + 8][3] - 0.875).abs() < 1e-6);
}

#[test]
fn the_mean_alpha_of_many_samples_is_that_of_one() {
    let scene = layers(1, 0.1, |_| DVec3::ONE);
    let background = Background::Transparent;
    let one_pixel = Options { size: (1, 1), samples: 1 << 15, background, ..Options::default() };
    let options = Options { fov: Some(0.1), ..frontal(one_pixel) };
    let film = draw(&scene, &options).0;
    for value in film.pixels[0] {
        assert!((f64::from(value) - 0.1).abs() < 1e-7, "{value} not 0.1");
    }
    // What is left of rounding goes on from wave to wave.
    assert_eq!(film, draw(&scene, &Options { samples_in_flight: 1 << 14, ..options }).0);
}

#[test]
fn layers_end_at_their_bound_without_a_gap() {
    for count in [31, 32, 33, 40] {
        let scene = layers(count, 0.02, |_| DVec3::ONE);
        let black = Options { size: (8, 8), background: Background::Constant(DVec3::ZERO), ..Options::default() };
        let own = f64::from(draw(&scene, &frontal(black)).0.pixels[8 * 4 + 4][0]);
        // The 33rd is the last that is met; behind it is the background.
        let expected = 1.0 - 0.98_f64.powi(count.min(33) as i32);
        assert!((own - expected).abs() < 1e-5, "{count} layers: {own} not {expected}");
    }
}

/// A white ground under a light from above, and a card between them.
fn shaded_by(material: Material) -> Scene {
    let white = Material { metallic: 0.0, double_sided: true, ..Material::default() };
    let flat = DMat4::from_translation(DVec3::Y) * DMat4::from_rotation_x(-PI / 2.0);
    let mut scene = scene_of(
        vec![
            (shapes::ground(), DMat4::from_scale(DVec3::splat(8.0)), white),
            (card(0.0, 1.0), flat, Material { double_sided: true, ..material }),
        ],
        vec![Light::directional(DVec3::NEG_Y, DVec3::splat(PI))],
    );
    let holes = |x: u32, y: u32| if (x + y).is_multiple_of(2) { [255, 60, 60, 255] } else { [255, 255, 255, 40] };
    (scene.images, scene.textures) = (vec![image(4, 4, holes)], vec![Texture::of(0)]);
    scene
}

#[test]
fn shadows_have_holes_and_colours() {
    let base_color = Some(Map::of(0));
    let holed = Material { maps: Maps { base_color, ..Maps::default() }, ..Material::default() };
    let glass = Material { metallic: 0.0, transmission: 0.7, roughness: 0.2, ..holed.clone() };
    let attenuation_color = DVec3::new(0.2, 0.9, 0.5);
    let volume = Volume { thickness: 0.3, thickness_map: None, attenuation_distance: 0.5, attenuation_color };
    let mut thick = glass.clone();
    thick.lobes.volume = Some(volume);
    let cases = [
        ("mask", Material { alpha_mode: AlphaMode::Mask(0.5), ..holed.clone() }),
        ("blend", Material { alpha_mode: AlphaMode::Blend, metallic: 0.0, ..holed }),
        ("glass", glass),
        ("thick glass", thick),
    ];
    let camera = look(DVec3::new(2.0, 3.0, 4.0), DVec3::new(0.0, 0.4, 0.0));
    let options = Options { camera, ..small() };
    let opaque = draw(&shaded_by(Material::default()), &options).0;
    for (name, material) in cases {
        let scene = shaded_by(material);
        let film = draw(&scene, &options).0;
        assert_ne!(film, opaque, "{name}");
        assert_alike(name, &draw_reference(&scene, &options), &film);
        assert_eq!(film, draw(&scene, &Options { all_features: true, ..options.clone() }).0, "{name}: all features");
        let shared = Options { instancing: Instancing::Shared, ..options.clone() };
        assert_eq!(film, draw(&scene, &shared).0, "{name}: nothing to share");
    }
}

#[test]
fn light_through_a_blended_card_is_weakened_and_tinted() {
    let (alpha, color) = (0.4, DVec3::new(0.9, 0.5, 0.1));
    let pane =
        Material { base_color: color, alpha, alpha_mode: AlphaMode::Blend, metallic: 0.0, ..Material::default() };
    let camera = look(DVec3::new(0.0, 0.5, 4.0), DVec3::new(0.0, 0.0, 0.2));
    let options = Options { camera, size: (64, 48), max_depth: 0, ..Options::default() };
    let without_ambient = |scene: Scene| {
        let lit = draw(&scene, &options).0;
        let dark = draw(&Scene { lights: vec![], ..scene }, &options).0;
        // The middle of the picture lies on the ground under the card.
        let at = 24 * 64 + 32;
        DVec3::from_array([0, 1, 2].map(|c| f64::from(lit.pixels[at][c] - dark.pixels[at][c])))
    };
    let mut bare = shaded_by(pane.clone());
    bare.instances.truncate(1);
    let share = without_ambient(shaded_by(pane)) / without_ambient(bare);
    let expected = (1.0 - alpha) * (DVec3::ONE * (1.0 - alpha) + color * alpha);
    assert!(share.distance(expected) < 1e-5, "{share} not {expected}");
}

#[test]
fn vertex_alpha_counts() {
    let mut fading = card(0.0, 1.0);
    fading.colors = [0.0, 1.0, 1.0, 0.0].map(|alpha| Vec4::new(1.0, 1.0, 1.0, alpha)).to_vec();
    for alpha_mode in [AlphaMode::Opaque, AlphaMode::Mask(0.3), AlphaMode::Blend] {
        let scene = alone(fading.clone(), Material { alpha_mode, ..unlit(None) });
        let options = frontal(Options { background: Background::Transparent, ..small() });
        let film = draw(&scene, &options).0;
        assert_alike(&format!("vertex alpha {alpha_mode:?}"), &draw_reference(&scene, &options), &film);
        let mean = film.pixels.iter().map(|pixel| f64::from(pixel[3])).sum::<f64>();
        let whole = draw(&alone(card(0.0, 1.0), unlit(None)), &options).0;
        let covered = mean / whole.pixels.iter().map(|pixel| f64::from(pixel[3])).sum::<f64>();
        let expected = match alpha_mode {
            AlphaMode::Opaque => 1.0,
            AlphaMode::Mask(cutoff) => 1.0 - cutoff,
            AlphaMode::Blend => 0.5,
        };
        assert!((covered - expected).abs() < 0.01, "{alpha_mode:?}: {covered} not {expected}");
    }
}
