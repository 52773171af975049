// Where wavelengths part. At a dispersive refraction one of those that a path carries becomes its hero (Wilkie et al. 2014, "Hero wavelength spectral
// sampling"), and the path goes its way. Where the path then scatters, or finds light, it keeps those whose own ways would have ended near by: each finds the mean of
// what its nearest neighbours find as heroes. Those of a camera path all end where the hero does, a blur within a pixel; those of a light path land each where it would have come
// to by itself, up to the first order (Elek et al. 2014, "Spectral ray differentials"). How near they have to be shrinks from pass to pass as the radius of merging does.
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
// By what light paths choose their hero: a third each by what they carry, by its luminance, and evenly. The path keeps those that may be chosen; the share of each beyond
// them comes back.
fn share_heroes(totally: u32) -> f32 {
    var carried = vec4f(0.0);
    var luminance = vec4f(0.0);
    var chosen = 0u;
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        // The last vector may have more components than there are wavelengths.
        let throughput = select(vec4f(0.0), beta[k], is_in(ALL_WAVELENGTHS, k));
        carried += throughput;
        luminance += throughput * spectrum(ROW_Y, k);
        chosen |= as_set(throughput > vec4f(0.0), k);
    }
    path.kept &= (chosen | BELOW | ABOVE) & ~totally;
    let range = hero_range();
    let ends = vec2i(carried_wavelengths());
    let beyond = f32((range.y - range.x) - (ends.y - ends.x));
    let by = vec3f(sum4(carried), sum4(luminance), f32(countOneBits(chosen)) + beyond);
    // Light that nobody sees has no luminance.
    let share = select(vec3f(0.0), 1.0 / by, by > vec3f(0.0)) / select(2.0, 3.0, by.y > 0.0);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        let of_each = beta[k] * (share.x + share.y * spectrum(ROW_Y, k)) + share.z;
        hero_shares[k] = select(vec4f(0.0), of_each, is_in(chosen, k));
    }
    return share.z;
}
#endif

