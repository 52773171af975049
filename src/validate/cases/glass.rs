//! Indices of refraction: nothing is rendered.

use super::LINES;
use crate::spectrum::{Ior, LINE_C_NM, LINE_F_NM, library};
use crate::validate::{Case, Row};

/// Half of the sixth decimal, which the published indices end with.
const SIXTH: f64 = 5.001e-7;

fn number(id: impl Into<String>, exact: f64, floor: f64, value: f64) -> Row {
    Row::new(id, exact, 0.0, move |_| vec![value]).floor(floor)
}

/// Indices at F, d and C, and V_d, as published; those not given are left out.
fn indices(name: &str, n: [Option<f64>; 3], vd: f64) -> Vec<Row> {
    // The name is one of the library's: an unknown one is NaN in every row.
    let ior = library::glass(name).unwrap_or(Ior::constant(f64::NAN));
    let id = name.to_lowercase().replace(' ', "-");
    let rows = LINES.iter().zip(n).filter_map(|((line, nm), n)| Some((line, nm, n?)));
    let mut rows: Vec<Row> = rows.map(|(line, nm, n)| number(format!("glass/{id}/n_{line}"), n, SIXTH, ior.eval(*nm))).collect();
    rows.push(number(format!("glass/{id}/v_d"), vd, 5.001e-3, ior.vd()));
    rows
}

fn khr(nm: f64) -> f64 {
    let (nd, vd) = (1.5168, 64.17);
    nd + (nd - 1.0) / vd * (523_655.0 / (nm * nm) - 1.5168)
}

pub(super) fn cases() -> Vec<Case> {
    let fit = |terms| library::glass("SF10").map_or(f64::NAN, |ior| ior.cauchy_fit(terms, 380.0, 780.0).1);
    let abbe = Ior::from_abbe_number(1.5168, 64.17);
    let bk7 = library::glass("N-BK7").unwrap_or(Ior::constant(f64::NAN));
    let mut glass = indices("N-BK7", [Some(1.522376), Some(1.516800), Some(1.514322)], 64.17);
    glass.extend(indices("N-SF11", [None, Some(1.784720), None], 25.68));
    glass.extend(indices("silica", [None, Some(1.458464), None], 67.82));
    vec![
        Case { id: "glass", title: "Sellmeier indices and Abbe numbers of catalogue glasses", views: vec![], rows: glass },
        Case {
            id: "cauchy",
            title: "greatest error of Cauchy formulas fitted to SF10 over 380-780 nm, two and three terms",
            views: vec![],
            rows: vec![number("cauchy/two-terms", 4e-3, 5e-4, fit(2)), number("cauchy/three-terms", 6e-4, 5e-5, fit(3))],
        },
        Case {
            id: "khr-dispersion",
            title: "index from n_d and V_d, as glTF's KHR_materials_dispersion has it, and N-BK7 by it",
            views: vec![],
            rows: vec![
                number("khr-dispersion/formula-F", khr(LINE_F_NM), 1e-12, abbe.eval(LINE_F_NM)),
                number("khr-dispersion/formula-C", khr(LINE_C_NM), 1e-12, abbe.eval(LINE_C_NM)),
                number("khr-dispersion/bk7-F", 1.522376, 6e-5, abbe.eval(LINE_F_NM)),
                number("khr-dispersion/bk7-C", bk7.eval(LINE_C_NM), 6e-5, abbe.eval(LINE_C_NM)),
            ],
        },
    ]
}
