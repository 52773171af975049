// What happens at a vertex, for each kind of material and for media: a connection and the choice of a new direction. Camera paths connect to a
// light (next-event estimation), light paths to the sensor.

// Random numbers of an event, drawn in one place for all materials: lanes that meet different ones would otherwise wait for each other's.
var<private> event_choice: vec2f; // of a light or of reflection; of survival
var<private> event_light: vec2f; // on the light or the lens; of a wavelength
var<private> event_direction: vec2f;

fn draw_event() {
    event_choice = next_2d();
    event_light = next_2d();
    event_direction = next_2d();
}

// The path's next segment from `o` along `d`, whose pdf (solid angle) is `pdf`, negative if no light sample could have made it.
fn next_segment(o: vec3f, d: vec3f, from_primitive: u32, vertex: vec3f, pdf: f32) -> Ray {
    path.pdf = pdf;
    path.last_vertex = vertex;
    return Ray(o, INFINITE, d, from_primitive, NONE, false);
}

// Russian roulette from the fourth event on, surviving by the mean throughput of the carried wavelengths.
fn survives_roulette() -> bool {
    let mean_beta = sum_beta() / f32(LANES);
    if (mean_beta <= 0.0) {
        return false;
    }
    if (path.depth < 4u) {
        return true;
    }
    let p = clamp(mean_beta / path.start, 0.05, 1.0);
    scale_beta(1.0 / p);
    return event_choice.y < p;
}

// Counts an event at `p`; false if the path ends here, because it is too long.
fn count_event(p: vec3f, bends: bool) -> bool {
    if (path.depth >= params.max_depth) {
        atomicAdd(&counters[COUNTER_TRUNCATED], 1u);
        return false;
    }
    path.depth += 1u;
#if CAUSTICS
    path.length += distance(p, path.last_vertex);
#if CAMERA_PATHS
    path.view = select(path.view, VIEW_BENT, bends && path.view == VIEW_DIRECT);
#endif
#endif
    return true;
}

// What shading normals do to flux: Veach's correction for the adjoint (1997, eq. 5.19), for a particle along `d` that goes on along `w`.
fn adjoint_correction(d: vec3f, w: vec3f, n: vec3f, ns: vec3f) -> f32 {
#if ADJOINT_NORMALS
    return abs(dot(d, ns) * dot(w, n)) / max(abs(dot(d, n) * dot(w, ns)), 1e-20);
#else
    return 1.0;
#endif
}

// What sheen over the surface at hand leaves of what is scattered at cosine `mu`.
fn through_sheen(mu: f32) -> f32 {
#if SHEEN
    return out_of_sheen(sheen, sheen_entered, mu);
#else
    return 1.0;
#endif
}

#if CONNECT
#if LIGHT_PATHS
// The sensor, seen from `p`.
fn connect(p: vec3f, u_choice: f32, u: vec2f) -> LightSample {
    return connect_to_sensor(p, u_choice, u);
}

fn light_spectrum(light: LightSample, k: u32) -> vec4f {
    return vec4f(1.0);
}
#else
// A point of a light, seen from `p`.
fn connect(p: vec3f, u_choice: f32, u: vec2f) -> LightSample {
    return sample_light(p, u_choice, u);
}

// Radiance, intensity or irradiance of the sampled light.
fn light_spectrum(light: LightSample, k: u32) -> vec4f {
#if ENV_IMAGE
    if (light.texel != NONE) {
        return environment_radiance(load_Light(params.environment_light), light.texel, k);
    }
#endif
#if LIGHT_TEXTURES
    if (light.is_textured) {
        return light_color[k];
    }
#endif
    return spectrum(light.row, k);
}
#endif

// Sends the shadow ray of `pending` first, `next` after it (or nothing, if the path does not survive).
fn shadow_then(next: Ray, survives: bool, light: LightSample, o: vec3f, from_primitive: u32) -> Ray {
    next_ray = next;
#if CONTACT
    next_beside = beside;
#endif
    next_ray.t_max = select(0.0, next.t_max, survives);
    path.in_shadow = true;
#if PASS_THROUGH
    return Ray(o, light.distance, light.wi, from_primitive, light.primitive, false);
#else
    return Ray(o, light.distance, light.wi, from_primitive, light.primitive, true);
#endif
}

#if INTERIORS
// Volumes that the shadow ray starts in.
fn shadow_starts_in(volumes: vec4u, light: LightSample) {
#if PASS_THROUGH
    shadow_inside = volumes;
#elif MEDIA
    attenuate_pending(ruling_interior(volumes), light.distance);
#endif
}
#endif
#endif

fn continue_or_end(next: Ray, survives: bool) -> Ray {
    path.ended = !survives;
    return next;
}

