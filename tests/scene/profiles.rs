//! Measured lamps: what files of every symmetry mean, and what is wrong with those that are refused.

use crate::{folder, scene_with};
use abbe::film::Film;
use abbe::integrator::GpuIntegrator;
use abbe::render::Integrator;
use abbe::scene::{Light, LoadOptions, Profile, load_str};
use glam::{DVec3, dvec3};
use std::f64::consts::PI;
use std::path::Path;
use std::sync::Arc;

/// Loads a spot with this file and `more` keys.
fn load(file: &str, more: &str) -> Result<Light, String> {
    static COUNT: std::sync::atomic::AtomicUsize = std::sync::atomic::AtomicUsize::new(0);
    let number = COUNT.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
    let base = std::env::temp_dir().join(format!("abbe-profiles-{}-{number}", std::process::id()));
    std::fs::create_dir_all(&base).unwrap();
    std::fs::write(base.join("lamp.ies"), file).unwrap();
    let down = if more.contains("direction") { "" } else { r#""direction": [0, -1, 0], "# };
    let spot = format!(r#"[{{"spot": {{"position": [0, 3, 0], {down}"profile": "lamp.ies"{more}}}}}]"#);
    let scene = load_str(&scene_with("lights", &spot), Path::new("test.json"), &base, &LoadOptions::default());
    std::fs::remove_dir_all(&base).unwrap();
    scene.map(|mut s| s.lights.remove(0)).map_err(|e| e.to_string())
}

fn profile(file: &str) -> Arc<Profile> {
    let Light::Profile { profile, .. } = load(file, "").unwrap_or_else(|e| panic!("{e}")) else { panic!("no profile") };
    profile
}

/// A file of these angles and candela.
fn file(polar: &[f64], azimuth: &[f64], candela: impl Fn(f64, f64) -> f64) -> String {
    let list = |v: &[f64]| v.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    let planes: Vec<String> = azimuth.iter().map(|&a| list(&polar.iter().map(|&p| candela(p, a)).collect::<Vec<_>>())).collect();
    format!(
        "IESNA:LM-63-2002\n[TEST] x\nTILT=NONE\n1 -1 1 {} {} 1 2 0 0 0\n1 1 10\n{}\n{}\n{}\n",
        polar.len(),
        azimuth.len(),
        list(polar),
        list(azimuth),
        planes.join("\n")
    )
}

fn along(polar: f64, azimuth: f64) -> DVec3 {
    let (t, p) = (polar.to_radians(), azimuth.to_radians());
    dvec3(t.sin() * p.cos(), t.sin() * p.sin(), t.cos())
}

fn near(a: f64, b: f64, share: f64) {
    assert!((a - b).abs() <= share * b.abs(), "{a} is not {b}");
}

#[test]
fn the_ballast_counts_but_not_how_a_file_was_made() {
    let file = file(&[0.0, 90.0], &[0.0], |_, _| 100.0);
    let lumens = |header: &str, factors: &str| {
        let text = file.replace("IESNA:LM-63-2002\n", header).replace("\n1 1 10\n", &format!("\n{factors} 10\n"));
        load(&text, "").unwrap().luminous_flux_lm().unwrap()
    };
    let whole = lumens("IESNA91\n", "1 1");
    near(whole, 200.0 * PI, 1e-4);
    near(lumens("IESNA91\n", "0.9 0.8"), 0.72 * whole, 1e-6);
    near(lumens("", "0.9 0.8"), 0.72 * whole, 1e-6);
    // Since 2019 the number is the file generation type.
    near(lumens("IES:LM-63-2019\n", "0.9 1.1"), 0.9 * whole, 1e-6);
}

#[test]
fn the_flux_is_the_integral_over_zones() {
    // A cosine law of 100 cd in steps of 1 degree: 100 pi lm, but for the chords.
    let degrees: Vec<f64> = (0..=90).map(f64::from).collect();
    let light = load(&file(&degrees, &[0.0], |t, _| 100.0 * t.to_radians().cos().max(0.0)), "").unwrap();
    near(light.luminous_flux_lm().unwrap(), 100.0 * PI, 1e-4);
    // Any file: zones of a thousandth of a degree, in which it hardly changes.
    let text = std::fs::read_to_string(folder("tests/data/scenes/lamp.ies")).unwrap();
    let light = load(&text, "").unwrap();
    let Light::Profile { profile, .. } = &light else { panic!("no profile") };
    near(profile.peak_cd(), 1000.0, 1e-12);
    let (zones, sectors) = (3600, 720);
    let mut sum = 0.0;
    for i in 0..zones {
        let edge = |i: i32| (180.0 * f64::from(i) / f64::from(zones)).to_radians().cos();
        for j in 0..sectors {
            let (t, p) = (180.0 * (f64::from(i) + 0.5) / f64::from(zones), 360.0 * (f64::from(j) + 0.5) / f64::from(sectors));
            sum += (edge(i) - edge(i + 1)) * 2.0 * PI / f64::from(sectors) * profile.eval(along(t, p));
        }
    }
    near(profile.solid_angle(), sum, 1e-5);
    near(light.luminous_flux_lm().unwrap(), 1000.0 * sum, 1e-5);
}

#[test]
fn a_lamp_lights_a_floor_as_its_file_says() {
    // Azimuth 0 is along +X and 90 along -Z; linear between the file's angles.
    const TURNS: [f64; 4] = [100.0, 250.0, 140.0, 60.0];
    let tilts = |polar: f64| 1.0 - polar / 120.0;
    let file = file(&[0.0, 30.0, 60.0, 90.0], &[0.0, 90.0, 180.0, 270.0], |p, a| tilts(p) * TURNS[(a / 90.0) as usize]);
    let intensity = |d: DVec3| {
        let quarters = (-d.z).atan2(d.x).rem_euclid(2.0 * PI) / (0.5 * PI);
        let (i, t) = (quarters as usize % 4, quarters.fract());
        tilts((-d.y).acos().to_degrees()) * ((1.0 - t) * TURNS[i] + t * TURNS[(i + 1) % 4])
    };
    let (height, half, n) = (3.0, 2.0, 8);
    let scene = format!(
        r#"{{"film": {{"width": {n}, "height": {n}, "bins": 20}},
        "camera": {{"irradiance_plane": {{"origin": [-2, 0, 2], "edge_u": [4, 0, 0], "edge_v": [0, 0, -4]}}}},
        "lights": [{{"spot": {{"position": [0, 3, 0], "direction": [0, -1, 0], "profile": "lamp.ies"}}}}]}}"#
    );
    let base = std::env::temp_dir().join(format!("abbe-floor-{}", std::process::id()));
    std::fs::create_dir_all(&base).unwrap();
    std::fs::write(base.join("lamp.ies"), file).unwrap();
    let scene = load_str(&scene, Path::new("test.json"), &base, &LoadOptions::default()).unwrap();
    std::fs::remove_dir_all(&base).unwrap();
    let mut film = Film::new(&scene.film);
    GpuIntegrator::new(&scene, None, 1).unwrap().render_batch(abbe::render::Batch::even(0, 256), &mut film).unwrap();
    let lux = |x: f64, z: f64| {
        let v = dvec3(x, -height, z);
        intensity(v.normalize()) * height / v.length().powi(3)
    };
    let step = 2.0 * half / f64::from(n);
    for row in 0..n {
        for column in 0..n {
            let along = |i: i32, k: i32| -half + step * (f64::from(i) + (f64::from(k) + 0.5) / 16.0);
            let points = (0..256).map(|k| lux(along(column, k % 16), along(row, k / 16)));
            near(film.xyz((row * n + column) as usize)[1], points.sum::<f64>() / 256.0, 5e-3);
        }
    }
}

