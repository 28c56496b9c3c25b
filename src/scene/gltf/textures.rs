//! glTF textures and samplers → [`Texture`], and the pictures that visible materials need.

use super::check::list;
use super::images::{decode, other_type, Header};
use super::{Document, ReadOptions};
use crate::error::Result;
use crate::scene::{Image, Minify, Scene, Texture, Wrap};
use rayon::prelude::*;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;
use std::sync::Arc;

/// Where a texture names its picture, better ones first; an extension's is used wherever it is there. Behind each the formats that it
/// may have, of which others are warned of.
const SOURCES: [(&str, &[&str]); 3] = [
    ("/extensions/KHR_texture_basisu/source", &["image/ktx2"]),
    ("/extensions/EXT_texture_webp/source", &["image/webp"]),
    ("/source", &["image/png", "image/jpeg"]),
];

/// Most pixels of a picture: 16384 × 16384.
const MOST_PIXELS: u64 = 1 << 28;

impl Document<'_> {
    /// Adds all textures.
    pub fn add_textures(&mut self, scene: &mut Scene) {
        let raw = Rc::clone(&self.raw);
        for (index, texture) in list(&raw, "textures").iter().enumerate() {
            let sampler = texture.get("sampler").and_then(Value::as_u64);
            let sampler = sampler.and_then(|sampler| list(&raw, "samplers").get(sampler as usize));
            let source = SOURCES.iter().find_map(|(place, _)| texture.pointer(place)?.as_u64());
            if source.is_none() {
                self.warnings.add(format!("ignored: textures[{index}] has no picture"));
            }
            let image = source.map_or(usize::MAX, |source| source as usize);
            scene.textures.push(read_sampler(sampler.unwrap_or(&Value::Null), image, index, &mut self.warnings));
        }
    }

    /// Decodes the pictures that these materials show. One that cannot be had is left out with a warning: its factors alone
    /// colour the material. Of pictures that nothing shows only the first bytes are looked at.
    ///
    /// # Errors
    /// `Content` when they take more memory than they may: nothing is decoded then.
    pub fn add_images(&mut self, scene: &mut Scene, materials: &BTreeSet<usize>, options: &ReadOptions) -> Result<()> {
        let raw = Rc::clone(&self.raw);
        let declared = list(&raw, "images");
        scene.images = vec![None; declared.len()];
        let maps = materials.iter().flat_map(|material| scene.materials[*material].drawn_maps().list());
        let images = maps.filter_map(|(map, _)| Some(scene.textures.get(map?.texture)?.image));
        let needed: BTreeSet<usize> = images.filter(|image| *image < declared.len()).collect();
        let headers = self.headers(declared.len(), &needed);
        self.check_sources(list(&raw, "textures"), &headers);
        let cap = options.max_texture_size.unwrap_or(u32::MAX);
        let most = MOST_PIXELS.min(self.numbers_left());
        let (mut wanted, mut encoded) = (Vec::new(), 0_u64);
        for (index, (header, length)) in headers.into_iter().filter(|(index, _)| needed.contains(index)) {
            let (width, height, numbers) = (header.width, header.height, header.numbers());
            if numbers > most {
                self.warnings.add(format!("ignored: images[{index}]: {width} × {height} is more than {most} pixels"));
                continue;
            }
            self.spend_numbers(header.limited(cap).numbers())?;
            // Many images may name the same long bytes for a few pixels each.
            encoded = encoded.saturating_add(length);
            if encoded > self.most_numbers.saturating_mul(4) {
                return Err(self.refuse("its pictures take more bytes than they may (see --max-memory)"));
            }
            wanted.push((index, numbers));
        }
        for batch in batches(wanted, most) {
            for (index, decoded) in self.decode_images(&batch, cap) {
                match decoded {
                    Ok((image, warning)) => {
                        warning.into_iter().for_each(|text| self.warnings.add(format!("images[{index}]: {text}")));
                        let name = declared[index].get("name").or(declared[index].get("uri")).and_then(Value::as_str);
                        let name = name.filter(|name| !name.starts_with("data:")).unwrap_or_default().into();
                        scene.images[index] = Some(Arc::new(Image { name, ..image }));
                    }
                    Err(fault) => self.warnings.add(format!("ignored: {fault}")),
                }
            }
        }
        Ok(())
    }

    /// What the images claim to be. Warns of those that cannot be had, and of those whose media type is wrong if they are not
    /// needed: the others will be decoded.
    fn headers(&mut self, count: usize, needed: &BTreeSet<usize>) -> BTreeMap<usize, (Header, u64)> {
        let mut headers = BTreeMap::new();
        for index in 0..count {
            let is_needed = needed.contains(&index);
            match self.image_header(index) {
                Ok((header, length)) => {
                    let declared = self.image_media_type(index).filter(|_| !is_needed);
                    let wrong_type = declared.and_then(|declared| other_type(declared, header.media_type));
                    let no_size = header.numbers() == 0;
                    let no_size = no_size.then(|| format!("{} × {} is no size", header.width, header.height));
                    let faults = wrong_type.into_iter().chain(no_size.filter(|_| !is_needed));
                    faults.for_each(|fault| self.warnings.add(format!("images[{index}]: {fault}")));
                    headers.insert(index, (header, length));
                }
                Err(fault) if is_needed => self.warnings.add(format!("ignored: {fault}")),
                Err(fault) => self.warnings.add(fault),
            }
        }
        headers
    }

    /// Warns of textures whose pictures have a format that does not belong where they are named.
    fn check_sources(&mut self, textures: &[Value], headers: &BTreeMap<usize, (Header, u64)>) {
        for (index, texture) in textures.iter().enumerate() {
            for (place, formats) in SOURCES {
                let image = texture.pointer(place).and_then(Value::as_u64).map(|image| image as usize);
                let Some((image, (header, _))) = image.and_then(|image| Some((image, headers.get(&image)?))) else {
                    continue;
                };
                if !formats.contains(&header.media_type) {
                    let place = place[1..].replace('/', ".");
                    let message = format!("textures[{index}].{place}: images[{image}] is {}", header.media_type);
                    self.warnings.add(format!("{message}, which does not belong there"));
                }
            }
        }
    }

    /// Decodes pictures, all at once.
    #[allow(clippy::type_complexity)]
    fn decode_images(&self, batch: &[(usize, u64)], cap: u32) -> Vec<(usize, Result<(Image, Option<String>), String>)> {
        let bytes = |(index, numbers): &(usize, u64)| {
            (*index, *numbers, self.image_bytes(*index), self.image_media_type(*index))
        };
        let found: Vec<_> = batch.iter().map(bytes).collect();
        let decoded = found.into_par_iter().map(|(index, numbers, bytes, media_type)| {
            let decoded = bytes.and_then(|bytes| {
                decode(&bytes, media_type, numbers).map_err(|fault| format!("images[{index}]: {fault}"))
            });
            (index, decoded.map(|(image, warning)| (image.limited(cap), warning)))
        });
        decoded.collect()
    }
}

/// Parts of a list of pictures and their numbers, in each at most `most` numbers or a single picture.
fn batches(pictures: Vec<(usize, u64)>, most: u64) -> Vec<Vec<(usize, u64)>> {
    let mut batches: Vec<Vec<(usize, u64)>> = Vec::new();
    let mut left = 0;
    for picture in pictures {
        match batches.last_mut().filter(|_| picture.1 <= left) {
            Some(batch) => batch.push(picture),
            None => {
                batches.push(vec![picture]);
                left = most;
            }
        }
        left = left.saturating_sub(picture.1);
    }
    batches
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn batches_fit() {
        let all = vec![(0, 5), (1, 5), (2, 1), (3, 20), (4, 10)];
        let parts = batches(all, 10);
        assert_eq!(parts, [vec![(0, 5), (1, 5)], vec![(2, 1)], vec![(3, 20)], vec![(4, 10)]]);
        assert!(batches(Vec::new(), 10).is_empty());
    }
}
