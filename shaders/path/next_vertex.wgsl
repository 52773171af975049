// A path from vertex to vertex: free flight, emission, the boundaries of volumes, and what happens when a ray escapes.
#include "common/params.wgsl"
#include "common/counters.wgsl"
#include "geometry/trace.wgsl"
#include "geometry/surface.wgsl"
#if TEXTURES
#include "geometry/texture.wgsl"
#endif
#include "bsdf/material.wgsl"
#include "bsdf/bsdf.wgsl"
#if GRADED
#include "bsdf/energy.wgsl"
#endif
#if INTERIORS
#include "medium/interiors.wgsl"
#endif
#if MEDIA
#include "medium/homogeneous.wgsl"
#endif
#if LIGHTS_PRESENT
#include "light/light.wgsl"
#endif
#include "path/state.wgsl"
#include "path/mis.wgsl"
#include "path/scatter.wgsl"
#include "path/arrive.wgsl"
#if START_VOLUMES
#include "path/start.wgsl"
#endif
#if MERGING
#include "path/merge.wgsl"
#endif
#if LIGHT_PATHS
#include "sensor/connect.wgsl"
#endif

#if INTERIORS || BOUNDARY
// The same direction from beyond a surface that is not there. No event: depth, pdf and last vertex stay.
fn pass_through(ray: Ray, s: Surface) -> Ray {
    var r = ray;
    r.o = leave(s, ray.d);
    r.from_primitive = s.primitive;
    path.crossings += 1u;
    path.ended = path.crossings > MAX_CROSSINGS;
    return r;
}
#endif

#if CAMERA_PATHS
#if LIGHT_AREA
fn add_emission(ray: Ray, s: Surface) {
    let light = load_Light(s.light);
    let cos_theta = -dot(s.n, ray.d);
    if (emits_towards(light, cos_theta)) {
        var emission = 0.0;
#if CAUSTICS
        if (path.light_path_density > 0.0) {
            emission = pdf_le(light, s.p, -ray.d, cos_theta, NONE);
        }
#endif
        let w = mis_weight_emitter_hit(pdf_li_area(s.light, path.last_vertex, distance(s.p, path.last_vertex), ray.d, s.n), emission);
#if LIGHT_TEXTURES
        if (texture_of_light(light) != NONE) {
            let texels = emission_texels(light, s.primitive, s.p);
            for (var k = 0u; k < WAVELENGTHS4; k++) {
                li[k] += w * beta[k] * filtered_spectrum(texels, k);
            }
            return;
        }
#endif
        for (var k = 0u; k < WAVELENGTHS4; k++) {
            li[k] += w * beta[k] * spectrum(light.row, k);
        }
    }
}
#endif
#endif

#if NORMAL_MAPS
// What lies under a map of normals, which turns the normal of `s`.
fn unmap_normals(first: u32, s: ptr<function, Surface>) -> u32 {
    let m = load_Material(first);
    if (m.kind != MATERIAL_KIND_NORMAL_MAPPED) {
        return first;
    }
    (*s).ns = mapped_normal(m.texture, *s);
    return m.b;
}
#endif

#if COMPOSITE
// The cosine at which the path arrives at facets of normal `ns`.
fn cosine_of_arrival(s: ptr<function, Surface>, ns: vec3f) -> f32 {
    var arrival = (*s).arrival;
#if SHADING_NORMALS
#if LIGHT_PATHS
    arrival = light_on_facet(-arrival, (*s).n, ns).w;
#endif
#endif
    return min(abs(dot(arrival, ns)), 1.0);
}

