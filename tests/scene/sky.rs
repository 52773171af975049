//! The sky by turbidity and elevation is Hosek and Wilkie's, as Mitsuba has it.

use super::{folder, load_text, scene_with};
use abbe::scene::{Light, Sky};
use glam::{DVec3, dvec3};
use serde_json::Value;

/// `tests/data/sky.json`, of Mitsuba in single precision.
#[test]
fn sky_and_sun_are_those_of_mitsuba() {
    let data: Value = serde_json::from_str(&std::fs::read_to_string(folder("tests/data/sky.json")).unwrap()).unwrap();
    let list = |v: &Value| v.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect::<Vec<_>>();
    let nm = list(&data["nm"]);
    for case in data["skies"].as_array().unwrap() {
        let number = |key: &str| case[key].as_f64().unwrap();
        let elevation = number("elevation_deg");
        let sky = Sky::new(number("turbidity"), elevation.to_radians(), 0.0, number("albedo"));
        let mut worst = 0.0f64;
        for row in case["sky"].as_array().unwrap() {
            let [x, y, z] = list(&row["direction"])[..] else { panic!("{row}") };
            // Its sky is about +z.
            let to = dvec3(x, z, -y);
            for (nm, exact) in nm.iter().zip(list(&row["radiance"])) {
                worst = worst.max((sky.radiance(to, *nm) / exact - 1.0).abs());
            }
        }
        // The Sun's radiance is that of its middle, and its wavelengths are interpolated after its limb is: near the horizon that tells.
        let most = if elevation < 5.0 { 0.05 } else { 0.01 };
        let sun = sky.sun_irradiance();
        let off = nm.iter().zip(list(&case["sun_irradiance"])).map(|(nm, exact)| (sun.eval(*nm) / exact - 1.0).abs());
        let off = off.fold(0.0, f64::max);
        println!("turbidity {}, {elevation} degrees: sky within {worst:.1e}, sun within {off:.1e}", number("turbidity"));
        assert!(worst < 1e-3 && off < most, "{case}: {worst} {off}");
    }
}

#[test]
fn a_sky_is_an_environment_and_a_sun() {
    let light = r#"{"sky": {"elevation_deg": 30, "azimuth_deg": 90, "turbidity": 4}}"#;
    let scene = load_text(&scene_with("lights", &format!("[{light}]"))).unwrap();
    let [Light::Image(map), Light::Sun { direction, .. }] = &scene.lights[..] else { panic!("{:?}", scene.lights) };
    assert!(direction.distance(-dvec3(0.0, 0.5, -0.75f64.sqrt())) < 1e-12, "{direction}");
    assert!(scene.notes.iter().any(|note| note.contains("held beyond")), "{:?}", scene.notes);
    // A texel 60 degrees up over +X, and one below the horizon.
    let sky = Sky::new(4.0, 30f64.to_radians(), 90f64.to_radians(), 0.3);
    let (row, column) = (42, 0);
    let theta = std::f64::consts::PI * (f64::from(row) + 0.5) / f64::from(map.height);
    let phi = std::f64::consts::PI / f64::from(map.width);
    let to: DVec3 = dvec3(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
    let (found, exact) = (map.eval((row * map.width + column) as usize, 555.0), sky.radiance(to, 555.0));
    assert!((found / exact - 1.0).abs() < 1e-6, "{found} is not {exact}");
    assert_eq!(map.eval((200 * map.width) as usize, 555.0), 0.0);
    let without = load_text(&scene_with("lights", &format!("[{}]", light.replace("4}", r#"4, "sun": false}"#)))).unwrap();
    assert_eq!(without.lights.len(), 1);
    for wrong in [r#"{"sky": {}}"#, r#"{"sky": {"elevation_deg": -5}}"#, r#"{"sky": {"elevation_deg": 5, "turbidity": 11}}"#] {
        let error = load_text(&scene_with("lights", &format!("[{wrong}]"))).map(|_| ()).unwrap_err().to_string();
        assert!(!error.contains('\n') && error.contains("; "), "{error}");
    }
}
