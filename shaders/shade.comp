#version 460
#include "shared/kernel.glsl"
#include "shared/queue.glsl"
#include "shared/surface.glsl"
#include "shared/light.glsl"

/// Light that reaches the surface from one light and leaves towards the viewer, if nothing is in between.
void queue_shadow_ray(HitItem item, Surface surface, Material material, Light light) {
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
    vec3 added = item.throughput * light_sample.irradiance * reflected;
    if (max(added.r, max(added.g, added.b)) <= 0.0)
        return;
    vec3 origin = leave_surface(surface, light_sample.direction);
    shadow_queue[queue_append(QUEUE_SHADOW)] =
        ShadowItem(item.sample_index, origin, light_sample.direction, light_sample.distance, added);
}

/// The mirror's part: r = 2(n·v)n − v, with v against the ray.
void queue_reflection_ray(HitItem item, Surface surface, Material material) {
    vec3 throughput = item.throughput * (material.mirror + material.mirror_tinted * surface.tint);
    if (max(throughput.r, max(throughput.g, throughput.b)) <= 0.0)
        return;
    vec3 direction = normalize(reflect(item.direction, surface.normal));
    reflection_queue[queue_append(QUEUE_REFLECTION)] =
        ReflectionItem(item.sample_index, leave_surface(surface, direction), direction, throughput);
}

/// One thread a hit: ambient and emission at once; a light → shadow queue; the mirror → reflection queue. With several
/// lights the pass runs once for each, so that a sample never has two shadow items; the first run does the rest too.
void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= queue_items(QUEUE_HIT))
        return;
    HitItem item = hit_queue[index];
    Surface surface = surface_at(item);
    Material material = materials[surface.material];
    if (step_now.first_light != 0u) {
        add_radiance(item.sample_index, item.throughput * (material.ambient_tinted * surface.tint + material.emission));
        if (REFLECTIONS && step_now.reflect != 0u)
            queue_reflection_ray(item, surface, material);
    }
    if (SHADOWS)
        queue_shadow_ray(item, surface, material, lights[step_now.light]);
}
