// Faces of lenses: surfaces of revolution, flat rings around them, and the edge (the model: src/geometry/lens_face.rs). Where two of them meet, both ask on
// which side of the common circle a ray crosses the cylinder through it, and get one answer: a ray crosses one of the two, whatever rounding does.
#include "geometry/trace.wgsl"
#include "geometry/primitives.wgsl"

// A ray along and across the axis of a lens.
struct Meridian {
    oz: f32,
    dz: f32,
    o: vec3f,
    d: vec3f,
}

fn height_along(m: Meridian, t: f32) -> f32 {
    return m.oz + t * m.dz;
}

// Where the ray enters and leaves the endless cylinder; where it enters is infinite if it does not.
fn cross_tube(m: Meridian, radius: f32) -> vec2f {
    let a = dot(m.d, m.d);
    let distance = length(m.o);
    if (a < 1e-24) {
        return select(vec2f(INFINITE), vec2f(-INFINITE, INFINITE), distance <= radius);
    }
    // As for spheres, without cancellation.
    let b = -dot(m.o, m.d) / a;
    let l = m.o + b * m.d;
    let discriminant = (radius * radius - dot(l, l)) / a;
    let q = b + select(-1.0, 1.0, b >= 0.0) * sqrt(max(discriminant, 0.0));
    if (discriminant <= 0.0 || q == 0.0) {
        return vec2f(INFINITE);
    }
    let other = (distance - radius) * (distance + radius) / a / q;
    return clamp(vec2f(min(q, other), max(q, other)), vec2f(-INFINITE), vec2f(INFINITE));
}

struct FaceSurface {
    edge: f32, // heights over the base: where it ends,
    vertex: f32, // and of its vertex
    curvature: f32,
    side: f32, // 1 or -1: the outward normal is along the axis, or against it
    conic: f32,
    terms: u32, // aspheric ones
    low: f32, // least and greatest height over the vertex
    high: f32,
    coefficients: u32, // the first row of these
    radius: f32,
}

fn face_surface(size: vec3f) -> FaceSurface {
    let at = bitcast<u32>(size.y);
    let a = primitive_row(at);
    let b = primitive_row(at + 1u);
    return FaceSurface(a.x, a.y, a.z, a.w, b.x, bitcast<u32>(b.y), b.z, b.w, at + 2u, size.x);
}

// Height over the vertex where the squared distance from the axis is `r2`, and dz/dr over r.
fn face_sag_and_slope(s: FaceSurface, r2: f32) -> vec2f {
    let root = sqrt(max(1.0 - (1.0 + s.conic) * s.curvature * s.curvature * r2, 0.0));
    var sag = r2 * s.curvature / (1.0 + root);
    var slope = s.curvature / max(root, 1e-30);
#if ASPHERES
    let per_square = 1.0 / (s.radius * s.radius);
    let u = r2 * per_square;
    var power = per_square;
    var row = vec4f(0.0);
    for (var i = 0u; i < s.terms; i++) {
        if (i % 4u == 0u) {
            row = primitive_row(s.coefficients + i / 4u);
        }
        sag += row.x * power * r2;
        slope += 2.0 * f32(i + 1u) * row.x * power;
        power *= u;
        row = row.yzwx;
    }
#endif
    return vec2f(sag, slope);
}

// How far the ray is above the surface, and the derivative of that.
fn gap_and_rate(m: Meridian, s: FaceSurface, t: f32) -> vec2f {
    let across = m.o + t * m.d;
    let surface = face_sag_and_slope(s, dot(across, across));
    return vec2f(height_along(m, t) - s.vertex - surface.x, m.dz - surface.y * dot(across, m.d));
}

// Half of dF/dt where F = c (x^2 + y^2 + (1 + k) z^2) - 2 z, which grows downwards near the vertex; `along`: the point's distance from that along the ray.
fn half_rate_of_conic(m: Meridian, s: FaceSurface, z: f32, along: f32) -> f32 {
    return s.curvature * (along + s.conic * z * m.dz) - m.dz;
}

