// The tree and the walk through it: nodes of four quantised boxes, walked while-while (Aila and Laine, HPG 2009), the
// nearest child first. What waits on the stack are groups: all of a node's children that are still to be visited are one entry (as in Ylitie,
// Karras and Laine, HPG 2017). The stack is a shift register: a few variables that move up and down, touched with constant indices
// only, because an indexed array costs software Vulkan eight scalar branches a push. When a live entry falls off its end,
// the ray goes to the retrace queue, where a variant of the same kernel walks again with an array as deep as the tree can be:
// rare, and no ray is ever lost. The same happens to a ray that f32 cannot tell whether it hits, and to a walk that the driver
// cut short; if that is still too long, it is done again subtree by subtree.
//
// Loops end at their bottom, do … while: Mesa 22.3 runs a loop's body before it asks whether any ray still needs it, so that
// one that ends at its top makes a round for nothing.

/// No node: the stack is empty.
const int NOTHING = int(0x80000000);
/// In place of a node: back from an instance to the world.
const int LEAVE = int(0x80000001);
const int REGISTERS = int(STACK_REGISTERS);
/// A node that no tree has. Every loop here also ends at it, see is_complete.
const int IMPOSSIBLE = 0x7fffffff;

/// The ray as boxes need it: see src/bvh/quantise.rs.
struct GridRay {
    /// In parts of a quantum, from the middle of the grid.
    vec3 origin;
    /// Along the ray, for such a part.
    vec3 inverse;
    /// Along the ray, for the unit that boxes reach to either side in; not negative.
    vec3 reach_inverse;
};

GridRay grid_ray(Ray ray, vec3 grid_origin, vec3 grid_scale) {
    // A zero component would make 0 · ∞ = NaN and drop a box; 1e-20 stays finite on any grid.
    vec3 direction = mix(ray.direction, vec3(1e-20), lessThan(abs(ray.direction), vec3(1e-20)));
    vec3 inverse = (1.0 / GRID_PARTS) / (direction * grid_scale);
    return GridRay(((ray.origin - grid_origin) * grid_scale - GRID_MIDDLE) * GRID_PARTS, inverse,
                   abs(inverse) * (GRID_PARTS * GRID_REACH));
}

/// Three bits for a child: IS_CHILD and its place among its siblings.
const uint CODE_BITS = 3u;
const uint CODE_MASK = 7u;
const uint IS_CHILD = 4u;
const uint PLACE_MASK = 3u;
/// The key of a child whose box the ray does not enter; its code is 0.
const int MISSED = 0x7ffffff8;

/// The key of a node's child, by which children are ordered: the bits of the distance at which the ray enters the child's box, something negative if it
/// starts inside, with the child's code for the last of them; or MISSED. Along an axis a box is a word: as an integer the middle of the box, its last bits a
/// small float that says how far the box reaches to either side. Neither needs more than one conversion, and which plane is the near one needs
/// no comparison.
///
/// Distances are compared as integers, which orders them like floats where they are ≥ 0. Negative ones come before all others, in the wrong
/// order: of several the largest integer is that of the smallest float. It is no less than that of a far side that is negative, so that a box behind
/// the ray is missed.
int key_of(GridRay ray, uvec3 box, uint place, float t_max) {
    vec3 middle = (vec3(ivec3(box)) - ray.origin) * ray.inverse;
    vec3 reach = uintBitsToFloat((box << REACH_SHIFT & REACH_MASK) | REACH_EXPONENT) * ray.reach_inverse;
    ivec3 near = floatBitsToInt(middle - reach);
    ivec3 far = floatBitsToInt(middle + reach);
    int first = max(near.x, max(near.y, near.z));
    int last = min(min(far.x, far.y), min(far.z, floatBitsToInt(t_max)));
    return first > last ? MISSED : int((uint(first) & ~CODE_MASK) | IS_CHILD | place);
}

/// Two keys in their order.
void order(inout int nearer, inout int farther) {
    int least = min(nearer, farther);
    farther = max(nearer, farther);
    nearer = least;
}

