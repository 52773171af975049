//! Prescriptions are read as opticians write them, rays go through them as other programs have it, and what is wrong with one is told in one line.
//!
//! Of the exit pupil's bounds the tests were seen to fail with those 3 % too small and 13 % too large, of the stop within a glass without it.

use super::random::Random;
use super::{folder, load_text, scene_with};
use abbe::geometry::LensForm;
use abbe::lens::{Glass, LensRay, Prescription, Surface, Tracer, library, zmx};
use abbe::scene::{Geometry, Sensor, Shape, load_lens};
use abbe::spectrum::measured::decode;
use abbe::spectrum::{Ior, LINE_D_NM};
use flate2::read::GzDecoder;
use glam::{dvec2, dvec3};
use serde_json::{Value, json};
use std::f64::consts::PI;
use std::io::Read;

/// The double Gauss as a Zemax file: `tail` follows, `glass` is that of its first element.
fn gauss_zmx(glass: &str) -> String {
    let Value::Array(surfaces) = gauss()["surfaces"].clone() else { unreachable!("a list") };
    let mut text = "VERS 140124 258 36214\nMODE SEQ\nNAME Double Gauss\nUNIT MM X W X CM MR CPMM\nENPD 2.5E+1\nGCAT SCHOTT\nFTYP 0 0 1 1 0 0 0\nSURF 0\n  TYPE STANDARD\n  CURV 0.0\n  DISZ INFINITY\n  DIAM 0 0 0 0 1\n".to_string();
    let number = |v: &Value, key: &str| v[key].as_f64().unwrap_or(0.0);
    // A plane that is not there stands before the lens, as in many files.
    text += "SURF 1\n  COMM a plane in air\n  TYPE STANDARD\n  CURV 0.0 0 0 0\n  DISZ 5\n  DIAM 1 0 0 0 1\n";
    for (i, s) in surfaces.iter().enumerate() {
        let radius = number(s, "radius");
        let curvature = if radius == 0.0 { 0.0 } else { 1.0 / radius };
        text += &format!("SURF {}\n", i + 2);
        text += if s["stop"] == true { "  STOP\n" } else { "" };
        text += &format!("  TYPE STANDARD\n  CURV {curvature:.17} 0 0 0 0 \"\"\n");
        if let Some(nd) = s["glass"]["nd"].as_f64() {
            let model = format!("  GLAS ___BLANK 1 0 {nd} {} 0 0 0\n", s["glass"]["abbe"]);
            text += &if i == 0 && !glass.is_empty() { format!("  GLAS {glass} 0 0 1.5 40 0 0 0\n") } else { model };
        }
        text += &format!("  DISZ {}\n  DIAM {} 1 0 0 1 \"\"\n", number(s, "thickness"), 0.5 * number(s, "diameter"));
    }
    text + "SURF 13\n  TYPE STANDARD\n  CURV 0.0\n  DISZ 0\n  DIAM 20 0 0 0 1\n"
}

fn gauss() -> Value {
    serde_json::from_str(library::text("gauss").unwrap()).unwrap()
}

#[test]
fn a_zemax_file_is_the_same_lens_whatever_its_encoding() {
    let text = gauss_zmx("");
    let known = load_lens("gauss", None).unwrap();
    let wide = |mark: [u8; 2], bytes: fn(u16) -> [u8; 2]| -> Vec<u8> {
        mark.into_iter().chain(text.encode_utf16().flat_map(bytes)).collect()
    };
    for bytes in [text.clone().into_bytes(), wide([0xff, 0xfe], u16::to_le_bytes), wide([0xfe, 0xff], u16::to_be_bytes)] {
        let read = zmx::read(&decode(&bytes)).unwrap();
        assert_eq!(read.name, "Double Gauss");
        assert_eq!(read.surfaces.len(), known.surfaces.len());
        for (a, b) in read.surfaces.iter().zip(&known.surfaces) {
            assert!((a.curvature() - b.curvature()).abs() < 1e-9 && (a.thickness - b.thickness).abs() < 1e-15, "{a:?} {b:?}");
            assert!((a.semi_diameter - b.semi_diameter).abs() < 1e-15 && a.stop == b.stop);
            assert_eq!(a.glass.as_ref().map(|g| g.ior.nd()), b.glass.as_ref().map(|g| g.ior.nd()));
        }
    }
    // Names of glasses of old, and of the file's catalogues.
    let nd = |glass| zmx::read(&gauss_zmx(glass)).unwrap().surfaces[0].glass.clone().unwrap().ior.nd();
    assert!((nd("N-BK7") - 1.5168).abs() < 5e-6);
    assert!((nd("BK7") - 1.5168).abs() < 5e-6);
}

