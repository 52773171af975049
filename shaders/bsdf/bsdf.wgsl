// What scatters light at a vertex: the one switch over materials. A material is a file with `eval_NAME` and `sample_NAME`, and a line in each function here.
// Directions `wo` (to where the path comes from) and `wi` (to where it goes) are in the local frame, z along the shading normal on the side of `wo`; in a
// medium along the path.
#include "common/sampler.wgsl"
#include "common/spectra.wgsl"
#include "path/state.wgsl"
#include "bsdf/material.wgsl"
#if INTERIORS
#include "medium/interiors.wgsl"
#endif
#if FRESNEL
#include "bsdf/fresnel.wgsl"
#endif
#if THIN_FILM
#include "bsdf/thin_film.wgsl"
#endif
#if DIFFUSE
#include "bsdf/diffuse.wgsl"
#endif
#if CONDUCTOR
#include "bsdf/conductor.wgsl"
#endif
#if DIELECTRIC
#include "bsdf/dielectric.wgsl"
#endif
#if THIN_DIELECTRIC
#include "bsdf/thin_dielectric.wgsl"
#endif
#if COAT
#include "bsdf/coat.wgsl"
#endif
#if SHEEN
#include "bsdf/sheen.wgsl"
#endif
#if SCATTERING
#include "medium/phase.wgsl"
#endif

// A material at a point of a surface, mixtures decided, for the wavelengths of the path; or a medium.
struct Bsdf {
    m: Material,
#if TEXTURES
    color: Spectrum, // what its picture shows there (the reflectance, a share), if it has one
#endif
#if COAT
    coat: u32, // the material that covers it, or NONE
    coat_eta: Spectrum, // index of that over the index outside
    coat_row: Spectrum, // where this is among the rows of its energy table
    coat_entered: Spectrum, // what it lets in of the path
    coat_mean: Spectrum, // what it lets in of uniform light
    coat_is_seen: bool, // the colour of paint under it is the one that is seen
#if COAT_NORMALS
    coat_normal: vec3f, // its normal, on the outer side
#endif
#endif
#if SHEEN
    sheen: u32, // the sheen over all of it, or NONE
    sheen_entered: f32, // what it leaves of the path for what lies under it
#endif
#if DIELECTRIC
    near_row: u32, // of the index on the side of the path
    far_row: u32, // of the index beyond
    dispersive: bool, // either depends on the wavelength
#endif
}

// Densities of a direction per solid angle.
struct BsdfPdf {
    pdf: f32, // with which sample_bsdf takes it
    pdf_fwd: f32, // that of one wavelength, the same for all: what multiple importance sampling works with
    pdf_rev: f32, // likewise, from `wi` to `wo`
}

struct BsdfSample {
    d: vec3f, // direction in the world
    wi: vec3f, // the same in the local frame; of a specular lobe only its z is filled in
    is_specular: bool, // no connection could have made it, and the throughput has its weight already
#if DISPERSION
    index: RelativeIndex, // of what refracts
#endif
}

fn specular_sample(d: vec3f, cos_to: f32) -> BsdfSample {
    var sampled: BsdfSample;
    sampled.d = d;
    sampled.wi = vec3f(0.0, 0.0, cos_to);
    sampled.is_specular = true;
    return sampled;
}

// Spectrum of what a picture may stand for: a reflectance, the share of a mixture.
fn color_of(b: ptr<function, Bsdf>, k: u32) -> vec4f {
#if TEXTURES
    if ((*b).m.texture != NONE) {
        return (*b).color[k];
    }
#endif
    return spectrum((*b).m.a, k);
}

#if CONDUCTOR || COAT || THIN_FILM
// Index of what the path is in: those of metals, coats and films count relative to it.
fn index_outside(k: u32) -> vec4f {
#if INTERIORS
    return spectrum(load_Interior(ruling_interior(inside)).eta_row, k);
#else
    return vec4f(1.0);
#endif
}
#endif

// True for lobes of a single direction, which nothing can be connected to.
fn is_specular(m: Material) -> bool {
    return m.kind == MATERIAL_KIND_SMOOTH_CONDUCTOR || m.kind == MATERIAL_KIND_SMOOTH_DIELECTRIC || m.kind == MATERIAL_KIND_THIN_DIELECTRIC
        || (m.kind == MATERIAL_KIND_COATED && m.alpha == 0.0);
}

#if TINT
fn is_glass(kind: u32) -> bool {
    return kind == MATERIAL_KIND_SMOOTH_DIELECTRIC || kind == MATERIAL_KIND_ROUGH_DIELECTRIC || kind == MATERIAL_KIND_THIN_DIELECTRIC
        || kind == MATERIAL_KIND_ROUGH_THIN_DIELECTRIC || kind == MATERIAL_KIND_BRUSHED_THIN_DIELECTRIC;
}

// The factor on what a surface lets through.
fn tint_of(b: ptr<function, Bsdf>, k: u32) -> vec4f {
    if (!is_glass((*b).m.kind) || (*b).m.b == NONE) {
        return vec4f(1.0);
    }
#if TEXTURES
    if ((*b).m.texture != NONE) {
        return (*b).color[k];
    }
#endif
    return spectrum((*b).m.b, k);
}
#endif

// True for what camera paths are merged at (mis.wgsl).
fn is_merging(kind: u32) -> bool {
    return kind == MATERIAL_KIND_DIFFUSE || kind == MATERIAL_KIND_MEDIUM;
}