/// The keys of a node's children, in order.
ivec4 visit(GridRay ray, int node, float t_max) {
    uint texel = uint(node) * NODE_TEXELS;
    // All are fetched before any is tested, so that the processor waits for all at once.
    uvec4 x = FETCH(nodes, texel);
    uvec4 y = FETCH(nodes, texel + 1u);
    uvec4 z = FETCH(nodes, texel + 2u);
    ivec4 keys = ivec4(key_of(ray, uvec3(x.x, y.x, z.x), 0u, t_max), key_of(ray, uvec3(x.y, y.y, z.y), 1u, t_max),
                       key_of(ray, uvec3(x.z, y.z, z.z), 2u, t_max), key_of(ray, uvec3(x.w, y.w, z.w), 3u, t_max));
    order(keys.x, keys.y);
    order(keys.z, keys.w);
    order(keys.x, keys.z);
    order(keys.y, keys.w);
    order(keys.y, keys.z);
    return keys;
}

/// A group of children of one node: the node, then the codes of at most three, the nearest in the lowest bits.
const uint GROUP_BITS = 3u * CODE_BITS;
const uint GROUP_MASK = (1u << GROUP_BITS) - 1u;
/// The group of none.
const uint NO_GROUP = 0u;
/// In place of a group where an instance was entered.
const uint LEAVE_GROUP = MOST_NODES << GROUP_BITS | IS_CHILD;

/// The nearest child of a visited node alone.
uint nearest_of(int node, ivec4 keys) {
    return uint(node) << GROUP_BITS | (uint(keys.x) & CODE_MASK);
}

/// The other children that the ray meets.
uint others_of(int node, ivec4 keys) {
    uvec4 codes = uvec4(keys) & CODE_MASK;
    return uint(node) << GROUP_BITS | codes.w << (2u * CODE_BITS) | codes.z << CODE_BITS | codes.y;
}

/// The reference of a group's nearest child; NOTHING of an empty one.
int first_of(uint group) {
    bool leaves = INSTANCES && group == LEAVE_GROUP;
    uint node = leaves ? 0u : group >> GROUP_BITS;
    // The last of a node's texels.
    uint word = 4u * (NODE_TEXELS * node + NODE_TEXELS - 1u) + (group & PLACE_MASK);
    int reference = leaves ? LEAVE : int(FETCH_WORD(node_words, word));
    return (group & IS_CHILD) != 0u ? reference : NOTHING;
}

/// A group without its nearest child.
uint rest_of(uint group) {
    return (group & ~GROUP_MASK) | (group & GROUP_MASK) >> CODE_BITS;
}

bool is_empty(uint group) {
    return (group & GROUP_MASK) == 0u;
}

/// Where a walk is: in the world's tree, or, with INSTANCES, in the tree of an instance, with the ray in its space. The ray's
/// parameter t is the same in all spaces, because directions are transformed and not normalised.
struct Walk {
    GridRay grid;
    ShearedRay ray;
    uint instance;
    bool cut;
    bool uncertain;
};

Walk begin_walk(Ray world_ray) {
    return Walk(grid_ray(world_ray, frame.grid_origin, frame.grid_scale), shear_ray(world_ray), 0u, false, false);
}

/// A leaf of the upper tree: ~(instance · 16 + LEAF_IS_INSTANCE).
bool is_instance(int node) {
    return INSTANCES && node < 0 && node != NOTHING && (uint(~node) & 15u) == LEAF_IS_INSTANCE;
}

/// Goes on in the instance's space and returns the root of its tree.
int enter_instance(inout Walk walk, Ray world_ray, int leaf) {
    walk.instance = uint(~leaf) >> 4u;
    uint first = walk.instance * INSTANCE_TEXELS;
    vec4 x = FETCH_FLOATS(instances, first);
    vec4 y = FETCH_FLOATS(instances, first + 1u);
    vec4 z = FETCH_FLOATS(instances, first + 2u);
    uvec4 origin_and_root = FETCH(instances, first + 3u);
    vec3 grid_scale = FETCH_FLOATS(instances, first + 4u).xyz;
    mat3 rows = mat3(x.xyz, y.xyz, z.xyz);
    Ray ray = Ray(world_ray.origin * rows + vec3(x.w, y.w, z.w), world_ray.direction * rows);
    walk.grid = grid_ray(ray, uintBitsToFloat(origin_and_root.xyz), grid_scale);
    walk.ray = shear_ray(ray);
    return int(origin_and_root.w);
}

