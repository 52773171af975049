// The sensor seen from the scene: connections of light paths to a camera, or their crossings of an irradiance sensor.
#include "common/params.wgsl"
#include "common/math.wgsl"
#include "common/sampler.wgsl"
#include "common/spectra.wgsl"
#include "common/counters.wgsl"
#if LIGHTS_PRESENT
#include "light/light.wgsl"
#endif
#include "path/state.wgsl"
#include "path/mis.wgsl"
#if CAUSTICS
#include "sensor/density.wgsl"
#endif
#if SENSOR_CAMERA
#include "sensor/landing.wgsl"
#endif
#if SENSOR_LENS
#include "sensor/lens.wgsl"
#endif
#include "sensor/splat.wgsl"

#if SENSOR_LENS
// The camera as a light sample: `weight` times the flux density scattered towards `wi` times landed_weight is what each wavelength adds to where it lands.
fn connect_to_sensor(p: vec3f, u_choice: f32, u: vec2f) -> LightSample {
    var s = no_light();
    let place = lens_point(p);
    let radius = params.half_extent.z;
    let v = vec3f(radius * sample_disc(u), params.half_extent.w) - place;
    if (place.z >= params.dual_u.w || v.z <= 0.0) {
        return s;
    }
    let d2 = dot(v, v);
    let d = v * inverseSqrt(d2);
    if (d.z < params.dual_v.z) {
        return s;
    }
    let density = land(place, v, vec2f(u_choice, fract(u_choice * 4096.0)));
    if (density <= 0.0) {
        return s;
    }
    let enters = PI * radius * radius * d.z / pixel_area();
    lens_density = density * enters;
    lens_reach = 0.0;
    s.density = sensor_density(d, d2);
    s.weight = enters / d2;
    s.wi = world_from_lens(d);
    s.distance = (params.dual_u.w - place.z) / d.z;
    return s;
}
#elif SENSOR_CAMERA
struct OnFilm {
    column: vec4f, // pixels
    row: vec4f,
    is_before: vec4<bool>,
}

// Where four points around the vertex are seen, from which `v` leads to the sensor: of wavelengths whose indices are by so much more than the hero's. `lens` is what
// a place on the lens moves the picture by.
fn on_film(v: vec3f, apart: vec4f, lens: vec2f) -> OnFilm {
    let size = vec2f(f32(params.image_width), f32(params.image_height));
    let axes = mat3x3f(params.axis_x.xyz, params.axis_y.xyz, params.axis_z.xyz);
    let to_sensor = v * axes;
    var by = vec3f(0.0);
#if DISPERSION
    by = landing_by_index * axes;
#endif
    let z = to_sensor.z - apart * by.z;
    var x = apart * by.x - to_sensor.x;
    var y = apart * by.y - to_sensor.y;
#if SENSOR_PERSPECTIVE
    x = x / z + lens.x;
    y = y / z + lens.y;
#endif
    return OnFilm((0.5 + 0.5 * x / params.half_extent.x) * size.x, (0.5 - 0.5 * y / params.half_extent.y) * size.y, z > vec4f(0.0));
}

// The camera as a light sample: `weight` times the flux density scattered towards `wi` is radiance in the pixel landed_pixel[0].x, or, where wavelengths land apart, times
// landed_weight what each adds to its own.
fn connect_to_sensor(p: vec3f, u_choice: f32, u: vec2f) -> LightSample {
    var s = no_light();
    let choices = vec2f(u_choice, fract(u_choice * 4096.0));
    var lens = vec2f(0.0);
#if SENSOR_PERSPECTIVE
    var eye = params.origin.xyz;
#if LENS
    lens = params.half_extent.z * sample_disc(u);
    eye += lens.x * params.axis_x.xyz + lens.y * params.axis_y.xyz;
    lens /= params.half_extent.w;
#endif
    let v = eye - p;
    let d2 = dot(v, v);
    if (d2 == 0.0) {
        return s;
    }
    s.distance = sqrt(d2);
    s.wi = v / s.distance;
    let is_before = dot(s.wi, params.axis_z.xyz) > 0.0;
#else
    let v = params.origin.xyz - p;
    s.wi = params.axis_z.xyz;
    s.distance = dot(v, s.wi);
    let is_before = s.distance > 0.0;
#endif
    if (!is_before) {
        return s;
    }
    var lands = false;
#if DISPERSION
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        let at = on_film(v, index_from_hero(k), lens);
        lands |= any(land_in_pixels(k, at.column, at.row, at.is_before & (beta[k] > vec4f(0.0)), choices) > vec4f(0.0));
    }
    s.weight = 1.0;
