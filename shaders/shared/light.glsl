// A light as a point sees it.

struct LightSample {
    /// Unit direction to the light.
    vec3 direction;
    float distance;
    /// Irradiance on a surface that faces the light.
    vec3 irradiance;
};

LightSample light_at(Light light, vec3 position) {
    if (light.kind == LIGHT_DIRECTIONAL)
        return LightSample(-light.direction, FAR, light.intensity);
    vec3 offset = light.position - position;
    float distance = length(offset);
    vec3 direction = offset / distance;
    // KHR_lights_punctual: inverse square, windowed to reach 0 at the range.
    float ratio = distance / light.range;
    float square = ratio * ratio;
    float falloff = clamp(1.0 - square * square, 0.0, 1.0) / (distance * distance);
    if (light.kind == LIGHT_SPOT) {
        float cone = clamp(dot(-direction, light.direction) * light.spot_scale + light.spot_offset, 0.0, 1.0);
        falloff *= cone * cone;
    }
    return LightSample(direction, distance, light.intensity * falloff);
}

vec3 background(vec3 direction) {
    return frame.nadir + (frame.zenith - frame.nadir) * (0.5 + 0.5 * dot(direction, frame.sky));
}
