//! Amounts of light and spectra, against values computed by hand.

use crate::{load_text, scene_with, with_shapes};
use abbe::scene::{Light, Material, Scene, Texture};
use abbe::spectrum::Spectrum;
use std::f64::consts::PI;

/// 683.002 lm/W times the integral of the CIE 1931 y over 360 to 830 nm (1 nm sums of CIE 018:2019): the luminance of the constant 1.
const UNIT: f64 = 683.002 * 106.856_917;
const AREA: f64 = 4.0 * PI;

fn near(a: f64, b: f64) {
    assert!((a - b).abs() <= 1e-5 * b.abs(), "{a} is not {b}");
}

fn lamp(radiance: &str, two_sided: bool) -> f64 {
    let scene = with_shapes(&format!(
        r#"[{{"sphere": {{"center": [0,0,0], "radius": 1}}, "emission": {{"radiance": {radiance}, "two_sided": {two_sided}}}}}]"#
    ));
    scene.shapes[0].emission.as_ref().unwrap().radiance.average(550.0)
}

fn light(text: &str) -> Light {
    let scene = load_text(&scene_with("lights", &format!("[{text}]"))).unwrap_or_else(|e| panic!("{e}"));
    scene.lights.into_iter().next().unwrap()
}

fn amount(light: &Light) -> f64 {
    match light {
        Light::Point { intensity, .. } | Light::Spot { intensity, .. } | Light::Profile { intensity, .. } => {
            intensity.eval(550.0)
        }
        Light::Beam { irradiance, .. } | Light::Sun { irradiance, .. } => irradiance.eval(550.0),
        Light::Constant { radiance } => radiance.eval(550.0),
        Light::Image(_) => panic!("an image has no amount"),
    }
}

