// Measured distributions of lamps (src/scene/profile.rs; the table: src/gpu/profiles.rs). A profile's texels: numbers of rings and sectors; edges of rings
// (polar angle, 1 - its cosine, share of the flux before it); edges of sectors (azimuth); two for each cell, ring by ring: its corners' intensities; share
// of its ring's flux before it and up to its end, pdf per solid angle. Within a cell directions are sampled evenly.
@group(0) @binding(23) var profiles: Table;

fn profile_texel(i: u32) -> vec4f {
    return bitcast<vec4f>(fetch(profiles, i));
}

// Of `count` intervals the one that `x` lies in; they begin at component `which` of the texels from `first` on, `stride` apart.
fn profile_interval(first: u32, stride: u32, which: u32, count: u32, x: f32) -> u32 {
    var low = 0u;
    var high = count;
    while (low + 1u < high) {
        let middle = (low + high) / 2u;
        let above = component(profile_texel(first + stride * middle), which) <= x;
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
    let first = bitcast<u32>(light.p0.w);
    let size = fetch(profiles, first).xy;
    let rings = first + 1u;
    let sectors = rings + size.x + 1u;
    let ring = profile_interval(rings, 1u, 0u, size.x, theta);
    let sector = profile_interval(sectors, 1u, 0u, size.y, phi);
    let from_theta = profile_texel(rings + ring).x;
    let to_theta = profile_texel(rings + ring + 1u).x;
    if (theta < from_theta || theta > to_theta) {
        return vec2f(0.0);
    }
    let from_phi = profile_texel(sectors + sector).x;
    let to_phi = profile_texel(sectors + sector + 1u).x;
    let cell = sectors + size.y + 1u + 2u * (ring * size.y + sector);
    let c = profile_texel(cell);
    let across = mix(c.xy, c.zw, clamp((phi - from_phi) / (to_phi - from_phi), 0.0, 1.0));
    return vec2f(mix(across.x, across.y, (theta - from_theta) / (to_theta - from_theta)), profile_texel(cell + 1u).z);
}

fn sample_profile(light: Light, u: vec2f) -> vec3f {
    let first = bitcast<u32>(light.p0.w);
    let size = fetch(profiles, first).xy;
    let rings = first + 1u;
    let sectors = rings + size.x + 1u;
    let ring = profile_interval(rings, 1u, 2u, size.x, u.x);
    let cells = sectors + size.y + 1u + 2u * ring * size.y;
    let sector = profile_interval(cells + 1u, 2u, 0u, size.y, u.y);
    let low = profile_texel(rings + ring);
    let high = profile_texel(rings + ring + 1u);
    let share = profile_texel(cells + 2u * sector + 1u).xy;
    let h = mix(low.y, high.y, clamp((u.x - low.z) / max(high.z - low.z, 1e-30), 0.0, 1.0));
    let within = clamp((u.y - share.x) / max(share.y - share.x, 1e-30), 0.0, 1.0);
    let phi = mix(profile_texel(sectors + sector).x, profile_texel(sectors + sector + 1u).x, within);
    let rho = sqrt(max(h * (2.0 - h), 0.0));
    let y = cross(light.p2.xyz, light.p1.xyz);
    return normalize(rho * cos(phi) * light.p2.xyz + rho * sin(phi) * y + (1.0 - h) * light.p1.xyz);
}
