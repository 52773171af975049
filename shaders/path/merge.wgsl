// Merging: what is seen through or in metal and glass. The first diffuse or foggy vertex of a camera path that something has bent is left as a visible
// point in a hash grid; light paths of the same pass add to the pixels of all points around their vertices (progressive photon mapping the other way
// round: Hachisuka et al. 2008, Knaus & Zwicker 2011). Sums are integers, so the order of a cell's list does not matter.
//
// In the table come first the links of all points, close together since searches go through many; then of each point its VisiblePoint, where there is
// sheen its PointSheen, where there is fog its PointSegment, its throughput, and through a lens the pixel within the tile of each wavelength plus one, or 0.
#include "common/params.wgsl"
#include "common/sampler.wgsl"
#include "common/spectra.wgsl"
#include "path/state.wgsl"
#include "path/mis.wgsl"
#include "bsdf/bsdf.wgsl"
#if SHADING_NORMALS
#include "geometry/facet.wgsl"
#endif
#if SCATTERING
#include "medium/homogeneous.wgsl"
#endif
#if LIGHT_PATHS
#include "sensor/connect.wgsl"
#endif

#if SHEEN
const POINT_SEGMENT = TEXELS_OF_VisiblePoint + TEXELS_OF_PointSheen;
#else
const POINT_SEGMENT = TEXELS_OF_VisiblePoint;
#endif
#if SCATTERING
const POINT_HEAD = POINT_SEGMENT + TEXELS_OF_PointSegment;
#else
const POINT_HEAD = POINT_SEGMENT;
#endif
#if SENSOR_LENS
const POINT_STRIDE = POINT_HEAD + 2u * WAVELENGTHS4;
#else
const POINT_STRIDE = POINT_HEAD + WAVELENGTHS4;
#endif
const FOG_POINT = 0x80000000u; // of VisiblePoint.about
const MOST_DEPTH_OF_POINT = 0x1fffu;

// As far as the largest kernel reaches; in fog a part of one, as long as wide.
fn kernel_reach(in_fog: bool) -> f32 {
    return merge_radius(params.merge_reach) * select(1.0, sqrt(2.0), in_fog);
}

// Cells are as wide as the largest kernel, so that a kernel reaches into no more than eight. Those of fog are cells of their own.
fn cell_of(p: vec3f, in_fog: bool) -> vec3i {
    return vec3i(floor(p / (2.0 * kernel_reach(in_fog))));
}

// Every pass has cells of its own: what a pass looks up lies together, as its points do.
fn cell_head(cell: vec3i, pass_index: u32) -> u32 {
    let c = vec3u(cell);
    return pass_index * params.heads + (hash(c.x * 0x9e3779b1u ^ hash(c.y * 0x85ebca77u ^ hash(c.z * 0xc2b2ae3du))) & (params.heads - 1u));
}

#if SCATTERING
// In fog a kernel is as many parts as a point has links: where the middle of each lies along the camera ray, in radii from the point.
fn part_of_kernel(i: u32) -> f32 {
    return f32(2u * i + 1u) - f32(POINT_LINKS);
}
#endif

// Where the rest of a point begins.
fn rest_of_point(slot: u32) -> u32 {
    return params.points + slot * POINT_STRIDE;
}

#if CAMERA_PATHS
@group(0) @binding(16) var points: WritableTable<vec4f, PointLink, VisiblePoint, PointSheen, PointSegment>;
@group(0) @binding(17) var<storage, read_write> heads: array<atomic<u32>>;

var<private> point_slot: u32; // where this path's point goes

