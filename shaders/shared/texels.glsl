// Structs of the contract from the texels they lie in, member by member in their order.

/// A ray from its queue.
RayItem ray_item(uvec4 first, uvec4 second) {
    return RayItem(uintBitsToFloat(first.xyz), first.w, uintBitsToFloat(second.xyz), uintBitsToFloat(second.w));
}

/// A hit from its queue.
HitItem hit_item(uvec4 first, uvec4 second) {
    return HitItem(first.x, first.y, uintBitsToFloat(first.zw), uintBitsToFloat(second.xyz), second.w);
}

Material material_at(uint index) {
    uint first = index * MATERIAL_TEXELS;
    vec4 a = FETCH_FLOATS(materials, first);
    vec4 b = FETCH_FLOATS(materials, first + 1u);
    vec4 c = FETCH_FLOATS(materials, first + 2u);
    vec4 d = FETCH_FLOATS(materials, first + 3u);
    vec4 e = FETCH_FLOATS(materials, first + 4u);
    vec4 f = FETCH_FLOATS(materials, first + 5u);
    return Material(a.xyz, a.w, b.xyz, vec3(b.w, c.xy), vec3(c.zw, d.x), d.yzw, e.xyz, vec3(e.w, f.xy), f.zw);
}

Look look_at(uint index) {
    uint first = index * MATERIAL_TEXELS + LOOK_TEXEL;
    vec4 a = FETCH_FLOATS(materials, first);
    vec4 b = FETCH_FLOATS(materials, first + 1u);
    vec4 c = FETCH_FLOATS(materials, first + 2u);
    uvec4 d = FETCH(materials, first + 3u);
    uvec4 e = FETCH(materials, first + 4u);
    uvec4 f = FETCH(materials, first + 5u);
    vec4 g = FETCH_FLOATS(materials, first + 6u);
    return Look(a.xyz, a.w, b.x, b.y, b.z, b.w, c.xyz, c.w, d.x, d.y, d.z, d.w, e.x, e.y, e.z, e.w,
                uintBitsToFloat(f.x), f.y, f.z, f.w, g.xyz, floatBitsToUint(g.w));
}

Light light_of(uint index) {
    uint first = index * LIGHT_TEXELS;
    vec4 a = FETCH_FLOATS(lights, first);
    vec4 b = FETCH_FLOATS(lights, first + 1u);
    vec4 c = FETCH_FLOATS(lights, first + 2u);
    vec4 d = FETCH_FLOATS(lights, first + 3u);
    return Light(a.xyz, floatBitsToUint(a.w), b.xyz, b.w, c.xyz, c.w, d.x, d.yzw);
}
