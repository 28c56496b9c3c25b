// Rays through Embree, default and ROBUST scenes, high quality: how many meet something.
//   embree_robust NAME...      reads NAME.bin (u32 count, nine f32 a triangle) and NAME.rays (eight f32 each)
// Prints: NAME rays hits-default hits-robust
#ifdef E3
#include <embree3/rtcore.h>
#else
#include <embree4/rtcore.h>
#endif
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

static std::vector<float> floats(const std::string& path, size_t skip) {
    FILE* file = std::fopen(path.c_str(), "rb");
    if (!file) {
        std::fprintf(stderr, "cannot read %s\n", path.c_str());
        std::exit(2);
    }
    std::fseek(file, 0, SEEK_END);
    size_t bytes = std::ftell(file) - skip;
    std::fseek(file, skip, SEEK_SET);
    std::vector<float> values(bytes / 4);
    if (std::fread(values.data(), 4, values.size(), file) != values.size()) std::exit(2);
    std::fclose(file);
    return values;
}

static size_t hits(RTCDevice device, const std::vector<float>& corners, const std::vector<float>& rays, bool robust) {
    RTCScene scene = rtcNewScene(device);
    RTCGeometry mesh = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    size_t count = corners.size() / 9;
    void* vertices = rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, 3 * count);
    std::memcpy(vertices, corners.data(), 4 * corners.size());
    auto indices = (uint32_t*)rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, count);
    for (size_t i = 0; i < 3 * count; i++) indices[i] = i;
    rtcCommitGeometry(mesh);
    rtcAttachGeometry(scene, mesh);
    rtcReleaseGeometry(mesh);
    if (robust) rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
    rtcCommitScene(scene);
    size_t found = 0;
    for (size_t i = 0; i < rays.size(); i += 8) {
        RTCRayHit hit{};
        hit.ray.org_x = rays[i], hit.ray.org_y = rays[i + 1], hit.ray.org_z = rays[i + 2];
        hit.ray.dir_x = rays[i + 4], hit.ray.dir_y = rays[i + 5], hit.ray.dir_z = rays[i + 6];
        hit.ray.tnear = 0, hit.ray.tfar = INFINITY, hit.ray.mask = -1;
        hit.hit.geomID = RTC_INVALID_GEOMETRY_ID, hit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
#ifdef E3
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        rtcIntersect1(scene, &context, &hit);
#else
        rtcIntersect1(scene, &hit);
#endif
        found += hit.hit.geomID != RTC_INVALID_GEOMETRY_ID;
    }
    rtcReleaseScene(scene);
    return found;
}

int main(int count, char** names) {
    RTCDevice device = rtcNewDevice("threads=1");
    for (int i = 1; i < count; i++) {
        std::string name = names[i];
        auto corners = floats(name + ".bin", 4), rays = floats(name + ".rays", 0);
        std::printf("%s %zu %zu %zu\n", name.c_str(), rays.size() / 8, hits(device, corners, rays, false),
                    hits(device, corners, rays, true));
    }
    rtcReleaseDevice(device);
}
