#include "common/params.wgsl"
#include "common/math.wgsl"

#if SENSOR_LENS
// Of the ray at hand: density of a pixel's camera paths per etendue, times the area of the disc that light paths enter by and the cosine there; and how
// far behind the ray's start its point in that disc is, m.
var<private> lens_density: f32;
var<private> lens_reach: f32;

// Density per area of a pixel's camera paths at their first vertex, over the cosine there, and over the density of light paths in the disc.
fn sensor_density(d: vec3f, d2: f32) -> f32 {
    let way = sqrt(d2) + lens_reach;
    return lens_density / (way * way);
}
#elif SENSOR_CAMERA
// Density per area of a pixel's camera paths at their first vertex, over the cosine there; `d` is the unit direction between it and the lens, the
// distance squared is `d2`.
fn sensor_density(d: vec3f, d2: f32) -> f32 {
    let size = vec2f(f32(params.image_width), f32(params.image_height));
    let pixel_area = 4.0 * params.half_extent.x * params.half_extent.y / (size.x * size.y);
#if SENSOR_PERSPECTIVE
    // Solid angle to area on the plane at distance 1 is 1 / cos^3.
    let z = abs(dot(d, params.axis_z.xyz));
    return 1.0 / (d2 * z * z * z * pixel_area);
#else
    return 1.0 / pixel_area;
#endif
}
#else
fn sensor_area() -> f32 {
#if SENSOR_PLANE
    return params.dual_u.w;
#else
    return 4.0 * PI * params.half_extent.x * params.half_extent.x;
#endif
}
#endif