#[test]
fn even_aspheres_keep_their_shape_in_every_unit() {
    let asphere = |unit: &str, scale: f64| {
        let a4 = 1e-6 * scale.powi(-3);
        format!(
            "UNIT {unit}\nSURF 0\n TYPE STANDARD\n DISZ INFINITY\nSURF 1\n STOP\n TYPE EVENASPH\n CURV {}\n CONI -0.5\n PARM 2 {a4}\n DISZ {}\n GLAS N-BK7 0 0\n DIAM {}\nSURF 2\n TYPE STANDARD\n CURV 0\n DISZ 1\n DIAM {}\nSURF 3\n TYPE STANDARD\n",
            0.02 / scale,
            5.0 * scale,
            10.0 * scale,
            10.0 * scale
        )
    };
    let sag = |unit, scale| zmx::read(&asphere(unit, scale)).unwrap().surfaces[0].sag(0.01);
    // z = c r^2 / (1 + sqrt(1 - 0.5 c^2 r^2)) + 1e-6 r^4, mm.
    let exact = 1e-3 * (0.02 * 100.0 / (1.0 + (1.0 - 0.5 * 4e-4 * 100.0f64).sqrt()) + 1e-6 * 1e4);
    for (unit, scale) in [("MM", 1.0), ("CM", 0.1), ("METER", 1e-3), ("IN", 1.0 / 25.4)] {
        assert!((sag(unit, scale) - exact).abs() < 1e-12, "{unit}: {} is not {exact}", sag(unit, scale));
    }
}

#[test]
fn diameters_that_the_file_leaves_out_let_its_light_through() {
    let text: String = gauss_zmx("").lines().filter(|l| !l.contains("DIAM")).map(|l| format!("{l}\n")).collect();
    let lens = zmx::read(&text).unwrap();
    let paraxial = lens.paraxial(LINE_D_NM);
    assert!((2.0 * paraxial.entrance_pupil.1 - 0.025).abs() < 1e-9, "{paraxial:?}");
    // Light of the axis as wide as the file says reaches every surface's edge or less.
    let heights = lens.heights(0.0125, 0.0, LINE_D_NM);
    assert!(lens.surfaces.iter().zip(heights).all(|(s, h)| s.semi_diameter >= h.abs() * (1.0 - 1e-9)));
}

