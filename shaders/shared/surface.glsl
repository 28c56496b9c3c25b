// What lies at a hit: position, normals, material coefficients; and rays that leave it.

struct Surface {
    vec3 position;
    /// Bound on the rounding error of position, the largest of the three axes.
    float error;
    /// Unit normal of the triangle, on the side that the ray came from.
    vec3 geometric_normal;
    /// Unit interpolated normal, on the same side.
    vec3 normal;
    /// Vertex colour, and base colour map if there is one.
    vec3 tint;
    /// Where on the triangle, and how much of it is seen.
    Place place;
    uint material;
    /// The triangle's material and flags.
    uint word;
    /// It is not opaque everywhere.
    bool is_see_through;
    /// Its normal comes from a normal map.
    bool is_bent;
    /// From position to where shadow rays start: on the curved surface that the vertex normals stand for.
    vec3 bulge;
    /// From position to where it is at least four times the error inside every edge: what rounding put beyond an edge, and so behind the
    /// wall that meets this one there, is in front of both again.
    vec3 inward;
};

/// The mean of a triangle's attributes, which start here.
vec4 interpolate(uint first, vec3 weights) {
    return weights.x * FETCH_FLOATS(attributes, first) + weights.y * FETCH_FLOATS(attributes, first + 1u) +
           weights.z * FETCH_FLOATS(attributes, first + 2u);
}

/// The linear part of an instance's transform to the world, column by column.
mat3 world_from_part(uint instance) {
    uint first = instance * INSTANCE_TEXELS + 5u;
    return transpose(mat3(FETCH_FLOATS(instances, first).xyz, FETCH_FLOATS(instances, first + 1u).xyz,
                          FETCH_FLOATS(instances, first + 2u).xyz));
}

/// The power of two at or below the largest component: dividing by it is exact and keeps products from vanishing.
float magnitude_of(vec3 size) {
    return uintBitsToFloat(floatBitsToUint(max(size.x, max(size.y, size.z))) & 0x7f800000u);
}

/// A normal of a part, of any length, in the world, of another length: by the cofactors, whose sign is the determinant's, so that
/// mirrored normals stay on the front.
vec3 world_normal(uint instance, vec3 normal) {
    mat3 m = world_from_part(instance);
    m /= magnitude_of(max(abs(m[0]), max(abs(m[1]), abs(m[2]))));
    vec3 x = cross(m[1], m[2]);
    vec3 world = mat3(x, cross(m[2], m[0]), cross(m[0], m[1])) * normal;
    return (dot(m[0], x) < 0.0 ? -world : world) / magnitude_of(abs(world));
}

/// Moves a position and its error from the space of an instance's part to the world. What the ray lost on its way into that
/// space is as much as what is lost on the way back, times the transforms' condition.
void place_in_world(uint instance, float condition, vec3 magnitude, inout Surface surface) {
    uint first = instance * INSTANCE_TEXELS;
    vec4 x = FETCH_FLOATS(instances, first + 5u);
    vec4 y = FETCH_FLOATS(instances, first + 6u);
    vec4 z = FETCH_FLOATS(instances, first + 7u);
    vec3 offset = vec3(x.w, y.w, z.w);
    surface.position = surface.position * mat3(x.xyz, y.xyz, z.xyz) + offset;
    vec3 world = magnitude * mat3(abs(x.xyz), abs(y.xyz), abs(z.xyz)) + abs(offset);
    surface.error = 9.6e-7 * condition * max(world.x, max(world.y, world.z));
}

/// By how much barycentric coordinates must change for the point to be at least four errors inside every edge, or, in a triangle that is
/// thinner than that, in the middle.
vec3 lift_from_edges(vec3 weights, float error, vec3 a, vec3 b, vec3 c) {
    vec3 edges = vec3(length(c - b), length(a - c), length(b - a));
    // Each coordinate is the distance from its edge over the height above it, which is twice the area over the edge.
    vec3 least = min(4.0 * error * edges / max(length(cross(b - a, c - a)), 1e-30), vec3(1.0 / 3.0));
    vec3 inside = max(weights, least);
    return inside / (inside.x + inside.y + inside.z) - weights;
}

/// From a point to the plane through a corner across its normal, where the point lies below.
vec3 rise(vec3 from_corner, vec3 normal) {
    return -min(dot(from_corner, normal), 0.0) * normal;
}

