// Pixel filters by importance sampling (Ernst, Stamminger and Greiner, RT 2006): positions are spread as dense as the filter is high, so
// that each sample counts the same and pixels do not need their neighbours' samples. Where a filter is negative, the sample is
// subtracted.

/// One coordinate, relative to the pixel's corner.
float filtered(float position) {
    float place = position * float(FILTER_STEPS);
    uint cell = min(uint(place), FILTER_STEPS - 1u);
    vec2 ends = FETCH_FLOATS(filter_steps, cell).xy;
    return 0.5 + mix(ends.x, ends.y, place - float(cell));
}

/// Where the filter puts a position that was even over the pixel.
vec2 filtered(vec2 position) {
    return vec2(filtered(position.x), filtered(position.y));
}

/// 1, or −1 where the filter is negative.
float sample_weight(vec2 inside) {
    bvec2 negative = greaterThan(abs(inside - 0.5), vec2(frame.filter_zero));
    return negative.x != negative.y ? -1.0 : 1.0;
}
