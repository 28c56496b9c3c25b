//! The account of extensions: what becomes of each.

use super::Document;
use crate::scene::{ExtensionUse, Standing};
use std::collections::BTreeSet;
use Standing::{Approximated, Exact};

/// Extensions that are read.
const KNOWN: [(&str, Standing); 26] = [
    ("EXT_mesh_gpu_instancing", Exact),
    ("EXT_meshopt_compression", Exact),
    ("EXT_texture_webp", Exact),
    ("KHR_draco_mesh_compression", Exact),
    ("KHR_lights_punctual", Exact),
    ("KHR_materials_anisotropy", Approximated("highlights are round")),
    ("KHR_materials_clearcoat", Approximated("the coat is left out")),
    ("KHR_materials_diffuse_transmission", Approximated("no light is scattered through")),
    ("KHR_materials_dispersion", Approximated("light of all colours goes straight through")),
    ("KHR_materials_emissive_strength", Exact),
    ("KHR_materials_ior", Approximated("it sets how much is reflected; nothing is refracted")),
    ("KHR_materials_iridescence", Approximated("the film is left out")),
    ("KHR_materials_pbrSpecularGlossiness", Approximated("converted to metallic-roughness")),
    ("KHR_materials_sheen", Approximated("the sheen is left out")),
    ("KHR_materials_specular", Approximated("it sets what is reflected head-on; Whitted's model has no Fresnel term")),
    ("KHR_materials_transmission", Approximated("light goes straight through, tinted, neither refracted nor blurred")),
    ("KHR_materials_unlit", Exact),
    ("KHR_materials_variants", Exact),
    ("KHR_materials_volume", Approximated("light is tinted as by the thickness factor, wherever it passes")),
    ("KHR_mesh_quantization", Exact),
    ("KHR_meshopt_compression", Exact),
    ("KHR_node_visibility", Exact),
    ("KHR_texture_basisu", Exact),
    ("KHR_texture_transform", Exact),
    // Descriptions of the file, which no picture shows.
    ("KHR_xmp", Exact),
    ("KHR_xmp_json_ld", Exact),
];

/// What becomes of an extension.
pub fn standing(name: &str) -> Standing {
    KNOWN.iter().find(|(own, _)| *own == name).map_or(Standing::Ignored, |(_, standing)| *standing)
}

impl Document<'_> {
    /// Every extension that the document uses or requires, in its order; a warning for each that is not exact.
    pub fn extensions(&mut self) -> Vec<ExtensionUse> {
        let (used, required) = (&self.root.extensions_used, &self.root.extensions_required);
        let mut all: Vec<ExtensionUse> = Vec::new();
        let is_required: BTreeSet<&String> = required.iter().collect();
        let mut seen = BTreeSet::new();
        for name in used.iter().chain(required) {
            if seen.insert(name) {
                let (required, standing) = (is_required.contains(name), standing(name));
                all.push(ExtensionUse { name: name.clone(), required, standing });
            }
        }
        for own in &all {
            match own.standing {
                Exact => {}
                Approximated(how) => self.warnings.add(format!("approximated: extension {}: {how}", own.name)),
                Standing::Ignored => self.warnings.add(format!("ignored: extension {}", own.name)),
            }
        }
        all
    }
}
