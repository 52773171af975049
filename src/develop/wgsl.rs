//! Numbers as constants of WGSL, with all their digits.

use crate::color::convert::Matrix;
use crate::color::space::Transfer;

pub fn number(name: &str, v: f64) -> String {
    format!("const {name}: f32 = {v:?};\n")
}

pub fn count(name: &str, n: usize) -> String {
    format!("const {name} = {n}u;\n")
}

pub fn array<const N: usize>(name: &str, v: &[f64; N]) -> String {
    format!("const {name} = array<f32, {N}>({});\n", list(v))
}

pub fn vector(name: &str, v: [f64; 3]) -> String {
    format!("const {name} = vec3f({});\n", list(&v))
}

pub fn matrix(name: &str, m: &Matrix) -> String {
    // Column by column.
    let values: [f64; 9] = std::array::from_fn(|i| m[i % 3][i / 3]);
    format!("const {name} = mat3x3f({});\n", list(&values))
}

fn list(values: &[f64]) -> String {
    values.iter().map(|v| format!("{v:?}")).collect::<Vec<_>>().join(", ")
}

/// Names and values of the numbers of [`Transfer::encode`].
pub fn transfer(t: &Transfer) -> String {
    [
        number("TRANSFER_EXPONENT", 1.0 / t.gamma),
        number("TRANSFER_ALPHA", t.alpha),
        number("TRANSFER_SLOPE", t.slope),
        number("TRANSFER_FROM", t.from),
    ]
    .concat()
}
