// Solid glass: the boundary between two volumes. Smooth, or GGX with reciprocal energy compensation (the model and its tables: src/bsdf/energy.rs).
#include "bsdf/bsdf.wgsl"
#include "bsdf/fresnel.wgsl"
#if ROUGH_DIELECTRIC
#include "bsdf/energy.wgsl"
#endif
#if ROUGH_DIELECTRIC
#include "bsdf/ggx.wgsl"
#endif
#if DISPERSION
#include "path/hero.wgsl"
#endif
#if HIGHLIGHTS
#include "light/highlight.wgsl"
#endif

// Index beyond over index on the side of the path, of one wavelength.
fn relative_index(b: ptr<function, Bsdf>, wavelength: u32) -> f32 {
    return spectrum_at((*b).far_row, wavelength) / spectrum_at((*b).near_row, wavelength);
}

fn relative_indices(b: ptr<function, Bsdf>, k: u32) -> vec4f {
    return spectrum((*b).far_row, k) / spectrum((*b).near_row, k);
}

// Reflectance of a face of relative index `eta`.
fn face_of_glass(m: Material, cos_i: f32, eta: vec4f) -> vec4f {
#if ANTIREFLECTIVE
    if (m.a != 0u) {
        return select(vec4f(0.0), vec4f(1.0), cos_transmitted_squared(cos_i, eta) <= vec4f(0.0));
    }
#endif
    return fresnel_dielectric(cos_i, eta);
}

#if SMOOTH_DIELECTRIC
// Reflectance between two indices, through the film that may lie there.
fn interface_reflectance(m: Material, cos_i: f32, near: vec4f, far: vec4f, k: u32) -> vec4f {
#if THIN_FILM
    if (m.c != 0u) {
        return film_reflectance(m, cos_i, near, far, vec4f(0.0), k);
    }
#endif
    return face_of_glass(m, cos_i, far / near);
}

#if SHADING_NORMALS
// For which relative indices `eta` the shading normal (at cosine `cos_s` to the camera's side of a path) reflects totally what the geometric one (`cos_g`) would let out.
fn is_let_out(cos_s: f32, cos_g: f32, eta: vec4f) -> vec4<bool> {
    return (cos_transmitted_squared(cos_s, eta) <= vec4f(0.0)) & (cos_transmitted_squared(cos_g, eta) > vec4f(0.0));
}

#if DISPERSION
// The same as a set.
fn let_out_set(b: ptr<function, Bsdf>, cos_s: f32, cos_g: f32) -> u32 {
    var let_out = as_set_beyond(is_let_out(cos_s, cos_g, indices_beyond((*b).near_row, (*b).far_row)));
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        let_out |= as_set(is_let_out(cos_s, cos_g, relative_indices(b, k)), k);
    }
    return let_out;
}
#endif

#if LIGHT_PATHS
// Such light the camera paths have to find: ends a light path that was reflected.
fn leave_to_camera_paths(b: ptr<function, Bsdf>, cos_s: f32, cos_g: f32) {
#if DISPERSION
    part_from(let_out_set(b, cos_s, cos_g));
#endif
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        beta[k] = select(beta[k], vec4f(0.0), is_let_out(cos_s, cos_g, relative_indices(b, k)));
    }
}
#else
// Whether the path goes by the geometric normal, since that lets it out. If its wavelengths do not agree, some of them go on.
fn goes_by_geometry(b: ptr<function, Bsdf>, cos_s: f32, cos_g: f32, u: f32) -> bool {
    var let_out = 0.0;
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        let_out += sum4(select(vec4f(0.0), beta[k], is_let_out(cos_s, cos_g, relative_indices(b, k))));
    }
    let total = sum_beta();
    let q = select(0.0, let_out / total, total > 0.0);
#if DISPERSION
    if (path.hero != NO_HERO) {
        let set_out = let_out_set(b, cos_s, cos_g);
        let of_hero = (set_out & hero_as_set()) != 0u;
        part_from(set_out);
        return of_hero;
    }
#endif
    let goes = u < q;
#if DISPERSION
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        let agrees = is_let_out(cos_s, cos_g, relative_indices(b, k)) == vec4<bool>(goes);
        beta[k] *= select(vec4f(0.0), vec4f(1.0 / select(1.0 - q, q, goes)), agrees);
    }
#endif
    return goes;
}
#endif
#endif

