// Scattering at a vertex, of whatever kind: a connection (of camera paths to a light, of light paths to the sensor), and a new direction.
#include "common/sampler.wgsl"
#include "bsdf/bsdf.wgsl"
#include "geometry/surface.wgsl"
#if SHADING_NORMALS
#include "geometry/facet.wgsl"
#endif
#if GRAIN
#include "geometry/grain.wgsl"
#endif
#if INTERIORS
#include "medium/interiors.wgsl"
#endif
#if LIGHTS_PRESENT
#include "light/light.wgsl"
#endif
#if LIGHT_PATHS
#include "sensor/connect.wgsl"
#endif
#include "path/state.wgsl"
#include "path/mis.wgsl"
#if MERGING
#include "path/merge.wgsl"
#endif
#if DISPERSION
#include "path/hero.wgsl"
#endif

// Where a path scatters, and what scatters it.
struct Interaction {
    bsdf: Bsdf,
    s: Surface, // in a medium one at right angles to the path, without error
    n: vec3f, // geometric normal on the side of the path; in a medium its direction, as `ns`
    ns: vec3f, // shading normal on the side of the path
    cos_from: f32, // geometric cosine to where the path comes from, 1 in a medium
    extinction: f32, // of a medium, 0 on a surface
    rest: f32, // in a medium how much further the ray would have come
#if INTERIORS
    here: Volumes, // volumes on the side of the path
    beyond: Volumes, // and on the other side
#endif
}

// Random numbers of an event, drawn in one place for all materials: lanes that meet different ones would otherwise wait for each other's.
var<private> event_choice: vec2f; // of a light or of reflection; of survival
var<private> event_light: vec2f; // on the light or the lens; of a wavelength
var<private> event_direction: vec2f;

fn draw_event() {
    event_choice = next_2d();
    event_light = next_2d();
    event_direction = next_2d();
#if SHADING_NORMALS
    event_facet = next_2d();
#endif
}

// A path survives with this many times its throughput over that behind its first vertex that is not specular: the ways to a vertex have been paid for, so that the best probability of
// going on is greater than what the vertex is worth (Rath et al. 2022, "EARS: efficiency-aware Russian roulette and splitting"). Measured: src/README.md.
const SURVIVAL = 1.5;

// Russian roulette by the mean throughput of the carried wavelengths. What is dark, or seen in what is dark, is lit by what is worth little: up to its first
// vertex that is not specular (path.start is negative) no path ends within its first three events.
fn survives_roulette(is_specular: bool) -> bool {
    let mean_beta = sum_beta() / f32(WAVELENGTHS);
    if (mean_beta <= 0.0) {
        return false;
    }
    if (path.start < 0.0) {
        path.start = select(mean_beta, path.start, is_specular);
        if (!is_specular || path.depth < 4u) {
            return true;
        }
    }
    let p = clamp(SURVIVAL * mean_beta / abs(path.start), 0.05, 1.0);
    scale_beta(1.0 / p);
    return event_choice.y < p;
}

fn is_in_medium(at: ptr<function, Interaction>) -> bool {
    return (*at).extinction > 0.0;
}

// Whether the geometry agrees that `w`, of cosine `mu` to the shading normal, leaves to that side. In a medium all directions are alike, also those at
// right angles to the path.
fn leaves_to_its_side(at: ptr<function, Interaction>, w: vec3f, mu: f32) -> bool {
    return is_in_medium(at) || dot((*at).n, w) * mu > 0.0;
}

#if SHADING_NORMALS
// How the facet has it: where the path comes from, the direction to a light or the sensor, and where it goes on to, by the side of the facet that it left to.
#if LIGHT_PATHS
fn face_arrival(at: ptr<function, Interaction>, w: vec3f) -> Faced {
    return light_on_facet(w, (*at).n, (*at).ns);
}

fn face_connection(at: ptr<function, Interaction>, w: vec3f) -> Faced {
    return Faced(raised(w, (*at).ns, dot(w, (*at).n)), 1.0);
}

fn leave_facet(at: ptr<function, Interaction>, w: vec3f, side: f32) -> Faced {
    return choose_facing(w, (*at).ns, (*at).n, side, event_facet.y);
}
#else
fn face_arrival(at: ptr<function, Interaction>, w: vec3f) -> Faced {
    return Faced(raised(w, (*at).ns, 1.0), 1.0);
}

fn face_connection(at: ptr<function, Interaction>, w: vec3f) -> Faced {
    return light_on_facet(w, (*at).n, (*at).ns);
}

fn leave_facet(at: ptr<function, Interaction>, w: vec3f, side: f32) -> Faced {
    return Faced(raised(w, (*at).n, side), 1.0);
}
#endif
#endif

