// As src/develop/gamut.rs, whose rings are `ring` and `rounded_ring`.

// As `GamutMap::without_negatives`.
fn without_negatives(rgb: vec3f) -> vec3f {
    let cut = max(rgb, vec3f(0.0));
    if (all(cut == rgb)) {
        return rgb;
    }
    let lab = oklab(rgb);
    if (lab.x <= 0.0 || all(cut == vec3f(0.0))) {
        return vec3f(0.0);
    }
    let own = hue_degrees(lab);
    let turn = half_turn(hue_degrees(oklab(cut)) - own);
    let hue = half_turn(own + HUE_SHARE * turn);
    let sharp = at_sharp(hue);
    let lost = 1.0 - saturation(oklab(sharp)) / saturation(lab);
    let t = clamp(lost / FAR_OUTSIDE, 0.0, 1.0);
    let share = t * t * (3.0 - 2.0 * t);
    return of_lightness_one(mix(sharp, at_rounded(hue), share)) * (lab.x * lab.x * lab.x);
}

fn oklab(rgb: vec3f) -> vec3f {
    let lms = RGB_TO_LMS * rgb;
    return ROOTS_TO_LAB * vec3f(cube_root(lms.x), cube_root(lms.y), cube_root(lms.z));
}

// Within [-180, 180], where single precision has more digits left than in [0, 360).
fn hue_degrees(lab: vec3f) -> f32 {
    return angle_degrees(lab.z, lab.y);
}

// The same angle, by less than half a turn.
fn half_turn(degrees: f32) -> f32 {
    return degrees + select(0.0, 360.0, degrees < -180.0) - select(0.0, 360.0, degrees >= 180.0);
}

fn saturation(lab: vec3f) -> f32 {
    return length(lab.yz) / lab.x;
}

fn of_lightness_one(rgb: vec3f) -> vec3f {
    let l = oklab(rgb).x;
    return rgb / (l * l * l);
}

// The ring's colour at a hue.
fn at_sharp(hue: f32) -> vec3f {
    let x = hue * (f32(RING) / 360.0);
    let i = u32(i32(floor(x)) + i32(RING));
    return mix(load_ring(i % RING).xyz, load_ring((i + 1u) % RING).xyz, x - floor(x));
}

fn at_rounded(hue: f32) -> vec3f {
    let x = hue * (f32(ROUNDED_RING) / 360.0);
    let i = u32(i32(floor(x)) + i32(ROUNDED_RING));
    let a = load_rounded_ring(i % ROUNDED_RING).xyz;
    return mix(a, load_rounded_ring((i + 1u) % ROUNDED_RING).xyz, x - floor(x));
}

// The largest component brought below 1, as `shoulder`.
fn shoulder(largest: f32) -> f32 {
    // e^x is 2^(x log2 e). With the knee at 1, whatever the power is, it counts as nothing.
    return 1.0 - (1.0 - KNEE) * exponential(-1.442695041 * (largest - KNEE) / max(1.0 - KNEE, 1e-6));
}