// Reflection, or refraction, where one wavelength becomes the hero if the index depends on them.
fn sample_smooth_dielectric(b: ptr<function, Bsdf>, p: vec3f, d: vec3f, n: vec3f) -> BsdfSample {
    let m = (*b).m;
    let near_row = (*b).near_row;
    let far_row = (*b).far_row;
    let cos_i = min(-dot(d, n), 1.0);
    let mirrored = normalize(d + 2.0 * cos_i * n);
#if DISPERSION || THIN_FILM
    // Reflection has the same direction at every wavelength: one choice for all, by the mean Fresnel reflectance of what the path carries, or by the hero's.
    var fresnel: Spectrum;
    var radiance: Spectrum; // of what refracts
    var reflected = vec4f(0.0);
#if DISPERSION
    var of_hero = vec4f(0.0);
    let nearest = u32(clamp(path.hero, 0, i32(WAVELENGTHS) - 1)); // to a hero beyond the range
    var totally = as_set_beyond(cos_transmitted_squared(cos_i, indices_beyond(near_row, far_row)) <= vec4f(0.0));
#endif
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        let near = spectrum(near_row, k);
        let far = spectrum(far_row, k);
        fresnel[k] = interface_reflectance(m, cos_i, near, far, k);
        radiance[k] = refracted_radiance(far / near);
        reflected += beta[k] * fresnel[k];
#if DISPERSION
        of_hero += fresnel[k] * one_hot(nearest, k);
        totally |= as_set(cos_transmitted_squared(cos_i, far / near) <= vec4f(0.0), k);
#endif
    }
    let total = sum_beta();
    var reflectance = select(0.0, sum4(reflected) / total, total > 0.0);
#if DISPERSION
    reflectance = select(sum4(of_hero), reflectance, path.hero == NO_HERO);
    part_from(totally);
#endif
    var q = reflectance;
#if HIGHLIGHTS
    q = share_of_reflection(reflectance, p, mirrored);
#endif
    let reflects = event_choice.x < q;
#if HIGHLIGHTS
    path.start *= worth_of_choice(reflectance, q, reflects); // roulette must not see it
#endif
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        beta[k] *= select(radiance[k] * (1.0 - fresnel[k]) / (1.0 - q), fresnel[k] / q, reflects);
    }
#else
    let near = spectrum(near_row, 0u);
    let far = spectrum(far_row, 0u);
    let fresnel = interface_reflectance(m, cos_i, near, far, 0u).x;
#if HIGHLIGHTS
    let q = share_of_reflection(fresnel, p, mirrored);
    let reflects = event_choice.x < q;
    let worth = worth_of_choice(fresnel, q, reflects);
    path.start *= worth; // roulette must not see it
    scale_beta(worth);
#else
    let reflects = event_choice.x < fresnel;
#endif
    scale_beta(select(refracted_radiance(far / near).x, 1.0, reflects));
#endif
    if (reflects) {
        return specular_sample(mirrored, cos_i);
    }
#if DISPERSION
    let parts = path.hero == NO_HERO && (*b).dispersive;
    if (parts) {
        choose_hero(near_row, far_row, totally);
    }
    let index = relative_index_at(near_row, far_row, select(path.hero, 0, path.hero == NO_HERO));
    if (parts) {
        path.parting = index.change;
        for (var k = 0u; k < WAVELENGTHS4; k++) {
            set_index_from_hero(k, spectrum(far_row, k) / spectrum(near_row, k) - index.eta);
        }
    }
    let eta = index.eta;
#else
    let eta = relative_index(b, 0u);
#endif
    let cos_t2 = cos_transmitted_squared(cos_i, vec4f(eta)).x;
    path.start *= refracted_radiance(vec4f(eta)).x; // undone where the path leaves the glass again: roulette must not see it
    // Total reflection of the hero ends the path: others have chosen to refract.
    var sampled = specular_sample(refracted_direction(d, n, cos_i, eta, cos_t2), select(0.0, -1.0, cos_t2 > 0.0));
#if DISPERSION
    sampled.index = index;
#endif
    return sampled;
}
#endif

#if ROUGH_DIELECTRIC
// Row of the energy table and weight for a relative index.
fn eta_cell(eta: f32) -> vec2f {
    let f = eta_rows(vec4f(eta)).x;
    let i = min(floor(f), f32(ENERGY_ETA - 2u));
    return vec2f(i, f - i);
}

// (1 - E(mu), M) of the side that sees relative index eta.
fn missing_energy(table: u32, mu: f32, eta: f32) -> vec2f {
    let e = eta_cell(eta);
    let c = centred(mu, ENERGY_MU);
    let at = table + u32(e.x) * ENERGY_MU + u32(c.x);
    let missing = mix(mix(tables[at], tables[at + 1u], c.y), mix(tables[at + ENERGY_MU], tables[at + ENERGY_MU + 1u], c.y), e.y);
    let averages = table + ENERGY_ETA * ENERGY_MU + u32(e.x);
    return vec2f(missing, mix(tables[averages], tables[averages + 1u], e.y));
}