// Chooses the hero of a path that refracts between the indices of these rows, where some wavelengths may be reflected `totally`. Camera paths of a pass choose among
// the same few, as even over a pixel's samples as can be, and evenly where they part once more.
fn choose_hero(near_row: u32, far_row: u32, totally: u32) {
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

// That between the volumes of these rows, at a wavelength that may be the hero.
fn relative_index_at(near_row: u32, far_row: u32, hero: i32) -> RelativeIndex {
    let near = index_at(near_row, hero);
    let far = index_at(far_row, hero);
    let eta = far.x / near.x;
    return RelativeIndex(eta, (far.y - eta * near.y) / near.x);
}

// Relative indices at the first and the last of those that may be the hero.
fn indices_beyond(near_row: u32, far_row: u32) -> vec4f {
    let range = hero_range();
    return vec2f(relative_index_at(near_row, far_row, range.x).eta, relative_index_at(near_row, far_row, range.y).eta).xyxy;
}

fn as_set_beyond(chosen: vec4<bool>) -> u32 {
    return select(0u, BELOW, chosen.x) | select(0u, ABOVE, chosen.y);
}

// No weight of one way that wavelengths share is negative for this: none has more than half of them to either side.
const MOST_UNEVEN = 2.0 / f32(WAVELENGTHS);

// Per unit of the index that wavelengths parted by, what changes by so much to the next wavelength.
fn of_parting(change: f32) -> f32 {
    return select(0.0, change / path.parting, path.hero != NO_HERO && abs(path.parting) > 1e-9);
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

// First and last of the wavelengths kept around this one that have none between them which is not.
fn run_around(wavelength: u32) -> vec2i {
    let gaps = ~(path.kept & ALL_WAVELENGTHS);
    let up_to = (2u << wavelength) - 1u;
    let above = gaps & ~up_to;
    return vec2i(vec2u(firstLeadingBit(gaps & up_to) + 1u, select(firstTrailingBit(above) - 1u, 31u, above == 0u)));
}

// x (x + 1) (2 x + 1), six times the sum of the first x squares.
fn six_squares(x: vec4f) -> vec4f {
    return x * (x + 1.0) * (2.0 * x + 1.0);
}

// The path keeps the hero and those wavelengths that share its way within `width` of the index: each shares the ways of as many to either side, so that the mean of
// what they find is right up to the second order of the width, energy included.
fn keep_within(width: f32) {
    let sum_before = sum_beta();
    // Where a number of neighbours ends and the next begins must not show.
    let about = 2.0 * width * (0.75 + 0.5 * unit_float(hash2(sampler_index, sampler_pixel ^ 0x68e31da4u)));
    // As far as there are heroes to both sides, without a gap; beyond the ends only where there would be few others.
    let ends = vec2i(carried_wavelengths());
    let without_gap = run_around(u32(clamp(path.hero, ends.x, ends.y)));
    let beyond = select(vec2f(0.0), vec2f(abs(ends - hero_range())), without_gap == ends);
    let first = f32(without_gap.x);
    let last = f32(without_gap.y);
    let hero = f32(path.hero);
    let end = f32(WAVELENGTHS - 1u);
    var shared_by = 0u;
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        let wavelength = f32(4u * k) + vec4f(0.0, 1.0, 2.0, 3.0);
        let index = index_from_hero(k);
        var before = vec4f(index_from_hero(max(k, 1u) - 1u).w, index.xyz);
        var behind = vec4f(index.yzw, index_from_hero(min(k + 1u, WAVELENGTHS4 - 1u)).x);
        before = select(before, 2.0 * index - behind, wavelength == vec4f(0.0));
        behind = select(behind, 2.0 * index - before, wavelength == vec4f(end));
        let change = behind - before;
        let per_change = change / (change * change + 1e-18);
        let most = min(max(wavelength - first, vec4f(beyond.x)), max(last - wavelength, vec4f(beyond.y)));
        let reach = min(floor(about * abs(per_change)), most);
        // Indices are not evenly apart: the side with the greater steps counts less, so that the mean index is the wavelength's own.
        var uneven = (behind - 2.0 * index + before) * per_change;
        // Beyond the film's range steps are those of the image. Only wavelengths near its ends share ways there.
        let imaged = six_squares(max(max(reach - wavelength, reach + wavelength - end), vec4f(0.0))) / max(six_squares(reach), vec4f(1.0));
        let is_inner = (wavelength >= vec4f(f32(BEYOND))) & (wavelength <= vec4f(end - f32(BEYOND)));
        uneven *= select(1.0 - imaged, vec4f(1.0), is_inner);
        let away = hero - wavelength;
        let balance = 1.0 - clamp(uneven, vec4f(-MOST_UNEVEN), vec4f(MOST_UNEVEN)) * away;
        let goes_on = (abs(away) <= reach) & (wavelength <= vec4f(end));
        beta[k] *= select(vec4f(0.0), path.hero_weight * balance / (2.0 * reach + 1.0), goes_on);
        shared_by |= as_set(goes_on, k);
    }
    path.kept = (path.kept & shared_by) | BELOW | ABOVE;
    path.hero = NO_HERO;
    // What is rarely kept must not outlive what is often kept.
    path.start *= safe_ratio(sum_beta(), sum_before);
}

#if LIGHT_PATHS
// Wavelengths that land apart may be this many times as far apart as those that end in one place. Measured: src/README.md.
const REACH_OF_LANDING = 4.0;

// Least and greatest of `from_hero` among the wavelengths that the path keeps.
fn landing_ends() -> vec2f {
    var ends = vec2f(0.0);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        let apart = select(vec4f(0.0), index_from_hero(k), is_in(path.kept & ALL_WAVELENGTHS, k));
        ends = vec2f(min(ends.x, min(min(apart.x, apart.y), min(apart.z, apart.w))), max(ends.y, max4(apart)));
    }
    return ends;
}
#endif

// Where a path has come to its hero's end at `p`, along `d`: of the normal `n` there, in a medium along `d`. By how much of the index wavelengths may differ that share its way. What is
// neither diffuse nor a lamp would show that directions differ: there the hero goes on alone. Wavelengths of a light path land apart where all around is alike (`is_plain`), and where they
// come from a lamp without being scattered: what has been is spread too wide for its place to matter.
fn width_near_hero(d: vec3f, p: vec3f, n: vec3f, is_diffuse: bool, is_plain: bool) -> f32 {
#if LIGHT_PATHS
    let by = landing_by(d, p, n);
    let widths = in_widths(by, p);
    let lands_apart = is_diffuse && is_plain && path.spread == 0.0 && widths < 1e6;
    landing_by_index = select(vec3f(0.0), by, lands_apart);
    let reach = select(1.0, REACH_OF_LANDING, lands_apart);
#else
    let widths = shift_by_index(d, p);
    let reach = 1.0;
#endif
    return select(0.0, reach * pass_head().blur / max(widths, 1e-6), is_diffuse);
}

#if CAMERA_PATHS
// Likewise for a path that has left the scene along `d`.
fn width_far_away(d: vec3f) -> f32 {
    return pass_head().blur / max(shift_in_picture(d, by_index.d, by_pixel_x.d, by_pixel_y.d), 1e-6);
}
#endif
