// Adds a finished sample to the film, unless it is bad: then it is counted instead.
fn deposit(film_base: u32, sample: u32) {
    var all = vec4f(0.0);
    var least = vec4f(0.0);
    for (var k = 0u; k < LANES4; k++) {
        all += abs(li[k]);
        least = min(least, li[k]);
    }
    if (!is_finite(sum4(all))) {
        atomicAdd(&counters[COUNTER_NOT_FINITE], 1u);
        return;
    }
    if (min(min(least.x, least.y), min(least.z, least.w)) < 0.0) {
        atomicAdd(&counters[COUNTER_NEGATIVE], 1u);
        return;
    }
    var xyz = vec3f(0.0);
    for (var k = 0u; k < LANES4; k++) {
        xyz += vec3f(dot(li[k], spectrum(ROW_X, k)), dot(li[k], spectrum(ROW_Y, k)), dot(li[k], spectrum(ROW_Z, k)));
        let w = li[k] * spectrum(ROW_BIN, k);
        for (var c = 0u; c < 4u; c++) {
            if (4u * k + c < LANES) {
#if MANY_BINS
                film[film_base + lane_bins[(sample - params.first_sample) * LANES + 4u * k + c]] += w[c];
#else
                film[film_base + 4u * k + c] += w[c];
#endif
            }
        }
    }
    film[film_base + BINS] += xyz.x;
    film[film_base + BINS + 1u] += xyz.y;
    film[film_base + BINS + 2u] += xyz.z;
}
