//! An opened file: read and checked once, then posed at any number of times.

use super::animation::{Path, Track};
use super::choice::{AnimationSummary, Contents, ReadOptions};
use super::nodes::{Hierarchy, Local, Member};
use super::pose::{posed, Shape};
use super::skin::Skin;
use super::Document;
use crate::error::{Error, Result};
use crate::scene::{Camera, Instance, Light, Mesh, Projection, Scene};
use glam::{DMat4, DQuat, DVec3};
use std::collections::BTreeSet;

/// Most instances of meshes in a scene.
const MOST_INSTANCES: usize = 1 << 22;
/// Numbers of four bytes that an instance takes: its transform twice over, while the scene is filled.
const INSTANCE_NUMBERS: u64 = 72;

/// A file that was read and checked. What it shows at a time is [`Asset::scene`].
#[derive(Debug)]
pub struct Asset {
    /// The file, for messages.
    file: String,
    /// Meshes in their own shape, materials, warnings; nothing stands anywhere yet.
    base: Scene,
    /// For each mesh what can change its shape.
    shapes: Vec<Shape>,
    /// For each glTF mesh what it became.
    primitives: Vec<Vec<usize>>,
    hierarchy: Hierarchy,
    /// Those that a visible node of the scene uses.
    skins: Vec<Option<Skin>>,
    lights: Vec<Result<Light, String>>,
    projections: Vec<Result<Projection, String>>,
    /// Of the chosen animation.
    tracks: Vec<Track>,
    /// The time that was asked for when it was opened.
    at: f64,
    contents: Contents,
}

/// Where all nodes stand at a time, and the weights of their morph targets where an animation sets them.
struct Pose {
    world_from_node: Vec<DMat4>,
    weights: Vec<Option<Vec<f64>>>,
    /// For each skin that is used, from a mesh's space to world space by each joint.
    joints: Vec<Option<Vec<DMat4>>>,
}

/// A mesh somewhere.
struct Drawn {
    mesh: usize,
    /// Index of the shape that it has instead of its own.
    shape: Option<usize>,
    world_from_object: DMat4,
}

/// What is drawn, and meshes in poses: which one, and how it looks.
#[derive(Default)]
struct Picture {
    drawn: Vec<Drawn>,
    shapes: Vec<(usize, Mesh)>,
}

