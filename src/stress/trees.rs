//! Cases about which triangles there are, and in which order.

use super::scenes::{grey, scene_of, Random};
use super::{Finding, Stress};
use crate::error::{Error, Result};
use crate::layout::MAX_TREE_DEPTH;
use crate::reference;
use crate::render::ray_sets::SetKind;
use crate::render::{Met, Options, Prepared, Ray};
use crate::scene::{gltf, shapes, Background, CameraChoice, Mesh, Scene};
use glam::{DMat4, DVec3, Vec3};

/// Copies of a square in colours of their own, in several orders.
pub(super) fn coplanar(stress: &mut Stress) -> Result<()> {
    for copies in stress.few(&[2, 5, 10, 30, 100, 300, 1000], &[2, 30, 1000]) {
        stress.row("copies", copies as f64, |stress| {
            let camera = CameraChoice::LookAt { eye: DVec3::new(0.1, 0.6, 0.3), target: Some(DVec3::ZERO) };
            let options = Options { size: (64, 48), camera, ..stress.options.clone() };
            let draw = |order: &[usize]| {
                let part =
                    |copy: &usize| (shapes::ground(), DMat4::IDENTITY, grey((*copy as f64 + 1.0) / 1001.0, 0.0, 0.0));
                stress.renderer.render(&scene_of(order.iter().map(part), Vec::new()), &options).map(|(film, _)| film)
            };
            let mut order: Vec<usize> = (0..copies).collect();
            let first = draw(&order)?;
            let mut wrong = 0;
            let mut random = Random::new(copies as u64);
            for turn in 0..3 {
                order.reverse();
                for place in (1..copies * usize::from(turn > 0)).rev() {
                    order.swap(place, random.below(place + 1));
                }
                let film = draw(&order)?;
                wrong += film.pixels.iter().zip(&first.pixels).filter(|(a, b)| a != b).count();
            }
            Ok(Finding::none_of(3 * first.pixels.len() as u64, wrong as u64))
        })?;
    }
    Ok(())
}

/// Rays of which each is judged by f64 arithmetic over all triangles.
const JUDGED: (u32, u32) = (24, 16);

