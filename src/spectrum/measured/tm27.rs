//! ANSI/IES TM-27 spectral data in XML (`.spdx`): `SpectralData` elements with a wavelength in nm.

use super::Series;
use roxmltree::Document;

/// One series for each `SpectralDistribution`, named by its `SpectralQuantity`.
pub(super) fn read(text: &str) -> Result<Vec<Series>, String> {
    let document = Document::parse(text).map_err(|e| format!("this is no XML: {e}"))?;
    let named = |name: &'static str| move |node: &roxmltree::Node| node.has_tag_name(name) || node.tag_name().name() == name;
    let distributions = document.descendants().filter(named("SpectralDistribution"));
    let series = |distribution: roxmltree::Node| {
        let line = |node: &roxmltree::Node| document.text_pos_at(node.range().start).row as usize;
        let point = |node: roxmltree::Node| {
            let wavelength = node.attribute("wavelength").and_then(|w| w.trim().parse().ok());
            let value = node.text().and_then(|t| t.trim().parse().ok());
            match (wavelength, value) {
                (Some(nm), Some(value)) => Ok((line(&node), nm, value)),
                _ => Err(format!("line {}: this is not a wavelength and a value", line(&node))),
            }
        };
        let points = distribution.descendants().filter(named("SpectralData")).map(point).collect::<Result<_, _>>()?;
        let quantity = distribution.descendants().find(named("SpectralQuantity"));
        Series::new(quantity.and_then(|q| q.text()).unwrap_or("spectrum").trim(), points)
    };
    distributions.map(series).collect()
}
