// Traversal of the compressed wide BVH (Ylitie, Karras & Laine, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs",
// HPG 2017; node layout of obvhs: 5 x vec4<u32>, min and max planes interleaved).
#include "common/math.wgsl"
#include "common/params.wgsl"
#include "geometry/primitives.wgsl"
#include "geometry/intersect_triangle.wgsl"
#if QUADRICS
#include "geometry/intersect_quadric.wgsl"
#endif
#if LENS_FACES
#include "geometry/intersect_lens_face.wgsl"
#endif
#if CONTACT
#include "geometry/contact.wgsl"
#endif
#if COUNTED
#include "common/counters.wgsl"
#endif
@group(0) @binding(1) var bvh: Table<vec4u>;

struct Ray {
    o: vec3f,
    t_max: f32,
    d: vec3f, // unit
    from_primitive: u32, // the primitive that `o` lies on, or NONE
    to_primitive: u32, // a light's primitive that does not occlude a ray towards itself, or NONE
    any_hit: bool, // the first hit found ends the traversal
}

struct Hit {
    t: f32,
    primitive: u32, // NONE for a miss
    bary: vec2f, // weights of vertices 1 and 2, for triangles
#if CONTACT
    contact: u32, // another primitive at the same place, or NONE
#endif
}

// True if the origin of `ray` lies on this primitive.
fn leaves(ray: Ray, primitive: u32) -> bool {
#if CONTACT
    return primitive == ray.from_primitive || primitive == beside.primitive;
#else
    return primitive == ray.from_primitive;
#endif
}

fn no_hit(t_max: f32) -> Hit {
    var hit: Hit;
    hit.t = t_max;
    hit.primitive = NONE;
#if CONTACT
    hit.contact = NONE;
#endif
    return hit;
}

// Keeps the nearest hit in (0, hit.t); with CONTACT also a second one at the same place. True if it was kept.
fn offer_hit(ray: Ray, t: f32, primitive: u32, bary: vec2f, hit: ptr<function, Hit>) -> bool {
#if CONTACT
    if (t <= 0.0) {
        return false;
    }
    let slack = contact_slack(ray, t);
    let known = (*hit).primitive;
    let touches = known != NONE && abs(t - (*hit).t) <= slack;
    if (t < (*hit).t) {
        (*hit).contact = select(NONE, known, touches);
        (*hit).t = t;
        (*hit).primitive = primitive;
        (*hit).bary = bary;
        return true;
    }
    if (touches) {
        (*hit).contact = primitive;
    }
    return touches;
#else
    if (t > 0.0 && t < (*hit).t) {
        *hit = Hit(t, primitive, bary);
        return true;
    }
    return false;
#endif
}

var<private> traversal_stack: array<vec2u, BVH_STACK>;

fn bytes(w: u32) -> vec4f {
    return vec4f(vec4u(w, w >> 8u, w >> 16u, w >> 24u) & vec4u(0xffu));
}

// Hit mask of four children: bits 24..31 inner nodes by traversal priority, bits 0..23 primitives.
fn hit_children(
    meta_bytes: u32, oct_inv4: u32, lo_x: u32, lo_y: u32, lo_z: u32, hi_x: u32, hi_y: u32, hi_z: u32,
    scale: vec3f, origin: vec3f, t_max: f32,
) -> u32 {
    let is_inner = (meta_bytes & (meta_bytes << 1u)) & 0x10101010u;
    let inner_mask = (is_inner >> 4u) * 0xffu;
    let bit_index = (meta_bytes ^ (oct_inv4 & inner_mask)) & 0x1f1f1f1fu;
    let child_bits = (meta_bytes >> 5u) & 0x07070707u;
    let t_near = max(
        max(bytes(lo_x) * scale.x + origin.x, bytes(lo_y) * scale.y + origin.y),
        max(bytes(lo_z) * scale.z + origin.z, vec4f(0.0)));
    let t_far = min(
        min(bytes(hi_x) * scale.x + origin.x, bytes(hi_y) * scale.y + origin.y),
        min(bytes(hi_z) * scale.z + origin.z, vec4f(t_max)));
    // Two ulps per operation keep the slab test conservative (Ize, "Robust BVH ray traversal", JCGT 2(2), 2013).
    let hit = t_near <= t_far * 1.0000008;
    let index = vec4u(bit_index, bit_index >> 8u, bit_index >> 16u, bit_index >> 24u) & vec4u(0x1fu);
    let bits = vec4u(child_bits, child_bits >> 8u, child_bits >> 16u, child_bits >> 24u) & vec4u(0x7u);
    let mask = select(vec4u(0u), bits << index, hit);
    return mask.x | mask.y | mask.z | mask.w;
}

