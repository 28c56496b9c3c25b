//! KHR_materials_pbrSpecularGlossiness → metallic-roughness, factors and pictures, by the method that the extension's own converter uses:
//! the metallic share is the root of a quadratic equation that keeps the brightness of both reflections.

use super::materials::Properties;
use super::Document;
use crate::scene::{Image, Map, Material, Pixels, Scene, Texture};
use crate::srgb::{decode, encode};
use glam::{DVec3, DVec4};
use rayon::prelude::*;
use std::sync::Arc;

/// Reflectance of a dielectric seen head-on.
const DIELECTRIC: f64 = 0.04;

/// A material that is still to be converted, once its pictures are decoded. Until then its base colour map is the diffuse one, its
/// metallic-roughness map the other.
pub(super) struct Unconverted {
    material: usize,
    /// Linear RGB.
    specular: DVec3,
    glossiness: f64,
}

/// Base colour, metallic and roughness for a diffuse and a specular colour and a glossiness.
fn converted(diffuse: DVec3, specular: DVec3, glossiness: f64) -> (DVec3, f64, f64) {
    let brightness = |color: DVec3| (color * color).dot(DVec3::new(0.299, 0.587, 0.114)).sqrt();
    let stays = 1.0 - specular.max_element().min(1.0);
    let bright = brightness(specular);
    let metallic = if bright < DIELECTRIC {
        0.0
    } else {
        let b = brightness(diffuse) * stays / (1.0 - DIELECTRIC) + bright - 2.0 * DIELECTRIC;
        let c = DIELECTRIC - bright;
        let root = (b * b - 4.0 * DIELECTRIC * c).max(0.0).sqrt();
        ((root - b) / (2.0 * DIELECTRIC)).clamp(0.0, 1.0)
    };
    let of_dielectric = diffuse * (stays / (1.0 - DIELECTRIC) / (1.0 - metallic).max(1e-6));
    let of_metal = (specular - DIELECTRIC * (1.0 - metallic)) / metallic.max(1e-6);
    let base = of_dielectric.lerp(of_metal, metallic * metallic).clamp(DVec3::ZERO, DVec3::ONE);
    (base, metallic, 1.0 - glossiness)
}

impl Document<'_> {
    /// Converts a material's factors; what its pictures say follows when they are decoded.
    pub(super) fn read_spec_gloss(&mut self, path: &str, own: Properties, index: usize, material: &mut Material) {
        let Some(given) = own.extension("KHR_materials_pbrSpecularGlossiness") else { return };
        let diffuse = given.color("diffuseFactor", 1.0);
        let alpha = given.0.get("diffuseFactor").and_then(|color| color.get(3)?.as_f64()).unwrap_or(1.0);
        let (specular, glossiness) = (given.color("specularFactor", 1.0), given.share("glossinessFactor", 1.0));
        material.alpha = alpha.clamp(0.0, 1.0);
        material.maps.base_color = self.map(path, given, "diffuseTexture");
        material.maps.metallic_roughness = self.map(path, given, "specularGlossinessTexture");
        if material.maps.base_color.is_none() && material.maps.metallic_roughness.is_none() {
            (material.base_color, material.metallic, material.roughness) = converted(diffuse, specular, glossiness);
        } else {
            material.base_color = diffuse;
            self.unconverted.push(Unconverted { material: index, specular, glossiness });
        }
    }

    /// Converts the materials whose pictures are decoded now, pixel by pixel.
    pub(super) fn convert_spec_gloss(&mut self, scene: &mut Scene) {
        for own in std::mem::take(&mut self.unconverted) {
            let material = &scene.materials[own.material];
            let (colors, glosses) = (material.maps.base_color, material.maps.metallic_roughness);
            let place = |map: &Map| (map.texcoord, map.transform);
            if colors.as_ref().zip(glosses.as_ref()).is_some_and(|(a, b)| place(a) != place(b)) {
                let name = &material.name;
                self.warnings.add(format!(
                    "approximated: material '{name}' places its diffuse and its specular texture differently; the first counts"
                ));
            }
            let Some(map) = colors.or(glosses) else { continue };
            let pictures = [colors, glosses].map(|map| map.and_then(|map| scene.image_of(&map)));
            let diffuse = material.base_color.extend(1.0);
            let factor = own.specular.extend(own.glossiness);
            let (base, numbers) = bake(pictures, diffuse, factor);
            let sampler = scene.textures[map.texture];
            let mut add = |image: Image| {
                scene.images.push(Some(Arc::new(image)));
                scene.textures.push(Texture { image: scene.images.len() - 1, ..sampler });
                Some(Map { texture: scene.textures.len() - 1, ..map })
            };
            let (base, numbers) = (add(base), add(numbers));
            let material = &mut scene.materials[own.material];
            (material.base_color, material.metallic, material.roughness) = (DVec3::ONE, 1.0, 1.0);
            (material.maps.base_color, material.maps.metallic_roughness) = (base, numbers);
        }
    }
}