// Where the ray crosses the conic, upwards and downwards through the sheet that has the vertex, and whether it does.
fn cross_conic(m: Meridian, s: FaceSurface) -> vec3f {
    let c = s.curvature;
    let a = c * (1.0 + s.conic * m.dz * m.dz);
    // From the ray's nearest point to the vertex, so that far origins do not cost digits.
    let along = dot(m.o, m.d) + (m.oz - s.vertex) * m.dz;
    let o = m.o - along * m.d;
    let z = (m.oz - s.vertex) - along * m.dz;
    let b = half_rate_of_conic(m, s, z, dot(o, m.d) + z * m.dz);
    let f = c * (dot(o, o) + (1.0 + s.conic) * z * z) - 2.0 * z;
    let discriminant = b * b - a * f;
    let root = sqrt(max(discriminant, 0.0));
    // a t + b = -root upwards, root downwards; of both forms the one that does not cancel.
    let up = select((-root - b) / a, f / (root - b), b <= 0.0);
    let down = select((root - b) / a, f / (-root - b), b >= 0.0);
    return vec3f(up - along, down - along, discriminant);
}

#if ASPHERES
// The crossing between two points of the ray, of which the first is below the surface, or not.
fn refine_crossing(m: Meridian, s: FaceSurface, near: f32, far: f32, below: bool, first: f32) -> f32 {
    var lo = near;
    var hi = far;
    var t = first;
    for (var i = 0u; i < 24u; i++) {
        if (!(t > lo && t < hi)) {
            t = 0.5 * (lo + hi);
        }
        let gap = gap_and_rate(m, s, t);
        if ((gap.x < 0.0) == below) {
            lo = t;
        } else {
            hi = t;
        }
        let next = t - gap.x / gap.y;
        if (next == t) {
            break;
        }
        t = next;
    }
    return clamp(t, near, far);
}
#endif

