//! Textures → device buffers: a record for each use of a texture, and the pixels of all levels.

use crate::error::{Error, Result};
use crate::layout::{
    Texture, TEXTURE_LEVEL_NEAREST, TEXTURE_MAGNIFY_NEAREST, TEXTURE_MINIFY_NEAREST, TEXTURE_MIPMAP,
    TEXTURE_SECOND_SET, TEXTURE_SRGB, TEXTURE_WIDE, WRAP_CLAMP, WRAP_MIRROR,
};
use crate::scene::{self, Map, Mipmaps, Pixels, Scene, UsedMap, Wrap};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Levels that a record has room for.
const MOST_LEVELS: usize = 16;
/// Bytes of a texel.
const TEXEL: usize = 16;

/// What of textures the device gets.
#[derive(Default)]
pub(super) struct Textures {
    used: Vec<UsedMap>,
    /// In the same order.
    pub records: Vec<Texture>,
    /// Levels of pictures, each from a whole texel on.
    pub pixels: Vec<[u32; 4]>,
}

/// A picture in the form in which some textures need it: which, in sRGB or not, with a mipmap or not.
type Form = (usize, bool, bool);

impl Textures {
    /// Textures of visible materials; nothing where the scene is drawn without.
    ///
    /// # Errors
    /// `Content` when their pixels are more than a device can address.
    pub fn of(scene: &Scene, is_needed: bool) -> Result<Self> {
        let mut textures = Self::default();
        if !is_needed {
            return Ok(textures);
        }
        for material in scene.visible_materials() {
            for (map, is_srgb) in scene.materials[material].drawn_maps().list() {
                let Some(map) = map.filter(|map| scene.image_of(map).is_some()) else { continue };
                let used = UsedMap { map, is_srgb };
                if !textures.used.contains(&used) {
                    textures.used.push(used);
                }
            }
        }
        let form = |used: &UsedMap| {
            let texture = &scene.textures[used.map.texture];
            (texture.image, used.is_srgb, texture.minify.mipmap.is_some())
        };
        let forms: BTreeMap<Form, ()> = textures.used.iter().map(|used| (form(used), ())).collect();
        let made: Vec<(Form, Mipmaps)> = forms
            .into_par_iter()
            .filter_map(|(form, ())| {
                let (image, is_srgb, has_mipmap) = form;
                let image = scene.images[image].as_ref()?;
                Some((form, if has_mipmap { Mipmaps::of(image, is_srgb) } else { Mipmaps::whole(image) }))
            })
            .collect();
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
        self.used.iter().position(|own| own == used).map_or(0, |place| place as u32 + 1)
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
