// The tree and the walk through it: nodes of four quantised boxes, walked while-while (Aila and Laine, HPG 2009), the
// nearest child first. The stack is a shift register: a few variables that move up and down, touched with constant indices
// only, because an indexed array costs software Vulkan eight scalar branches a push. When a live entry falls off its end,
// the ray goes to the retrace queue, where a variant of the same kernel walks again with an array as deep as the tree can be:
// rare, and no ray is ever lost. The same happens to a ray that f32 cannot tell whether it hits, and to a walk that the driver
// cut short; if that is still too long, it is done again subtree by subtree.
//
// Loops end at their bottom, do … while: Mesa 22.3 runs a loop's body before it asks whether any ray still needs it, so that
// one that ends at its top makes a round for nothing.

/// No node: the bottom of the stack, where a walk is over.
const int NOTHING = int(0x80000000);
/// No node either: below the bottom of the stack. A walk comes here if its stack was too small: then the bottom was the first to fall off the end.
const int LOST = int(0x80000001);
/// In place of a node: back from an instance to the world.
const int LEAVE = int(0x80000002);
/// Nodes that the stack of registers holds, its bottom being one.
const int REGISTERS = 15;
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

/// In place of the distance at which a ray enters a box: it does not.
const int MISSED = 0x7fffffff;

/// Slab test: the distance at which the ray enters a box, something negative if it starts inside, or MISSED. Along an axis
/// a box is a word: as an integer the middle of the box, its last bits a small float that says how far the box reaches to either side. Neither needs
/// more than one conversion, and which plane is the near one needs no comparison.
///
/// Distances are compared as integers, which orders them like floats where they are ≥ 0. Negative ones come before all others, in the wrong
/// order: of several the largest integer is that of the smallest float. It is no less than that of a far side that is negative, so that a box behind
/// the ray is missed.
int entry_of(GridRay ray, uvec3 box, float t_max) {
    vec3 middle = (vec3(ivec3(box)) - ray.origin) * ray.inverse;
    vec3 reach = uintBitsToFloat((box << REACH_SHIFT & REACH_MASK) | REACH_EXPONENT) * ray.reach_inverse;
    ivec3 near = floatBitsToInt(middle - reach);
    ivec3 far = floatBitsToInt(middle + reach);
    int first = max(near.x, max(near.y, near.z));
    int last = min(min(far.x, far.y), min(far.z, floatBitsToInt(t_max)));
    return first > last ? MISSED : first;
}

/// A node's child as a ray meets it.
struct Branch {
    /// See entry_of.
    int entry;
    /// The child's reference.
    int node;
};

/// Two branches in their order.
void order(inout Branch nearer, inout Branch farther) {
    bool swapped = farther.entry < nearer.entry;
    Branch first = nearer;
    nearer = Branch(min(first.entry, farther.entry), swapped ? farther.node : first.node);
    farther = Branch(max(first.entry, farther.entry), swapped ? first.node : farther.node);
}

/// A node's children, the nearest first, those that are missed last.
struct Visit {
    Branch first;
    Branch second;
    Branch third;
    Branch fourth;
};

