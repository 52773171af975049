// Mirror images of small lamps in smooth glass. Fresnel reflection is chosen a few times in a hundred, so that such an image is made of rare bright samples; where
// the mirrored direction leads to a lamp it is chosen more often. Only where nothing but chance finds the lamp: what light paths find as well has its weight there.
#include "common/params.wgsl"
#include "light/light.wgsl"
#include "path/state.wgsl"

// Lamps that show a greater sine squared of their angle are no small ones, and light their surroundings about as brightly as glass mirrors them.
const SMALL = 0.0625;
const MOST_REFLECTED = 0.5;

fn is_found_by_chance() -> bool {
#if CAUSTICS
    return path.light_path_density == 0.0;
#else
    return path.pdf < 0.0;
#endif
}

// Probability of reflection along `w` from `p`, where the reflectance is `r`. A lamp that shows the sine squared s lights diffuse surfaces with s of its radiance
// at most, which is what the other way may lead to.
fn share_of_reflection(r: f32, p: vec3f, w: vec3f) -> f32 {
    var share = r;
    for (var i = 0u; i < params.highlights; i++) {
        let lamp = load_Light(params.lights + i).p0;
        let v = lamp.xyz - p;
        let off = cross(v, w);
        let s = lamp.w * lamp.w / dot(v, v);
        let is_met = dot(v, w) > 0.0 && dot(off, off) < lamp.w * lamp.w && s < SMALL;
        share = select(share, max(share, min(r / (r + s), MOST_REFLECTED)), is_met);
    }
    return select(r, share, r > 0.0 && is_found_by_chance());
}

// What a path that went one of the two ways is worth for it, where the reflectance is `r` and reflection was chosen with probability `q`.
fn worth_of_choice(r: f32, q: f32, reflects: bool) -> f32 {
    return select(1.0, select((1.0 - r) / (1.0 - q), r / q, reflects), q > r);
}
