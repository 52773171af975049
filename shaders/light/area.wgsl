// Lights with a surface: triangles, spheres, discs, cylinders.
#include "light/light.wgsl"
#if CAUSTICS
#include "light/aim.wgsl"
#endif
#if LIGHT_TEXTURES
#include "geometry/texture.wgsl"
#endif

#if LIGHT_SPHERE
// 1 - cos of the angle that a sphere subtends, without cancellation for small and distant ones.
fn sphere_one_minus_cos(radius: f32, distance_squared: f32) -> f32 {
    let s2 = min(radius * radius / distance_squared, 1.0);
    return s2 / (1.0 + sqrt(1.0 - s2));
}
#endif

// pdf per solid angle at `p` of sampling light `index` at distance `t` along `d`, where it has the normal `n`.
fn pdf_li_area(index: u32, p: vec3f, t: f32, d: vec3f, n: vec3f) -> f32 {
    let light = load_Light(index);
    let probability = probability_of_choice(light, index, p);
#if LIGHT_SPHERE
    if (light.kind == LIGHT_KIND_SPHERE) {
        let v = light.p0.xyz - p;
        let r = light.p2.x;
        let d2 = dot(v, v);
        if (d2 > r * r) {
            // Nothing but the near side is sampled from outside.
            return select(probability / (2.0 * PI * sphere_one_minus_cos(r, d2)), 0.0, dot(n, d) > 0.0);
        }
    }
#endif
    return probability * t * t / (light.area * max(abs(dot(n, d)), 1e-20));
}

// Normal of a light's surface at its point `p`.
fn normal_of_light(light: Light, p: vec3f) -> vec3f {
    switch light.kind {
#if LIGHT_TRIANGLE
        case LIGHT_KIND_TRIANGLE: {
            return normalize(cross(light.p1.xyz - light.p0.xyz, light.p2.xyz - light.p0.xyz));
        }
#endif
#if LIGHT_DISC
        case LIGHT_KIND_DISC: {
            return light.p1.xyz;
        }
#endif
        default: {
            // A sphere, or with its axis a cylinder.
            let v = p - light.p0.xyz;
            return normalize(v - dot(v, light.p1.xyz) * light.p1.xyz);
        }
    }
}

#if TOUCHED_LIGHTS
// Distance from `p` to where light starts that reaches it over `distance` from a point of normal `n`: surfaces in which the light lies are no shadow on it.
fn distance_to_start(light: Light, p: vec3f, n: vec3f, cos_theta: f32, distance: f32) -> f32 {
    let lift = select(0.0, light.p1.w + 2.0 * GAMMA_7 * (dot(abs(n), abs(p)) + distance), light.p1.w > 0.0);
    return max(distance - lift / max(abs(cos_theta), 1e-10), 0.5 * distance);
}
#endif

#if LIGHT_TEXTURES
// The picture that a light shows, or NONE.
fn texture_of_light(light: Light) -> u32 {
    return select(NONE, bitcast<u32>(light.p0.w), light.kind == LIGHT_KIND_TRIANGLE);
}

// What that picture shows at the point `p` of a primitive.
fn emission_texels(light: Light, primitive: u32, p: vec3f) -> Filtered {
    var f: Filtered;
    let index = texture_of_light(light);
    if (index != NONE) {
        f = filter_texels(index, primitive, p);
    }
    return f;
}
#endif

fn emits_towards(light: Light, cos_theta: f32) -> bool {
    return cos_theta > 0.0 || light.two_sided != 0u;
}

// A point of the light's surface, uniform in area.
struct LightPoint {
    p: vec3f,
    n: vec3f,
}

fn sample_light_surface(light: Light, u: vec2f) -> LightPoint {
    switch light.kind {
#if LIGHT_DISC
        case LIGHT_KIND_DISC: {
            let c = light.p2.x * sample_disc(u);
            let f = frame_around(light.p1.xyz);
            return LightPoint(light.p0.xyz + c.x * f[0] + c.y * f[1], light.p1.xyz);
        }
#endif
#if LIGHT_CYLINDER
        case LIGHT_KIND_CYLINDER: {
            let f = frame_around(light.p1.xyz);
            let phi = 2.0 * PI * u.x;
            let n = cos(phi) * f[0] + sin(phi) * f[1];
            return LightPoint(light.p0.xyz + light.p2.y * u.y * light.p1.xyz + light.p2.x * n, n);
        }
#endif
#if LIGHT_SPHERE
        case LIGHT_KIND_SPHERE: {
            let z = 1.0 - 2.0 * u.x;
            let phi = 2.0 * PI * u.y;
            let rho = sqrt(max(0.0, 1.0 - z * z));
            let n = vec3f(rho * cos(phi), rho * sin(phi), z);
            return LightPoint(light.p0.xyz + light.p2.x * n, n);
        }
#endif
        default: {
            // Low-distortion map to the triangle (Heitz 2019).
            let b = select(vec2f(0.5 * u.x, u.y - 0.5 * u.x), vec2f(u.x - 0.5 * u.y, 0.5 * u.y), u.x > u.y);
            let e1 = light.p1.xyz - light.p0.xyz;
            let e2 = light.p2.xyz - light.p0.xyz;
            return LightPoint(light.p0.xyz + b.x * e1 + b.y * e2, normalize(cross(e1, e2)));
        }
    }
}

