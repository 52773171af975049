// A path from vertex to vertex: free flight, emission, the boundaries of volumes, and what happens when a ray escapes.

struct Path {
    ended: bool,
    in_shadow: bool, // the ray at hand is a light sample's; `next_ray` waits
    connects: bool, // nothing was in its way
    depth: u32, // scattering events so far
    pdf: f32, // of the present direction per solid angle; negative if no light sample could have made it
    last_vertex: vec3f, // where that direction was chosen
    crossings: u32, // surfaces passed straight through; bounds the loop
    lane: u32, // the one wavelength left after a dispersive refraction, or NONE
    start: f32, // mean throughput at the start
#if CAUSTICS
    length: f32, // way so far; of a light path, from the last vertex at which it could be gathered
#if CAMERA_PATHS
    joins: f32, // density of light paths for this one, over that of emission (techniques.wgsl)
    view: u32, // VIEW_*: what lies between the sensor and the path's end
#else
    at_joints: f32, // what the throughput is worth at joints to the sensor, over what it is worth at visible points
    emission: f32, // number of light paths times the density of emission
    chance: f32, // density of camera paths that hit or sample the light
    gathers: f32, // cosine over pdf for a camera path at the last vertex at which this one could be gathered, or 0
    extinction: f32, // of the fog there
    light: u32,
    light_texel: u32, // of an environment picture
    light_normal: vec3f,
#endif
#endif
}

const VIEW_DIRECT = 0u; // nothing
const VIEW_BENT = 1u; // metal or glass only
const VIEW_SCATTERED = 2u;

var<private> path: Path;

#if CONNECT
var<private> next_ray: Ray; // the path's next segment, while its shadow ray is under way
#if PASS_THROUGH
var<private> shadow_inside: vec4u; // volumes that the shadow ray is in
#endif
#if CONTACT
var<private> next_beside: Beside; // what lies beside the next segment's origin
#endif
#endif

fn start_path(ray: Ray) {
#if CONTACT
    beside = NOTHING;
#endif
    path = Path();
    path.pdf = -1.0;
    path.last_vertex = ray.o;
    path.lane = NONE;
    path.start = sum_beta() / f32(LANES);
}

fn end_path(ray: Ray) -> Ray {
    path.ended = true;
    return ray;
}

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
        if (path.joins > 0.0) {
            emission = emission_density(light, s.p, -ray.d, cos_theta, NONE);
        }
#endif
        let w = chance_share(pdf_area_light(s.light, path.last_vertex, distance(s.p, path.last_vertex), ray.d, s.n), emission);
#if LIGHT_TEXTURES
        look_at_light(texture_of_light(light), s.primitive, s.p);
#endif
        for (var k = 0u; k < LANES4; k++) {
            li[k] += w * beta[k] * radiance_of(light, k);
        }
    }
}
#endif
#endif

// True for materials that are diffuse, or of which a part may be.
fn scatters_diffusely(kind: u32) -> bool {
    return kind == MATERIAL_KIND_DIFFUSE || kind == MATERIAL_KIND_MIX || kind == MATERIAL_KIND_COATED || kind == MATERIAL_KIND_GRADED
        || kind == MATERIAL_KIND_SHEEN;
}

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
// The part of a composite material that this path (or its shadow ray) meets at `s`. The share that a mixture has of each wavelength goes into beta (or
// pending), what a map of normals says into the shading normal.
fn resolve_material(first: u32, s: ptr<function, Surface>, in_shadow: bool) -> u32 {
    var index = first;
#if COAT
    coat = NONE;
#endif
#if SHEEN
    sheen = NONE;
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
            go_under_sheen(index);
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
            go_under_coat(index);
            index = m.b;
            continue;
        }
#endif
#if GRADED
        if (m.kind == MATERIAL_KIND_GRADED) {
            look_at_surface(m, (*s).primitive, (*s).p);
            let first = m.c & 0xffffu;
            let last = m.c >> 16u;
            let x = clamp(color_of(m, 0u).x * f32(ROUGHNESS_STEPS), f32(first), f32(last));
            let level = min(u32(x), last - 1u);
            index = m.b + level + select(0u, 1u, next_1d() < x - f32(level));
            continue;
        }
#endif
#if MIX
        if (m.kind != MATERIAL_KIND_MIX) {
            break;
        }
#if TEXTURES
        look_at_surface(m, (*s).primitive, (*s).p);