#[test]
fn every_symmetry_fills_the_circle() {
    let polar = [0.0, 30.0, 90.0];
    // Of period 180 and symmetric about 0 and 90; about 0; about 90; not at all.
    let quarter = |_: f64, a: f64| 2.0 + (2.0 * a.to_radians()).cos();
    let half = |_: f64, a: f64| 2.0 + a.to_radians().cos();
    let side = |_: f64, a: f64| 2.0 + a.to_radians().sin();
    let any = |t: f64, a: f64| 3.0 + a.to_radians().sin() + 0.5 * (2.0 * a.to_radians()).cos() + 0.01 * t;
    let steps = |from: i32, to: i32| (from..=to).step_by(30).map(f64::from).collect::<Vec<_>>();
    type Law<'a> = &'a dyn Fn(f64, f64) -> f64;
    let cases: [(Vec<f64>, Law); 5] =
        [(steps(0, 90), &quarter), (steps(0, 180), &half), (steps(90, 270), &side), (steps(0, 360), &any), (steps(0, 330), &any)];
    for (azimuth, law) in cases {
        let profile = profile(&file(&polar, &azimuth, law));
        for a in steps(0, 330) {
            for t in [30.0, 90.0] {
                near(profile.eval(along(t, a)) * profile.peak_cd(), law(t, a), 1e-9);
            }
        }
    }
}