// Leaves a visible point where the path scatters.
fn leave_visible_point(ray: Ray, at: ptr<function, Interaction>, b: ptr<function, Bsdf>) {
    let p = (*at).s.p;
    let in_medium = (*at).extinction > 0.0;
    let first = rest_of_point(point_slot);
    let radius = merge_radius(path.length);
    let links = select(1u, POINT_LINKS, in_medium);
    for (var i = 0u; i < links; i++) {
        var part = p;
#if SCATTERING
        let along = part_of_kernel(i) * radius;
        part = select(p, p + along * ray.d, in_medium);
        // What lies beyond the ends of the kernel, or of the camera ray, has nothing to do with it.
        let half_length = fog_kernel(radius, (*at).extinction);
        if (in_medium && (along < -min(half_length, distance(ray.o, p) + radius) - radius || along > min(half_length, (*at).rest + radius) + radius)) {
            continue;
        }
#endif
        let link = point_slot * POINT_LINKS + i;
        let next = atomicExchange(&heads[cell_head(cell_of(part, in_medium), pass_of_path)], link + 1u);
        store_PointLink_at(link, PointLink(part.x, part.y, part.z, next));
    }
    let carried = carried_wavelengths();
    let about = select(0u, FOG_POINT, in_medium) | min(path.depth, MOST_DEPTH_OF_POINT) << 18u | carried.y << 13u | carried.x << 8u
        | pass_of_path;
    var medium_or_coat = 0u;
#if COAT
    medium_or_coat = (*b).coat + 1u;
#endif
#if SCATTERING
    medium_or_coat = select(medium_or_coat, bitcast<u32>((*b).m.alpha), in_medium);
#endif
    let normal = select((*at).ns, ray.d, in_medium);
    let connection = path.light_path_density / f32(params.light_paths);
    store_VisiblePoint_at(first, VisiblePoint(vec4f(normal, radius), sampled_pixel, about, medium_or_coat, connection));
#if SHEEN
    store_PointSheen_at(first + TEXELS_OF_VisiblePoint, PointSheen((*b).sheen, (*b).sheen_entered, 0u, 0u));
#endif
#if SCATTERING
    store_PointSegment_at(first + POINT_SEGMENT, PointSegment(distance(ray.o, p), (*at).rest, 0u, 0u));
#endif
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        var throughput = beta[k];
#if DIFFUSE
        throughput *= select(INV_PI * diffuse_reflectance(b, k), vec4f(1.0), in_medium);
#endif
#if SCATTERING
        // Light paths bring the scattering coefficient a second time.
        let sigma_s = spectrum((*b).m.a, k);
        throughput *= select(vec4f(1.0), select(vec4f(0.0), 1.0 / sigma_s, sigma_s > vec4f(0.0)), in_medium);
#endif
        store_points(first + POINT_HEAD + k, throughput);
#if SENSOR_LENS
        store_points(first + POINT_HEAD + WAVELENGTHS4 + k, vec4f(landed_pixel[k] + 1u));
#endif
    }
}
#else
@group(0) @binding(16) var points: WrittenTable<vec4f, PointLink, VisiblePoint, PointSheen, PointSegment>;
@group(0) @binding(17) var<storage, read> heads: array<u32>;

// Cells along an axis, less one, that a search goes through at most. Wavelengths land no further apart than takes half of them; numbers of cells far from the origin may not fit.
const MOST_CELLS = 8;

// Squared distance of `p` from what lies between the origin and `end`.
fn distance2_from_line(p: vec3f, end: vec3f) -> f32 {
    let v = p - clamp(dot(p, end) / max(dot(end, end), 1e-30), 0.0, 1.0) * end;
    return dot(v, v);
}