/// What a cone of this diameter covers of a triangle: the axes of an ellipse, as changes of its barycentric coordinates (as in Akenine-Möller et
/// al., JCGT 10(1) 2021).
void cover(vec3 edge_b, vec3 edge_c, vec3 normal, vec3 direction, float diameter, inout Place place) {
    float cosine = max(abs(dot(normal, direction)), 1e-3);
    vec3 along = direction - dot(normal, direction) * normal;
    vec3 other = abs(normal.x) < 0.5 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0);
    along = normalize(dot(along, along) > 1e-12 ? along : cross(normal, other));
    // Edges of about size 1, so that no product vanishes.
    float size = magnitude_of(max(abs(edge_b), abs(edge_c)));
    vec3 b = edge_b / size;
    vec3 c = edge_c / size;
    vec3 across = cross(b, c);
    float scale = 1.0 / (size * max(dot(across, across), 1e-30));
    mat2x3 gradients = mat2x3(cross(c, across) * scale, cross(across, b) * scale);
    place.major = (along * (diameter / cosine)) * gradients;
    place.minor = (cross(normal, along) * diameter) * gradients;
}

/// The normal that a normal map says, from one that is interpolated; both on the front.
vec3 mapped_normal(HitItem item, Surface surface, Look look, vec3 weights, vec3 normal, bool is_placed) {
    vec4 interpolated = interpolate(frame.first_tangent + surface.place.primitive * TRIANGLE_TEXELS, weights);
    vec3 tangent = interpolated.xyz;
    float handedness = interpolated.w < 0.0 ? -1.0 : 1.0;
    if (is_placed) {
        mat3 to_world = world_from_part(item.instance);
        tangent = to_world * tangent;
        handedness *= dot(cross(to_world[0], to_world[1]), to_world[2]) < 0.0 ? -1.0 : 1.0;
    }
    tangent -= dot(tangent, normal) * normal;
    float size = length(tangent);
    vec3 local = map_at(look.normal_map, surface.place).xyz * 2.0 - 1.0;
    local.xy *= look.normal_scale;
    tangent /= size;
    vec3 mapped = local.x * tangent + local.y * handedness * cross(normal, tangent) + local.z * normal;
    return size > 0.0 && dot(mapped, mapped) > 0.0 ? normalize(mapped) : normal;
}

