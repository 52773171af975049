// Light paths: a light by its power, a point and a direction on it. beta becomes flux per probability, W nm^-1.

// A disc of radius params.bend_target.w that faces direction `d` in front of everything that can bend light: light from afar is shot only there.
fn sample_target_disc(d: vec3f, u: vec2f) -> vec3f {
    let c = sample_disc(u);
    let f = frame_around(d);
    return params.bend_target.xyz + params.bend_target.w * (c.x * f[0] + c.y * f[1]) - params.scene_diameter * d;
}

fn emit() -> Ray {
    let index = choose_light(next_1d());
    let light = light_at(index);
    let u = next_2d();
    let v = next_2d();
    var ray = Ray(light.p0.xyz, INFINITE, light.p1.xyz, NONE, NONE, false);
    var weight = 1.0 / light.probability;
    var texel = NONE;
    switch light.kind {
#if LIGHT_POINT
        case LIGHT_KIND_POINT: {
            ray.d = frame_around(vec3f(0.0, 0.0, 1.0)) * sample_cone(v, 2.0);
            weight *= 4.0 * PI;
        }
        case LIGHT_KIND_SPOT: {
            let omc = 1.0 - light.p2.y;
            let local = sample_cone(v, omc);
            ray.d = normalize(frame_around(light.p1.xyz) * local);
            weight *= 2.0 * PI * omc * smoothstep(light.p2.y, light.p2.x, local.z);
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
#if LIGHT_SUN
        case LIGHT_KIND_SUN: {
            let omc = light.p2.x;
            weight *= PI * params.bend_target.w * params.bend_target.w;
            if (omc > 0.0) {
                ray.d = normalize(frame_around(light.p1.xyz) * sample_cone(v, omc));
                weight *= 2.0 * PI * omc;
            }
            ray.o = sample_target_disc(ray.d, u);
        }
#endif
#if ENV_CONSTANT
        case LIGHT_KIND_CONSTANT: {
            ray.d = frame_around(vec3f(0.0, 0.0, 1.0)) * sample_cone(v, 2.0);
            weight *= 4.0 * PI * PI * params.bend_target.w * params.bend_target.w;
            ray.o = sample_target_disc(ray.d, u);
        }
#endif
#if ENV_IMAGE
        case LIGHT_KIND_IMAGE: {
            let s = sample_environment_image(light, v);
            ray.d = -s.wi;
            texel = s.texel;
            weight *= PI * params.bend_target.w * params.bend_target.w / pdf_environment_image(texel);
            ray.o = sample_target_disc(ray.d, u);
        }
#endif
        default: {
#if LIGHT_AREA
            let point = sample_light_surface(light, u);
            var n = point.n;
            weight *= PI * light.area;
            if (light.two_sided != 0u) {
                n = select(n, -n, next_1d() < 0.5);
                weight *= 2.0;
            }
            ray.d = normalize(frame_around(n) * sample_cosine(v));
            ray.o = point.p + GAMMA_7 * dot(abs(n), abs(point.p)) * n;
            ray.from_primitive = light.primitive;
#endif
        }
    }
    for (var k = 0u; k < LANES4; k++) {
        let lit = select(vec4f(0.0), vec4f(weight), vec4u(4u * k, 4u * k + 1u, 4u * k + 2u, 4u * k + 3u) < vec4u(LANES));
#if ENV_IMAGE
        if (texel != NONE) {
            beta[k] = lit * environment_radiance(light, texel, k);
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
