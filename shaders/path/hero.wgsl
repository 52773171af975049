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
// By what light paths choose their hero: a third each by what they carry, by its luminance, and as camera paths do. The path keeps those that may be chosen; the
// share of each beyond them comes back.
fn share_heroes(totally: u32) -> f32 {
    var carried = vec4f(0.0);
    var luminance = vec4f(0.0);
    var of_camera = vec4f(0.0);
    var all_of_camera = vec4f(0.0);
    var chosen = BELOW | ABOVE;
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        let is_carried = beta[k] > vec4f(0.0);
        carried += beta[k];
        luminance += beta[k] * spectrum(ROW_Y, k);
        all_of_camera += spectrum(ROW_HERO, k);
        of_camera += select(vec4f(0.0), spectrum(ROW_HERO, k), is_carried);
        chosen |= as_set(is_carried, k);
    }
    path.kept &= chosen & ~totally;
    let range = hero_range();
    let ends = vec2i(carried_wavelengths());
    let beyond = select(0.0, (1.0 - sum4(all_of_camera)) / f32(2u * max(BEYOND, 1u)), range.y - range.x > ends.y - ends.x);
    let by = vec3f(sum4(carried), sum4(luminance), sum4(of_camera) + beyond * f32((range.y - range.x) - (ends.y - ends.x)));
    // Light that nobody sees has no luminance.
    let share = select(vec3f(0.0), 1.0 / by, by > vec3f(0.0)) / select(2.0, 3.0, by.y > 0.0);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        let of_each = beta[k] * (share.x + share.y * spectrum(ROW_Y, k)) + share.z * spectrum(ROW_HERO, k);
        hero_shares[k] = select(vec4f(0.0), of_each, is_in(chosen, k));
    }
    return share.z * beyond;
}
#endif

// Chooses the hero of a path that refracts between the indices of these rows, where some wavelengths may be reflected `totally`. Camera paths of a pass choose among
// the same few, as even over a pixel's samples as can be, and evenly where they part once more.
fn choose_hero(near_row: u32, far_row: u32, totally: u32) {
    path.hero_near = near_row;
    path.hero_far = far_row;
#if CAMERA_PATHS
    let range = hero_range();
    let carries_all = (path.kept & ALL_WAVELENGTHS) == ALL_WAVELENGTHS;
    var carried = BELOW | ABOVE;
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        carried |= as_set(beta[k] > vec4f(0.0), k);
    }
    path.kept &= carried & ~totally;
    if (carries_all) {
        let choice = ((sampler_index & 1u) << 1u | ((sampler_index >> 1u) & 1u)) ^ (sampler_pixel & 3u);
        path.hero = i32(component(vec4f(pass_head().heroes), choice)) - i32(BEYOND);
        // 1 / (4 times the probability of the wavelength): the sum over a wavelength is 1 in the mean of all passes.
        path.hero_weight = 4.0 * component(pass_head().hero_weights, choice);
    } else {
        let count = f32(range.y - range.x + 1);
        path.hero = range.x + i32(min(event_light.x * count, count - 1.0));
        path.hero_weight = count;
    }
    let left = hero_range();
    let may_be_hero = (path.kept & hero_as_set()) != 0u && path.hero >= left.x && path.hero <= left.y;
    scale_beta(select(0.0, 1.0, may_be_hero));
#else
    var u = event_light.x;
#if GUIDED
    u = select(u, numbers.choices.y, (path.kept & ALL_WAVELENGTHS) == ALL_WAVELENGTHS);
#endif
    let share_beyond = share_heroes(totally);
    let carried = vec2i(carried_wavelengths());
    let range = hero_range();
    let below = share_beyond * f32(carried.x - range.x);
    let above = share_beyond * f32(range.y - carried.y);
    path.hero = i32(choose_wavelength(&hero_shares, (u - below) / (1.0 - below - above)));
    path.hero_weight = safe_ratio(1.0, at_wavelength(&hero_shares, u32(path.hero)));
    if (u < below || u > 1.0 - above) {
        path.hero = select(range.y - i32((1.0 - u) / share_beyond), range.x + i32(u / share_beyond), u < below);
        path.hero_weight = 1.0 / share_beyond;
    }
#endif
}

// Where some of the wavelengths kept take another way, as those that glass reflects totally, they cannot share one, however near they are: the hero goes on alone.
fn part_from(others: u32) {
    if (path.hero != NO_HERO) {
        let parted = others & path.kept;
        if (parted != 0u && parted != path.kept) {
            // One beyond the range has nothing of its own.
            path.kept = hero_as_set() & ALL_WAVELENGTHS;
            scale_beta(select(0.0, 1.0, path.kept != 0u));
        }
    }
}

// First and last of the wavelengths that may be the hero: those that the path carries, and beyond them a third as many to either side.
fn hero_range() -> vec2i {
    let ends = vec2i(carried_wavelengths());
    let beyond = min((ends.y - ends.x) / 3, i32(BEYOND));
    return ends + beyond * select(vec2i(0), vec2i(-1, 1), vec2<bool>((path.kept & BELOW) != 0u, (path.kept & ABOVE) != 0u));
}

// The hero as a set; BELOW or ABOVE if it is beyond what the path carries.
fn hero_as_set() -> u32 {
    let ends = vec2i(carried_wavelengths());
    let within = select(ABOVE, 1u << u32(path.hero & 31), path.hero <= ends.y);
    return select(within, BELOW, path.hero < ends.x);
}

fn hero_or_first() -> i32 {
    return select(path.hero, 0, path.hero == NO_HERO);
}

