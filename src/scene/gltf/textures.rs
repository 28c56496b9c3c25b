//! glTF textures and samplers → [`Texture`], and the pictures that visible materials need.

use super::images::decode;
use super::{Document, ReadOptions};
use crate::error::Result;
use crate::scene::{Image, Minify, Pixels, Scene, Texture, Wrap};
use rayon::prelude::*;
use serde_json::Value;
use std::collections::BTreeSet;
use std::sync::Arc;

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

/// Most pixels of a picture: 16384 × 16384.
const MOST_PIXELS: u64 = 1 << 28;

impl Document<'_> {
    /// Decodes the pictures that these materials show, all at once. One that cannot be had is left out with a warning: its factors alone
    /// colour the material.
    ///
    /// # Errors
    /// `Content` when they take more memory than they may.
    pub fn add_images(&mut self, scene: &mut Scene, materials: &BTreeSet<usize>, options: &ReadOptions) -> Result<()> {
        let names = self.raw("images");
        let mut faults = Vec::new();
        scene.images = vec![None; names.len()];
        let maps = materials.iter().flat_map(|material| scene.materials[*material].drawn_maps().list());
        let images = maps.filter_map(|(map, _)| Some(scene.textures.get(map?.texture)?.image));
        let needed: BTreeSet<usize> = images.filter(|image| *image < scene.images.len()).collect();
        let mut found = Vec::new();
        for index in needed {
            match self.image_bytes(index) {
                Ok(bytes) => found.push((index, bytes, self.image_media_type(index))),
                Err(fault) => faults.push(fault),
            }
        }
        // Each may take what is left; what they take together is counted behind it.
        let most = MOST_PIXELS.min(self.numbers_left());
        let cap = options.max_texture_size.unwrap_or(u32::MAX);
        let decoded: Vec<_> = found
            .into_par_iter()
            .map(|(index, bytes, media_type)| {
                let decoded = decode(&bytes, media_type, most);
                (index, decoded.map(|(image, warning)| (image.limited(cap), warning)))
            })
            .collect();
        for (index, decoded) in decoded {
            match decoded {
                Ok((image, warning)) => {
                    if let Some(warning) = warning {
                        self.warnings.add(format!("images[{index}]: {warning}"));
                    }
                    let pixels = u64::from(image.width) * u64::from(image.height);
                    self.spend_numbers(if matches!(image.pixels, Pixels::Rgba16(_)) { 2 * pixels } else { pixels })?;
                    let name = names[index].get("name").or(names[index].get("uri")).and_then(Value::as_str);
                    let name = name.filter(|name| !name.starts_with("data:")).unwrap_or_default().into();
                    scene.images[index] = Some(Arc::new(Image { name, ..image }));
                }
                Err(fault) => faults.push(format!("images[{index}]: {fault}")),
            }
        }
        faults.into_iter().for_each(|fault| self.warnings.add(format!("ignored: {fault}")));
        Ok(())
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