fn intersect_lens_face(ray: Ray, primitive: u32, base: vec3f, axis: vec3f, size: vec3f, hit: ptr<function, Hit>) {
    let f = ray.o - base;
    let oz = dot(f, axis);
    let dz = dot(ray.d, axis);
    let m = Meridian(oz, dz, f - oz * axis, ray.d - dz * axis);
    let form = bitcast<u32>(size.z);
    let from_here = leaves(ray, primitive);
    let ends = cross_tube(m, size.x);
    if (form == LENS_EDGE) {
        let heights = primitive_row(bitcast<u32>(size.y));
        var ts = ends;
        if (from_here) {
            // One root is zero by construction, whatever rounding says.
            let a = dot(m.d, m.d);
            ts = vec2f(select(INFINITE, -2.0 * dot(m.o, m.d) / a, a >= 1e-24));
        }
        for (var i = 0u; i < 2u; i++) {
            let t = select(ts.x, ts.y, i == 1u);
            let h = height_along(m, t);
            if (t > 0.0 && t < INFINITE && h >= heights.x && h < heights.y) {
                offer_hit(ray, t, primitive, vec2f(0.0), hit);
            }
        }
        return;
    }
    if (ends.x == INFINITE || ends.y <= 0.0) {
        return;
    }
    let start = max(ends.x, 1e-30);
    if (form == LENS_ANNULUS) {
        let ring = primitive_row(bitcast<u32>(size.y));
        if (from_here || dz == 0.0) {
            return;
        }
        // The hole's ends, or where it begins and ends at once.
        let hole = cross_tube(m, ring.y);
        let h = ring.x;
        let starts_below = height_along(m, start) < h;
        let ends_below = height_along(m, ends.y) < h;
        var is_met = starts_below != ends_below;
        if (hole.x != INFINITE) {
            let before = hole.x > start && starts_below != (height_along(m, hole.x) < h);
            let last = max(hole.y, start);
            is_met = before || (ends.y > last && (height_along(m, last) < h) != ends_below);
        }
        if (is_met) {
            offer_hit(ray, clamp((h - oz) / dz, start, ends.y), primitive, vec2f(0.0), hit);
        }
        return;
    }
    let s = face_surface(size);
    var starts_below = height_along(m, start) < s.edge;
    if (from_here || ends.x <= 0.0) {
        let gap = gap_and_rate(m, s, 0.0);
        starts_below = select(gap.x, gap.y, from_here) < 0.0;
    }
    let crosses_once = starts_below != (height_along(m, ends.y) < s.edge);
    if (from_here && !crosses_once) {
        return;
    }
    var roots = cross_conic(m, s);
    if (from_here) {
        // One root is zero by construction.
        let z = oz - s.vertex;
        let a = s.curvature * (1.0 + s.conic * dz * dz);
        let along = dot(m.o, m.d) + z * dz;
        roots = vec3f(-2.0 * half_rate_of_conic(m, s, z, along) / a);
    }
    let first = select(roots.y, roots.x, starts_below);
#if ASPHERES
    if (s.terms > 0u) {
        var near = start;
        var far = ends.y;
        if (dz != 0.0) {
            // Within the heights that the surface has.
            let slab = (vec2f(s.low, s.high) + (s.vertex - oz)) / dz;
            let margin = 1e-3 * abs(slab.y - slab.x) + 1e-6 * max(abs(slab.x), abs(slab.y));
            near = max(near, min(slab.x, slab.y) - margin);
            far = min(far, max(slab.x, slab.y) + margin);
        }
        if (crosses_once) {
            offer_hit(ray, refine_crossing(m, s, near, far, starts_below, first), primitive, vec2f(0.0), hit);
            return;
        }
        // Twice or not at all: the farthest off on the other side is between both.
        let grows = gap_and_rate(m, s, near).y > 0.0;
        if (near >= far || grows != starts_below || (gap_and_rate(m, s, far).y > 0.0) == grows) {
            return;
        }
        var lo = near;
        var hi = far;
        for (var i = 0u; i < 24u; i++) {
            let middle = 0.5 * (lo + hi);
            if ((gap_and_rate(m, s, middle).y > 0.0) == grows) {
                lo = middle;
            } else {
                hi = middle;
            }
        }
        if ((gap_and_rate(m, s, lo).x < 0.0) != starts_below) {
            offer_hit(ray, refine_crossing(m, s, near, lo, starts_below, 0.5 * (near + lo)), primitive, vec2f(0.0), hit);
        }
        return;
    }
#endif
    if (crosses_once) {
        offer_hit(ray, clamp(first, start, ends.y), primitive, vec2f(0.0), hit);
        return;
    }
    let lo = min(roots.x, roots.y);
    let hi = max(roots.x, roots.y);
    // The conic's other half or sheet is no part of the lens.
    let limit = (1.0 + s.conic) * s.curvature;
    let is_near = (height_along(m, lo) - s.vertex) * limit < 1.0 && (height_along(m, hi) - s.vertex) * limit < 1.0;
    if (roots.z > 0.0 && lo > start && hi < ends.y && is_near) {
        offer_hit(ray, lo, primitive, vec2f(0.0), hit);
    }
}

struct LensPlace {
    p: vec3f, // over the base
    n: vec3f, // outward
    curvature: f32, // of that, across the axis
}

// The point of the face next to `q` (over the base).
fn place_on_lens_face(q: vec3f, axis: vec3f, size: vec3f) -> LensPlace {
    let h = dot(q, axis);
    let across = q - h * axis;
    let form = bitcast<u32>(size.z);
    if (form == LENS_EDGE) {
        let n = normalize(across);
        return LensPlace(h * axis + size.x * n, n, 1.0 / size.x);
    }
    if (form == LENS_ANNULUS) {
        let ring = primitive_row(bitcast<u32>(size.y));
        return LensPlace(across + ring.x * axis, ring.w * axis, 0.0);
    }
    let s = face_surface(size);
    let surface = face_sag_and_slope(s, dot(across, across));
    return LensPlace(across + (s.vertex + surface.x) * axis, s.side * normalize(axis - surface.y * across), -s.side * surface.y);
}
