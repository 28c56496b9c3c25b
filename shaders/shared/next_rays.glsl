// Rays that leave a hit: to a light, mirrored, or straight on behind the surface.

/// Light that reaches the surface from one light and leaves towards the viewer, if nothing is in between.
void queue_shadow_ray(HitItem item, vec3 factor, Surface surface, Material material, Light light) {
    LightSample light_sample = light_at(light, surface.position);
    float cosine = dot(surface.normal, light_sample.direction);
    if (cosine <= 0.0)
        return;
    vec3 reflected = material.diffuse_tinted * surface.tint * cosine;
    if (SPECULAR) {
        vec3 halfway = normalize(light_sample.direction - item.direction);
        vec3 specular = material.specular + material.specular_tinted * surface.tint;
        reflected += specular * pow(max(dot(surface.normal, halfway), 0.0), material.shininess);
    }
    vec3 added = factor * light_sample.irradiance * reflected;
    if (max(added.r, max(added.g, added.b)) <= 0.0)
        return;
    vec3 origin = leave_towards_light(surface);
    shadow_radiance[item.sample_index] = vec4(added, 0.0);
    append_shadow_ray(RayItem(origin, item.sample_index, light_sample.direction, light_sample.distance));
}

/// The mirror's direction: r = 2(n·v)n − v, with v against the ray. Where a bent normal sends it into the surface, it is mirrored out again.
vec3 mirrored(HitItem item, Surface surface) {
    vec3 direction = reflect(item.direction, surface.normal);
    if (NORMAL_MAPS && surface.is_bent)
        direction -= 2.0 * min(dot(direction, surface.geometric_normal), 0.0) * surface.geometric_normal;
    return normalize(direction);
}

/// The mirror's part.
void queue_reflection_ray(HitItem item, vec3 factor, Way way, Surface surface, vec3 mirror) {
    factor *= mirror;
    if (max(factor.r, max(factor.g, factor.b)) <= 0.0)
        return;
    vec3 direction = mirrored(item, surface);
    throughput[item.sample_index] = vec4(factor, word_of(Way(way.travelled, way.mirrors + 1u)));
    append_reflection_ray(RayItem(leave_surface(surface, direction), item.sample_index, direction, FAR));
}

/// What lies behind a surface that is not opaque.
void queue_ray_behind(HitItem item, vec3 factor, Way way, Surface surface) {
    if (step_now.round - way.mirrors < MAX_LAYERS) {
        throughput[item.sample_index] = vec4(factor, word_of(way));
        append_reflection_ray(RayItem(leave_surface(surface, item.direction), item.sample_index, item.direction, FAR));
    } else {
        add_radiance(item.sample_index, factor * background(item.direction));
    }
}