/// The pictures of base colour and of metallic and roughness for two pictures, each white where it is missing, and their factors.
fn bake(pictures: [Option<&Image>; 2], diffuse: DVec4, specular: DVec4) -> (Image, Image) {
    let largest = |side: fn(&Image) -> u32| pictures.iter().flatten().map(|image| side(image)).max().unwrap_or(1);
    let (width, height) = (largest(|image| image.width), largest(|image| image.height));
    let at =
        |image: Option<&Image>, x: u32, y: u32| image.map_or(DVec4::ONE, |image| pixel(image, x, y, width, height));
    let pixels: Vec<([u8; 4], [u8; 4])> = (0..width as usize * height as usize)
        .into_par_iter()
        .map(|index| {
            let (x, y) = ((index % width as usize) as u32, (index / width as usize) as u32);
            let (color, gloss) = (at(pictures[0], x, y) * diffuse, at(pictures[1], x, y) * specular);
            let (base, metallic, roughness) = converted(color.truncate(), gloss.truncate(), gloss.w);
            let code = |value: f64| (255.0 * value).round() as u8;
            let [r, g, b] = base.to_array().map(|light| code(encode(light)));
            ([r, g, b, code(color.w)], [255, code(roughness), code(metallic), 255])
        })
        .collect();
    let image = |name: &str, pixels: Vec<[u8; 4]>| Image {
        name: name.into(),
        format: "converted".into(),
        width,
        height,
        pixels: Pixels::Rgba8(pixels),
        bytes: 0,
    };
    let (base, numbers) = pixels.into_iter().unzip();
    (image("base colour", base), image("metallic and roughness", numbers))
}

/// The nearest pixel of a picture stretched to a size, its colours as light.
fn pixel(image: &Image, x: u32, y: u32, width: u32, height: u32) -> DVec4 {
    let scaled = |at: u32, own: u32, size: u32| (u64::from(at) * u64::from(own) / u64::from(size)) as usize;
    let index = scaled(y, image.height, height) * image.width as usize + scaled(x, image.width, width);
    let [r, g, b, a] = match &image.pixels {
        Pixels::Rgba8(pixels) => pixels[index].map(|value| f64::from(value) / 255.0),
        Pixels::Rgba16(pixels) => pixels[index].map(|value| f64::from(value) / 65535.0),
    };
    DVec4::new(decode(r), decode(g), decode(b), a)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plastic_and_metal_come_out_as_they_went_in() {
        // A dielectric: 0.04 of everything is reflected, the rest is diffuse.
        let (base, metallic, roughness) = converted(DVec3::new(0.5, 0.25, 0.1), DVec3::splat(0.04), 0.3);
        assert!(base.distance(DVec3::new(0.5, 0.25, 0.1)) < 1e-9 && metallic < 1e-9, "{base} {metallic}");
        assert!((roughness - 0.7).abs() < 1e-12);
        // A metal reflects its colour and has no diffuse part.
        let gold = DVec3::new(1.0, 0.77, 0.34);
        let (base, metallic, _) = converted(DVec3::ZERO, gold, 1.0);
        assert!(base.distance(gold) < 1e-9 && (metallic - 1.0).abs() < 1e-9, "{base} {metallic}");
    }

    #[test]
    fn pictures_of_two_sizes_are_baked_to_the_larger() {
        let image = |width, pixels: Vec<[u8; 4]>| Image {
            name: String::new(),
            format: String::new(),
            width,
            height: 1,
            pixels: Pixels::Rgba8(pixels),
            bytes: 0,
        };
        let colors = image(2, vec![[255, 0, 0, 128], [0, 255, 0, 255]]);
        let glosses = image(1, vec![[0, 0, 0, 51]]);
        let (base, numbers) = bake([Some(&colors), Some(&glosses)], DVec4::ONE, DVec4::ONE);
        let (Pixels::Rgba8(base), Pixels::Rgba8(numbers)) = (base.pixels, numbers.pixels) else { panic!() };
        assert_eq!((base[0][3], base[1][0], base[1][3]), (128, 0, 255));
        assert!(base[0][0] > 240 && base[1][1] > 240, "{base:?}");
        assert_eq!(numbers, [[255, 204, 0, 255]; 2]);
    }
}
