// As `ToneCurve::apply` of src/develop/tone.rs.
fn tone_curve(rgb: vec3f) -> vec3f {
#if TONE_REINHARD
    let y = max(dot(LUMINANCE, rgb), 0.0);
    return rgb * ((1.0 + y / (REINHARD_WHITE * REINHARD_WHITE)) / (1.0 + y));
#elif TONE_ACES
    // Beyond 1e7 the fit has ended, and the squares would soon leave single precision.
    let v = clamp(TONE_INTO * rgb, vec3f(0.0), vec3f(1e7));
    let fit = (v * (v + ACES_FIT[0]) + ACES_FIT[1]) / (v * (ACES_FIT[2] * v + ACES_FIT[3]) + ACES_FIT[4]);
    return TONE_BACK * max(fit, vec3f(0.0));
#elif TONE_AGX
    let v = TONE_INTO * rgb;
    let shaped = AGX_OUTSET * vec3f(agx_shaped(v.x), agx_shaped(v.y), agx_shaped(v.z));
    return TONE_BACK * vec3f(power(shaped.x, AGX_EXPONENT), power(shaped.y, AGX_EXPONENT), power(shaped.z, AGX_EXPONENT));
#else
    return rgb;
#endif
}

#if TONE_AGX
fn agx_shaped(v: f32) -> f32 {
    let stops = logarithm(max(v, AGX_LEAST) / AGX_GREY);
    let x = clamp((stops + AGX_STOPS_BELOW) / (AGX_STOPS_BELOW + AGX_STOPS_ABOVE), 0.0, 1.0);
    var sum = 0.0;
    for (var i = 0u; i < 7u; i++) {
        sum = sum * (x - 0.5) + AGX_SIGMOID_AROUND_HALF[i];
    }
    return sum;
}
#endif
