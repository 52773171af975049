// Where light paths are sent, and how densely. Half of them are aimed at what bends light (if it fills less than what the light fills by itself): at the
// spheres around it (`targets`), of which one is chosen by the solid angle (or cross-section) that it shows times its weight, and since spheres overlap, the
// density of a ray is the sum of the weights of the spheres it meets over the sum of all choices. The others go wherever else the light shines: those that meet
// a sphere are given up, since a ray that both halves could make would be one of many to the guide in one of them, and a rare bright one in the other.
// Spheres within each other, around the part of something wide that counts (TARGETS_NESTED), have the weight that gives all of them as many paths from afar;
// from a place in or near one nothing is aimed at it, since that would be anywhere.
#include "common/params.wgsl"
#include "common/math.wgsl"
#include "light/light.wgsl"

#if LIGHT_POINT || LIGHT_AREA || LIGHT_ENVIRONMENT
@group(0) @binding(15) var targets: Table<vec4f>; // centre, radius

// Share of the light paths that are aimed.
const AIMED = 0.5;

// Whether light paths are aimed from where targets show `total` and the light by itself has `wide`.
fn is_aiming(total: f32, wide: f32) -> bool {
    return total > 0.0 && (TARGETS_NESTED || total < wide);
}

// Density of a ray where `wide` is that of the light by itself and `aimed` that of the targets that the ray meets, 0 if it meets none.
fn density_of_halves(wide: f32, aimed: f32) -> f32 {
    return select((1.0 - AIMED) * wide, AIMED * aimed, aimed > 0.0);
}

fn target_at(i: u32) -> vec4f {
    return load_targets(i);
}

fn target_weight(t: vec4f) -> f32 {
    return select(1.0, 1.0 / (t.w * t.w), TARGETS_NESTED);
}

// Whether something is aimed at it from a place at this squared distance.
fn is_target(t: vec4f, d2: f32) -> bool {
    return !TARGETS_NESTED || d2 > 2.0 * t.w * t.w;
}

fn meets_target(t: vec4f, o: vec3f, d: vec3f) -> bool {
    let v = t.xyz - o;
    let b = dot(v, d);
    let l = v - b * d;
    return dot(v, v) <= t.w * t.w || (b > 0.0 && dot(l, l) <= t.w * t.w);
}

// Weight of the targets that the ray meets; from `afar` all of them are some.
fn targets_hit(o: vec3f, d: vec3f, afar: bool) -> f32 {
    var met = 0.0;
    for (var i = 0u; i < TARGETS; i++) {
        let t = target_at(i);
        let v = t.xyz - o;
        met += select(0.0, target_weight(t), meets_target(t, o, d) && (afar || is_target(t, dot(v, v))));
    }
    return met;
}
#endif

#if LIGHT_POINT || LIGHT_AREA
fn target_solid_angle(t: vec4f, p: vec3f) -> f32 {
    let v = t.xyz - p;
    let s2 = t.w * t.w / max(dot(v, v), 1e-30);
    return select(2.0 * PI * s2 / (1.0 + sqrt(max(1.0 - s2, 0.0))), 4.0 * PI, s2 >= 1.0);
}

// Solid angle of a target from `p`, times its weight.
fn target_choice(t: vec4f, p: vec3f) -> f32 {
    let v = t.xyz - p;
    return select(0.0, target_weight(t) * target_solid_angle(t, p), is_target(t, dot(v, v)));
}

fn all_choices(p: vec3f) -> f32 {
    var total = 0.0;
    for (var i = 0u; i < TARGETS; i++) {
        total += target_choice(target_at(i), p);
    }
    return total;
}

// Chooses a target as seen from `p`, where the choices sum up to `total`; what is left of the number goes on.
fn choose_target(p: vec3f, total: f32, u: ptr<function, vec2f>) -> vec4f {
    var left = (*u).x * total;
    var chosen = 0u;
    for (var i = 0u; i + 1u < TARGETS; i++) {
        let w = target_choice(target_at(i), p);
        if (chosen == i && left >= w) {
            left -= w;
            chosen = i + 1u;
        }
    }
    let t = target_at(chosen);
    (*u).x = min(left / target_choice(t, p), 1.0);
    return t;
}

// A direction from `p` to a target.
fn sample_target(t: vec4f, p: vec3f, u: vec2f) -> vec3f {
    let v = t.xyz - p;
    let axis = select(normalize(v), vec3f(0.0, 0.0, 1.0), dot(v, v) == 0.0);
    return normalize(level_frame(axis) * sample_cone(u, target_solid_angle(t, p) / (2.0 * PI)));
}
#endif

#if LIGHT_ENVIRONMENT
fn scene_cross_section() -> f32 {
    return 0.25 * PI * params.scene_diameter * params.scene_diameter;
}

// Cross-section of a target times its weight.
fn cross_section_choice(t: vec4f) -> f32 {
    return target_weight(t) * PI * t.w * t.w;
}

fn all_cross_sections() -> f32 {
    var total = 0.0;
    for (var i = 0u; i < TARGETS; i++) {
        total += cross_section_choice(target_at(i));
    }
    return total;
}

// A point before the scene on a ray along `d` that meets some target.
fn sample_target_line(d: vec3f, u: vec2f) -> vec3f {
    var left = u.x * all_cross_sections();
    var chosen = 0u;
    for (var i = 0u; i + 1u < TARGETS; i++) {
        let w = cross_section_choice(target_at(i));
        if (chosen == i && left >= w) {
            left -= w;
            chosen = i + 1u;
        }
    }
    let t = target_at(chosen);
    let c = t.w * sample_disc(vec2f(min(left / cross_section_choice(t), 1.0), u.y));
    let f = frame_around(d);
    return t.xyz + c.x * f[0] + c.y * f[1] - params.scene_diameter * d;
}
#endif

#if LIGHT_PATHS
#if LIGHT_POINT || LIGHT_AREA || LIGHT_ENVIRONMENT
// True for AIMED of the numbers, what is left of which is spread evenly again.
fn is_aimed(u: ptr<function, vec2f>) -> bool {
    let x = (*u).x;
    let aimed = x < AIMED;
    (*u).x = min(select((x - AIMED) / (1.0 - AIMED), x / AIMED, aimed), 0x1.fffffep-1);
    return aimed;
}
#endif
#endif
