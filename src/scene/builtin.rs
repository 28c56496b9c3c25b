//! Built-in scenes, made of the shapes.

use super::teapot::teapot;
use super::{shapes, Camera, Instance, Light, Material, Mesh, Projection, Scene, Whitted};
use crate::error::{Error, Result};
use glam::{DMat4, DVec3, Vec3};

/// Names of the built-in scenes with a sentence each; the first is the default.
pub const BUILT_IN: [(&str, &str); 4] = [
    ("table", "a table of five cubes with the teapot and a mirror ball on it"),
    ("cornell", "a box of coloured walls, two boxes in it, a light below its ceiling"),
    ("mirrors", "balls between two mirrors that face each other"),
    ("teapot", "the teapot on a plane"),
];

/// The built-in scene of that name.
///
/// # Errors
/// `Usage` when there is none.
pub fn built_in(name: &str) -> Result<Scene> {
    match name {
        "table" => table(),
        "cornell" => cornell(),
        "mirrors" => mirrors(),
        "teapot" => teapot_alone(),
        _ => Err(Error::Usage(format!(
            "no built-in scene '{name}'; there is {}",
            BUILT_IN.map(|(own, _)| own).join(", ")
        ))),
    }
}

impl Scene {
    fn named(name: &str) -> Self {
        Self { name: name.into(), has_lights: true, ..Self::default() }
    }

    /// Adds a mesh in a material and returns its index.
    fn add_mesh(&mut self, mesh: Mesh, material: Material) -> usize {
        self.materials.push(material);
        self.meshes.push(Mesh { material: self.materials.len() - 1, ..mesh });
        self.meshes.len() - 1
    }

    fn place(&mut self, mesh: usize, world_from_object: DMat4) {
        self.instances.push(Instance { mesh, world_from_object });
    }

    fn look(&mut self, eye: DVec3, target: DVec3, fov_degrees: f64) -> Result<()> {
        let projection = Projection::Perspective { fov: fov_degrees.to_radians() };
        self.cameras.push(("default".into(), Camera::looking(eye, target - eye, DVec3::Y, projection)?));
        Ok(())
    }
}

/// A dull material: Lambert with a share of ambient.
fn matte(name: &str, color: DVec3) -> Material {
    shiny(name, color, DVec3::ZERO, 1.0, DVec3::ZERO)
}

fn shiny(name: &str, color: DVec3, specular: DVec3, shininess: f64, mirror: DVec3) -> Material {
    let whitted = Whitted { ambient: color * 0.18, diffuse: color * 0.8, specular, shininess, mirror };
    Material::exact(name, whitted)
}

fn moved(x: f64, y: f64, z: f64) -> DMat4 {
    DMat4::from_translation(DVec3::new(x, y, z))
}

fn scaled(x: f64, y: f64, z: f64) -> DMat4 {
    DMat4::from_scale(DVec3::new(x, y, z))
}

/// Top and four legs are one unit cube under five matrices.
fn table() -> Result<Scene> {
    let mut scene = Scene::named("table");
    let floor = scene
        .add_mesh(shapes::ground(), shiny("floor", DVec3::new(0.42, 0.40, 0.37), DVec3::ZERO, 1.0, DVec3::splat(0.06)));
    scene.place(floor, scaled(14.0, 1.0, 14.0));

    let wood = shiny("wood", DVec3::new(0.52, 0.30, 0.15), DVec3::splat(0.12), 40.0, DVec3::splat(0.05));
    let cube = scene.add_mesh(shapes::cube(), wood);
    scene.place(cube, moved(0.0, 0.96, 0.0) * scaled(2.4, 0.08, 1.5));
    for (x, z) in [(-1.1, -0.65), (1.1, -0.65), (-1.1, 0.65), (1.1, 0.65)] {
        scene.place(cube, moved(x, 0.46, z) * scaled(0.09, 0.92, 0.09));
    }

    let china = shiny("china", DVec3::new(0.80, 0.33, 0.22), DVec3::splat(0.55), 90.0, DVec3::splat(0.10));
    let pot = scene.add_mesh(teapot(10), china);
    scene.place(pot, moved(-0.42, 1.0, 0.08) * DMat4::from_rotation_y(0.55) * scaled(0.22, 0.22, 0.22));

    let silver = shiny("silver", DVec3::new(0.05, 0.05, 0.06), DVec3::splat(0.7), 300.0, DVec3::new(0.82, 0.83, 0.86));
    let ball = scene.add_mesh(shapes::sphere(48), silver);
    scene.place(ball, moved(0.62, 1.34, -0.12) * scaled(0.34, 0.34, 0.34));

    scene.lights.push(Light::point(DVec3::new(-2.2, 4.2, 2.6), DVec3::new(19.0, 17.6, 15.4)));
    scene.lights.push(Light::point(DVec3::new(3.4, 3.0, 2.2), DVec3::new(3.4, 4.0, 5.0)));
    scene.look(DVec3::new(0.9, 2.35, 3.9), DVec3::new(0.0, 0.93, 0.0), 38.0)?;
    Ok(scene)
}

