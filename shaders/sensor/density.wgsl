#include "common/params.wgsl"
#include "common/math.wgsl"

#if SENSOR_CAMERA
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
