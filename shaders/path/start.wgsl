// How a path starts: in which volumes, and from an irradiance sensor with a light sample.
#include "common/counters.wgsl"
#include "geometry/trace.wgsl"
#include "path/state.wgsl"
#include "path/mis.wgsl"
#include "path/scatter.wgsl"
#if INTERIORS
#include "medium/interiors.wgsl"
#endif
#if START_VOLUMES
#include "medium/start.wgsl"
#endif

#if LIT_SENSOR
// Light that falls on an irradiance sensor straight from a light: sampled as at a diffuse surface, since `ray` leaves it likewise.
fn light_on_sensor(ray: Ray) -> Ray {
    path.pdf = dot(sensor_normal, ray.d) * INV_PI;
    let choice = next_1d();
    let light = connect(ray.o, choice, next_2d());
    let pdf = dot(sensor_normal, light.wi) * INV_PI;
    if (light.weight <= 0.0 || pdf <= 0.0) {
        return ray;
    }
    let w = mis_weight_connection(light, Vertex(ray.o, 1.0, pdf * PI, pdf, 0.0, false, 0.0)) * pdf;
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        Ld[k] = w * beta[k] * light_spectrum(light, k);
    }
#if INTERIORS
    shadow_starts_in(inside, light);
#endif
    return shadow_then(ray, true, light, ray.o, NONE);
}
#endif

// The ray that a path along `ray` is taken on by first.
fn first_segment(ray: Ray) -> Ray {
#if LIT_SENSOR
    return light_on_sensor(ray);
#else
    return ray;
#endif
}

#if START_VOLUMES
// Before it goes along `ray`, a path finds out which volumes it starts in.
fn find_start(ray: Ray) -> Ray {
    path.is_starting = true;
    return way_up(ray);
}

// Takes the way up from the start of a path past `hit`.
fn next_boundary(ray: Ray, hit: Hit) -> Ray {
    if (starts_crowded) {
        atomicAdd(&counters[COUNTER_CROWDED], 1u);
    }
    path.crossings += 1u;
    path.ended = starts_crowded || path.crossings > MAX_CROSSINGS;
    if (hit.primitive != NONE) {
        return climb(ray, hit);
    }
    path.is_starting = false;
    path.crossings = 0u;
#if CONTACT
    beside = NOTHING;
#endif
    if (path.ended) {
        return ray;
    }
    return first_segment(first_ray);
}
#endif
