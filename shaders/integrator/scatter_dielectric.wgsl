// The boundary between two volumes: reflection, refraction, and the parting of wavelengths.

#if DISPERSION
#if !CAMERA_PATHS
// Bins want lanes by what they carry, the picture by their luminance: half of each. `total` is the sum of what they carry.
fn share_lanes(total: f32) {
    var y = 0.0;
    for (var k = 0u; k < LANES4; k++) {
        y += dot(beta[k], spectrum(ROW_Y, k));
    }
    let by_power = select(1.0, 0.5, y > 0.0);
    for (var k = 0u; k < LANES4; k++) {
        lane_shares[k] = beta[k] * (safe_ratio(by_power, total) + safe_ratio(1.0 - by_power, y) * spectrum(ROW_Y, k));
    }
}

#if GATHERED
// Share of light paths that keep the lane of the camera paths: the more, the less light is lost to visible points, and the more do bins differ between passes.
const WITH_CAMERA = 0.8;

// Probability of keeping this lane, in the mean over what the camera paths of a pass may keep.
fn parting_density(lane: u32) -> f32 {
    var own = vec4f(0.0);
    var carried = vec4f(0.0);
    for (var k = 0u; k < LANES4; k++) {
        let share = spectrum(ROW_COLLAPSE, k);
        own += share * one_hot(lane, k);
        carried += select(vec4f(0.0), share, beta[k] > vec4f(0.0));
    }
    return WITH_CAMERA * sum4(own) + (1.0 - WITH_CAMERA * sum4(carried)) * at_lane(&lane_shares, lane);
}
#endif
#endif

// Keeps one wavelength of a path that still carries all of them; returns its lane. Camera paths of a pass choose among the same few lanes, as even over a
// pixel's samples as can be, or all keep the same one where they are gathered. Light paths choose by what they carry and by its luminance; where they are
// gathered, most of them keep what the camera paths keep. The throughput is right for gathering, within the pass; joints to the sensor have no need of the
// camera paths' lane, and count in the mean over all passes (path.at_joints), without the great weights of what a pass hardly ever keeps.
fn part_wavelengths() -> u32 {
    let total = sum_beta();
#if CAMERA_PATHS || GATHERED
    let lanes = pass_head().collapse;
#endif
#if CAMERA_PATHS
    // 1 / (4 times the probability of the lane): the sum over a lane is 1 in the mean of all passes.
    let weights = pass_head().collapse_weights;
    let choice = ((sampler_index & 1u) << 1u | ((sampler_index >> 1u) & 1u)) ^ (sampler_pixel & 3u);
    path.lane = u32(component(vec4f(lanes), choice));
    let weight = 4.0 * component(weights, choice);
    for (var k = 0u; k < LANES4; k++) {
        beta[k] *= weight * one_hot(path.lane, k);
    }
#else
    share_lanes(total);
#if GUIDED
    let u = numbers.choices.y;
#else
    let u = event_light.x;
#endif
#if GATHERED
    let with_camera = select(0.0, WITH_CAMERA, beta_at(lanes.x) > 0.0);
    path.lane = lanes.x;
    if (u >= with_camera) {
        path.lane = choose_lane((u - with_camera) / (1.0 - with_camera));
    }
    let probability = select(0.0, with_camera, path.lane == lanes.x) + (1.0 - with_camera) * at_lane(&lane_shares, path.lane);
    path.at_joints *= safe_ratio(probability, parting_density(path.lane));
#else
    path.lane = choose_lane(u);
    let probability = at_lane(&lane_shares, path.lane);
#endif
    // Zero for a path that carries nothing.
    let kept = safe_ratio(beta_at(path.lane), probability);
    for (var k = 0u; k < LANES4; k++) {
        beta[k] = kept * one_hot(path.lane, k);
    }
#endif
    // What is rarely kept must not outlive what is often kept.
    path.start *= safe_ratio(sum_beta(), total);
    return path.lane;
}
#endif

#if SMOOTH_DIELECTRIC
// Reflectance between the indices in two rows, through the film that may lie there.
fn interface_reflectance(m: Material, cos_i: f32, near_row: u32, far_row: u32, k: u32) -> vec4f {
#if FILM
    if (m.c != 0u) {
        return film_reflectance(m, cos_i, spectrum(near_row, k), spectrum(far_row, k), vec4f(0.0), k);
    }
#endif
    return fresnel_dielectric(cos_i, spectrum(far_row, k) / spectrum(near_row, k));
}
#endif