#if SCATTERING
fn scatter_in_medium(ray: Ray, t: f32, m: Interior) -> Ray {
#if CONTACT
    beside = NOTHING;
#endif
    let p = ray.o + t * ray.d;
    if (!count_event(p, false)) {
        return end_path(ray);
    }
    var extinction = 0.0;
#if CAUSTICS
    for (var k = 0u; k < LANES4; k++) {
        extinction = max(extinction, max4(sigma_t(m, k)));
    }
#endif
#if GATHERED
    gather_in_fog(ray, p, m, extinction);
#endif
#if CONNECT
    let light = connect(p, event_choice.x, event_light);
    let lit = light.weight > 0.0;
    if (lit) {
        let phase = phase_hg(dot(ray.d, light.wi), m.g);
        let w = connection_weight(light, Vertex(p, 1.0, 1.0, phase, phase, false, extinction)) * phase;
        for (var k = 0u; k < LANES4; k++) {
            pending[k] = w * beta[k] * light_spectrum(light, k);
        }
        shadow_starts_in(inside, light);
    }
#endif
    let d = sample_hg(ray.d, m.g, event_direction);
    let survives = survives_roulette();
    let phase = phase_hg(dot(ray.d, d), m.g);
    leave_vertex(Vertex(p, 1.0, 1.0, phase, phase, false, extinction));
    let next = next_segment(p, d, NONE, p, phase);
#if CONNECT
    if (lit) {
        return shadow_then(next, survives, light, p, NONE);
    }
#endif
    return continue_or_end(next, survives);
}
#endif

#if DIFFUSE
fn scatter_diffuse(ray: Ray, s: Surface, m: Material, n: vec3f, ns: vec3f) -> Ray {
    let cos_from = -dot(ray.d, ns);
    // Seen or lit from behind its shading normal a surface is black, for both passes alike.
    if (cos_from <= 0.0) {
        return end_path(ray);
    }
#if GATHERED
#if CAMERA_PATHS
    leave_point_at_surface(s.p, ns, m);
#endif
#endif
    for (var k = 0u; k < LANES4; k++) {
        beta[k] *= paint_of(m, k);
    }
#if CONNECT
    let light = connect(s.p, event_choice.x, event_light);
    let cos_light = dot(ns, light.wi);
    let lit = light.weight > 0.0 && cos_light > 0.0 && dot(n, light.wi) > 0.0;
    if (lit) {
        let pdf = cos_light * INV_PI;
        let v = Vertex(s.p, cos_from, cos_light, pdf, cos_from * INV_PI, false, 0.0);
        let w = connection_weight(light, v) * pdf * adjoint_correction(ray.d, light.wi, n, ns) * through_sheen(cos_light);
#if COAT
        look_out_of_coat(cos_light);
#endif
        for (var k = 0u; k < LANES4; k++) {
            pending[k] = w * beta[k] * light_spectrum(light, k);
#if COAT
            pending[k] *= if_coated(coat_share[k]);
#endif
        }
#if INTERIORS
        shadow_starts_in(inside, light);
#endif
    }
#endif
    let local = sample_cosine(event_direction);
    let d = normalize(frame_around(ns) * local);
#if COAT
    look_out_of_coat(local.z);
    for (var k = 0u; k < LANES4; k++) {
        beta[k] *= if_coated(coat_share[k]);
    }
#endif
    scale_beta(adjoint_correction(ray.d, d, n, ns) * through_sheen(local.z));
    let survives = survives_roulette() && dot(n, d) > 0.0;
    leave_vertex(Vertex(s.p, cos_from, local.z, local.z * INV_PI, cos_from * INV_PI, false, 0.0));
    let next = next_segment(leave(s, d), d, s.primitive, s.p, local.z * INV_PI);
#if CONNECT
    if (lit) {
        return shadow_then(next, survives, light, leave(s, light.wi), s.primitive);
    }
#endif
    return continue_or_end(next, survives);
}
#endif

#if SMOOTH_CONDUCTOR || SMOOTH_COAT
// Of a coat only what the coat itself reflects: that share is in beta already.
fn scatter_mirror(ray: Ray, s: Surface, m: Material, n: vec3f, ns: vec3f) -> Ray {
    let cos_i = min(-dot(ray.d, ns), 1.0);
    let d = normalize(ray.d + 2.0 * cos_i * ns);
#if SMOOTH_CONDUCTOR
    if (m.kind == MATERIAL_KIND_SMOOTH_CONDUCTOR) {
#if COAT
        look_out_of_coat(cos_i);
#endif
        for (var k = 0u; k < LANES4; k++) {
            let f = metal_reflectance(m, cos_i, k);
#if COAT
            beta[k] *= mirror_under_coat(f, k);
#else
            beta[k] *= f;
#endif
        }
    }
#endif
    scale_beta(adjoint_correction(ray.d, d, n, ns) * through_sheen(cos_i));
    let survives = cos_i > 0.0 && dot(d, n) > 0.0 && survives_roulette();
    return continue_or_end(next_segment(leave(s, d), d, s.primitive, s.p, -1.0), survives);
}
#endif