Visit visit(GridRay ray, int node, float t_max) {
    uint texel = uint(node) * NODE_TEXELS;
    // All are fetched before any is tested, so that the processor waits for all at once.
    uvec4 x = FETCH(nodes, texel);
    uvec4 y = FETCH(nodes, texel + 1u);
    uvec4 z = FETCH(nodes, texel + 2u);
    ivec4 references = ivec4(FETCH(nodes, texel + 3u));
    Visit next = Visit(Branch(entry_of(ray, uvec3(x.x, y.x, z.x), t_max), references.x),
                       Branch(entry_of(ray, uvec3(x.y, y.y, z.y), t_max), references.y),
                       Branch(entry_of(ray, uvec3(x.z, y.z, z.z), t_max), references.z),
                       Branch(entry_of(ray, uvec3(x.w, y.w, z.w), t_max), references.w));
    order(next.first, next.second);
    order(next.third, next.fourth);
    order(next.first, next.third);
    order(next.second, next.fourth);
    order(next.second, next.third);
    return next;
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

/// The walk through a subtree with an array for a stack, with room for three siblings on each level of any two trees and the mark between them. The host
/// looks at the count of those that are cut short even so: a wrong picture is never written.
void traverse_deep(Ray world_ray, bool any, inout Hit hit) {
    int stack[2u * 3u * MAX_TREE_DEPTH + 1u];
    int height = 0;
    Walk walk = begin_walk(world_ray);
    int node = any && hit.triangle != NO_TRIANGLE ? NOTHING : int(step_now.root);
    while (node != NOTHING && node != IMPOSSIBLE) {
        bool found = false;
        if (node >= 0) {
            Visit next = visit(walk.grid, node, hit.t);
            if (next.fourth.entry != MISSED)
                stack[height++] = next.fourth.node;
            if (next.third.entry != MISSED)
                stack[height++] = next.third.node;
            if (next.second.entry != MISSED)
                stack[height++] = next.second.node;
            node = next.first.node;
            if (next.first.entry != MISSED)
                continue;
        } else if (INSTANCES && node == LEAVE) {
            leave_instance(walk, world_ray);
        } else if (is_instance(node)) {
            stack[height++] = LEAVE;
            int root = enter_instance(walk, world_ray, node);
            node = step_now.below != 0u ? int(step_now.below) : root;
            continue;
        } else {
            found = visit_leaf(walk, node, any, hit);
        }
        node = height > 0 && !(any && found) ? stack[--height] : NOTHING;
    }
    if (!is_complete(node, walk.cut))
        atomicAdd(counters[COUNTER_LOST], 1u);
}

/// A stack in registers: the top is entry 0. Below its last entry, NOTHING, all are LOST.
struct Stack {
    int entries[REGISTERS];
};

// Here and below conditions are selections, no branches: what software Vulkan assigns in a long branch it moves twice.

/// Moves the entries up by `places`, which is constant.
void move_up(inout Stack stack, bool is_moved, int places) {
    [[unroll]] for (int i = REGISTERS - 1; i >= places; i--)
        stack.entries[i] = is_moved ? stack.entries[i - places] : stack.entries[i];
}

/// All but the nearest, the farthest first: in two moves, of two places and of one.
void push_siblings(inout Stack stack, Visit next) {
    bool one = next.second.entry != MISSED;
    bool two = next.third.entry != MISSED;
    bool three = next.fourth.entry != MISSED;
    move_up(stack, two, 2);
    move_up(stack, one && (three || !two), 1);
    stack.entries[0] = one ? next.second.node : stack.entries[0];
    stack.entries[1] = two ? next.third.node : stack.entries[1];
    stack.entries[2] = three ? next.fourth.node : stack.entries[2];
}

/// The stack without its top.
void pop(inout Stack stack, bool is_popped) {
    [[unroll]] for (int i = 0; i < REGISTERS - 1; i++)
        stack.entries[i] = is_popped ? stack.entries[i + 1] : stack.entries[i];
    stack.entries[REGISTERS - 1] = is_popped ? LOST : stack.entries[REGISTERS - 1];
}

/// The walk with registers for a stack; false if it is worth nothing: the stack overflowed, the walk was cut short, or a triangle left it uncertain.
bool traverse_shallow(Ray world_ray, bool any, inout Hit hit) {
    Walk walk = begin_walk(world_ray);
    Stack stack;
    stack.entries[0] = NOTHING;
    [[unroll]] for (int i = 1; i < REGISTERS; i++)
        stack.entries[i] = LOST;
    int node = 0;
    do {
        // An inner node, and not IMPOSSIBLE.
        do {
            if (uint(node) < uint(IMPOSSIBLE)) {
                Visit next = visit(walk.grid, node, hit.t);
                bool none = next.first.entry == MISSED;
                node = none ? stack.entries[0] : next.first.node;
                push_siblings(stack, next);
                pop(stack, none);
            }
        } while (uint(node) < uint(IMPOSSIBLE));
        if (node >= 0 || node <= LOST)
            break;
        if (is_instance(node)) {
            move_up(stack, true, 1);
            stack.entries[0] = LEAVE;
            node = enter_instance(walk, world_ray, node);
            continue;
        }
        bool found = false;
        if (INSTANCES && node == LEAVE)
            leave_instance(walk, world_ray);
        else
            found = visit_leaf(walk, node, any, hit);
        node = stack.entries[0];
        pop(stack, true);
        if (any && found) {
            node = NOTHING;
            walk.uncertain = false;
        }
    } while (node > LOST);
    return is_complete(node, walk.cut) && !walk.uncertain;
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
