// Light paths begin: a light by its power, a point and a direction on it. beta becomes flux per probability, W nm^-1.
#include "common/sampler.wgsl"
#include "light/lights.wgsl"
#include "light/aim.wgsl"
#if GUIDED
#include "light/guide.wgsl"
#endif
#include "path/state.wgsl"

#if LIGHT_POINT || LIGHT_AREA || LIGHT_ENVIRONMENT
// True for AIMED of the numbers, what is left of which is spread evenly again.
fn is_aimed(u: ptr<function, vec2f>) -> bool {
    let x = (*u).x;
    let aimed = x < AIMED;
    (*u).x = min(select((x - AIMED) / (1.0 - AIMED), x / AIMED, aimed), 0x1.fffffep-1);
    return aimed;
}
#endif

fn emit() -> Ray {
#if GUIDED
    let guided = guided_numbers();
    var u = guided.at.xy;
    var v = guided.at.zw;
    let index = choose_light(guided.choices.x);
#else
    let index = choose_light(next_1d());
    var u = next_2d();
    var v = next_2d();
#endif
    let light = load_Light(index);
    var ray = Ray(light.p0.xyz, INFINITE, light.p1.xyz, NONE, NONE, false);
    var n = light.p1.xyz;
    var weight = 1.0;
    var given_up = false;
    var at = NONE;
    var chance = 0.0;
    switch light.kind {
#if LIGHT_POINT
        case LIGHT_KIND_POINT, LIGHT_KIND_SPOT, LIGHT_KIND_PROFILE: {
            let total = all_solid_angles(ray.o);
            let wide = light_solid_angle(light);
            let halves = total < wide;
            let aimed = halves && is_aimed(&v);
            if (aimed) {
                ray.d = sample_target(ray.o, total, v);
            } else {
                ray.d = sample_point_light(light, v);
            }
            given_up = halves && aimed != (targets_hit(ray.o, ray.d) > 0.0);
            weight = intensity_along(light, ray.d);
        }
#endif
#if LIGHT_BEAM
        case LIGHT_KIND_BEAM: {
            let c = light.p2.x * sample_disc(u);
            let f = frame_around(n);
            ray.o += c.x * f[0] + c.y * f[1];
        }
#endif
#if LIGHT_ENVIRONMENT
        case LIGHT_KIND_SUN, LIGHT_KIND_CONSTANT, LIGHT_KIND_IMAGE: {
            chance = 1.0;
            if (light.kind == LIGHT_KIND_SUN) {
                let omc = light.p2.x;
                if (omc > 0.0) {
                    ray.d = normalize(frame_around(n) * sample_cone(v, omc));
                } else {
                    chance = 0.0;
                }
            } else if (light.kind == LIGHT_KIND_CONSTANT) {
                ray.d = frame_around(vec3f(0.0, 0.0, 1.0)) * sample_cone(v, 2.0);
            } else {
#if ENV_IMAGE
                let s = sample_environment_image(light, v);
                ray.d = -s.wi;
                at = s.texel;
#endif
            }
            let halves = all_cross_sections() < scene_cross_section();
            let aimed = halves && is_aimed(&u);
            if (aimed) {
                ray.o = sample_target_line(ray.d, u);
            } else {
                let c = 0.5 * params.scene_diameter * sample_disc(u);
                let f = frame_around(ray.d);
                ray.o = c.x * f[0] + c.y * f[1] - params.scene_diameter * ray.d;
            }
            given_up = halves && aimed != (targets_hit(ray.o, ray.d) > 0.0);
        }
#endif
        default: {
#if LIGHT_AREA
            chance = 1.0;
            let point = sample_light_surface(light, u);
            n = point.n;
            ray.o = point.p;
            let total = all_solid_angles(ray.o);
            let halves = total < WIDE_TARGETS;
            let aimed = halves && is_aimed(&v);
            if (aimed) {
                ray.d = sample_target(ray.o, total, v);
            } else {
                let back = light.two_sided != 0u && v.x < 0.5;
                let x = select(v.x, fract(2.0 * v.x), light.two_sided != 0u);
                ray.d = normalize(frame_around(select(n, -n, back)) * sample_cosine(vec2f(x, v.y)));
            }
            given_up = halves && aimed != (targets_hit(ray.o, ray.d) > 0.0);
            if (!emits_towards(light, dot(n, ray.d))) {
                weight = 0.0;
            }
            ray.from_primitive = light.primitive;
#if LIGHT_TEXTURES
            look_at_light(texture_of_light(light), light.primitive, ray.o);
#endif
#endif
        }
    }
    let cos_theta = dot(n, ray.d);
    let density = emission_density(light, ray.o, ray.d, cos_theta, at);
    weight = select(weight, 0.0, given_up);
#if GUIDED
    weight = safe_ratio(weight, density * guide_density);
#else
    weight = safe_ratio(weight, density);
#endif
#if LIGHT_AREA
    if (light.kind <= LIGHT_KIND_CYLINDER) {
        ray.o += sign(cos_theta) * GAMMA_7 * dot(abs(n), abs(ray.o)) * n;
    }
#endif
    for (var k = 0u; k < LANES4; k++) {
        let lit = select(vec4f(0.0), vec4f(weight), vec4u(4u * k, 4u * k + 1u, 4u * k + 2u, 4u * k + 3u) < vec4u(LANES));
#if ENV_IMAGE
        if (at != NONE) {
            beta[k] = lit * environment_radiance(light, at, k);
            continue;
        }
#endif
#if LIGHT_AREA
        beta[k] = lit * radiance_of(light, k);
#else
        beta[k] = lit * spectrum(light.row, k);
#endif
    }
#if INTERIORS
    inside = light.inside;
#endif
    start_path(ray);
    path.at_joints = 1.0;
#if CHANCE
    path.chance = chance;
#endif
    path.emission = f32(params.light_paths) * density;
    path.light = index;
    path.light_normal = n;
    path.light_texel = at;
    return ray;
}

#if LIGHT_SAMPLES
// Density of a light sample of the point that this path comes from, seen from `p`, its first vertex.
fn light_density_at(p: vec3f) -> f32 {
    var light = load_Light(path.light);
    light.probability = probability_of_choice(light, path.light, p);
    let v = p - path.last_vertex;
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
        case LIGHT_KIND_SUN: {
            return light.probability * select(1.0, 1.0 / (2.0 * PI * light.p2.x), light.p2.x > 0.0);
        }
        case LIGHT_KIND_CONSTANT: {
            return light.probability / (4.0 * PI);
        }
#if ENV_IMAGE
        case LIGHT_KIND_IMAGE: {
            return light.probability * pdf_environment_image(path.light_texel);
        }
#endif
#endif
        default: {
#if LIGHT_AREA
            let d = sqrt(d2);
            return pdf_area_light(path.light, p, d, v / max(d, 1e-30), path.light_normal);
#else
            return 0.0;
#endif
        }
    }
}
#endif
