// The tree and the walk through it: a binary tree of quantised boxes, walked while-while (Aila and Laine, HPG 2009), the
// nearer child first. The stack is a shift register: ten variables that move up and down, touched with constant indices
// only, because an indexed array costs software Vulkan eight scalar branches a push. When a live entry falls off its end,
// the ray goes to the retrace queue, where a variant of the same kernel walks again with an array as deep as the tree can be:
// rare, and no ray is ever lost.

const int NOTHING = int(0x80000000); // no node: the stack is empty
const int REGISTERS = int(STACK_REGISTERS);
/// A node that no tree has. Every loop here also ends at it, see check_complete.
const int IMPOSSIBLE = 0x7fffffff;

/// The ray in grid coordinates, where a child's u16 box is compared without decoding it.
struct GridRay {
    vec3 origin;
    vec3 inverse;
};

GridRay grid_ray(Ray ray) {
    // A zero component would make 0 · ∞ = NaN and drop a box; 1e-20 stays finite on any grid.
    vec3 direction = mix(ray.direction, vec3(1e-20), lessThan(abs(ray.direction), vec3(1e-20)));
    return GridRay((ray.origin - frame.grid_origin) * frame.grid_scale, 1.0 / (direction * frame.grid_scale));
}

/// Slab test against a child's box. Distances are compared as integers, which orders them like floats because entry ≥ 0.
bool enters(GridRay ray, uvec4 child, float t_max, out float entry) {
    vec3 lo = vec3(child.x & 0xffffu, child.x >> 16u, child.y & 0xffffu);
    vec3 hi = vec3(child.y >> 16u, child.z & 0xffffu, child.z >> 16u);
    ivec3 t_lo = floatBitsToInt((lo - ray.origin) * ray.inverse);
    ivec3 t_hi = floatBitsToInt((hi - ray.origin) * ray.inverse);
    ivec3 near = min(t_lo, t_hi);
    ivec3 far = max(t_lo, t_hi);
    int first = max(max(near.x, near.y), max(near.z, 0));
    int last = min(min(far.x, far.y), min(far.z, floatBitsToInt(t_max)));
    entry = intBitsToFloat(first);
    return first <= last;
}

/// What a node's two children mean for the walk.
struct Visit {
    bool both;
    bool none;
    int nearer;
    int farther;
};

/// The nearer of two that are entered comes first, unless any hit will do.
Visit visit(GridRay ray, int node, float t_max, bool any) {
    uvec4 child_0 = FETCH(nodes, uint(node) * NODE_TEXELS);
    uvec4 child_1 = FETCH(nodes, uint(node) * NODE_TEXELS + 1u);
    float entry_0;
    float entry_1;
    bool enters_0 = enters(ray, child_0, t_max, entry_0);
    bool enters_1 = enters(ray, child_1, t_max, entry_1);
    bool swapped = any ? !enters_0 : enters_1 && (!enters_0 || entry_1 < entry_0);
    return Visit(enters_0 && enters_1, !(enters_0 || enters_1),
                 int(swapped ? child_1.w : child_0.w), int(swapped ? child_0.w : child_1.w));
}

/// Tests the triangles of a leaf. A leaf's reference is ~(first · 16 + count).
bool visit_leaf(ShearedRay ray, int leaf, bool culls, inout bool cut, inout Hit hit) {
    uint reference = uint(~leaf);
    uint triangle = reference >> 4u;
    uint end = triangle + (reference & 15u);
    bool found = false;
    while (triangle < end && triangle != uint(IMPOSSIBLE)) {
        found = intersect_triangle(ray, triangle, culls, hit) || found;
        triangle++;
    }
    cut = cut || triangle < end;
    return found;
}

/// Counts a ray whose walk was cut short. The host turns a count above zero into an error: a wrong picture is never written.
///
/// Mesa 22.3 silently ends every loop when one invocation, or another in its subgroup, has made 65 535 rounds, nested loops
/// added up. So every loop here has a second way out, which is never taken: only then does the compiler not take for granted
/// that a loop ended as it should, and what is left to do behind the loop tells whether it was cut short.
void check_complete(int node, bool cut) {
    if (node != NOTHING || cut)
        atomicAdd(counters[COUNTER_LOST], 1u);
}

/// The walk with an array for a stack, as deep as any tree.
void traverse_deep(GridRay grid, ShearedRay ray, bool any, inout Hit hit) {
    bool cut = false;
    int stack[MAX_TREE_DEPTH];
    int height = 0;
    int node = 0;
    while (node != NOTHING && node != IMPOSSIBLE) {
        bool found = false;
        if (node >= 0) {
            Visit next = visit(grid, node, hit.t, any);
            if (next.both)
                stack[height++] = next.farther;
            node = next.nearer;
            if (!next.none)
                continue;
        } else {
            found = visit_leaf(ray, node, SINGLE_SIDED && !any, cut, hit);
        }
        node = height > 0 && !(any && found) ? stack[--height] : NOTHING;
    }
    check_complete(node, cut);
}

/// The walk with registers for a stack; false if it overflowed and is worth nothing.
bool traverse_shallow(GridRay grid, ShearedRay ray, bool any, inout Hit hit) {
    bool cut = false;
    int stack[REGISTERS];
    [[unroll]] for (int i = 0; i < REGISTERS; i++)
        stack[i] = NOTHING;
    int overflow = 0;
    int node = 0;
    while (node != NOTHING) {
        // An inner node, and not IMPOSSIBLE.
        while (uint(node) < uint(IMPOSSIBLE)) {
            Visit next = visit(grid, node, hit.t, any);
            node = next.none ? stack[0] : next.nearer;
            if (DEEP_TREE)
                overflow |= next.both ? stack[REGISTERS - 1] ^ NOTHING : 0;
            if (next.both) {
                [[unroll]] for (int i = REGISTERS - 1; i > 0; i--)
                    stack[i] = stack[i - 1];
                stack[0] = next.farther;
            }
            if (next.none) {
                [[unroll]] for (int i = 0; i < REGISTERS - 1; i++)
                    stack[i] = stack[i + 1];
                stack[REGISTERS - 1] = NOTHING;
            }
        }
        if (node >= 0 || node == NOTHING)
            break;
        bool found = visit_leaf(ray, node, SINGLE_SIDED && !any, cut, hit);
        node = stack[0];
        [[unroll]] for (int i = 0; i < REGISTERS - 1; i++)
            stack[i] = stack[i + 1];
        stack[REGISTERS - 1] = NOTHING;
        if (any && found) {
            node = NOTHING;
            overflow = 0;
        }
    }
    check_complete(node, cut);
    return overflow == 0;
}

/// Finds the nearest hit, or with `any` some hit, closer than hit.t; a miss leaves hit as it was. False: the ray must be traced
/// again by a kernel with RETRACE, its answer is worth nothing.
bool traverse(Ray world_ray, bool any, inout Hit hit) {
    GridRay grid = grid_ray(world_ray);
    ShearedRay ray = shear_ray(world_ray);
    if (RETRACE) {
        traverse_deep(grid, ray, any, hit);
        return true;
    }
    return traverse_shallow(grid, ray, any, hit);
}

/// No hit yet, and none wanted beyond `distance`.
Hit no_hit(float distance) {
    return Hit(distance, NO_TRIANGLE, NO_TRIANGLE, vec2(0.0));
}
