// Traversal of the compressed wide BVH (Ylitie, Karras & Laine, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs",
// HPG 2017; node layout of obvhs: 5 x vec4<u32>, min and max planes interleaved).
#include "geometry/intersect_triangle.wgsl"
#if QUADRICS
#include "geometry/intersect_quadric.wgsl"
#endif

#if COUNTED
#include "common/counts.wgsl"
#endif

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

#if CONTACT
// The same place on the primitive in contact, within it.
fn at_contact(hit: Hit) -> Hit {
    return Hit(hit.t, hit.contact, vec2f(1.0 / 3.0), NONE);
}

var<private> leaving_contact: u32; // the primitive in contact with the one that the ray at hand leaves, or NONE
#endif

fn no_hit(t_max: f32) -> Hit {
    var hit: Hit;
    hit.t = t_max;
    hit.primitive = NONE;
#if CONTACT
    hit.contact = NONE;
#endif
    return hit;
}

// Distances along `ray` that cannot be told apart around `t`: surfaces closer than this touch.
fn contact_slack(ray: Ray, t: f32) -> f32 {
#if CONTACT
    let o = abs(ray.o);
    return 2e-6 * (max(o.x, max(o.y, o.z)) + t);
#else
    return 0.0;
#endif
}

// Keeps the nearest hit in (0, hit.t); with CONTACT also a second one at the same place. True if it was kept.
fn offer_hit(ray: Ray, t: f32, primitive: u32, bary: vec2f, hit: ptr<function, Hit>) -> bool {
#if CONTACT
    if (t <= 0.0 || primitive == leaving_contact) {
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

fn trace(ray: Ray) -> Hit {
    var hit = no_hit(ray.t_max);
    // A direction component of zero would turn a slab into 0 * infinity.
    let tiny = vec3f(1e-30);
    let inv_d = 1.0 / select(ray.d, select(-tiny, tiny, ray.d >= vec3f(0.0)), abs(ray.d) < tiny);
    let negative = ray.d < vec3f(0.0);
    let oct_inv4 = select(4u, 0u, negative.x) * 0x01010101u | select(2u, 0u, negative.y) * 0x01010101u | select(1u, 0u, negative.z) * 0x01010101u;
    var nodes = vec2u(0u, 0x80000000u);
    var primitives_left = vec2u(0u);
    var depth = 0u;
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
            let slot = (bit - 24u) ^ (oct_inv4 & 0xffu);
#if COUNTED
            nodes_tested += 1u;
#endif
            let at = 5u * (base + countOneBits(imask & ~(0xffffffffu << slot)));
            let n0 = fetch(bvh, at);
            let n1 = fetch(bvh, at + 1u);
            let nx = fetch(bvh, at + 2u);
            let ny = fetch(bvh, at + 3u);
            let nz = fetch(bvh, at + 4u);
            let exponents = vec3u(n0.w & 0xffu, (n0.w >> 8u) & 0xffu, (n0.w >> 16u) & 0xffu);
            let scale = bitcast<vec3f>(exponents << vec3u(23u)) * inv_d;
            let origin = (bitcast<vec3f>(n0.xyz) - ray.o) * inv_d;
            let lo_x = select(nx.xy, nx.zw, negative.x);
            let hi_x = select(nx.zw, nx.xy, negative.x);
            let lo_y = select(ny.xy, ny.zw, negative.y);
            let hi_y = select(ny.zw, ny.xy, negative.y);
            let lo_z = select(nz.xy, nz.zw, negative.z);
            let hi_z = select(nz.zw, nz.xy, negative.z);
            let t_far = hit.t + contact_slack(ray, hit.t);
            let mask = hit_children(n1.z, oct_inv4, lo_x.x, lo_y.x, lo_z.x, hi_x.x, hi_y.x, hi_z.x, scale, origin, t_far)
                | hit_children(n1.w, oct_inv4, lo_x.y, lo_y.y, lo_z.y, hi_x.y, hi_y.y, hi_z.y, scale, origin, t_far);
            nodes = vec2u(n1.x, (mask & 0xff000000u) | (n0.w >> 24u));
            primitives_left = vec2u(n1.y, mask & 0x00ffffffu);
        }
        while (primitives_left.y != 0u) {
            let bit = firstTrailingBit(primitives_left.y);
            primitives_left.y &= primitives_left.y - 1u;
#if COUNTED
            primitives_tested += 1u;
#endif
            intersect_primitive(ray, primitives_left.x + bit, &hit);
        }
        if (ray.any_hit && hit.primitive != NONE) {
            break;
        }
        if ((nodes.y & 0xff000000u) == 0u) {
            if (depth == 0u) {
                break;
            }
            depth -= 1u;
            nodes = traversal_stack[depth];
        }
    }
    return hit;
}

fn intersect_primitive(ray: Ray, primitive: u32, hit: ptr<function, Hit>) {
    if (primitive == ray.to_primitive) {
        return;
    }
    let r0 = primitive_row(3u * primitive);
    let r1 = primitive_row(3u * primitive + 1u);
    let r2 = primitive_row(3u * primitive + 2u);
#if QUADRICS
    let kind = bitcast<u32>(r0.w) >> 30u;
    if (kind != PRIMITIVE_TRIANGLE) {
        intersect_quadric(ray, primitive, kind, r0.xyz, r1.xyz, r2.xyz, hit);
        return;
    }
#endif
    // A ray cannot meet again the plane that it leaves.
    if (primitive != ray.from_primitive) {
        intersect_triangle(ray, primitive, r0.xyz, r1.xyz, r2.xyz, hit);
    }
}
