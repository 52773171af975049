// The camera's lens, surface by surface: a ray of one wavelength leads from the film to a ray before the lens, and that ray comes back to the film at every
// wavelength by its own indices, each to its own place. Etendue is the same on both sides, so that densities need no Jacobian.
//
// In the lens's coordinates z runs along the axis from the scene to the film, 0 at the first vertex (lens/camera.rs).
#include "common/params.wgsl"
#include "common/math.wgsl"
#include "common/spectra.wgsl"
#include "sensor/landing.wgsl"
#if DISPERSION
#if LIGHT_PATHS
#include "path/state.wgsl"
#endif
#endif

@group(0) @binding(25) var<uniform> lens: array<LensSurface, LENS_SURFACES>;
@group(0) @binding(26) var<uniform> pupil_bounds: array<vec4f, LENS_BOUNDS>;

// Four rays of the four wavelengths 4k .. 4k+3.
struct LensRays {
    ox: vec4f,
    oy: vec4f,
    oz: vec4f,
    dx: vec4f,
    dy: vec4f,
    dz: vec4f,
    weight: vec4f, // share of the light that gets through, 0 where it is stopped
}

fn four_rays(o: vec3f, d: vec3f) -> LensRays {
    return LensRays(vec4f(o.x), vec4f(o.y), vec4f(o.z), vec4f(d.x), vec4f(d.y), vec4f(d.z), vec4f(1.0));
}

#if LENS_ASPHERES
// Height of an aspheric surface over the plane of its vertex, and slope over the distance from the axis, whose square is r2.
fn sag_and_slope(s: LensSurface, r2: vec4f) -> array<vec4f, 2> {
    let root = sqrt(max(vec4f(0.0), 1.0 - (1.0 + s.conic) * s.curvature * s.curvature * r2));
    // Coefficients are those of powers of the radius over that of the rim.
    let a = s.low;
    let b = s.high;
    let rim2 = s.semi_diameter * s.semi_diameter;
    let u = r2 / rim2;
    let sum = ((((((b.w * u + b.z) * u + b.y) * u + b.x) * u + a.w) * u + a.z) * u + a.y) * u + a.x;
    let slopes = ((((((8.0 * b.w * u + 7.0 * b.z) * u + 6.0 * b.y) * u + 5.0 * b.x) * u + 4.0 * a.w) * u + 3.0 * a.z) * u + 2.0 * a.y) * u + a.x;
    return array(s.curvature * r2 / (1.0 + root) + u * sum, s.curvature / max(root, vec4f(1e-6)) + 2.0 * slopes / rim2);
}
#endif

