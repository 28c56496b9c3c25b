//! Textures → device buffers: a record for each use of a texture, and the pixels of all levels.

use crate::error::{Error, Result};
use crate::layout::{
    Texture, TEXTURE_LEVEL_NEAREST, TEXTURE_MAGNIFY_NEAREST, TEXTURE_MINIFY_NEAREST, TEXTURE_MIPMAP,
    TEXTURE_SECOND_SET, TEXTURE_SRGB, TEXTURE_WIDE, WRAP_CLAMP, WRAP_MIRROR,
};
use crate::scene::{self, Map, Mipmaps, Pixels, Scene, UsedMap, Wrap};
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Levels that a record has room for.
const MOST_LEVELS: usize = 16;
/// Bytes of a texel.
const TEXEL: usize = 16;

/// What of textures the device gets.
#[derive(Default)]
pub(super) struct Textures {
    used: Vec<UsedMap>,
    /// Places there.
    places: HashMap<Use, u32>,
    /// In the same order.
    pub records: Vec<Texture>,
    /// Levels of pictures, each from a whole texel on.
    pub pixels: Vec<[u32; 4]>,
    /// How often a picture was halved because the device cannot bind all of them.
    pub halved: usize,
}

/// A use of a map as a key: texture, set of coordinates, bits of the transform, whether it is in sRGB.
type Use = (usize, usize, [[u64; 3]; 2], bool);

fn key(UsedMap { map, is_srgb }: &UsedMap) -> Use {
    (map.texture, map.texcoord, map.transform.map(|row| row.map(f64::to_bits)), *is_srgb)
}

/// A picture in the form in which some textures need it: which, in sRGB or not, with a mipmap or not.
type Form = (usize, bool, bool);

impl Textures {
    /// Textures of visible materials, in at most so many bytes: the largest pictures are halved until they fit. Nothing where the scene
    /// is drawn without.
    ///
    /// # Errors
    /// `Content` when their pixels are more than a device can address.
    pub fn of(scene: &Scene, is_needed: bool, most_bytes: u64) -> Result<Self> {
        let mut textures = Self::default();
        if !is_needed {
            return Ok(textures);
        }
        for material in scene.visible_materials() {
            for (map, is_srgb) in scene.materials[material].drawn_maps().list() {
                let Some(map) = map.filter(|map| scene.image_of(map).is_some()) else { continue };
                let used = UsedMap { map, is_srgb };
                if let Entry::Vacant(place) = textures.places.entry(key(&used)) {
                    place.insert(textures.used.len() as u32);
                    textures.used.push(used);
                }
            }
        }
        let form = |used: &UsedMap| {
            let texture = &scene.textures[used.map.texture];
            (texture.image, used.is_srgb, texture.minify.mipmap.is_some())
        };
        let forms: BTreeSet<Form> = textures.used.iter().map(form).collect();
        let mut made: Vec<(Form, Mipmaps)> = forms
            .into_par_iter()
            .filter_map(|form| {
                let (image, is_srgb, has_mipmap) = form;
                let image = scene.images[image].as_ref()?;
                Some((form, if has_mipmap { Mipmaps::of(image, is_srgb) } else { Mipmaps::whole(image) }))
            })
            .collect();
        textures.halved = fit(scene, &mut made, most_bytes);
        let mut placed = BTreeMap::new();
        for (form, mipmaps) in made {
            placed.insert(form, textures.place(&mipmaps));
        }
        if u32::try_from(textures.pixels.len()).is_err() {
            let bytes = textures.pixels.len() * TEXEL;
            let message =
                format!("its textures take {bytes} bytes: more than can be addressed (see --max-texture-size)");
            return Err(Error::content(&scene.name, message));
        }
        let records = textures.used.iter().map(|used| {
            let (levels, size, is_wide) = &placed[&form(used)];
            record(&scene.textures[used.map.texture], used, levels, *size, *is_wide)
        });
        textures.records = records.collect();
        Ok(textures)
    }

    /// What a [`Look`](crate::layout::Look) calls a map: 0 where there is no picture behind it.
    pub fn number_of(&self, used: &UsedMap) -> u32 {
        self.places.get(&key(used)).map_or(0, |place| place + 1)
    }

    /// Bytes of a texture buffer's pixels.
    pub fn bytes(&self) -> u64 {
        (self.pixels.len() * TEXEL) as u64
    }

    /// Appends the levels of a picture: the first texel of each, the size of the first, and whether it has 16 bits a channel.
    fn place(&mut self, mipmaps: &Mipmaps) -> (Vec<u32>, (u32, u32), bool) {
        let mut firsts = Vec::new();
        for (_, _, pixels) in mipmaps.levels.iter().take(MOST_LEVELS) {
            firsts.push(self.pixels.len() as u32);
            match pixels.as_ref() {
                Pixels::Rgba8(pixels) => self.pixels.extend(pixels.chunks(4).map(|four| {
                    let mut texel = [0; 4];
                    texel.iter_mut().zip(four).for_each(|(word, pixel)| *word = u32::from_le_bytes(*pixel));
                    texel
                })),
                Pixels::Rgba16(pixels) => self.pixels.extend(pixels.chunks(2).map(|two| {
                    let mut texel = [0; 4];
                    for (words, [r, g, b, a]) in texel.chunks_mut(2).zip(two) {
                        words[0] = u32::from(*r) | u32::from(*g) << 16;
                        words[1] = u32::from(*b) | u32::from(*a) << 16;
                    }
                    texel
                })),
            }
        }
        let (width, height, pixels) = &mipmaps.levels[0];
        (firsts, (*width, *height), matches!(pixels.as_ref(), Pixels::Rgba16(_)))
    }
}

