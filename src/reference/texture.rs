//! Textures in f64: the definitions of OpenGL 4.6, 8.14, with anisotropic probes, one pixel after the other.

use crate::scene::{Map, Mipmaps, Pixels, Scene, Texture, UsedMap, Wrap};
use glam::{DMat2, DVec2, DVec4};
use std::collections::BTreeMap;

/// Most probes along a footprint.
const PROBES: f64 = 8.0;

/// All pictures that a scene's maps show.
pub(super) struct Library<'a> {
    scene: &'a Scene,
    mipmaps: BTreeMap<(usize, bool), Mipmaps<'a>>,
}

/// Where a map is read: texture coordinates of each set, and how they change along the axes of a footprint.
#[derive(Clone, Copy, Default)]
pub(super) struct Spot {
    pub at: [DVec2; 2],
    pub major: [DVec2; 2],
    pub minor: [DVec2; 2],
}

impl<'a> Library<'a> {
    pub fn new(scene: &'a Scene) -> Self {
        let mut mipmaps = BTreeMap::new();
        for material in scene.visible_materials() {
            for (map, is_srgb) in scene.materials[material].drawn_maps().list() {
                let Some(map) = map else { continue };
                let Some(image) = scene.image_of(&map) else { continue };
                let key = (scene.textures[map.texture].image, is_srgb);
                mipmaps.entry(key).or_insert_with(|| Mipmaps::of(image, is_srgb));
            }
        }
        Self { scene, mipmaps }
    }

    /// The value of a map; `None` where there is no picture behind it.
    pub fn value(&self, used: UsedMap, spot: &Spot) -> Option<DVec4> {
        let Map { texture, texcoord, transform: [u, v] } = used.map;
        let texture = &self.scene.textures[texture];
        let mipmaps = self.mipmaps.get(&(texture.image, used.is_srgb))?;
        let turn = DMat2::from_cols(DVec2::new(u[0], v[0]), DVec2::new(u[1], v[1]));
        let at = turn * spot.at[texcoord] + DVec2::new(u[2], v[2]);
        let axes = [turn * spot.major[texcoord], turn * spot.minor[texcoord]];
        let (width, height, _) = mipmaps.levels[0];
        let pixels = axes.map(|axis| (axis * DVec2::new(width.into(), height.into())).length());
        let (longest, other) = if pixels[0] >= pixels[1] { (0, 1) } else { (1, 0) };
        let probes = if texture.minify.mipmap.is_some() {
            (pixels[longest] / pixels[other].max(1.0) - 0.001).ceil().clamp(1.0, PROBES)
        } else {
            1.0
        };
        let lod = (pixels[longest] / probes).log2();
        let reader = Reader { texture, mipmaps, is_srgb: used.is_srgb };
        let mean = (0..probes as u32).map(|probe| {
            let along = (f64::from(probe) + 0.5) / probes - 0.5;
            reader.at_lod(at + axes[longest] * along, lod)
        });
        Some(mean.sum::<DVec4>() / probes)
    }
}

struct Reader<'a> {
    texture: &'a Texture,
    mipmaps: &'a Mipmaps<'a>,
    is_srgb: bool,
}

impl Reader<'_> {
    fn at_lod(&self, at: DVec2, lod: f64) -> DVec4 {
        let minify = self.texture.minify;
        let last = (self.mipmaps.levels.len() - 1) as f64;
        if lod <= 0.0 || lod.is_nan() {
            return self.at_level(at, 0.0, self.texture.magnify_linear);
        }
        match minify.mipmap {
            None => self.at_level(at, 0.0, minify.linear),
            Some(false) => self.at_level(at, ((lod.min(last) + 0.5).ceil() - 1.0).clamp(0.0, last), minify.linear),
            Some(true) => {
                let lod = lod.min(last);
                let (fine, share) = (lod.floor(), lod.fract());
                let coarse = self.at_level(at, (fine + 1.0).min(last), minify.linear);
                self.at_level(at, fine, minify.linear) * (1.0 - share) + coarse * share
            }
        }
    }

    fn at_level(&self, at: DVec2, level: f64, linear: bool) -> DVec4 {
        let (width, height, pixels) = &self.mipmaps.levels[level as usize];
        let size = [i64::from(*width), i64::from(*height)];
        let axis = |axis: usize| wrapped(at[axis], self.texture.wrap[axis]) * size[axis] as f64;
        let (x, y) = (axis(0), axis(1));
        let pixel = |x: i64, y: i64| {
            let place = |at: i64, axis: usize| match self.texture.wrap[axis] {
                Wrap::Repeat => at.rem_euclid(size[axis]),
                Wrap::Mirror | Wrap::Clamp => at.clamp(0, size[axis] - 1),
            };
            self.color(pixels, (place(y, 1) * size[0] + place(x, 0)) as usize)
        };
        if !linear {
            return pixel((x.floor() as i64).min(size[0] - 1), (y.floor() as i64).min(size[1] - 1));
        }
        let (left, top) = ((x - 0.5).floor(), (y - 0.5).floor());
        let (fx, fy) = (x - 0.5 - left, y - 0.5 - top);
        let (left, top) = (left as i64, top as i64);
        let row = |y: i64| pixel(left, y) * (1.0 - fx) + pixel(left + 1, y) * fx;
        row(top) * (1.0 - fy) + row(top + 1) * fy
    }

    fn color(&self, pixels: &Pixels, index: usize) -> DVec4 {
        let [r, g, b, a] = match pixels {
            Pixels::Rgba16(pixels) => pixels[index].map(|value| f64::from(value) / 65535.0),
            Pixels::Rgba8(pixels) => pixels[index].map(|value| f64::from(value) / 255.0),
        };
        let light = |value: f64| match self.is_srgb {
            false => value,
            true if value <= 0.04045 => value / 12.92,
            true => ((value + 0.055) / 1.055).powf(2.4),
        };
        DVec4::new(light(r), light(g), light(b), a)
    }
}

/// A coordinate inside the texture for one that is anywhere.
fn wrapped(at: f64, wrap: Wrap) -> f64 {
    match wrap {
        Wrap::Repeat => at.rem_euclid(1.0),
        Wrap::Clamp => at.clamp(0.0, 1.0),
        Wrap::Mirror => {
            let twice = at.rem_euclid(2.0);
            twice.min(2.0 - twice)
        }
    }
}
