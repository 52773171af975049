// Lights: how one is chosen, and the one switch over their kinds. A kind is a file with `sample_li_NAME` (a sample of the light that arrives at a point) and
// `pdf_li_NAME`, `sample_le_NAME` (the beginning of a light path) and `pdf_le_NAME`, as far as it needs them, and a line in each function here.
#include "common/params.wgsl"
#include "common/math.wgsl"
#include "common/sampler.wgsl"
#include "common/spectra.wgsl"
#if LIGHT_GRID
#include "light/grid.wgsl"
#endif
#if PRECISE_ANGLES
#include "light/angles.wgsl"
#endif
#if LIGHT_TEXTURES
#include "geometry/texture.wgsl"
#endif
#if LIGHT_POINT
#include "light/point.wgsl"
#endif
#if LIGHT_BEAM
#include "light/beam.wgsl"
#endif
#if LIGHT_AREA
#include "light/area.wgsl"
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
    hittable: f32, // 1 for a light that can be hit by chance, else 0
    row: u32,
#if CAUSTICS
    index: u32,
#endif
    primitive: u32, // the emitting primitive, or NONE
#if ENV_IMAGE
    texel: u32, // texel of the environment's picture, or NONE
#endif
#if LIGHT_TEXTURES
    is_textured: bool, // `texels` has what the sampled point emits
    texels: Filtered,
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
    let at = alias_entry(u, params.lights);
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
    if (params.near_share < 1.0 && u >= params.near_share) {
        var left = u - params.near_share;
        var chosen = params.first_distant_light;
        for (var i = params.first_distant_light; i + 1u < params.lights; i++) {
            let share = load_Light(i).probability;
            if (chosen == i && left >= share) {
                left -= share;
                chosen = i + 1u;
            }
        }
        return LightChoice(chosen, load_Light(chosen).probability);
    }
    return choose_near_light(p, u / params.near_share);
#else
    let index = choose_light(u);
    return LightChoice(index, load_Light(index).probability);
#endif
}

// Probability that a camera path at `p` chooses light `index`.
fn probability_of_choice(light: Light, index: u32, p: vec3f) -> f32 {
#if LIGHT_GRID
    if (index < params.first_distant_light) {
        return probability_of_near_light(index, p);
    }
#endif
    return light.probability;
}

// The beginning of a light path.
struct LightRay {
    ray: Ray,
    n: vec3f, // normal of the light's surface, else its axis
    weight: f32, // what is emitted along the ray, over the greatest
    given_up: bool, // the ray is one of the other half's (aim.wgsl)
    texel: u32, // of an environment picture, or NONE
    hittable: f32, // 1 if a camera path could meet the light, else 0
}

fn light_ray(light: Light) -> LightRay {
    return LightRay(Ray(light.p0.xyz, INFINITE, light.p1.xyz, NONE, NONE, false), light.p1.xyz, 1.0, false, NONE, 0.0);
}

#if CAMERA_PATHS
#if NEXT_EVENT_ESTIMATION
// Light incident at `p`, from one light of the scene.
fn sample_light(p: vec3f, u_choice: f32, u: vec2f) -> LightSample {
    let choice = choose_light_for(p, u_choice);
    var light = load_Light(choice.index);
    light.probability = choice.probability;
    var s = sample_li(light, p, u);
#if CAUSTICS
    s.index = choice.index;
#endif
    return s;
}

// Light incident at `p` from this one; without light where there is nothing to see.
fn sample_li(light: Light, p: vec3f, u: vec2f) -> LightSample {
    switch light.kind {
#if LIGHT_POINT
        case LIGHT_KIND_POINT, LIGHT_KIND_SPOT, LIGHT_KIND_PROFILE: {
            return sample_li_point(light, p);
        }
#endif
#if LIGHT_BEAM
        case LIGHT_KIND_BEAM: {
            return sample_li_beam(light, p);
        }
#endif
#if LIGHT_ENVIRONMENT
        case LIGHT_KIND_SUN, LIGHT_KIND_CONSTANT, LIGHT_KIND_IMAGE: {
            return sample_li_environment(light, u);
        }
#endif
        default: {
#if LIGHT_AREA
            return sample_li_area(light, p, u);
#else
            return no_light();
#endif
        }
    }
}
#endif
#endif

