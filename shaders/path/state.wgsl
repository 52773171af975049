// State of the path that an invocation is tracing.
#include "common/math.wgsl"
#include "common/params.wgsl"
#include "common/spectra.wgsl"
#include "geometry/trace.wgsl"
#if INTERIORS
#include "medium/interiors.wgsl"
#endif

var<private> pass_of_path: u32; // pass within the table of spectra
var<private> beta: array<vec4f, WAVELENGTHS4>; // throughput per wavelength
var<private> li: array<vec4f, WAVELENGTHS4>; // radiance collected so far
var<private> Ld: array<vec4f, WAVELENGTHS4>; // light-sample contribution that waits for its shadow ray

fn sum_beta() -> f32 {
    var s = vec4f(0.0);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        s += beta[k];
    }
    return sum4(s);
}

fn scale_beta(factor: f32) {
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        beta[k] *= factor;
    }
}

#if WAVELENGTH_CHOICE
// A wavelength with probability shares / their sum.
fn choose_wavelength(shares: ptr<private, array<vec4f, WAVELENGTHS4>>, u: f32) -> u32 {
    var total = vec4f(0.0);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        total += (*shares)[k];
    }
    let target_sum = u * sum4(total);
    var wavelength = 0u;
    var last = 0u;
    var s = 0.0;
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        for (var c = 0u; c < 4u; c++) {
            let share = (*shares)[k][c];
            // The last wavelength of a share that is not zero catches what rounding leaves over.
            last = select(last, 4u * k + c, share > 0.0);
            s += share;
            wavelength = select(wavelength, 4u * k + c + 1u, s <= target_sum);
        }
    }
    return min(wavelength, last);
}

// A wavelength with probability beta / sum(beta): the one-sample mixture over wavelengths; callers divide by the mixture's pdf.
fn sample_wavelength(u: f32) -> u32 {
    return choose_wavelength(&beta, u);
}
#endif

fn at_wavelength(values: ptr<private, array<vec4f, WAVELENGTHS4>>, wavelength: u32) -> f32 {
    var chosen = vec4f(0.0);
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        chosen += (*values)[k] * one_hot(wavelength, k);
    }
    return sum4(chosen);
}

fn beta_at(wavelength: u32) -> f32 {
    return at_wavelength(&beta, wavelength);
}

#if DISPERSION
// An index beyond a face over that before it at a wavelength, and what it changes by to the next.
struct RelativeIndex {
    eta: f32,
    change: f32,
}
#endif

struct Path {
    ended: bool,
    in_shadow: bool, // the ray at hand is a light sample's; `next_ray` waits
    connects: bool, // nothing was in its way
    depth: u32, // scattering events so far
    pdf: f32, // of the present direction per solid angle; negative if no light sample could have made it
    last_vertex: vec3f, // where that direction was chosen
    crossings: u32, // surfaces passed straight through; bounds the loop
#if DISPERSION
    kept: u32, // wavelengths that the path carries, a bit for each, and whether heroes may lie BELOW and ABOVE them
    hero: i32, // the wavelength that it goes by since a dispersive refraction, or NO_HERO; the first one is 0
    parting: f32, // what the index that they parted by changes by from the hero to the next
    hero_weight: f32, // 1 / probability of having it
#if LIGHT_PATHS
    chain: f32, // way since the last vertex that was not specular
    spread: f32, // angle that light spreads by from there
#endif
#endif
    start: f32, // mean throughput behind the first vertex that is not specular; before that the one at the start, times -1
#if START_VOLUMES
    is_starting: bool, // the ray at hand leads up from the start, to find the volumes there
#endif
#if CAUSTICS
    length: f32, // way so far; of a light path, from the last vertex at which it could be merged
#if CAMERA_PATHS
    light_path_density: f32, // density of light paths for this one, over that of emission (path/mis.wgsl)
    view: u32, // VIEW_*: what lies between the sensor and the path's end
#else
    emission: f32, // number of light paths times the density of emission
    camera_path_density: f32, // density of camera paths that hit or sample the light
    merges: f32, // cosine over pdf for a camera path at the last vertex at which this one could be merged, or 0
    extinction: f32, // of the fog there
    light: u32,
    light_texel: u32, // of an environment picture
    light_normal: vec3f,
#endif
#endif
}

const VIEW_DIRECT = 0u; // nothing
const VIEW_BENT = 1u; // metal or glass only
const VIEW_SCATTERED = 2u;

var<private> path: Path;

#if DISPERSION
const ALL_WAVELENGTHS = 0xffffffffu >> (32u - WAVELENGTHS);
const BELOW = select(0u, 1u << 30u, BEYOND > 0u);
const ABOVE = select(0u, 1u << 31u, BEYOND > 0u);
const NO_HERO = i32(1u << 16u);

// Of a ray's origin, in the plane of the surface there, and of its direction.
struct Differential {
    p: vec3f,
    d: vec3f,
}

var<private> by_index: Differential; // per unit of the index that wavelengths parted by
#if CAMERA_PATHS
var<private> by_pixel_x: Differential; // per width of a pixel's kernel
var<private> by_pixel_y: Differential;
#else
var<private> hero_shares: array<vec4f, WAVELENGTHS4>; // by which the path chooses its hero
// Where wavelengths land around the vertex at hand: what it moves by per unit of the index that they parted by.
var<private> landing_by_index: vec3f;
var<private> from_hero: array<vec4f, WAVELENGTHS4>;
#endif

// How much greater the index that wavelengths parted by is than the hero's.
fn index_from_hero(k: u32) -> vec4f {
#if LIGHT_PATHS
    return from_hero[k];
#else
    return Ld[k];
#endif
}

fn set_index_from_hero(k: u32, index: vec4f) {
#if LIGHT_PATHS
    from_hero[k] = index;
#else
    // Free as long as a hero is under way: no light is sampled at a smooth surface.
    Ld[k] = index;
#endif
}
#endif

// First and last of the wavelengths that the path carries; if it carries none the first comes behind the last.
fn carried_wavelengths() -> vec2u {
#if DISPERSION
    let kept = path.kept & ALL_WAVELENGTHS;
    return select(vec2u(1u, 0u), vec2u(firstTrailingBit(kept), firstLeadingBit(kept)), kept != 0u);
#else
    return vec2u(0u, WAVELENGTHS - 1u);
#endif
}

#if CONNECT
var<private> next_ray: Ray; // the path's next segment, while its shadow ray is under way
#if PASS_THROUGH
#if INTERIORS
var<private> shadow_inside: Volumes; // volumes that the shadow ray is in
#endif
#endif
#if CONTACT
var<private> next_beside: Beside; // what lies beside the next segment's origin
#endif
#endif

fn start_path(ray: Ray) {
#if CONTACT
    beside = NOTHING;
#endif
    path = Path();
    path.pdf = -1.0;
    path.last_vertex = ray.o;
#if DISPERSION
    path.kept = ALL_WAVELENGTHS | BELOW | ABOVE;
    path.hero = NO_HERO;
    begin_differentials(ray.d);
#endif
    path.start = -sum_beta() / f32(WAVELENGTHS);
}

fn end_path(ray: Ray) -> Ray {
    path.ended = true;
    return ray;
}
