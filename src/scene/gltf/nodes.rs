//! The node tree: transforms, what hangs on the nodes, and which of them the chosen scene has.

use super::Document;
use crate::error::Result;
use crate::scene::{Light, LightKind, Projection};
use ::gltf::json::extensions::scene::khr_lights_punctual::{self as punctual, Type as LightType};
use ::gltf::json::validation::Checked;
use ::gltf::json::{self};
use glam::{DMat4, DQuat, DVec3};
use std::f64::consts::{FRAC_PI_2, PI};

/// Numbers of four bytes that the transform of an instance takes.
const PLACE_NUMBERS: u64 = 32;

/// A node's own transform.
#[derive(Clone, Copy, Debug)]
pub(super) enum Local {
    /// Given as a matrix, which no animation moves.
    Matrix(DMat4),
    /// Given in parts: first scaled, then turned, then moved.
    Parts { translation: DVec3, rotation: DQuat, scale: DVec3 },
}

impl Local {
    fn of(node: &json::Node) -> Self {
        if let Some(matrix) = node.matrix {
            return Self::Matrix(DMat4::from_cols_array(&matrix.map(f64::from)));
        }
        let vector =
            |values: Option<[f32; 3]>, default| values.map_or(default, |v| DVec3::from_array(v.map(f64::from)));
        Self::Parts {
            translation: vector(node.translation, DVec3::ZERO),
            rotation: node.rotation.map_or(DQuat::IDENTITY, |rotation| unit(&rotation.0.map(f64::from))),
            scale: vector(node.scale, DVec3::ONE),
        }
    }

    /// As a matrix.
    pub fn matrix(&self) -> DMat4 {
        match *self {
            Self::Matrix(matrix) => matrix,
            Self::Parts { translation, rotation, scale } => {
                DMat4::from_scale_rotation_translation(scale, rotation, translation)
            }
        }
    }
}

/// A node and what hangs on it.
#[derive(Debug)]
pub(super) struct Node {
    pub name: String,
    pub parent: Option<usize>,
    /// The topmost node above it, or itself.
    pub root: usize,
    pub local: Local,
    /// Index of a glTF mesh.
    pub mesh: Option<usize>,
    pub skin: Option<usize>,
    /// Weights of the mesh's morph targets: its own, or else the mesh's.
    pub weights: Vec<f64>,
    pub camera: Option<usize>,
    pub light: Option<usize>,
    /// Where its mesh stands, in its own space (EXT_mesh_gpu_instancing); `None` for once, at its origin.
    pub places: Option<Vec<DMat4>>,
    /// It and what is below it is not drawn (KHR_node_visibility).
    hidden: bool,
}

/// A node of the chosen scene.
#[derive(Clone, Copy, Debug)]
pub(super) struct Member {
    pub node: usize,
    /// Neither it nor what is above it is hidden.
    pub visible: bool,
}

/// All nodes of the file, and those of the chosen scene.
#[derive(Debug)]
pub(super) struct Hierarchy {
    pub nodes: Vec<Node>,
    /// All nodes, each behind its parent.
    pub order: Vec<usize>,
    /// The chosen scene's nodes, depth first.
    pub members: Vec<Member>,
    /// For each node, whether the chosen scene has it.
    pub is_member: Vec<bool>,
}

impl Hierarchy {
    /// The nodes of the chosen scene that are visible.
    pub fn visible(&self) -> impl Iterator<Item = &Node> {
        self.members.iter().filter(|member| member.visible).map(|member| &self.nodes[member.node])
    }
}

