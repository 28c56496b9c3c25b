//! What a scene needs of the renderer.

use super::{Filter, Material, Sampler, Scene, Soup, View};
use crate::layout::Features;
use glam::DVec3;

/// The features that this view of this scene needs, and no more.
pub fn of(scene: &Scene, soup: &Soup, view: &View) -> Features {
    let mut used = vec![false; scene.materials.len()];
    for material in &soup.materials {
        used[*material as usize] = true;
    }
    let materials: Vec<&Material> =
        scene.materials.iter().zip(&used).filter(|(_, used)| **used).map(|(material, _)| material).collect();
    let any = |of: fn(&Material) -> DVec3| materials.iter().any(|material| of(material).max_element() > 0.0);
    let specular = any(|material| material.whitted(DVec3::ONE).specular);
    let diffuse = any(|material| material.whitted(DVec3::ONE).diffuse);
    let mirror = any(most_mirroring);
    let maps = |of: fn(&super::Maps) -> bool| materials.iter().any(|material| of(&material.drawn_maps()));
    let shadows = !view.lights.is_empty() && (specular || diffuse);
    Features {
        smooth_normals: soup.flags.iter().any(|flags| flags.smooth),
        vertex_colors: soup.flags.iter().any(|flags| flags.colored),
        single_sided: soup.flags.iter().any(|flags| flags.single_sided),
        specular: shadows && specular,
        shadows,
        reflections: mirror && view.max_depth > 0,
        multisampling: view.samples > 1,
        sobol: view.samples > 1 && view.sampler == Sampler::Sobol,
        independent: view.samples > 1 && view.sampler == Sampler::Independent,
        filter: view.samples > 1 && view.filter != Filter::Box,
        textures: maps(super::Maps::any),
        normal_maps: maps(|maps| maps.normal.is_some()),
        alpha: materials.iter().any(|material| material.is_see_through()),
        thin_triangles: soup.flags.iter().any(|flags| flags.thin),
        layers: materials.iter().any(|material| material.lets_light_through()),
        // These are the renderer's to know.
        instances: false,
        retrace: false,
        fixed_epsilon: false,
        moller_trumbore: false,
        plain_sums: false,
    }
}

/// The mirror coefficient where a material mirrors most: with a map, roughness and metallic may be anything up to their factors.
fn most_mirroring(material: &Material) -> DVec3 {
    let mirror = |material: &Material| material.whitted(DVec3::ONE).mirror;
    if material.drawn_maps().metallic_roughness.is_none() {
        return mirror(material);
    }
    let smooth = Material { roughness: 0.0, ..material.clone() };
    mirror(&smooth).max(mirror(&Material { metallic: 0.0, ..smooth }))
}
