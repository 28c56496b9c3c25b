// What lies at a hit: position, normals, material coefficients; and rays that leave it.

struct Surface {
    vec3 position;
    /// Bound on the rounding error of position, the largest of the three axes.
    float error;
    /// Unit normal of the triangle, on the side that the ray came from.
    vec3 geometric_normal;
    /// Unit interpolated normal, on the same side.
    vec3 normal;
    /// Vertex colour.
    vec3 tint;
    uint material;
};

vec3 interpolate(vec3 weights, uvec4 a, uvec4 b, uvec4 c) {
    return weights.x * uintBitsToFloat(a.xyz) + weights.y * uintBitsToFloat(b.xyz) + weights.z * uintBitsToFloat(c.xyz);
}

Surface surface_at(HitItem item) {
    uint first = item.triangle * TRIANGLE_TEXELS;
    uvec4 texel_a = FETCH(triangles, first);
    uvec4 texel_b = FETCH(triangles, first + 1u);
    uvec4 texel_c = FETCH(triangles, first + 2u);
    vec3 a = uintBitsToFloat(texel_a.xyz);
    vec3 b = uintBitsToFloat(texel_b.xyz);
    vec3 c = uintBitsToFloat(texel_c.xyz);
    vec3 weights = vec3(1.0 - item.barycentrics.x - item.barycentrics.y, item.barycentrics);
    uint attributes = texel_a.w * TRIANGLE_TEXELS;
    uint flags = texel_c.w;

    Surface surface;
    // From the barycentrics, never origin + t · direction: the error is then bounded by the triangle's size and place,
    // γ(7)·Σ|λᵢ pᵢ| (Pharr, Jakob and Humphreys, 4th ed., 6.8.4), not by the length of the ray; 16 u covers γ(7) and the
    // next ray's own subtraction.
    surface.position = weights.x * a + weights.y * b + weights.z * c;
    vec3 magnitude = abs(weights.x * a) + abs(weights.y * b) + abs(weights.z * c);
    surface.error = 9.6e-7 * max(magnitude.x, max(magnitude.y, magnitude.z));
    // Edges are brought to size 1 first, so that tiny or huge triangles neither underflow nor overflow.
    vec3 edge_b = b - a;
    vec3 edge_c = c - a;
    float size_b = max(abs(edge_b.x), max(abs(edge_b.y), abs(edge_b.z)));
    float size_c = max(abs(edge_c.x), max(abs(edge_c.y), abs(edge_c.z)));
    surface.geometric_normal = normalize(cross(edge_b / size_b, edge_c / size_c));
    surface.normal = surface.geometric_normal;
    if (SMOOTH_NORMALS && (flags & TRIANGLE_SMOOTH) != 0u)
        surface.normal = normalize(interpolate(weights, FETCH(normals, attributes), FETCH(normals, attributes + 1u),
                                               FETCH(normals, attributes + 2u)));
    if (dot(surface.geometric_normal, item.direction) > 0.0) {
        surface.geometric_normal = -surface.geometric_normal;
        surface.normal = -surface.normal;
    }
    surface.tint = vec3(1.0);
    if (VERTEX_COLORS && (flags & TRIANGLE_COLORED) != 0u)
        surface.tint = interpolate(weights, FETCH(colors, attributes), FETCH(colors, attributes + 1u),
                                   FETCH(colors, attributes + 2u));
    surface.material = texel_b.w;
    return surface;
}

/// Start of a ray that leaves the surface: moved along the geometric normal, to the side the ray goes to, by the error
/// bound, which grows with the triangle and its distance from the world's origin.
vec3 leave_surface(Surface surface, vec3 direction) {
    float side = dot(surface.geometric_normal, direction) < 0.0 ? -1.0 : 1.0;
    return surface.position + surface.geometric_normal * (side * surface.error);
}