// The rays through the lens, towards the film or towards the scene.
fn trace_lens(start: LensRays, k: u32, to_film: bool) -> LensRays {
    var r = start;
    let side = select(-1.0, 1.0, to_film);
    var n1 = vec4f(1.0);
#if LENS_ABSORPTION
    var absorption = vec4f(0.0);
    var depth = vec4f(0.0);
#endif
    for (var step = 0u; step < LENS_SURFACES; step++) {
        let s = lens[select(LENS_SURFACES - 1u - step, step, to_film)];
        let beyond = select(s.front_row, s.row, to_film);
        var n2 = vec4f(1.0);
        if (beyond != LENS_AIR) {
            n2 = spectrum(beyond, k);
        }
        // c (x^2 + y^2 + (1 + conic) z^2) = 2 z, solved from the plane of the vertex on for the root near it.
        let c = s.curvature;
        let to_vertex = (s.z - r.oz) / r.dz;
        let px = r.ox + to_vertex * r.dx;
        let py = r.oy + to_vertex * r.dy;
        let a = c * (1.0 + s.conic * r.dz * r.dz);
        let b = r.dz - c * (px * r.dx + py * r.dy);
        let q = c * (px * px + py * py);
        let discriminant = b * b - a * q;
        let root = sqrt(max(vec4f(0.0), discriminant));
        var t = q / (b + side * root);
        var x = px + t * r.dx;
        var y = py + t * r.dy;
        var z = t * r.dz;
#if LENS_ASPHERES
        var slope = c / max(vec4f(1e-6), 1.0 - c * (1.0 + s.conic) * z);
        if (any(s.low != vec4f(0.0)) || any(s.high != vec4f(0.0))) {
            for (var i = 0u; i < 6u; i++) {
                let surface = sag_and_slope(s, x * x + y * y);
                slope = surface[1];
                let back = (z - surface[0]) / (r.dz - slope * (x * r.dx + y * r.dy));
                t -= back;
                x -= back * r.dx;
                y -= back * r.dy;
                z -= back * r.dz;
            }
            slope = sag_and_slope(s, x * x + y * y)[1];
        }
        let nx = -slope * x;
        let ny = -slope * y;
        let nz = vec4f(1.0);
#else
        let nx = -c * x;
        let ny = -c * y;
        let nz = 1.0 - c * (1.0 + s.conic) * z;
#endif
        var passes = (discriminant >= vec4f(0.0)) & (x * x + y * y <= vec4f(s.semi_diameter * s.semi_diameter));
        // A stop between equal media bends nothing.
        if (s.front_row != s.row) {
#if LENS_ASPHERES
            let scale = inverseSqrt(nx * nx + ny * ny + nz * nz);
            let cos1 = side * scale * (r.dx * nx + r.dy * ny + r.dz * nz);
#else
            // The normal's length is 1 on a sphere; times the cosine it is the root.
            var scale = vec4f(1.0);
            if (s.conic != 0.0) {
                scale = inverseSqrt(nx * nx + ny * ny + nz * nz);
            }
            let cos1 = scale * root;
#endif
            let eta = n1 / n2;
            let cos2_squared = 1.0 - eta * eta * (1.0 - cos1 * cos1);
            let cos2 = sqrt(max(vec4f(0.0), cos2_squared));
            // Fresnel's transmittances, the mean of both polarisations.
            let perpendicular = eta * cos1 + cos2;
            let parallel = cos1 + eta * cos2;
            let product = perpendicular * parallel;
            let through = 2.0 * eta * cos1 * cos2 * (perpendicular * perpendicular + parallel * parallel) / (product * product);
            passes &= (cos2_squared > vec4f(0.0)) & (cos1 > vec4f(0.0));
            r.weight *= select(vec4f(0.0), through, passes);
            let bend = side * scale * (cos2 - eta * cos1);
            r.dx = eta * r.dx + bend * nx;
            r.dy = eta * r.dy + bend * ny;
            r.dz = eta * r.dz + bend * nz;
        }
        r.weight = select(vec4f(0.0), r.weight, passes & (r.weight > vec4f(0.0)));
#if LENS_ABSORPTION
        depth += absorption * (to_vertex + t);
        absorption = spectrum(select(s.front_absorption, s.absorption, to_film), k);
#endif
        if (!any(r.weight > vec4f(0.0))) {
            break;
        }
        r.ox = x;
        r.oy = y;
        r.oz = s.z + z;
        n1 = n2;
    }
#if LENS_ABSORPTION
    r.weight = select(vec4f(0.0), r.weight * exp(-depth), r.weight > vec4f(0.0));
#endif
    return r;
}

// Bound of the exit pupil at this radius on the film: centre and half extents.
fn pupil_at(radius: f32) -> vec4f {
    let x = clamp(radius * params.dual_v.x, 0.0, f32(LENS_BOUNDS - 1u));
    let i = min(u32(x), LENS_BOUNDS - 2u);
    return mix(pupil_bounds[i], pupil_bounds[i + 1u], x - f32(i));
}

// A point of the bound for this place of the film.
fn sample_pupil(film: vec2f, disc: vec2f) -> vec2f {
    let radius = length(film);
    let along = select(vec2f(1.0, 0.0), film / radius, radius > 0.0);
    let bound = pupil_at(radius);
    let q = vec2f(bound.x + bound.y * disc.x, bound.z * disc.y);
    return vec2f(along.x * q.x - along.y * q.y, along.y * q.x + along.x * q.y);
}