impl Document<'_> {
    /// Reads all that poses need.
    pub(super) fn asset(&mut self, name: String, options: &ReadOptions) -> Result<Asset> {
        if let Some(at) = options.at.filter(|at| !at.is_finite()) {
            return Err(Error::Usage(format!("time {at}: must be a number of seconds")));
        }
        let (extensions, max_memory) = (self.extensions(), options.max_memory);
        let mut base = Scene { name, extensions, max_memory, ..Scene::default() };
        self.check_bind_matrices();
        let contents = self.contents();
        let variant = options.variant.as_deref();
        let variant =
            variant.map(|own| self.choose("variant", contents.variants.iter().map(String::as_str), own)).transpose()?;
        let animation = self.chosen_animation(options, &contents)?;
        self.add_textures(&mut base);
        self.add_materials(&mut base);
        let (primitives, shapes) = self.add_meshes(&mut base, variant)?;
        let hierarchy = self.hierarchy(options.scene.as_deref())?;
        self.check_sizes(&hierarchy, &base, &primitives, &shapes)?;
        let visible = visible_materials(&hierarchy, &base, &primitives);
        self.add_images(&mut base, &visible, options)?;
        self.convert_spec_gloss(&mut base);
        let skins = self.used_skins(&hierarchy, &primitives, &shapes)?;
        let tracks = animation.map_or(Vec::new(), |animation| self.tracks(animation));
        let (lights, projections) = (self.read_lights(), self.projections());
        base.has_lights = !lights.is_empty();
        for node in hierarchy.members.iter().map(|member| &hierarchy.nodes[member.node]) {
            if let Some((index, Err(fault))) = node.camera.map(|index| (index, &projections[index])) {
                self.warnings.add(format!("ignored: cameras[{index}]: {fault}"));
            }
            if let Some(Err(fault)) = node.light.and_then(|index| lights.get(index)) {
                self.warnings.add(format!("ignored: a light: {fault}"));
            }
        }
        if let Some(ignored) = self.warnings.ignored.as_ref().filter(|_| options.strict) {
            return Err(self.refuse(format!("--strict: {ignored}")));
        }
        let file = self.file.to_owned();
        base.warnings = std::mem::take(&mut self.warnings).into_lines();
        let at = options.at.unwrap_or(0.0);
        Ok(Asset { file, base, shapes, primitives, hierarchy, skins, lights, projections, tracks, at, contents })
    }

    fn contents(&self) -> Contents {
        let durations = self.durations();
        let animation = |(index, own): (usize, &super::animation::Declared)| AnimationSummary {
            name: own.name.clone(),
            duration: durations[index],
            channels: own.channels.len(),
        };
        let meshes = self.root.meshes.iter().enumerate();
        let targets = meshes.map(|(index, mesh)| {
            let most = mesh.primitives.iter().map(|primitive| primitive.targets.as_ref().map_or(0, Vec::len)).max();
            (mesh.name.clone().unwrap_or(format!("meshes[{index}]")), most.unwrap_or(0))
        });
        Contents {
            animations: self.animations.iter().enumerate().map(animation).collect(),
            skins: self.skins.iter().map(|skin| (skin.name.clone(), skin.joints.len())).collect(),
            morphs: targets.filter(|(_, targets)| *targets > 0).collect(),
            variants: self.variants(),
        }
    }

    /// The animation that is to be played.
    fn chosen_animation(&mut self, options: &ReadOptions, contents: &Contents) -> Result<Option<usize>> {
        let names = contents.animations.iter().map(|animation| animation.name.as_str());
        match (&options.animation, options.at, contents.animations.len()) {
            (Some(choice), ..) => self.choose("animation", names, choice).map(Some),
            (None, Some(_), 0) => {
                self.warnings.add("a time was given, but the file has no animation");
                Ok(None)
            }
            (None, Some(_), _) => Ok(Some(0)),
            (None, None, 0) => Ok(None),
            (None, None, count) => {
                self.warnings.add(format!("not played: {count} animations (choose with --animation or --at)"));
                Ok(None)
            }
        }
    }

    /// Reads the skins that visible nodes use.
    fn used_skins(
        &mut self,
        hierarchy: &Hierarchy,
        primitives: &[Vec<usize>],
        shapes: &[Shape],
    ) -> Result<Vec<Option<Skin>>> {
        let mut skins: Vec<Option<Skin>> = (0..self.skins.len()).map(|_| None).collect();
        for node in hierarchy.visible() {
            let Some((mesh, index)) = node.mesh.zip(node.skin) else { continue };
            if skins[index].is_none() {
                skins[index] = Some(self.skin(index, hierarchy)?);
            }
            let joints = self.skins[index].joints.len();
            let last = primitives[mesh].iter().filter_map(|own| shapes[*own].influences.last_joint()).max();
            if let Some(beyond) = last.filter(|joint| *joint as usize >= joints) {
                return Err(
                    self.refuse(format!("meshes[{mesh}]: joint {beyond}, but skins[{index}] has {joints} joints"))
                );
            }
            if node.places.is_some() {
                self.warnings.add("ignored: EXT_mesh_gpu_instancing of a mesh with a skin");
            }
        }
        Ok(skins)
    }

    /// Refuses what would be too large before any of it is made: instances, and meshes in poses of their own.
    fn check_sizes(
        &self,
        hierarchy: &Hierarchy,
        base: &Scene,
        primitives: &[Vec<usize>],
        shapes: &[Shape],
    ) -> Result<()> {
        let (mut instances, mut posed) = (0_usize, 0_u64);
        for node in hierarchy.visible() {
            let Some(mesh) = node.mesh else { continue };
            let places = node.places.as_ref().map_or(1, Vec::len);
            instances = instances.saturating_add(places.saturating_mul(primitives[mesh].len()));
            for own in &primitives[mesh] {
                if node.skin.is_some() || !shapes[*own].targets.is_empty() {
                    posed = posed.saturating_add(base.meshes[*own].numbers());
                }
            }
        }
        if instances > MOST_INSTANCES {
            return Err(self.refuse(format!("more than {MOST_INSTANCES} instances of meshes")));
        }
        self.spend_numbers(INSTANCE_NUMBERS * instances as u64)?;
        self.spend_numbers(posed)
    }
}

/// Materials of meshes that visible nodes have.
fn visible_materials(hierarchy: &Hierarchy, base: &Scene, primitives: &[Vec<usize>]) -> BTreeSet<usize> {
    let meshes = hierarchy.visible().filter_map(|node| node.mesh).flat_map(|mesh| &primitives[mesh]);
    meshes.map(|mesh| base.meshes[*mesh].material).collect()
}

impl Asset {
    /// What can be chosen, and what moves.
    pub fn contents(&self) -> &Contents {
        &self.contents
    }

    /// Time of the last key of the animation that plays, seconds; 0 without one.
    pub fn duration(&self) -> f64 {
        self.tracks.iter().map(Track::end).fold(0.0, f64::max)
    }

    /// The scene at a time of the animation that was chosen when the file was opened; the same at all times without one.
    ///
    /// A mesh is one of the scene's for all nodes that have it, but for nodes that change its shape: each of them has it in its
    /// own pose, skinned ones in world space.
    ///
    /// # Errors
    /// `Usage` when the time is not finite.
    pub fn scene(&self, at: f64) -> Result<Scene> {
        self.fill(self.base.clone(), at)
    }

    /// The scene at the time that it was opened for. Meshes are moved, not copied.
    ///
    /// # Errors
    /// As [`Asset::scene`].
    pub fn into_scene(mut self) -> Result<Scene> {
        let base = std::mem::take(&mut self.base);
        self.fill(base, self.at)
    }