#else
    let at = on_film(v, vec4f(0.0), lens);
    s.weight = land_in_pixels(0u, at.column, at.row, at.is_before, choices).x;
    lands = s.weight > 0.0;
#endif
    if (!lands) {
        return no_light();
    }
    s.density = sensor_density(s.wi, s.distance * s.distance);
    s.weight *= s.density;
    s.distance *= 1.0 - params.origin.w;
    return s;
}
#endif

#if CROSSINGS
// Records where the segment of `ray` up to `t_max` crosses the irradiance sensor from its front.
fn record_crossing(ray: Ray, t_max: f32) {
    let size = vec2f(f32(params.image_width), f32(params.image_height));
    var t = -1.0;
    var at = vec2f(0.0);
#if SENSOR_PLANE
    let cos_theta = -dot(ray.d, params.axis_z.xyz);
    if (cos_theta <= 0.0) {
        return;
    }
    let v = params.origin.xyz - ray.o;
    t = -dot(v, params.axis_z.xyz) / cos_theta;
    let q = t * ray.d - v;
    at = vec2f(dot(q, params.dual_u.xyz), 1.0 - dot(q, params.dual_v.xyz));
#else
    let v = ray.o - params.origin.xyz;
    let r = params.half_extent.x;
    let b = -dot(v, ray.d);
    let l = v + b * ray.d;
    let discriminant = r * r - dot(l, l);
    if (discriminant <= 0.0) {
        return;
    }
    t = b - sqrt(discriminant);
    let n = (v + t * ray.d) / r;
    var phi = atan2(-n.z, n.x) / (2.0 * PI);
    at = vec2f(select(phi, phi + 1.0, phi < 0.0), 0.5 - 0.5 * n.y);
    let cos_theta = -dot(n, ray.d);
#endif
    if (t <= 0.0 || t >= t_max * (1.0 + params.origin.w) || any(at < vec2f(0.0)) || any(at >= vec2f(1.0))) {
        return;
    }
    // The sensor is like a diffuse surface, at which camera paths begin evenly over a pixel.
    let per_pixel = size.x * size.y / sensor_area();
    let pdf_rev = cos_theta * INV_PI;
    let others = camera_path_density_at(Vertex(ray.o + t * ray.d, cos_theta, 1.0, 1.0, pdf_rev, false, 0.0), path.depth + 1u);
    let share = 1.0 / (1.0 + safe_ratio(others, path.emission * PI / per_pixel));
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        Ld[k] = share * per_pixel * beta[k];
    }
    var carried = carried_wavelengths();
#if DISPERSION
    if (path.hero != NO_HERO) {
        // The path goes on beyond the sensor: what it keeps is still open.
        for (var k = 0u; k < WAVELENGTHS4; k++) {
            Ld[k] *= path.hero_weight * one_hot(u32(path.hero), k);
        }
        carried = vec2u(clamp(vec2i(path.hero), vec2i(0), vec2i(i32(WAVELENGTHS) - 1)));
    }
#endif
#if MEDIA
    attenuate_Ld(ruling_interior(inside), t);
#endif
    splat(carried, place_in_tile(vec2u(at * size)));
}
#endif
