// Elementary functions to a few units of 2^-24 on every adapter: WGSL lets its own be off by far more (its arctangent by 4096). Polynomials are
// Chebyshev fits.

// Logarithm to base 2 of a normal number above 0: its exponent, and the series of atanh for the rest within [sqrt(1/2), sqrt(2)).
fn logarithm(x: f32) -> f32 {
    let bits = bitcast<i32>(x) - 0x3f3504f3;
    let exponent = bits >> 23u;
    let m = bitcast<f32>((bits & 0x007fffff) + 0x3f3504f3);
    let s = (m - 1.0) / (m + 1.0);
    let z = s * s;
    // 2 / ln(2) times 1, 1/3, 1/5, 1/7, 1/9.
    let series = 2.885390082 + z * (0.961796694 + z * (0.577078016 + z * (0.412198583 + z * 0.320598898)));
    return f32(exponent) + s * series;
}

// 2^x, 0 from below the normal numbers on.
fn exponential(x: f32) -> f32 {
    if (x < -126.0) {
        return 0.0;
    }
    let whole = floor(min(x, 127.0) + 0.5);
    let f = x - whole;
    let high = 0.0555032721 + f * (0.00961802560 + f * (0.00134004331 + f * 0.000154697328));
    let mantissa = 1.0 + f * (0.693147207 + f * (0.240226512 + f * high));
    return mantissa * bitcast<f32>((i32(whole) + 127) << 23u);
}

// x^p for x from 0 on, p > 0.
fn power(x: f32, p: f32) -> f32 {
    return select(0.0, exponential(p * logarithm(max(x, 1.2e-38))), x > 1.2e-38);
}

// Cube root of any sign; one step of Newton's method takes off what the logarithm lost.
fn cube_root(x: f32) -> f32 {
    let y = power(abs(x), 1.0 / 3.0);
    let better = y - (y - abs(x) / (y * y)) / 3.0;
    return select(0.0, select(better, -better, x < 0.0), y > 0.0);
}

// Arctangent of x within [-tan(pi/8), tan(pi/8)].
fn arctangent_near_zero(x: f32) -> f32 {
    let z = x * x;
    return x * (1.0 + z * (-0.33333307 + z * (0.19998211 + z * (-0.14239983 + z * (0.10572816 - z * 0.06033242)))));
}

// Angle of (x, y), degrees within [-180, 180].
fn angle_degrees(y: f32, x: f32) -> f32 {
    let low = min(abs(x), abs(y));
    let high = max(abs(x), abs(y));
    if (high == 0.0) {
        return 0.0;
    }
    // From the diagonal where that is nearer.
    let steep = low > 0.41421356 * high;
    let ratio = select(low, low - high, steep) / select(high, low + high, steep);
    var angle = degrees(arctangent_near_zero(ratio)) + select(0.0, 45.0, steep);
    angle = select(angle, 90.0 - angle, abs(y) > abs(x));
    angle = select(angle, 180.0 - angle, x < 0.0);
    return select(angle, -angle, y < 0.0);
}
