//! `--frames`: frames are the stills of their keys, in numbered files that are rendered once, under one exposure.

use crate::support::{Folder, SCENE, fails, text};
use abbe::output::SpectralImage;
use serde_json::{Value, json};
use std::fs;
use std::process::Command;

/// The ball swells and the light changes by steps.
fn moving(name: &str) -> Folder {
    let folder = Folder::new(name);
    let mut scene: Value = serde_json::from_str(SCENE).unwrap();
    scene["animate"] = json!([
        {"key": "shapes[0].sphere.radius", "frames": [0, 10], "values": [1, 0.5]},
        {"key": "camera.perspective.eye", "frames": [0, 2, 10], "values": [[0, 0, 4], [1, 0, 4], [1, 2, 4]], "interpolation": "smooth"},
        {"key": "lights[0].constant.radiance", "frames": [0, 7], "values": [1, {"blackbody": 5000, "scale": 1e-9}], "interpolation": "step"}
    ]);
    fs::write(folder.0.join("moving.json"), scene.to_string()).unwrap();
    folder
}

const FRAMES: [&str; 8] = ["render", "moving.json", "--device", "reference", "--spp", "8", "--quiet", "--frames"];

fn run(folder: &Folder, arguments: &[&str]) {
    let output = folder.run(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
}

fn image(folder: &Folder, name: &str) -> SpectralImage {
    SpectralImage::read(folder.0.join(name)).unwrap()
}

#[test]
fn a_frame_is_the_still_of_its_keys_bit_by_bit() {
    let folder = moving("frames");
    run(&folder, &[&FRAMES[..], &["1..8:7", "-o", "f_%03d.exr"]].concat());
    assert_eq!(
        folder.names(),
        ["ball.json", "f.exposure.json", "f_001.exr", "f_001.png", "f_008.exr", "f_008.png", "moving.json"]
    );
    // Frame 8 by its formulas: a line, the spline's last piece (from the slope 0, since x turns there, to rest), a step.
    let share: f64 = 6.0 / 8.0;
    let eye = 2.0 * share * share * (3.0 - 2.0 * share);
    let keys = [
        format!("shapes[0].sphere.radius={}", 1.0 + 0.8 * (0.5 - 1.0)),
        format!("camera.perspective.eye=[1, {eye}, 4]"),
        "lights[0].constant.radiance={\"blackbody\": 5000, \"scale\": 1e-9}".to_string(),
    ];
    let set: Vec<&str> = keys.iter().flat_map(|key| ["--set", key.as_str()]).collect();
    run(&folder, &[&FRAMES[..7], &["-o", "still.exr"], &set[..]].concat());
    let (frame, still) = (image(&folder, "f_008.exr"), image(&folder, "still.exr"));
    assert_eq!(frame.data, still.data);
    assert_eq!(frame.other("XYZ.Y"), still.other("XYZ.Y"));
    assert_ne!(frame.data, image(&folder, "f_001.exr").data);
    assert_eq!(frame.attribute("abbe.frame"), Some("8"));
    // The still of the file is what its keys say.
    run(&folder, &[&FRAMES[..7], &["-o", "file.exr"]].concat());
    run(&folder, &["render", "ball.json", "--device", "reference", "--spp", "8", "--quiet", "-o", "ball.exr"]);
    assert_eq!(image(&folder, "file.exr").data, image(&folder, "ball.exr").data);
}

#[test]
fn frames_have_the_exposure_of_the_first_and_seeds_as_asked_for() {
    let folder = moving("exposure");
    run(&folder, &[&FRAMES[..], &["0..1"]].concat());
    let of_first = image(&folder, "moving.0000.exr").attribute("EV").unwrap().to_string();
    // What comes later, from another process and far darker, has it too.
    run(&folder, &[&FRAMES[..], &["9"]].concat());
    for name in ["moving.0001.exr", "moving.0009.exr"] {
        assert_eq!(image(&folder, name).attribute("EV"), Some(of_first.as_str()), "{name}");
    }
    let kept: Value = serde_json::from_slice(&fs::read(folder.0.join("moving.exposure.json")).unwrap()).unwrap();
    assert_eq!((kept["stops"].as_f64().map(|v| v as f32), &kept["frame"]), (of_first.parse().ok(), &json!(0)));
    // One that is given counts, and nothing is kept.
    run(&folder, &[&FRAMES[..], &["9", "--exposure", "-2", "-o", "given.exr"]].concat());
    assert_eq!(image(&folder, "given.0009.exr").attribute("EV"), Some("-2"));
    assert!(!folder.0.join("given.exposure.json").exists());
    // Seeds.
    run(&folder, &[&FRAMES[..], &["9", "--seed", "5", "--seed-per-frame", "-o", "own.exr"]].concat());
    run(&folder, &[&FRAMES[..], &["9", "--seed", "14", "-o", "same.exr"]].concat());
    let own = image(&folder, "own.0009.exr");
    assert_eq!(own.data, image(&folder, "same.0009.exr").data);
    assert_ne!(own.data, image(&folder, "moving.0009.exr").data);
    // An exposure of another scene is told of.
    let other = [&FRAMES[..], &["3", "--set", "max_depth=3"]].concat();
    fails(&folder, &other, &["moving.exposure.json", "scene's files", "remove"]);
    fails(&folder, &[&FRAMES[..], &["3", "--exposure", "auto+1"]].concat(), &["moving.exposure.json", "--exposure"]);
}

#[test]
fn frames_that_are_done_are_passed_over_and_others_in_their_place_are_told_of() {
    let folder = moving("passed-over");
    run(&folder, &[&FRAMES[..], &["3..4"]].concat());
    let written = |name: &str| fs::metadata(folder.0.join(name)).unwrap().modified().unwrap();
    let before = written("moving.0003.exr");
    fs::remove_file(folder.0.join("moving.0004.png")).unwrap();
    fs::remove_file(folder.0.join("moving.exposure.json")).unwrap();
    run(&folder, &[&FRAMES[..], &["3..5"]].concat());
    assert_eq!(written("moving.0003.exr"), before);
    assert!(["moving.0004.png", "moving.0005.exr", "moving.exposure.json"].iter().all(|name| folder.0.join(name).exists()));
    // The exposure of a frame that was passed over is the others' too.
    assert_eq!(image(&folder, "moving.0003.exr").attribute("EV"), image(&folder, "moving.0005.exr").attribute("EV"));

    let with = |more: &[&'static str]| [&FRAMES[..], &["3"], more].concat();
    fails(&folder, &with(&["--seed", "2"]), &["moving.0003.exr", "another seed", "0 instead of 2"]);
    fails(&folder, &with(&["--aov", "error"]), &["moving.0003.exr", "another aov"]);
    fails(&folder, &with(&["--fps", "30"]), &["moving.0003.exr", "another frames_per_second"]);
    let scene = fs::read_to_string(folder.0.join("moving.json")).unwrap();
    fs::write(folder.0.join("moving.json"), scene.replace("0.75", "0.5")).unwrap();
    fails(&folder, &with(&[]), &["moving.0003.exr", "content of the scene's files"]);
    fs::copy(folder.0.join("moving.0005.exr"), folder.0.join("x.0006.exr")).unwrap();
    fails(&folder, &[&FRAMES[..], &["6", "-o", "x.exr"]].concat(), &["x.0006.exr", "of another"]);
}

#[test]
fn a_signal_ends_a_sequence_and_the_same_command_goes_on_with_it() {
    let folder = moving("stopped");
    let mut child =
        folder.command(&["render", "moving.json", "--device", "reference", "--frames", "0..1", "--spp", "4000"]).spawn().unwrap();
    // So that it is at work.
    let mut lines = std::io::BufRead::lines(std::io::BufReader::new(child.stderr.take().unwrap()));
    assert!(lines.by_ref().any(|line| line.unwrap().contains(" spp, ")));
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert_eq!(folder.names(), ["ball.json", "moving.0000.checkpoint", "moving.0000.exr", "moving.0000.png", "moving.json"]);
    assert_eq!(image(&folder, "moving.0000.exr").attribute("abbe.interrupted"), Some("yes"));

    let again = ["render", "moving.json", "--device", "reference", "--frames", "0..1", "--spp", "4000", "--quiet"];
    run(&folder, &again);
    assert!(!folder.names().iter().any(|name| name.contains("checkpoint")), "{:?}", folder.names());
    let gone_on_with = image(&folder, "moving.0000.exr");
    assert_eq!(gone_on_with.attribute("abbe.samples"), Some("4000"));
    run(&folder, &[&again[..], &["-o", "whole.exr"]].concat());
    assert_eq!(gone_on_with.data, image(&folder, "whole.0000.exr").data);
}

#[test]
fn a_frame_that_is_none_is_told_with_its_number() {
    let folder = moving("wrong-frame");
    let frames = |more: &[&'static str]| [&FRAMES[..], more].concat();
    let key = "animate[0].values[1]=-1";
    fails(&folder, &frames(&["10", "--set", key]), &["$.shapes[0].sphere.radius", "in frame 10"]);
    fails(&folder, &frames(&["10", "--set", "animate[0].key=shapes[3].sphere"]), &["$.animate[0].key", "no element 3"]);
    fails(&folder, &frames(&["10..1"]), &["0..120"]);
    fails(&folder, &frames(&["1", "--share", "1/2"]), &["--share"]);
    fails(&folder, &frames(&["1", "-o", "%02d/%d.exr"]), &["more than one place"]);
}