// True for materials that are diffuse, or of which a part may be.
fn scatters_diffusely(kind: u32) -> bool {
    return kind == MATERIAL_KIND_DIFFUSE || kind == MATERIAL_KIND_MIX || kind == MATERIAL_KIND_COATED || kind == MATERIAL_KIND_GRADED
        || kind == MATERIAL_KIND_SHEEN;
}

// True for what lets no light through.
fn is_opaque(kind: u32) -> bool {
    return kind == MATERIAL_KIND_DIFFUSE || kind == MATERIAL_KIND_SMOOTH_CONDUCTOR || kind == MATERIAL_KIND_ROUGH_CONDUCTOR || kind == MATERIAL_KIND_COATED
        || kind == MATERIAL_KIND_BRUSHED_CONDUCTOR || kind == MATERIAL_KIND_SHEEN;
}

// Fills `f` with the BSDF times |cos(wi)|, of radiance that comes along `wi` and leaves along `wo` (in a medium with the phase function); returns densities.
fn eval_bsdf(b: ptr<function, Bsdf>, wo: vec3f, wi: vec3f, f: ptr<function, Spectrum>) -> BsdfPdf {
    switch (*b).m.kind {
#if SCATTERING
        case MATERIAL_KIND_MEDIUM: {
            return eval_phase(b, wi, f);
        }
#endif
#if ROUGH_CONDUCTOR
        case MATERIAL_KIND_ROUGH_CONDUCTOR, MATERIAL_KIND_BRUSHED_CONDUCTOR: {
            return eval_rough_conductor(b, wo, wi, f);
        }
#endif
#if ROUGH_DIELECTRIC
        case MATERIAL_KIND_ROUGH_DIELECTRIC: {
            return eval_rough_dielectric(b, wo, wi, f);
        }
#endif
#if ROUGH_THIN_DIELECTRIC
        case MATERIAL_KIND_ROUGH_THIN_DIELECTRIC, MATERIAL_KIND_BRUSHED_THIN_DIELECTRIC: {
            return eval_rough_thin_dielectric(b, wo, wi, f);
        }
#endif
#if ROUGH_COAT
        case MATERIAL_KIND_COATED: {
            return eval_coat(b, wo, wi, f);
        }
#endif
#if SHEEN
        case MATERIAL_KIND_SHEEN: {
            return eval_sheen(b, wo, wi, f);
        }
#endif
        default: {
#if DIFFUSE
            return eval_diffuse(b, wo, wi, f);
#else
            return BsdfPdf();
#endif
        }
    }
}

// A direction for a path along `d`; `frame` is the local one. Specular lobes put their weight into the throughput.
fn sample_bsdf(b: ptr<function, Bsdf>, p: vec3f, d: vec3f, frame: mat3x3f, wo: vec3f) -> BsdfSample {
    var wi = vec3f(0.0, 0.0, 0.0);
    switch (*b).m.kind {
#if SCATTERING
        case MATERIAL_KIND_MEDIUM: {
            wi = sample_hg((*b).m.alpha, event_direction);
        }
#endif
#if SMOOTH_CONDUCTOR
        case MATERIAL_KIND_SMOOTH_CONDUCTOR: {
            return sample_smooth_conductor(b, d, frame[2]);
        }
#endif
#if ROUGH_CONDUCTOR
        case MATERIAL_KIND_ROUGH_CONDUCTOR, MATERIAL_KIND_BRUSHED_CONDUCTOR: {
            wi = sample_mirror((*b).m, wo, next_1d(), event_direction);
        }
#endif
#if SMOOTH_DIELECTRIC
        case MATERIAL_KIND_SMOOTH_DIELECTRIC: {
            return sample_smooth_dielectric(b, p, d, frame[2]);
        }
#endif
#if ROUGH_DIELECTRIC
        case MATERIAL_KIND_ROUGH_DIELECTRIC: {
            wi = sample_rough_dielectric(b, wo);
        }
#endif
#if ROUGH_THIN_DIELECTRIC
        case MATERIAL_KIND_ROUGH_THIN_DIELECTRIC, MATERIAL_KIND_BRUSHED_THIN_DIELECTRIC: {
            wi = sample_rough_thin_dielectric(b, wo);
        }
#endif
#if SMOOTH_THIN_DIELECTRIC
        case MATERIAL_KIND_THIN_DIELECTRIC: {
            return sample_thin_dielectric(b, p, d, frame[2]);
        }
#endif
#if COAT
        case MATERIAL_KIND_COATED: {
#if SMOOTH_COAT
            if ((*b).m.alpha == 0.0) {
                return mirrored(d, frame[2]);
            }
#endif
#if ROUGH_COAT
            wi = reflect(-wo, sample_visible_normal(wo, Width((*b).m.alpha), event_direction));
#endif
        }
#endif
        default: {
#if DIFFUSE || SHEEN
            wi = sample_cosine(event_direction);
#endif
#if DIFFUSE_TRANSMISSION
            wi.z *= side_of_diffuse((*b).m);
#endif
        }
    }
    var sampled: BsdfSample;
    sampled.d = normalize(frame * wi);
    sampled.wi = wi;
    return sampled;
}

#if SMOOTH_CONDUCTOR || SMOOTH_COAT
// The mirror image of a path along `d` at the normal `n`; of a coat only what it reflects itself, which is in the throughput already.
fn mirrored(d: vec3f, n: vec3f) -> BsdfSample {
    let cos_i = min(-dot(d, n), 1.0);
    return specular_sample(normalize(d + 2.0 * cos_i * n), cos_i);
}
#endif
