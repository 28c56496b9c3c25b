//! Scenes as plain data, in the field's terms: meshes, instances, materials, lights, cameras. Knows no GPU.
//!
//! ```text
//! .glb/.gltf ─ gltf::read ─┐
//! built-in  ─ builtin ─────┴→ Scene ─┬─ Scene::view → View (camera, lights, picture)
//!                                    ├─ Soup::of    → every instance's triangles in world space
//!                                    └─ features    → what this scene needs of the renderer
//! ```
//! Lengths are metres, angles radians, colours linear RGB with the sRGB primaries. World space is right-handed, y up.

mod account;
mod background;
mod bounds;
mod builtin;
mod camera;
mod dice;
pub mod features;
pub mod gltf;
mod image;
mod light;
mod lobes;
mod material;
mod mipmap;
mod precedence;
mod sampling;
pub mod shapes;
mod sharing;
mod soup;
mod tangents;
mod teapot;
mod texture;
mod triangle;
mod view;

pub use self::image::{Image, Pixels};
pub use account::{ExtensionUse, Standing};
pub use background::Background;
pub(crate) use bounds::{bounds_of, box_corners};
pub use builtin::{built_in, BUILT_IN};
pub use camera::{Camera, CameraChoice, Projection};
pub use light::{Light, LightKind};
pub use lobes::{Anisotropy, Clearcoat, DiffuseTransmission, Iridescence, Lobes, Sheen, Volume};
pub use material::{AlphaMode, Material, Whitted};
pub use mipmap::Mipmaps;
pub use precedence::precedence;
pub use sampling::{Filter, Sampler};
pub use sharing::Instancing;
pub use soup::{Placement, Soup, TriangleFlags};
pub use texture::{Map, Maps, Minify, Texture, UsedMap, Wrap};
pub use triangle::Crossing;
pub use view::{View, MAX_SAMPLES};

use glam::{DMat4, Vec2, Vec3, Vec4};
use std::sync::Arc;

/// One glTF primitive: triangles of one material.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Name, for messages.
    pub name: String,
    /// Vertex positions, object space.
    pub positions: Vec<Vec3>,
    /// Vertex normals, object space, one a position; empty for flat shading.
    pub normals: Vec<Vec3>,
    /// Tangents (xyz) and signs of the bitangents (w), object space, one for each corner of each triangle; empty where no normal map needs
    /// them.
    pub tangents: Vec<[Vec4; 3]>,
    /// Texture coordinates, two sets, one a position; empty without.
    pub texcoords: Vec<[Vec2; 2]>,
    /// Vertex colours, linear RGB and alpha, one a position; empty for opaque white.
    pub colors: Vec<Vec4>,
    /// Three vertices a triangle, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Index into [`Scene::materials`].
    pub material: usize,
}

impl Mesh {
    /// Numbers of four bytes that it takes.
    pub fn numbers(&self) -> u64 {
        let vertices =
            3 * self.positions.len() + 3 * self.normals.len() + 4 * self.texcoords.len() + 4 * self.colors.len();
        (vertices + 12 * self.tangents.len() + 3 * self.triangles.len()) as u64
    }
}

/// A mesh somewhere in the world.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Index into [`Scene::meshes`].
    pub mesh: usize,
    /// Object space to world space.
    pub world_from_object: DMat4,
}

/// All that a file says, and what of it was left out.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Name: the file's stem or the built-in's name.
    pub name: String,
    /// Geometry, each once.
    pub meshes: Vec<Mesh>,
    /// Where it stands.
    pub instances: Vec<Instance>,
    /// Materials; never empty when there are meshes.
    pub materials: Vec<Material>,
    /// Textures that materials' maps name.
    pub textures: Vec<Texture>,
    /// Pictures that textures name; `None` for one that nothing visible uses, or that cannot be read.
    pub images: Vec<Option<Arc<Image>>>,
    /// Lights, world space.
    pub lights: Vec<Light>,
    /// The file declares lights, be it dark ones: then no default light is added.
    pub has_lights: bool,
    /// Cameras with their names, world space.
    pub cameras: Vec<(String, Camera)>,
    /// Bytes that the triangles of all instances may take in a [`Soup`]; `None` for as many as there are.
    pub max_memory: Option<u64>,
    /// Extensions that the file uses.
    pub extensions: Vec<ExtensionUse>,
    /// What was approximated, ignored or dropped, one sentence each.
    pub warnings: Vec<String>,
}

impl Scene {
    /// Triangles of all instances.
    pub fn triangle_count(&self) -> usize {
        self.instances.iter().map(|instance| self.meshes[instance.mesh].triangles.len()).sum()
    }
}
