// The ray along which a sample measures, and its weight. Rows of the image run downwards.
#include "common/params.wgsl"
#include "common/math.wgsl"
#include "common/sampler.wgsl"
#include "geometry/trace.wgsl"
#if SENSOR_LENS
#include "sensor/lens.wgsl"
#include "sensor/density.wgsl"
#endif

#if FILTER_GAUSSIAN
// Giles, "Approximating the erfinv function", GPU Computing Gems Jade, 2011, single precision.
fn inverse_erf(x: f32) -> f32 {
    var w = -log((1.0 - x) * (1.0 + x));
    if (w < 5.0) {
        w -= 2.5;
        return x * (1.50140941 + w * (0.246640727 + w * (-0.00417768164 + w * (-0.00125372503 + w * (0.000218580870
            + w * (-4.39150654e-6 + w * (-3.5233877e-6 + w * (3.43273939e-7 + w * 2.81022636e-8))))))));
    }
    w = sqrt(w) - 3.0;
    return x * (2.83297682 + w * (1.00167406 + w * (0.00943887047 + w * (-0.0076224613 + w * (0.00573950773
        + w * (-0.00367342844 + w * (0.00134934322 + w * (0.000100950558 + w * -0.000200214257))))))));
}
#endif

#if SENSOR_CAMERA
// Offset within the pixel, from the reconstruction filter by importance, relative to the pixel's corner.
fn sample_filter(u: vec2f) -> vec2f {
#if FILTER_TENT
    let a = 2.0 * u - 1.0;
    return 0.5 + params.filter_radius * sign(a) * (1.0 - sqrt(1.0 - abs(a)));
#elif FILTER_GAUSSIAN
    // By inversion, cut off at three standard deviations: erf(3 / sqrt 2) = 0.9973002.
    let x = 0.9973002 * (2.0 * u - 1.0);
    return 0.5 + params.filter_radius * 1.41421356 * vec2f(inverse_erf(x.x), inverse_erf(x.y));
#else
    return u;
#endif
}
#endif

#if !SENSOR_CAMERA
var<private> sensor_normal: vec3f; // at the point that measures
#endif

#if SENSOR_LENS
// A ray into the scene that a wavelength of the path, drawn evenly, leads to from the place `p` of the picture (right, up in [-1, 1]); beta becomes what
// radiance along it counts where each wavelength lands.
fn lens_ray(p: vec2f) -> Ray {
    // The image is upside down.
    let film = -p * params.half_extent.xy;
    let pupil = sample_pupil(film, sample_disc(next_2d()));
    let u = next_2d();
    let leading = min(u32(u.x * f32(WAVELENGTHS)), WAVELENGTHS - 1u);
    let place = vec3f(film, params.dual_u.y);
    let out = trace_lens(four_rays(place, normalize(vec3f(pupil, params.dual_u.z) - place)), leading / 4u, false);
    let c = leading % 4u;
    let o = vec3f(component(out.ox, c), component(out.oy, c), component(out.oz, c));
    let d = normalize(vec3f(component(out.dx, c), component(out.dy, c), component(out.dz, c)));
    let start = o + (params.dual_u.w - o.z) / d.z * d;
    let passes = component(out.weight, c) > 0.0;
    var density = 0.0;
    if (passes) {
        density = land(start, -d, next_2d());
    }
    let scale = select(0.0, 1.0 / density, density > 0.0);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        beta[k] = select(vec4f(0.0), scale * landed_weight[k], scale > 0.0);
        li[k] = vec4f(0.0);
    }
    let in_disc = start.xy + (params.half_extent.w - params.dual_u.w) / d.z * d.xy;
    lens_reach = (params.half_extent.w - params.dual_u.w) / -d.z;
    let radius = params.half_extent.z;
    // No light path enters beside the disc.
    lens_density = select(1e30, density / pixel_area() * PI * radius * radius * -d.z, dot(in_disc, in_disc) < radius * radius);
    // What is stopped meets nothing.
    let reach = select(0.0, INFINITE, scale > 0.0);
    let toward = select(vec3f(0.0, 0.0, -1.0), d, scale > 0.0);
    return Ray(world_point(select(vec3f(0.0), start, scale > 0.0)), reach, world_from_lens(toward), NONE, NONE, false);
}
#endif

// Fills `ray`; beta becomes the weight that turns radiance into what the film measures.
fn start_ray(pixel: vec2u) -> Ray {
    var ray: Ray;
    ray.t_max = INFINITE;
    ray.from_primitive = NONE;
    ray.to_primitive = NONE;
    ray.any_hit = false;
    let size = vec2f(f32(params.image_width), f32(params.image_height));
#if SENSOR_CAMERA
    let at = (vec2f(pixel) + sample_filter(next_2d())) / size;
#else
    // A cell of an irradiance sensor is what it is: no filter.
    let at = (vec2f(pixel) + next_2d()) / size;
#endif
    let p = vec2f(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y); // right, up in [-1, 1]
#if SENSOR_LENS
    return lens_ray(p);
#else
    var weight = 1.0;
#if SENSOR_PERSPECTIVE
    let q = p * params.half_extent.xy;
    let local = vec3f(q, -1.0);
    ray.o = params.origin.xyz;
    var d = local.x * params.axis_x.xyz + local.y * params.axis_y.xyz - params.axis_z.xyz;
#if LENS
    let lens = params.half_extent.z * sample_disc(next_2d());
    let offset = lens.x * params.axis_x.xyz + lens.y * params.axis_y.xyz;
    ray.o += offset;
    d = params.half_extent.w * d - offset;
#endif
    ray.d = normalize(d);
#elif SENSOR_ORTHOGRAPHIC
    let q = p * params.half_extent.xy;
    ray.o = params.origin.xyz + q.x * params.axis_x.xyz + q.y * params.axis_y.xyz;
    ray.d = -params.axis_z.xyz;
#else
    // Irradiance: pi times radiance under cosine-weighted directions.
    weight = PI;
#if SENSOR_PLANE
    ray.o = params.origin.xyz + at.x * params.axis_x.xyz + (1.0 - at.y) * params.axis_y.xyz;
    let n = params.axis_z.xyz;
#else
    let phi = 2.0 * PI * at.x;
    let rho = sqrt(max(0.0, 1.0 - p.y * p.y));
    let n = vec3f(rho * cos(phi), p.y, -rho * sin(phi));
    ray.o = params.origin.xyz + params.half_extent.x * n;
#endif
    sensor_normal = n;
    ray.d = normalize(frame_around(n) * sample_cosine(next_2d()));
#endif
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        beta[k] = weight * select(vec4f(0.0), vec4f(1.0), vec4u(4u * k, 4u * k + 1u, 4u * k + 2u, 4u * k + 3u) < vec4u(WAVELENGTHS));
        li[k] = vec4f(0.0);
    }
    return ray;
#endif
}