#[test]
fn intensities_are_scaled_as_the_file_says_and_the_scene_may_say_otherwise() {
    let text = |head: &str| format!("old header\nTILT=NONE\n{head}\n0 45 90\n0\n50,100,0\n");
    near(profile(&text("1 1000 2.5 3 1 1 1 0 0 0\n0.8 0.5 60")).peak_cd(), 100.0, 1e-12);
    let plain = text("1 -1 1 3 1 1 2 0 0 0 1 1 60");
    let flux = |more: &str| load(&plain, more).unwrap().luminous_flux_lm().unwrap();
    let own = flux("");
    near(flux(r#", "intensity": {"spectrum": {"blackbody": 3000}}"#), own, 1e-9);
    near(flux(r#", "intensity": {"spectrum": 7, "luminous_flux_lm": 800}"#), 800.0, 1e-9);
    near(flux(r#", "intensity": {"spectrum": 7, "luminous_intensity_cd": 300}"#), 3.0 * own, 1e-9);
}

#[test]
fn a_lamp_is_turned_as_it_hangs() {
    let text = file(&[0.0, 90.0], &[0.0, 90.0, 180.0, 270.0, 360.0], |_, a| if a == 90.0 { 2.0 } else { 1.0 });
    for (more, brightest) in [("", -DVec3::Z), (r#", "rotate_deg": 90"#, -DVec3::X)] {
        let Light::Profile { axes, profile, .. } = load(&text, more).unwrap() else { panic!("no profile") };
        // Azimuths go round as seen from above, about an axis that points down.
        near(axes.determinant(), -1.0, 1e-12);
        near(profile.eval(axes.transpose() * brightest), 1.0, 1e-9);
        near(profile.eval(axes.transpose() * -brightest), 0.5, 1e-9);
    }
}

#[test]
fn files_that_are_refused_say_why() {
    let good = file(&[0.0, 90.0], &[0.0], |_, _| 1.0);
    assert!(load(&good, "").is_ok());
    let cases = [
        ("TILT=NONE", "TILT=INCLUDE", "tilt"),
        ("TILT=NONE", "TILT=lamp.tlt", "a file of its own"),
        ("TILT=NONE", "TILTED", "no line TILT="),
        ("2 1 1 2 0 0 0", "2 1 2 2 0 0 0", "type B"),
        ("2 1 1 2 0 0 0", "2 1 3 2 0 0 0", "type A"),
        ("2 1 1 2 0 0 0", "99999999 1 1 2 0 0 0", "vertical angles"),
        ("2 1 1 2 0 0 0", "1 1 1 2 0 0 0", "vertical angles"),
        ("2 1 1 2 0 0 0", "3000 3000 1 2 0 0 0", "ends before"),
        ("0 90", "90 0", "do not rise"),
        ("0 90", "0 190", "do not rise"),
        ("0 90\n0", "0 90\n-5", "do not rise"),
        ("\n1 1\n", "\n1\n", "ends before its candela"),
        ("\n1 1\n", "\n0 0\n", "dark"),
        ("\n1 1\n", "\n1 -1\n", "negative"),
        ("\n1 1\n", "\n1 nan\n", "no number"),
        ("\n1 1\n", "\n1 one\n", "no number"),
    ];
    for (from, to, fragment) in cases {
        assert!(good.contains(from), "{from:?} in {good}");
        let line = load(&good.replace(from, to), "").expect_err(to);
        assert!(line.contains(fragment) && !line.contains('\n'), "{fragment:?} is not in: {line}");
    }
    let line = load(&file(&[0.0, 90.0], &[0.0, 120.0], |_, _| 1.0), "").unwrap_err();
    assert!(line.contains("symmetry"), "{line}");
    let line = load(&good, r#", "outer_deg": 20"#).unwrap_err();
    assert!(line.contains("leave out inner_deg"), "{line}");
}

/// An EULUMDAT file of `planes` C-planes all around, and these angles.
fn eulumdat(symmetry: u32, planes: u32, written: &[f64], polar: &[f64], candela: impl Fn(f64, f64) -> f64) -> String {
    let mut lines: Vec<String> = vec!["Maker".into(), "1".into(), symmetry.to_string(), planes.to_string()];
    lines.extend([format!("{}", 360.0 / f64::from(planes)), polar.len().to_string(), "0".into()]);
    lines.extend(["report", "name", "number", "lamp.ldt", "2026"].map(String::from));
    lines.extend(["1200", "100", "80", "1180", "90", "0", "0", "0", "0"].map(String::from));
    lines.extend(["100", "80", "1.0", "0", "1"].map(String::from));
    lines.extend(["2", "T16 tube", "2000", "840", "1B", "58"].map(String::from));
    lines.extend((0..10).map(|i| format!("0.{i}")));
    lines.extend((0..planes).map(|i| (f64::from(i) * 360.0 / f64::from(planes)).to_string()));
    lines.extend(polar.iter().map(f64::to_string));
    // In cd for 1,000 lm; the lamps have 2,000.
    lines
        .extend(written.iter().flat_map(|&c| polar.iter().map(move |&g| (c, g))).map(|(c, g)| (0.5 * candela(g, c)).to_string()));
    lines.join("\r\n")
}

#[test]
fn eulumdat_files_of_every_symmetry_are_what_lm_63_says_of_the_same_lamp() {
    let polar = [0.0, 30.0, 60.0, 90.0];
    let all: Vec<f64> = (0..8).map(|i| 45.0 * f64::from(i)).collect();
    let azimuth: Vec<f64> = all.iter().copied().chain([360.0]).collect();
    // None; about the axis; to the plane of 0 and 180; to that of 90 and 270; to both.
    type Turn = fn(f64) -> f64;
    let cases: [(u32, &[f64], Turn); 5] = [
        (0, &all, |c| 2.0 + (c % 360.0) / 360.0),
        (1, &[0.0], |_| 1.0),
        (2, &all[..5], |c| 2.0 + c.to_radians().cos()),
        (3, &[270.0, 315.0, 0.0, 45.0, 90.0], |c| 2.0 + c.to_radians().sin()),
        (4, &all[..3], |c| 2.0 + (2.0 * c).to_radians().cos()),
    ];
    for (symmetry, written, turn) in cases {
        let candela = |g: f64, c: f64| (100.0 - g) * turn(c);
        let (ldt, ies) = (profile(&eulumdat(symmetry, 8, written, &polar, candela)), profile(&file(&polar, &azimuth, candela)));
        near(ldt.peak_cd(), ies.peak_cd(), 1e-12);
        for (g, c) in [(0.0, 0.0), (10.0, 20.0), (45.0, 100.0), (70.0, 170.0), (50.0, 200.0), (85.0, 300.0), (33.0, 355.0)] {
            assert!((ldt.eval(along(g, c)) - ies.eval(along(g, c))).abs() < 1e-9, "symmetry {symmetry} at {g}, {c}");
        }
    }
}

#[test]
fn damaged_eulumdat_files_are_errors_of_one_line() {
    let good = eulumdat(1, 4, &[0.0], &[0.0, 90.0], |_, _| 100.0);
    assert!(load(&good, "").is_ok());
    let lines: Vec<&str> = good.split("\r\n").collect();
    for cut in 3..lines.len() {
        let line = load(&lines[..cut].join("\n"), "").expect_err("cut short");
        assert!(line.contains("it ends before") && !line.contains('\n'), "{cut}: {line}");
    }
    for (at, wrong) in [(3, "0"), (3, "1e9"), (5, "-3"), (25, "99"), (28, "much"), (42, "NaN"), (46, "200"), (48, "-5")] {
        let mut broken = lines.clone();
        broken[at] = wrong;
        let line = load(&broken.join("\n"), "").expect_err(wrong);
        assert!(!line.contains('\n'), "{line}");
    }
}

#[test]
fn tilt_dims_a_lamp_as_its_file_says() {
    let tilted = file(&[0.0, 90.0], &[0.0], |_, _| 100.0).replace("TILT=NONE", "TILT=INCLUDE\n1\n3\n0 60 180\n1.0 0.8 0.5");
    for (direction, factor) in
        [("[0, -1, 0]", 1.0), ("[1, 0, 0]", 0.725), ("[0, 1, 0]", 0.5), ("[0.8660254037844386, -0.5, 0]", 0.8)]
    {
        let light = load(&tilted, &format!(r#", "rotate_deg": 0, "direction": {direction}"#)).unwrap();
        near(light.luminous_flux_lm().unwrap(), factor * 200.0 * PI, 1e-4);
    }
}

#[test]
fn eulumdat_files_of_one_angle_or_of_planes_out_of_order_are_refused() {
    let one = load(&eulumdat(1, 4, &[0.0], &[0.0], |_, _| 100.0), "").expect_err("one angle");
    assert!(one.contains("number of angles"), "{one}");
    let whole = eulumdat(0, 4, &[0.0, 90.0, 180.0, 270.0], &[0.0, 90.0], |_, _| 100.0);
    assert!(load(&whole, "").is_ok());
    let mut lines: Vec<&str> = whole.split("\r\n").collect();
    lines[43] = "-1e-9";
    let turned = load(&lines.join("\n"), "").expect_err("a negative plane");
    assert!(turned.contains("do not rise"), "{turned}");
}