/// Meshes that make bad trees.
pub(super) fn trees_that_hurt(stress: &mut Stress) -> Result<()> {
    type Kind = (&'static str, usize, fn(usize) -> Mesh);
    let mut kinds: Vec<Kind> = vec![
        ("triangles about one centre", 10_000, concentric),
        ("boxes, each twice as large", 40, doubling),
        ("triangles beside one 10⁴ × longer", 10_000, one_diagonal),
        ("triangles over each other", 10_000, overlapping),
        ("copies of one triangle", 100_000, |count| few(1, count)),
        ("triangles in all", 0, |count| few(count, 1)),
        ("triangles in all", 1, |count| few(count, 1)),
        ("triangles in all", 2, |count| few(count, 1)),
    ];
    if !stress.settings.quick {
        kinds.push(("triangles over each other", 1_000_000, overlapping));
        kinds.push(("triangles about one centre", 1_000_000, concentric));
    }
    for (name, count, mesh) in kinds {
        stress.row(name, count as f64, |stress| hurt(stress, mesh(count)))?;
    }
    Ok(())
}

/// Triangles of all sizes about the origin.
fn concentric(count: usize) -> Mesh {
    let mut random = Random::new(17);
    soup(count, |index| {
        let (along, across) = (random.direction(), random.direction());
        let size = (index + 1) as f64 / count as f64;
        // The box of a and −a is about the origin, and c lies in it.
        [along * size, -along * size, along * (0.9 * size * random.unit()) + across * 1e-3 * size]
    })
}

/// Boxes around each other.
fn doubling(count: usize) -> Mesh {
    let cube = shapes::cube();
    let mut mesh = Mesh { name: "boxes".into(), ..Mesh::default() };
    for level in 0..count as i32 {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(cube.positions.iter().map(|point| *point * 2_f32.powi(level - count as i32)));
        // The front is left out, so that rays go on to the next.
        let open = cube.triangles.iter().filter(|corners| !corners.iter().all(|corner| corner & 4 != 0));
        mesh.triangles.extend(open.map(|corners| corners.map(|corner| corner + first)));
    }
    mesh
}

/// Small triangles, and a sliver through all of them.
fn one_diagonal(count: usize) -> Mesh {
    let mut random = Random::new(19);
    let mut mesh = soup(count, |_| {
        let center = random.in_cube() * 0.5;
        std::array::from_fn(|_| center + random.in_cube() * 5e-5)
    });
    let first = mesh.positions.len() as u32;
    mesh.positions.extend([Vec3::splat(-0.5), Vec3::splat(0.5), Vec3::new(0.5, 0.5, 0.4999)]);
    mesh.triangles.push([first, first + 1, first + 2]);
    mesh
}

/// Large triangles, most of which a ray meets.
fn overlapping(count: usize) -> Mesh {
    let mut random = Random::new(23);
    soup(count, |index| {
        let z = (index as f64 / count as f64 - 0.5) * 1e-2;
        [(-0.9, -0.8), (0.9, -0.8), (0.0, 0.9)].map(|(x, y)| DVec3::new(x, y, z) + random.in_cube() * 0.05)
    })
}

/// So many different triangles, each so many times.
fn few(different: usize, copies: usize) -> Mesh {
    let mut mesh = soup(different, |index| {
        let z = index as f64 * 0.1;
        [DVec3::new(-0.8, -0.7, z), DVec3::new(0.8, -0.7, z), DVec3::new(0.1, 0.8, z)]
    });
    mesh.triangles = (0..copies).flat_map(|_| mesh.triangles.clone()).collect();
    mesh
}

fn soup(count: usize, triangle: impl FnMut(usize) -> [DVec3; 3]) -> Mesh {
    let positions: Vec<Vec3> = (0..count).flat_map(triangle).map(|corner| corner.as_vec3()).collect();
    let triangles = (0..count as u32).map(|index| [3 * index, 3 * index + 1, 3 * index + 2]).collect();
    Mesh { name: "soup".into(), positions, triangles, ..Mesh::default() }
}

/// Traces a fan of rays at the mesh and has each answer judged.
fn hurt(stress: &Stress, mesh: Mesh) -> Result<Finding> {
    let scene = scene_of([(mesh, DMat4::IDENTITY, grey(1.0, 0.0, 0.0))], Vec::new());
    let eye = DVec3::new(0.1, 0.2, 2.0);
    let camera = CameraChoice::LookAt { eye, target: Some(DVec3::ZERO) };
    let options = Options { size: JUDGED, camera, ..stress.options.clone() };
    let prepared = Prepared::new(&scene, &options)?;
    let tree = prepared.tree(&options);
    let mut random = Random::new(29);
    let ray = |_| {
        let direction = (random.in_cube() * 0.4 - eye).normalize();
        // As the device will have it, so that both judge the same ray.
        Ray { origin: eye, direction: direction.as_vec3().as_dvec3(), t_max: f64::MAX }
    };
    let rays: Vec<Ray> = (0..JUDGED.0 * JUDGED.1).map(ray).collect();
    let trace = stress.renderer.tracer(&scene, &prepared, &tree)?.trace(SetKind::Diffuse, &rays, 1, &options)?;
    let is_wrong = |(ray, met): (&Ray, &Met)| {
        let met = match *met {
            Met::Nothing => None,
            Met::Something => Some(None),
            Met::Triangle { t, .. } => Some(Some(f64::from(t))),
        };
        !reference::allows(&prepared.soup, ray.origin, ray.direction, ray.t_max, met)
    };
    let wrong = rays.iter().zip(&trace.met).filter(|pair| is_wrong(*pair)).count();
    let too_deep = u64::from(tree.report().depth > MAX_TREE_DEPTH);
    Ok(Finding::none_of(rays.len() as u64, wrong as u64 + too_deep))
}

/// Numbers and indices that make no sense.
pub(super) fn bad_input(stress: &mut Stress) -> Result<()> {
    let f32s: [(&str, f32, bool); 5] = [
        ("a position is NaN", f32::NAN, true),
        ("a position is +inf", f32::INFINITY, true),
        ("a position is -inf", f32::NEG_INFINITY, true),
        ("a position is 1e38", 1e38, true),
        ("a position is denormal", 1e-40, false),
    ];
    for (name, value, is_dropped) in f32s {
        stress.row(name, f64::from(value), |stress| {
            let mut mesh = shapes::cube();
            mesh.positions.push(Vec3::new(value, 0.3, 0.2));
            mesh.triangles.push([0, 1, 8]);
            drawn(stress, mesh, is_dropped.then_some("not a finite number"))
        })?;
    }
    for (name, corner) in
        [("a triangle without area", Vec3::new(0.0, -0.5, -0.5)), ("a triangle that is a point", Vec3::splat(-0.5))]
    {
        stress.row(name, 0.0, |stress| {
            let mut mesh = shapes::cube();
            mesh.positions.push(corner);
            mesh.triangles.push([0, if corner.x == 0.0 { 1 } else { 0 }, 8]);
            drawn(stress, mesh, None)
        })?;
    }
    stress.row("an index past the end", 0.0, |_| {
        let uri = "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAkA";
        let document = format!(
            r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}},
            {{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}}],
            "bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":6}}],
            "buffers":[{{"byteLength":42,"uri":"{uri}"}}]}}"#
        );
        let read = gltf::parse(document.as_bytes(), "past".into(), "past.gltf", None, &gltf::ReadOptions::default());
        let names_it = |message: &str| message.contains("index 9") || message.contains("9");
        Ok(Finding::check(match read {
            Err(Error::Content { message, .. }) => names_it(&message),
            Err(_) => false,
            Ok(scene) => scene.warnings.iter().any(|warning| names_it(warning)),
        }))
    })
}

/// The picture shows the rest of the mesh, and a warning says what was dropped, if anything was.
fn drawn(stress: &Stress, mesh: Mesh, dropped: Option<&str>) -> Result<Finding> {
    let scene: Scene = scene_of([(mesh, DMat4::IDENTITY, grey(0.5, 0.0, 0.0))], Vec::new());
    let camera = CameraChoice::LookAt { eye: DVec3::new(0.4, 0.7, 3.0), target: Some(DVec3::ZERO) };
    let background = Background::Constant(DVec3::ZERO);
    let options = Options { size: (32, 24), camera, background, ..stress.options.clone() };
    let (film, report) = stress.renderer.render(&scene, &options)?;
    let seen = film.pixels.iter().filter(|pixel| pixel[0] == 0.5).count();
    let odd = film.pixels.iter().filter(|pixel| pixel[0] != 0.5 && pixel[0] != 0.0).count();
    let says = dropped.is_none_or(|words| report.scene.warnings.iter().any(|warning| warning.contains(words)));
    Ok(Finding::check(seen > 40 && odd == 0 && says))
}
