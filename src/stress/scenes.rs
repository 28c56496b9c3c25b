//! What the cases' scenes are made of.

use crate::scene::{Instance, Light, Material, Mesh, Scene, Whitted};
use glam::{DMat4, DVec3, Vec3};
use std::f64::consts::{PI, TAU};

/// A material of grey coefficients, seen from both sides.
pub fn grey(ambient: f64, diffuse: f64, mirror: f64) -> Material {
    let splat = DVec3::splat;
    let whitted = Whitted {
        ambient: splat(ambient),
        diffuse: splat(diffuse),
        specular: DVec3::ZERO,
        shininess: 1.0,
        mirror: splat(mirror),
    };
    Material::exact("grey", whitted)
}

/// A scene of meshes, each somewhere in a material of its own.
pub fn scene_of(parts: impl IntoIterator<Item = (Mesh, DMat4, Material)>, lights: Vec<Light>) -> Scene {
    let mut scene = Scene { name: "stress".into(), lights, has_lights: true, ..Scene::default() };
    for (index, (mesh, world_from_object, material)) in parts.into_iter().enumerate() {
        scene.meshes.push(Mesh { material: index, ..mesh });
        scene.materials.push(material);
        scene.instances.push(Instance { mesh: index, world_from_object });
    }
    scene
}

/// A scene in other units and elsewhere: lengths times `scale`, then moved. What light does stays the same.
pub fn elsewhere(scene: &Scene, scale: f64, offset: DVec3) -> Scene {
    let mut scene = scene.clone();
    let transform = DMat4::from_translation(offset) * DMat4::from_scale(DVec3::splat(scale));
    for instance in &mut scene.instances {
        instance.world_from_object = transform * instance.world_from_object;
    }
    for light in scene.lights.iter_mut().filter(|light| light.kind != crate::scene::LightKind::Directional) {
        light.position = transform.transform_point3(light.position);
        light.intensity *= scale * scale;
        light.range = light.range.map(|range| range * scale);
    }
    for (_, camera) in &mut scene.cameras {
        camera.eye = transform.transform_point3(camera.eye);
    }
    scene
}

/// A rotation that leaves nothing along an axis.
pub fn tilt() -> DMat4 {
    DMat4::from_euler(glam::EulerRot::XYZ, 0.7, 0.4, 1.1)
}

/// Numbers from 0 to 1 that are the same every time (SplitMix64; Steele, Lea and Flood, OOPSLA 2014).
pub struct Random(u64);

impl Random {
    /// A sequence of its own for each seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next 64 bits.
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ mixed >> 31
    }

    /// [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// One of `count` numbers from 0.
    pub fn below(&mut self, count: usize) -> usize {
        (self.unit() * count as f64) as usize
    }

    /// A point in the cube from −1 to 1.
    pub fn in_cube(&mut self) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| self.unit() * 2.0 - 1.0))
    }

    /// A unit vector, all directions alike.
    pub fn direction(&mut self) -> DVec3 {
        let (height, angle) = (self.unit() * 2.0 - 1.0, self.unit() * TAU);
        let radius = (1.0 - height * height).sqrt();
        DVec3::new(radius * angle.cos(), height, radius * angle.sin())
    }
}

/// A closed sphere of radius 0.7 to 1.3, each vertex at a distance of its own, each vertex once.
pub fn noisy_sphere(rings: u32) -> Mesh {
    let mut random = Random::new(7);
    let around = 2 * rings;
    let mut mesh = Mesh { name: "noisy sphere".into(), positions: vec![Vec3::Y], ..Mesh::default() };
    for ring in 1..rings {
        for step in 0..around {
            let (polar, angle) = (PI * f64::from(ring) / f64::from(rings), TAU * f64::from(step) / f64::from(around));
            let point = DVec3::new(polar.sin() * angle.sin(), polar.cos(), polar.sin() * angle.cos());
            mesh.positions.push((point * (0.7 + 0.6 * random.unit())).as_vec3());
        }
    }
    mesh.positions.push(Vec3::NEG_Y);
    let last = mesh.positions.len() as u32 - 1;
    let vertex = |ring: u32, step: u32| match ring {
        0 => 0,
        ring if ring == rings => last,
        ring => 1 + (ring - 1) * around + step % around,
    };
    for ring in 0..rings {
        for step in 0..around {
            let [a, b] = [vertex(ring, step), vertex(ring, step + 1)];
            let [c, d] = [vertex(ring + 1, step), vertex(ring + 1, step + 1)];
            if ring + 1 < rings {
                mesh.triangles.push([a, c, d]);
            }
            if ring > 0 {
                mesh.triangles.push([a, d, b]);
            }
        }
    }
    mesh
}

/// A closed ring of radius 1 whose tube has radius 0.4.
pub fn torus(around: u32, across: u32) -> Mesh {
    let mut mesh = Mesh { name: "torus".into(), ..Mesh::default() };
    for i in 0..around {
        for j in 0..across {
            let (u, v) = (TAU * f64::from(i) / f64::from(around), TAU * f64::from(j) / f64::from(across));
            let radius = 1.0 + 0.4 * v.cos();
            mesh.positions.push(DVec3::new(radius * u.cos(), 0.4 * v.sin(), radius * u.sin()).as_vec3());
            let vertex = |i: u32, j: u32| i % around * across + j % across;
            let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}
