// Measured distributions of lamps (src/scene/lamp/profile.rs; the table: src/gpu/scene/profiles.rs). Within a cell directions are sampled evenly.
#include "common/math.wgsl"
#include "light/angles.wgsl"

@group(0) @binding(23) var profiles: Table<vec4f, Profile, ProfileRing, ProfileSector, ProfileCell>;

// Where the parts of a profile are.
struct ProfileParts {
    size: vec2u, // rings and sectors
    rings: u32,
    sectors: u32,
    cells: u32,
}

fn profile_parts(light: Light) -> ProfileParts {
    let first = bitcast<u32>(light.p0.w);
    let head = load_Profile_at(first);
    let rings = first + TEXELS_OF_Profile;
    let sectors = rings + (head.rings + 1u) * TEXELS_OF_ProfileRing;
    return ProfileParts(vec2u(head.rings, head.sectors), rings, sectors, sectors + (head.sectors + 1u) * TEXELS_OF_ProfileSector);
}

// Of `count` intervals the one that `x` lies in; they begin at component `which` of the texels from `first` on, `stride` apart.
fn profile_interval(first: u32, stride: u32, which: u32, count: u32, x: f32) -> u32 {
    var low = 0u;
    var high = count;
    while (low + 1u < high) {
        let middle = (low + high) / 2u;
        let above = component(load_profiles(first + stride * middle), which) <= x;
        low = select(low, middle, above);
        high = select(middle, high, above);
    }
    return low;
}

// Relative intensity along `d` and the pdf of sampling it.
fn profile_towards(light: Light, d: vec3f) -> vec2f {
    let y = cross(light.p2.xyz, light.p1.xyz);
    let local = vec3f(dot(light.p2.xyz, d), dot(y, d), dot(light.p1.xyz, d));
    let theta = atan2_precise(length(local.xy), local.z);
    let azimuth = atan2_precise(local.y, local.x);
    let phi = select(azimuth, azimuth + 2.0 * PI, azimuth < 0.0);
    let parts = profile_parts(light);
    let ring = profile_interval(parts.rings, TEXELS_OF_ProfileRing, 0u, parts.size.x, theta);
    let sector = profile_interval(parts.sectors, TEXELS_OF_ProfileSector, 0u, parts.size.y, phi);
    let from_theta = load_ProfileRing_at(parts.rings + ring * TEXELS_OF_ProfileRing).theta;
    let to_theta = load_ProfileRing_at(parts.rings + (ring + 1u) * TEXELS_OF_ProfileRing).theta;
    if (theta < from_theta || theta > to_theta) {
        return vec2f(0.0);
    }
    let from_phi = load_ProfileSector_at(parts.sectors + sector * TEXELS_OF_ProfileSector).phi;
    let to_phi = load_ProfileSector_at(parts.sectors + (sector + 1u) * TEXELS_OF_ProfileSector).phi;
    let cell = load_ProfileCell_at(parts.cells + (ring * parts.size.y + sector) * TEXELS_OF_ProfileCell);
    let across = mix(cell.corners.xy, cell.corners.zw, clamp((phi - from_phi) / (to_phi - from_phi), 0.0, 1.0));
    return vec2f(mix(across.x, across.y, (theta - from_theta) / (to_theta - from_theta)), cell.pdf);
}

fn sample_profile(light: Light, u: vec2f) -> vec3f {
    let parts = profile_parts(light);
    // The third number of a ring's edge is its share.
    let ring = profile_interval(parts.rings, TEXELS_OF_ProfileRing, 2u, parts.size.x, u.x);
    let cells = parts.cells + ring * parts.size.y * TEXELS_OF_ProfileCell;
    // The second texel of a cell begins with its share.
    let sector = profile_interval(cells + 1u, TEXELS_OF_ProfileCell, 0u, parts.size.y, u.y);
    let low = load_ProfileRing_at(parts.rings + ring * TEXELS_OF_ProfileRing);
    let high = load_ProfileRing_at(parts.rings + (ring + 1u) * TEXELS_OF_ProfileRing);
    let cell = load_ProfileCell_at(cells + sector * TEXELS_OF_ProfileCell);
    let h = mix(low.one_minus_cos, high.one_minus_cos, clamp((u.x - low.share) / max(high.share - low.share, 1e-30), 0.0, 1.0));
    let within = clamp((u.y - cell.share_from) / max(cell.share_to - cell.share_from, 1e-30), 0.0, 1.0);
    let from_phi = load_ProfileSector_at(parts.sectors + sector * TEXELS_OF_ProfileSector).phi;
    let to_phi = load_ProfileSector_at(parts.sectors + (sector + 1u) * TEXELS_OF_ProfileSector).phi;
    let phi = mix(from_phi, to_phi, within);
    let rho = sqrt(max(h * (2.0 - h), 0.0));
    let y = cross(light.p2.xyz, light.p1.xyz);
    return normalize(rho * cos(phi) * light.p2.xyz + rho * sin(phi) * y + (1.0 - h) * light.p1.xyz);
}
