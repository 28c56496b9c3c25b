// What a pixel sample's way has been so far, in one word beside its throughput: the upper half of its length as a float, which is enough to choose
// levels of textures, and how often it was mirrored.

struct Way {
    /// From the eye.
    float travelled;
    uint mirrors;
};

Way way_of(float word) {
    uint bits = floatBitsToUint(word);
    return Way(uintBitsToFloat(bits & 0xffff0000u), bits & 0xffffu);
}

float word_of(Way way) {
    return uintBitsToFloat((floatBitsToUint(way.travelled) + 0x8000u & 0xffff0000u) | way.mirrors);
}