/// Rays of PyPI's rayoptics 0.9.8 (`tools/lens-rays.py`), through surfaces between the same numbers.
#[test]
fn rays_go_where_rayoptics_has_them_to_1e_9_of_the_focal_length() {
    let bytes = std::fs::read(folder("tests/data/lens_rays.json.gz")).unwrap();
    let mut text = String::new();
    GzDecoder::new(&bytes[..]).read_to_string(&mut text).unwrap();
    let data: Value = serde_json::from_str(&text).unwrap();
    let list = |v: &Value| v.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect::<Vec<_>>();
    let wavelengths = list(&data["wavelengths"]);
    for (name, of_lens) in data["lenses"].as_object().unwrap() {
        let surface = |s: &Value| {
            let indices = list(&s["indices"]);
            let table: Vec<(f64, f64)> = wavelengths.iter().copied().zip(indices.iter().copied()).collect();
            let glass = !s["glass"].is_null();
            // Lengths are mm there.
            let powers = list(&s["aspheric"]).into_iter().enumerate();
            Surface {
                radius: s["radius"].as_f64().map_or(f64::INFINITY, |r| 1e-3 * r),
                conic: s["conic"].as_f64().unwrap(),
                aspheric: powers.map(|(i, a)| a * 1e3f64.powi(2 * i as i32 + 1)).collect(),
                thickness: 1e-3 * s["thickness"].as_f64().unwrap(),
                glass: glass.then(|| Glass { name: "of a table".into(), ior: Ior::table(&table).unwrap(), absorption: None }),
                semi_diameter: 0.5e-3 * s["diameter"].as_f64().unwrap(),
                stop: s["stop"] == true,
            }
        };
        let lens =
            Prescription { name: name.clone(), surfaces: of_lens["surfaces"].as_array().unwrap().iter().map(surface).collect() };
        lens.check().unwrap();
        let f = lens.paraxial(wavelengths[3]).focal_length;
        let rays = of_lens["rays"].as_array().unwrap();
        assert!(rays.len() >= 1000, "{name}: {} rays", rays.len());
        let mut worst = (0.0f64, 0.0f64);
        for row in rays {
            let [nm, x, y, dy, dz, px, py, pz, ex, ey, ez] = list(row)[..] else { panic!("{row}") };
            let start = LensRay { o: 1e-3 * dvec3(x, y, 0.0), d: dvec3(0.0, dy, dz).normalize() };
            let out = Tracer::new(&lens, nm).trace(start).unwrap_or_else(|| panic!("{name}: {row} gets through"));
            worst.0 = worst.0.max(out.ray.o.distance(1e-3 * dvec3(px, py, pz)));
            worst.1 = worst.1.max(out.ray.d.distance(dvec3(ex, ey, ez)));
            // And back the same way.
            let back = Tracer::new(&lens, nm).trace(LensRay { o: out.ray.o, d: -out.ray.d }).unwrap();
            assert!(back.ray.at(0.0).distance(start.o) < 1e-9 * f, "{name}: {row} comes back");
            assert!((back.transmission - out.transmission).abs() < 1e-12);
        }
        println!("{name}: f {f:.6} m, off by {:.1e} m and {:.1e} rad at most", worst.0, worst.1);
        assert!(worst.0 < 1e-9 * f && worst.1 < 1e-9, "{name}: {worst:?}");
    }
}

