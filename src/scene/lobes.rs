//! Reflectance beyond metallic-roughness, as glTF's extensions have it. Read and kept; Whitted's model shows none of it.

use super::Map;
use glam::DVec3;

/// What a material has besides its metallic-roughness base. Maps multiply their factors.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lobes {
    /// A clear coat over everything (KHR_materials_clearcoat).
    pub clearcoat: Option<Clearcoat>,
    /// Cloth's sheen (KHR_materials_sheen).
    pub sheen: Option<Sheen>,
    /// A thin film (KHR_materials_iridescence).
    pub iridescence: Option<Iridescence>,
    /// Brushed metal (KHR_materials_anisotropy).
    pub anisotropy: Option<Anisotropy>,
    /// What is inside (KHR_materials_volume).
    pub volume: Option<Volume>,
    /// How much refraction depends on colour: 20 divided by Abbe's number (KHR_materials_dispersion).
    pub dispersion: f64,
    /// Light that passes and is scattered (KHR_materials_diffuse_transmission).
    pub diffuse_transmission: Option<DiffuseTransmission>,
}

/// KHR_materials_clearcoat.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Clearcoat {
    /// Intensity, 0 to 1.
    pub factor: f64,
    /// Roughness, 0 to 1.
    pub roughness: f64,
    /// Intensity in red.
    pub map: Option<Map>,
    /// Roughness in green.
    pub roughness_map: Option<Map>,
    /// Its own normals.
    pub normal_map: Option<Map>,
}

/// KHR_materials_sheen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sheen {
    /// Linear RGB.
    pub color: DVec3,
    /// Roughness, 0 to 1.
    pub roughness: f64,
    /// Colour, sRGB.
    pub color_map: Option<Map>,
    /// Roughness in alpha.
    pub roughness_map: Option<Map>,
}

/// KHR_materials_iridescence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iridescence {
    /// Intensity, 0 to 1.
    pub factor: f64,
    /// Index of refraction of the film.
    pub ior: f64,
    /// Thinnest and thickest, nanometres.
    pub thickness: [f64; 2],
    /// Intensity in red.
    pub map: Option<Map>,
    /// Between thinnest and thickest, in green.
    pub thickness_map: Option<Map>,
}

/// KHR_materials_anisotropy.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Anisotropy {
    /// Strength, 0 to 1.
    pub strength: f64,
    /// Direction, radians from the tangent.
    pub rotation: f64,
    /// Direction in red and green, strength in blue.
    pub map: Option<Map>,
}

/// KHR_materials_volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    /// Thickness below the surface, metres of the mesh's space; 0 for a thin wall.
    pub thickness: f64,
    /// Thickness in green.
    pub thickness_map: Option<Map>,
    /// Distance after which white light has the attenuation colour, metres; infinite for none.
    pub attenuation_distance: f64,
    /// Linear RGB.
    pub attenuation_color: DVec3,
}

/// KHR_materials_diffuse_transmission.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DiffuseTransmission {
    /// Share of the diffuse light that passes.
    pub factor: f64,
    /// Linear RGB.
    pub color: DVec3,
    /// Share in alpha.
    pub map: Option<Map>,
    /// Colour, sRGB.
    pub color_map: Option<Map>,
}
