// A ray, and the same prepared for the triangle test.

struct Ray {
    vec3 origin;
    vec3 direction;
};

/// What rounding took from a product: a·b = fl(a·b) + rest, exactly (Dekker, Numer. Math. 18, 1971). Not by fma, which
/// software Vulkan does not fuse.
float product_rest(float a, float b, float product) {
    precise float scaled_a = a * 4097.0;
    precise float scaled_b = b * 4097.0;
    precise float high_a = scaled_a - (scaled_a - a);
    precise float high_b = scaled_b - (scaled_b - b);
    precise float low_a = a - high_a;
    precise float low_b = b - high_b;
    precise float rest = ((high_a * high_b - product) + high_a * low_b + low_a * high_b) + low_a * low_b;
    return rest;
}

/// A ray prepared for the triangle test. Axes are rotated so that z is the direction's largest component.
struct ShearedRay {
    vec3 origin;
    /// x/z, y/z and 1/z of the rotated direction.
    vec3 shear;
    /// What rounding took from the first two; for rays that are traced again.
    vec2 shear_rest;
    uint largest_axis;
};

vec3 rotate_axes(vec3 v, uint largest_axis) {
    return largest_axis == 0u ? v.yzx : largest_axis == 1u ? v.zxy : v;
}

ShearedRay shear_ray(Ray ray) {
    vec3 size = abs(ray.direction);
    uint axis = size.x >= size.y ? (size.x >= size.z ? 0u : 2u) : (size.y >= size.z ? 1u : 2u);
    vec3 d = rotate_axes(ray.direction, axis);
    ShearedRay sheared = ShearedRay(ray.origin, vec3(d.x / d.z, d.y / d.z, 1.0 / d.z), vec2(0.0), axis);
    if (RETRACE) {
        precise vec2 back = sheared.shear.xy * d.z;
        vec2 back_rest =
            vec2(product_rest(sheared.shear.x, d.z, back.x), product_rest(sheared.shear.y, d.z, back.y));
        precise vec2 rest = (d.xy - back) - back_rest;
        sheared.shear_rest = rest * sheared.shear.z;
    }
    return sheared;
}