#if GLOSSY
fn scatter_glossy(ray: Ray, s: Surface, m: Material, n: vec3f, ns: vec3f) -> Ray {
#if GRAIN
    let frame = frame_along_grain(m, s, ns);
#else
    let frame = frame_around(ns);
#endif
    let wo = -ray.d * frame;
    if (wo.z <= 0.0) {
        return end_path(ray);
    }
#if CONNECT
    let light = connect(s.p, event_choice.x, event_light);
    var lit = light.weight > 0.0 && dot(n, light.wi) > 0.0;
    if (lit) {
        let wl = light.wi * frame;
        let pdf = eval_glossy(m, wo, wl);
        let v = Vertex(s.p, wo.z, abs(wl.z), pdf, pdf_glossy(m, wl, wo), true, 0.0);
        let w = connection_weight(light, v) * adjoint_correction(ray.d, light.wi, n, ns) * through_sheen(wl.z);
        for (var k = 0u; k < LANES4; k++) {
            pending[k] = w * beta[k] * bsdf_f[k] * light_spectrum(light, k);
        }
#if INTERIORS
        shadow_starts_in(inside, light);
#endif
    }
#endif
    let wi = sample_glossy(m, wo, next_1d(), event_direction);
    let pdf = eval_glossy(m, wo, wi);
    let d = normalize(frame * wi);
    for (var k = 0u; k < LANES4; k++) {
        beta[k] *= select(vec4f(0.0), bsdf_f[k] / pdf, pdf > 0.0);
    }
    scale_beta(adjoint_correction(ray.d, d, n, ns) * through_sheen(wi.z));
    let survives = survives_roulette() && dot(n, d) > 0.0;
    leave_vertex(Vertex(s.p, wo.z, abs(wi.z), pdf, pdf_glossy(m, wi, wo), true, 0.0));
    let next = next_segment(leave(s, d), d, s.primitive, s.p, pdf);
#if CONNECT
    if (lit) {
        return shadow_then(next, survives, light, leave(s, light.wi), s.primitive);
    }
#endif
    return continue_or_end(next, survives);
}
#endif

#if THIN_DIELECTRIC
// A pane with all its inner reflections, R' = 2R / (1 + R), or a film.
fn pane_reflectance(m: Material, cos_i: f32, k: u32) -> vec4f {
#if FILM
    if (m.c != 0u) {
        let around = index_outside(k);
        return film_reflectance(m, cos_i, around, around, vec4f(0.0), k);
    }
#endif
    let r = fresnel_dielectric(cos_i, spectrum(m.a, k));
    return 2.0 * r / (1.0 + r);
}

// What is not reflected goes straight through.
fn scatter_thin_dielectric(ray: Ray, s: Surface, m: Material, n: vec3f, ns: vec3f) -> Ray {
    let cos_i = clamp(-dot(ray.d, ns), 0.0, 1.0);
    var reflected = vec4f(0.0);
    for (var k = 0u; k < LANES4; k++) {
        reflected += beta[k] * pane_reflectance(m, cos_i, k);
    }
    let total = sum_beta();
    let q = select(0.0, sum4(reflected) / total, total > 0.0);
    let reflects = event_choice.x < q;
    for (var k = 0u; k < LANES4; k++) {
        let r = pane_reflectance(m, cos_i, k);
        beta[k] *= select((1.0 - r) / (1.0 - q), r / q, reflects);
    }
    let d = select(ray.d, normalize(ray.d + 2.0 * cos_i * ns), reflects);
    scale_beta(select(1.0, adjoint_correction(ray.d, d, n, ns), reflects));
    let survives = (!reflects || dot(d, n) > 0.0) && survives_roulette();
    return continue_or_end(next_segment(leave(s, d), d, s.primitive, s.p, -1.0), survives);
}
#endif

// Scattering at an opaque or thin surface.
fn scatter_at_surface(ray: Ray, s: Surface, m: Material) -> Ray {
    // Normals on the side that the path comes from.
    let flip = select(1.0, -1.0, dot(ray.d, s.n) > 0.0);
    let n = flip * s.n;
    let ns = flip * s.ns;
    switch m.kind {
#if SMOOTH_CONDUCTOR
        case MATERIAL_KIND_SMOOTH_CONDUCTOR: {
            return scatter_mirror(ray, s, m, n, ns);
        }
#endif
#if ROUGH_CONDUCTOR
        case MATERIAL_KIND_ROUGH_CONDUCTOR, MATERIAL_KIND_BRUSHED_CONDUCTOR: {
            return scatter_glossy(ray, s, m, n, ns);
        }
#endif
#if SHEEN
        case MATERIAL_KIND_SHEEN: {
            return scatter_glossy(ray, s, m, n, ns);
        }
#endif
#if COAT
        case MATERIAL_KIND_COATED: {
#if ROUGH_COAT
            if (m.alpha > 0.0) {
                return scatter_glossy(ray, s, m, n, ns);
            }
#endif
#if SMOOTH_COAT
            return scatter_mirror(ray, s, m, n, ns);
#else
            return end_path(ray);
#endif
        }
#endif
#if THIN_DIELECTRIC
        case MATERIAL_KIND_THIN_DIELECTRIC: {
            return scatter_thin_dielectric(ray, s, m, n, ns);
        }
#endif
        default: {
#if DIFFUSE
            return scatter_diffuse(ray, s, m, n, ns);
#else
            return end_path(ray);
#endif
        }
    }
}

#if DIELECTRIC
#include "integrator/scatter_dielectric.wgsl"
#endif
