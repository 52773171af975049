// Lambertian reflection or transmission, under a coat with its ways in and out.
#include "bsdf/bsdf.wgsl"

// Reflectance, but for the ways into and out of a coat.
fn diffuse_reflectance(b: ptr<function, Bsdf>, k: u32) -> vec4f {
#if COAT
    return under_coat(b, color_of(b, k), k);
#else
    return color_of(b, k);
#endif
}

#if DIFFUSE_TRANSMISSION
// To which side light goes: 1 to that which it comes from, or -1.
fn side_of_diffuse(m: Material) -> f32 {
    return select(1.0, -1.0, m.kind == MATERIAL_KIND_DIFFUSE_TRANSMISSION);
}
#endif

fn eval_diffuse(b: ptr<function, Bsdf>, wo: vec3f, wi: vec3f, f: ptr<function, Spectrum>) -> BsdfPdf {
#if DIFFUSE_TRANSMISSION
    let mu = wi.z * side_of_diffuse((*b).m);
#else
    let mu = wi.z;
#endif
    let pdf = max(mu, 0.0) * INV_PI;
#if COAT
    var out = coat_transmittance(b, mu);
#endif
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        (*f)[k] = pdf * diffuse_reflectance(b, k);
#if COAT
        (*f)[k] *= if_coated(b, out[k]);
#endif
    }
    return BsdfPdf(pdf, pdf, wo.z * INV_PI);
}