/// Goes on in the world.
void leave_instance(inout Walk walk, Ray world_ray) {
    walk.grid = grid_ray(world_ray, frame.grid_origin, frame.grid_scale);
}

/// Tests the triangles of a leaf. A leaf's reference is ~(first · 16 + count).
bool visit_leaf(inout Walk walk, int leaf, bool any, inout Hit hit) {
    uint reference = uint(~leaf);
    uint triangle = reference >> 4u;
    uint end = triangle + (reference & 15u);
    // Counted along: a multiplication of integers takes as long as ten additions.
    uint texel = triangle * TRIANGLE_TEXELS;
    bool found = false;
    do {
        if (triangle < end)
            found = intersect_triangle(walk.ray, triangle, texel, walk.instance, any, hit, walk.uncertain) || found;
        triangle++;
        texel += TRIANGLE_TEXELS;
    } while (triangle < end && triangle != uint(IMPOSSIBLE));
    walk.cut = walk.cut || triangle < end;
    return found;
}

/// Whether a walk came to its end.
///
/// Mesa 22.3 silently ends every loop when one invocation, or another in its subgroup, has made 65 535 rounds, nested loops
/// added up. So every loop here has a second way out, which is never taken: only then does the compiler not take for granted
/// that a loop ended as it should, and what is left to do behind the loop tells whether it was cut short.
bool is_complete(int node, bool cut) {
    return node == NOTHING && !cut;
}

/// The walk through a subtree with an array for a stack, with room for a group on each level of any two trees and the mark between them. The host
/// looks at the count of those that are cut short even so: a wrong picture is never written.
void traverse_deep(Ray world_ray, bool any, inout Hit hit) {
    uint stack[2u * MAX_TREE_DEPTH + 1u];
    int height = 0;
    Walk walk = begin_walk(world_ray);
    int node = any && hit.triangle != NO_TRIANGLE ? NOTHING : int(step_now.root);
    while (node != NOTHING && node != IMPOSSIBLE) {
        bool found = false;
        if (node >= 0) {
            ivec4 keys = visit(walk.grid, node, hit.t);
            if (keys.y != MISSED)
                stack[height++] = others_of(node, keys);
            node = first_of(nearest_of(node, keys));
            if (keys.x != MISSED)
                continue;
        } else if (INSTANCES && node == LEAVE) {
            leave_instance(walk, world_ray);
        } else if (is_instance(node)) {
            stack[height++] = LEAVE_GROUP;
            int root = enter_instance(walk, world_ray, node);
            node = step_now.below != 0u ? int(step_now.below) : root;
            continue;
        } else {
            found = visit_leaf(walk, node, any, hit);
        }
        uint group = height > 0 && !(any && found) ? stack[height - 1] : NO_GROUP;
        // Of no group it is NOTHING, which ends the walk.
        node = first_of(group);
        if (is_empty(rest_of(group)))
            height--;
        else
            stack[height - 1] = rest_of(group);
    }
    if (!is_complete(node, walk.cut))
        atomicAdd(counters[COUNTER_LOST], 1u);
}

/// A stack in registers: the top is entry 0.
struct Stack {
    uint groups[REGISTERS];
    /// Not 0 when an entry was lost.
    uint overflow;
};

/// Here and below selections, no branches: what software Vulkan assigns in a branch it moves twice.
void push(inout Stack stack, bool pushed, uint group) {
    if (DEEP_TREE)
        stack.overflow |= pushed ? stack.groups[REGISTERS - 1] : NO_GROUP;
    [[unroll]] for (int i = REGISTERS - 1; i > 0; i--)
        stack.groups[i] = pushed ? stack.groups[i - 1] : stack.groups[i];
    stack.groups[0] = pushed ? group : stack.groups[0];
}

/// Drops the nearest child of the group at the top, and the group when it was the last.
void drop_first(inout Stack stack, bool dropped) {
    uint rest = rest_of(stack.groups[0]);
    bool popped = dropped && is_empty(rest);
    stack.groups[0] = dropped ? rest : stack.groups[0];
    [[unroll]] for (int i = 0; i < REGISTERS - 1; i++)
        stack.groups[i] = popped ? stack.groups[i + 1] : stack.groups[i];
    stack.groups[REGISTERS - 1] = popped ? NO_GROUP : stack.groups[REGISTERS - 1];
}

