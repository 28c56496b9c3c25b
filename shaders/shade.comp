#version 460
#include "shared/kernel.glsl"
#include "shared/queue.glsl"
#include "shared/texels.glsl"
#include "shared/surface.glsl"
#include "shared/light.glsl"

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
    shadow_radiance[item.sample_index].rgb = added;
    shadow_queue[queue_append(QUEUE_SHADOW)] =
        RayItem(origin, item.sample_index, light_sample.direction, light_sample.distance);
}

/// The mirror's part: r = 2(n·v)n − v, with v against the ray.
void queue_reflection_ray(HitItem item, vec3 factor, Surface surface, Material material) {
    factor *= material.mirror + material.mirror_tinted * surface.tint;
    if (max(factor.r, max(factor.g, factor.b)) <= 0.0)
        return;
    vec3 direction = normalize(reflect(item.direction, surface.normal));
    throughput[item.sample_index].rgb = factor;
    reflection_queue[queue_append(QUEUE_REFLECTION)] =
        RayItem(leave_surface(surface, direction), item.sample_index, direction, FAR);
}

/// A condition of the whole dispatch, made one of this thread: see kernel.glsl.
bool here(bool condition, HitItem item) {
    return all(bvec2(condition, item.sample_index != NO_ITEM));
}

/// One thread a hit: ambient and emission at once; a light → shadow queue; the mirror → reflection queue. With several
/// lights the pass runs once for each, so that a sample never has two shadow items; the first run adds what needs no light, the
/// last one reflects, because that changes the throughput.
void main() {
    uint index = queue_item(interleaved_thread(), QUEUE_HIT);
    if (index == NO_ITEM)
        return;
    HitItem item = hit_item(FETCH(hit_items, index * ITEM_TEXELS), FETCH(hit_items, index * ITEM_TEXELS + 1u));
    vec3 factor = vec3(1.0);
    if (REFLECTIONS)
        factor = mix(factor, FETCH_FLOATS(throughputs, item.sample_index).rgb, bvec3(step_now.reflected != 0u));
    Surface surface = surface_at(item);
    Material material = material_at(surface.material);
    if (here(step_now.first_light != 0u, item))
        add_radiance(item.sample_index, factor * (material.ambient_tinted * surface.tint + material.emission));
    if (REFLECTIONS && here(step_now.reflect != 0u, item))
        queue_reflection_ray(item, factor, surface, material);
    if (SHADOWS)
        queue_shadow_ray(item, factor, surface, material, light_of(step_now.light));
}
