//! glTF textures and samplers → [`Texture`], and the pictures that visible materials need.

use super::Document;
use crate::scene::{Minify, Scene, Texture, Wrap};
use serde_json::Value;

impl Document<'_> {
    /// Adds all textures.
    pub fn add_textures(&mut self, scene: &mut Scene) {
        let (textures, samplers) = (self.raw("textures"), self.raw("samplers"));
        for (index, texture) in textures.iter().enumerate() {
            let sampler = texture.get("sampler").and_then(Value::as_u64);
            let sampler = sampler.and_then(|sampler| samplers.get(sampler as usize)).unwrap_or(&Value::Null);
            // Better pictures first; an extension's is used wherever it is there.
            let sources = ["/extensions/KHR_texture_basisu/source", "/extensions/EXT_texture_webp/source", "/source"];
            let source = sources.iter().find_map(|place| texture.pointer(place)?.as_u64());
            if source.is_none() {
                self.warnings.add(format!("ignored: textures[{index}] has no picture"));
            }
            let image = source.map_or(usize::MAX, |source| source as usize);
            scene.textures.push(read_sampler(sampler, image, index, &mut self.warnings));
        }
    }
}

/// How a texture is read, by the numbers of OpenGL.
fn read_sampler(sampler: &Value, image: usize, index: usize, warnings: &mut super::Warnings) -> Texture {
    let number = |name: &str| sampler.get(name).and_then(Value::as_u64);
    let mut unknown = |name: &str, value: u64| {
        warnings.add(format!("textures[{index}]: its sampler's {name} {value} is unknown; the default is used"));
    };
    let mut wrap = |name: &str| match number(name) {
        None | Some(10497) => Wrap::Repeat,
        Some(33648) => Wrap::Mirror,
        Some(33071) => Wrap::Clamp,
        Some(other) => {
            unknown(name, other);
            Wrap::Repeat
        }
    };
    let wrap = [wrap("wrapS"), wrap("wrapT")];
    let best = Minify { linear: true, mipmap: Some(true) };
    let minify = match number("minFilter") {
        None | Some(9987) => best,
        Some(9728) => Minify { linear: false, mipmap: None },
        Some(9729) => Minify { linear: true, mipmap: None },
        Some(9984) => Minify { linear: false, mipmap: Some(false) },
        Some(9985) => Minify { linear: true, mipmap: Some(false) },
        Some(9986) => Minify { linear: false, mipmap: Some(true) },
        Some(other) => {
            unknown("minFilter", other);
            best
        }
    };
    let magnify = number("magFilter");
    if let Some(other) = magnify.filter(|filter| ![9728, 9729].contains(filter)) {
        unknown("magFilter", other);
    }
    Texture { image, wrap, magnify_linear: magnify != Some(9728), minify }
}
