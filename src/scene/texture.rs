//! Textures, and where materials use them.

use super::{Material, Scene};
use std::collections::BTreeSet;

/// What lies beyond an edge of a texture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Wrap {
    /// The texture again.
    #[default]
    Repeat,
    /// The texture again, turned round.
    Mirror,
    /// Its outermost pixels.
    Clamp,
}

/// How a texture is read where its pixels are smaller than the picture's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Minify {
    /// Between four pixels of a level, or the nearest one.
    pub linear: bool,
    /// Between levels of the mipmap (`Some(true)`), the nearest level, or the whole texture alone.
    pub mipmap: Option<bool>,
}

/// A picture and how it is read (glTF 2.0, 3.8).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Texture {
    /// Index into [`Scene::images`].
    pub image: usize,
    /// Beyond its left and right, and upper and lower edges.
    pub wrap: [Wrap; 2],
    /// Where its pixels are larger than the picture's: between four of them, or the nearest.
    pub magnify_linear: bool,
    /// Where they are smaller.
    pub minify: Minify,
}

impl Texture {
    /// A picture that is repeated and read as well as can be.
    pub fn of(image: usize) -> Self {
        let minify = Minify { linear: true, mipmap: Some(true) };
        Self { image, wrap: [Wrap::Repeat; 2], magnify_linear: true, minify }
    }
}

/// A texture on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Map {
    /// Index into [`Scene::textures`].
    pub texture: usize,
    /// Which set of texture coordinates: 0 or 1.
    pub texcoord: usize,
    /// Rows of the affine matrix from those to the texture's own (KHR_texture_transform).
    pub transform: [[f64; 3]; 2],
}

impl Map {
    /// Texture coordinates as they are.
    pub const UNMOVED: [[f64; 3]; 2] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    /// A texture by the first set of coordinates.
    pub fn of(texture: usize) -> Self {
        Self { texture, texcoord: 0, transform: Self::UNMOVED }
    }
}

/// What of a material comes from textures; each is multiplied with its factor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Maps {
    /// Base colour and alpha, sRGB.
    pub base_color: Option<Map>,
    /// Roughness in green, metallic in blue, linear.
    pub metallic_roughness: Option<Map>,
    /// Normals in the space of the tangents, linear, 0 to 1 for −1 to 1.
    pub normal: Option<Map>,
    /// Share of ambient light that arrives, in red, linear.
    pub occlusion: Option<Map>,
    /// Emission, sRGB.
    pub emission: Option<Map>,
    /// Strength of a dielectric's reflection, in alpha, linear.
    pub specular: Option<Map>,
    /// Colour of a dielectric's reflection, sRGB.
    pub specular_color: Option<Map>,
    /// Transmission in red, linear.
    pub transmission: Option<Map>,
}

/// A map in one of its uses: the same picture is read in two ways where one material takes it for a colour and another for numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UsedMap {
    /// The map.
    pub map: Map,
    /// Its picture is in sRGB.
    pub is_srgb: bool,
}

impl Maps {
    /// All of them, with whether they are in sRGB, in the order of the device's [`Look`](crate::layout::Look).
    pub fn list(&self) -> [(Option<Map>, bool); 8] {
        [
            (self.base_color, true),
            (self.metallic_roughness, false),
            (self.normal, false),
            (self.occlusion, false),
            (self.emission, true),
            (self.specular, false),
            (self.specular_color, true),
            (self.transmission, false),
        ]
    }

    /// Any at all.
    pub fn any(&self) -> bool {
        self.list().iter().any(|(map, _)| map.is_some())
    }
}

impl Material {
    /// Its maps as they are drawn: an unlit material shows its base colour alone.
    pub fn drawn_maps(&self) -> Maps {
        let Maps { base_color, .. } = self.maps;
        if self.unlit {
            Maps { base_color, ..Maps::default() }
        } else {
            self.maps
        }
    }
}

impl Scene {
    /// Materials of meshes that stand somewhere.
    pub fn visible_materials(&self) -> BTreeSet<usize> {
        self.instances.iter().map(|instance| self.meshes[instance.mesh].material).collect()
    }

    /// The picture behind a map; `None` where it cannot be had.
    pub fn image_of(&self, map: &Map) -> Option<&super::Image> {
        self.images.get(self.textures.get(map.texture)?.image)?.as_deref()
    }
}
