// Sample positions: independent, stratified (correlated multi-jittered sampling; Kensler, Pixar TM 13-01, 2013), or Sobol's
// sequence with Owen's scrambling; with PCG hashes (Jarzynski and Olano, JCGT 9(3) 2020). Integers only, so the reference renderer finds the
// very same positions.

uint pcg(uint value) {
    uint state = value * 747796405u + 2891336453u;
    uint word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

/// [0, 1) with 24 bits.
float unit_float(uint bits) {
    return float(bits >> 8u) * (1.0 / 16777216.0);
}

/// A permutation of 0 … count−1 that seed selects, evaluated at index: a bijection on the next power of two (odd
/// multiplications and xor-shifts, both invertible), walked along its cycle until it lands inside (Black and Rogaway 2002).
uint permute(uint index, uint count, uint seed) {
    uint mask = count - 1u;
    mask |= mask >> 1u;
    mask |= mask >> 2u;
    mask |= mask >> 4u;
    mask |= mask >> 8u;
    mask |= mask >> 16u;
    do {
        index = (index + seed) & mask;
        index = (index * (seed | 1u)) & mask;
        index ^= index >> 3u;
        index = (index * 0x9e3779b1u) & mask;
        index ^= index >> 5u;
        index = (index * (pcg(seed) | 1u)) & mask;
        index ^= index >> 2u;
    } while (index >= count);
    return index;
}

/// Correlated multi-jittered. Every one of the strata_x × strata_y cells, every one of the samples columns and every one of the
/// samples rows holds exactly one sample.
vec2 stratified_position(uint seed, uint index) {
    uint m = frame.strata_x;
    uint n = frame.strata_y;
    uint s = permute(index, frame.samples, seed);
    uint cell_x = s % m;
    uint cell_y = s / m;
    uint sub_x = permute(cell_y, n, pcg(seed + 1u));
    uint sub_y = permute(cell_x, m, pcg(seed + 2u));
    vec2 jitter = vec2(unit_float(pcg(seed ^ pcg(4u * index + 3u))), unit_float(pcg(seed ^ pcg(4u * index + 5u))));
    return vec2((float(cell_x) + (float(sub_x) + jitter.x) / float(n)) / float(m),
                (float(cell_y) + (float(sub_y) + jitter.y) / float(m)) / float(n));
}

/// Owen's scrambling as a hash (Laine and Karras 2011, with the constants of Vegdahl 2021): each bit is flipped as all lower ones say.
uint scramble(uint bits, uint seed) {
    bits ^= bits * 0x3d20adeau;
    bits += seed;
    bits *= (seed >> 16u) | 1u;
    bits ^= bits * 0x05526c56u;
    bits ^= bits * 0x53a22864u;
    return bits;
}

/// The first two dimensions of Sobol's sequence, each scrambled (Burley, JCGT 9(4) 2020). Reversed, the first is the index; the second is
/// the index times Pascal's triangle modulo 2, which five exclusive ors apply.
vec2 sobol_position(uint seed, uint index) {
    uint pascal = index;
    pascal ^= (pascal >> 1u) & 0x55555555u;
    pascal ^= (pascal >> 2u) & 0x33333333u;
    pascal ^= (pascal >> 4u) & 0x0f0f0f0fu;
    pascal ^= (pascal >> 8u) & 0x00ff00ffu;
    pascal ^= (pascal >> 16u) & 0x0000ffffu;
    return vec2(unit_float(bitfieldReverse(scramble(index, pcg(seed + 1u)))),
                unit_float(bitfieldReverse(scramble(pascal, pcg(seed + 2u)))));
}

/// Position of a sample inside its pixel, [0, 1)².
vec2 sample_position(uint pixel, uint index) {
    uint seed = pcg(pixel + pcg(step_now.seed));
    if (INDEPENDENT)
        return vec2(unit_float(pcg(seed + pcg(2u * index))), unit_float(pcg(seed + pcg(2u * index + 1u))));
    if (SOBOL)
        return sobol_position(seed, index);
    return stratified_position(seed, index);
}