// Brings a ray from before the lens to the film, from `o` by way of `o + v`, where all wavelengths go through that land apart around `o`. Returns the density with which camera paths of the tile take it, in the mean over their leading
// wavelengths, per etendue; times the area of a pixel.
fn land(o: vec3f, v: vec3f, u: vec2f) -> f32 {
    let d = normalize(v);
    let size = vec2f(f32(params.image_width), f32(params.image_height));
    let gap = params.dual_u.y - params.dual_u.z;
    var density = vec4f(0.0);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        let is_wavelength = vec4u(4u * k, 4u * k + 1u, 4u * k + 2u, 4u * k + 3u) < vec4u(WAVELENGTHS);
        var start = four_rays(o, d);
#if DISPERSION
#if LIGHT_PATHS
        let by = lens_from_world(landing_by_index);
        let apart = select(vec4f(0.0), index_from_hero(k), beta[k] > vec4f(0.0));
        let vx = v.x - by.x * apart;
        let vy = v.y - by.y * apart;
        let vz = v.z - by.z * apart;
        let way = sqrt(vx * vx + vy * vy + vz * vz);
        start = LensRays(o.x + by.x * apart, o.y + by.y * apart, o.z + by.z * apart, vx / way, vy / way, vz / way, start.weight);
#endif
#endif
        let r = trace_lens(start, k, true);
        let arrives = (r.weight > vec4f(0.0)) & is_wavelength;
        let to_film = (params.dual_u.y - r.oz) / r.dz;
        let x = select(vec4f(1e3), r.ox + to_film * r.dx, arrives);
        let y = select(vec4f(1e3), r.oy + to_film * r.dy, arrives);
        // The image is upside down.
        let column = (0.5 - 0.5 * x / params.half_extent.x) * size.x;
        let row = (0.5 + 0.5 * y / params.half_extent.y) * size.y;
        let share = land_in_pixels(k, column, row, arrives, u);
        let lands = share > vec4f(0.0);
        landed_weight[k] *= r.weight / params.dual_v.y;
        // The place in the exit pupil, seen from where it arrives.
        let to_pupil = (params.dual_u.z - r.oz) / r.dz;
        let px = r.ox + to_pupil * r.dx;
        let py = r.oy + to_pupil * r.dy;
        let radius = sqrt(x * x + y * y);
        let ax = select(vec4f(1.0), x / radius, radius > vec4f(0.0));
        let ay = select(vec4f(0.0), y / radius, radius > vec4f(0.0));
        let bounds = transpose(mat4x4f(pupil_at(radius.x), pupil_at(radius.y), pupil_at(radius.z), pupil_at(radius.w)));
        let along = (px * ax + py * ay - bounds[0]) / bounds[1];
        let across = (py * ax - px * ay) / bounds[2];
        let is_bounded = (bounds[1] > vec4f(0.0)) & (along * along + across * across <= vec4f(1.0));
        let dz2 = r.dz * r.dz;
        density += select(vec4f(0.0), share * gap * gap / (dz2 * dz2 * PI * bounds[1] * bounds[2]), lands & is_bounded);
    }
    return sum4(density) / f32(WAVELENGTHS);
}

// A point and a direction of the world in the lens's coordinates, and back.
fn lens_from_world(v: vec3f) -> vec3f {
    return vec3f(dot(v, params.axis_x.xyz), dot(v, params.axis_y.xyz), dot(v, params.axis_z.xyz));
}

fn world_from_lens(v: vec3f) -> vec3f {
    return v.x * params.axis_x.xyz + v.y * params.axis_y.xyz + v.z * params.axis_z.xyz;
}

fn lens_point(p: vec3f) -> vec3f {
    return lens_from_world(p - params.origin.xyz) + vec3f(0.0, 0.0, params.dual_u.x);
}

fn world_point(p: vec3f) -> vec3f {
    return params.origin.xyz + world_from_lens(p - vec3f(0.0, 0.0, params.dual_u.x));
}

// Area of a pixel on the film.
fn pixel_area() -> f32 {
    return 4.0 * params.half_extent.x * params.half_extent.y / (f32(params.image_width) * f32(params.image_height));
}