// A ray as boxes see it.
struct Slopes {
    o: vec3f,
    inv_d: vec3f,
    negative: vec3<bool>,
    oct_inv4: u32,
}

fn slopes(o: vec3f, d: vec3f) -> Slopes {
    // A direction component of zero would turn a slab into 0 * infinity.
    let tiny = vec3f(1e-30);
    let inv_d = 1.0 / select(d, select(-tiny, tiny, d >= vec3f(0.0)), abs(d) < tiny);
    let negative = d < vec3f(0.0);
    let oct_inv4 = select(4u, 0u, negative.x) * 0x01010101u | select(2u, 0u, negative.y) * 0x01010101u | select(1u, 0u, negative.z) * 0x01010101u;
    return Slopes(o, inv_d, negative, oct_inv4);
}

#if INSTANCES
// The space of the hierarchy that is being searched: the world's, or a mesh's in one of its places.
struct Space {
    to_world: Affine,
    first_number: u32, // of a primitive less its place in the table
}

const WORLD = Space(Affine(vec4f(1.0, 0.0, 0.0, 0.0), vec4f(0.0, 1.0, 0.0, 0.0), vec4f(0.0, 0.0, 1.0, 0.0)), 0u);
#endif

fn trace(ray: Ray) -> Hit {
    var hit = no_hit(ray.t_max);
    var is_done = false;
#if CONTACT
    // What lies beside the origin may be the first thing that the ray crosses.
    is_done = dot(ray.d, beside.n) < 0.0 && beside.primitive != ray.to_primitive;
    if (is_done) {
        hit = Hit(0.0, beside.primitive, beside.bary, NONE);
    }
#endif
    var seen = slopes(ray.o, ray.d);
    var nodes = vec2u(0u, select(0x80000000u, 0u, is_done));
    var primitives_left = vec2u(0u);
    var depth = 0u;
#if INSTANCES
    var space = WORLD;
    var in_mesh = false;
    var bottom = 0u; // of the stack, as far as the present space goes
#endif
    loop {
        if ((nodes.y & 0xff000000u) != 0u) {
            let bit = firstLeadingBit(nodes.y);
            let base = nodes.x;
            let imask = nodes.y;
            nodes.y &= ~(1u << bit);
            if ((nodes.y & 0xff000000u) != 0u) {
                traversal_stack[depth] = nodes;
                depth += 1u;
            }
            let slot = (bit - 24u) ^ (seen.oct_inv4 & 0xffu);
#if COUNTED
            nodes_tested += 1u;
#endif
            let at = 5u * (base + countOneBits(imask & ~(0xffffffffu << slot)));
            let n0 = load_bvh(at);
            let n1 = load_bvh(at + 1u);
            let nx = load_bvh(at + 2u);
            let ny = load_bvh(at + 3u);
            let nz = load_bvh(at + 4u);
            let exponents = vec3u(n0.w & 0xffu, (n0.w >> 8u) & 0xffu, (n0.w >> 16u) & 0xffu);
            let scale = bitcast<vec3f>(exponents << vec3u(23u)) * seen.inv_d;
            let origin = (bitcast<vec3f>(n0.xyz) - seen.o) * seen.inv_d;
            let lo_x = select(nx.xy, nx.zw, seen.negative.x);
            let hi_x = select(nx.zw, nx.xy, seen.negative.x);
            let lo_y = select(ny.xy, ny.zw, seen.negative.y);
            let hi_y = select(ny.zw, ny.xy, seen.negative.y);
            let lo_z = select(nz.xy, nz.zw, seen.negative.z);
            let hi_z = select(nz.zw, nz.xy, seen.negative.z);
#if CONTACT
            let t_far = hit.t + contact_slack(ray, hit.t);
#else
            let t_far = hit.t;
#endif
            let mask = hit_children(n1.z, seen.oct_inv4, lo_x.x, lo_y.x, lo_z.x, hi_x.x, hi_y.x, hi_z.x, scale, origin, t_far)
                | hit_children(n1.w, seen.oct_inv4, lo_x.y, lo_y.y, lo_z.y, hi_x.y, hi_y.y, hi_z.y, scale, origin, t_far);
            nodes = vec2u(n1.x, (mask & 0xff000000u) | (n0.w >> 24u));
            primitives_left = vec2u(n1.y, mask & 0x00ffffffu);
        }
        while (primitives_left.y != 0u) {
            let bit = firstTrailingBit(primitives_left.y);
            primitives_left.y &= primitives_left.y - 1u;
#if COUNTED
            primitives_tested += 1u;
#endif
#if INSTANCES
            let instance = intersect_primitive(ray, space, primitives_left.x + bit, &hit);
            if (instance != NONE) {
                // What is left here waits.
                if ((nodes.y & 0xff000000u) != 0u) {
                    traversal_stack[depth] = nodes;
                    depth += 1u;
                }
                if (primitives_left.y != 0u) {
                    traversal_stack[depth] = primitives_left;
                    depth += 1u;
                }
                let i = load_Instance(instance);
                space = Space(to_world(i), i.first_number);
                seen = slopes(carry_point(to_mesh(i), ray.o), carry_direction(to_mesh(i), ray.d));
                in_mesh = true;
                bottom = depth;
                nodes = vec2u(i.root, 0x80000000u);
                primitives_left = vec2u(0u);
            }
#else
            intersect_primitive(ray, primitives_left.x + bit, &hit);
#endif
        }
        if (ray.any_hit && hit.primitive != NONE) {
            break;
        }
        if ((nodes.y & 0xff000000u) == 0u) {
#if INSTANCES
            if (in_mesh && depth == bottom) {
                space = WORLD;
                seen = slopes(ray.o, ray.d);
                in_mesh = false;
            }
#endif
            if (depth == 0u) {
                break;
            }
            depth -= 1u;
            nodes = traversal_stack[depth];
#if INSTANCES
            if ((nodes.y & 0xff000000u) == 0u) {
                primitives_left = nodes;
                nodes = vec2u(0u);
            }
#endif
        }
    }
#if CONTACT
    settle_contact(ray, &hit);
#endif
    return hit;
}

