//! What the page draws its diagrams from: all glasses with index and Abbe number, and the colours of the visible.

use super::look;
use crate::color::chromaticity::color_of_wavelength;
use crate::color::cie::xy;
use crate::color::space::{D65, Space};
use crate::spectrum::library::{self, Observer};
use crate::spectrum::{LINE_C_NM, LINE_D_NM, LINE_F_NM};
use serde_json::{Value, json};
use std::sync::OnceLock;

/// Name, n_d and V_d of every glass whose data reach over the lines F, d and C.
pub fn glasses() -> &'static Value {
    static ALL: OnceLock<Value> = OnceLock::new();
    ALL.get_or_init(|| {
        let of = |name: &str| {
            let ior = library::glass(name)?;
            let is_known = [LINE_F_NM, LINE_D_NM, LINE_C_NM].iter().all(|nm| (ior.range_nm.0..=ior.range_nm.1).contains(nm));
            let (nd, vd) = (ior.eval(LINE_D_NM), ior.vd());
            let round = |v: f64, digits: f64| (v * digits).round() / digits;
            (is_known && vd.is_finite()).then(|| json!([name, round(nd, 1e5), round(vd, 100.0)]))
        };
        Value::Array(library::glass_names().into_iter().filter_map(of).collect())
    })
}

/// One glass: its index over the visible, and where that comes from.
pub fn glass(name: &str) -> Option<Value> {
    let known = library::glass_name(name)?;
    let ior = library::glass(known)?;
    let (lo, hi) = (ior.range_nm.0.max(380.0), ior.range_nm.1.min(780.0));
    let points: Vec<[f64; 2]> = (0..=40).map(|i| lo + (hi - lo) * f64::from(i) / 40.0).map(|nm| [nm, ior.eval(nm)]).collect();
    let head = library::glass_head(known).unwrap_or_default();
    let said = |word: &str| head.iter().find(|(w, _)| w == word).map(|(_, text)| text.clone());
    Some(
        json!({"name": known, "n": points, "nd": ior.eval(LINE_D_NM), "vd": ior.vd(), "range": [ior.range_nm.0, ior.range_nm.1], "source": said("source")}),
    )
}

/// What a page offers: names of views and settings, illuminants and metals; and what its diagrams of colours have: the spectral locus, the colours along it
/// and the triangle of sRGB.
pub fn choices() -> Value {
    let cmf = library::observer(Observer::Cie1931);
    let locus: Vec<Value> = (380..=700)
        .step_by(5)
        .map(|nm| {
            let [x, y] = xy(cmf.eval(f64::from(nm)));
            json!([nm, x, y])
        })
        .collect();
    let visible: Vec<Value> = (360..=830)
        .step_by(5)
        .map(|nm| {
            let [r, g, b] = color_of_wavelength(f64::from(nm));
            json!([nm, format!("#{r:02x}{g:02x}{b:02x}")])
        })
        .collect();
    json!({"look": look::choices(), "locus": locus, "visible": visible, "srgb": Space::Srgb.primaries(), "white": D65, "illuminants": library::illuminant_names(), "metals": library::metal_names()})
}