// Adds this vertex, the path's of this number, to all points around it, `weight` times. The path arrives along `d`, as facets have it; normals are on the side
// that a surface is lit from.
fn merge(d: vec3f, weight: f32, v: Vertex, number: u32, n: vec3f, ns: vec3f) {
    let pass_index = pass_of_path;
    let own = carried_wavelengths();
#if SCATTERING
    let medium = load_Interior(ruling_interior(inside));
#endif
    let in_fog = v.extinction > 0.0;
    // Cells that the largest kernel can reach into: two along each axis, and more where wavelengths land apart, between these ends.
    let reach = kernel_reach(in_fog);
    var by = vec3f(0.0);
    var lands = vec2f(0.0);
#if DISPERSION
    by = landing_by_index;
    lands = landing_ends();
#endif
    let ends = array(v.p + lands.x * by, v.p + lands.y * by);
    let between = ends[1] - ends[0];
    let first = cell_of(min(ends[0], ends[1]) - reach, in_fog);
    let last = min(max(cell_of(max(ends[0], ends[1]) + reach, in_fog) - first, vec3i(0)), vec3i(MOST_CELLS));
    var cell = first;
    var ahead = vec3i(0); // the cell after that, from the first on
    var next = 0u;
    loop {
        // The next point within reach. Software drivers execute all of a loop for each of its turns, so that this one has little in it.
        var found = NONE;
        while (found == NONE && (next != 0u || ahead.z <= last.z)) {
            if (next == 0u) {
                cell = first + ahead;
                next = heads[cell_head(cell, pass_index)];
                let ends_row = ahead.x == last.x;
                let ends_plane = ends_row && ahead.y == last.y;
                ahead = vec3i(
                    select(ahead.x + 1, 0, ends_row),
                    select(select(ahead.y, ahead.y + 1, ends_row), 0, ends_plane),
                    select(ahead.z, ahead.z + 1, ends_plane),
                );
            }
            if (next != 0u) {
                let link = load_PointLink(next - 1u);
                found = select(NONE, next - 1u, distance2_from_line(vec3f(link.x, link.y, link.z) - ends[0], between) < reach * reach);
                next = link.next;
            }
        }
        if (found == NONE) {
            break;
        }
        let link = load_PointLink(found);
        let place = vec3f(link.x, link.y, link.z);
        let to_point = place - v.p;
        let at = rest_of_point(found / POINT_LINKS);
        let point = load_VisiblePoint_at(at);
        let normal = point.normal.xyz;
        let radius = point.normal.w;
        let about = point.about;
        // What both carry.
        let carried = vec2u(max(own.x, (about >> 8u) & 0x1fu), min(own.y, (about >> 13u) & 0x1fu));
        // Another cell of the same head may hold the point, and have it looked at a second time.
        let is_around = distance2_from_line(place - ends[0], between) <= radius * radius * select(1.0, 2.0, in_fog);
        if (!is_around || (about & 0xffu) != pass_index || any(cell_of(place, in_fog) != cell) || carried.x > carried.y
            || (about >= FOG_POINT) != in_fog) {
            continue;
        }
        // Together no longer than a path may be.
        if (number + ((about >> 18u) & MOST_DEPTH_OF_POINT) > params.max_depth + 1u) {
            continue;
        }
        var camera = v;
        var factor = weight;
#if SCATTERING
        let segment = load_PointSegment_at(at + POINT_SEGMENT);
        let half_length = fog_kernel(radius, v.extinction);
        if (in_fog) {
            camera.pdf_rev = phase_hg(-dot(normal, d), bitcast<f32>(point.medium_or_coat));
            factor *= camera.pdf_rev;
        }
#endif
        if (!in_fog && (dot(normal, ns) < 0.9 || abs(dot(to_point, n)) > 0.2 * radius || dot(normal, d) >= 0.0)) {
            // Another surface, or its other side.
            continue;
        }
#if SHEEN
        let over = load_PointSheen_at(at + TEXELS_OF_VisiblePoint);
        factor *= out_of_sheen(over.sheen, over.entered, min(abs(dot(normal, d)), 1.0));
#endif
        let measure = merge_measure(camera, radius);
        let merged = path.emission * safe_ratio(measure * camera.cos_from, camera.pdf_rev);
        let others = camera_path_density_at(camera, number) + path.emission * point.connection;
#if COAT
        var there: Bsdf;
        there.coat = select(point.medium_or_coat - 1u, NONE, in_fog);
        look_at_coat(&there, load_Material(select(there.coat, 0u, there.coat == NONE)));
        var out = coat_transmittance(&there, min(abs(dot(normal, d)), 1.0));
#endif
        let w = factor / (1.0 + safe_ratio(others, merged));
        for (var k = 0u; k < WAVELENGTHS4; k++) {
            // Each from where it lands.
            var apart = vec4f(0.0);
#if DISPERSION
            apart = index_from_hero(k);
#endif
            let to_x = to_point.x - apart * by.x;
            let to_y = to_point.y - apart * by.y;
            let to_z = to_point.z - apart * by.z;
            var distance2 = to_x * to_x + to_y * to_y + to_z * to_z;
            var density = vec4f(1.0 / (PI * radius * radius));
#if SCATTERING
            if (in_fog) {
                // From the middle of the kernel's part to the vertex, and from the point, on the camera ray.
                let in_part = -(to_x * normal.x + to_y * normal.y + to_z * normal.z);
                let along = in_part + part_of_kernel(found % POINT_LINKS) * radius;
                distance2 -= in_part * in_part;
                // As much of the kernel as the camera ray has around the vertex, so that no light is lost where it ends.
                let length = min(vec4f(segment.behind), along + half_length) + min(vec4f(segment.before), half_length - along);
                density /= max(length, vec4f(1e-6 * half_length));
                // Light is dimmed as far as the vertex, not as the point.
                density *= exp(-along * sigma_t(medium, k));
                let is_within = (in_part >= vec4f(-radius)) & (in_part < vec4f(radius)) & (abs(along) <= vec4f(half_length))
                    & (along >= vec4f(-segment.before - radius)) & (along <= vec4f(segment.behind + radius));
                density = select(vec4f(0.0), density, is_within);
            }
#endif
            density = select(vec4f(0.0), density, distance2 <= vec4f(radius * radius));
            Ld[k] = w * density * beta[k] * load_points(at + POINT_HEAD + k);
#if COAT
            Ld[k] *= if_coated(&there, out[k]);
#endif
        }
#if SENSOR_LENS
        for (var k = 0u; k < WAVELENGTHS4; k++) {
            landed_pixel[k] = vec4u(load_points(at + POINT_HEAD + WAVELENGTHS4 + k)) - 1u;
        }
        splat_landed(carried);
#else
        let pixel = point.pixel;
        splat(carried, place_in_tile(vec2u(pixel % params.image_width, pixel / params.image_width)));
#endif
    }
}
#endif