// A quotient of two rows at a wavelength; beyond the film's range rows go on as their image in the point at its end, so that the mean of what lies to either side
// of a wavelength is its own.
fn ratio_at(over: u32, under: u32, wavelength: i32) -> f32 {
    let end = clamp(wavelength, 0, i32(WAVELENGTHS) - 1);
    let image = u32(2 * end - wavelength);
    return (2.0 * spectrum_at(over, u32(end)) - spectrum_at(over, image)) / (2.0 * spectrum_at(under, u32(end)) - spectrum_at(under, image));
}

// The same at the first and the last of those that may be the hero.
fn ratios_beyond(over: u32, under: u32) -> vec4f {
    let range = hero_range();
    return vec2f(ratio_at(over, under, range.x), ratio_at(over, under, range.y)).xyxy;
}

fn as_set_beyond(chosen: vec4<bool>) -> u32 {
    return select(0u, BELOW, chosen.x) | select(0u, ABOVE, chosen.y);
}

// Index that wavelengths parted by.
fn parting_index(k: u32) -> vec4f {
    return spectrum(path.hero_far, k) / spectrum(path.hero_near, k);
}

// What a quotient of two rows changes by around the hero, per unit of the index that wavelengths parted by.
fn change_of_ratio(over: u32, under: u32) -> f32 {
    if (path.hero == NO_HERO) {
        return 0.0;
    }
    let change = ratio_at(path.hero_far, path.hero_near, path.hero + 1) - ratio_at(path.hero_far, path.hero_near, path.hero - 1);
    let ratio = ratio_at(over, under, path.hero + 1) - ratio_at(over, under, path.hero - 1);
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
// what they find is right up to the second order of the width, energy included.
fn keep_within(width: f32) {
    let sum_before = sum_beta();
    var index: array<vec4f, WAVELENGTHS4>;
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        index[k] = parting_index(k);
    }
    // Where a number of neighbours ends and the next begins must not show.
    let about = 2.0 * width * (0.75 + 0.5 * unit_float(hash2(sampler_index, sampler_pixel ^ 0x68e31da4u)));
    let last = i32(WAVELENGTHS) - 1;
    let ends = vec2i(carried_wavelengths());
    let range = hero_range();
    let set_of = path.kept;
    path.kept = BELOW | ABOVE;
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        let wavelength = vec4i(i32(4u * k)) + vec4i(0, 1, 2, 3);
        var before = vec4f(index[max(k, 1u) - 1u].w, index[k].xyz);
        var behind = vec4f(index[k].yzw, index[min(k + 1u, WAVELENGTHS4 - 1u)].x);
        before = select(before, 2.0 * index[k] - behind, wavelength == vec4i(0));
        behind = select(behind, 2.0 * index[k] - before, wavelength == vec4i(last));
        let step = max(abs(behind - before), vec4f(1e-9));
        // Wavelengths share ways beyond the range only where there would be few others.
        let within = max(min(wavelength - ends.x, ends.y - wavelength), vec4i((ends.y - ends.x) / 3));
        let most = max(min(min(wavelength - range.x, range.y - wavelength), within), vec4i(0));
        let reach = min(vec4i(min(about / step, vec4f(32.0))), most);
        let shares = abs(wavelength - path.hero) <= reach;
        // As far as there is a way; there is one for each beyond what the path carries.
        let first = max(wavelength - reach, vec4i(ends.x));
        let end = min(wavelength + reach, vec4i(ends.y));
        let window = ((vec4u(2u) << vec4u(max(end - first, vec4i(0)))) - 1u) << vec4u(first & vec4i(31));
        let ways = max(vec4i(countOneBits(window & vec4u(set_of))) + 2 * reach - (end - first), vec4i(1));
        // Indices are not evenly apart: the side with the greater steps counts less, so that the mean index is the wavelength's own. Beyond the film's range steps
        // are those of the image.
        let r = vec4f(reach);
        let below = max(r - vec4f(wavelength), vec4f(0.0));
        let above = max(r + vec4f(wavelength - last), vec4f(0.0));
        let turned = (below * (below + 1.0) * (2.0 * below + 1.0) + above * (above + 1.0) * (2.0 * above + 1.0)) / max(r * (r + 1.0), vec4f(1.0));
        let uneven = 2.0 * (abs(behind - index[k]) - abs(index[k] - before)) / step * (2.0 * r + 1.0 - turned) / 6.0;
        let balance = 1.0 - clamp(uneven, vec4f(-1.0), vec4f(1.0)) * vec4f(sign(path.hero - wavelength));
        let goes_on = shares & is_in(set_of, k);
        beta[k] *= select(vec4f(0.0), path.hero_weight * balance / vec4f(ways), goes_on);
        path.kept |= as_set(goes_on, k);
    }
    path.hero = NO_HERO;
    // What is rarely kept must not outlive what is often kept.
    path.start *= safe_ratio(sum_beta(), sum_before);
}

// Where a path has come to its hero's end at `p`, along `d`: of the normal `n` there, in a medium along `d`. What is neither diffuse nor a lamp would show that
// directions differ: there the hero goes on alone.
fn keep_near_hero(d: vec3f, p: vec3f, n: vec3f, is_diffuse: bool) {
    if (path.hero != NO_HERO) {
        keep_within(select(0.0, pass_head().blur / max(shift_by_index(d, p, n), 1e-6), is_diffuse));
    }
}

#if CAMERA_PATHS
// Likewise for a path that has left the scene along `d`.
fn keep_near_hero_far_away(d: vec3f) {
    if (path.hero != NO_HERO) {
        keep_within(pass_head().blur / max(shift_in_picture(d, by_index.d, by_pixel_x.d, by_pixel_y.d), 1e-6));
    }
}
#endif