// Offers the primitive at `place` in the table to `hit`. An instance's index is returned instead, so that its mesh is searched; else NONE.
fn intersect_primitive(
    ray: Ray,
#if INSTANCES
    space: Space,
#endif
    place: u32,
    hit: ptr<function, Hit>,
) -> u32 {
    var number = place;
#if INSTANCES
    number += space.first_number;
#endif
    if (number == ray.to_primitive) {
        return NONE;
    }
    let r0 = primitive_row(3u * place);
    let r1 = primitive_row(3u * place + 1u);
    let r2 = primitive_row(3u * place + 2u);
#if QUADRICS || INSTANCES
    let kind = bitcast<u32>(r0.w) >> 29u;
#endif
#if INSTANCES
    if (kind == PRIMITIVE_INSTANCE) {
        return bitcast<u32>(r2.x);
    }
#endif
#if LENS_FACES
    if (kind == PRIMITIVE_LENS_FACE) {
        intersect_lens_face(ray, number, r0.xyz, r1.xyz, r2.xyz, hit);
        return NONE;
    }
#endif
#if QUADRICS
    if (kind != PRIMITIVE_TRIANGLE) {
        intersect_quadric(ray, number, kind, r0.xyz, r1.xyz, r2.xyz, hit);
        return NONE;
    }
#endif
    // A ray cannot meet again the plane that it leaves.
    if (!leaves(ray, number)) {
#if INSTANCES
        // Met in the world, where neighbours have the same corners.
        let m = space.to_world;
        intersect_triangle(ray, number, carry_point(m, r0.xyz), carry_point(m, r1.xyz), carry_point(m, r2.xyz), hit);
#else
        intersect_triangle(ray, number, r0.xyz, r1.xyz, r2.xyz, hit);
#endif
    }
    return NONE;
}