#endif
        var share = 0.0;
        for (var k = 0u; k < LANES4; k++) {
            share += dot(beta[k], color_of(m, k));
        }
        let total = sum_beta();
        // Any probability strictly between 0 and 1 is right; that of the carried wavelengths is best.
        share = select(0.5, clamp(share / total, 0.001, 0.999), total > 0.0);
        let is_first = next_1d() < share;
        for (var k = 0u; k < LANES4; k++) {
            let w = color_of(m, k);
            let factor = select((1.0 - w) / (1.0 - share), w / share, is_first);
            if (in_shadow) {
                pending[k] *= factor;
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
#if SHEEN
    if (sheen != NONE && choose_sheen(min(abs(dot((*s).arrival, (*s).ns)), 1.0), next_1d())) {
        index = sheen;
        sheen = NONE;
#if COAT
        coat = NONE;
#endif
    }
#endif
#if COAT
    if (coat != NONE && choose_coat(min(abs(dot((*s).arrival, (*s).ns)), 1.0), next_1d())) {
        index = coat;
        coat = NONE;
    }
#endif
    return index;
}
#endif

#if CONTACT
fn is_opaque(kind: u32) -> bool {
    return kind == MATERIAL_KIND_DIFFUSE || kind == MATERIAL_KIND_SMOOTH_CONDUCTOR || kind == MATERIAL_KIND_ROUGH_CONDUCTOR || kind == MATERIAL_KIND_COATED
        || kind == MATERIAL_KIND_BRUSHED_CONDUCTOR || kind == MATERIAL_KIND_SHEEN;
}
#endif

#if GATHERS_PAINT
// Whether a path that meets the material `index` may, by chance or by what touches it there, meet a diffuse surface.
fn may_scatter_diffusely(index: u32, hit: Hit) -> bool {
    let kind = load_Material(index).kind;
#if CONTACT
    if (hit.contact != NONE && !is_opaque(kind)) {
        var touching = load_Material(material_of(hit.contact));
#if NORMAL_MAPS
        if (touching.kind == MATERIAL_KIND_NORMAL_MAPPED) {
            touching = load_Material(touching.b);
        }
#endif
        return scatters_diffusely(kind) || scatters_diffusely(touching.kind);
    }
#endif
    return scatters_diffusely(kind);
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

// Takes the path over the segment that `hit` ends, and returns its next ray (a shadow ray if path.in_shadow).
fn advance(ray: Ray, hit: Hit) -> Ray {
    draw_event();
#if LIGHT_PATHS
#if CROSSINGS
    record_crossing(ray, hit.t);
#endif
#endif
#if MEDIA
    let medium = ruling_interior(inside);
    let t = fly(medium, hit.t);
#if SCATTERING
    if (t >= 0.0) {
        return scatter_in_medium(ray, t, load_Interior(medium));
    }
#endif
#endif
    if (hit.primitive == NONE) {
#if CAMERA_PATHS
#if LIGHT_ENVIRONMENT
        add_environment(ray.d);
#endif
#endif
        return end_path(ray);
    }
    var s = surface_at(ray, hit);
#if CAMERA_PATHS
#if LIGHT_AREA
    if (s.light != NONE) {
        add_emission(ray, s);
    }
#endif
#endif
    var seen = hit.primitive;
    var index = material_of(seen);
#if NORMAL_MAPS
    index = unmap_normals(index, &s);
#endif
#if GATHERS_PAINT
    if (may_scatter_diffusely(index, hit)) {
        gather_at_surface(ray, s);
    }
#endif
#if COMPOSITE
    index = resolve_material(index, &s, false);
#endif
#if CONTACT
    if (hit.contact != NONE && load_Material(index).interior != NONE) {
        // An opaque surface that touches a volume's is what is seen there.
        var other = material_of(hit.contact);
#if COMPOSITE
        var touching = surface_at(ray, at_contact(ray, hit));
        other = resolve_material(other, &touching, false);
#endif
        let is_seen = is_opaque(load_Material(other).kind);
        seen = select(seen, hit.contact, is_seen);
        index = select(index, other, is_seen);
    }
#endif
    let m = load_Material(index);
#if INTERIORS
    if (m.interior != NONE) {
        let sides = cross_surface(inside, ray, s, m.interior, hit);
        if (is_crowded(sides)) {
            return end_path(ray);
        }
        if (is_invisible(m, sides)) {
            inside = sides.beyond;
            return pass_through(ray, s);
        }
#if DIELECTRIC
        return scatter_at_dielectric(ray, s, m, sides);
#else
        return end_path(ray);
#endif
    }
#endif
#if BOUNDARY
    if (m.kind == MATERIAL_KIND_BOUNDARY) {
        return pass_through(ray, s);
    }
#endif
    if (!count_event(s.p, m.kind != MATERIAL_KIND_DIFFUSE)) {
        return end_path(ray);
    }
#if TEXTURES
    look_at_surface(m, seen, s.p);
#endif
    return scatter_at_surface(ray, s, m);
}

#if CONNECT
// Decides whether the shadow ray that ended in `hit` reached its light (or the sensor), and gives the path back its own ray.
fn resume_after_shadow(ray: Ray, hit: Hit) -> Ray {
    var visible = hit.primitive == NONE;
#if PASS_THROUGH
#if MEDIA
    attenuate_pending(ruling_interior(shadow_inside), min(hit.t, ray.t_max));
#endif
    if (!visible) {
        var s = surface_at(ray, hit);
        var index = material_of(hit.primitive);
#if COMPOSITE
        index = resolve_material(index, &s, true);
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
        ray = advance(ray, trace(ray));
    }
    while (path.in_shadow) {
        rays_traced += 1u;
        ray = resume_after_shadow(ray, trace(ray));
    }
    if (path.connects) {
#if LIGHT_PATHS
        splat(path.lane);
#else
        for (var k = 0u; k < LANES4; k++) {
            li[k] += pending[k];
        }
#endif
    }
#else
    rays_traced += 1u;
    ray = advance(ray, trace(ray));
#endif
    return ray;
}
