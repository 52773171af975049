// Light paths: a light by its power, a point and a direction on it. beta becomes flux per probability, W nm^-1.
//
// Only paths that meet a smooth mirror or glass first are wanted, so light is shot only at the spheres around those (`targets`): one is chosen by the
// solid angle (or cross-section) that it shows, and since spheres overlap, the density of a ray is the number of spheres it hits over the sum of all.
#if LIGHT_POINT || LIGHT_AREA || LIGHT_ENVIRONMENT
@group(0) @binding(15) var targets: Table; // centre, radius

fn target_at(i: u32) -> vec4f {
    return bitcast<vec4f>(fetch(targets, i));
}

// Solid angle of target `i` from `p`.
fn target_solid_angle(i: u32, p: vec3f) -> f32 {
    let t = target_at(i);
    let v = t.xyz - p;
    let d2 = dot(v, v);
    let s2 = t.w * t.w / max(d2, 1e-30);
    return select(2.0 * PI * s2 / (1.0 + sqrt(max(1.0 - s2, 0.0))), 4.0 * PI, s2 >= 1.0);
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
    // Rounding must not lose the target that was aimed at.
    return max(count, 1.0);
}

struct Aim {
    v: vec3f, // a direction, or an origin
    weight: f32, // 1 / density
}

// A direction from `p` to some target; density per solid angle.
fn aim_from(p: vec3f, u_choice: f32, u: vec2f) -> Aim {
    var total = 0.0;
    for (var i = 0u; i < TARGETS; i++) {
        total += target_solid_angle(i, p);
    }
    var left = u_choice * total;
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
    let d = normalize(frame_around(axis) * sample_cone(u, solid_angle / (2.0 * PI)));
    return Aim(d, total / targets_hit(p, d));
}

// An origin, outside the scene, of a ray along `d` that meets some target; density per cross-section.
fn aim_along(d: vec3f, u_choice: f32, u: vec2f) -> Aim {
    var total = 0.0;
    for (var i = 0u; i < TARGETS; i++) {
        let r = target_at(i).w;
        total += PI * r * r;
    }
    var left = u_choice * total;
    var chosen = 0u;
    for (var i = 0u; i + 1u < TARGETS; i++) {
        let r = target_at(i).w;
        if (chosen == i && left >= PI * r * r) {
            left -= PI * r * r;
            chosen = i + 1u;
        }
    }
    let t = target_at(chosen);
    let c = t.w * sample_disc(u);
    let f = frame_around(d);
    let o = t.xyz + c.x * f[0] + c.y * f[1] - params.scene_diameter * d;
    return Aim(o, total / targets_hit(o, d));
}
#endif

fn emit() -> Ray {
    let index = choose_light(next_1d());
    let light = light_at(index);
    let choice = next_1d();
    let u = next_2d();
    let v = next_2d();
    var ray = Ray(light.p0.xyz, INFINITE, light.p1.xyz, NONE, NONE, false);
    var weight = 1.0 / light.probability;
    var texel_index = NONE;
    switch light.kind {
#if LIGHT_POINT
        case LIGHT_KIND_POINT, LIGHT_KIND_SPOT: {
            let aim = aim_from(ray.o, choice, v);
            ray.d = aim.v;
            weight *= aim.weight;
            if (light.kind == LIGHT_KIND_SPOT) {
                weight *= smoothstep(light.p2.y, light.p2.x, dot(aim.v, light.p1.xyz));
            }
        }
#endif
#if LIGHT_BEAM
        case LIGHT_KIND_BEAM: {
            let c = light.p2.x * sample_disc(u);
            let f = frame_around(light.p1.xyz);
            ray.o += c.x * f[0] + c.y * f[1];
            weight *= PI * light.p2.x * light.p2.x;
        }
#endif
#if LIGHT_ENVIRONMENT
        case LIGHT_KIND_SUN, LIGHT_KIND_CONSTANT, LIGHT_KIND_IMAGE: {
            if (light.kind == LIGHT_KIND_SUN) {
                let omc = light.p2.x;
                if (omc > 0.0) {
                    ray.d = normalize(frame_around(light.p1.xyz) * sample_cone(v, omc));
                    weight *= 2.0 * PI * omc;
                }
            } else if (light.kind == LIGHT_KIND_CONSTANT) {
                ray.d = frame_around(vec3f(0.0, 0.0, 1.0)) * sample_cone(v, 2.0);
                weight *= 4.0 * PI;
            } else {
#if ENV_IMAGE
                let s = sample_environment_image(light, v);
                ray.d = -s.wi;
                texel_index = s.texel;
                weight /= pdf_environment_image(texel_index);
#endif
            }
            let aim = aim_along(ray.d, choice, u);
            ray.o = aim.v;
            weight *= aim.weight;
        }
#endif
        default: {
#if LIGHT_AREA
            let point = sample_light_surface(light, u);
            let aim = aim_from(point.p, choice, v);
            let cos_theta = dot(point.n, aim.v);
            ray.d = aim.v;
            ray.o = point.p + sign(cos_theta) * GAMMA_7 * dot(abs(point.n), abs(point.p)) * point.n;
            ray.from_primitive = light.primitive;
            weight *= light.area * aim.weight * select(0.0, abs(cos_theta), emits_towards(light, cos_theta));
#endif
        }
    }
    for (var k = 0u; k < LANES4; k++) {
        let lit = select(vec4f(0.0), vec4f(weight), vec4u(4u * k, 4u * k + 1u, 4u * k + 2u, 4u * k + 3u) < vec4u(LANES));
#if ENV_IMAGE
        if (texel_index != NONE) {
            beta[k] = lit * environment_radiance(light, texel_index, k);
            continue;
        }
#endif
        beta[k] = lit * spectrum(light.row, k);
    }
#if INTERIORS
    inside = light.inside;
#endif
    return ray;
}