/// The surface that was hit; the cone of the ray had this length when it arrived, or, where it comes from the eye, any.
Surface surface_at(HitItem item, float cone_length, bool from_eye) {
    uint first = item.triangle * TRIANGLE_TEXELS;
    uvec4 texel_a = FETCH(triangles, first);
    uvec4 texel_b = FETCH(triangles, first + 1u);
    uvec4 texel_c = FETCH(triangles, first + 2u);
    vec3 a = uintBitsToFloat(texel_a.xyz);
    vec3 b = uintBitsToFloat(texel_b.xyz);
    vec3 c = uintBitsToFloat(texel_c.xyz);
    vec3 weights = vec3(1.0 - item.barycentrics.x - item.barycentrics.y, item.barycentrics);
    uint first_attribute = texel_a.w * TRIANGLE_TEXELS;
    uint flags = texel_b.w;

    Surface surface;
    // From the barycentrics, never origin + t · direction: the error is then bounded by the triangle's size and place,
    // γ(7)·Σ|λᵢ pᵢ| (Pharr, Jakob and Humphreys, 4th ed., 6.8.4), not by the length of the ray; 16 u covers γ(7) and the
    // next ray's own subtraction.
    surface.position = weights.x * a + weights.y * b + weights.z * c;
    vec3 magnitude = abs(weights.x * a) + abs(weights.y * b) + abs(weights.z * c);
    surface.error = 9.6e-7 * max(magnitude.x, max(magnitude.y, magnitude.z));
    // A condition of 0 means that the part lies in the world already.
    float condition = INSTANCES ? FETCH_FLOATS(instances, item.instance * INSTANCE_TEXELS + 4u).w : 0.0;
    bool is_placed = INSTANCES && condition > 0.0;
    if (is_placed)
        place_in_world(item.instance, condition, magnitude, surface);
    // Edges are brought to size 1 first, so that tiny or huge triangles neither underflow nor overflow.
    vec3 edge_b = b - a;
    vec3 edge_c = c - a;
    float size_b = max(abs(edge_b.x), max(abs(edge_b.y), abs(edge_b.z)));
    float size_c = max(abs(edge_c.x), max(abs(edge_c.y), abs(edge_c.z)));
    vec3 across = cross(edge_b / size_b, edge_c / size_c);
    surface.geometric_normal = normalize(is_placed ? world_normal(item.instance, across) : across);
    vec3 lifted = lift_from_edges(weights, 9.6e-7 * max(magnitude.x, max(magnitude.y, magnitude.z)), a, b, c);
    surface.inward = lifted.y * edge_b + lifted.z * edge_c;
    if (is_placed)
        surface.inward = world_from_part(item.instance) * surface.inward;
    surface.normal = surface.geometric_normal;
    surface.bulge = vec3(0.0);
    if (SMOOTH_NORMALS && (flags & TRIANGLE_SMOOTH) != 0u) {
        vec3 na = FETCH_FLOATS(attributes, first_attribute).xyz;
        vec3 nb = FETCH_FLOATS(attributes, first_attribute + 1u).xyz;
        vec3 nc = FETCH_FLOATS(attributes, first_attribute + 2u).xyz;
        if (is_placed) {
            // Unit in the world before they are interpolated, as in a flat scene, where the host sees to it.
            na = normalize(world_normal(item.instance, na));
            nb = normalize(world_normal(item.instance, nb));
            nc = normalize(world_normal(item.instance, nc));
        }
        surface.normal = normalize(weights.x * na + weights.y * nb + weights.z * nc);
        vec3 point = weights.x * a + weights.y * b + weights.z * c;
        float front = dot(surface.geometric_normal, item.direction) > 0.0 ? -1.0 : 1.0;
        mat3 to_world = is_placed ? world_from_part(item.instance) : mat3(1.0);
        surface.bulge = weights.x * rise(to_world * (point - a), front * na) +
                        weights.y * rise(to_world * (point - b), front * nb) +
                        weights.z * rise(to_world * (point - c), front * nc);
    }
    surface.material = bitfieldExtract(texel_b.w, 0, int(MATERIAL_BITS));
    surface.word = flags;
    surface.is_see_through = (flags & TRIANGLE_SEE_THROUGH) != 0u;
    surface.place = Place(texel_a.w, item.barycentrics, vec2(0.0), vec2(0.0));
    if (TEXTURES) {
        mat3 to_world = is_placed ? world_from_part(item.instance) : mat3(1.0);
        float length_so_far = from_eye ? distance(surface.position, frame.eye) : cone_length;
        float diameter = frame.cone.x + frame.cone.y * length_so_far;
        cover(to_world * edge_b, to_world * edge_c, surface.geometric_normal, item.direction, diameter, surface.place);
    }
    surface.is_bent = false;
    if (TEXTURES && NORMAL_MAPS) {
        Look look = look_at(surface.material);
        surface.is_bent = look.normal_map != 0u;
        if (surface.is_bent)
            surface.normal = mapped_normal(item, surface, look, weights, surface.normal, is_placed);
    }
    if (dot(surface.geometric_normal, item.direction) > 0.0) {
        surface.geometric_normal = -surface.geometric_normal;
        surface.normal = -surface.normal;
    }
    surface.tint = vec3(1.0);
    if (VERTEX_COLORS && (flags & TRIANGLE_COLORED) != 0u)
        surface.tint = interpolate(frame.first_color + first_attribute, weights).rgb;
    return surface;
}

/// How far off the surface a ray starts.
float offset_of(Surface surface) {
    return FIXED_EPSILON ? frame.fixed_epsilon : surface.error;
}

/// Start of a ray that leaves the surface: moved along the geometric normal, to the side the ray goes to, by the error
/// bound, which grows with the triangle and its distance from the world's origin.
vec3 leave_surface(Surface surface, vec3 direction) {
    float side = dot(surface.geometric_normal, direction) < 0.0 ? -1.0 : 1.0;
    return surface.position + surface.inward + surface.geometric_normal * (side * offset_of(surface));
}

/// Start of a shadow ray: from the curved surface that the vertex normals stand for (Hanika, Ray Tracing Gems II, ch. 4), so that the
/// flat triangles do not show where light only just reaches it; on the side that is seen.
vec3 leave_towards_light(Surface surface) {
    return surface.position + surface.inward + surface.bulge + surface.geometric_normal * offset_of(surface);
}
