// Nested volumes by priority (Schmidt & Budge, "Simple nested dielectrics in ray traced images", JGT 7(2), 2002). A path keeps the multiset
// of volumes it is inside; an entry is a rank (1 << 31 | priority << 16 | index into `interiors`), 0 an empty slot; the greatest rules.

var<private> inside: vec4u;

fn with_interior(volumes: vec4u, rank: u32) -> vec4u {
    let empty = volumes == vec4u(0u);
    let first = vec4<bool>(empty.x, empty.y && !empty.x, empty.z && !empty.y && !empty.x, empty.w && !empty.z && !empty.y && !empty.x);
    return select(volumes, vec4u(rank), first);
}

fn without_interior(volumes: vec4u, rank: u32) -> vec4u {
    let same = volumes == vec4u(rank);
    let first = vec4<bool>(same.x, same.y && !same.x, same.z && !same.y && !same.x, same.w && !same.z && !same.y && !same.x);
    return select(volumes, vec4u(0u), first);
}

fn ruling_rank(volumes: vec4u) -> u32 {
    return max(max(volumes.x, volumes.y), max(volumes.z, volumes.w));
}

// Index into `interiors` of the volume that rules in `volumes`; 0 surrounds the scene.
fn ruling_interior(volumes: vec4u) -> u32 {
    return ruling_rank(volumes) & 0xffffu;
}
