// Where light paths are sent, and how densely. Half of them are aimed at what bends light (if it fills less than what the light fills by itself): at the
// spheres around it (`targets`), of which one is chosen by the solid angle (or cross-section) that it shows, and since spheres overlap, the density of a
// ray is the number of spheres it meets over the sum of all. The others go wherever else the light shines: those that meet a sphere are given up, since a
// ray that both halves could make would be one of many to the guide in one of them, and a rare bright one in the other.
#include "common/params.wgsl"
#include "common/math.wgsl"
#include "light/lights.wgsl"

#if LIGHT_POINT || LIGHT_AREA || LIGHT_ENVIRONMENT
@group(0) @binding(15) var targets: Table<vec4f>; // centre, radius

// Share of the light paths that are aimed.
const AIMED = 0.5;

// Density of a ray that meets `hits` spheres, where `wide` is that of the light by itself and `aimed` that of aiming for one sphere.
fn density_of_halves(wide: f32, aimed: f32, hits: f32) -> f32 {
    return select((1.0 - AIMED) * wide, AIMED * aimed * hits, hits > 0.0);
}

fn target_at(i: u32) -> vec4f {
    return load_targets(i);
}

// How many targets the ray meets.
fn targets_hit(o: vec3f, d: vec3f) -> f32 {
    var count = 0.0;
    for (var i = 0u; i < TARGETS; i++) {
        let t = target_at(i);
        let v = t.xyz - o;
        let b = dot(v, d);
        let l = v - b * d;
        count += select(0.0, 1.0, dot(v, v) <= t.w * t.w || (b > 0.0 && dot(l, l) <= t.w * t.w));
    }
    return count;
}
#endif

#if LIGHT_POINT || LIGHT_AREA
// Solid angle of target `i` from `p`.
fn target_solid_angle(i: u32, p: vec3f) -> f32 {
    let t = target_at(i);
    let v = t.xyz - p;
    let d2 = dot(v, v);
    let s2 = t.w * t.w / max(d2, 1e-30);
    return select(2.0 * PI * s2 / (1.0 + sqrt(max(1.0 - s2, 0.0))), 4.0 * PI, s2 >= 1.0);
}

fn all_solid_angles(p: vec3f) -> f32 {
    var total = 0.0;
    for (var i = 0u; i < TARGETS; i++) {
        total += target_solid_angle(i, p);
    }
    return total;
}

// A direction from `p` to some target, whose solid angles sum up to `total`.
fn sample_target(p: vec3f, total: f32, u: vec2f) -> vec3f {
    var left = u.x * total;
    var chosen = 0u;
    for (var i = 0u; i + 1u < TARGETS; i++) {
        let w = target_solid_angle(i, p);
        if (chosen == i && left >= w) {
            left -= w;
            chosen = i + 1u;
        }
    }
    let solid_angle = target_solid_angle(chosen, p);
    let v = target_at(chosen).xyz - p;
    let axis = select(normalize(v), vec3f(0.0, 0.0, 1.0), dot(v, v) == 0.0);
    return normalize(level_frame(axis) * sample_cone(vec2f(min(left / solid_angle, 1.0), u.y), solid_angle / (2.0 * PI)));
}
#endif

#if LIGHT_POINT
// Solid angle that a point or spot fills; of a profile its flux over its greatest intensity.
fn light_solid_angle(light: Light) -> f32 {
#if LIGHT_PROFILE
    if (light.kind == LIGHT_KIND_PROFILE) {
        return light.p1.w;
    }
#endif
    return select(4.0 * PI, 2.0 * PI * (1.0 - light.p2.y), light.kind == LIGHT_KIND_SPOT);
}

// Density of the directions of a point, spot or profile by itself.
fn pdf_point_light(light: Light, d: vec3f) -> f32 {
#if LIGHT_PROFILE
    if (light.kind == LIGHT_KIND_PROFILE) {
        return profile_towards(light, d).y;
    }
#endif
    return 1.0 / light_solid_angle(light);
}

#if LIGHT_PATHS
fn sample_point_light(light: Light, u: vec2f) -> vec3f {
#if LIGHT_PROFILE
    if (light.kind == LIGHT_KIND_PROFILE) {
        return sample_profile(light, u);
    }
#endif
    return normalize(frame_around(light.p1.xyz) * sample_cone(u, light_solid_angle(light) / (2.0 * PI)));
}
#endif
#endif

