// atan on [0, 1], absolute error 2e-8 (Abramowitz & Stegun 4.4.49); the built-in is only good to 1e-4 on some adapters.
#include "common/math.wgsl"

fn atan_unit(x: f32) -> f32 {
    let s = x * x;
    return x * (1.0 + s * (-0.3333314528 + s * (0.1999355085 + s * (-0.1420889944 + s * (0.1065626393
        + s * (-0.0752896400 + s * (0.0429096138 + s * (-0.0161657367 + s * 0.0028662257))))))));
}

fn atan2_precise(y: f32, x: f32) -> f32 {
    let ax = abs(x);
    let ay = abs(y);
    let greatest = max(ax, ay);
    if (greatest == 0.0) {
        return 0.0;
    }
    var a = atan_unit(min(ax, ay) / greatest);
    a = select(a, 0.5 * PI - a, ay > ax);
    a = select(a, PI - a, x < 0.0);
    return select(a, -a, y < 0.0);
}