#if CAUSTICS
// Density of a sample of light `index` (its `probability` the one at `p`), at the point that a light path came from, seen from its first vertex `p`: per
// solid angle, for a light of zero size 1 / (weight without its shape). `n` is the light's normal there.
fn pdf_li(light: Light, index: u32, p: vec3f, from_light: vec3f, n: vec3f, texel: u32) -> f32 {
    let v = p - from_light;
    let d2 = dot(v, v);
    switch light.kind {
#if LIGHT_POINT
        case LIGHT_KIND_POINT, LIGHT_KIND_SPOT, LIGHT_KIND_PROFILE: {
            return light.probability * d2;
        }
#endif
#if LIGHT_BEAM
        case LIGHT_KIND_BEAM: {
            return light.probability;
        }
#endif
#if LIGHT_ENVIRONMENT
        case LIGHT_KIND_SUN, LIGHT_KIND_CONSTANT, LIGHT_KIND_IMAGE: {
            return pdf_li_environment(light, texel);
        }
#endif
        default: {
#if LIGHT_AREA
            let d = sqrt(d2);
            return pdf_li_area(index, p, d, -v / max(d, 1e-30), n);
#else
            return 0.0;
#endif
        }
    }
}

// Density of light paths from `light` that leave `o` (any point of the ray, for a distant light) along `d`, over the cosine at the light where it has
// a surface; never zero where the light shines. `texel` is that of an environment picture.
fn pdf_le(light: Light, o: vec3f, d: vec3f, cos_theta: f32, texel: u32) -> f32 {
    switch light.kind {
#if LIGHT_POINT
        case LIGHT_KIND_POINT, LIGHT_KIND_SPOT, LIGHT_KIND_PROFILE: {
            return pdf_le_point(light, o, d);
        }
#endif
#if LIGHT_BEAM
        case LIGHT_KIND_BEAM: {
            return pdf_le_beam(light);
        }
#endif
#if LIGHT_ENVIRONMENT
        case LIGHT_KIND_SUN, LIGHT_KIND_CONSTANT, LIGHT_KIND_IMAGE: {
            return pdf_le_environment(light, o, d, texel);
        }
#endif
        default: {
#if LIGHT_AREA
            return pdf_le_area(light, o, d, cos_theta);
#else
            return 0.0;
#endif
        }
    }
}

#if LIGHT_PATHS
// The beginning of a light path from `light`; `u` is for a place, `v` for a direction.
fn sample_le(light: Light, u: vec2f, v: vec2f) -> LightRay {
    switch light.kind {
#if LIGHT_POINT
        case LIGHT_KIND_POINT, LIGHT_KIND_SPOT, LIGHT_KIND_PROFILE: {
            return sample_le_point(light, v);
        }
#endif
#if LIGHT_BEAM
        case LIGHT_KIND_BEAM: {
            return sample_le_beam(light, u);
        }
#endif
#if LIGHT_ENVIRONMENT
        case LIGHT_KIND_SUN, LIGHT_KIND_CONSTANT, LIGHT_KIND_IMAGE: {
            return sample_le_environment(light, u, v);
        }
#endif
        default: {
#if LIGHT_AREA
            return sample_le_area(light, u, v);
#else
            return light_ray(light);
#endif
        }
    }
}
#endif

#if CAMERA_PATHS
#if NEXT_EVENT_ESTIMATION
// Density of the light paths that a light sample, seen from `p`, could have come with.
fn pdf_le_of_sample(s: LightSample, p: vec3f) -> f32 {
    let light = load_Light(s.index);
    var o = p;
    var cos_theta = 1.0;
#if LIGHT_AREA
    if (light.kind <= LIGHT_KIND_CYLINDER) {
        o = p + s.distance * s.wi;
        cos_theta = -dot(normal_of_light(light, o), s.wi);
    }
#endif
#if LIGHT_POINT
    if (light.kind == LIGHT_KIND_POINT || light.kind == LIGHT_KIND_SPOT || light.kind == LIGHT_KIND_PROFILE) {
        o = light.p0.xyz;
    }
#endif
#if ENV_IMAGE
    return pdf_le(light, o, -s.wi, cos_theta, s.texel);
#else
    return pdf_le(light, o, -s.wi, cos_theta, NONE);
#endif
}
#endif
#endif
#endif
