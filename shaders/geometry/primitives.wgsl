// The table of primitives: three rows each (src/gpu/scene/primitives.rs). With INSTANCES a primitive's number is not its place in the table where it is part
// of a mesh that stands in many places: every instance has numbers of its own for its triangles (src/gpu/scene/instances.rs).
#include "common/math.wgsl"

@group(0) @binding(2) var primitives: Table<vec4f>;
#if INSTANCES
@group(0) @binding(21) var instances: Table<vec4u, Instance>;
#endif

// Row `i` of the table.
fn primitive_row(i: u32) -> vec4f {
    return load_primitives(i);
}

#if INSTANCES
// The instance that the primitive of this number is part of, or NONE.
fn instance_of(number: u32) -> u32 {
    if (number < params.first_instanced) {
        return NONE;
    }
    let granule = (number - params.first_instanced) / GRANULE;
    let four = load_instances(params.first_owner + granule / 4u);
    let pair = select(four.xy, four.zw, (granule & 2u) != 0u);
    return select(pair.x, pair.y, (granule & 1u) != 0u);
}

// A transform by its rows.
struct Affine {
    x: vec4f,
    y: vec4f,
    z: vec4f,
}

// The same expression wherever a vertex is carried, so that it lands on the same place.
fn carry_point(m: Affine, p: vec3f) -> vec3f {
    return vec3f(dot(m.x.xyz, p) + m.x.w, dot(m.y.xyz, p) + m.y.w, dot(m.z.xyz, p) + m.z.w);
}

fn carry_direction(m: Affine, d: vec3f) -> vec3f {
    return vec3f(dot(m.x.xyz, d), dot(m.y.xyz, d), dot(m.z.xyz, d));
}

fn to_world(i: Instance) -> Affine {
    return Affine(i.to_world_x, i.to_world_y, i.to_world_z);
}

fn to_mesh(i: Instance) -> Affine {
    return Affine(i.to_mesh_x, i.to_mesh_y, i.to_mesh_z);
}

// A normal of the mesh in the world: by the inverse transposed.
fn carry_normal(i: Instance, n: vec3f) -> vec3f {
    let carried = n.x * i.to_mesh_x.xyz + n.y * i.to_mesh_y.xyz + n.z * i.to_mesh_z.xyz;
    return carried * inverseSqrt(max(dot(carried, carried), 1e-37));
}
#endif

// A primitive's rows, those of a triangle in the world.
struct Primitive {
    r0: vec4f,
    r1: vec4f,
    r2: vec4f,
    place: u32, // in the table
#if INSTANCES
    instance: u32, // or NONE
#endif
}

fn primitive_at(number: u32) -> Primitive {
    var p: Primitive;
    p.place = number;
#if INSTANCES
    p.instance = instance_of(number);
    if (p.instance != NONE) {
        let i = load_Instance(p.instance);
        p.place = number - i.first_number;
        let r0 = primitive_row(3u * p.place);
        let r1 = primitive_row(3u * p.place + 1u);
        let r2 = primitive_row(3u * p.place + 2u);
        p.r0 = vec4f(carry_point(to_world(i), r0.xyz), r0.w);
        p.r1 = vec4f(carry_point(to_world(i), r1.xyz), r1.w);
        p.r2 = vec4f(carry_point(to_world(i), r2.xyz), r2.w);
        return p;
    }
#endif
    p.r0 = primitive_row(3u * number);
    p.r1 = primitive_row(3u * number + 1u);
    p.r2 = primitive_row(3u * number + 2u);
    return p;
}

// Index of a primitive's material.
fn material_of(number: u32) -> u32 {
#if INSTANCES
    let instance = instance_of(number);
    if (instance != NONE) {
        return load_Instance(instance).material;
    }
#endif
    return bitcast<u32>(primitive_row(3u * number).w) & 0x1fffffffu;
}