// A factor on what leaves along `w` (cosine `mu`): sheen over the surface, and Veach's correction for shading normals (1997, eq. 5.19), of flux that
// comes on the facet along `d`.
fn leaving_factor(at: ptr<function, Interaction>, d: vec3f, w: vec3f, mu: f32) -> f32 {
    var factor = 1.0;
#if SHADING_NORMALS
#if LIGHT_PATHS
    let corrected = abs(dot(d, (*at).ns) * dot(w, (*at).n)) / max(abs(dot(d, (*at).n) * dot(w, (*at).ns)), 1e-20);
    factor = select(corrected, 1.0, is_in_medium(at));
#endif
#endif
#if SHEEN
    factor *= out_of_sheen((*at).bsdf.sheen, (*at).bsdf.sheen_entered, abs(mu));
#endif
    return factor;
}

// The vertex as multiple importance sampling sees it, for a direction `w` of cosine `mu` to the shading normal.
fn vertex_towards(at: ptr<function, Interaction>, w: vec3f, mu: f32, densities: BsdfPdf) -> Vertex {
#if SHADING_NORMALS
    let cos_n = abs(dot(w, (*at).n));
#else
    let cos_n = abs(mu);
#endif
    let cos_to = select(cos_n, 1.0, is_in_medium(at));
    return Vertex((*at).s.p, (*at).cos_from, cos_to, densities.pdf_fwd, densities.pdf_rev, !is_merging((*at).bsdf.m.kind), (*at).extinction);
}

#if INTERIORS
// Volumes on the side that a direction of cosine `mu` goes to.
fn volumes_towards(at: ptr<function, Interaction>, mu: f32) -> Volumes {
    return select_volumes((*at).beyond, (*at).here, mu > 0.0 || is_in_medium(at));
}
#endif

#if CONNECT
#if LIGHT_PATHS
// The sensor, seen from `p`.
fn connect(p: vec3f, u_choice: f32, u: vec2f) -> LightSample {
    return connect_to_sensor(p, u_choice, u);
}

fn light_spectrum(light: LightSample, k: u32) -> vec4f {
#if SENSOR_LENS || DISPERSION
    return landed_weight[k];
#else
    return vec4f(1.0);
#endif
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
        return filtered_spectrum(light.texels, k);
    }
#endif
    return spectrum(light.row, k);
}
#endif

// Sends the shadow ray of `Ld` first, `next` after it (or nothing, if the path does not survive).
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
fn shadow_starts_in(volumes: Volumes, light: LightSample) {
#if PASS_THROUGH
    shadow_inside = volumes;
#elif MEDIA
    attenuate_Ld(ruling_interior(volumes), light.distance);
#endif
}
#endif
#endif

