//! The node tree → instances, cameras and lights in world space.

use super::Document;
use crate::error::{Error, Result};
use crate::scene::{Camera, Instance, Light, LightKind, Projection, Scene};
use ::gltf::json::extensions::scene::khr_lights_punctual::{self as punctual, Type as LightType};
use ::gltf::json::scene::Node;
use ::gltf::json::validation::Checked;
use glam::{DMat4, DQuat, DVec3};
use std::f64::consts::{FRAC_PI_2, PI};

/// Most instances of meshes in a scene.
const MOST_INSTANCES: usize = 1 << 22;

impl Document<'_> {
    /// Walks the chosen scene's nodes. Transforms are composed in f64.
    pub fn add_nodes(&mut self, scene: &mut Scene, primitives: &[Vec<usize>], choice: Option<&str>) -> Result<()> {
        scene.has_lights = !self.lights().is_empty();
        let mut stack: Vec<(usize, DMat4)> =
            self.roots(choice)?.into_iter().rev().map(|node| (node, DMat4::IDENTITY)).collect();
        let mut visited = vec![false; self.root.nodes.len()];
        while let Some((index, world_from_parent)) = stack.pop() {
            if std::mem::replace(&mut visited[index], true) {
                return Err(self.refuse(format!("nodes[{index}] has two parents, or is its own ancestor")));
            }
            let node = self.root.nodes[index].clone();
            let world_from_node = world_from_parent * local_transform(&node);
            if let Some(mesh) = node.mesh {
                let places = self.instance_transforms(index, &node)?.unwrap_or_else(|| vec![DMat4::IDENTITY]);
                let meshes = &primitives[mesh.value()];
                if scene.instances.len() + places.len().saturating_mul(meshes.len()) > MOST_INSTANCES {
                    return Err(self.refuse(format!("more than {MOST_INSTANCES} instances of meshes")));
                }
                for object_from_instance in places {
                    let world_from_object = world_from_node * object_from_instance;
                    let instance = |mesh: &usize| Instance { mesh: *mesh, world_from_object };
                    scene.instances.extend(meshes.iter().map(instance));
                }
            }
            if let Some(camera) = node.camera {
                match self.camera(camera.value(), &world_from_node) {
                    Ok(camera) => scene.cameras.push((node.name.clone().unwrap_or_default(), camera)),
                    Err(fault) => self.warnings.add(format!("cameras[{}] is not used: {fault}", camera.value())),
                }
            }
            let light = node.extensions.as_ref().and_then(|extensions| extensions.khr_lights_punctual.as_ref());
            if let Some(light) = light.and_then(|reference| self.lights().get(reference.light.value())) {
                match read_light(light) {
                    Ok(light) => scene.lights.push(light.placed(&world_from_node)),
                    Err(fault) => self.warnings.add(format!("a light is not used: {fault}")),
                }
            }
            // Children in their own order: the stack turns them round.
            stack.extend(node.children.iter().flatten().rev().map(|child| (child.value(), world_from_node)));
        }
        Ok(())
    }

    fn lights(&self) -> &[punctual::Light] {
        self.root.as_ref()
    }

    /// Root nodes of the scene that is wanted, or of the file's default, or of all the file.
    fn roots(&mut self, choice: Option<&str>) -> Result<Vec<usize>> {
        let scenes = &self.root.scenes;
        let index = match choice {
            Some(name) => {
                let by_index = name.parse::<usize>().ok().filter(|index| *index < scenes.len());
                let found = by_index.or_else(|| scenes.iter().position(|scene| scene.name.as_deref() == Some(name)));
                Some(found.ok_or_else(|| {
                    Error::Usage(format!("{}: no scene '{name}', it has {}", self.file, scenes.len()))
                })?)
            }
            None => self.root.scene.map(|scene| scene.value()).or(if scenes.is_empty() { None } else { Some(0) }),
        };
        if let Some(index) = index {
            if scenes.len() > 1 && choice.is_none() {
                self.warnings
                    .add(format!("the file has {} scenes, this is number {index} (choose with --scene)", scenes.len()));
            }
            return Ok(self.root.scenes[index].nodes.iter().map(|node| node.value()).collect());
        }
        self.warnings.add("the file has no scene: all its nodes are shown");
        let mut is_child = vec![false; self.root.nodes.len()];
        self.root
            .nodes
            .iter()
            .flat_map(|node| node.children.iter().flatten())
            .for_each(|child| is_child[child.value()] = true);
        Ok((0..is_child.len()).filter(|node| !is_child[*node]).collect())
    }

    /// EXT_mesh_gpu_instancing: one transform an instance; `None` when the node has no such extension.
    fn instance_transforms(&mut self, index: usize, node: &Node) -> Result<Option<Vec<DMat4>>> {
        let others = node.extensions.as_ref().map(|extensions| &extensions.others);
        let Some(attributes) = others.and_then(|others| others.get("EXT_mesh_gpu_instancing")?.get("attributes"))
        else {
            return Ok(None);
        };
        let refuse =
            |message: &str| self.refuse(format!("nodes[{index}].extensions.EXT_mesh_gpu_instancing: {message}"));
        let mut count = None;
        let mut read = |name: &str, components: usize| -> Result<Option<Vec<f32>>> {
            let Some(accessor) = attributes.get(name) else { return Ok(None) };
            let accessor = accessor
                .as_u64()
                .map(|accessor| accessor as usize)
                .filter(|accessor| *accessor < self.root.accessors.len());
            let elements = self.floats(accessor.ok_or_else(|| refuse("an attribute names no accessor"))?)?;
            let own = elements.values.len() / elements.components;
            if elements.components != components || *count.get_or_insert(own) != own {
                return Err(refuse("its attributes differ in length or have the wrong type"));
            }
            Ok(Some(elements.values))
        };
        let (translations, rotations, scales) = (read("TRANSLATION", 3)?, read("ROTATION", 4)?, read("SCALE", 3)?);
        let vector = |values: &Option<Vec<f32>>, i: usize, default: DVec3| {
            values.as_ref().map_or(default, |values| glam::Vec3::from_slice(&values[3 * i..]).as_dvec3())
        };
        let transform = |i: usize| {
            let rotation = rotations.as_ref().map_or(DQuat::IDENTITY, |values| unit(&values[4 * i..]));
            DMat4::from_scale_rotation_translation(
                vector(&scales, i, DVec3::ONE),
                rotation,
                vector(&translations, i, DVec3::ZERO),
            )
        };
        Ok(Some((0..count.unwrap_or(0)).map(transform).collect()))
    }

    fn camera(&self, index: usize, world_from_node: &DMat4) -> Result<Camera> {
        let camera = &self.root.cameras[index];
        let usage = |message: &str| Error::Usage(message.into());
        let projection = match (&camera.perspective, &camera.orthographic) {
            (Some(perspective), None) if perspective.yfov > 0.0 && f64::from(perspective.yfov) < PI => {
                Projection::Perspective { fov: perspective.yfov.into() }
            }
            (None, Some(orthographic)) if orthographic.ymag.abs() > 0.0 => {
                Projection::Orthographic { half_height: f64::from(orthographic.ymag.abs()) }
            }
            (Some(_), Some(_)) | (None, None) => return Err(usage("it must be either perspective or orthographic")),
            _ => return Err(usage("its field of view or magnification is out of range")),
        };
        Camera::of_node(world_from_node, projection)
    }
}

