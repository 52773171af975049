// Choosing a light, sampling a point on it, and the pdf of having done so.
#include "common/params.wgsl"
#include "common/math.wgsl"
#include "common/sampler.wgsl"
#include "common/spectra.wgsl"
#if LIGHT_GRID
#include "light/grid.wgsl"
#endif
#if LIGHT_TEXTURES
#include "geometry/texture.wgsl"
#endif
#if PRECISE_ANGLES
#include "light/angles.wgsl"
#endif
#if LIGHT_PROFILE
#include "light/profile.wgsl"
#endif
#if LIGHT_ENVIRONMENT
#include "light/environment.wgsl"
#endif
@group(0) @binding(7) var lights: Table<Light>;

struct LightSample {
    wi: vec3f, // towards the light, unit; zero if there is nothing to see
    distance: f32,
    weight: f32, // radiance (or intensity, irradiance) of `row` times this is the incident light per pdf
    density: f32, // of the sample: pdf per solid angle, choice of light included; for a light of zero size 1 / (weight without its shape)
    chance: f32, // 1 for a light that can be hit by chance, else 0
    row: u32,
#if CAUSTICS
    index: u32,
#endif
    primitive: u32, // the emitting primitive, or NONE
#if ENV_IMAGE
    texel: u32, // texel of the environment's picture, or NONE
#endif
#if LIGHT_TEXTURES
    is_textured: bool, // `light_color` has what the sampled point emits
#endif
}

fn no_light() -> LightSample {
    var s: LightSample;
    s.primitive = NONE;
#if ENV_IMAGE
    s.texel = NONE;
#endif
    return s;
}

// Alias method (Walker 1974; Vose 1991) with a table of `count` entries: the entry that a number is at, and how much of the number is left to keep it or take
// its alias.
fn alias_entry(u: f32, count: u32) -> vec2f {
    let x = u * f32(count);
    let entry = min(floor(x), f32(count - 1u));
    return vec2f(entry, x - entry);
}

// Light `i` with probability its probability.
fn choose_light(u: f32) -> u32 {
    let at = alias_entry(u, LIGHTS);
    let i = u32(at.x);
    return select(load_Light(i).alias_index, i, at.y < load_Light(i).alias_threshold);
}

struct LightChoice {
    index: u32,
    probability: f32,
}

// A light for the point `p`: one that has a place by what it could send there, another by its share.
fn choose_light_for(p: vec3f, u: f32) -> LightChoice {
#if LIGHT_GRID
    if (NEAR_SHARE < 1.0 && u >= NEAR_SHARE) {
        var left = u - NEAR_SHARE;
        var chosen = NEAR_LIGHTS;
        for (var i = NEAR_LIGHTS; i + 1u < LIGHTS; i++) {
            let share = load_Light(i).probability;
            if (chosen == i && left >= share) {
                left -= share;
                chosen = i + 1u;
            }
        }
        return LightChoice(chosen, load_Light(chosen).probability);
    }
    return choose_near_light(p, u / NEAR_SHARE);
#else
    let index = choose_light(u);
    return LightChoice(index, load_Light(index).probability);
#endif
}

// Probability that a camera path at `p` chooses light `index`.
fn probability_of_choice(light: Light, index: u32, p: vec3f) -> f32 {
#if LIGHT_GRID
    if (index < NEAR_LIGHTS) {
        return probability_of_near_light(index, p);
    }
#endif
    return light.probability;
}

#if LIGHT_SPHERE
// 1 - cos of the angle that a sphere subtends, without cancellation for small and distant ones.
fn sphere_one_minus_cos(radius: f32, distance_squared: f32) -> f32 {
    let s2 = min(radius * radius / distance_squared, 1.0);
    return s2 / (1.0 + sqrt(1.0 - s2));
}
#endif

#if LIGHT_AREA
// pdf per solid angle at `p` of hitting light `index` at distance `t` with the normal `n` against direction `d`.
fn pdf_area_light(index: u32, p: vec3f, t: f32, d: vec3f, n: vec3f) -> f32 {
    let light = load_Light(index);
    let probability = probability_of_choice(light, index, p);
#if LIGHT_SPHERE
    if (light.kind == LIGHT_KIND_SPHERE) {
        let v = light.p0.xyz - p;
        let r = light.p2.x;
        let d2 = dot(v, v);
        if (d2 > r * r) {
            return probability / (2.0 * PI * sphere_one_minus_cos(r, d2));
        }
    }
#endif
    return probability * t * t / (light.area * max(abs(dot(n, d)), 1e-20));
}

