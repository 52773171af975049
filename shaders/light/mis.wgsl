// Balance heuristic (Veach 1997, 9.2.2) of a chance hit of pdf `pdf` against a light sample of pdf `light_pdf`, both per solid angle.
// A negative pdf marks a direction that no light sample could have made: a sensor ray, or one that left a smooth surface.
fn mis_weight(pdf: f32, light_pdf: f32) -> f32 {
    return select(pdf / (pdf + light_pdf), 1.0, pdf < 0.0);
}