// Takes a path that arrives by `ray` on from `at`: returns its next ray, or that of a connection which goes first.
fn scatter(ray: Ray, at: ptr<function, Interaction>) -> Ray {
    var b = (*at).bsdf;
    let s = (*at).s;
    var d = ray.d; // the path's direction as the facet has it
    var cos_facet = (*at).cos_from; // its cosine there
#if SHADING_NORMALS
    if (!is_in_medium(at)) {
        let arrival = face_arrival(at, -ray.d);
        d = -arrival.w;
        cos_facet = dot(arrival.w, (*at).ns);
        scale_beta(arrival.weight);
    }
#endif
    // Light from behind a facet goes through a pane, but nowhere else.
    if (cos_facet <= 0.0 && b.m.kind != MATERIAL_KIND_THIN_DIELECTRIC) {
        return end_path(ray);
    }
#if GRAIN
    var frame = frame_along_grain(b.m, s, (*at).ns);
#else
    var frame = frame_around((*at).ns);
#endif
    let wo = -d * frame;
    let specular = is_specular(b.m);
#if DISPERSION
#if CONTACT
    // What touches glass is known only now.
    if (!specular && path.hero != NO_HERO) {
        keep_within(width_near_hero(ray.d, s.p, (*at).n, is_merging(b.m.kind), false));
    }
#endif
#endif
    var f: Spectrum;
#if CAMERA_PATHS
#if MERGING
    if (path.view == VIEW_BENT && is_merging(b.m.kind)) {
        leave_visible_point(ray, at, &b);
    }
#endif
#endif
#if CONNECT
    var light: LightSample;
    var lit = false;
    var wl: vec3f; // to the light, in the local frame
    if (!specular) {
        light = connect(s.p, event_choice.x, event_light);
#if SHADING_NORMALS
        let faced = face_connection(at, light.wi);
        light.weight *= faced.weight;
        wl = select(faced.w, light.wi, is_in_medium(at)) * frame;
#else
        wl = light.wi * frame;
#endif
        lit = light.weight > 0.0 && leaves_to_its_side(at, light.wi, wl.z);
    }
#endif
#if SHADING_NORMALS
#if SMOOTH_DIELECTRIC
#if CAMERA_PATHS
    // No light path finds the same way: from the light's end the shading normal may let it in elsewhere.
    if (b.m.kind == MATERIAL_KIND_SMOOTH_DIELECTRIC && goes_by_geometry(&b, cos_facet, (*at).cos_from, event_facet.y)) {
        d = ray.d;
        frame[2] = (*at).n;
#if CAUSTICS
        path.light_path_density = 0.0;
#endif
    }
#endif
#endif
#endif
    let sampled = sample_bsdf(&b, s.p, d, frame, wo);
    var densities: BsdfPdf;
#if CONNECT
    // The connection, and then the direction that was sampled: drivers inline functions at each call.
    for (var turn = select(1u, 0u, lit); turn < select(2u, 1u, specular); turn++) {
        let is_connection = turn == 0u;
        let w_local = select(sampled.wi, wl, is_connection);
        densities = eval_bsdf(&b, wo, w_local, &f);
        if (is_connection) {
            // Nothing goes through what does not transmit.
            lit = densities.pdf_fwd > 0.0;
            let w = mis_weight_connection(light, vertex_towards(at, light.wi, wl.z, densities)) * leaving_factor(at, d, light.wi, wl.z);
#if SHAFTS
            lit &= w > 0.0;
#endif
#if COAT_NORMALS
#if LIGHT_PATHS
            let through_coat = seen_through_coat(&b, (*at).ns, light.wi);
#endif
#endif
            for (var k = 0u; k < WAVELENGTHS4; k++) {
                Ld[k] = w * beta[k] * f[k] * light_spectrum(light, k);
#if COAT_NORMALS
#if LIGHT_PATHS
                Ld[k] *= through_coat[k];
#endif
#endif
#if TINT
                Ld[k] *= select(vec4f(1.0), tint_of(&b, k), wl.z < 0.0);
#endif
            }
#if INTERIORS
            shadow_starts_in(volumes_towards(at, wl.z), light);
#endif
        }
    }
#else
    if (!specular) {
        densities = eval_bsdf(&b, wo, sampled.wi, &f);
    }
#endif
    var out = sampled.d;
    var leaves = true;
#if SHADING_NORMALS
    if (!is_in_medium(at)) {
        let left = leave_facet(at, sampled.d, sampled.wi.z);
        out = left.w;
        scale_beta(left.weight);
#if SMOOTH_DIELECTRIC
#if LIGHT_PATHS
        if (b.m.kind == MATERIAL_KIND_SMOOTH_DIELECTRIC && sampled.wi.z > 0.0) {
            leave_to_camera_paths(&b, cos_facet, abs(dot(out, (*at).n)));
        }
#endif
#endif
    }
#if SMOOTH_THIN_DIELECTRIC
    if (b.m.kind == MATERIAL_KIND_THIN_DIELECTRIC) {
        // What goes through a pane goes straight on, past the facets; so light that the mirror threw on them has not come through.
        let through = sampled.wi.z < 0.0;
        out = select(out, ray.d, through);
        leaves = select(cos_facet > 0.0, dot(d, (*at).n) < 0.0, through);
    }
#endif
#endif
    var pdf = -1.0;
#if DISPERSION
    if (sampled.is_specular) {
        let refracts = b.m.kind == MATERIAL_KIND_SMOOTH_DIELECTRIC && sampled.wi.z < 0.0;
        let straight = sampled.wi.z < 0.0 && !refracts;
        var bend = Bend(d, out, (*at).ns, s.curvature * sign(dot(s.n, (*at).n)), !refracts && !straight, straight, 1.0);
        var of_eta = 0.0;
        if (refracts) {
            bend.eta = 1.0 / sampled.index.eta;
            of_eta = -bend.eta * bend.eta * of_parting(sampled.index.change);
        }
        bend_differentials(s, bend, of_eta);
    } else {
        scatter_differentials(out);
    }
#endif
    if (!sampled.is_specular) {
        let weight = 1.0 / densities.pdf;
        for (var k = 0u; k < WAVELENGTHS4; k++) {
            beta[k] *= select(vec4f(0.0), f[k] * weight, densities.pdf > 0.0);
        }
        pdf = densities.pdf_fwd;
        leave_vertex(vertex_towards(at, out, sampled.wi.z, densities));
    }
#if TINT
    if (sampled.wi.z < 0.0) {
        for (var k = 0u; k < WAVELENGTHS4; k++) {
            beta[k] *= tint_of(&b, k);
        }
    }
#endif
    scale_beta(leaving_factor(at, d, out, sampled.wi.z));
#if COAT_NORMALS
#if LIGHT_PATHS
    let through_coat = seen_through_coat(&b, (*at).ns, out);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        beta[k] *= through_coat[k];
    }
#endif
#endif
#if INTERIORS
    inside = volumes_towards(at, sampled.wi.z);
#endif
    let survives = leaves && leaves_to_its_side(at, out, sampled.wi.z) && survives_roulette(sampled.is_specular);
    path.pdf = pdf;
    path.last_vertex = s.p;
    let next = Ray(leave(s, out), INFINITE, out, s.primitive, NONE, false);
#if CONNECT
    if (lit) {
        return shadow_then(next, survives, light, leave(s, light.wi), s.primitive);
    }
#endif
    path.ended = !survives;
    return next;
}