fn sample_li_area(light: Light, p: vec3f, u: vec2f) -> LightSample {
    var s = no_light();
    s.row = light.row;
    s.primitive = light.primitive;
    s.hittable = 1.0;
#if LIGHT_SPHERE
    if (light.kind == LIGHT_KIND_SPHERE) {
        let v = light.p0.xyz - p;
        let r = light.p2.x;
        let d2 = dot(v, v);
        if (d2 > r * r) {
            let omc = sphere_one_minus_cos(r, d2);
            s.wi = normalize(frame_around(v * inverseSqrt(d2)) * sample_cone(u, omc));
            let b = dot(v, s.wi);
            let l = v - b * s.wi;
            s.distance = b - sqrt(max(0.0, r * r - dot(l, l)));
#if TOUCHED_LIGHTS
            let n = (s.distance * s.wi - v) / r;
            s.distance = distance_to_start(light, p, n, dot(n, s.wi), s.distance);
#endif
            s.density = light.probability / (2.0 * PI * omc);
            s.weight = 1.0 / s.density;
            return s;
        }
    }
#endif
    let point = sample_light_surface(light, u);
    let n = point.n;
    let v = point.p - p;
    let d2 = dot(v, v);
    if (d2 == 0.0) {
        return s;
    }
    let wi = v * inverseSqrt(d2);
    let cos_theta = -dot(n, wi);
    if (!emits_towards(light, cos_theta) || cos_theta == 0.0) {
        return s;
    }
#if LIGHT_CYLINDER
    if (light.kind == LIGHT_KIND_CYLINDER && cos_theta < 0.0) {
        // The inside of a tube. Its own near wall may be in the way, which a shadow ray aimed at this primitive leaves out: the other root from
        // the sampled point back. Where `p` lies on the tube that root is `p` itself.
        let along = dot(wi, light.p1.xyz);
        let back = -2.0 * light.p2.x * cos_theta / max(1.0 - along * along, 1e-20);
        let height = dot(point.p - light.p0.xyz, light.p1.xyz) - back * along;
        if (back < 0.9999 * sqrt(d2) && height >= 0.0 && height <= light.p2.y) {
            return s;
        }
    }
#endif
#if LIGHT_TEXTURES
    s.is_textured = texture_of_light(light) != NONE;
    s.texels = emission_texels(light, light.primitive, point.p);
#endif
    s.wi = wi;
    s.distance = sqrt(d2);
#if TOUCHED_LIGHTS
    s.distance = distance_to_start(light, p, n, cos_theta, s.distance);
#endif
    s.density = light.probability * d2 / (light.area * abs(cos_theta));
    s.weight = 1.0 / s.density;
    return s;
}

#if CAUSTICS
// From here on targets fill so much of what a surface lights that its cosine matters more than they do.
const WIDE_TARGETS = PI;

// Where targets are chosen from: the middle of a sphere, or else the point of the surface.
fn aims_from(light: Light, p: vec3f) -> vec3f {
#if LIGHT_SPHERE
    return select(p, light.p0.xyz, light.kind == LIGHT_KIND_SPHERE);
#else
    return p;
#endif
}

#if LIGHT_SPHERE
// How rays from a sphere to a target are made, if both are far enough apart: through a point of the disc around the target's middle that faces the lamp, chosen by the solid angle
// that it shows to the lamp's middle, from a point of the lamp by the solid angle that it shows there. So all of them are worth about the same, and where on the target light
// arrives, on which all that follows depends most, is left to two numbers of the four.
struct DiscOfTarget {
    axis: vec3f, // from the lamp's middle to the target's
    distance: f32,
    radius: f32, // 0 if the two are too close, or if the sphere shines inwards, too
    one_minus_cos: f32, // of the angle that the disc subtends
}

fn disc_of_target(light: Light, t: vec4f) -> DiscOfTarget {
    let v = t.xyz - light.p0.xyz;
    let distance = length(v);
    let slope = (light.p2.x + t.w) / max(distance, 1e-30);
    // Rays that are aslant meet the plane of the disc up to this far from its middle.
    let radius = select(0.0, t.w * inverseSqrt(max(1.0 - slope * slope, 1e-10)), slope < 0.7 && light.two_sided == 0u);
    let tangent2 = radius * radius / max(distance * distance, 1e-30);
    let one_minus_cos = tangent2 / (1.0 + tangent2 + sqrt(1.0 + tangent2));
    return DiscOfTarget(v / max(distance, 1e-30), distance, radius, one_minus_cos);
}