// The part of a composite material that this path (or its shadow ray) meets at `s`. The share that a mixture has of each wavelength goes into beta (or
// Ld), what a map of normals says into the shading normal, what lies over that part into `b`.
fn resolve_material(first: u32, s: ptr<function, Surface>, in_shadow: bool, b: ptr<function, Bsdf>) -> u32 {
    var index = first;
#if COAT
    (*b).coat = NONE;
    var above_coat: Spectrum; // throughput of the path that arrives at it
#endif
#if SHEEN
    (*b).sheen = NONE;
    var above_sheen: Spectrum;
#endif
    for (var i = 0u; i < 12u; i++) {
        let m = load_Material(index);
#if NORMAL_MAPS
        if (m.kind == MATERIAL_KIND_NORMAL_MAPPED) {
            index = unmap_normals(index, s);
            continue;
        }
#endif
#if SHEEN
        if (m.kind == MATERIAL_KIND_SHEEN) {
            // As with coats.
            if (in_shadow) {
                break;
            }
            (*b).sheen = index;
            above_sheen = beta;
            index = m.b;
            continue;
        }
#endif
#if COAT
        if (m.kind == MATERIAL_KIND_COATED) {
            // Light that goes straight on ends at a coat.
            if (in_shadow) {
                break;
            }
            (*b).coat = index;
            above_coat = beta;
            index = m.b;
            continue;
        }
#endif
#if GRADED
        if (m.kind == MATERIAL_KIND_GRADED) {
            (*b).m = m;
            look_up_color(b, (*s).primitive, (*s).p);
            let first = m.c & 0xffffu;
            let last = m.c >> 16u;
            let x = clamp(color_of(b, 0u).x * f32(ROUGHNESS_STEPS), f32(first), f32(last));
            let level = min(u32(x), last - 1u);
            index = u32(tables[m.table + level - first + select(0u, 1u, next_1d() < x - f32(level))]);
            continue;
        }
#endif
#if MIX
        if (m.kind != MATERIAL_KIND_MIX) {
            break;
        }
        (*b).m = m;
#if TEXTURES
        look_up_color(b, (*s).primitive, (*s).p);
#endif
        var share = 0.0;
        for (var k = 0u; k < WAVELENGTHS4; k++) {
            share += dot(beta[k], color_of(b, k));
        }
        let total = sum_beta();
        // Any probability strictly between 0 and 1 is right; that of the carried wavelengths is best.
        share = select(0.5, clamp(share / total, 0.001, 0.999), total > 0.0);
        let is_first = next_1d() < share;
        for (var k = 0u; k < WAVELENGTHS4; k++) {
            let w = color_of(b, k);
            let factor = select((1.0 - w) / (1.0 - share), w / share, is_first);
            if (in_shadow) {
                Ld[k] *= factor;
            } else {
                beta[k] *= factor;
            }
        }
        index = select(m.c, m.b, is_first);
#else
        break;
#endif
    }
    // Behind the loop, of which every turn costs all that is in it.
    let mu = cosine_of_arrival(s, (*s).ns);
#if SHEEN
    if ((*b).sheen != NONE) {
        let below = choose_sheen(b, &above_sheen, mu, next_1d());
        if (below == 0.0) {
            index = (*b).sheen;
            (*b).sheen = NONE;
        }
#if COAT
        (*b).coat = select((*b).coat, NONE, below == 0.0);
        for (var k = 0u; k < WAVELENGTHS4; k++) {
            above_coat[k] *= below;
        }
#endif
    }
#endif
#if COAT
    if ((*b).coat != NONE) {
        var mu_coat = mu;
#if COAT_NORMALS
        (*b).coat_normal = normal_of_coat(load_Material((*b).coat), *s);
        mu_coat = cosine_of_arrival(s, (*b).coat_normal);
#endif
        if (choose_coat(b, &above_coat, mu, mu_coat, next_1d())) {
            index = (*b).coat;
            (*b).coat = NONE;
#if COAT_NORMALS
            (*s).ns = (*b).coat_normal;
#endif
        }
    }
#endif
    return index;
}
#endif

#if INTERIORS
// Whether a path cannot go on, since too many volumes overlap beyond; counts it.
fn is_crowded(sides: Sides) -> bool {
    if (sides.crowded) {
        atomicAdd(&counters[COUNTER_CROWDED], 1u);
    }
    return sides.crowded;
}
#endif

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

#if SCATTERING
// Scattering at distance `t` of a ray that would have come to `t_max`, in the medium of interior `m`.
fn in_medium(ray: Ray, t: f32, t_max: f32, m: Interior) -> Interaction {
    var at: Interaction;
    at.bsdf.m.kind = MATERIAL_KIND_MEDIUM;
    at.bsdf.m.alpha = m.g;
    at.bsdf.m.a = m.sigma_s_row;
    at.bsdf.m.texture = NONE;
#if COAT
    at.bsdf.coat = NONE;
#endif
#if SHEEN
    at.bsdf.sheen = NONE;
#endif
    at.s.p = ray.o + t * ray.d;
    at.s.on_ray = at.s.p;
    at.s.n = ray.d;
    at.s.primitive = NONE;
    at.n = ray.d;
    at.ns = ray.d;
    at.cos_from = 1.0;
    at.rest = t_max - t;
#if CAUSTICS
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        at.extinction = max(at.extinction, max4(sigma_t(m, k)));
    }