// Normal of a light's surface at its point `p`.
fn normal_of_light(light: Light, p: vec3f) -> vec3f {
    switch light.kind {
#if LIGHT_TRIANGLE
        case LIGHT_KIND_TRIANGLE: {
            return normalize(cross(light.p1.xyz - light.p0.xyz, light.p2.xyz - light.p0.xyz));
        }
#endif
#if LIGHT_DISC
        case LIGHT_KIND_DISC: {
            return light.p1.xyz;
        }
#endif
        default: {
            // A sphere, or with its axis a cylinder.
            let v = p - light.p0.xyz;
            return normalize(v - dot(v, light.p1.xyz) * light.p1.xyz);
        }
    }
}

#if LIGHT_TEXTURES
// The picture that a light shows, or NONE.
fn texture_of_light(light: Light) -> u32 {
    return select(NONE, bitcast<u32>(light.p0.w), light.kind == LIGHT_KIND_TRIANGLE);
}
#endif

// Radiance of a surface that emits, where it was looked at.
fn radiance_of(light: Light, k: u32) -> vec4f {
#if LIGHT_TEXTURES
    if (texture_of_light(light) != NONE) {
        return light_color[k];
    }
#endif
    return spectrum(light.row, k);
}

fn emits_towards(light: Light, cos_theta: f32) -> bool {
    return cos_theta > 0.0 || light.two_sided != 0u;
}

// A point of the light's surface, uniform in area.
struct LightPoint {
    p: vec3f,
    n: vec3f,
}

fn sample_light_surface(light: Light, u: vec2f) -> LightPoint {
    switch light.kind {
#if LIGHT_DISC
        case LIGHT_KIND_DISC: {
            let c = light.p2.x * sample_disc(u);
            let f = frame_around(light.p1.xyz);
            return LightPoint(light.p0.xyz + c.x * f[0] + c.y * f[1], light.p1.xyz);
        }
#endif
#if LIGHT_CYLINDER
        case LIGHT_KIND_CYLINDER: {
            let f = frame_around(light.p1.xyz);
            let phi = 2.0 * PI * u.x;
            let n = cos(phi) * f[0] + sin(phi) * f[1];
            return LightPoint(light.p0.xyz + light.p2.y * u.y * light.p1.xyz + light.p2.x * n, n);
        }
#endif
#if LIGHT_SPHERE
        case LIGHT_KIND_SPHERE: {
            let z = 1.0 - 2.0 * u.x;
            let phi = 2.0 * PI * u.y;
            let rho = sqrt(max(0.0, 1.0 - z * z));
            let n = vec3f(rho * cos(phi), rho * sin(phi), z);
            return LightPoint(light.p0.xyz + light.p2.x * n, n);
        }
#endif
        default: {
            // Low-distortion map to the triangle (Heitz 2019).
            let b = select(vec2f(0.5 * u.x, u.y - 0.5 * u.x), vec2f(u.x - 0.5 * u.y, 0.5 * u.y), u.x > u.y);
            let e1 = light.p1.xyz - light.p0.xyz;
            let e2 = light.p2.xyz - light.p0.xyz;
            return LightPoint(light.p0.xyz + b.x * e1 + b.y * e2, normalize(cross(e1, e2)));
        }
    }
}

