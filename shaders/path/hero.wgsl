// Where wavelengths part. At a dispersive refraction one of those that a path carries becomes its hero (Wilkie et al. 2014, "Hero wavelength spectral
// sampling"), and the path goes its way. Where the path then scatters, or finds light, it keeps those that would have ended up within a part of a
// pixel of it: each finds the mean of what its nearest neighbours find as heroes. That is a blur within a pixel, which shrinks from pass to pass as the radius of merging
// does.
#include "common/sampler.wgsl"
#include "common/spectra.wgsl"
#include "path/state.wgsl"
#include "path/mis.wgsl"
#include "path/differentials.wgsl"
#if GUIDED
#if LIGHT_PATHS
#include "light/guide.wgsl"
#endif
#endif

#if LIGHT_PATHS
// By what light paths choose their hero: a third each by what they carry, by its luminance, and as camera paths do. As a set come those that may be chosen.
fn share_heroes() -> u32 {
    var carried = vec4f(0.0);
    var luminance = vec4f(0.0);
    var of_camera = vec4f(0.0);
    var chosen = 0u;
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        let is_carried = beta[k] > vec4f(0.0);
        carried += beta[k];
        luminance += beta[k] * spectrum(ROW_Y, k);
        of_camera += select(vec4f(0.0), spectrum(ROW_HERO, k), is_carried);
        chosen |= as_set(is_carried, k);
    }
    let by = vec3f(sum4(carried), sum4(luminance), sum4(of_camera));
    // Light that nobody sees has no luminance.
    let share = select(vec3f(0.0), 1.0 / by, by > vec3f(0.0)) / select(2.0, 3.0, by.y > 0.0);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        let of_each = beta[k] * (share.x + share.y * spectrum(ROW_Y, k)) + share.z * spectrum(ROW_HERO, k);
        hero_shares[k] = select(vec4f(0.0), of_each, is_in(chosen, k));
    }
    return chosen;
}
#endif

// Chooses the hero of a path that refracts between the indices of these rows. Camera paths of a pass choose among the same few wavelengths, as even over a
// pixel's samples as can be, and evenly where they part once more. No hero has a wavelength that carries nothing, as one that is reflected totally.
fn choose_hero(near_row: u32, far_row: u32) {
    path.hero_near = near_row;
    path.hero_far = far_row;
#if CAMERA_PATHS
    if (path.kept == ALL_WAVELENGTHS) {
        let choice = ((sampler_index & 1u) << 1u | ((sampler_index >> 1u) & 1u)) ^ (sampler_pixel & 3u);
        path.hero = u32(component(vec4f(pass_head().heroes), choice));
        // 1 / (4 times the probability of the wavelength): the sum over a wavelength is 1 in the mean of all passes.
        path.hero_weight = 4.0 * component(pass_head().hero_weights, choice);
    } else {
        let ends = carried_wavelengths();
        let count = f32(ends.y - ends.x + 1u);
        path.hero = ends.x + u32(min(event_light.x * count, count - 1.0));
        path.hero_weight = count;
    }
    var carried = 0u;
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        carried |= as_set(beta[k] > vec4f(0.0), k);
    }
    path.hero_weight = select(0.0, path.hero_weight, ((carried >> path.hero) & 1u) != 0u);
    path.kept &= carried;
#else
    var u = event_light.x;
#if GUIDED
    u = select(u, numbers.choices.y, path.kept == ALL_WAVELENGTHS);
#endif
    path.kept = share_heroes();
    path.hero = choose_wavelength(&hero_shares, u);
    // Zero for a path that carries nothing.
    path.hero_weight = safe_ratio(1.0, at_wavelength(&hero_shares, path.hero));
#endif
}

// Where some of the wavelengths kept take another way, as those that glass reflects totally, they cannot share one, however near they are: the hero goes on alone.
fn part_from(others: u32) {
    if (path.hero != NONE) {
        let parted = others & path.kept;
        path.kept = select(1u << path.hero, path.kept, parted == 0u || parted == path.kept);
    }
}

// Index that wavelengths parted by.
fn parting_index(k: u32) -> vec4f {
    return spectrum(path.hero_far, k) / spectrum(path.hero_near, k);
}

fn parting_index_at(wavelength: u32) -> f32 {
    return spectrum_at(path.hero_far, wavelength) / spectrum_at(path.hero_near, wavelength);
}