#else
    at.extinction = 1.0;
#endif
    at.here = inside;
    at.beyond = inside;
#if CONTACT
    beside = NOTHING;
#endif
    return at;
}
#endif

// What a path finds where it meets something.
struct Met {
    scatters: bool, // or else `ray` is the path's next one
    ray: Ray,
}

// Emission, and which material scatters the path at `hit`, if one does: where `at` is, on a surface of `material`.
fn meet_surface(ray: Ray, hit: Hit, material: u32, at: ptr<function, Interaction>) -> Met {
    if (hit.primitive == NONE) {
#if CAMERA_PATHS
#if LIGHT_ENVIRONMENT
        add_environment(ray.d);
#endif
#endif
        return Met(false, end_path(ray));
    }
    var s = (*at).s;
    var seen = hit.primitive;
    var index = material;
    var b: Bsdf;
#if CAMERA_PATHS
#if LIGHT_AREA
    if (s.light != NONE) {
        add_emission(ray, s);
    }
#if CONTACT
    if (hit.contact != NONE) {
        let touching = surface_at(ray, at_contact(ray, hit));
        if (touching.light != NONE) {
            add_emission(ray, touching);
        }
    }
#endif
#endif
#endif
#if MERGES_AT_SURFACES
    if (may_scatter_diffusely(index, hit)) {
        merge_at_surface(ray, s);
    }
#endif
#if COMPOSITE
    index = resolve_material(index, &s, false, &b);
#endif
#if CONTACT
    if (hit.contact != NONE && load_Material(index).interior != NONE) {
        // An opaque surface that touches a volume's is what is seen there.
        var other = material_of(hit.contact);
#if COMPOSITE
        var touching = surface_at(ray, at_contact(ray, hit));
        var c: Bsdf;
        other = resolve_material(other, &touching, false, &c);
#endif
        let is_seen = is_opaque(load_Material(other).kind);
        seen = select(seen, hit.contact, is_seen);
        index = select(index, other, is_seen);
#if COMPOSITE
        if (is_seen) {
            b = c;
        }
#endif
    }
#endif
    let m = load_Material(index);
    b.m = m;
#if INTERIORS
    (*at).here = inside;
    (*at).beyond = inside;
    if (m.interior != NONE) {
        let sides = cross_surface(inside, ray, s, m.interior, hit);
        if (is_crowded(sides)) {
            return Met(false, end_path(ray));
        }
        if (is_invisible(m, sides)) {
            inside = sides.beyond;
            return Met(false, pass_through(ray, s));
        }
#if DIELECTRIC
        let near = load_Interior(ruling_interior(sides.here));
        let far = load_Interior(ruling_interior(sides.beyond));
        b.near_row = near.eta_row;
        b.far_row = far.eta_row;
        b.dispersive = (near.dispersive | far.dispersive) != 0u;
        (*at).here = sides.here;
        (*at).beyond = sides.beyond;
#else
        return Met(false, end_path(ray));
#endif
    }
#endif
#if BOUNDARY
    if (m.kind == MATERIAL_KIND_BOUNDARY) {
        return Met(false, pass_through(ray, s));
    }
#endif
#if TEXTURES
    look_up_color(&b, seen, s.p);
#endif
    // Normals on the side that the path comes from.
    let flip = select(1.0, -1.0, dot(ray.d, s.n) > 0.0);
    (*at).bsdf = b;
    (*at).s = s;
    (*at).n = flip * s.n;
    (*at).ns = flip * s.ns;
    (*at).cos_from = -dot(ray.d, (*at).n);
    return Met(true, ray);
}

// Takes the path over the segment that `hit` ends, and returns its next ray (that of a connection if path.in_shadow).
fn next_vertex(ray: Ray, hit: Hit) -> Ray {
    draw_event();
#if LIGHT_PATHS
#if DISPERSION
    landing_by_index = vec3f(0.0);
#endif
#if CROSSINGS
    record_crossing(ray, hit.t);
#endif
#endif
    var at: Interaction;
    var scatters_before = false;
#if MEDIA
    let medium = ruling_interior(inside);
    let t = sample_free_flight(medium, hit.t);
#if SCATTERING
    scatters_before = t >= 0.0;
    if (scatters_before) {
        at = in_medium(ray, t, hit.t, load_Interior(medium));
    }
#endif
#endif
    var index = NONE;
    if (!scatters_before && hit.primitive != NONE) {
        var s = surface_at(ray, hit);
        index = material_of(hit.primitive);
#if NORMAL_MAPS
        index = unmap_normals(index, &s);
#endif
        at.s = s;
    }
#if DISPERSION
    // In one place for all: drivers inline functions at each call.
    if (path.hero != NO_HERO) {
        end_hero(ray, hit, &at, index, scatters_before);
    }
#endif
#if SCATTERING
#if LIGHT_PATHS
#if MERGING
    if (scatters_before) {
        merge_in_medium(ray, &at);
    }
#endif
#endif
#endif
    if (!scatters_before) {
        let met = meet_surface(ray, hit, index, &at);
        if (!met.scatters) {
            return met.ray;
        }
    }
    if (!count_event(at.s.p, !is_merging(at.bsdf.m.kind))) {
        return end_path(ray);
    }
    return scatter(ray, &at);
}

