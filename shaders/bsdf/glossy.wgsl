// What one facet after another reflects: rough metal, or a rough coat or sheen by itself.

fn pdf_glossy(m: Material, wo: vec3f, wi: vec3f) -> f32 {
#if SHEEN
    if (m.kind == MATERIAL_KIND_SHEEN) {
        return pdf_sheen(wo, wi);
    }
#endif
#if ROUGH_COAT
    if (m.kind == MATERIAL_KIND_COATED) {
        return pdf_coat(m, wo, wi);
    }
#endif
#if ROUGH_CONDUCTOR
    return pdf_rough_conductor(m, wo, wi);
#else
    return 0.0;
#endif
}

// Fills bsdf_f; returns the pdf.
fn eval_glossy(m: Material, wo: vec3f, wi: vec3f) -> f32 {
#if SHEEN
    if (m.kind == MATERIAL_KIND_SHEEN) {
        return eval_sheen(m, wo, wi);
    }
#endif
#if ROUGH_COAT
    if (m.kind == MATERIAL_KIND_COATED) {
        return eval_coat(m, wo, wi);
    }
#endif
#if ROUGH_CONDUCTOR
    return eval_rough_conductor(m, wo, wi);
#else
    return 0.0;
#endif
}

fn sample_glossy(m: Material, wo: vec3f, u_lobe: f32, u: vec2f) -> vec3f {
#if SHEEN
    if (m.kind == MATERIAL_KIND_SHEEN) {
        return sample_cosine(u);
    }
#endif
#if ROUGH_CONDUCTOR
    if (m.kind != MATERIAL_KIND_COATED) {
        return sample_rough_conductor(m, wo, u_lobe, u);
    }
#endif
    return reflect(-wo, sample_visible_normal(wo, Width(m.alpha), u));
}