/// Bytes of a level on the device.
fn level_bytes((width, height, pixels): &(u32, u32, Cow<Pixels>)) -> u64 {
    let pixels_in_texel = if matches!(pixels.as_ref(), Pixels::Rgba16(_)) { 2 } else { 4 };
    (u64::from(*width) * u64::from(*height)).div_ceil(pixels_in_texel) * TEXEL as u64
}

/// Halves the largest pictures until all fit; answers how often.
fn fit<'a>(scene: &'a Scene, made: &mut [(Form, Mipmaps<'a>)], most_bytes: u64) -> usize {
    let mut halved = 0;
    loop {
        let bytes: u64 = made.iter().flat_map(|(_, mipmaps)| &mipmaps.levels).map(level_bytes).sum();
        let largest = made.iter_mut().max_by_key(|(_, mipmaps)| level_bytes(&mipmaps.levels[0]));
        let Some(((image, is_srgb, has_mipmap), mipmaps)) = largest.filter(|_| bytes > most_bytes) else {
            return halved;
        };
        if !*has_mipmap {
            if let Some(image) = &scene.images[*image] {
                let first = (mipmaps.levels[0].0, mipmaps.levels[0].1);
                let mut all = Mipmaps::of(image, *is_srgb);
                let next = all.levels.iter().position(|level| level.0 < first.0 || level.1 < first.1);
                let Some(next) = next else { return halved };
                mipmaps.levels = vec![all.levels.swap_remove(next)];
            }
        } else if mipmaps.levels.len() > 1 {
            mipmaps.levels.remove(0);
        } else {
            return halved;
        }
        halved += 1;
    }
}

fn record(texture: &scene::Texture, used: &UsedMap, firsts: &[u32], size: (u32, u32), is_wide: bool) -> Texture {
    let wrap = |wrap: Wrap| match wrap {
        Wrap::Repeat => 0,
        Wrap::Mirror => WRAP_MIRROR,
        Wrap::Clamp => WRAP_CLAMP,
    };
    let bits = [
        (!texture.magnify_linear, TEXTURE_MAGNIFY_NEAREST),
        (!texture.minify.linear, TEXTURE_MINIFY_NEAREST),
        (texture.minify.mipmap.is_some(), TEXTURE_MIPMAP),
        (texture.minify.mipmap == Some(false), TEXTURE_LEVEL_NEAREST),
        (used.is_srgb, TEXTURE_SRGB),
        (is_wide, TEXTURE_WIDE),
        (used.map.texcoord == 1, TEXTURE_SECOND_SET),
    ];
    let flags: u32 = bits.iter().filter(|(on, _)| *on).map(|(_, bit)| bit).sum();
    let level = |first: usize| std::array::from_fn(|index| firsts.get(first + index).copied().unwrap_or(0));
    let Map { transform: [u, v], .. } = used.map;
    Texture {
        width: size.0,
        height: size.1,
        levels: firsts.len() as u32,
        flags: flags | wrap(texture.wrap[0]) | wrap(texture.wrap[1]) << 2,
        u_from_texcoord: u.map(|value| value as f32),
        v_from_texcoord: v.map(|value| value as f32),
        levels_from_0: level(0),
        levels_from_4: level(4),
        levels_from_8: level(8),
        levels_from_12: level(12),
        unused_u: 0,
        unused_v: 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Image, Maps, Material, Mesh};
    use std::sync::Arc;

    /// Pictures of these sides, each the base colour of a material.
    fn scene_of(sides: &[u32], minify: scene::Minify) -> Scene {
        let mut scene = Scene::default();
        for (index, side) in sides.iter().enumerate() {
            let pixels = Pixels::Rgba8(vec![[7; 4]; (side * side) as usize]);
            let (name, format) = (String::new(), String::new());
            let image = Image { name, format, width: *side, height: *side, pixels, bytes: 0 };
            scene.images.push(Some(Arc::new(image)));
            scene.textures.push(scene::Texture { minify, ..scene::Texture::of(index) });
            let maps = Maps { base_color: Some(Map::of(index)), ..Maps::default() };
            scene.materials.push(Material { maps, ..Material::default() });
            scene.meshes.push(Mesh { material: index, ..Mesh::default() });
            let world_from_object = glam::DMat4::IDENTITY;
            scene.instances.push(scene::Instance { mesh: index, world_from_object });
        }
        scene
    }

    #[test]
    fn the_largest_pictures_are_halved_until_all_fit() {
        for (mipmap, whole_bytes) in [(None, 4 * (64 * 64 + 16 * 16)), (Some(true), 4 * 64 * 64 * 4 / 3 + 2000)] {
            let scene = scene_of(&[64, 16], scene::Minify { linear: true, mipmap });
            let sides = |most: u64| {
                let textures = Textures::of(&scene, true, most).unwrap();
                assert!(textures.bytes() <= most, "{} of {most} bytes", textures.bytes());
                (textures.records.iter().map(|record| record.width).collect::<Vec<_>>(), textures.halved)
            };
            assert_eq!(sides(u64::MAX), (vec![64, 16], 0));
            assert_eq!(sides(whole_bytes), (vec![64, 16], 0));
            assert_eq!(sides(4 * 64 * 64), (vec![32, 16], 1));
            assert!(sides(2 * 4 * 16 * 16).1 >= 2);
        }
    }
}
