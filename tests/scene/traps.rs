//! What people get wrong without any message from the scene's grammar: units, signs, and things that stand where they are of no use.

use crate::advice::{is_silent, scene, warns};
use crate::{load_text, scene_with};
use abbe::scene::{Scene, advice};
use serde_json::{Value, json};
use std::f64::consts::{FRAC_PI_2, PI};

/// The line about the scene whose `key` is `value` and which cannot be read.
fn refusal(key: &str, value: &Value) -> String {
    match load_text(&scene_with(key, &value.to_string())) {
        Ok(_) => panic!("{key}: {value} was read"),
        Err(e) => e.to_string(),
    }
}

/// The notes and the warnings of the loader.
fn remarks(more: &[(&str, Value)]) -> (Vec<String>, Vec<String>) {
    let mut text: Value = serde_json::from_str(&scene_with("lights", r#"[{"constant": {"radiance": 1}}]"#)).unwrap();
    more.iter().for_each(|(key, value)| text[*key] = value.clone());
    let scene = load_text(&text.to_string()).unwrap_or_else(|e| panic!("{e}"));
    assert!(scene.warnings.iter().all(|w| advice(&scene).contains(w)), "{:?} not among the advice", scene.warnings);
    (scene.notes, scene.warnings)
}

fn material(value: Value) -> Value {
    json!({"m": value})
}

#[test]
fn films_that_are_not_given_in_nm_are_refused() {
    let pane = |thickness: f64| material(json!({"thin_dielectric": {"ior": 1.5, "thickness": thickness}}));
    let film = |thickness: f64| material(json!({"dielectric": {"ior": 1.5, "thin_film": {"ior": 1.33, "thickness": thickness}}}));
    // In m, mm, um, and a pane of 4 mm in nm.
    for thickness in [4e-3, 3e-7, 3e-4, 0.3, -300.0, 4e6] {
        for (value, path) in
            [(pane(thickness), "$.materials.m.thin_dielectric.thickness"), (film(thickness), "thin_film.thickness")]
        {
            let line = refusal("materials", &value);
            assert!(line.contains(path) && line.contains("thickness is in nm") && line.contains("leave it out"), "{line}");
        }
    }
    for thickness in [0.0, 5.0, 300.0, 10_000.0] {
        assert_eq!(remarks(&[("materials", film(thickness))]), (vec![], vec![]));
    }
    let (_, warnings) = remarks(&[("materials", film(2.5))]);
    assert!(warnings.len() == 1 && warnings[0].contains("thin_film.thickness") && warnings[0].contains("2500"), "{warnings:?}");
}

#[test]
fn wavelengths_in_other_units_are_refused_wherever_they_stand() {
    let um = json!([[0.4, 0.5], [0.7, 0.6]]);
    let index = json!([[0.4, 1.53], [0.7, 1.51]]);
    let point = |intensity: Value| json!([{"point": {"position": [0, 3, 0], "intensity": intensity}}]);
    let laser = |nm: f64| json!([{"laser": {"origin": [0, 3, 0], "direction": [0, -1, 0], "radius": 1e-3, "power_W": 1, "wavelength_nm": nm}}]);
    let metal = |eta: Value, k: Value| material(json!({"conductor": {"eta": eta, "k": k}}));
    let nm = json!([[400, 1.5], [700, 0.5]]);
    let glass = |ior: Value| material(json!({"dielectric": {"ior": ior}}));
    let places = [
        ("film", json!({"range_nm": [0.38, 0.78]}), "$.film.range_nm", "micrometres"),
        ("film", json!({"range_nm": [3.8e-7, 7.8e-7]}), "$.film.range_nm", "metres"),
        ("film", json!({"range_nm": [3800, 7800]}), "$.film.range_nm", "angstroms"),
        ("materials", material(json!({"diffuse": {"reflectance": um}})), "diffuse.reflectance", "micrometres"),
        (
            "materials",
            material(json!({"diffuse": {"reflectance": [[4000, 0.5], [7000, 0.5]]}})),
            "diffuse.reflectance",
            "angstroms",
        ),
        ("materials", glass(json!({"table": index})), "dielectric.ior.table", "micrometres"),
        ("materials", glass(json!({"table": index, "extrapolate": true})), "dielectric.ior.table", "micrometres"),
        // From the ultraviolet to the far infrared, as of water.
        ("materials", glass(json!({"table": [[0.2, 1.4], [200, 2.1]]})), "dielectric.ior.table", "micrometres"),
        ("materials", glass(json!({"cauchy": [1.5, 0.004], "range_nm": [0.38, 0.78]})), "dielectric.ior.range_nm", "micrometres"),
        ("materials", metal(um.clone(), nm.clone()), "conductor.eta", "micrometres"),
        ("materials", metal(nm, um.clone()), "conductor.k", "micrometres"),
        ("materials", material(json!({"dielectric": {"ior": 1.5, "absorption": um}})), "dielectric.absorption", "micrometres"),
        ("media", json!({"fog": {"sigma_s": um}}), "$.media.fog.sigma_s", "micrometres"),
        ("lights", point(um.clone()), "point.intensity", "micrometres"),
        ("lights", point(json!({"spectrum": um, "luminous_flux_lm": 100})), "point.intensity.spectrum", "micrometres"),
        ("lights", point(json!({"line": {"nm": 0.589}})), "point.intensity.line.nm", "micrometres"),
        ("lights", point(json!({"band": {"nm": 5.5e-7, "width": 10}})), "point.intensity.band.nm", "metres"),
        ("lights", laser(0.532), "laser.wavelength_nm", "micrometres"),
        ("lights", laser(1.064), "laser.wavelength_nm", "micrometres"),
        ("lights", laser(5320.0), "laser.wavelength_nm", "angstroms"),
    ];
    for (key, value, path, unit) in places {
        let line = refusal(key, &value);
        assert!(line.contains(path) && line.contains(&format!("like {unit};")) && line.contains("nm"), "{path}: {line}");
    }
}

#[test]
fn it_is_said_where_data_end_before_the_film_does() {
    let light = |radiance: Value| ("lights", json!([{"constant": {"radiance": radiance}}]));
    let film = |lo: f64, hi: f64| ("film", json!({"width": 8, "height": 8, "range_nm": [lo, hi]}));
    let notes = |more: &[(&str, Value)]| {
        let (notes, warnings) = remarks(more);
        assert!(warnings.is_empty(), "{warnings:?}");
        notes
    };
    let fluorescent = || light(json!({"illuminant": "FL11"}));
    assert!(notes(&[film(380.0, 780.0), fluorescent()]).is_empty());
    let said = notes(&[film(380.0, 1000.0), fluorescent()]);
    let parts = ["$.lights[0].constant.radiance", "known from 380 to 780 nm", "dark"];
    assert!(said.len() == 1 && parts.iter().all(|part| said[0].contains(part)), "{said:?}");
    // Once, whatever the unit is; and where it begins late.
    let bright = light(json!({"spectrum": {"illuminant": "FL11"}, "illuminance_lx": 100}));
    assert_eq!(notes(&[film(300.0, 700.0), bright]).len(), 1);
    // What has fallen to 0 is known to be dark.
    assert!(notes(&[light(json!([[440, 0], [460, 1], [480, 0]]))]).is_empty());
    assert_eq!(notes(&[light(json!([[440, 0], [460, 1]]))]).len(), 1);
    // Of measured data end values are taken; those that a scene writes are meant so.
    let copper = || ("materials", material(json!({"conductor": {"metal": "Cu"}})));
    assert!(notes(&[copper()]).is_empty());
    let said = notes(&[film(380.0, 2500.0), copper()]);
    assert!(said.len() == 1 && said[0].contains("conductor.metal") && said[0].contains("end values are taken"), "{said:?}");
    let paint = |nm: f64| ("materials", material(json!({"diffuse": {"reflectance": [[nm, 0.2], [nm + 50.0, 0.4]]}})));
    assert!(notes(&[paint(500.0)]).is_empty());
    assert!(notes(&[paint(900.0)])[0].contains("its end value is taken"));
    // Light that the film cannot see at all is a mistake.
    for radiance in [json!({"line": {"nm": 1064}}), json!([[800, 1], [900, 1]])] {
        let (_, warnings) = remarks(&[light(radiance)]);
        assert!(
            warnings.iter().any(|w| w.contains("$.lights[0]") && w.contains("nothing within the film's 380 to 780 nm; ")),
            "{warnings:?}"
        );
    }
}

/// B and C of N-BK7 by Schott's catalogue.
const B: [f64; 3] = [1.039_612_12, 0.231_792_344, 1.010_469_45];
const C: [f64; 3] = [0.006_000_698_67, 0.020_017_914_4, 103.560_653];

#[test]
fn coefficients_in_other_units_are_warned_of() {
    let glass = |ior: Value| remarks(&[("materials", material(json!({"dielectric": {"ior": ior}})))]).1;
    let sellmeier = |c: [f64; 3]| glass(json!({"sellmeier": {"b": B, "c_um2": c}}));
    assert!(sellmeier(C).is_empty());
    // In um, and in nm^2.
    for c in [C.map(f64::sqrt), C.map(|c| c * 1e6)] {
        let said = sellmeier(c);
        assert!(
            said.len() == 1
                && said[0].contains("$.materials.m.dielectric.ior")
                && said[0].contains("squares of wavelengths in um"),
            "{said:?}"
        );
    }
    // A pole within the film says so too: of N-SF11 it is at 250 nm.
    let line = refusal(
        "materials",
        &material(json!({"dielectric": {"ior": {"sellmeier": {"b": [1.7, 0.31, 1.9], "c_um2": [0.1157, 0.2496, 12.46]}}}})),
    );
    assert!(line.contains("pole") && line.contains("squares of wavelengths"), "{line}");
    let cauchy = |b: f64| json!({"cauchy": [1.5, b]});
    assert!(glass(cauchy(0.0042)).is_empty() && glass(cauchy(0.0)).is_empty());
    let said = glass(cauchy(4.2e-15));
    assert!(said.len() == 1 && said[0].contains("B/um^2"), "{said:?}");
    let line = refusal("materials", &material(json!({"dielectric": {"ior": cauchy(4200.0)}})));
    assert!(line.contains("divide a B that is given in nm^2 by 1e6"), "{line}");
    // Rising with wavelength, as nothing does that is clear; an Abbe number is meant as it is.
    assert_eq!(glass(json!({"table": [[380, 1.5], [780, 1.53]]})).len(), 1);
    assert!(glass(json!({"nd": 1.5, "abbe": 5})).is_empty() && glass(json!({"glass": "rutile", "extrapolate": true})).is_empty());
}

#[test]
fn angles_in_radians_are_suspected() {
    let camera = |vfov: f64| ("camera", json!({"perspective": {"eye": [0, 0, 5], "target": [0, 0, 0], "vfov_deg": vfov}}));
    let turned = |degrees: Value| {
        ("shapes", json!([{"box": {"min": [0, 0, 0], "max": [1, 1, 1]}, "material": "m", "transform": {"rotate_deg": degrees}}]))
    };
    assert_eq!(remarks(&[camera(40.0), turned(json!([90, 45, 3]))]).1, Vec::<String>::new());
    let turns = [
        (camera(0.7), "write 40.1"),
        (turned(json!([0, FRAC_PI_2, 0])), "write 90.0"),
        (turned(json!([0, 0, -PI])), "write -180.0"),
    ];
    for (value, says) in turns {
        let said = remarks(&[value]).1;
        assert!(said.len() == 1 && said[0].contains("_deg") && said[0].contains(says), "{said:?}");
    }
}

fn of_lights(lights: Value) -> Scene {
    scene(json!({"lights": lights}))
}

#[test]
fn beams_and_spots_that_meet_nothing_are_said() {
    let beam = |y: f64, radius: f64| {
        of_lights(json!([{"beam": {"origin": [9, 3, 0], "direction": [0, y, 0], "radius": radius, "irradiance": 1}}]))
    };
    let spot = |direction: [f64; 3], outer: f64| {
        of_lights(json!([{"spot": {"position": [0, 1.5, 0], "direction": direction, "outer_deg": outer, "intensity": 1}}]))
    };
    warns(&beam(-1.0, 1.0), &["the parallel beam at [9.000, 3.000, 0.000] meets nothing", "turn or move it"]);
    // Wide enough to touch the table's edge at x = 2.
    is_silent(&beam(-1.0, 7.5));
    warns(&beam(1.0, 8.0), &["meets nothing"]);
    warns(&spot([1.0, 0.0, 0.0], 20.0), &["the spot light", "meets nothing"]);
    is_silent(&spot([0.0, -1.0, 0.0], 20.0));
    // The lamp is far smaller than the steps between rays.
    let speck = json!({"shapes": [{"sphere": {"center": [100, 1.5, 0.5], "radius": 1e-3}, "material": "paper"}],
        "lights": [{"spot": {"position": [0, 1.5, 0], "direction": [1, 0, 0], "outer_deg": 20, "intensity": 1}}]});
    is_silent(&scene(speck));
    // Fog is lit everywhere; a sensor counts too.
    let away = json!([{"beam": {"origin": [9, 3, 0], "direction": [0, 1, 0], "radius": 1, "irradiance": 1}}]);
    is_silent(&scene(json!({"lights": away, "media": {"fog": {"sigma_s": 0.1}}, "surroundings": {"medium": "fog"}})));
    let plane = json!({"irradiance_plane": {"origin": [8, 4, -1], "edge_u": [2, 0, 0], "edge_v": [0, 0, 2]}});
    is_silent(&scene(json!({"lights": away, "camera": plane})));
}

#[test]
fn lights_in_closed_boxes_and_under_the_ground_are_said() {
    let boxed = |min: f64, lamp: f64| {
        scene(json!({"shapes": [{"name": "case", "box": {"min": [min, min, min], "max": [6, 6, 6]}, "material": "paper"}],
            "lights": [{"point": {"position": [lamp, lamp, lamp], "intensity": 1}}]}))
    };
    warns(&boxed(4.5, 5.0), &["the point light at [5.000, 5.000, 5.000] is shut in \"case\"", "move one of them"]);
    is_silent(&boxed(4.5, 4.0));
    // A room with the camera in it.
    is_silent(&boxed(-6.0, 1.0));
    let sun = |y: f64| of_lights(json!([{"sun": {"direction": [0.3, y, 0], "irradiance": 1}}]));
    warns(&sun(1.0), &["a sun shines upwards", "turn the signs"]);
    is_silent(&sun(-1.0));
    let laser = |radius: f64| {
        of_lights(
            json!([{"laser": {"origin": [0, 3, 0], "direction": [0, -1, 0], "radius": radius, "power_W": 1, "wavelength_nm": 532}}]),
        )
    };
    warns(&laser(1.0), &["$.lights[1].laser: a laser beam 2 m wide", "metres"]);
    is_silent(&laser(1e-3));
}

#[test]
fn sensors_that_see_nothing_are_said() {
    let camera = |eye: [f64; 3], target: [f64; 3]| json!({"perspective": {"eye": eye, "target": target, "vfov_deg": 40}});
    let seen = |camera: Value| scene(json!({"camera": camera}));
    warns(&seen(camera([0.0, 1.0, 4.0], [0.0, 1.0, 9.0])), &["the camera sees nothing", "[0.000, 1.000, 0.000]"]);
    let away = json!({"orthographic": {"eye": [0, 1, 4], "target": [0, 1, 9], "height": 2}});
    warns(&seen(away.clone()), &["the camera sees nothing"]);
    // A sky is something.
    is_silent(&scene(json!({"camera": away, "lights": [{"constant": {"radiance": 1}}]})));
    let plane = |v: f64| json!({"irradiance_plane": {"origin": [-1, 0, 1], "edge_u": [2, 0, 0], "edge_v": [0, 0, -2.0 * v]}});
    is_silent(&seen(plane(1.0)));
    let below = json!({"irradiance_plane": {"origin": [-3, -0.1, 3], "edge_u": [0, 0, -6], "edge_v": [6, 0, 0]}});
    warns(&seen(below), &["the irradiance plane sees nothing", "swap edge_u and edge_v"]);
    warns(&seen(camera([0.0, 0.5, 0.1], [0.0, 0.5, 4.0])), &["the camera stands inside \"glass\"", "move it out"]);
    // Under water that has no walls.
    let water = json!({"shapes": [{"name": "water", "quad": {"corner": [-9, 3, 9], "edge_u": [18, 0, 0], "edge_v": [0, 0, -18]}, "material": "other"}]});
    assert_eq!(advice(&scene(water)).iter().filter(|w| w.contains("camera")).count(), 0);
    warns(&seen(camera([0.0, 1000.0, 4000.0], [0.0, 0.0, 0.0])), &["in the picture", "metres"]);
    let lens =
        |radius: f64| json!({"perspective": {"eye": [0, 1, 4], "target": [0, 0, 0], "vfov_deg": 40, "aperture_radius": radius}});
    warns(&seen(lens(12.5)), &["the lens is 25 m wide", "metres"]);
    is_silent(&seen(lens(0.0125)));
}

#[test]
fn misread_values_are_answered_with_what_was_meant() {
    let cases = [
        ("lights", json!([{"point": {"position": [0, 3, 0], "intensity": [1, 1, 1]}}]), "linear_rgb"),
        ("materials", material(json!({"diffuse": {"reflectance": 80}})), "80 % is 0.8"),
        ("materials", material(json!({"diffuse": {"reflectance": {"srgb": [200, 100, 50]}}})), "over 255"),
    ];
    for (key, value, says) in cases {
        let line = refusal(key, &value);
        assert!(line.contains(says), "{line}");
    }
}
