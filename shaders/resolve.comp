#version 460
#include "shared/kernel.glsl"
#include "shared/random.glsl"
#include "shared/filter.glsl"
#include "shared/pixel.glsl"

/// One thread a pixel of the band: its samples of this wave are added to the film in their order, whatever the size of
/// the waves, so that the sum is always the same; at the end it becomes the mean. Sums are compensated (Kahan, CACM 8(1) 1965): a million
/// samples lose no more than one. Weights are whole numbers, which lose nothing, and so is alpha as long as nothing is blended.
void main() {
    begin();
    uint pixel = gl_GlobalInvocationID.x;
    // Rays that nobody has traced again: the host runs the wave once more.
    uint left = counters[COUNTER_FILLING + COUNTER_LINE * QUEUE_PRIMARY_AGAIN] |
                counters[COUNTER_FILLING + COUNTER_LINE * QUEUE_SHADOW_AGAIN] |
                counters[COUNTER_FILLING + COUNTER_LINE * QUEUE_REFLECTION_AGAIN];
    bool is_incomplete = (left | counters[COUNTER_LOST] | counters[COUNTER_CUT]) != 0u;
    if (pixel >= step_now.pixels || is_incomplete)
        return;
    uvec2 place = pixel_place(step_now.first_pixel + pixel);
    if (place.x >= frame.width || place.y >= frame.height)
        return;
    if (!MULTISAMPLING) {
        film[pixel] = FETCH_FLOATS(radiances, pixel);
        return;
    }
    bvec4 fresh = bvec4(step_now.first_sample == step_now.start);
    vec4 sum = mix(FETCH_FLOATS(film_so_far, pixel), vec4(0.0), fresh);
    uint rest_texel = pixel * (LAYERS ? 2u : 1u);
    vec4 rest_and_weights = mix(FETCH_FLOATS(film_rest_so_far, rest_texel), vec4(0.0), fresh);
    float rest_of_alpha = LAYERS ? mix(FETCH_FLOATS(film_rest_so_far, rest_texel + 1u).x, 0.0, fresh.x) : 0.0;
    vec4 rest = vec4(rest_and_weights.rgb, rest_of_alpha);
    float weights = rest_and_weights.w;
    // A bound of this thread, not of the dispatch: see kernel.glsl.
    uint samples = min(step_now.samples, ~pixel);
    for (uint i = 0u; i < samples; i++) {
        vec4 value = FETCH_FLOATS(radiances, pixel * step_now.samples + i);
        float weight = 1.0;
        if (FILTER) {
            vec2 even = sample_position(place.y * frame.width + place.x, step_now.first_sample + i);
            weight = frame.samples > 1u ? sample_weight(filtered(even)) : 1.0;
        }
        value *= weight;
        weights += weight;
        precise vec4 lost = PLAIN_SUMS ? vec4(0.0) : rest;
        precise vec4 added = value - lost;
        precise vec4 grown = sum + added;
        precise vec4 gained = grown - sum;
        rest = gained - added;
        sum = grown;
    }
    // Few samples of a filter with negative parts may cancel out: then the expected sum of weights stands for the true one.
    float count = float(step_now.first_sample - step_now.start + step_now.samples);
    float divisor = weights > 0.5 * count * frame.filter_mean ? weights : count * frame.filter_mean;
    film[pixel] = sum / (step_now.finish != 0u ? divisor : 1.0);
    film_rest[rest_texel] = vec4(rest.rgb, weights);
    if (LAYERS)
        film_rest[rest_texel + 1u] = vec4(rest.a);
}