#[test]
fn lamps_take_candela_per_square_metre_lumen_and_watt() {
    near(lamp("2.5", false), 2.5);
    near(lamp(r#"{"spectrum": 3, "luminance_cd_m2": 1000}"#, false), 1000.0 / UNIT);
    near(lamp(r#"{"spectrum": 3, "luminous_flux_lm": 800}"#, false), 800.0 / (PI * AREA * UNIT));
    near(lamp(r#"{"spectrum": 3, "luminous_flux_lm": 800}"#, true), 800.0 / (2.0 * PI * AREA * UNIT));
    near(lamp(r#"{"spectrum": 3, "power_W": 60}"#, false), 60.0 / (PI * AREA * 400.0));
}

#[test]
fn a_transformed_lamp_of_several_parts_shares_its_flux() {
    let scene = with_shapes(
        r#"[{"cylinder": {"base": [0,0,0], "top": [0,3,0], "radius": 1, "capped": true}, "transform": {"scale": 2},
             "emission": {"radiance": {"spectrum": 1, "power_W": 10}}}]"#,
    );
    assert_eq!(scene.shapes.len(), 3);
    let area = 2.0 * PI * 2.0 * 6.0 + 2.0 * PI * 4.0;
    for shape in &scene.shapes {
        near(shape.emission.as_ref().unwrap().radiance.average(500.0), 10.0 / (PI * area * 400.0));
    }
}

#[test]
fn points_and_spots_take_candela_lumen_and_watt() {
    let point = |v: &str| amount(&light(&format!(r#"{{"point": {{"position": [0,0,0], "intensity": {v}}}}}"#)));
    near(point(r#"{"spectrum": 2, "luminous_intensity_cd": 100}"#), 100.0 / UNIT);
    near(point(r#"{"spectrum": 2, "luminous_flux_lm": 100}"#), 100.0 / (4.0 * PI * UNIT));
    near(point(r#"{"spectrum": 2, "power_W": 100}"#), 100.0 / (4.0 * PI * 400.0));
    let spot = light(
        r#"{"spot": {"position": [0,0,0], "direction": [0,-3,0], "inner_deg": 0, "outer_deg": 60,
            "intensity": {"spectrum": 2, "luminous_flux_lm": 100}}}"#,
    );
    // Smoothstep from cos 0 = 1 to cos 60 = 1/2 counts half of that cap: 2 pi (1 - 3/4).
    near(amount(&spot), 100.0 / (0.5 * PI * UNIT));
    let Light::Spot { direction, cos_outer, .. } = spot else { panic!("not a spot") };
    near(direction.y, -1.0);
    near(cos_outer, 0.5);
}

#[test]
fn beams_suns_lasers_and_skies_take_lux_and_watt() {
    let beam = |v: &str| {
        amount(&light(&format!(r#"{{"beam": {{"origin": [0,0,0], "direction": [1,0,0], "radius": 0.5, "irradiance": {v}}}}}"#)))
    };
    near(beam(r#"{"spectrum": 2, "illuminance_lx": 100}"#), 100.0 / UNIT);
    near(beam(r#"{"spectrum": 2, "irradiance_W_m2": 100}"#), 100.0 / 400.0);
    near(beam(r#"{"spectrum": 2, "power_W": 100}"#), 100.0 / (400.0 * PI * 0.25));
    near(beam(r#"{"spectrum": 2, "luminous_flux_lm": 100}"#), 100.0 / (UNIT * PI * 0.25));
    let sun = light(r#"{"sun": {"direction": [0,-1,0], "angle_deg": 90, "irradiance": {"spectrum": 2, "illuminance_lx": 1e5}}}"#);
    near(amount(&sun), 1e5 / UNIT);
    let Light::Sun { cos_angle, .. } = sun else { panic!("not a sun") };
    near(cos_angle, 0.5f64.sqrt());
    near(amount(&light(r#"{"constant": {"radiance": {"spectrum": 2, "illuminance_lx": 100}}}"#)), 100.0 / (PI * UNIT));
    near(amount(&light(r#"{"constant": {"radiance": {"spectrum": 2, "luminance_cd_m2": 100}}}"#)), 100.0 / UNIT);
    let laser = light(
        r#"{"laser": {"origin": [0,0,0], "direction": [1,0,0], "radius": 0.001, "power_W": 0.005, "wavelength_nm": 632.8}}"#,
    );
    let Light::Beam { irradiance, .. } = laser else { panic!("not a beam") };
    near(irradiance.eval(632.8), 0.005 / (PI * 1e-6) / 0.1);
    assert_eq!((irradiance.eval(632.7), irradiance.eval(632.9)), (0.0, 0.0));
}

fn reflectance(text: &str) -> Spectrum {
    let text = scene_with("materials", &format!(r#"{{"m": {{"diffuse": {{"reflectance": {text}}}}}}}"#));
    let scene: Scene = load_text(&text).unwrap_or_else(|e| panic!("{e}"));
    let Material::Diffuse { reflectance: Texture::Uniform(reflectance) } = scene.materials[0].clone() else {
        panic!("not diffuse")
    };
    reflectance
}

#[test]
fn spectra_are_what_they_say() {
    near(reflectance("[[400, 0.2], [500, 0.4]]").eval(450.0), 0.3);
    near(reflectance("[[400, 0.2], [500, 0.4]]").eval(700.0), 0.4); // reflectances hold their ends
    near(reflectance(r#"{"file": "ramp.csv"}"#).eval(700.0), 0.2);
    near(reflectance(r#"{"band": {"nm": 500, "width": 10, "value": 0.5}, "scale": 0.5}"#).eval(504.0), 0.25);
    near(reflectance(r#"{"srgb": [0.5, 0.5, 0.5]}"#).eval(600.0), 0.214_041_14);
    near(reflectance(r#"{"linear_rgb": [0.5, 0.5, 0.5]}"#).eval(600.0), 0.5);
    assert_eq!(lamp("[[540, 1], [545, 1]]", false), 0.0); // light ends where its table does
    near(lamp(r#"{"illuminant": "D65", "scale": 2}"#, false), 2.0 * 104.046 / 100.0);
    near(lamp(r#"{"line": {"nm": 550, "width": 0.5, "power": 3}}"#, false), 6.0);
}

fn index(text: &str, nm: f64) -> f64 {
    let text = scene_with("materials", &format!(r#"{{"m": {{"dielectric": {{"ior": {text}}}}}}}"#));
    let scene = load_text(&text).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(scene.interiors[1].priority, 1);
    scene.interiors[1].ior.eval(nm)
}

#[test]
fn indices_are_what_they_say() {
    near(index("1.5", 500.0), 1.5);
    near(index("\"N-BK7\"", 587.5618), 1.516_80);
    near(index(r#"{"nd": 1.5168, "abbe": 64.17}"#, 587.5618), 1.5168);
    near(index(r#"{"cauchy": [1.5, 0.005]}"#, 500.0), 1.52);
    near(index(r#"{"table": [[300, 1.6], [800, 1.5]]}"#, 550.0), 1.55);
    near(index(r#"{"sellmeier": {"b": [1.25], "c_um2": [0]}}"#, 550.0), 1.5);
}

#[test]
fn extrapolated_glass_is_said() {
    let materials = r#"{"m": {"dielectric": {"ior": {"cauchy": [1.5], "range_nm": [400, 700], "extrapolate": true}}}}"#;
    let scene = load_text(&scene_with("materials", materials)).unwrap();
    assert!(scene.notes.len() == 1 && scene.notes[0].contains("400 to 700"), "{:?}", scene.notes);
}

#[test]
fn light_beyond_single_precision_is_refused_where_it_stands() {
    let scene = |lights: &str, emission: &str| {
        format!(
            r#"{{"film": {{"width": 2, "height": 2, "bins": 2}},
            "camera": {{"orthographic": {{"eye": [0, 0, 5], "target": [0, 0, 0], "height": 1}}}},
            "materials": {{"m": {{"diffuse": {{"reflectance": 0.5}}}}}},
            "shapes": [{{"sphere": {{"center": [0, 0, 0], "radius": 1}}, "material": "m"{emission}}}], "lights": [{lights}]}}"#
        )
    };
    let load =
        |text: &str| abbe::scene::load_str(text, std::path::Path::new("s.json"), std::path::Path::new("."), &Default::default());
    let beam = r#""origin": [0, 5, 0], "direction": [0, -1, 0], "radius": 1"#;
    for (amount, problem) in
        [("1e33", "too bright"), ("1e60", "too bright"), ("1e300", "too bright"), ("1e-40", "too dark"), ("1e-300", "too dark")]
    {
        let lights = [
            format!(r#"{{"point": {{"position": [0, 3, 0], "intensity": {amount}}}}}"#),
            format!(r#"{{"point": {{"position": [0, 3, 0], "intensity": {{"spectrum": 1, "luminous_flux_lm": {amount}}}}}}}"#),
            format!(
                r#"{{"spot": {{"position": [0, 3, 0], "direction": [0, -1, 0], "outer_deg": 20, "intensity": [[300, 0], [500, {amount}], [900, 0]]}}}}"#
            ),
            format!(r#"{{"beam": {{{beam}, "irradiance": {{"blackbody": 5000, "scale": {amount}}}}}}}"#),
            format!(r#"{{"laser": {{{beam}, "wavelength_nm": 532, "power_W": {amount}}}}}"#),
            format!(r#"{{"sun": {{"direction": [0, -1, 0], "irradiance": {amount}}}}}"#),
            format!(r#"{{"constant": {{"radiance": {amount}}}}}"#),
        ];
        for light in lights {
            let error = load(&scene(&light, "")).expect_err(&light).to_string();
            assert!(error.contains("$.lights[0]") && error.contains(problem), "{light}: {error}");
        }
        let emission = format!(r#", "emission": {{"radiance": {amount}}}"#);
        let error = load(&scene("", &emission)).expect_err(amount).to_string();
        assert!(error.contains("$.shapes[0].emission") && error.contains(problem), "{error}");
    }
    for amount in ["0", "1e-18", "1e18"] {
        load(&scene(&format!(r#"{{"constant": {{"radiance": {amount}}}}}"#), "")).expect(amount);
    }
}
