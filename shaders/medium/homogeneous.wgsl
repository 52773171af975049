// Homogeneous spectral media: Beer-Lambert transmittance and free flight.
#include "common/math.wgsl"
#include "common/spectra.wgsl"
#include "common/sampler.wgsl"
#include "medium/interiors.wgsl"
#include "path/state.wgsl"

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
// Ld *= transmittance over `distance` in `interior`.
fn attenuate_Ld(interior: u32, distance: f32) {
    let m = load_Interior(interior);
    if (has_medium(m)) {
        for (var k = 0u; k < WAVELENGTHS4; k++) {
            Ld[k] *= exp(-distance * sigma_t(m, k));
        }
    }
}
#endif

// Free flight over at most `t_max`: multiplies beta by transmittance over the mixture pdf of its wavelengths (one-sample MIS over
// wavelengths, Wilkie et al., "Hero wavelength spectral sampling", EGSR 2014). Returns the distance of a scattering event, or a negative number.
fn sample_free_flight(interior: u32, t_max: f32) -> f32 {
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
        let wavelength = sample_wavelength(u.x);
        var sigma = spectrum_at(m.sigma_s_row, wavelength);
        if (m.sigma_a_row != NONE) {
            sigma += spectrum_at(m.sigma_a_row, wavelength);
        }
        let t = select(INFINITE, -log(1.0 - u.y) / sigma, sigma > 0.0);
        let scatters = t < t_max;
        var pdf = vec4f(0.0);
        for (var k = 0u; k < WAVELENGTHS4; k++) {
            let s = sigma_t(m, k);
            let transmittance = exp(-s * min(t, t_max));
            pdf += beta[k] * select(transmittance, s * transmittance, scatters);
            beta[k] *= select(transmittance, spectrum(m.sigma_s_row, k) * transmittance, scatters);
        }
        scale_beta(total / sum4(pdf));
        return select(-1.0, t, scatters);
    }
#endif
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        beta[k] *= exp(-t_max * sigma_t(m, k));
    }
    return -1.0;
}
