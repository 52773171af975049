//! Matrices, XYZ and sRGB.

use super::cie::xyz_of_xy;
use super::space::Space;
use std::sync::LazyLock;

/// A 3 by 3 matrix of rows.
pub type Matrix = [[f64; 3]; 3];

/// Linear sRGB to XYZ, derived from the primaries and white; RGB (1, 1, 1) has Y = 1.
pub static RGB_TO_XYZ: LazyLock<Matrix> = LazyLock::new(|| Space::Srgb.to_xyz());

/// XYZ to linear sRGB, the inverse of [`RGB_TO_XYZ`].
pub static XYZ_TO_RGB: LazyLock<Matrix> = LazyLock::new(|| Space::Srgb.from_xyz());

/// Linear RGB to XYZ of the space with these chromaticities of R, G, B and of white, which has Y = 1.
pub fn primaries_to_xyz(primaries: [[f64; 2]; 3], white: [f64; 2]) -> Matrix {
    let columns = primaries.map(xyz_of_xy);
    let m = std::array::from_fn(|row| std::array::from_fn(|col| columns[col][row]));
    let scale = apply(&regular_inverse(&m), xyz_of_xy(white));
    m.map(|row| std::array::from_fn(|col| row[col] * scale[col]))
}

/// Linear sRGB of XYZ (Y = 1 at white); components lie outside [0, 1] for colours outside the gamut.
pub fn linear_srgb_of_xyz(xyz: [f64; 3]) -> [f64; 3] {
    apply(&XYZ_TO_RGB, xyz)
}

/// XYZ (Y = 1 at white) of linear sRGB.
pub fn xyz_of_linear_srgb(rgb: [f64; 3]) -> [f64; 3] {
    apply(&RGB_TO_XYZ, rgb)
}

/// Linear to encoded sRGB component (IEC 61966-2-1), odd for negative values.
pub fn srgb_encode(v: f64) -> f64 {
    let a = v.abs();
    let e = if a <= 0.003_130_8 { 12.92 * a } else { 1.055 * a.powf(1.0 / 2.4) - 0.055 };
    e.copysign(v)
}

/// Encoded to linear sRGB component (IEC 61966-2-1), odd for negative values.
pub fn srgb_decode(v: f64) -> f64 {
    let a = v.abs();
    let l = if a <= 0.040_45 { a / 12.92 } else { ((a + 0.055) / 1.055).powf(2.4) };
    l.copysign(v)
}

/// Matrix times column.
pub fn apply(m: &Matrix, v: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// Product `a b`: `b` is applied first.
pub fn multiply(a: &Matrix, b: &Matrix) -> Matrix {
    a.map(|row| std::array::from_fn(|col| row[0] * b[0][col] + row[1] * b[1][col] + row[2] * b[2][col]))
}

/// Inverse of a matrix of a colour space or of cone responses, whose columns lie in no plane.
pub(super) fn regular_inverse(m: &Matrix) -> Matrix {
    inverse(m).expect("the primaries of a colour space span a triangle")
}

/// Inverse by cofactors; `None` if the determinant is 0 or not finite.
pub fn inverse(m: &Matrix) -> Option<Matrix> {
    let cofactor = |r: usize, c: usize| {
        let (r1, r2, c1, c2) = ((r + 1) % 3, (r + 2) % 3, (c + 1) % 3, (c + 2) % 3);
        m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1]
    };
    let det: f64 = (0..3).map(|c| m[0][c] * cofactor(0, c)).sum();
    (det != 0.0 && det.is_finite()).then(|| std::array::from_fn(|r| std::array::from_fn(|c| cofactor(c, r) / det)))
}
