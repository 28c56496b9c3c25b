// Ray against triangle, watertight: Woop, Benthin and Wald, JCGT 2(1) 2013. The world is sheared so that the ray runs
// along z from the origin; then three 2D edge functions decide. Two triangles evaluate a shared edge by the same products,
// exactly negated (`precise` forbids contraction), and 0 counts as inside: no ray slips between them. Rounding is monotone, so the
// difference of two rounded products never has the wrong sign: it is 0 where f32 cannot tell, and then both triangles are hit.

/// The triangle of a ray that hits none.
const uint NO_TRIANGLE = 0xffffffffu;

struct Ray {
    vec3 origin;
    vec3 direction;
};

struct Hit {
    /// Distance along the ray, in lengths of its direction.
    float t;
    /// Triangle in leaf order.
    uint triangle;
    /// Primitive: decides last between hits at the same distance, so that the tree's shape never shows.
    uint primitive;
    /// λ2, λ3.
    vec2 barycentrics;
    /// Instance; decides before the primitive.
    uint instance;
    /// What the triangle looks like, as a number: decides before both, so that the order of the file never shows.
    uint precedence;
};

/// A ray prepared for the triangle test. Axes are rotated so that z is the direction's largest component.
struct ShearedRay {
    vec3 origin;
    /// x/z, y/z and 1/z of the rotated direction.
    vec3 shear;
    uint largest_axis;
};

vec3 rotate_axes(vec3 v, uint largest_axis) {
    return largest_axis == 0u ? v.yzx : largest_axis == 1u ? v.zxy : v;
}

ShearedRay shear_ray(Ray ray) {
    vec3 size = abs(ray.direction);
    uint axis = size.x >= size.y ? (size.x >= size.z ? 0u : 2u) : (size.y >= size.z ? 1u : 2u);
    vec3 d = rotate_axes(ray.direction, axis);
    return ShearedRay(ray.origin, vec3(d.x / d.z, d.y / d.z, 1.0 / d.z), axis);
}

#ifndef PLAIN
/// Barycentric coordinates and distance by Möller and Trumbore (JGT 2(1) 1997): u, v, w and t, all of one sign where the ray
/// hits, their sum in det. Two triangles come to different results about the edge that they share.
void moller_trumbore(Ray ray, vec3 a, vec3 b, vec3 c, out vec3 uvw, out float det, out float t) {
    vec3 edge_b = b - a;
    vec3 edge_c = c - a;
    vec3 across = cross(ray.direction, edge_c);
    float determinant = dot(edge_b, across);
    vec3 from_a = ray.origin - a;
    float v = dot(from_a, across) / determinant;
    vec3 around = cross(from_a, edge_b);
    float w = dot(ray.direction, around) / determinant;
    uvw = vec3(1.0 - v - w, v, w);
    det = 1.0;
    t = dot(edge_c, around) / determinant;
}
#endif

/// Takes the triangle as the new hit if it is nearer than the old one.
bool intersect_triangle(ShearedRay ray, uint triangle, uint instance, bool culls, inout Hit hit) {
    uint first = triangle * TRIANGLE_TEXELS;
    uvec4 texel_a = FETCH(triangles, first);
    uvec4 texel_b = FETCH(triangles, first + 1u);
    uvec4 texel_c = FETCH(triangles, first + 2u);
    vec3 a = rotate_axes(uintBitsToFloat(texel_a.xyz) - ray.origin, ray.largest_axis);
    vec3 b = rotate_axes(uintBitsToFloat(texel_b.xyz) - ray.origin, ray.largest_axis);
    vec3 c = rotate_axes(uintBitsToFloat(texel_c.xyz) - ray.origin, ray.largest_axis);

    precise vec2 pa = a.xy - ray.shear.xy * a.z;
    precise vec2 pb = b.xy - ray.shear.xy * b.z;
    precise vec2 pc = c.xy - ray.shear.xy * c.z;
    precise float u = pc.x * pb.y - pc.y * pb.x;
    precise float v = pa.x * pc.y - pa.y * pc.x;
    precise float w = pb.x * pa.y - pb.y * pa.x;
    bool inside = min(u, min(v, w)) >= 0.0 || max(u, max(v, w)) <= 0.0;

    float det = u + v + w;
    precise float t = (u * a.z + v * b.z + w * c.z) * ray.shear.z / det;
#ifndef PLAIN
    if (MOLLER_TRUMBORE) {
        vec3 direction = vec3(ray.shear.xy, 1.0) / ray.shear.z;
        vec3 uvw;
        moller_trumbore(Ray(vec3(0.0), direction), a, b, c, uvw, det, t);
        u = uvw.x;
        v = uvw.y;
        w = uvw.z;
        inside = min(u, min(v, w)) >= 0.0;
    }
#endif
    // det and 1/z have the same sign when the ray meets the front face.
    bool culled = culls && (texel_b.w & TRIANGLE_SINGLE_SIDED) != 0u && (det < 0.0) != (ray.shear.z < 0.0);
    bool comes_first = INSTANCES && instance != hit.instance ? instance < hit.instance : texel_a.w < hit.primitive;
    bool is_first = texel_c.w != hit.precedence ? texel_c.w < hit.precedence : comes_first;
    bool nearer = t < hit.t || (t == hit.t && is_first);
    if (inside && det != 0.0 && t > 0.0 && nearer && !culled) {
        hit = Hit(t, triangle, texel_a.w, vec2(v, w) / det, instance, texel_c.w);
        return true;
    }
    return false;
}
