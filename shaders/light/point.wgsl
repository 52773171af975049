// Lights at a point: the same intensity everywhere, in a cone (spot), or as measured (profile).
#include "light/light.wgsl"
#if CAUSTICS
#include "light/aim.wgsl"
#endif
#if LIGHT_PROFILE
#include "light/profile.wgsl"
#endif

// Intensity of a point, spot or profile along `d`, over its greatest.
fn intensity_along(light: Light, d: vec3f) -> f32 {
#if LIGHT_PROFILE
    if (light.kind == LIGHT_KIND_PROFILE) {
        return profile_towards(light, d).x;
    }
#endif
    let eased = smoothstep(light.p2.y, light.p2.x, dot(d, light.p1.xyz));
    let share = clamp((dot(d, light.p1.xyz) - light.p2.y) / (light.p2.x - light.p2.y), 0.0, 1.0);
    let falloff = select(eased, share * share, light.p2.z > 0.0);
    return select(1.0, falloff, light.kind == LIGHT_KIND_SPOT);
}

fn sample_li_point(light: Light, p: vec3f) -> LightSample {
    var s = no_light();
    s.row = light.row;
    let v = light.p0.xyz - p;
    let d2 = dot(v, v);
    if (d2 > 0.0) {
        s.wi = v * inverseSqrt(d2);
        s.distance = sqrt(d2) * (1.0 - light.p2.w);
        s.density = light.probability * d2;
        s.weight = intensity_along(light, -s.wi) / s.density;
    }
    return s;
}

#if CAUSTICS
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

// The directions are those of a light path that leaves `o` along `d`.
fn pdf_le_point(light: Light, o: vec3f, d: vec3f) -> f32 {
    let total = all_choices(o);
    let wide = pdf_point_light(light, d);
    let halves = density_of_halves(wide, targets_hit(o, d, false) / total);
    return light.probability * select(wide, halves, is_aiming(total, light_solid_angle(light)));
}

#if LIGHT_PATHS
fn sample_le_point(light: Light, v: vec2f) -> LightRay {
    var l = light_ray(light);
    var direction = v;
    let total = all_choices(l.ray.o);
    let wide = light_solid_angle(light);
    let halves = is_aiming(total, wide);
    let aimed = halves && is_aimed(&direction);
    if (aimed) {
        l.ray.d = sample_target(choose_target(l.ray.o, total, &direction), l.ray.o, direction);
    } else {
        l.ray.d = sample_point_light(light, direction);
    }
    l.given_up = halves && aimed != (targets_hit(l.ray.o, l.ray.d, false) > 0.0);
    l.weight = intensity_along(light, l.ray.d);
    return l;
}
#endif
#endif