    fn fill(&self, mut scene: Scene, at: f64) -> Result<Scene> {
        if !at.is_finite() {
            return Err(Error::Usage(format!("{}: time {at} is not a finite number of seconds", self.file)));
        }
        let pose = self.pose(at);
        let mut picture = Picture::default();
        for member in &self.hierarchy.members {
            if member.visible {
                self.draw_meshes(*member, &pose, &scene, &mut picture);
            }
            self.add_camera_and_light(*member, &pose, &mut scene);
        }
        picture.place(&mut scene);
        Ok(scene)
    }

    /// Where everything stands at a time.
    fn pose(&self, at: f64) -> Pose {
        let nodes = &self.hierarchy.nodes;
        let mut locals: Vec<Local> = nodes.iter().map(|node| node.local).collect();
        let mut weights = vec![None; nodes.len()];
        for track in &self.tracks {
            let value = track.at(at);
            if track.path == Path::Weights {
                weights[track.node] = Some(value);
                continue;
            }
            // A matrix cannot be animated, which was said when the file was checked.
            let Local::Parts { translation, rotation, scale } = &mut locals[track.node] else { continue };
            match (track.path, value.as_slice()) {
                (Path::Translation, [x, y, z]) => *translation = DVec3::new(*x, *y, *z),
                (Path::Scale, [x, y, z]) => *scale = DVec3::new(*x, *y, *z),
                (Path::Rotation, [x, y, z, w]) => *rotation = DQuat::from_xyzw(*x, *y, *z, *w),
                _ => {}
            }
        }
        let mut world_from_node = vec![DMat4::IDENTITY; nodes.len()];
        for node in &self.hierarchy.order {
            let world_from_parent = nodes[*node].parent.map_or(DMat4::IDENTITY, |parent| world_from_node[parent]);
            world_from_node[*node] = world_from_parent * locals[*node].matrix();
        }
        let joints = |skin: &Option<Skin>| skin.as_ref().map(|skin| skin.world_from_mesh(&world_from_node));
        let joints = self.skins.iter().map(joints).collect();
        Pose { world_from_node, weights, joints }
    }

    fn draw_meshes(&self, member: Member, pose: &Pose, scene: &Scene, picture: &mut Picture) {
        let node = &self.hierarchy.nodes[member.node];
        let Some(mesh) = node.mesh else { return };
        let joints = node.skin.and_then(|skin| pose.joints[skin].as_deref());
        let weights = pose.weights[member.node].as_ref().unwrap_or(&node.weights);
        let world_from_node = pose.world_from_node[member.node];
        let places = node.places.as_deref().unwrap_or(&[DMat4::IDENTITY]);
        for own in &self.primitives[mesh] {
            let (base, shape) = (&scene.meshes[*own], &self.shapes[*own]);
            let joints = joints.filter(|_| !shape.influences.is_empty());
            let has_own = joints.is_some() || shape.is_morphed(weights);
            let index = has_own.then(|| {
                picture.shapes.push((*own, posed(base, shape, weights, joints)));
                picture.shapes.len() - 1
            });
            let drawn = |world_from_object| Drawn { mesh: *own, shape: index, world_from_object };
            if joints.is_some() {
                // The joints have placed it already; its node's own transform has no influence.
                picture.drawn.push(drawn(DMat4::IDENTITY));
            } else {
                picture.drawn.extend(places.iter().map(|place| drawn(world_from_node * *place)));
            }
        }
    }

    fn add_camera_and_light(&self, member: Member, pose: &Pose, scene: &mut Scene) {
        let node = &self.hierarchy.nodes[member.node];
        let world_from_node = &pose.world_from_node[member.node];
        if let Some((index, Ok(projection))) = node.camera.map(|index| (index, &self.projections[index])) {
            match Camera::of_node(world_from_node, *projection) {
                Ok(camera) => scene.cameras.push((node.name.clone(), camera)),
                Err(fault) => scene.warnings.push(format!("ignored: cameras[{index}]: {fault}")),
            }
        }
        if let Some(Ok(light)) = node.light.filter(|_| member.visible).and_then(|index| self.lights.get(index)) {
            scene.lights.push(light.placed(world_from_node));
        }
    }
}

impl Picture {
    /// Adds instances to a scene, and meshes in poses: each replaces the mesh that it was made of if nothing else shows that.
    fn place(self, scene: &mut Scene) {
        let mut is_taken = vec![false; scene.meshes.len()];
        for drawn in self.drawn.iter().filter(|drawn| drawn.shape.is_none()) {
            is_taken[drawn.mesh] = true;
        }
        let mut places = Vec::with_capacity(self.shapes.len());
        for (base, mesh) in self.shapes {
            if std::mem::replace(&mut is_taken[base], true) {
                places.push(scene.meshes.len());
                scene.meshes.push(mesh);
            } else {
                places.push(base);
                scene.meshes[base] = mesh;
            }
        }
        let instance = |drawn: Drawn| Instance {
            mesh: drawn.shape.map_or(drawn.mesh, |shape| places[shape]),
            world_from_object: drawn.world_from_object,
        };
        scene.instances = self.drawn.into_iter().map(instance).collect();
    }
}
