// Lambertian reflection, under a coat with its ways in and out.
#include "bsdf/bsdf.wgsl"

// Reflectance, but for the ways into and out of a coat.
fn diffuse_reflectance(b: ptr<function, Bsdf>, k: u32) -> vec4f {
#if COAT
    return under_coat(b, color_of(b, k), k);
#else
    return color_of(b, k);
#endif
}

fn eval_diffuse(b: ptr<function, Bsdf>, wo: vec3f, wi: vec3f, f: ptr<function, Spectrum>) -> BsdfPdf {
    let pdf = max(wi.z, 0.0) * INV_PI;
#if COAT
    var out = coat_transmittance(b, wi.z);
#endif
    for (var k = 0u; k < WAVELENGTHS4; k++) {
        (*f)[k] = pdf * diffuse_reflectance(b, k);
#if COAT
        (*f)[k] *= if_coated(b, out[k]);
#endif
    }
    return BsdfPdf(pdf, pdf, wo.z * INV_PI);
}