#if LIGHT_AREA
// From here on targets fill so much of what a surface lights that its cosine matters more than they do.
const WIDE_TARGETS = PI;
#endif

#if LIGHT_ENVIRONMENT
fn scene_cross_section() -> f32 {
    return 0.25 * PI * params.scene_diameter * params.scene_diameter;
}

fn all_cross_sections() -> f32 {
    var total = 0.0;
    for (var i = 0u; i < TARGETS; i++) {
        let r = target_at(i).w;
        total += PI * r * r;
    }
    return total;
}

// A point before the scene on a ray along `d` that meets some target.
fn sample_target_line(d: vec3f, u: vec2f) -> vec3f {
    var left = u.x * all_cross_sections();
    var chosen = 0u;
    for (var i = 0u; i + 1u < TARGETS; i++) {
        let r = target_at(i).w;
        if (chosen == i && left >= PI * r * r) {
            left -= PI * r * r;
            chosen = i + 1u;
        }
    }
    let t = target_at(chosen);
    let c = t.w * sample_disc(vec2f(min(left / (PI * t.w * t.w), 1.0), u.y));
    let f = frame_around(d);
    return t.xyz + c.x * f[0] + c.y * f[1] - params.scene_diameter * d;
}
#endif

// Density of light paths from `light` that leave `o` (any point of the ray, for a distant light) along `d`, over the cosine at the light where it has
// a surface; never zero where the light shines. `at` is the texel of an environment picture.
fn emission_density(light: Light, o: vec3f, d: vec3f, cos_theta: f32, at: u32) -> f32 {
    switch light.kind {
#if LIGHT_POINT
        case LIGHT_KIND_POINT, LIGHT_KIND_SPOT, LIGHT_KIND_PROFILE: {
            let total = all_solid_angles(o);
            let wide = pdf_point_light(light, d);
            let halves = density_of_halves(wide, 1.0 / total, targets_hit(o, d));
            return light.probability * select(halves, wide, total >= light_solid_angle(light));
        }
#endif
#if LIGHT_BEAM
        case LIGHT_KIND_BEAM: {
            return light.probability / (PI * light.p2.x * light.p2.x);
        }
#endif
#if LIGHT_ENVIRONMENT
        case LIGHT_KIND_SUN, LIGHT_KIND_CONSTANT, LIGHT_KIND_IMAGE: {
            let total = all_cross_sections();
            let wide = 1.0 / scene_cross_section();
            let halves = density_of_halves(wide, 1.0 / total, targets_hit(o - params.scene_diameter * d, d));
            let across = light.probability * select(halves, wide, total * wide >= 1.0);
#if ENV_IMAGE
            if (light.kind == LIGHT_KIND_IMAGE) {
                return across * pdf_environment_image(at);
            }
#endif
            if (light.kind == LIGHT_KIND_SUN) {
                return select(across, across / (2.0 * PI * light.p2.x), light.p2.x > 0.0);
            }
            return across / (4.0 * PI);
        }
#endif
        default: {
#if LIGHT_AREA
            let total = all_solid_angles(o);
            let wide = INV_PI * select(1.0, 0.5, light.two_sided != 0u);
            let halves = density_of_halves(wide, 1.0 / (total * max(abs(cos_theta), 1e-10)), targets_hit(o, d));
            return light.probability / light.area * select(halves, wide, total >= WIDE_TARGETS);
#else
            return 0.0;
#endif
        }
    }
}

#if CAMERA_PATHS
#if LIGHT_SAMPLES
// Density of the light paths that a light sample, seen from `p`, could have come with.
fn emission_density_of_sample(s: LightSample, p: vec3f) -> f32 {
    let light = load_Light(s.index);
    var o = p;
    var cos_theta = 1.0;
#if LIGHT_AREA
    if (light.kind <= LIGHT_KIND_CYLINDER) {
        o = p + s.distance * s.wi;
        cos_theta = dot(normal_of_light(light, o), s.wi);
    }
#endif
#if LIGHT_POINT
    if (light.kind == LIGHT_KIND_POINT || light.kind == LIGHT_KIND_SPOT || light.kind == LIGHT_KIND_PROFILE) {
        o = light.p0.xyz;
    }
#endif
#if ENV_IMAGE
    return emission_density(light, o, -s.wi, cos_theta, s.texel);
#else
    return emission_density(light, o, -s.wi, cos_theta, NONE);
#endif
}
#endif
#endif
