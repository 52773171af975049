//! Dominant wavelengths and colour temperatures against colour-science 0.4.7 (whole wavelengths; Ohno's method) and by construction.

use abbe::color::chromaticity::{correlated_color_temperature, dominant_wavelength};
use abbe::color::cie::{xy, xyz_of};
use abbe::spectrum::Spectrum;
use abbe::spectrum::library::Observer;

fn xy_of(spectrum: &Spectrum) -> [f64; 2] {
    xy(xyz_of(spectrum, Observer::Cie1931))
}

#[test]
fn dominant_wavelengths_are_those_of_others() {
    for (xy, nm, complementary, purity) in [
        ([0.44757, 0.40745], 583.0, false, 0.56647),
        ([0.31272, 0.32903], 489.0, false, 0.07275),
        ([0.2, 0.3], 488.0, false, 0.47488),
        ([0.5, 0.4], 589.0, false, 0.70133),
        ([0.3, 0.6], 548.0, false, 0.71599),
        ([0.4, 0.2], 521.0, true, 0.64529),
        ([0.55, 0.25], 497.0, true, 0.72287),
    ] {
        let d = dominant_wavelength(xy).unwrap();
        assert!((d.nm - nm).abs() < 0.7 && d.complementary == complementary && (d.purity - purity).abs() < 3e-3, "{xy:?}: {d:?}");
    }
    assert_eq!(dominant_wavelength([1.0 / 3.0, 1.0 / 3.0]), None);
    assert_eq!(dominant_wavelength([0.3335, 0.334]), None);
}

#[test]
fn a_line_is_its_own_dominant_wavelength() {
    for nm in [420.0, 470.5, 520.0, 555.0, 589.3, 650.0] {
        let d = dominant_wavelength(xy_of(&Spectrum::Band { center_nm: nm, width_nm: 0.1, height: 1.0 })).unwrap();
        assert!((d.nm - nm).abs() < 0.1 && !d.complementary && d.purity > 0.999, "{nm} nm: {d:?}");
    }
}

#[test]
fn colour_temperatures_are_those_of_others() {
    for (xy, kelvin, duv) in [
        ([0.44757, 0.40745], 2855.64, 3.9e-6),
        ([0.31272, 0.32903], 6503.0, 3.212e-3),
        ([0.5, 0.4], 2151.5, -4.917e-3),
        ([0.38, 0.38], 4035.7, 1.646e-3),
        ([0.28, 0.29], 9972.4, 1.301e-3),
    ] {
        let (found, off) = correlated_color_temperature(xy).unwrap();
        assert!((found / kelvin - 1.0).abs() < 1e-3 && (off - duv).abs() < 2e-5, "{xy:?}: {found} K, {off}");
    }
    for kelvin in [1200.0, 2700.0, 20_000.0] {
        let (found, duv) = correlated_color_temperature(xy_of(&Spectrum::Blackbody { kelvin, scale: 3.0 })).unwrap();
        assert!((found / kelvin - 1.0).abs() < 1e-5 && duv.abs() < 1e-7, "{kelvin} K: {found} K, {duv}");
    }
}

#[test]
fn what_is_no_white_has_no_colour_temperature() {
    // Green, purple and blue beyond the locus' end; a blackbody that hardly glows.
    for xy in [[0.3, 0.6], [0.4, 0.2], [0.15, 0.06], [0.7, 0.29]] {
        assert_eq!(correlated_color_temperature(xy), None, "{xy:?}");
    }
}