#if LIGHT_PATHS
#if DIFFUSE
// What arrives at a surface that may be diffuse is merged before chance decides what the surface is: the points know which part of a mixture they are of.
fn merge_at_surface(ray: Ray, s: Surface) {
    let flip = select(1.0, -1.0, dot(ray.d, s.n) > 0.0);
    let cos_from = -flip * dot(ray.d, s.n);
    var d = ray.d;
    var cos_facet = cos_from;
    var weight = 1.0;
#if SHADING_NORMALS
    let faced = light_on_facet(-d, s.n, s.ns);
    d = -faced.w;
    cos_facet = flip * dot(faced.w, s.ns);
    // Veach's correction for shading normals, as in leaving_factor.
    weight = faced.weight * cos_facet / max(cos_from, 1e-20);
#endif
    if (cos_facet > 0.0 && path.depth < params.max_depth) {
        let v = Vertex(s.p, cos_from, 1.0, 0.0, cos_facet * INV_PI, false, 0.0);
        merge(d, weight, v, path.depth + 1u, flip * s.n, flip * s.ns);
    }
}
#endif

#if SCATTERING
fn merge_in_medium(ray: Ray, at: ptr<function, Interaction>) {
    if (path.depth < params.max_depth) {
        merge(ray.d, 1.0, Vertex((*at).s.p, 1.0, 1.0, 0.0, 0.0, false, (*at).extinction), path.depth + 1u, vec3f(0.0), vec3f(0.0));
    }
}
#endif
#endif