fn sample_area_light(light: Light, p: vec3f, u: vec2f) -> LightSample {
    var s = no_light();
    s.row = light.row;
    s.primitive = light.primitive;
    s.chance = 1.0;
#if LIGHT_SPHERE
    if (light.kind == LIGHT_KIND_SPHERE) {
        let v = light.p0.xyz - p;
        let r = light.p2.x;
        let d2 = dot(v, v);
        if (d2 > r * r) {
            let omc = sphere_one_minus_cos(r, d2);
            s.wi = normalize(frame_around(v * inverseSqrt(d2)) * sample_cone(u, omc));
            let b = dot(v, s.wi);
            let l = v - b * s.wi;
            s.distance = b - sqrt(max(0.0, r * r - dot(l, l)));
            s.density = light.probability / (2.0 * PI * omc);
            s.weight = 1.0 / s.density;
            return s;
        }
    }
#endif
    let point = sample_light_surface(light, u);
    let n = point.n;
    let v = point.p - p;
    let d2 = dot(v, v);
    if (d2 == 0.0) {
        return s;
    }
    let wi = v * inverseSqrt(d2);
    let cos_theta = -dot(n, wi);
    if (!emits_towards(light, cos_theta) || cos_theta == 0.0) {
        return s;
    }
#if LIGHT_CYLINDER
    if (light.kind == LIGHT_KIND_CYLINDER && cos_theta < 0.0) {
        // The inside of a tube. Its own near wall may be in the way, which a shadow ray aimed at this primitive leaves out: the other root from
        // the sampled point back. Where `p` lies on the tube that root is `p` itself.
        let along = dot(wi, light.p1.xyz);
        let back = -2.0 * light.p2.x * cos_theta / max(1.0 - along * along, 1e-20);
        let height = dot(point.p - light.p0.xyz, light.p1.xyz) - back * along;
        if (back < 0.9999 * sqrt(d2) && height >= 0.0 && height <= light.p2.y) {
            return s;
        }
    }
#endif
#if LIGHT_TEXTURES
    look_at_light(texture_of_light(light), light.primitive, point.p);
    s.is_textured = texture_of_light(light) != NONE;
#endif
    s.wi = wi;
    s.distance = sqrt(d2);
    s.density = light.probability * d2 / (light.area * abs(cos_theta));
    s.weight = 1.0 / s.density;
    return s;
}
#endif

#if LIGHT_POINT
// Intensity of a point, spot or profile along `d`, over its greatest.
fn intensity_along(light: Light, d: vec3f) -> f32 {
#if LIGHT_PROFILE
    if (light.kind == LIGHT_KIND_PROFILE) {
        return profile_towards(light, d).x;
    }
#endif
    return select(1.0, smoothstep(light.p2.y, light.p2.x, dot(d, light.p1.xyz)), light.kind == LIGHT_KIND_SPOT);
}
#endif

#if CAMERA_PATHS
#if LIGHT_SAMPLES
// Light incident at `p`, from one light of the scene.
fn sample_light(p: vec3f, u_choice: f32, u: vec2f) -> LightSample {
    let choice = choose_light_for(p, u_choice);
    var light = load_Light(choice.index);
    light.probability = choice.probability;
    var s = sample_light_of(light, p, u);
#if CAUSTICS
    s.index = choice.index;
#endif
    return s;
}

fn sample_light_of(light: Light, p: vec3f, u: vec2f) -> LightSample {
    var s = no_light();
    s.row = light.row;
    switch light.kind {
#if LIGHT_POINT
        case LIGHT_KIND_POINT, LIGHT_KIND_SPOT, LIGHT_KIND_PROFILE: {
            let v = light.p0.xyz - p;
            let d2 = dot(v, v);
            if (d2 > 0.0) {
                s.wi = v * inverseSqrt(d2);
                s.distance = sqrt(d2);
                s.density = light.probability * d2;
                s.weight = intensity_along(light, -s.wi) / s.density;
            }
        }
#endif
#if LIGHT_BEAM
        case LIGHT_KIND_BEAM: {
            let v = p - light.p0.xyz;
            let along = dot(v, light.p1.xyz);
            let across = v - along * light.p1.xyz;
            if (along > 0.0 && dot(across, across) <= light.p2.x * light.p2.x) {
                s.wi = -light.p1.xyz;
                s.distance = along;
                s.density = light.probability;
                s.weight = 1.0 / s.density;
            }
        }
#endif
#if LIGHT_SUN
        case LIGHT_KIND_SUN: {
            s.distance = INFINITE;
            let omc = light.p2.x;
            if (omc > 0.0) {
                s.wi = normalize(frame_around(-light.p1.xyz) * sample_cone(u, omc));
                s.density = light.probability / (2.0 * PI * omc);
                s.chance = 1.0;
            } else {
                s.wi = -light.p1.xyz;
                s.density = light.probability;
            }
            s.weight = 1.0 / s.density;
        }
#endif
#if ENV_CONSTANT
        case LIGHT_KIND_CONSTANT: {
            s.wi = frame_around(vec3f(0.0, 0.0, 1.0)) * sample_cone(u, 2.0);
            s.distance = INFINITE;
            s.density = light.probability / (4.0 * PI);
            s.weight = 1.0 / s.density;
            s.chance = 1.0;
        }
#endif
#if ENV_IMAGE
        case LIGHT_KIND_IMAGE: {
            return sample_environment_image(light, u);
        }
#endif
        default: {
#if LIGHT_AREA
            return sample_area_light(light, p, u);
#endif
        }
    }
    return s;
}
#endif
#endif
