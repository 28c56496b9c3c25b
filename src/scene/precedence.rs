//! Which of several surfaces at the very same distance is seen.

use super::{Scene, Soup};
use rayon::prelude::*;

/// A number for each primitive of the soup; of several hits at the same distance the one with the smallest number is seen. It comes from what the triangle
/// looks like and has 31 bits, so that copies of a surface that several meshes share give the same picture in whatever order the file has them. Where
/// the numbers are equal too, so are, but for a chance of 2⁻³¹, the looks.
pub fn precedence(scene: &Scene, soup: &Soup) -> Vec<u32> {
    let materials: Vec<u32> = scene
        .materials
        .iter()
        .map(|material| format!("{material:?}").bytes().fold(0x811c_9dc5, |hash, byte| mix(hash, byte.into())))
        .collect();
    let values = |hash, values: &[f32]| values.iter().fold(hash, |hash, value| mix(hash, value.to_bits()));
    let of_primitive = |primitive: usize| {
        let flags = soup.flags[primitive];
        let mut hash = materials[soup.materials[primitive] as usize];
        if flags.smooth {
            hash = soup.normals[primitive].iter().fold(hash, |hash, normal| values(hash, &normal.to_array()));
        }
        if flags.colored {
            hash = soup.colors[primitive].iter().fold(hash, |hash, color| values(hash, &color.to_array()));
        }
        if scene.materials[soup.materials[primitive] as usize].drawn_maps().any() {
            let sets = soup.texcoords[primitive].iter().flatten();
            hash = sets.fold(hash, |hash, texcoord| values(hash, &texcoord.to_array()));
        }
        hash
    };
    (0..soup.len()).into_par_iter().map(|primitive| of_primitive(primitive) >> 1).collect()
}

/// One step of FNV-1a.
fn mix(hash: u32, value: u32) -> u32 {
    (hash ^ value).wrapping_mul(0x0100_0193)
}
