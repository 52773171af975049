// Homogeneous spectral media: Beer-Lambert transmittance, free flight and the Henyey-Greenstein phase function.

fn sigma_t(m: Interior, k: u32) -> vec4f {
    var s = vec4f(0.0);
    if (m.sigma_a_row != NONE) {
        s += spectrum(m.sigma_a_row, k);
    }
    if (m.sigma_s_row != NONE) {
        s += spectrum(m.sigma_s_row, k);
    }
    return s;
}

fn has_medium(m: Interior) -> bool {
    return m.sigma_a_row != NONE || m.sigma_s_row != NONE;
}

#if CONNECT || LIGHT_PATHS
// pending *= transmittance over `distance` in `interior`.
fn attenuate_pending(interior: u32, distance: f32) {
    let m = load_Interior(interior);
    if (has_medium(m)) {
        for (var k = 0u; k < LANES4; k++) {
            pending[k] *= exp(-distance * sigma_t(m, k));
        }
    }
}
#endif

#if SCATTERING
// Henyey-Greenstein phase function and also its pdf per solid angle; `cos_theta` between the directions of travel before and after.
fn phase_hg(cos_theta: f32, g: f32) -> f32 {
    // 1 + g^2 - 2 g cos, so that it keeps its digits (and its sign) where g is near 1 or -1.
    let h = abs(g);
    let d = (1.0 - h) * (1.0 - h) + 2.0 * h * max(1.0 - select(-cos_theta, cos_theta, g > 0.0), 0.0);
    return 0.25 * INV_PI * (1.0 - h) * (1.0 + h) / (d * sqrt(d));
}

// Samples the phase function around the direction of travel `d`.
fn sample_hg(d: vec3f, g: f32, u: vec2f) -> vec3f {
    var cos_theta = 1.0 - 2.0 * u.x;
    if (abs(g) > 1e-3) {
        let s = (1.0 - g * g) / (1.0 + g - 2.0 * g * u.x);
        cos_theta = clamp((1.0 + g * g - s * s) / (2.0 * g), -1.0, 1.0);
    }
    let sin_theta = sqrt(max(0.0, 1.0 - cos_theta * cos_theta));
    let phi = 2.0 * PI * u.y;
    return normalize(frame_around(d) * vec3f(sin_theta * cos(phi), sin_theta * sin(phi), cos_theta));
}
#endif

// Free flight over at most `t_max`: multiplies beta by transmittance over the mixture pdf of its wavelengths (one-sample MIS over
// wavelengths, Wilkie et al., "Hero wavelength spectral sampling", EGSR 2014). Returns the distance of a scattering event, or a negative number.
fn fly(interior: u32, t_max: f32) -> f32 {
    let m = load_Interior(interior);
    if (!has_medium(m)) {
        return -1.0;
    }
#if SCATTERING
    if (m.sigma_s_row != NONE) {
        let total = sum_beta();
        if (total <= 0.0) {
            return -1.0;
        }
        let u = next_2d();
        let lane = sample_lane(u.x);
        var sigma = spectrum_at(m.sigma_s_row, lane);
        if (m.sigma_a_row != NONE) {
            sigma += spectrum_at(m.sigma_a_row, lane);
        }
        let t = select(INFINITE, -log(1.0 - u.y) / sigma, sigma > 0.0);
        let scatters = t < t_max;
        var pdf = vec4f(0.0);
        for (var k = 0u; k < LANES4; k++) {
            let s = sigma_t(m, k);
            let transmittance = exp(-s * min(t, t_max));
            pdf += beta[k] * select(transmittance, s * transmittance, scatters);
            beta[k] *= select(transmittance, spectrum(m.sigma_s_row, k) * transmittance, scatters);
        }
        scale_beta(total / sum4(pdf));
        return select(-1.0, t, scatters);
    }
#endif
    for (var k = 0u; k < LANES4; k++) {
        beta[k] *= exp(-t_max * sigma_t(m, k));
    }
    return -1.0;
}
