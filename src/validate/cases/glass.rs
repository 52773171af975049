//! Indices of refraction, of which nothing is rendered, and what glass lets through.

use super::{LINES, all_bins, film};
use crate::film::Film;
use crate::spectrum::{Ior, LINE_C_NM, LINE_F_NM, library};
use crate::validate::{Case, Row, View};
use serde_json::{Value, json};

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
    let mut cases = vec![
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
    ];
    cases.extend(tinted());
    cases
}

/// Tinted and absorbing glass of index 1.5 before an even sky of radiance 1, seen along an axis or at 45 degrees.
fn tinted() -> [Case; 3] {
    let (tint, share): (Value, [f64; 2]) = (json!([[400, 0.3], [549.9, 0.3], [550.1, 0.6], [700, 0.6]]), [0.3, 0.6]);
    let case = |id: &'static str, title, material: Value, shapes: Value, eye: [f64; 3], exact: &dyn Fn(f64) -> f64| {
        let scene = json!({
            "film": film(4, 4, 2),
            "camera": {"orthographic": {"eye": eye, "target": [0, 0, 0], "height": 1e-3}},
            "materials": {"m": material},
            "shapes": shapes,
            "lights": [{"constant": {"radiance": 1}}],
        });
        let rows = share.iter().enumerate().map(|(bin, &t)| {
            let row = Row::new(format!("{id}/{bin}"), exact(t), 2e-3, move |f: &[Film]| vec![all_bins(&f[0])[bin]]);
            row.floor(2e-4)
        });
        Case { id, title, views: vec![View::new(scene, 1024)], rows: rows.collect() }
    };
    let pane = |z: f64| json!({"disc": {"center": [0, 0, z], "normal": [0, 0, 1], "radius": 9}, "material": "m"});
    // At normal incidence a face reflects 0.04; all bounces of a pane of such faces; at 45 degrees by Fresnel's equations.
    let (face, both): (f64, f64) = (0.04, 0.08 / 1.04);
    let cos_t = (1.0 - 0.5 / 2.25f64).sqrt();
    let squares = |a: f64, b: f64| ((a - b) / (a + b)).powi(2);
    let slanted = 0.5 * (squares(0.5f64.sqrt(), 1.5 * cos_t) + squares(1.5 * 0.5f64.sqrt(), cos_t));
    [
        case(
            "tinted-panes",
            "two tinted panes one behind the other: the square of the tint, and what is reflected to and fro between them",
            json!({"thin_dielectric": {"ior": 1.5, "tint": tint}}),
            json!([pane(0.0), pane(-1.0)]),
            [0.0, 0.0, 5.0],
            &|t| {
                let through = t * (1.0 - both);
                // From between the panes a way ends outside after each further reflection or passage.
                both + through * (through + both * through) / (1.0 - both * both)
            },
        ),
        case(
            "absorbing-pane",
            "a pane that absorbs, seen at 45 degrees: Beer-Lambert along the way within, by all inner bounces",
            json!({"thin_dielectric": {"ior": 1.5, "absorption": {"color": tint, "distance": 0.01}, "thickness": 0.02}}),
            json!([pane(0.0)]),
            [5.0, 0.0, 5.0],
            &|t| {
                let way = t.powf(2.0 / cos_t);
                let through = (1.0 - slanted).powi(2) * way / (1.0 - (slanted * way).powi(2));
                slanted + through * slanted * way + through
            },
        ),
        case(
            "tinted-ball",
            "a ball of glass whose surface is tinted, seen in its middle: a factor at each crossing",
            json!({"dielectric": {"ior": 1.5, "tint": tint}}),
            json!([{"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "m"}]),
            [0.0, 0.0, 5.0],
            &|t| face + t * t * (1.0 - face).powi(2) / (1.0 - face),
        ),
    ]
}