fn camera(lens: &str) -> String {
    let film = if lens.contains("\"film\"") { "" } else { r#""film": [0.036, 0.024], "# };
    format!(
        r#"{{"film": {{"width": 36, "height": 24}}, "camera": {{"lens": {{"eye": [0, 0, 1], "target": [0, 0, 0], {film}{lens}}}}}, "lights": [{{"constant": {{"radiance": 1}}}}]}}"#
    )
}

#[test]
fn what_is_wrong_with_a_lens_is_told_in_one_line() {
    let biconvex = r#""diameter": 0.02, "surfaces": [{"radius": 0.05, "thickness": 0.005, "glass": "N-BK7"}, {"radius": -0.05}]"#;
    load_text(&camera(biconvex)).unwrap();
    let many =
        format!(r#""diameter": 0.01, "surfaces": [{}]"#, vec![r#"{"thickness": 0.001, "glass": "N-BK7"}"#; 10_000].join(", "));
    for (lens, word) in [
        (biconvex.replace(r#""thickness": 0.005, "#, ""), "no thickness"),
        (biconvex.replace(r#", "glass": "N-BK7""#, ""), "no glass"),
        (biconvex.replace("N-BK7", "N-BK77"), "unknown glass"),
        (biconvex.replace(r#""radius": 0.05"#, r#""radius": 0.0099"#), "does not reach"),
        (biconvex.replace(r#""radius": 0.05"#, r#""radius": 0"#), "no radius"),
        (biconvex.replace(r#""diameter": 0.02"#, r#""diameter": -1"#), "not positive"),
        (biconvex.replace(r#""diameter": 0.02, "#, ""), "no diameter"),
        (biconvex.replace(r#""thickness": 0.005"#, r#""thickness": -0.005"#), "thickness"),
        (biconvex.replace("-0.05}", r#"-0.05, "glass": "F2", "thickness": 1}"#), "behind the last"),
        (biconvex.replace("-0.05", "0.04"), "no image"),
        (biconvex.replace("\"surfaces\": [", "\"surfaces\": [{\"stop\": true}, {\"stop\": true}, "), "stop already"),
        (format!(r#"{biconvex}, "f_number": 1"#), "wider than the lens"),
        (format!(r#"{biconvex}, "focus_distance": 0.01"#), "no image"),
        (format!(r#"{biconvex}, "prescription": "gauss""#), "both"),
        (r#""prescription": "gaus""#.to_string(), "did you mean \"gauss\""),
        (r#""surfaces": [], "diameter": 1"#.to_string(), "0 elements"),
        (many, "10000 surfaces"),
    ] {
        let error = load_text(&camera(&lens)).map(|_| ()).expect_err(&lens[..lens.len().min(200)]).to_string();
        assert!(error.contains(word) && !error.contains('\n') && error.contains("; "), "{error}");
    }
    let square = camera(biconvex).replace("[0.036, 0.024]", "[0.036, 0.036]");
    let error = load_text(&square).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("no square pixels"), "{error}");
    for (line, word) in [
        ("GLAS MIRROR 0 0", "mirror"),
        ("GLAS NOSUCHGLASS 0 0", "unknown glass"),
        ("TYPE COORDBRK", "not read"),
        ("DISZ NAN", "no number"),
        ("CURV 1e999", "no number"),
    ] {
        let text = gauss_zmx("").replacen("  DISZ 0.12\n", &format!("  DISZ 0.12\n  {line}\n"), 1);
        let fault = zmx::read(&text).expect_err(line);
        assert!(fault.problem.contains(word) && !fault.remedy.is_empty(), "{line}: {fault:?}");
    }
}

/// A camera through a lens sees what a pinhole at its entrance pupil does, but for distortion.
#[test]
fn a_lens_has_the_field_of_view_of_its_film() {
    let scene = load_text(&camera(r#""prescription": "gauss", "f_number": 8"#)).unwrap();
    let Sensor::Perspective { tan_half_vfov, .. } = scene.sensor else { panic!("a camera") };
    let optics = scene.sensor.optics().unwrap();
    assert!((optics.paraxial.f_number() - 8.0).abs() < 1e-3);
    // From the edge of the film, half way up, back through the lens at d.
    let edge = dvec2(0.0, -0.012);
    let bound = optics.pupil_at(0.012);
    let out = Tracer::new(&optics.lens, LINE_D_NM).trace(optics.ray_from_film(edge, dvec2(0.0, -bound.center))).unwrap();
    let tan = out.ray.d.y / -out.ray.d.z;
    assert!((tan / tan_half_vfov - 1.0).abs() < 0.02, "{tan} {tan_half_vfov}");
    let json = json!({"axial": optics.axial});
    assert!((optics.axial / (PI / 4.0 / 64.0) - 1.0).abs() < 0.12, "{json}");
}

/// At full aperture on the axis less than a fifth of the rays that the double Gauss is given are lost.
#[test]
fn bounds_of_the_exit_pupil_are_tight() {
    let scene = load_text(&camera(r#""prescription": "gauss""#)).unwrap();
    let optics = scene.sensor.optics().unwrap();
    let mut random = Random(5);
    for (radius, most) in [(0.0, 0.1), (0.01, 0.15), (0.0216, 0.25)] {
        let (bound, film) = (optics.pupil_at(radius), dvec2(radius, 0.0));
        let (mut lost, all) = (0, 9000);
        for i in 0..all {
            let (r, phi) = (random.next().sqrt(), 2.0 * PI * random.next());
            let p = dvec2(bound.center, 0.0) + bound.half * r * dvec2(phi.cos(), phi.sin());
            let tracer = Tracer::new(&optics.lens, [380.0, 550.0, 780.0][i % 3]);
            lost += u32::from(!tracer.trace(optics.ray_from_film(film, p)).is_some_and(|out| out.is_clear()));
        }
        let share = f64::from(lost) / all as f64;
        println!("{radius} m: {:.1} % of the rays are lost", 100.0 * share);
        assert!(share < most, "{radius} m: {share}");
    }
}

/// A stop within one glass is part of the lens, as shape and as camera.
#[test]
fn a_stop_within_a_glass_stays() {
    let surfaces = r#"[{"radius": 0.01, "thickness": 0.01, "glass": "N-BK7"}, {"stop": true, "diameter": 0.004, "thickness": 0.01, "glass": "N-BK7"}, {"radius": -0.01}]"#;
    let scene =
        load_text(&scene_with("shapes", &format!(r#"[{{"lens": {{"diameter": 0.019, "surfaces": {surfaces}}}}}]"#))).unwrap();
    let stops: Vec<_> = scene.shapes.iter().filter(|s| s.interior.is_none() && scene.materials[s.material].is_opaque()).collect();
    let [Shape { geometry: Geometry::LensFace(face), .. }] = &stops[..] else { panic!("{stops:?}") };
    assert!(matches!(face.form, LensForm::Annulus { height: 0.01, inner: 0.002, outer: 0.0095, .. }), "{face:?}");
}

#[test]
fn keys_that_a_prescription_has_its_own_of_are_refused() {
    let load = |more: &str| {
        let camera = format!(
            r#"{{"lens": {{"eye": [0, 1, 4], "target": [0, 1, 0], "film": [0.036, 0.036], "prescription": "gauss"{more}}}}}"#
        );
        let scene = format!(r#"{{"camera": {camera}, "lights": [{{"constant": {{"radiance": 1}}}}]}}"#);
        load_text(&scene).map(|_| ()).map_err(|e| e.to_string())
    };
    assert_eq!(load(""), Ok(()));
    for more in [r#", "unit": "mm""#, r#", "diameter": 30"#] {
        assert!(load(more).expect_err(more).contains("leave this out"), "{more}");
    }
}

/// Light that the lens brings from the scene to the film comes through the bounds of the exit pupil, however small that is, and to the edge of the picture
/// that the lens makes.
#[test]
fn all_light_from_the_scene_is_within_the_bounds_of_the_exit_pupil() {
    let meniscus = r#""diameter": 0.012, "surfaces": [{"stop": true, "thickness": 0.01, "diameter": 0.004}, {"radius": -0.03, "thickness": 0.003, "glass": "N-BK7"}, {"radius": -0.02}]"#;
    let mut random = Random(3);
    for lens in [
        r#""prescription": "gauss""#,
        r#""prescription": "gauss", "f_number": 45"#,
        r#""prescription": "gauss", "f_number": 1000"#,
        r#""prescription": "gauss", "f_number": 16, "film": [0.09, 0.06]"#,
        r#""prescription": "gauss", "film": [0.09, 0.06]"#,
        r#""prescription": "triplet", "film": [0.18, 0.12]"#,
        r#""prescription": "singlet", "film": [0.18, 0.12]"#,
        meniscus,
    ] {
        let scene = load_text(&camera(lens)).unwrap();
        let optics = scene.sensor.optics().unwrap();
        let (z, pupil) = optics.paraxial.entrance_pupil;
        let widest = 1.5 * optics.film_radius() / optics.paraxial.focal_length;
        let mut arrived = 0;
        let mut lost = 0;
        for i in 0..60_000 {
            let nm = [380.0, 550.0, 780.0][i % 3];
            let mut disc = |radius: f64| {
                let (r, phi) = (radius * random.next().sqrt(), 2.0 * PI * random.next());
                dvec2(r * phi.cos(), r * phi.sin())
            };
            let (through, d) = (disc(1.5 * pupil.abs()), disc(widest).extend(1.0).normalize());
            let o = through.extend(z);
            let start = LensRay { o: o - d * (0.1 + z.abs()), d };
            let Some(out) = Tracer::new(&optics.lens, nm).trace(start).filter(|out| out.is_clear()) else { continue };
            let film = out.ray.at(optics.film_z).truncate();
            if film.length() > optics.film_radius() {
                continue;
            }
            arrived += 1;
            let (bound, along) = (optics.pupil_at(film.length()), film.normalize());
            let p = out.ray.at(optics.pupil_z).truncate();
            let p = dvec2(p.dot(along) - bound.center, p.perp_dot(along));
            lost += u32::from((p / bound.half).length() > 1.0 || bound.half.x == 0.0);
        }
        println!("{lens}: {arrived} arrive, {lost} out of bounds");
        assert!(arrived > 300 && lost == 0, "{lens}: {lost} of {arrived} out of bounds");
    }
}

/// A lens whose pupil is at infinity, on either side, is a camera like others.
#[test]
fn telecentric_lenses_make_pictures() {
    // A thin lens of f = 50 mm with its stop in either focus.
    let thin = r#"{"radius": 0.05, "thickness": 1e-9, "glass": 1.5}, {"radius": -0.05"#;
    let stop = r#""stop": true, "diameter": 0.004"#;
    let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 2e-3, "{a} is not {b}");
    let made = |surfaces: &str| {
        let more = format!(r#""diameter": 0.03, "surfaces": [{surfaces}], "film": [0.003, 0.002]"#);
        let scene = load_text(&camera(&more)).unwrap();
        let Sensor::Perspective { tan_half_vfov, lens_radius, .. } = scene.sensor else { panic!("a camera") };
        let optics = scene.sensor.optics().unwrap().clone();
        let is_sound =
            [tan_half_vfov, lens_radius, optics.film_z, optics.axial, optics.front.radius, optics.front.z, optics.eye_z];
        assert!(is_sound.iter().all(|v| v.is_finite()) && lens_radius > 0.0, "{is_sound:?}");
        (optics, tan_half_vfov)
    };
    // Towards the film: each place of it gets an equal cone around a ray along the axis.
    let (optics, tan) = made(&format!(r#"{{{stop}, "thickness": 0.05}}, {thin}}}"#));
    close(tan, 0.001 / 0.05);
    let (middle, edge) = (optics.pupil_at(0.0), optics.pupil_at(0.0015));
    assert!((edge.center / 0.0015 - 1.0).abs() < 0.02, "{edge:?}");
    assert!((edge.half / middle.half - 1.0).abs().max_element() < 0.05, "{middle:?} {edge:?}");
    // Towards the scene: rays along the axis leave the stop at their height over the focal length. The eye is the first vertex then, 1 m from what is in focus.
    let narrow = r#""stop": true, "diameter": 0.0002"#;
    let (optics, tan) = made(&format!(r#"{thin}, "thickness": 0.05}}, {{{narrow}}}"#));
    close(tan, 0.001 * 0.05 / (optics.film_z - 0.05));
    assert!((1e-4..1.05e-4).contains(&optics.pupil_at(0.0).half.x), "{:?}", optics.pupil_at(0.0));
    assert_eq!(optics.eye_z, 0.0);
    let f_number = camera(&format!(r#""diameter": 0.03, "surfaces": [{thin}, "thickness": 0.05}}, {{{stop}}}], "f_number": 8"#));
    let error = load_text(&f_number).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("telecentric"), "{error}");
}