// One wavelength: x = f |cos wi| without the factor of refracted radiance, y = pdf. `eta` = index beyond / index on wo's side.
fn rough_dielectric_at(m: Material, wo: vec3f, wi: vec3f, eta: f32) -> vec2f {
    let reflects = wi.z > 0.0;
    var single = 0.0;
    var h = wo + wi;
    if (!reflects) {
        h = -(wo + eta * wi);
        h = select(h, -h, h.z < 0.0);
    }
    let h_length = length(h);
    if (h_length > 0.0) {
        h /= h_length;
        let oh = dot(wo, h);
        let ih = dot(wi, h);
        if (oh > 0.0 && select(-ih, ih, reflects) > 0.0) {
            let f = face_of_glass(m, oh, vec4f(eta)).x;
            let s = oh + eta * ih;
            let jacobian = select(eta * eta * abs(ih) / max(s * s, 1e-20), 0.25 / oh, reflects);
            single = select(1.0 - f, f, reflects) * pdf_visible_normal(wo, h, Width(m.alpha)) * jacobian;
        }
    }
    let here = missing_energy(m.table, wo.z, eta);
    let there = missing_energy(m.table, abs(wi.z), select(1.0 / eta, eta, reflects));
    let beyond = eta * eta * missing_energy(m.table, 1.0, 1.0 / eta).y;
    let total = here.y + beyond;
    var multiple = 0.0;
    var multiple_pdf = abs(wi.z) * INV_PI;
    if (there.y > ENERGY_MIN_MEAN && total > 0.0) {
        let share = select(beyond, here.y, reflects) / total;
        multiple = share * here.x * there.x * abs(wi.z) * INV_PI / there.y;
        multiple_pdf *= share;
    } else {
        multiple_pdf *= 0.5;
    }
    return vec2f(single * shadowing(wo, wi, Width(m.alpha)) + multiple, mix(single, multiple_pdf, here.x));
}

// The density is that of the mixture over wavelengths, weighted by the throughput; that of multiple importance sampling is of one wavelength, the same for
// all, since the mixture at the other end of the path is not known.
fn eval_rough_dielectric(b: ptr<function, Bsdf>, wo: vec3f, wi: vec3f, f: ptr<function, Spectrum>) -> BsdfPdf {
    let m = (*b).m;
    let reflects = wi.z > 0.0;
    var pdf = 0.0;
    let total = sum_beta();
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        let eta = spectrum((*b).far_row, k) / spectrum((*b).near_row, k);
        var g = vec4f(0.0);
        for (var c = 0u; c < 4u; c++) {
            if (beta[k][c] > 0.0) {
                let r = rough_dielectric_at(m, wo, wi, eta[c]);
                g[c] = r.x;
                pdf += beta[k][c] * r.y;
            }
        }
        (*f)[k] = select(g * refracted_radiance(eta), g, reflects);
    }
    // Drivers inline functions at each call: one for both ways.
    let eta = relative_index(b, WAVELENGTHS / 2u);
    var ways: array<f32, 2>;
    for (var way = 0u; way < 2u; way++) {
        let side = select(-1.0, 1.0, reflects);
        let from_wo = way == 0u;
        ways[way] = rough_dielectric_at(m, select(side * wi, wo, from_wo), select(side * wo, wi, from_wo), select(eta, 1.0 / eta, !from_wo && !reflects)).y;
    }
    return BsdfPdf(select(0.0, pdf / total, total > 0.0), ways[0], ways[1]);
}

// Direction sampled for one wavelength; z = 0 marks failure (absorbed, its energy is in the compensation).
fn sample_rough_dielectric_at(m: Material, wo: vec3f, eta: f32, u_lobe: vec2f, u: vec2f) -> vec3f {
    let here = missing_energy(m.table, wo.z, eta);
    if (u_lobe.x < here.x) {
        let beyond = eta * eta * missing_energy(m.table, 1.0, 1.0 / eta).y;
        let total = here.y + beyond;
        let share = select(0.5, here.y / total, total > 0.0);
        let w = sample_cosine(u);
        return select(vec3f(w.xy, -w.z), w, u_lobe.y < share);
    }
    let h = sample_visible_normal(wo, Width(m.alpha), u);
    let oh = dot(wo, h);
    let f = face_of_glass(m, oh, vec4f(eta)).x;
    if (u_lobe.y < f) {
        let wi = reflect(-wo, h);
        return select(vec3f(0.0), wi, wi.z > 0.0);
    }
    let c2 = cos_transmitted_squared(oh, vec4f(eta)).x;
    let wi = normalize(-wo / eta + (oh / eta - sqrt(max(c2, 0.0))) * h);
    return select(vec3f(0.0), wi, wi.z < 0.0);
}

// One of the wavelengths chooses for all.
fn sample_rough_dielectric(b: ptr<function, Bsdf>, wo: vec3f) -> vec3f {
    let eta = relative_index(b, sample_wavelength(next_1d()));
    let wi = sample_rough_dielectric_at((*b).m, wo, eta, next_2d(), event_direction);
    path.start *= select(refracted_radiance(vec4f(relative_index(b, WAVELENGTHS / 2u))).x, 1.0, wi.z > 0.0);
    return wi;
}
#endif
