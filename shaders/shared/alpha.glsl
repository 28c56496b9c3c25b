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
    uint first = bitfieldExtract(word, 0, int(MATERIAL_BITS)) * MATERIAL_TEXELS + LOOK_TEXEL;
    vec4 color = FETCH_FLOATS(materials, first);
    float metallic = FETCH_FLOATS(materials, first + 1u).x;
    float cutoff = FETCH_FLOATS(materials, first + 2u).w;
    uvec4 maps = FETCH(materials, first + 3u);
    uint transmission_map = FETCH(materials, first + 4u).w;
    uvec4 last = FETCH(materials, first + 5u);
    if (VERTEX_COLORS && (word & TRIANGLE_COLORED) != 0u) {
        uint corner = frame.first_color + primitive * TRIANGLE_TEXELS;
        color *= (1.0 - barycentrics.x - barycentrics.y) * FETCH_FLOATS(attributes, corner) +
                 barycentrics.x * FETCH_FLOATS(attributes, corner + 1u) +
                 barycentrics.y * FETCH_FLOATS(attributes, corner + 2u);
    }
    float transmission = uintBitsToFloat(last.x);
    if (TEXTURES) {
        Place place = Place(primitive, barycentrics, vec2(0.0), vec2(0.0));
        if (maps.x != 0u)
            color *= map_at(maps.x, place);
        if (transmission_map != 0u)
            transmission *= map_at(transmission_map, place).r;
        if (maps.y != 0u && transmission > 0.0)
            metallic *= map_at(maps.y, place).b;
    }
    float alpha = last.y == ALPHA_BLEND ? clamp(color.a, 0.0, 1.0) : last.y == ALPHA_MASK && color.a < cutoff ? 0.0 : 1.0;
    vec3 attenuation = FETCH_FLOATS(materials, first + 6u).xyz;
    return Veil(alpha, color.rgb, color.rgb * attenuation, transmission * (1.0 - metallic));
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