impl Document<'_> {
    /// Reads all nodes and walks those of the chosen scene.
    pub fn hierarchy(&mut self, choice: Option<&str>) -> Result<Hierarchy> {
        // Many nodes may have one mesh's weights each.
        let weights = |node: &json::Node| self.weights_of(node).map_or(0, |weights| weights.len() as u64);
        self.spend_numbers(self.root.nodes.iter().map(|node| 2 * weights(node)).sum())?;
        let mut nodes: Vec<Node> = self.root.nodes.iter().map(|node| self.node(node)).collect();
        for (parent, node) in self.root.nodes.iter().enumerate() {
            node.children.iter().flatten().for_each(|child| nodes[child.value()].parent = Some(parent));
        }
        let children = |node: usize| self.root.nodes[node].children.iter().flatten().rev().map(|child| child.value());
        // Children in their own order: the stack turns them round.
        let mut order: Vec<usize> = Vec::with_capacity(nodes.len());
        let mut stack: Vec<usize> = (0..nodes.len()).filter(|node| nodes[*node].parent.is_none()).collect();
        while let Some(node) = stack.pop() {
            order.push(node);
            nodes[node].root = nodes[node].parent.map_or(node, |parent| nodes[parent].root);
            stack.extend(children(node));
        }
        let roots = self.roots(choice)?;
        let mut members = Vec::new();
        let mut stack: Vec<(usize, bool)> = roots.into_iter().rev().map(|node| (node, true)).collect();
        let mut visited = vec![false; nodes.len()];
        while let Some((node, above)) = stack.pop() {
            if std::mem::replace(&mut visited[node], true) {
                return Err(self.refuse(format!("nodes[{node}] has two parents, or is its own ancestor")));
            }
            let visible = above && !nodes[node].hidden;
            members.push(Member { node, visible });
            let children = self.root.nodes[node].children.iter().flatten().rev();
            stack.extend(children.map(|child| (child.value(), visible)));
        }
        for Member { node, .. } in members.iter().filter(|member| member.visible) {
            if nodes[*node].mesh.is_some() {
                nodes[*node].places = self.instance_transforms(*node, &self.root.nodes[*node])?;
            }
        }
        Ok(Hierarchy { nodes, order, members, is_member: visited })
    }

    /// Weights of the morph targets of a node's mesh.
    fn weights_of<'b>(&'b self, node: &'b json::Node) -> Option<&'b Vec<f32>> {
        let of_mesh = || self.root.meshes[node.mesh?.value()].weights.as_ref();
        node.weights.as_ref().or_else(of_mesh)
    }

    fn node(&self, node: &json::Node) -> Node {
        let extensions = node.extensions.as_ref();
        let visibility = extensions.and_then(|extensions| extensions.others.get("KHR_node_visibility"));
        let mesh = node.mesh.map(|mesh| mesh.value());
        let weights = self.weights_of(node).into_iter().flatten();
        Node {
            name: node.name.clone().unwrap_or_default(),
            parent: None,
            root: 0,
            local: Local::of(node),
            mesh,
            skin: node.skin.map(|skin| skin.value()).filter(|_| mesh.is_some()),
            weights: weights.copied().map(f64::from).collect(),
            camera: node.camera.map(|camera| camera.value()),
            light: extensions
                .and_then(|extensions| extensions.khr_lights_punctual.as_ref())
                .map(|reference| reference.light.value()),
            places: None,
            hidden: visibility.and_then(|visibility| visibility.get("visible")?.as_bool()) == Some(false),
        }
    }

    /// Lights of the file, at the origin, or why they are not used.
    pub fn read_lights(&self) -> Vec<Result<Light, String>> {
        let lights: &[punctual::Light] = self.root.as_ref();
        lights.iter().map(read_light).collect()
    }

    /// What the cameras of the file project, or why they are not used.
    pub fn projections(&self) -> Vec<Result<Projection, String>> {
        self.root.cameras.iter().map(projection).collect()
    }

    /// Root nodes of the scene that is wanted, or of the file's default, or of all the file.
    fn roots(&mut self, choice: Option<&str>) -> Result<Vec<usize>> {
        let scenes = &self.root.scenes;
        let index = match choice {
            Some(choice) => {
                let names = scenes.iter().map(|scene| scene.name.as_deref().unwrap_or_default());
                Some(self.choose("scene", names, choice)?)
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
    fn instance_transforms(&self, index: usize, node: &json::Node) -> Result<Option<Vec<DMat4>>> {
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
        // What is made of them takes more than they do.
        self.spend_numbers(count.unwrap_or(0) as u64 * PLACE_NUMBERS)?;
        let transform = |i: usize| {
            let rotation = rotations
                .as_ref()
                .map_or(DQuat::IDENTITY, |values| unit(&std::array::from_fn(|k| values[4 * i + k].into())));
            DMat4::from_scale_rotation_translation(
                vector(&scales, i, DVec3::ONE),
                rotation,
                vector(&translations, i, DVec3::ZERO),
            )
        };
        Ok(Some((0..count.unwrap_or(0)).map(transform).collect()))
    }
}

fn projection(camera: &json::Camera) -> Result<Projection, String> {
    match (&camera.perspective, &camera.orthographic) {
        (Some(perspective), None) if perspective.yfov > 0.0 && f64::from(perspective.yfov) < PI => {
            Ok(Projection::Perspective { fov: perspective.yfov.into() })
        }
        (None, Some(orthographic)) if orthographic.ymag.abs() > 0.0 => {
            Ok(Projection::Orthographic { half_height: f64::from(orthographic.ymag.abs()) })
        }
        (Some(_), Some(_)) | (None, None) => Err("it must be either perspective or orthographic".into()),
        _ => Err("its field of view or magnification is out of range".into()),
    }
}

/// The rotation of a quaternion of any length; none where it has no direction.
pub(super) fn unit(xyzw: &[f64; 4]) -> DQuat {
    let q = DQuat::from_array(*xyzw);
    if q.length() > 0.0 && q.is_finite() {
        q.normalize()
    } else {
        DQuat::IDENTITY
    }
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
