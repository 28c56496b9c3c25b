// Surfaces that are not opaque: what of a ray passes them.

/// What a surface that is not opaque does to light.
struct Veil {
    /// Share of the light that meets the surface: 0 or 1 with a mask.
    float alpha;
    /// Colour of the surface.
    vec3 color;
    /// Colour of what passes where it meets the surface.
    vec3 inside;
    /// Share of that which passes.
    float transmission;
};

/// The veil at a point of a triangle, in the finest level of its textures: what is there and what is not must not depend on how far away it
/// is. `word` is the triangle's material and flags.
Veil veil_at(uint primitive, uint word, vec2 barycentrics) {
    Look look = look_at(bitfieldExtract(word, 0, int(MATERIAL_BITS)));
    vec4 color = vec4(look.base_color, look.alpha);
    float metallic = look.metallic;
    float transmission = look.transmission;
    if (VERTEX_COLORS && (word & TRIANGLE_COLORED) != 0u) {
        uint corner = frame.first_color + primitive * TRIANGLE_TEXELS;
        color *= (1.0 - barycentrics.x - barycentrics.y) * FETCH_FLOATS(attributes, corner) +
                 barycentrics.x * FETCH_FLOATS(attributes, corner + 1u) +
                 barycentrics.y * FETCH_FLOATS(attributes, corner + 2u);
    }
    if (TEXTURES) {
        Place place = Place(primitive, barycentrics, vec2(0.0), vec2(0.0));
        if (look.base_color_map != 0u)
            color *= map_at(look.base_color_map, place);
        if (look.transmission_map != 0u)
            transmission *= map_at(look.transmission_map, place).r;
        if (look.metallic_roughness_map != 0u && transmission > 0.0)
            metallic *= map_at(look.metallic_roughness_map, place).b;
    }
    bool is_hole = look.alpha_mode == ALPHA_MASK && color.a < look.cutoff;
    float alpha = look.alpha_mode == ALPHA_BLEND ? clamp(color.a, 0.0, 1.0) : is_hole ? 0.0 : 1.0;
    return Veil(alpha, color.rgb, color.rgb * look.attenuation, transmission * (1.0 - metallic));
}

/// What is seen of things behind it: the share that does not meet the surface, and what passes it, tinted.
vec3 seen_through(Veil veil) {
    return vec3(1.0 - veil.alpha) + veil.alpha * veil.transmission * veil.inside;
}

/// What passes of light on its way: a blended surface also colours what does not meet it, the more so the more there is of it, as stained
/// glass does.
vec3 light_through(Veil veil) {
    return (1.0 - veil.alpha) * mix(vec3(1.0), veil.color, veil.alpha) + veil.alpha * veil.transmission * veil.inside;
}
