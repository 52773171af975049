// Light paths begin: a light by its power, a point and a direction on it. beta becomes flux per probability, W nm^-1.
#include "common/sampler.wgsl"
#include "light/light.wgsl"
#include "light/aim.wgsl"
#if GUIDED
#include "light/guide.wgsl"
#endif
#include "path/state.wgsl"
#if START_VOLUMES
#include "path/start.wgsl"
#endif

fn emit() -> Ray {
#if GUIDED
    let guided = guided_numbers();
    let u = guided.at.xy;
    let v = guided.at.zw;
    let index = choose_light(guided.choices.x);
#else
    let index = choose_light(next_1d());
    let u = next_2d();
    let v = next_2d();
#endif
    let light = load_Light(index);
    let begun = sample_le(light, u, v);
    var ray = begun.ray;
    let n = begun.n;
    let at = begun.texel;
    let cos_theta = dot(n, ray.d);
    let density = pdf_le(light, ray.o, ray.d, cos_theta, at);
    var weight = select(begun.weight, 0.0, begun.given_up);
#if GUIDED
    weight = safe_ratio(weight, density * guide_density);
#else
    weight = safe_ratio(weight, density);
#endif
#if LIGHT_AREA
    if (light.kind <= LIGHT_KIND_CYLINDER) {
        // On the side that it leaves to, of surfaces that its own lies in, too.
        ray.o += sign(cos_theta) * max(GAMMA_7 * dot(abs(n), abs(ray.o)), light.p1.w) * n;
    }
#endif
#if LIGHT_TEXTURES
    let texels = emission_texels(light, light.primitive, begun.ray.o);
#endif
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        let lit = select(vec4f(0.0), vec4f(weight), vec4u(4u * k, 4u * k + 1u, 4u * k + 2u, 4u * k + 3u) < vec4u(WAVELENGTHS));
#if ENV_IMAGE
        if (at != NONE) {
            beta[k] = lit * environment_radiance(light, at, k);
            continue;
        }
#endif
#if LIGHT_TEXTURES
        if (texture_of_light(light) != NONE) {
            beta[k] = lit * filtered_spectrum(texels, k);
            continue;
        }
#endif
        beta[k] = lit * spectrum(light.row, k);
    }
#if INTERIORS
    inside = volumes_of(light.inside, light.inside_more);
#endif
    start_path(ray);
#if BSDF_SAMPLING
    path.camera_path_density = begun.hittable;
#endif
    path.emission = f32(params.light_paths) * density;
    path.light = index;
    path.light_normal = n;
    path.light_texel = at;
#if START_VOLUMES
    if (index < params.first_distant_light) {
        return find_start(ray);
    }
#endif
    return ray;
}

#if NEXT_EVENT_ESTIMATION
// Density of a light sample of the point that this path comes from, seen from `p`, its first vertex.
fn light_density_at(p: vec3f) -> f32 {
    var light = load_Light(path.light);
    light.probability = probability_of_choice(light, path.light, p);
    return pdf_li(light, path.light, p, path.last_vertex, path.light_normal, path.light_texel);
}
#endif
