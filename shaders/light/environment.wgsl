// Light from beyond the scene: the sun, a constant environment, a latitude-longitude picture.
#include "common/math.wgsl"
#include "light/lights.wgsl"
#if CAMERA_PATHS
#include "path/mis.wgsl"
#endif
#if ENV_IMAGE
@group(0) @binding(11) var environment: Table<vec4f>;
#endif

#if ENV_IMAGE
// Texel seen in direction `d`.
fn environment_texel(light: Light, d: vec3f) -> u32 {
    let local = vec3f(dot(light.p0.xyz, d), dot(light.p1.xyz, d), dot(light.p2.xyz, d));
    let width = light.p0.w;
    let height = light.p1.w;
    let u = fract(atan2_precise(local.z, local.x) / (2.0 * PI) + 1.0);
    let v = atan2_precise(length(local.xz), local.y) / PI;
    let column = min(floor(u * width), width - 1.0);
    let row = min(floor(v * height), height - 1.0);
    return u32(row * width + column);
}

// Radiance of a texel: upsampled colour times the colour space's white.
fn environment_radiance(light: Light, at: u32, k: u32) -> vec4f {
    let c = load_environment(2u * at);
    let x = spectrum(bitcast<u32>(light.p2.w), k);
    let t = (c.x * x + c.y) * x + c.z;
    return c.w * (0.5 + 0.5 * t * inverseSqrt(1.0 + t * t)) * spectrum(light.row, k);
}

fn pdf_environment_image(at: u32) -> f32 {
    return load_environment(2u * at + 1u).z;
}

fn sample_environment_image(light: Light, u: vec2f) -> LightSample {
    var s = no_light();
    let width = light.p0.w;
    let height = light.p1.w;
    let x = u.x * width * height;
    var at = u32(min(x, width * height - 1.0));
    let alias_entry = load_environment(2u * at + 1u);
    let f = x - f32(at);
    var within = f / alias_entry.x;
    if (f >= alias_entry.x) {
        at = bitcast<u32>(alias_entry.y);
        within = (f - alias_entry.x) / (1.0 - alias_entry.x);
    }
    // Uniform over the texel's solid angle: azimuth and cosine of the polar angle.
    let column = f32(at % u32(width));
    let row = f32(at / u32(width));
    let top = cos(PI * row / height);
    let bottom = cos(PI * (row + 1.0) / height);
    let y = mix(top, bottom, clamp(within, 0.0, 1.0));
    let phi = 2.0 * PI * (column + u.y) / width;
    let rho = sqrt(max(0.0, 1.0 - y * y));
    let local = vec3f(rho * cos(phi), y, rho * sin(phi));
    s.wi = normalize(local.x * light.p0.xyz + local.y * light.p1.xyz + local.z * light.p2.xyz);
    s.distance = INFINITE;
    s.texel = at;
    s.row = light.row;
    s.density = light.probability * pdf_environment_image(at);
    s.weight = 1.0 / s.density;
    s.chance = 1.0;
    return s;
}
#endif

#if CAMERA_PATHS
// Density of the light paths that come in along a ray escaping towards `d`.
fn distant_emission(light: Light, d: vec3f, at: u32) -> f32 {
#if CAUSTICS
    if (path.joins > 0.0) {
        return emission_density(light, path.last_vertex, -d, 1.0, at);
    }
#endif
    return 0.0;
}

// Adds what an escaping ray sees.
fn add_environment(d: vec3f) {
    for (var i = FIRST_DISTANT_LIGHT; i < LIGHTS; i++) {
        let light = load_Light(i);
        switch light.kind {
#if ENV_CONSTANT
            case LIGHT_KIND_CONSTANT: {
                let w = chance_share(light.probability / (4.0 * PI), distant_emission(light, d, NONE));
                for (var k = 0u; k < LANES4; k++) {
                    li[k] += w * beta[k] * spectrum(light.row, k);
                }
            }
#endif
#if ENV_IMAGE
            case LIGHT_KIND_IMAGE: {
                let at = environment_texel(light, d);
                let w = chance_share(light.probability * pdf_environment_image(at), distant_emission(light, d, at));
                for (var k = 0u; k < LANES4; k++) {
                    li[k] += w * beta[k] * environment_radiance(light, at, k);
                }
            }
#endif
#if LIGHT_SUN
            case LIGHT_KIND_SUN: {
                let omc = light.p2.x;
                let v = d + light.p1.xyz;
                // |d - axis|^2 = 2 (1 - cos): keeps its digits for a small sun.
                if (omc > 0.0 && dot(v, v) <= 2.0 * omc) {
                    let w = chance_share(light.probability / (2.0 * PI * omc), distant_emission(light, d, NONE));
                    for (var k = 0u; k < LANES4; k++) {
                        li[k] += w * beta[k] * spectrum(light.row, k);
                    }
                }
            }
#endif
            default: {}
        }
    }
}
#endif
