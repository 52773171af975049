//! `abbe new` and `abbe check`.

use crate::support::{Folder, fails, text};

#[test]
fn a_new_scene_has_its_name_and_comments_is_good_and_renders() {
    let folder = Folder::new("new");
    let output = folder.run(&["new", "rain bow"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(folder.names(), ["ball.json", "rain bow.json"]);
    let written = std::fs::read_to_string(folder.0.join("rain bow.json")).unwrap();
    assert!(written.contains("\"name\": \"rain bow\"") && written.matches("\"//").count() >= 4, "{written}");
    let output = folder.run(&["check", "rain bow.json"]);
    let stdout = text(&output.stdout);
    assert!(output.status.success() && stdout.contains("no warnings") && !stdout.contains("warning:"), "{stdout}");
    let arguments =
        ["render", "rain bow.json", "--device", "reference", "--spp", "1", "--size", "6x4", "--channels", "4", "--quiet"];
    // The reference that the scene names can see its beam.
    assert!(folder.run(&arguments).status.success());
    let before = std::fs::read_to_string(folder.0.join("ball.json")).unwrap();
    fails(&folder, &["new", "ball"], &["ball.json", "there already", "nothing was overwritten"]);
    assert_eq!(std::fs::read_to_string(folder.0.join("ball.json")).unwrap(), before);
    fails(&folder, &["new", "no/such/folder"], &["cannot be written"]);
}

#[test]
fn every_scene_to_start_from_has_comments_and_is_good() {
    let folder = Folder::new("new-from");
    for from in ["starter", "prism", "coffee", "lens", "rainbow", "gem", "room", "singlet", "achromat", "triplet", "gauss"] {
        let output = folder.run(&["new", from, "--from", from]);
        assert!(output.status.success(), "{}", text(&output.stderr));
        let written = std::fs::read_to_string(folder.0.join(format!("{from}.json"))).unwrap();
        assert!(written.contains(&format!("\"name\": \"{from}\"")) && written.matches("\"//").count() >= 2, "{written}");
        assert!(!written.contains("$schema"), "a file that is not there");
        let stdout = text(&folder.run(&["check", &format!("{from}.json")]).stdout);
        assert!(stdout.contains("no warnings") && !stdout.contains("warning:"), "{from}: {stdout}");
    }
    // The stone's mesh is shared by all that start from it, and another file of its name stays as it is.
    assert!(folder.run(&["new", "second", "--from", "gem"]).status.success());
    std::fs::write(folder.0.join("diamond.ply"), "mine").unwrap();
    fails(&folder, &["new", "third", "--from", "gem"], &["diamond.ply", "there already", "nothing was overwritten"]);
    assert_eq!(std::fs::read_to_string(folder.0.join("diamond.ply")).unwrap(), "mine");
    assert!(!folder.0.join("third.json").exists());
}

#[test]
fn check_says_what_will_be_rendered_and_what_is_wrong() {
    let folder = Folder::new("check");
    let good = text(&folder.run(&["check", "ball.json"]).stdout);
    for part in
        ["8 x 6 pixels of 4 bins, 380 to 780 nm, pinhole camera", "light: constant environment", "caustics: none", "no warnings"]
    {
        assert!(good.contains(part), "no '{part}' in {good}");
    }
    let glass = r#"{"camera": {"perspective": {"eye": [0, 1, 4], "target": [0, 0, 0], "vfov_deg": 40}},
        "materials": {"flint": {"dielectric": {"ior": "N-SF11", "absorption": 2}}, "paper": {"diffuse": {"reflectance": 0.8}}},
        "shapes": [{"sphere": {"center": [0, 1, 0], "radius": 0.5}, "material": "flint"}, {"disc": {"center": [0, 0, 0], "normal": [0, 1, 0], "radius": 2}, "material": "paper"}],
        "lights": [{"point": {"position": [0, 3, 0], "intensity": 1}}]}"#;
    std::fs::write(folder.0.join("glass.json"), glass).unwrap();
    let good = text(&folder.run(&["check", "glass.json"]).stdout);
    for part in [
        "volume \"flint\": index 1.7847 at 587.6 nm, Abbe number 25.7, absorbs 2.000 per m",
        "caustics: looked for",
        "no warnings",
    ] {
        assert!(good.contains(part), "no '{part}' in {good}");
    }
    let at = text(&folder.run(&["check", "glass.json", "--at", "0,1.2,0", "--at=-1,1,0"]).stdout);
    assert!(at.contains("at 0, 1.2, 0: in \"flint\" (priority 1)") && at.contains("at -1, 1, 0: in no volume"), "{at}");
    fails(&folder, &["check", "glass.json", "--at", "0,1"], &["x,y,z"]);
    // Many lights of a kind are one entry.
    let lamps: Vec<String> = (0..50).map(|i| format!(r#"{{"point": {{"position": [{i}, 3, 0], "intensity": 1}}}}"#)).collect();
    let many = glass.replace(r#"{"point": {"position": [0, 3, 0], "intensity": 1}}"#, &lamps.join(","));
    std::fs::write(folder.0.join("many.json"), many).unwrap();
    let many = text(&folder.run(&["check", "many.json"]).stdout);
    assert!(many.lines().any(|line| line.starts_with("light: point light of ") && line.ends_with("lm (50 times)")), "{many}");
    let blind = text(&folder.run(&["check", "glass.json", "--without", "light-paths", "--without", "merging"]).stdout);
    for part in ["warning: not found: caustics of point lights", "--without", "2 warnings"] {
        assert!(blind.contains(part), "no '{part}' in {blind}");
    }
}

#[test]
fn a_render_warns_of_what_check_would_before_it_starts() {
    let folder = Folder::new("warned");
    let lost = r#"{"film": {"width": 4, "height": 4, "bins": 4}, "reference": "forward",
        "camera": {"perspective": {"eye": [0, 1, 4], "target": [0, 0, 0], "vfov_deg": 40}},
        "materials": {"paper": {"diffuse": {"reflectance": 0.8}}},
        "shapes": [{"disc": {"center": [0, 0, 0], "normal": [0, 1, 0], "radius": 2}, "material": "paper"}],
        "lights": [{"beam": {"origin": [0, 3, 0], "direction": [0, 1, 0], "radius": 0.1, "irradiance": 1}}]}"#;
    std::fs::write(folder.0.join("lost.json"), lost).unwrap();
    let warned = "warning: the parallel beam at [0.000, 3.000, 0.000] meets nothing";
    let check = text(&folder.run(&["check", "lost.json"]).stdout);
    assert!(check.contains(warned) && check.contains("1 warning"), "{check}");
    let render =
        |more: &[&str]| folder.run(&[&["render", "lost.json", "--device", "reference", "--spp", "1"][..], more].concat());
    let stderr = text(&render(&[]).stderr);
    let at = |part: &str| stderr.find(part).unwrap_or_else(|| panic!("no '{part}' in {stderr}"));
    assert!(at(warned) < at("reference: paths from the lights"), "{stderr}");
    // And afterwards, that there is nothing to be seen.
    assert!(at("no light has reached the sensor") > at(warned), "{stderr}");
    assert_eq!(text(&render(&["--quiet"]).stderr), "");
    let output = render(&["--json"]);
    let value: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(value["warnings"][0].as_str().unwrap().contains("meets nothing"), "{value}");
    assert!(!text(&output.stderr).contains("warning"), "{}", text(&output.stderr));
    // A scene that has nothing the matter is rendered in silence.
    let output = folder.run(&["render", "ball.json", "--device", "reference", "--spp", "1"]);
    assert!(!text(&output.stderr).contains("warning"), "{}", text(&output.stderr));
}

#[test]
fn caustics_that_nothing_could_catch_are_not_missed() {
    let folder = Folder::new("mirror");
    let mirror = r#"{"camera": {"perspective": {"eye": [0, 1, 4], "target": [0, 0, 0], "vfov_deg": 40}},
        "materials": {"mirror": {"conductor": {"metal": "Ag"}}},
        "shapes": [{"disc": {"center": [0, 0, 0], "normal": [0, 1, 0], "radius": 2}, "material": "mirror"}],
        "lights": [{"point": {"position": [0, 3, 0], "intensity": 1}}]}"#;
    std::fs::write(folder.0.join("mirror.json"), mirror).unwrap();
    let check = text(&folder.run(&["check", "mirror.json"]).stdout);
    assert!(check.contains("no warnings") && !check.contains("not found"), "{check}");
}