// `sides` are the volumes before and behind the surface.
fn scatter_at_dielectric(ray: Ray, s: Surface, m: Material, sides: Sides) -> Ray {
    let here = sides.here;
    let beyond = sides.beyond;
    let near = load_Interior(ruling_interior(here));
    let far = load_Interior(ruling_interior(beyond));
    if (!count_event(s.p, true)) {
        return end_path(ray);
    }
    let flip = select(-1.0, 1.0, dot(ray.d, s.n) < 0.0);
    let n = flip * s.n;
    let ns = flip * s.ns;
#if ROUGH_DIELECTRIC
    if (m.kind == MATERIAL_KIND_ROUGH_DIELECTRIC) {
        return scatter_rough_dielectric(ray, s, m, n, ns, here, beyond, near.eta_row, far.eta_row);
    }
#endif
#if SMOOTH_DIELECTRIC
    let cos_i = min(-dot(ray.d, ns), 1.0);
    if (cos_i <= 0.0) {
        return end_path(ray);
    }
#if DISPERSION || FILM
    // Reflection has the same direction at every wavelength: one choice for all, by the mean Fresnel reflectance of what the path carries.
    var fresnel: array<vec4f, LANES4>;
    var reflected = vec4f(0.0);
    for (var k = 0u; k < LANES4; k++) {
        fresnel[k] = interface_reflectance(m, cos_i, near.eta_row, far.eta_row, k);
        reflected += beta[k] * fresnel[k];
    }
    let total = sum_beta();
    let q = select(0.0, sum4(reflected) / total, total > 0.0);
    let reflects = event_choice.x < q;
    for (var k = 0u; k < LANES4; k++) {
        beta[k] *= select((1.0 - fresnel[k]) / (1.0 - q), fresnel[k] / q, reflects);
    }
#else
    let reflects = event_choice.x < interface_reflectance(m, cos_i, near.eta_row, far.eta_row, 0u).x;
#endif
    if (reflects) {
        let d = normalize(ray.d + 2.0 * cos_i * ns);
        inside = here;
        scale_beta(adjoint_correction(ray.d, d, n, ns));
        let survives = dot(d, n) > 0.0 && survives_roulette();
        return continue_or_end(next_segment(leave(s, d), d, s.primitive, s.p, -1.0), survives);
    }
    var lane = select(path.lane, 0u, path.lane == NONE);
#if DISPERSION
    if (path.lane == NONE && (near.dispersive | far.dispersive) != 0u) {
        lane = part_wavelengths();
    }
#endif
    let eta = spectrum_at(far.eta_row, lane) / spectrum_at(near.eta_row, lane);
    let cos_t2 = cos_transmitted_squared(cos_i, vec4f(eta)).x;
    let d = refracted_direction(ray.d, ns, cos_i, eta, cos_t2);
    inside = beyond;
    let refracted = refracted_radiance(vec4f(eta)).x;
    path.start *= refracted; // undone where the path leaves the glass again: roulette must not see it
    scale_beta(refracted * adjoint_correction(ray.d, d, n, ns));
    let survives = cos_t2 > 0.0 && dot(d, n) < 0.0 && survives_roulette();
    return continue_or_end(next_segment(leave(s, d), d, s.primitive, s.p, -1.0), survives);
#else
    return end_path(ray);
#endif
}

#if ROUGH_DIELECTRIC
// Densities of one wavelength, the same for all: that of the path's mixture is unknown at its other end.
fn rough_vertex(s: Surface, m: Material, wo: vec3f, wi: vec3f, eta: f32) -> Vertex {
    let pdf = rough_dielectric_lane(m, wo, wi, eta).y;
    var reverse = 0.0;
    if (wi.z > 0.0) {
        reverse = rough_dielectric_lane(m, wi, wo, eta).y;
    } else {
        reverse = rough_dielectric_lane(m, -wi, -wo, 1.0 / eta).y;
    }
    return Vertex(s.p, wo.z, abs(wi.z), pdf, reverse, true, 0.0);
}

fn scatter_rough_dielectric(
    ray: Ray, s: Surface, m: Material, n: vec3f, ns: vec3f, here: vec4u, beyond: vec4u, near_row: u32, far_row: u32,
) -> Ray {
    let frame = frame_around(ns);
    let wo = -ray.d * frame;
    if (wo.z <= 0.0) {
        return end_path(ray);
    }
    let eta = spectrum_at(far_row, LANES / 2u) / spectrum_at(near_row, LANES / 2u);
#if CONNECT
    let light = connect(s.p, event_choice.x, event_light);
    let wl = light.wi * frame;
    let lit = light.weight > 0.0 && dot(n, light.wi) * wl.z > 0.0;
    if (lit) {
        eval_rough_dielectric(m, wo, wl, near_row, far_row);
        let w = connection_weight(light, rough_vertex(s, m, wo, wl, eta)) * adjoint_correction(ray.d, light.wi, n, ns);
        for (var k = 0u; k < LANES4; k++) {
            pending[k] = w * beta[k] * bsdf_f[k] * light_spectrum(light, k);
        }
        shadow_starts_in(select(beyond, here, wl.z > 0.0), light);
    }
#endif
    let lane = sample_lane(next_1d());
    let wi = sample_rough_dielectric(m, wo, spectrum_at(far_row, lane) / spectrum_at(near_row, lane), next_2d(), event_direction);
    let pdf = select(0.0, eval_rough_dielectric(m, wo, wi, near_row, far_row), wi.z != 0.0);
    for (var k = 0u; k < LANES4; k++) {
        beta[k] *= select(vec4f(0.0), bsdf_f[k] / pdf, pdf > 0.0);
    }
    let d = normalize(frame * wi);
    inside = select(beyond, here, wi.z > 0.0);
    path.start *= select(refracted_radiance(vec4f(eta)).x, 1.0, wi.z > 0.0);
    scale_beta(adjoint_correction(ray.d, d, n, ns));
    let survives = dot(n, d) * wi.z > 0.0 && survives_roulette();
    let v = rough_vertex(s, m, wo, wi, eta);
    leave_vertex(v);
    let next = next_segment(leave(s, d), d, s.primitive, s.p, v.pdf);
#if CONNECT
    if (lit) {
        return shadow_then(next, survives, light, leave(s, light.wi), s.primitive);
    }
#endif
    return continue_or_end(next, survives);
}
#endif
