// The ray along which a sample measures, and its weight. Rows of the image run downwards.

// Offset within the pixel, from the reconstruction filter by importance, relative to the pixel's corner.
fn sample_filter(u: vec2f) -> vec2f {
#if FILTER_TENT
    let a = 2.0 * u - 1.0;
    return 0.5 + params.filter_radius * sign(a) * (1.0 - sqrt(1.0 - abs(a)));
#elif FILTER_GAUSSIAN
    // Box-Muller on the disc of three standard deviations.
    let r = sqrt(-2.0 * log(1.0 - u.x * 0.98889100346));
    return 0.5 + params.filter_radius * r * vec2f(cos(2.0 * PI * u.y), sin(2.0 * PI * u.y));
#else
    return u;
#endif
}

// Fills `ray`; beta becomes the weight that turns radiance into what the film measures.
fn start_ray(pixel: vec2u) -> Ray {
    var ray: Ray;
    ray.t_max = INFINITE;
    ray.from_primitive = NONE;
    ray.to_primitive = NONE;
    ray.any_hit = false;
    let size = vec2f(f32(params.image_width), f32(params.image_height));
    let at = (vec2f(pixel) + sample_filter(next_2d())) / size;
    let p = vec2f(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y); // right, up in [-1, 1]
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
    ray.d = normalize(frame_around(n) * sample_cosine(next_2d()));
#endif
    for (var k = 0u; k < LANES4; k++) {
        beta[k] = weight * select(vec4f(0.0), vec4f(1.0), vec4u(4u * k, 4u * k + 1u, 4u * k + 2u, 4u * k + 3u) < vec4u(LANES));
        li[k] = vec4f(0.0);
    }
    return ray;
}