/// After the box of Cornell's program of computer graphics: 2 m wide, open to the camera.
fn cornell() -> Result<Scene> {
    let mut scene = Scene::named("cornell");
    let white = DVec3::splat(0.73);
    let wall = |a: [f32; 3], b: [f32; 3], c: [f32; 3], d: [f32; 3]| shapes::square([a, b, c, d].map(Vec3::from_array));
    let walls = [
        ("floor", white, wall([-1., 0., 1.], [1., 0., 1.], [1., 0., -1.], [-1., 0., -1.])),
        ("ceiling", white, wall([-1., 2., -1.], [1., 2., -1.], [1., 2., 1.], [-1., 2., 1.])),
        ("back", white, wall([-1., 0., -1.], [1., 0., -1.], [1., 2., -1.], [-1., 2., -1.])),
        ("red", DVec3::new(0.63, 0.06, 0.05), wall([-1., 0., 1.], [-1., 0., -1.], [-1., 2., -1.], [-1., 2., 1.])),
        ("green", DVec3::new(0.14, 0.45, 0.09), wall([1., 0., -1.], [1., 0., 1.], [1., 2., 1.], [1., 2., -1.])),
    ];
    for (name, color, mesh) in walls {
        let mesh = scene.add_mesh(mesh, matte(name, color));
        scene.place(mesh, DMat4::IDENTITY);
    }
    let block = scene.add_mesh(shapes::cube(), matte("block", white));
    scene.place(block, moved(0.35, 0.3, 0.35) * DMat4::from_rotation_y(-0.3) * scaled(0.6, 0.6, 0.6));
    let mirror = shiny("mirror block", white * 0.2, DVec3::ZERO, 1.0, DVec3::splat(0.75));
    let tall = scene.add_mesh(shapes::cube(), mirror);
    scene.place(tall, moved(-0.35, 0.6, -0.3) * DMat4::from_rotation_y(0.3) * scaled(0.6, 1.2, 0.6));
    scene.lights.push(Light::point(DVec3::new(0.0, 1.9, 0.0), DVec3::new(1.30, 1.15, 0.95)));
    // Off the axis of symmetry: there pixel centres lie exactly on the seams of walls, where either wall is right.
    scene.look(DVec3::new(0.03, 1.02, 4.4), DVec3::new(0.0, 1.0, 0.0), 36.0)?;
    Ok(scene)
}

/// Reflections of reflections, as many as the maximum depth.
fn mirrors() -> Result<Scene> {
    let mut scene = Scene::named("mirrors");
    let floor = scene.add_mesh(shapes::ground(), matte("floor", DVec3::new(0.45, 0.43, 0.40)));
    scene.place(floor, scaled(6.0, 1.0, 6.0));
    let glass = shiny("glass", DVec3::splat(0.04), DVec3::ZERO, 1.0, DVec3::new(0.86, 0.90, 0.88));
    let pane = scene.add_mesh(shapes::cube(), glass);
    scene.place(pane, moved(0.0, 1.0, -2.0) * scaled(4.0, 1.98, 0.05));
    scene.place(pane, moved(0.0, 1.0, 2.0) * scaled(4.0, 1.98, 0.05));
    let colors = [DVec3::new(0.75, 0.18, 0.14), DVec3::new(0.82, 0.62, 0.16), DVec3::new(0.16, 0.38, 0.68)];
    for (index, color) in colors.into_iter().enumerate() {
        let material = shiny("ball", color, DVec3::splat(0.4), 120.0, DVec3::splat(0.12));
        let ball = scene.add_mesh(shapes::sphere(32), material);
        let x = index as f64 - 1.0;
        scene.place(ball, moved(1.1 * x, 0.4, -0.3 * x * x) * scaled(0.4, 0.4, 0.4));
    }
    scene.lights.push(Light::point(DVec3::new(0.6, 3.6, 0.3), DVec3::splat(10.0)));
    scene.look(DVec3::new(1.5, 1.55, 1.75), DVec3::new(-0.15, 0.62, -2.0), 62.0)?;
    Ok(scene)
}

fn teapot_alone() -> Result<Scene> {
    let mut scene = Scene::named("teapot");
    let floor = scene.add_mesh(shapes::ground(), matte("floor", DVec3::new(0.5, 0.5, 0.5)));
    scene.place(floor, scaled(30.0, 1.0, 30.0));
    let china = shiny("china", DVec3::new(0.70, 0.72, 0.76), DVec3::splat(0.5), 80.0, DVec3::ZERO);
    let pot = scene.add_mesh(teapot(12), china);
    scene.place(pot, DMat4::IDENTITY);
    scene.lights.push(Light::point(DVec3::new(-5.0, 9.0, 8.0), DVec3::splat(120.0)));
    scene.look(DVec3::new(3.4, 5.2, 8.4), DVec3::new(0.1, 1.35, 0.0), 36.0)?;
    Ok(scene)
}
