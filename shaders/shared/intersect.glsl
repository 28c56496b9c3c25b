// Ray against triangle, watertight: Woop, Benthin and Wald, JCGT 2(1) 2013. The world is sheared so that the ray runs
// along z from the origin; then three 2D edge functions decide. Two triangles evaluate a shared edge by the same products,
// exactly negated (`precise` forbids contraction), and 0 counts as inside: no ray slips between them. Rounding is monotone, so the
// difference of two rounded products never has the wrong sign: it is 0 where f32 cannot tell, and then both triangles are hit.
// What is inside is thus certain, what is made of it is not: on slivers so thin that little is left of the products there is nothing
// sensible to divide by, and where rounding could move a hit from before the ray's start to behind it, or back, the ray would meet
// the very thing that it leaves. Such rays are traced again with numbers of two floats each.

#include "ray.glsl"
#include "exact.glsl"

/// What is left of the products of edge functions, as a share, below which barycentric coordinates have fewer than six bits.
const float LITTLE_LEFT = 7.6e-6;
/// Rounding error of the volume between a ray's start and a thin triangle, as a share of the products it is made of: of a million random
/// ones 999 in 1000 stay below it, half below 7e-9.
const float VOLUME_ERROR = 2.0e-7;

/// The triangle of a ray that hits none.
const uint NO_TRIANGLE = 0xffffffffu;

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
    /// Whether its back is hit, then what it looks like, as a number: decides before both, so that the order of the file never shows, and
    /// of a thing as thin as paper the side that faces the ray is seen.
    uint precedence;
    /// What is left of light that came through surfaces that are not opaque; for rays that any hit will do.
    vec3 passed;
};

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

/// Twice the area of the triangle from the origin to p and q; 0 where its sign is not certain. Adds to `size` how large it might
/// have been.
float edge_function(vec2 p, vec2 q, inout float size) {
    precise float first = p.x * q.y;
    precise float second = p.y * q.x;
    precise float area = first - second;
    size += abs(first);
    return area;
}

/// Whether none is negative or none positive. By comparisons: the smaller of two floats takes software Vulkan three instructions, for the sake of
/// NaN.
bool have_one_sign(float u, float v, float w) {
    return all(greaterThanEqual(vec3(u, v, w), vec3(0.0))) || all(lessThanEqual(vec3(u, v, w), vec3(0.0)));
}

/// Less than this part of light is none.
const float NO_LIGHT = 1.0 / 4096.0;

/// Whether a ray ends at a triangle that is not opaque. Light is weakened where it does not.
bool is_met(uint primitive, uint word, vec2 barycentrics, bool any, inout Hit hit) {
    Veil veil = veil_at(primitive, word, barycentrics);
    if (!any)
        return veil.alpha > 0.0;
    hit.passed *= light_through(veil);
    return max(hit.passed.r, max(hit.passed.g, hit.passed.b)) < NO_LIGHT;
}

/// Takes the triangle, whose texels begin at `first`, as the new hit if it is nearer than the old one. Where `any` hit will do,
/// backs count too, and of the hit only the triangle is kept. A ray for which that cannot be decided is `uncertain`.
bool intersect_triangle(ShearedRay ray, uint triangle, uint first, uint instance, bool any, inout Hit hit,
                        inout bool uncertain) {
    uvec4 texel_a = FETCH(triangles, first);
    uvec4 texel_b = FETCH(triangles, first + 1u);
    uvec4 texel_c = FETCH(triangles, first + 2u);
    vec3 a = rotate_axes(uintBitsToFloat(texel_a.xyz) - ray.origin, ray.largest_axis);
    vec3 b = rotate_axes(uintBitsToFloat(texel_b.xyz) - ray.origin, ray.largest_axis);
    vec3 c = rotate_axes(uintBitsToFloat(texel_c.xyz) - ray.origin, ray.largest_axis);

    precise vec2 pa = a.xy - ray.shear.xy * a.z;
    precise vec2 pb = b.xy - ray.shear.xy * b.z;
    precise vec2 pc = c.xy - ray.shear.xy * c.z;
    float size = 0.0;
    float u = edge_function(pc, pb, size);
    float v = edge_function(pa, pc, size);
    float w = edge_function(pb, pa, size);
    bool inside = have_one_sign(u, v, w);
    float det = u + v + w;
    precise float volume = u * a.z + v * b.z + w * c.z;
    bool is_thin = THIN_TRIANGLES && (texel_c.w & PRECEDENCE_THIN) != 0u;
    // As integers, which not negative floats are ordered like.
    ivec3 depths = floatBitsToInt(abs(vec3(a.z, b.z, c.z)));
    float reach = intBitsToFloat(max(depths.x, max(depths.y, depths.z)));
    bool is_uncertain =
        inside && (abs(det) <= size * LITTLE_LEFT || (is_thin && abs(volume) <= size * reach * VOLUME_ERROR));
    if (RETRACE && is_uncertain) {
        ExactCorner exact_a = shear_exactly(ray, texel_a, a);
        ExactCorner exact_b = shear_exactly(ray, texel_b, b);
        ExactCorner exact_c = shear_exactly(ray, texel_c, c);
        vec2 both_u = exact_edge_function(exact_c, exact_b);
        vec2 both_v = exact_edge_function(exact_a, exact_c);
        vec2 both_w = exact_edge_function(exact_b, exact_a);
        vec2 both = both_u + both_v + both_w;
        // Nothing that is left of a triangle when corners are rounded covers nothing.
        inside = both.x != 0.0 && have_one_sign(both_u.x, both_v.x, both_w.x);
        det = both.y;
        volume = both_u.y * a.z + both_v.y * b.z + both_w.y * c.z;
        // Beside the triangle, by less than corners are rounded, means its edge.
        vec3 weights = max(vec3(both_u.y, both_v.y, both_w.y) * sign(det), 0.0);
        weights *= det / max(weights.x + weights.y + weights.z, 1e-37);
        u = weights.x;
        v = weights.y;
        w = weights.z;
    }
    if (!RETRACE) {
        uncertain = uncertain || is_uncertain;
        inside = inside && !is_uncertain;
    }

    precise float t = volume * ray.shear.z / det;
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
    bool is_back = (det < 0.0) != (ray.shear.z < 0.0);
    bool culled = SINGLE_SIDED && !any && (texel_b.w & TRIANGLE_SINGLE_SIDED) != 0u && is_back;
    bool comes_first = INSTANCES && instance != hit.instance ? instance < hit.instance : texel_a.w < hit.primitive;
    uint precedence = texel_c.w | (is_back ? PRECEDENCE_BACK : 0u);
    bool is_first = precedence < hit.precedence || (precedence == hit.precedence && comes_first);
    // What is not hit is behind the ray. Where det is 0 no distance is nearer: it is infinite or NaN.
    t = inside ? t : -1.0;
    bool nearer = any ? t <= hit.t : t < hit.t || (t == hit.t && is_first);
    if (t > 0.0 && nearer && !culled) {
        vec2 barycentrics = vec2(v, w) / det;
        if (ALPHA && (texel_b.w & TRIANGLE_SEE_THROUGH) != 0u && !is_met(texel_a.w, texel_b.w, barycentrics, any, hit))
            return false;
        if (any)
            hit.triangle = triangle;
        else
            hit = Hit(t, triangle, texel_a.w, barycentrics, INSTANCES ? instance : hit.instance, precedence, hit.passed);
        return true;
    }
    return false;
}
