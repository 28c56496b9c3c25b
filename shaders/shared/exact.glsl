// Edge functions in two floats each, high and rest: for rays that are traced again because f32 could not tell what they hit.

/// A corner as the ray sees it, sheared: x and y of two floats each.
struct ExactCorner {
    vec2 at;
    vec2 rest;
};

/// `corner` is fl(vertex - origin), rotated.
ExactCorner shear_exactly(ShearedRay ray, uvec4 texel, vec3 corner) {
    vec3 vertex = rotate_axes(uintBitsToFloat(texel.xyz), ray.largest_axis);
    vec3 origin = rotate_axes(ray.origin, ray.largest_axis);
    // What rounding took from the two subtractions (Knuth, TAOCP 2, 4.2.2).
    precise vec3 moved = corner - vertex;
    precise vec3 corner_rest = (vertex - (corner - moved)) - (origin + moved);
    precise vec2 shift = ray.shear.xy * corner.z;
    precise vec2 at = corner.xy - shift;
    precise vec2 shifted = at - corner.xy;
    precise vec2 at_rest = (corner.xy - (at - shifted)) - (shift + shifted);
    vec2 shift_rest =
        vec2(product_rest(ray.shear.x, corner.z, shift.x), product_rest(ray.shear.y, corner.z, shift.y));
    precise vec2 low_products = ray.shear.xy * corner_rest.z + ray.shear_rest * corner.z;
    precise vec2 rest = at_rest + (corner_rest.xy - (shift_rest + low_products));
    return ExactCorner(at, rest);
}

/// Twice the area of the triangle from the origin to p and q, twice: as the rounded corners have it, which decides what is inside,
/// since a neighbour that needs no more than f32 has the same corners; and as the corners have it with their rests.
vec2 exact_edge_function(ExactCorner p, ExactCorner q) {
    precise float first = p.at.x * q.at.y;
    precise float second = p.at.y * q.at.x;
    float lost = product_rest(p.at.x, q.at.y, first) - product_rest(p.at.y, q.at.x, second);
    precise float rounded = (first - second) + lost;
    precise float first_rest = p.at.x * q.rest.y + p.rest.x * q.at.y;
    precise float second_rest = p.at.y * q.rest.x + p.rest.y * q.at.x;
    precise float exact = rounded + (first_rest - second_rest);
    return vec2(rounded, exact);
}
