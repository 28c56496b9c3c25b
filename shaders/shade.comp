#version 460
#include "shared/kernel.glsl"
#include "shared/queue.glsl"
#include "shared/texels.glsl"
#include "shared/texture.glsl"
#include "shared/alpha.glsl"
#include "shared/surface.glsl"
#include "shared/material.glsl"
#include "shared/light.glsl"
#include "shared/way.glsl"
#include "shared/next_rays.glsl"

/// A condition of the whole dispatch, made one of this thread: see kernel.glsl.
bool here(bool condition, HitItem item) {
    return all(bvec2(condition, item.sample_index != NO_ITEM));
}

const uint WAITING = QUEUE_HIT;

/// A hit: ambient and emission at once; a light → shadow queue; the mirror, or what lies behind → reflection queue. With several
/// lights the pass runs once for each, so that a sample never has two shadow items; the first run adds what needs no light, the
/// last one makes the ray that goes on, because that changes the throughput. A sample goes on one way only: where light passes a surface, that
/// mirrors the background and nothing else.
void work(uint index, uint place) {
    HitItem item = hit_item(FETCH(hit_items, place * ITEM_TEXELS), FETCH(hit_items, place * ITEM_TEXELS + 1u));
    vec3 factor = vec3(1.0);
    Way way = Way(1.0, 0u);
    bool from_eye = !here(step_now.round != 0u, item);
    if (REFLECTIONS || LAYERS) {
        vec4 left = FETCH_FLOATS(throughputs, item.sample_index);
        factor = mix(left.rgb, factor, bvec3(from_eye));
        // 1 rather than 0, which with a count beside it would be a number that some devices take for 0.
        way = way_of(from_eye ? 1.0 : left.w);
    }
    Surface surface = surface_at(item, way.travelled, from_eye);
    Material material = material_at(surface.material);
    float alpha = 1.0;
    vec3 through = vec3(0.0);
    if (LAYERS && surface.is_see_through) {
        Veil veil = veil_at(surface.place.primitive, surface.word, item.barycentrics);
        alpha = veil.alpha;
        through = seen_through(veil);
    }
    if (TEXTURES)
        apply_maps(surface.material, surface, material);
    vec3 mirror = material.mirror + material.mirror_tinted * surface.tint;
    bool is_behind_seen = LAYERS && max(through.r, max(through.g, through.b)) > 0.0;
    bool may_mirror = REFLECTIONS && (!LAYERS || way.mirrors < frame.max_depth);
    if (TEXTURES)
        way.travelled = from_eye ? distance(surface.position, frame.eye) : way.travelled;
    if (here(step_now.first_light != 0u, item)) {
        vec3 own = material.ambient_tinted * surface.tint + material.emission;
        if (is_behind_seen && may_mirror)
            own += mirror * background(mirrored(item, surface));
        vec4 before = mix(FETCH_FLOATS(radiances, item.sample_index), vec4(0.0), bvec4(from_eye));
        // Of what is still clear the share that the surface covers.
        float covered = !LAYERS ? 1.0 : way.mirrors == 0u ? before.a + (1.0 - before.a) * alpha : before.a;
        radiance[item.sample_index] = vec4(before.rgb + factor * alpha * own, covered);
    }
    if ((REFLECTIONS || LAYERS) && here(step_now.reflect != 0u, item)) {
        if (is_behind_seen)
            queue_ray_behind(item, factor * through, way, surface);
        else if (may_mirror)
            queue_reflection_ray(item, factor * alpha, way, surface, mirror);
    }
    if (SHADOWS)
        queue_shadow_ray(item, factor * alpha, surface, material, light_of(step_now.light));
}

#include "shared/main.glsl"