/// The walk with registers for a stack; false if it is worth nothing: the stack overflowed, the walk was cut short, or a triangle left it uncertain.
bool traverse_shallow(Ray world_ray, bool any, inout Hit hit) {
    Walk walk = begin_walk(world_ray);
    Stack stack;
    stack.overflow = 0u;
    [[unroll]] for (int i = 0; i < REGISTERS; i++)
        stack.groups[i] = NO_GROUP;
    int node = 0;
    do {
        // An inner node, and not IMPOSSIBLE.
        do {
            if (uint(node) < uint(IMPOSSIBLE)) {
                ivec4 keys = visit(walk.grid, node, hit.t);
                bool none = keys.x == MISSED;
                uint group = none ? stack.groups[0] : nearest_of(node, keys);
                push(stack, keys.y != MISSED, others_of(node, keys));
                drop_first(stack, none);
                node = first_of(group);
            }
        } while (uint(node) < uint(IMPOSSIBLE));
        if (node >= 0 || node == NOTHING)
            break;
        if (is_instance(node)) {
            push(stack, true, LEAVE_GROUP);
            node = enter_instance(walk, world_ray, node);
            continue;
        }
        bool found = false;
        if (INSTANCES && node == LEAVE)
            leave_instance(walk, world_ray);
        else
            found = visit_leaf(walk, node, any, hit);
        node = first_of(stack.groups[0]);
        drop_first(stack, true);
        if (any && found) {
            node = NOTHING;
            stack.overflow = 0u;
            walk.uncertain = false;
        }
    } while (node != NOTHING);
    return is_complete(node, walk.cut) && stack.overflow == 0u && !walk.uncertain;
}

/// Finds the nearest hit, or with `any` some hit, closer than hit.t; a miss leaves hit as it was. False: the ray must be traced
/// again by a kernel with RETRACE, its answer is worth nothing.
bool traverse(Ray world_ray, bool any, inout Hit hit) {
    if (RETRACE) {
        traverse_deep(world_ray, any, hit);
        return true;
    }
    return traverse_shallow(world_ray, any, hit);
}

/// No hit yet, and none wanted beyond `distance`.
Hit no_hit(float distance) {
    return Hit(distance, NO_TRIANGLE, NO_TRIANGLE, vec2(0.0), 0u, NO_TRIANGLE, vec3(1.0));
}

/// What a ray that is traced again has hit in the subtrees before, or no hit yet. `index` is its place in the retrace queue.
Hit hit_so_far(uint index, float distance) {
    Hit hit = no_hit(distance);
    if (RETRACE) {
        uvec4 first = partial_hits[PARTIAL_HIT_TEXELS * index];
        uvec4 second = partial_hits[PARTIAL_HIT_TEXELS * index + 1u];
        uint triangle_and_back = step_now.first_part != 0u ? NO_TRIANGLE : first.y;
        hit.passed = mix(uintBitsToFloat(second.xyz), vec3(1.0), bvec3(step_now.first_part != 0u));
        if (triangle_and_back != NO_TRIANGLE) {
            uint triangle = triangle_and_back & ~PRECEDENCE_BACK;
            uint texel = triangle * TRIANGLE_TEXELS;
            uint precedence = FETCH(triangles, texel + 2u).w | (triangle_and_back & PRECEDENCE_BACK);
            hit = Hit(uintBitsToFloat(first.x), triangle, FETCH(triangles, texel).w, uintBitsToFloat(first.zw), second.w,
                      precedence, hit.passed);
        }
    }
    return hit;
}

/// Whether the walk is over; otherwise keeps what was hit for the next subtree.
bool is_last_part(uint index, Hit hit) {
    if (!RETRACE)
        return true;
    // A triangle's number has room for whether its back was hit; of none all bits are set.
    uint triangle = hit.triangle | (hit.precedence & PRECEDENCE_BACK);
    partial_hits[PARTIAL_HIT_TEXELS * index] = uvec4(floatBitsToUint(hit.t), triangle, floatBitsToUint(hit.barycentrics));
    partial_hits[PARTIAL_HIT_TEXELS * index + 1u] = uvec4(floatBitsToUint(hit.passed), hit.instance);
    // A condition of the whole dispatch, made one of this thread: see kernel.glsl.
    return all(bvec2(step_now.last_part != 0u, index != NO_ITEM));
}
