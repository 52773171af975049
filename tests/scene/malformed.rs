//! Malformed scenes: each fails with one line that has the JSON path of the culprit and a remedy.

use crate::{load_text, scene_with};
use abbe::Error;

/// `(key of the scene to replace, its value, JSON path of the error, fragment of problem or remedy)`.
const CASES: &[(&str, &str, &str, &str)] = &[
    ("flim", "{}", "$.flim", "did you mean \"film\"?"),
    ("film", "3", "$.film", "expected an object"),
    ("film", r#"{"width": 0}"#, "$.film.width", "1 to 65536"),
    ("film", r#"{"width": 2.5}"#, "$.film.width", "whole number"),
    ("film", r#"{"width": "wide"}"#, "$.film.width", "expected a number"),
    ("film", r#"{"height": -4}"#, "$.film.height", "1 to 65536"),
    ("film", r#"{"height": 65536, "width": 65536}"#, "$.film", "64 Mi pixels"),
    ("film", r#"{"height": 8000, "width": 8000, "bins": 400}"#, "$.film", "2 Gi values"),
    ("film", r#"{"bins": 0}"#, "$.film.bins", "1 to 400"),
    ("film", r#"{"bins": 401}"#, "$.film.bins", "1 to 400"),
    ("film", r#"{"range_nm": [780, 380]}"#, "$.film.range_nm", "within 300 to 2500"),
    ("film", r#"{"range_nm": [299, 700]}"#, "$.film.range_nm", "within 300 to 2500"),
    ("film", r#"{"range_nm": [400]}"#, "$.film.range_nm", "an array of 2 numbers"),
    ("film", r#"{"filter": "tent"}"#, "$.film.filter", "use one of box"),
    ("film", r#"{"filter": {"tent": {"radius": 0}}}"#, "$.film.filter.tent.radius", "0.1 to 10"),
    ("film", r#"{"sampling": "center"}"#, "$.film.sampling", "did you mean \"centres\"?"),
    ("film", r#"{"exposure": "auto"}"#, "$.film.exposure", "expected a number"),
    ("camera", "null", "$", "add \"camera\""),
    ("camera", "{}", "$.camera", "add one of perspective"),
    ("camera", r#"{"perspectiv": {}}"#, "$.camera.perspectiv", "did you mean \"perspective\"?"),
    ("camera", r#"{"perspective": {"eye": [0,0,1], "target": [0,0,0]}}"#, "$.camera.perspective", "add \"vfov_deg\""),
    (
        "camera",
        r#"{"perspective": {"eye": [0,0,1], "target": [0,0,1], "vfov_deg": 40}}"#,
        "$.camera.perspective.target",
        "move eye and target apart",
    ),
    (
        "camera",
        r#"{"perspective": {"eye": [0,5,0], "target": [0,0,0], "vfov_deg": 40}}"#,
        "$.camera.perspective",
        "not along eye to target",
    ),
    (
        "camera",
        r#"{"perspective": {"eye": [0,0,1], "target": [0,0,0], "up": [0,0,0], "vfov_deg": 40}}"#,
        "$.camera.perspective.up",
        "not zero",
    ),
    (
        "camera",
        r#"{"perspective": {"eye": [0,0,1], "target": [0,0,0], "vfov_deg": 180}}"#,
        "$.camera.perspective.vfov_deg",
        "179.9",
    ),
    (
        "camera",
        r#"{"perspective": {"eye": [0,0,1], "target": [0,0,0], "vfov_deg": 0}}"#,
        "$.camera.perspective.vfov_deg",
        "between 0.0001",
    ),
    (
        "camera",
        r#"{"perspective": {"eye": [0,0,1e10], "target": [0,0,0], "vfov_deg": 9}}"#,
        "$.camera.perspective.eye",
        "use smaller ones",
    ),
    (
        "camera",
        r#"{"perspective": {"eye": [0,0], "target": [0,0,0], "vfov_deg": 9}}"#,
        "$.camera.perspective.eye",
        "an array of 3 numbers",
    ),
    (
        "camera",
        r#"{"perspective": {"eye": [0,0,1], "target": [0,0,0], "vfov_deg": 9, "focus_distance": 0}}"#,
        "$.camera.perspective.focus_distance",
        "greater than 0",
    ),
    (
        "camera",
        r#"{"perspective": {"eye": [0,0,1], "target": [0,0,0], "vfov_deg": 9, "aperture_radius": -1}}"#,
        "$.camera.perspective.aperture_radius",
        "0 or more",
    ),
    (
        "camera",
        r#"{"orthographic": {"eye": [0,0,1], "target": [0,0,0], "height": -1}}"#,
        "$.camera.orthographic.height",
        "greater than 0",
    ),
    (
        "camera",
        r#"{"irradiance_plane": {"origin": [0,0,1], "edge_u": [1,0,0], "edge_v": [2,0,0]}}"#,
        "$.camera.irradiance_plane",
        "neither zero nor parallel",
    ),
    (
        "camera",
        r#"{"irradiance_sphere": {"center": [0,0,1], "radius": 0}}"#,
        "$.camera.irradiance_sphere.radius",
        "greater than 0",
    ),
    ("max_depth", "0", "$.max_depth", "1 to 100000"),
    ("reference", "\"both\"", "$.reference", "use one of backward, forward"),
    ("media", r#"{"f": {"sigma_s": -1}}"#, "$.media.f.sigma_s", "0 or more"),
    ("media", r#"{"f": {"g": 1}}"#, "$.media.f.g", "-0.999 to 0.999"),
    ("media", r#"{"f": {"sigma_t": 1}}"#, "$.media.f.sigma_t", "did you mean \"sigma_a\"?"),
    ("surroundings", r#"{"medium": "fog"}"#, "$.surroundings.medium", "none to choose from"),
    ("materials", "[]", "$.materials", "expected an object"),
    ("materials", r#"{"m": {}}"#, "$.materials.m", "add one of diffuse"),
    ("materials", r#"{"m": {"diffuse": {}}}"#, "$.materials.m.diffuse", "add \"reflectance\""),
    ("materials", r#"{"m": {"diffuse": {"reflectance": 1.1}}}"#, "$.materials.m.diffuse.reflectance", "between 0 and 1"),
    (
        "materials",
        r#"{"m": {"diffuse": {"reflectance": true}}}"#,
        "$.materials.m.diffuse.reflectance",
        "write a number, [[nm, value]",
    ),
    (
        "materials",
        r#"{"m": {"diffuse": {"reflectance": [[400, 0.1], [500, -0.1]]}}}"#,
        "$.materials.m.diffuse.reflectance[1]",
        "between 0 and 1",
    ),
    (
        "materials",
        r#"{"m": {"diffuse": {"reflectance": [[400, 0.1], [400, 0.1]]}}}"#,
        "$.materials.m.diffuse.reflectance[1]",
        "sort by wavelength",
    ),
    ("materials", r#"{"m": {"diffuse": {"reflectance": []}}}"#, "$.materials.m.diffuse.reflectance", "at least 2"),
    (
        "materials",
        r#"{"m": {"diffuse": {"reflectance": {"srgb": [0, 0, 1.5]}}}}"#,
        "$.materials.m.diffuse.reflectance.srgb",
        "from 0 to 1",
    ),
    (
        "materials",
        r#"{"m": {"diffuse": {"reflectance": {"linear_rgb": [0, 0, 2]}}}}"#,
        "$.materials.m.diffuse.reflectance.linear_rgb",
        "from 0 to 1",
    ),
    (
        "materials",
        r#"{"m": {"diffuse": {"reflectance": {"blackbody": 5000}}}}"#,
        "$.materials.m.diffuse.reflectance",
        "between 0 and 1",
    ),
    (
        "materials",
        r#"{"m": {"diffuse": {"reflectance": {"blackbody": -5}}}}"#,
        "$.materials.m.diffuse.reflectance.blackbody",
        "1 to 1000000",
    ),
    (
        "materials",
        r#"{"m": {"diffuse": {"reflectance": {"reflectance": "ColorCheker/white"}}}}"#,
        "$.materials.m.diffuse.reflectance.reflectance",
        "unknown reflectance",
    ),
    (
        "materials",
        r#"{"m": {"diffuse": {"reflectance": {"file": "none.csv"}}}}"#,
        "$.materials.m.diffuse.reflectance.file",
        "check the path",
    ),
    (
        "materials",
        r#"{"m": {"diffuse": {"reflectance": {"file": "bad.csv"}}}}"#,
        "$.materials.m.diffuse.reflectance.file",
        "write one",
    ),
    (
        "materials",
        r#"{"m": {"diffuse": {"reflectance": {"line": {"nm": 500, "width": 0}}}}}"#,
        "$.materials.m.diffuse.reflectance.line.width",
        "0.001",
    ),
    ("materials", r#"{"m": {"dielectric": {"ior": "BK-7"}}}"#, "$.materials.m.dielectric.ior", "unknown glass"),
    ("materials", r#"{"m": {"dielectric": {"ior": "n-sf12"}}}"#, "$.materials.m.dielectric.ior", "did you mean \"N-SF1"),
    ("materials", r#"{"m": {"dielectric": {"ior": 0}}}"#, "$.materials.m.dielectric.ior", "0.1 to 10"),
    ("materials", r#"{"m": {"dielectric": {"ior": []}}}"#, "$.materials.m.dielectric.ior", "the name of a glass"),
    (
        "materials",
        r#"{"m": {"dielectric": {"ior": {"nd": 1.5, "cauchy": [1.5]}}}}"#,
        "$.materials.m.dielectric.ior",
        "keep one of",
    ),
    (
        "materials",
        r#"{"m": {"dielectric": {"ior": {"cauchy": [1,2,3,4]}}}}"#,
        "$.materials.m.dielectric.ior.cauchy",
        "one to three",
    ),
    (
        "materials",
        r#"{"m": {"dielectric": {"ior": {"sellmeier": {"b": [1], "c_um2": [0.01, 2]}}}}}"#,
        "$.materials.m.dielectric.ior.sellmeier",
        "as many of one",
    ),
    (
        "materials",
        r#"{"m": {"dielectric": {"ior": {"sellmeier": {"b": [1], "c_um2": [0.25]}}}}}"#,
        "$.materials.m.dielectric.ior",
        "pole at 500",
    ),
    (
        "materials",
        r#"{"m": {"dielectric": {"ior": {"table": [[400, 1.5], [700, 1.4]]}}}}"#,
        "$.materials.m.dielectric.ior",
        "\"extrapolate\": true",
    ),
    (
        "materials",
        r#"{"m": {"dielectric": {"ior": {"nd": 1.5, "abbe": 0}}}}"#,
        "$.materials.m.dielectric.ior.abbe",
        "1 to 1000000",
    ),
    ("materials", r#"{"m": {"dielectric": {"ior": 1.5, "alpha": 0.0005}}}"#, "$.materials.m.dielectric.alpha", "0.001 to 1"),
    ("materials", r#"{"m": {"dielectric": {"ior": 1.5, "priority": 256}}}"#, "$.materials.m.dielectric.priority", "0 to 255"),
    (
        "materials",
        r#"{"m": {"dielectric": {"ior": 1.5, "absorption": "catalogue"}}}"#,
        "$.materials.m.dielectric.absorption",
        "name the glass",
    ),
    ("materials", r#"{"m": {"conductor": {"metal": "Unobtainium"}}}"#, "$.materials.m.conductor.metal", "unknown metal"),
    ("materials", r#"{"m": {"conductor": {"eta": 1}}}"#, "$.materials.m.conductor", "\"eta\" and \"k\""),
    ("materials", r#"{"m": {"conductor": {"metal": "Al", "k": 3}}}"#, "$.materials.m.conductor.k", "keep either"),
    ("materials", r#"{"m": {"mix": {"a": "m", "b": "m", "weight": 0.5}}}"#, "$.materials.m", "materials contain each other"),
    ("materials", r#"{"m": {"mix": {"a": "n", "b": "m", "weight": 0.5}}}"#, "$.materials.m.mix.a", "unknown material"),
    ("materials", r#"{"m": {"boundary": {"priority": 3}}}"#, "$.materials.m.boundary.priority", "add \"medium\""),
    ("shapes", "{}", "$.shapes", "expected an array"),
    ("shapes", "[]", "$", "add \"shapes\" or \"lights\""),
    (
        "shapes",
        r#"[{"sphere": {"center": [0,0,0], "radius": -1}, "material": "m"}]"#,
        "$.shapes[0].sphere.radius",
        "greater than 0",
    ),
    (
        "shapes",
        r#"[{"sphere": {"center": [0,0,0], "radius": 1e300}, "material": "m"}]"#,
        "$.shapes[0].sphere.radius",
        "1e-12 to 1e9",
    ),
    (
        "shapes",
        r#"[{"sphere": {"centre": [0,0,0], "radius": 1}, "material": "m"}]"#,
        "$.shapes[0].sphere.centre",
        "did you mean \"center\"?",
    ),
    ("shapes", r#"[{"sphere": {"center": [0,0,0], "radius": 1}}]"#, "$.shapes[0]", "add \"material\""),
    (
        "shapes",
        r#"[{"sphere": {"center": [0,0,0], "radius": 1}, "material": "mm"}]"#,
        "$.shapes[0].material",
        "did you mean \"m\"?",
    ),
    ("shapes", r#"[{"material": "m"}]"#, "$.shapes[0]", "add one of sphere"),
    (
        "shapes",
        r#"[{"disc": {"center": [0,0,0], "normal": [0,0,0], "radius": 1}, "material": "m"}]"#,
        "$.shapes[0].disc.normal",
        "not zero",
    ),
    (
        "shapes",
        r#"[{"cylinder": {"base": [0,0,0], "top": [0,0,0], "radius": 1}, "material": "m"}]"#,
        "$.shapes[0].cylinder",
        "move them apart",
    ),
    (
        "shapes",
        r#"[{"quad": {"corner": [0,0,0], "edge_u": [1,0,0], "edge_v": [1,0,0]}, "material": "m"}]"#,
        "$.shapes[0].quad",
        "nor parallel",
    ),
    ("shapes", r#"[{"box": {"min": [0,0,0], "max": [1,0,1]}, "material": "m"}]"#, "$.shapes[0].box", "opposite corners"),
    (
        "shapes",
        r#"[{"prism": {"polygon": [[0,0],[1,0],[0.2,0.2],[0,1]], "length": 1}, "material": "m"}]"#,
        "$.shapes[0].prism.polygon",
        "convex",
    ),
    (
        "shapes",
        r#"[{"prism": {"polygon": [[0,10],[6,-8],[-9.5,3],[9.5,3],[-6,-8]], "length": 1}, "material": "m"}]"#,
        "$.shapes[0].prism.polygon",
        "convex",
    ),
    ("shapes", r#"[{"mesh": {"file": "none.ply"}, "material": "m"}]"#, "$.shapes[0].mesh.file", "check the path"),
    ("shapes", r#"[{"mesh": {"file": "bad.csv"}, "material": "m"}]"#, "$.shapes[0].mesh.file", "use .ply, .obj"),
    ("shapes", r#"[{"mesh": {"file": "index.ply"}, "material": "m"}]"#, "$.shapes[0].mesh", "names a vertex"),
    (
        "shapes",
        r#"[{"mesh": {"file": "index.ply", "smooth": true}, "material": "m"}]"#,
        "$.shapes[0].mesh.file",
        "names a vertex",
    ),
    ("shapes", r#"[{"mesh": {"file": "nan.ply"}, "material": "m"}]"#, "$.shapes[0].mesh", "not finite"),
    ("shapes", r#"[{"mesh": {"file": "huge.ply"}, "material": "m"}]"#, "$.shapes[0].mesh.file", "the file is too short"),
    ("shapes", r#"[{"mesh": {"file": "empty.ply"}, "material": "m"}]"#, "$.shapes[0].mesh.file", "no triangles"),
    ("shapes", r#"[{"mesh": {"file": "flat.obj"}, "material": "m"}]"#, "$.shapes[0].mesh", "no triangle has an area"),
    ("shapes", r#"[{"mesh": {"file": "."}, "material": "m"}]"#, "$.shapes[0].mesh.file", "not a plain file"),
    ("shapes", r#"[{"instance": "g"}]"#, "$.shapes[0].instance", "unknown group"),
    ("shapes", r#"[{"gltf": {"file": "bad.csv"}}]"#, "$", "not valid JSON"),
    ("shapes", r#"[{"gltf": {"file": "x.glb"}, "material": "m"}]"#, "$.shapes[0].material", "remove this key"),
    ("shapes", r#"[{"sphere": {"center": [0,0,0], "radius": 1}, "emission": {}}]"#, "$.shapes[0].emission", "add \"radiance\""),
    (
        "shapes",
        r#"[{"sphere": {"center": [0,0,0], "radius": 1}, "emission": {"radiance": -2}}]"#,
        "$.shapes[0].emission.radiance",
        "0 or more",
    ),
    (
        "shapes",
        r#"[{"sphere": {"center": [0,0,0], "radius": 1}, "emission": {"radiance": {"illuminant": "D66"}}}]"#,
        "$.shapes[0].emission.radiance.illuminant",
        "did you mean \"D",
    ),
    (
        "shapes",
        r#"[{"sphere": {"center": [0,0,0], "radius": 1}, "emission": {"radiance": {"spectrum": 1, "illuminance_lx": 3}}}]"#,
        "$.shapes[0].emission.radiance.illuminance_lx",
        "use one of luminance_cd_m2",
    ),
    (
        "shapes",
        r#"[{"sphere": {"center": [0,0,0], "radius": 1}, "emission": {"radiance": {"spectrum": {"line": {"nm": 1000}}, "power_W": 3}}}]"#,
        "$.shapes[0].emission.radiance",
        "shines within the film",
    ),
    (
        "shapes",
        r#"[{"sphere": {"center": [0,0,0], "radius": 1}, "material": "m", "transform": {"scale": [1,2,1]}}]"#,
        "$.shapes[0].sphere",
        "scale it evenly",
    ),
    (
        "shapes",
        r#"[{"sphere": {"center": [0,0,0], "radius": 1}, "material": "m", "transform": {"scale": 0}}]"#,
        "$.shapes[0].transform",
        "not 0",
    ),
    (
        "shapes",
        r#"[{"sphere": {"center": [0,0,0], "radius": 1}, "material": "m", "transform": {"scale": 1e200}}]"#,
        "$.shapes[0].sphere",
        "finite",
    ),
    (
        "shapes",
        r#"[{"sphere": {"center": [0,0,0], "radius": 1}, "material": "m", "transform": {"rotate_deg": 9}}]"#,
        "$.shapes[0].transform.rotate_deg",
        "add \"axis\"",
    ),
    (
        "shapes",
        r#"[{"sphere": {"center": [0,0,0], "radius": 1}, "material": "m", "transform": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,1,1]]}]"#,
        "$.shapes[0].transform[3]",
        "row by row",
    ),
    (
        "shapes",
        r#"[{"sphere": {"center": [0,0,0], "radius": 1}, "material": "m", "transform": [[1,0,0,0],[1,0,0,0],[0,0,1,0],[0,0,0,1]]}]"#,
        "$.shapes[0].transform",
        "can be undone",
    ),
    ("groups", r#"{"g": []}"#, "$.groups.g", "at least 1"),
    ("lights", r#"[{"pointt": {}}]"#, "$.lights[0].pointt", "did you mean \"point\"?"),
    (
        "lights",
        r#"[{"spot": {"position": [0,0,0], "direction": [0,0,1], "intensity": 1, "inner_deg": 30, "outer_deg": 20}}]"#,
        "$.lights[0].spot.outer_deg",
        "greater than inner_deg",
    ),
    (
        "lights",
        r#"[{"spot": {"position": [0,0,0], "direction": [0,0,1], "intensity": 1, "outer_deg": 120}}]"#,
        "$.lights[0].spot.outer_deg",
        "0.001 to 90",
    ),
    (
        "lights",
        r#"[{"laser": {"origin": [0,0,0], "direction": [0,0,1], "radius": 1, "power_W": 1, "wavelength_nm": 1064}}]"#,
        "$.lights[0].laser.wavelength_nm",
        "widen film.range_nm",
    ),
    ("lights", r#"[{"image": {"file": "bad.csv"}}]"#, "$.lights[0].image.file", "readable .png"),
];

#[test]
fn every_malformed_scene_names_its_place_and_a_remedy_in_one_line() {
    assert!(CASES.len() >= 60);
    for (key, value, path, fragment) in CASES {
        let text = scene_with(key, value);
        match load_text(&text) {
            Ok(_) => panic!("accepted {key}: {value}"),
            Err(error) => {
                let line = error.to_string();
                assert!(!line.contains('\n'), "more than one line: {line}");
                let Error::Scene { path: found, .. } = &error else { panic!("{key}: {value}: not a scene error: {line}") };
                assert_eq!(found, path, "{line}");
                assert!(line.contains(fragment), "{fragment:?} is not in: {line}");
            }
        }
    }
}

#[test]
fn broken_json_says_where() {
    for (text, fragment) in [
        ("", "line 1 column 0"),
        ("{\"a\": 1e400}", "number out of range"),
        ("{\"film\": {}, \"film\": {}}", "the key \"film\" appears twice"),
        ("{\"film\": {\"width\": 1, \"width\": 2}}", "the key \"width\" appears twice"),
        ("{\"film\": {}} trailing", "trailing characters"),
        ("[NaN]", "not valid JSON"),
        ("[1]", "expected an object"),
    ] {
        let line = load_text(text).unwrap_err().to_string();
        assert!(line.contains(fragment) && line.contains("$: "), "{fragment:?} is not in: {line}");
    }
    let deep = "[".repeat(100_000);
    assert!(load_text(&deep).unwrap_err().to_string().contains("recursion limit"));
}

#[test]
fn a_byte_order_mark_and_the_line_ends_of_windows_are_read_over() {
    let text = "\u{feff}{\r\n\t\"film\": {\"width\": 0}\r\n}";
    assert!(load_text(text).unwrap_err().to_string().contains("$.film.width"));
}

#[test]
fn cyclic_and_exploding_instances_are_refused() {
    let cyclic = scene_with("groups", r#"{"a": [{"instance": "b"}], "b": [{"instance": "a"}]}"#)
        .replace(r#""shapes": ["#, r#""shapes": [{"instance": "a"}, "#);
    let line = load_text(&cyclic).unwrap_err().to_string();
    assert!(line.contains("break the circle"), "{line}");
    let ten = |name: &str| vec![format!(r#"{{"instance": "{name}"}}"#); 10].join(",");
    let mut groups = vec![r#""g0": [{"sphere": {"center": [0,0,0], "radius": 1}, "material": "m"}]"#.to_string()];
    groups.extend((1..12).map(|i| format!(r#""g{i}": [{}]"#, ten(&format!("g{}", i - 1)))));
    let text = scene_with("groups", &format!("{{{}}}", groups.join(",")))
        .replace(r#""shapes": ["#, r#""shapes": [{"instance": "g11"}, "#);
    let line = load_text(&text).unwrap_err().to_string();
    assert!(line.contains("more than 1000000 shapes"), "{line}");
}