// What comes after a ray that is no shadow ray.
fn after_segment(ray: Ray, hit: Hit) -> Ray {
#if START_VOLUMES
    if (path.is_starting) {
        return next_boundary(ray, hit);
    }
#endif
    return next_vertex(ray, hit);
}

#if CONNECT
// Decides whether the shadow ray that ended in `hit` reached its light (or the sensor), and gives the path back its own ray.
fn resume_after_shadow(ray: Ray, hit: Hit) -> Ray {
    var visible = hit.primitive == NONE;
#if PASS_THROUGH
#if MEDIA
    attenuate_Ld(ruling_interior(shadow_inside), min(hit.t, ray.t_max));
#endif
    if (!visible) {
        var s = surface_at(ray, hit);
        var index = material_of(hit.primitive);
#if COMPOSITE
        var unseen: Bsdf;
        index = resolve_material(index, &s, true, &unseen);
#endif
        var m = load_Material(index);
#if CONTACT
        if (hit.contact != NONE && is_opaque(load_Material(material_of(hit.contact)).kind)) {
            m.kind = MATERIAL_KIND_DIFFUSE;
            m.interior = NONE;
        }
#endif
        var absent = m.kind == MATERIAL_KIND_BOUNDARY;
#if INTERIORS
        if (m.interior != NONE) {
            let sides = cross_surface(shadow_inside, ray, s, m.interior, hit);
            absent = is_invisible(m, sides) && !is_crowded(sides);
            shadow_inside = sides.beyond;
        }
#endif
        path.crossings += 1u;
        if (absent && path.crossings <= MAX_CROSSINGS) {
            var r = ray;
            r.o = leave(s, ray.d);
            r.from_primitive = s.primitive;
            r.t_max = select(ray.t_max - hit.t, ray.t_max, ray.t_max >= INFINITE);
            return r;
        }
    }
#endif
    if (visible) {
        path.connects = true;
    }
#if CONTACT
    beside = next_beside;
#endif
    path.in_shadow = false;
    path.ended = next_ray.t_max <= 0.0;
    return next_ray;
}
#endif

var<private> rays_traced: u32;

// When an invocation has come to its end.
fn report_rays() {
    atomicAdd(&counters[COUNTER_RAYS], rays_traced);
    atomicMax(&counters[COUNTER_MOST_RAYS], rays_traced);
#if COUNTED
    atomicAdd(&counters[COUNTER_NODES], nodes_tested);
    atomicAdd(&counters[COUNTER_PRIMITIVES], primitives_tested);
#endif
}

// Takes the path to its next vertex, and the light sample there to its light (or the sensor). One after the other within a turn of the loop over all paths:
// software drivers execute all of a loop for each lane that is in it, so that shading would be done for shadow rays as well.
fn next_event(from_vertex: Ray) -> Ray {
    var ray = from_vertex;
#if CONNECT
    path.connects = false;
    // Paths that leave an irradiance sensor begin with a light sample.
    if (!path.in_shadow) {
        rays_traced += 1u;
        ray = after_segment(ray, trace(ray));
    }
    while (path.in_shadow) {
        rays_traced += 1u;
        ray = resume_after_shadow(ray, trace(ray));
    }
    if (path.connects) {
#if LIGHT_PATHS
#if SENSOR_LENS || DISPERSION
        splat_landed(carried_wavelengths());
#else
        splat(carried_wavelengths(), landed_pixel[0].x);
#endif
#else
        for (var k = 0u; k < WAVELENGTHS4; k++) {
            li[k] += Ld[k];
        }
#endif
    }
#else
    rays_traced += 1u;
    ray = after_segment(ray, trace(ray));
#endif
    return ray;
}
