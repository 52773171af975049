//! Oklab: B. Ottosson, "A perceptual color space for image processing", 2020.

use crate::color::convert::{Matrix, apply};

/// XYZ (D65, Y = 1 at white) to cone responses.
pub const XYZ_TO_LMS: Matrix = [
    [0.818_933_010_1, 0.361_866_742_4, -0.128_859_713_7],
    [0.032_984_543_6, 0.929_311_871_5, 0.036_145_638_7],
    [0.048_200_301_8, 0.264_366_269_1, 0.633_851_707_0],
];

/// Cube roots of the responses to L, a, b.
pub(super) const ROOTS_TO_LAB: Matrix = [
    [0.210_454_255_3, 0.793_617_785_0, -0.004_072_046_8],
    [1.977_998_495_1, -2.428_592_205_0, 0.450_593_709_9],
    [0.025_904_037_1, 0.782_771_766_2, -0.808_675_766_0],
];

/// Lightness L (1 at white), a and b of cone responses. Light times `k` has L, a and b times the cube root of `k`: hue and saturation stay.
pub fn oklab_of_lms(lms: [f64; 3]) -> [f64; 3] {
    apply(&ROOTS_TO_LAB, lms.map(f64::cbrt))
}

/// Lightness, a and b of XYZ (D65, Y = 1 at white).
pub fn oklab_of_xyz(xyz: [f64; 3]) -> [f64; 3] {
    oklab_of_lms(apply(&XYZ_TO_LMS, xyz))
}

/// Hue of a colour, degrees within [0, 360).
pub fn hue_degrees([_, a, b]: [f64; 3]) -> f64 {
    b.atan2(a).to_degrees().rem_euclid(360.0)
}

/// Chroma over lightness.
pub fn saturation([l, a, b]: [f64; 3]) -> f64 {
    a.hypot(b) / l
}