// What a quotient of two rows changes by around the hero, per unit of the index that wavelengths parted by.
fn change_of_ratio(over: u32, under: u32) -> f32 {
    if (path.hero == NONE) {
        return 0.0;
    }
    let below = max(path.hero, 1u) - 1u;
    let above = min(path.hero + 1u, WAVELENGTHS - 1u);
    let change = parting_index_at(above) - parting_index_at(below);
    let ratio = spectrum_at(over, above) / spectrum_at(under, above) - spectrum_at(over, below) / spectrum_at(under, below);
    return select(0.0, ratio / change, abs(change) > 1e-8);
}

// Wavelengths 4k .. 4k+3 as a set of bits.
fn as_set(chosen: vec4<bool>, k: u32) -> u32 {
    let bits = select(vec4u(0u), vec4u(1u, 2u, 4u, 8u), chosen);
    return (bits.x | bits.y | bits.z | bits.w) << (4u * k);
}

// Whether wavelengths 4k .. 4k+3 are in a set.
fn is_in(kept: u32, k: u32) -> vec4<bool> {
    return (vec4u(kept >> (4u * k)) & vec4u(1u, 2u, 4u, 8u)) != vec4u(0u);
}

// The path keeps the hero and those wavelengths that share its way within `width` of the index: each shares the ways of as many to either side, so that the mean of
// what they find is right up to the second order of the width, energy included. So the first and the last one have their own ways alone.
fn keep_within(width: f32) {
    let sum_before = sum_beta();
    var index: array<vec4f, WAVELENGTHS4>;
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        index[k] = parting_index(k);
    }
    // Where a number of neighbours ends and the next begins must not show.
    let about = 2.0 * width * (0.75 + 0.5 * unit_float(hash2(sampler_index, sampler_pixel ^ 0x68e31da4u)));
    let ends = carried_wavelengths();
    let set_of = path.kept;
    path.kept = 0u;
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        let wavelength = vec4i(i32(4u * k)) + vec4i(0, 1, 2, 3);
        let before = vec4f(index[max(k, 1u) - 1u].w, index[k].xyz);
        let behind = vec4f(index[k].yzw, index[min(k + 1u, WAVELENGTHS4 - 1u)].x);
        let step = max(abs(behind - before), vec4f(1e-9));
        let to_end = max(min(wavelength - i32(ends.x), i32(ends.y) - wavelength), vec4i(0));
        let reach = min(vec4i(min(about / step, vec4f(32.0))), to_end);
        let shares = abs(wavelength - i32(path.hero)) <= reach;
        // As far as there is a way.
        let window = ((vec4u(2u) << vec4u(2 * reach)) - 1u) << vec4u(wavelength - reach);
        let ways = max(countOneBits(window & vec4u(set_of)), vec4u(1u));
        // Indices are not evenly apart: the side with the greater steps counts less, so that the mean index is the wavelength's own.
        let uneven = 2.0 * (abs(behind - index[k]) - abs(index[k] - before)) / step * vec4f(2 * reach + 1) / 6.0;
        let balance = 1.0 - clamp(uneven, vec4f(-1.0), vec4f(1.0)) * vec4f(sign(i32(path.hero) - wavelength));
        let goes_on = shares & is_in(set_of, k);
        beta[k] *= select(vec4f(0.0), path.hero_weight * balance / vec4f(ways), goes_on);
        path.kept |= as_set(goes_on, k);
    }
    path.hero = NONE;
    // What is rarely kept must not outlive what is often kept.
    path.start *= safe_ratio(sum_beta(), sum_before);
}

// Where a path has come to its hero's end at `p`, along `d`: of the normal `n` there, in a medium along `d`. What is neither diffuse nor a lamp would show that
// directions differ: there the hero goes on alone.
fn keep_near_hero(d: vec3f, p: vec3f, n: vec3f, is_diffuse: bool) {
    if (path.hero != NONE) {
        keep_within(select(0.0, pass_head().blur / max(shift_by_index(d, p, n), 1e-6), is_diffuse));
    }
}

#if CAMERA_PATHS
// Likewise for a path that has left the scene along `d`.
fn keep_near_hero_far_away(d: vec3f) {
    if (path.hero != NONE) {
        keep_within(pass_head().blur / max(shift_in_picture(d, by_index.d, by_pixel_x.d, by_pixel_y.d), 1e-6));
    }
}
#endif

