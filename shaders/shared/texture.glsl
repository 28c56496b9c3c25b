// Textures at a place on a triangle, filtered over what the ray's cone covers there. Pixels lie in a buffer and are wrapped and
// weighed here: no device has to know their formats, and software Vulkan cannot choose between images by a number.

/// A place on a triangle and what a ray covers of it.
struct Place {
    uint primitive;
    /// λ2, λ3.
    vec2 barycentrics;
    /// How λ2 and λ3 change along the longer axis of the ellipse that the ray's cone cuts out of the triangle's plane.
    vec2 major;
    /// Along the shorter one.
    vec2 minor;
};

/// A level of a texture's mipmap.
struct Level {
    uint first;
    ivec2 size;
    uint flags;
};

Level level_of(uint first, uvec4 header, uint level) {
    uvec4 firsts = FETCH(textures, first + 3u + (level >> 2u));
    return Level(firsts[level & 3u], max(ivec2(header.xy) >> int(level), ivec2(1)), header.w);
}

vec3 linear_from_srgb(vec3 color) {
    vec3 power = pow((color + 0.055) / 1.055, vec3(2.4));
    return mix(power, color / 12.92, lessThanEqual(color, vec3(0.04045)));
}

/// A pixel of a level.
vec4 pixel_at(Level level, ivec2 place) {
    uint index = uint(place.y * level.size.x + place.x);
    bool is_wide = (level.flags & TEXTURE_WIDE) != 0u;
    uvec4 texel = FETCH(pixels, level.first + (index >> (is_wide ? 1u : 2u)));
    uvec2 wide = (index & 1u) != 0u ? texel.zw : texel.xy;
    vec4 pixel = is_wide ? vec4(unpackUnorm2x16(wide.x), unpackUnorm2x16(wide.y)) : unpackUnorm4x8(texel[index & 3u]);
    return (level.flags & TEXTURE_SRGB) != 0u ? vec4(linear_from_srgb(pixel.rgb), pixel.a) : pixel;
}

/// A coordinate inside the texture, 0 to 1, for one that is anywhere.
float wrap(float at, uint mode) {
    float turned = 1.0 - abs(at - 2.0 * floor(at * 0.5) - 1.0);
    return mode == WRAP_CLAMP ? clamp(at, 0.0, 1.0) : mode == WRAP_MIRROR ? turned : at - floor(at);
}

/// A pixel's number inside a row for one that is at most one beyond its ends.
int wrap_pixel(int at, int size, uint mode) {
    int repeated = at < 0 ? at + size : at >= size ? at - size : at;
    return clamp(mode == 0u ? repeated : at, 0, size - 1);
}

/// A level of a texture at a point, between four pixels or at the nearest.
vec4 read_level(Level level, vec2 at, bool linear) {
    uvec2 mode = uvec2(level.flags & TEXTURE_WRAP_U, (level.flags & TEXTURE_WRAP_V) >> 2u);
    vec2 place = vec2(wrap(at.x, mode.x), wrap(at.y, mode.y)) * vec2(level.size);
    if (!linear)
        return pixel_at(level, clamp(ivec2(floor(place)), ivec2(0), level.size - 1));
    vec2 corner = floor(place - 0.5);
    vec2 weight = place - 0.5 - corner;
    ivec2 lo = ivec2(wrap_pixel(int(corner.x), level.size.x, mode.x), wrap_pixel(int(corner.y), level.size.y, mode.y));
    ivec2 hi = ivec2(wrap_pixel(int(corner.x) + 1, level.size.x, mode.x),
                     wrap_pixel(int(corner.y) + 1, level.size.y, mode.y));
    vec4 upper = mix(pixel_at(level, lo), pixel_at(level, ivec2(hi.x, lo.y)), weight.x);
    vec4 lower = mix(pixel_at(level, ivec2(lo.x, hi.y)), pixel_at(level, hi), weight.x);
    return mix(upper, lower, weight.y);
}

/// A texture at a point where its pixels are 2^lod times as small as what the ray covers: from one level or between two. Written as a loop, which
/// is compiled once, because all of it is repeated for every map that a kernel reads.
vec4 read_texture(uint first, uvec4 header, vec2 at, float lod) {
    bool is_large = lod <= 0.0;
    bool linear = (header.w & (is_large ? TEXTURE_MAGNIFY_NEAREST : TEXTURE_MINIFY_NEAREST)) == 0u;
    bool has_levels = !is_large && (header.w & TEXTURE_MIPMAP) != 0u;
    bool is_nearest = (header.w & TEXTURE_LEVEL_NEAREST) != 0u;
    float last = float(header.z - 1u);
    float level = has_levels ? min(lod, last) : 0.0;
    level = has_levels && is_nearest ? max(ceil(level + 0.5) - 1.0, 0.0) : level;
    float finer = floor(level);
    vec4 sum = vec4(0.0);
    uint levels = level > finer ? 2u : 1u;
    for (uint i = 0u; i < levels; i++) {
        float weight = i == 0u ? 1.0 - (level - finer) : level - finer;
        sum += weight * read_level(level_of(first, header, uint(finer) + i), at, linear);
    }
    return sum;
}

/// The value of a map, named by one more than its place among the textures: the mean of probes along the longer axis of the footprint, each as
/// wide as the shorter one (as GL_EXT_texture_filter_anisotropic describes it).
vec4 map_at(uint map, Place place) {
    uint first = (map - 1u) * TEXTURE_TEXELS;
    uvec4 header = FETCH(textures, first);
    vec4 u_row = FETCH_FLOATS(textures, first + 1u);
    vec4 v_row = FETCH_FLOATS(textures, first + 2u);
    uint corner = frame.first_texcoord + place.primitive * TRIANGLE_TEXELS;
    bool second = (header.w & TEXTURE_SECOND_SET) != 0u;
    vec4 sets_a = FETCH_FLOATS(attributes, corner);
    vec4 sets_b = FETCH_FLOATS(attributes, corner + 1u);
    vec4 sets_c = FETCH_FLOATS(attributes, corner + 2u);
    vec2 a = second ? sets_a.zw : sets_a.xy;
    mat2 edges = mat2((second ? sets_b.zw : sets_b.xy) - a, (second ? sets_c.zw : sets_c.xy) - a);
    mat2 turn = transpose(mat2(u_row.xy, v_row.xy));
    vec2 at = turn * (a + edges * place.barycentrics) + vec2(u_row.z, v_row.z);
    vec2 major = turn * (edges * place.major);
    vec2 minor = turn * (edges * place.minor);
    vec2 size = vec2(header.xy);
    float longer = length(major * size);
    float shorter = length(minor * size);
    vec2 along = longer >= shorter ? major : minor;
    float most = max(longer, shorter);
    float least = max(min(longer, shorter), 1.0);
    bool has_mipmap = (header.w & TEXTURE_MIPMAP) != 0u;
    uint probes = has_mipmap ? uint(clamp(ceil(most / least - 0.001), 1.0, float(MAX_PROBES))) : 1u;
    float lod = log2(max(most / float(probes), 1e-9));
    vec4 sum = vec4(0.0);
    for (uint i = 0u; i < probes; i++)
        sum += read_texture(first, header, at + along * ((float(i) + 0.5) / float(probes) - 0.5), lod);
    return sum / float(probes);
}