// The density of a ray from `o` on the sphere along `d` among them, per solid angle and over that of a uniform point of the sphere.
fn density_by_disc(light: Light, disc: DiscOfTarget, t: vec4f, o: vec3f, d: vec3f, cos_theta: f32) -> f32 {
    let slant = dot(d, disc.axis);
    // From the target's middle to where the ray meets the disc: differences of squared distances would lose a small target of a far lamp.
    let v = o - t.xyz;
    let beside = v - dot(v, disc.axis) / slant * d;
    let beside2 = dot(beside, beside);
    if (cos_theta <= 0.0 || slant <= 0.0 || beside2 > disc.radius * disc.radius) {
        return 0.0;
    }
    let q2 = disc.distance * disc.distance + beside2;
    let cosine = disc.distance * inverseSqrt(q2);
    let of_place = cosine * cosine * cosine / (disc.distance * disc.distance * 2.0 * PI * disc.one_minus_cos);
    let of_lamp = 1.0 / (2.0 * PI * sphere_one_minus_cos(light.p2.x, q2));
    return light.area * of_place * of_lamp * cos_theta / slant;
}

fn sample_by_disc(light: Light, disc: DiscOfTarget, u: vec2f, v: vec2f) -> Ray {
    let w = level_frame(disc.axis) * sample_cone(v, disc.one_minus_cos);
    let q = disc.distance / dot(w, disc.axis) * w;
    let q2 = dot(q, q);
    let d = -(level_frame(-w) * sample_cone(u, sphere_one_minus_cos(light.p2.x, q2)));
    let beside = q - dot(q, d) * d;
    let o = beside + sqrt(max(light.p2.x * light.p2.x - dot(beside, beside), 0.0)) * d;
    return Ray(light.p0.xyz + o, INFINITE, normalize(q - o), NONE, NONE, false);
}
#endif

// Density of aiming, per solid angle and over that of a uniform point of the surface, for the targets that the ray meets; behind it the sum of all choices.
fn density_of_aiming(light: Light, o: vec3f, d: vec3f, cos_theta: f32) -> vec2f {
    var met = 0.0;
    var total = 0.0;
    let origin = aims_from(light, o);
    for (var i = 0u; i < TARGETS; i++) {
        let t = target_at(i);
        let choice = target_choice(t, origin);
        var share = target_weight(t);
#if LIGHT_SPHERE
        if (light.kind == LIGHT_KIND_SPHERE) {
            let disc = disc_of_target(light, t);
            share = choice * select(1.0 / target_solid_angle(t, o), density_by_disc(light, disc, t, o, d, cos_theta), disc.radius > 0.0);
        }
#endif
        met += select(0.0, share, choice > 0.0 && meets_target(t, o, d));
        total += choice;
    }
    return vec2f(met / total, total);
}

fn pdf_le_area(light: Light, o: vec3f, d: vec3f, cos_theta: f32) -> f32 {
    let aiming = density_of_aiming(light, o, d, cos_theta);
    let wide = INV_PI * select(1.0, 0.5, light.two_sided != 0u);
    let halves = density_of_halves(wide, aiming.x / max(abs(cos_theta), 1e-10));
    return light.probability / light.area * select(wide, halves, is_aiming(aiming.y, WIDE_TARGETS));
}

#if LIGHT_PATHS
fn sample_le_area(light: Light, u: vec2f, v: vec2f) -> LightRay {
    var l = light_ray(light);
    var direction = v;
    l.hittable = 1.0;
    let point = sample_light_surface(light, u);
    l.n = point.n;
    l.ray.o = point.p;
    let origin = aims_from(light, point.p);
    let total = all_choices(origin);
    let halves = is_aiming(total, WIDE_TARGETS);
    let aimed = halves && is_aimed(&direction);
    if (aimed) {
        let aim = choose_target(origin, total, &direction);
        l.ray.d = sample_target(aim, l.ray.o, direction);
#if LIGHT_SPHERE
        if (light.kind == LIGHT_KIND_SPHERE) {
            let disc = disc_of_target(light, aim);
            if (disc.radius > 0.0) {
                l.ray = sample_by_disc(light, disc, u, direction);
                l.n = normalize(l.ray.o - light.p0.xyz);
            }
        }
#endif
    } else {
        let back = light.two_sided != 0u && direction.x < 0.5;
        let x = select(direction.x, fract(2.0 * direction.x), light.two_sided != 0u);
        l.ray.d = normalize(frame_around(select(l.n, -l.n, back)) * sample_cosine(vec2f(x, direction.y)));
    }
    let cos_theta = dot(l.n, l.ray.d);
    l.given_up = halves && aimed != (density_of_aiming(light, l.ray.o, l.ray.d, cos_theta).x > 0.0);
    if (!emits_towards(light, cos_theta)) {
        l.weight = 0.0;
    }
    l.ray.from_primitive = light.primitive;
    return l;
}
#endif
#endif
