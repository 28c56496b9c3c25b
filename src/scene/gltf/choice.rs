//! What a caller chooses of a file by name or index, and what there is to choose from.

use super::Document;
use crate::error::{Error, Result};
use serde_json::Value;

/// What a caller may choose of a file.
#[derive(Clone, Debug, Default)]
pub struct ReadOptions {
    /// Scene, by name or index. Default: the file's own, or else its first.
    pub scene: Option<String>,
    /// Variant of the materials (KHR_materials_variants), by name or index. Default: the materials that primitives name themselves.
    pub variant: Option<String>,
    /// Animation to play, by name or index. Default: the first if a time is given, otherwise none.
    pub animation: Option<String>,
    /// Seconds on the animation's clock; before its first key and after its last the pose stands still. Default: 0 if an
    /// animation is chosen. Without either nothing plays: nodes and morph targets stand as the file itself says, which need
    /// not be the animation's pose at time 0.
    pub at: Option<f64>,
    /// Textures are halved until neither side has more pixels. Default: none is.
    pub max_texture_size: Option<u32>,
    /// Bytes that each of these may take: the buffers; what is read of them, textures too; the triangles of all instances.
    /// Default: 2 GiB for the first two each, and any number of triangles.
    pub max_memory: Option<u64>,
    /// A file with anything that is ignored is refused.
    pub strict: bool,
}

/// An animation of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct AnimationSummary {
    /// Name, empty if it has none.
    pub name: String,
    /// Time of its last key, seconds.
    pub duration: f64,
    /// Properties that it moves.
    pub channels: usize,
}

/// What a file has besides its geometry: what can be chosen, and what moves.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contents {
    /// Animations in the file's order.
    pub animations: Vec<AnimationSummary>,
    /// Skins: name and number of joints.
    pub skins: Vec<(String, usize)>,
    /// Meshes with morph targets: name and number of targets.
    pub morphs: Vec<(String, usize)>,
    /// Variants of the materials.
    pub variants: Vec<String>,
}

impl Document<'_> {
    /// The index that a name or an index means. An index wins over a name that looks like it.
    ///
    /// # Errors
    /// `Usage`, with all names, when there is no such thing.
    pub fn choose<'b>(&self, kind: &str, names: impl Iterator<Item = &'b str>, choice: &str) -> Result<usize> {
        let names: Vec<&str> = names.collect();
        let by_index = choice.parse::<usize>().ok().filter(|index| *index < names.len());
        by_index.or_else(|| names.iter().position(|name| *name == choice)).ok_or_else(|| {
            let all: Vec<String> = names.iter().enumerate().map(|(index, name)| format!("{index} '{name}'")).collect();
            let there_is = if all.is_empty() { "it has none".into() } else { format!("it has {}", all.join(", ")) };
            Error::Usage(format!("{}: no {kind} '{choice}'; {there_is}", self.file))
        })
    }

    /// Names of the variants of materials.
    pub fn variants(&self) -> Vec<String> {
        let extensions = self.root.extensions.as_ref();
        let variants =
            extensions.and_then(|extensions| extensions.others.get("KHR_materials_variants")?.get("variants"));
        let name = |variant: &Value| variant.get("name").and_then(Value::as_str).unwrap_or_default().to_owned();
        variants.and_then(Value::as_array).into_iter().flatten().map(name).collect()
    }

    /// The material that a primitive has in a variant, if the variant changes it.
    pub fn material_in(&self, variant: usize, primitive: &::gltf::json::mesh::Primitive) -> Option<usize> {
        let extensions = primitive.extensions.as_ref()?;
        let mappings = extensions.others.get("KHR_materials_variants")?.get("mappings")?.as_array()?;
        let is_meant = |mapping: &&Value| {
            let variants = mapping.get("variants").and_then(Value::as_array);
            variants.is_some_and(|variants| variants.iter().any(|own| own.as_u64() == Some(variant as u64)))
        };
        let material = mappings.iter().find(is_meant)?.get("material")?.as_u64()? as usize;
        (material < self.root.materials.len()).then_some(material)
    }
}
