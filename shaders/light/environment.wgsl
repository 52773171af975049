// Light from beyond the scene: the sun, a constant environment, a latitude-longitude picture.
#include "common/math.wgsl"
#include "light/light.wgsl"
#if CAUSTICS
#include "light/aim.wgsl"
#endif
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

// Where a texel stands in the table: how it is chosen, then what is in it.
fn place_in_environment(light: Light, at: u32) -> u32 {
#if ENV_SPECTRA
    return (light.two_sided + 1u) * at;
#else
    return 2u * at;
#endif
}

#if ENV_SPECTRA
// The value of a bin of the texel that begins at `first`.
fn environment_bin(first: u32, bin: f32) -> f32 {
    let n = u32(bin);
    return component(load_environment(first + n / 4u), n % 4u);
}
#endif

// Radiance of a texel: upsampled colour, or what its bins have, times what all are multiplied by.
fn environment_radiance(light: Light, at: u32, k: u32) -> vec4f {
    let first = place_in_environment(light, at) + 1u;
    let x = spectrum(bitcast<u32>(light.p2.w), k);
#if ENV_SPECTRA
    let bins = vec4f(environment_bin(first, x.x), environment_bin(first, x.y), environment_bin(first, x.z), environment_bin(first, x.w));
    return bins * spectrum(light.row, k);
#else
    let c = load_environment(first);
    let t = (c.x * x + c.y) * x + c.z;
    return c.w * (0.5 + 0.5 * t * inverseSqrt(1.0 + t * t)) * spectrum(light.row, k);
#endif
}

fn pdf_environment_image(light: Light, at: u32) -> f32 {
    return load_environment(place_in_environment(light, at)).z;
}

fn sample_environment_image(light: Light, u: vec2f) -> LightSample {
    var s = no_light();
    let width = light.p0.w;
    let height = light.p1.w;
    let x = u.x * width * height;
    var at = u32(min(x, width * height - 1.0));
    let alias_entry = load_environment(place_in_environment(light, at));
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
    s.density = light.probability * pdf_environment_image(light, at);
    s.weight = 1.0 / s.density;
    s.hittable = 1.0;
    return s;
}
#endif

fn sample_li_environment(light: Light, u: vec2f) -> LightSample {
#if ENV_IMAGE
    if (light.kind == LIGHT_KIND_IMAGE) {
        return sample_environment_image(light, u);
    }
#endif
    var s = no_light();
    s.row = light.row;
#if LIGHT_SUN
    if (light.kind == LIGHT_KIND_SUN) {
        s.distance = INFINITE;
        let omc = light.p2.x;
        if (omc > 0.0) {
            s.wi = normalize(frame_around(-light.p1.xyz) * sample_cone(u, omc));
            s.density = light.probability / (2.0 * PI * omc);
            s.hittable = 1.0;
        } else {
            s.wi = -light.p1.xyz;
            s.density = light.probability;
        }
        s.weight = 1.0 / s.density;
        return s;
    }
#endif
    s.wi = frame_around(vec3f(0.0, 0.0, 1.0)) * sample_cone(u, 2.0);
    s.distance = INFINITE;
    s.density = light.probability / (4.0 * PI);
    s.weight = 1.0 / s.density;
    s.hittable = 1.0;
    return s;
}

fn pdf_li_environment(light: Light, texel: u32) -> f32 {
#if ENV_IMAGE
    if (light.kind == LIGHT_KIND_IMAGE) {
        return light.probability * pdf_environment_image(light, texel);
    }
#endif
    if (light.kind == LIGHT_KIND_SUN) {
        return light.probability * select(1.0, 1.0 / (2.0 * PI * light.p2.x), light.p2.x > 0.0);
    }
    return light.probability / (4.0 * PI);
}

#if CAUSTICS
fn pdf_le_environment(light: Light, o: vec3f, d: vec3f, at: u32) -> f32 {
    let total = all_cross_sections();
    let wide = 1.0 / scene_cross_section();
    let halves = density_of_halves(wide, targets_hit(o - params.scene_diameter * d, d, true) / total);
    let across = light.probability * select(wide, halves, is_aiming(total * wide, 1.0));
#if ENV_IMAGE
    if (light.kind == LIGHT_KIND_IMAGE) {
        return across * pdf_environment_image(light, at);
    }
#endif
    if (light.kind == LIGHT_KIND_SUN) {
        return select(across, across / (2.0 * PI * light.p2.x), light.p2.x > 0.0);
    }
    return across / (4.0 * PI);
}

#if LIGHT_PATHS
fn sample_le_environment(light: Light, u: vec2f, v: vec2f) -> LightRay {
    var l = light_ray(light);
    var place = u;
    l.hittable = 1.0;
    if (light.kind == LIGHT_KIND_SUN) {
        let omc = light.p2.x;
        if (omc > 0.0) {
            l.ray.d = normalize(frame_around(l.n) * sample_cone(v, omc));
        } else {
            l.hittable = 0.0;
        }
    } else if (light.kind == LIGHT_KIND_CONSTANT) {
        l.ray.d = frame_around(vec3f(0.0, 0.0, 1.0)) * sample_cone(v, 2.0);
    } else {
#if ENV_IMAGE
        let s = sample_environment_image(light, v);
        l.ray.d = -s.wi;
        l.texel = s.texel;
#endif
    }
    let halves = is_aiming(all_cross_sections(), scene_cross_section());
    let aimed = halves && is_aimed(&place);
    if (aimed) {
        l.ray.o = sample_target_line(l.ray.d, place);
    } else {
        let c = 0.5 * params.scene_diameter * sample_disc(place);
        let f = frame_around(l.ray.d);
        l.ray.o = c.x * f[0] + c.y * f[1] - params.scene_diameter * l.ray.d;
    }
    l.given_up = halves && aimed != (targets_hit(l.ray.o, l.ray.d, true) > 0.0);
    return l;
}
#endif
#endif

#if CAMERA_PATHS
// Density of the light paths that come in along a ray escaping towards `d`.
fn distant_emission(light: Light, d: vec3f, at: u32) -> f32 {
#if CAUSTICS
    if (path.light_path_density > 0.0) {
        return pdf_le(light, path.last_vertex, -d, 1.0, at);
    }
#endif
    return 0.0;
}

// Adds what an escaping ray sees.
fn add_environment(d: vec3f) {
    for (var i = params.first_distant_light; i < params.lights; i++) {
        let light = load_Light(i);
        switch light.kind {
#if ENV_CONSTANT
            case LIGHT_KIND_CONSTANT: {
                let w = mis_weight_emitter_hit(light.probability / (4.0 * PI), distant_emission(light, d, NONE));
                for (var k = 0u; k < WAVELENGTHS4; k++) {
                    li[k] += w * beta[k] * spectrum(light.row, k);
                }
            }
#endif
#if ENV_IMAGE
            case LIGHT_KIND_IMAGE: {
                let at = environment_texel(light, d);
                let w = mis_weight_emitter_hit(light.probability * pdf_environment_image(light, at), distant_emission(light, d, at));
                for (var k = 0u; k < WAVELENGTHS4; k++) {
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
                    let w = mis_weight_emitter_hit(light.probability / (2.0 * PI * omc), distant_emission(light, d, NONE));
                    for (var k = 0u; k < WAVELENGTHS4; k++) {
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
