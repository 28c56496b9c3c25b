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

/// Applies the maps of a surface's material to its coefficients and tint.
void apply_maps(uint material_index, inout Surface surface, inout Material material) {
    Look look = look_at(material_index);
    vec4 base = vec4(1.0);
    if (look.base_color_map != 0u)
        base = map_at(look.base_color_map, surface.place);
    surface.tint *= base.rgb;
    if (look.emission_map != 0u)
        material.emission *= map_at(look.emission_map, surface.place).rgb;
    uint deep = look.metallic_roughness_map | look.specular_map | look.specular_color_map | look.transmission_map;
    if (deep != 0u && look.follows_rule != 0u) {
        vec4 rough_metal = vec4(1.0);
        vec3 dielectric = look.dielectric;
        float transmission = look.transmission;
        if (look.metallic_roughness_map != 0u)
            rough_metal = map_at(look.metallic_roughness_map, surface.place);
        if (look.specular_map != 0u)
            dielectric *= map_at(look.specular_map, surface.place).a;
        if (look.specular_color_map != 0u)
            dielectric *= map_at(look.specular_color_map, surface.place).rgb;
        if (look.transmission_map != 0u)
            transmission *= map_at(look.transmission_map, surface.place).r;
        material = by_rule(look.base_color * surface.tint, look.metallic * rough_metal.b, look.roughness * rough_metal.g,
                           dielectric, transmission, material.emission);
        surface.tint = vec3(1.0);
    }
    if (look.occlusion_map != 0u)
        material.ambient_tinted *= 1.0 + look.occlusion_strength * (map_at(look.occlusion_map, surface.place).r - 1.0);
}