fn unit(xyzw: &[f32]) -> DQuat {
    let q = DQuat::from_xyzw(xyzw[0].into(), xyzw[1].into(), xyzw[2].into(), xyzw[3].into());
    if q.length() > 0.0 && q.is_finite() {
        q.normalize()
    } else {
        DQuat::IDENTITY
    }
}

fn local_transform(node: &Node) -> DMat4 {
    if let Some(matrix) = node.matrix {
        return DMat4::from_cols_array(&matrix.map(f64::from));
    }
    let vector = |values: Option<[f32; 3]>, default| values.map_or(default, |v| DVec3::from_array(v.map(f64::from)));
    let rotation = node.rotation.map_or(DQuat::IDENTITY, |rotation| unit(&rotation.0));
    DMat4::from_scale_rotation_translation(
        vector(node.scale, DVec3::ONE),
        rotation,
        vector(node.translation, DVec3::ZERO),
    )
}

/// A light of the extension, at the origin.
fn read_light(light: &punctual::Light) -> Result<Light, String> {
    let intensity = DVec3::from_array(light.color.map(f64::from)) * f64::from(light.intensity);
    if !intensity.is_finite() || intensity.min_element() < 0.0 {
        return Err(format!("its colour times intensity is {intensity}"));
    }
    let kind = match (&light.type_, &light.spot) {
        (Checked::Valid(LightType::Directional), _) => LightKind::Directional,
        (Checked::Valid(LightType::Point), _) => LightKind::Point,
        (Checked::Valid(LightType::Spot), spot) => {
            let spot = spot
                .clone()
                .unwrap_or(punctual::Spot { inner_cone_angle: 0.0, outer_cone_angle: std::f32::consts::FRAC_PI_4 });
            let (inner, outer) = (f64::from(spot.inner_cone_angle), f64::from(spot.outer_cone_angle));
            if !(0.0 <= inner && inner < outer && outer <= FRAC_PI_2 + 1e-6) {
                return Err(format!("its cone angles are {inner} and {outer}"));
            }
            LightKind::Spot { inner_cosine: inner.cos(), outer_cosine: outer.cos() }
        }
        _ => return Err("its type is unknown".into()),
    };
    let range = light.range.map(f64::from).filter(|range| *range > 0.0);
    Ok(Light { kind, position: DVec3::ZERO, direction: DVec3::NEG_Z, intensity, range })
}
