// What a surface's maps make of its material. The rule is that of scene::material.

const float PI = 3.14159265358979;

/// Coefficients by the rule; nothing is left for a tint to multiply.
Material by_rule(vec3 base, float metallic, float roughness, vec3 dielectric, float transmission, vec3 emission) {
    float weight = max(1.0 - roughness / MIRROR_END_ROUGHNESS, 0.0);
    weight *= weight;
    vec3 reflectance = dielectric * (1.0 - metallic) + base * metallic;
    float stays = 1.0 - transmission * (1.0 - metallic);
    float alpha = roughness * roughness;
    float shininess = clamp(2.0 / max(alpha * alpha, 1e-12) - 2.0, 1.0, 1024.0);
    vec3 diffuse = base * (stays * ((1.0 - metallic) + metallic * (1.0 - weight) / 2.0) / PI);
    vec3 specular = reflectance * ((shininess + 8.0) / (8.0 * PI));
    return Material(base * (AMBIENT_SHARE * stays), shininess, emission, diffuse, specular, vec3(0.0), reflectance * weight,
                    vec3(0.0), vec2(0.0));
}

/// Applies the maps of a surface's material to its coefficients and tint. Maps are read in a loop: one by one, the kernel would be eight times as
/// long, and be compiled as slowly.
void apply_maps(uint material_index, inout Surface surface, inout Material material) {
    const uint BASE_COLOR = 0u, ROUGH_METAL = 1u, OCCLUSION = 2u, EMISSION = 3u, SPECULAR_STRENGTH = 4u;
    const uint SPECULAR_COLOR = 5u, TRANSMISSION = 6u, MAPS = 7u;
    Look look = look_at(material_index);
    uint maps[MAPS] = uint[](look.base_color_map, look.metallic_roughness_map, look.occlusion_map, look.emission_map,
                             look.specular_map, look.specular_color_map, look.transmission_map);
    vec4 values[MAPS];
    [[dont_unroll]] for (uint i = 0u; i < MAPS; i++)
        values[i] = maps[i] != 0u ? map_at(maps[i], surface.place) : vec4(1.0);
    surface.tint *= values[BASE_COLOR].rgb;
    material.emission *= values[EMISSION].rgb;
    uint deep = look.metallic_roughness_map | look.specular_map | look.specular_color_map | look.transmission_map;
    if (deep != 0u && look.follows_rule != 0u) {
        vec3 dielectric = look.dielectric * values[SPECULAR_STRENGTH].a * values[SPECULAR_COLOR].rgb;
        material = by_rule(look.base_color * surface.tint, look.metallic * values[ROUGH_METAL].b,
                           look.roughness * values[ROUGH_METAL].g, dielectric,
                           look.transmission * values[TRANSMISSION].r, material.emission);
        surface.tint = vec3(1.0);
    }
    material.ambient_tinted *= 1.0 + look.occlusion_strength * (values[OCCLUSION].r - 1.0);
}
