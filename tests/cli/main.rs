//! The command as a user meets it: what it prints, where it writes, how it fails and how it is stopped. Everything but what is
//! about adapters renders on the reference device, so that none is needed.

mod bench;
mod check;
#[cfg(unix)]
mod checkpoint;
mod compare;
mod crop;
mod denoise;
mod develop;
mod exr;
#[cfg(target_os = "linux")]
mod faults;
mod glass;
mod merge;
mod outputs;
mod plot;
mod probe;
#[cfg(unix)]
#[path = "../support/random.rs"]
mod random;
#[cfg(unix)]
mod sequence;
mod settings;
#[cfg(unix)]
mod signals;
mod support;
#[cfg(unix)]
#[path = "../support/sweep.rs"]
mod sweep;

use abbe::output::SpectralImage;
use support::{Folder, SCENE, fails, text};

#[test]
fn a_scene_becomes_an_exr_and_a_picture() {
    let folder = Folder::new("render");
    let output = folder.run(&["render", "ball.json", "--device", "reference", "--spp", "16"]);
    let (stdout, stderr) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{stderr}");
    assert_eq!(folder.names(), ["ball.exr", "ball.json", "ball.png"]);
    for part in
        ["16 samples per pixel", "16 batches", "reference", "ball.exr", "ball.png", "dropped samples: 0 not finite, 0 negative"]
    {
        assert!(stdout.contains(part), "no '{part}' in {stdout}");
    }
    let image = SpectralImage::read(folder.0.join("ball.exr")).unwrap();
    assert_eq!((image.width, image.height, image.bins()), (8, 6, 4));
    assert_eq!(image.attribute("abbe.scene"), Some("ball"));
    assert_eq!(image.attribute("abbe.samples"), Some("16"));
    // The corner looks past the ball at the light.
    assert!(image.pixel(0).iter().all(|&v| (v - 1.0).abs() < 1e-6), "{:?}", image.pixel(0));
}

#[test]
fn options_override_the_scene() {
    let folder = Folder::new("options");
    let scene = "render ball.json --device reference --spp 3 --size 5x4 --channels 7 --max-depth 3";
    let rest = "--seed 9 --aov error -o out.EXR --quiet";
    let output = folder.run(&scene.split(' ').chain(rest.split(' ')).collect::<Vec<_>>());
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(output.stdout.is_empty() && output.stderr.is_empty());
    assert_eq!(folder.names(), ["ball.json", "out.EXR", "out.png"]);
    let image = SpectralImage::read(folder.0.join("out.EXR")).unwrap();
    assert_eq!((image.width, image.height, image.bins()), (5, 4, 7));
    assert_eq!(image.attribute("abbe.seed"), Some("9"));
    assert!(image.other("error.Y").is_some());
}

#[test]
fn aovs_are_in_the_file_where_asked_for() {
    let folder = Folder::new("aov");
    let render = |aov: &[&str]| {
        let output = folder.run(&[&["render", "ball.json", "--device", "reference", "--spp", "2", "--quiet"], aov].concat());
        assert!(output.status.success(), "{}", text(&output.stderr));
        let image = SpectralImage::read(folder.0.join("ball.exr")).unwrap();
        let named = |name: &&str| ["depth", "normal", "albedo", "error"].iter().any(|aov| name.starts_with(aov));
        let names: Vec<String> =
            image.others.iter().map(|(name, _)| name.as_str()).filter(|name| named(name)).map(str::to_string).collect();
        (image, names)
    };
    assert!(render(&[]).1.is_empty());
    assert_eq!(render(&["--aov", "depth"]).1, ["depth.Z"]);
    assert_eq!(render(&["--aov", "error"]).1.len(), 5);
    let (image, names) = render(&["--aov", "normal,albedo", "--aov", "depth"]);
    assert_eq!(names, ["albedo.B", "albedo.G", "albedo.R", "depth.Z", "normal.X", "normal.Y", "normal.Z"]);
    // The ball of radius 1 and reflectance 0.75, seen from 4 m; nothing in the corner.
    let at = |name: &str, pixel: usize| image.other(name).unwrap()[pixel];
    assert!((at("depth.Z", 3 * 8 + 4) - 3.05).abs() < 0.05, "{}", at("depth.Z", 3 * 8 + 4));
    assert!(at("normal.Z", 3 * 8 + 4) > 0.9 && (at("albedo.G", 3 * 8 + 4) - 0.75).abs() < 1e-6);
    assert!(["depth.Z", "normal.Z", "albedo.R"].iter().all(|name| at(name, 0) == 0.0));
    for (name, says) in [("abbe.depth", "along the ray"), ("abbe.normal", "world space"), ("abbe.albedo", "linear sRGB")] {
        assert!(image.attribute(name).unwrap().contains(says), "{name}");
    }
}

#[test]
fn the_same_seed_gives_the_same_spectra_and_another_does_not() {
    let folder = Folder::new("seed");
    let render = |seed: &str, out: &str| {
        let output = folder.run(&["render", "ball.json", "--device", "reference", "--spp", "4", "--seed", seed, "-o", out]);
        assert!(output.status.success(), "{}", text(&output.stderr));
        SpectralImage::read(folder.0.join(out)).unwrap().data
    };
    let first = render("1", "a.exr");
    assert_eq!(first, render("1", "b.exr"));
    assert_ne!(first, render("2", "c.exr"));
}

#[test]
fn json_is_one_object_on_standard_output() {
    let folder = Folder::new("json");
    let output = folder.run(&["render", "ball.json", "--device", "reference", "--error", "50%", "--json"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let value: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(value["ended"], "error");
    assert_eq!(value["exr"], "ball.exr");
    assert!(value["batches"].as_u64().unwrap() >= 16);
    assert!(value["rays"].as_u64().unwrap() > 0);
    assert!(value["relative_error"].as_f64().unwrap() <= 0.5);

    let output = folder.run(&["info", "ball.exr", "--json"]);
    let value: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&value["size"], &value["abbe.scene"]), (&"8x6".into(), &"ball".into()));
    assert_eq!(
        (&value["quantity"], &value["bins"]),
        (&"radiance, W m^-2 sr^-1 nm^-1".into(), &"4 over 380.00 to 780.00 nm".into())
    );
    for key in ["abbe.version", "abbe.sceneHash", "abbe.seed", "abbe.samples", "abbe.seconds", "abbe.droppedNotFinite", "EV"] {
        assert!(value[key].as_str().is_some_and(|text| !text.is_empty()), "{key}: {value}");
    }

    let reflective = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/fichet_reflective_20.exr");
    let output = folder.run(&["info", reflective]);
    assert!(text(&output.stdout).contains("  reflectance, 1\n"), "{}", text(&output.stdout));
}

#[test]
fn time_ends_a_render() {
    let folder = Folder::new("time");
    let output = folder.run(&["render", "ball.json", "--device", "reference", "--time", "0.2s", "--json"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let value: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(value["ended"], "time");
}

#[test]
fn info_check_and_devices_answer() {
    let folder = Folder::new("info");
    for (arguments, says) in [
        (&["info", "ball.json"][..], "8x6"),
        (&["check", "ball.json"], "no warnings"),
        (&["devices"], "reference"),
        (&["devices", "--json"], "\"reference\""),
        (&["--version"], env!("CARGO_PKG_VERSION")),
    ] {
        let output = folder.run(arguments);
        assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
        assert!(text(&output.stdout).contains(says), "{arguments:?}: {}", text(&output.stdout));
    }
    assert_eq!(folder.names(), ["ball.json"]);
}

#[test]
fn help_has_examples_everywhere() {
    let folder = Folder::new("help");
    for arguments in [
        &["--help"][..],
        &["render", "--help"],
        &["develop", "--help"],
        &["devices", "--help"],
        &["info", "--help"],
        &["check", "--help"],
        &["bench", "--help"],
        &["compare", "--help"],
        &["glass", "--help"],
        &["probe", "--help"],
    ] {
        let output = folder.run(arguments);
        let stdout = text(&output.stdout);
        assert!(output.status.success());
        assert!(stdout.contains("Examples:") && stdout.contains("  abbe "), "{arguments:?}: {stdout}");
    }
    // Every option is explained: no line holds an option alone.
    let output = folder.run(&["render", "--help"]);
    for line in text(&output.stdout).lines().filter(|line| line.trim_start().starts_with('-')) {
        assert!(line.trim().split("  ").filter(|part| !part.is_empty()).count() >= 2, "no help: {line}");
    }
}

#[test]
fn wrong_requests_fail_in_one_line_and_write_nothing() {
    let folder = Folder::new("wrong");
    std::fs::write(folder.0.join("broken.json"), "{").unwrap();
    std::fs::write(folder.0.join("empty.exr"), []).unwrap();
    std::fs::write(folder.0.join("broken.exr"), [0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0, 9, 9]).unwrap();
    let cases: &[(&[&str], &[&str])] = &[
        (&[], &["abbe --help"]),
        (&["rendr"], &["rendr", "render"]),
        (&["render"], &["SCENE", "--help"]),
        (&["render", "ball.json", "--frobnicate"], &["--frobnicate"]),
        (&["render", "ball.json", "--sp", "3"], &["'--sp' found; a similar argument", "--spp"]),
        (&["render", "ball.json", "--spp", "0"], &["--spp", "0"]),
        (&["render", "ball.json", "--spp", "many"], &["--spp", "many"]),
        (&["render", "ball.json", "--size", "640"], &["--size", "640x480"]),
        (&["render", "ball.json", "--size", "0x4"], &["--size", "640x480"]),
        (&["render", "ball.json", "--time", "soon"], &["--time", "30s"]),
        (&["render", "ball.json", "--error", "0"], &["--error", "2%"]),
        (&["render", "ball.json", "--channels", "401"], &["--channels", "400"]),
        (&["render", "ball.json", "--aov", "depth,shade"], &["--aov", "shade", "albedo"]),
        (&["render", "ball.json", "--quiet", "--json"], &["--quiet", "--json"]),
        (&["render", "missing.json"], &["missing.json"]),
        (&["render", "broken.json"], &["broken.json"]),
        (&["render", "ball.json", "-o", "ball.json", "--device", "reference"], &["ball.json", ".exr"]),
        (&["render", "ball.json", "--device", "no such device"], &["device"]),
        (&["render", "ball.json", "--size", "4000000000x4000000000", "--device", "reference"], &["4000000000"]),
        (&["info", "missing.exr"], &["missing.exr"]),
        (&["info", "broken.exr"], &["broken.exr", "EXR", "whole"]),
        (&["info", "empty.exr"], &["empty.exr", "EXR"]),
        (&["probe", "broken.exr", "0,0"], &["broken.exr", "EXR", "whole"]),
        (&["check", "broken.json"], &["broken.json"]),
        (&["bench"], &["scenes"]),
    ];
    for (arguments, says) in cases {
        fails(&folder, arguments, says);
    }
    assert_eq!(std::fs::read_to_string(folder.0.join("ball.json")).unwrap(), SCENE);
}

#[test]
fn outputs_are_tried_before_the_work() {
    let folder = Folder::new("outputs");
    std::fs::create_dir(folder.0.join("folder.exr")).unwrap();
    std::fs::create_dir(folder.0.join("picture.png")).unwrap();
    let start = std::time::Instant::now();
    for (output, says) in [("nowhere/a.exr", "nowhere"), ("folder.exr", "folder.exr"), ("picture.exr", "picture.png")] {
        fails(&folder, &["render", "ball.json", "-o", output, "--device", "reference", "--time", "1m"], &[says, "-o"]);
    }
    assert!(start.elapsed().as_secs() < 60, "it rendered first");
}

#[test]
fn a_failed_render_keeps_the_old_picture() {
    let folder = Folder::new("keep");
    std::fs::write(folder.0.join("ball.exr"), "old").unwrap();
    std::fs::write(folder.0.join("broken.json"), SCENE.replace("\"radius\": 1", "\"radius\": -1")).unwrap();
    fails(&folder, &["render", "broken.json", "-o", "ball.exr", "--device", "reference"], &["broken.json", "radius"]);
    assert_eq!(std::fs::read(folder.0.join("ball.exr")).unwrap(), b"old");
}

#[test]
fn a_closed_pipe_is_no_disaster() {
    let folder = Folder::new("pipe");
    for arguments in [&["--help"][..], &["info", "ball.json"], &["render", "ball.json", "--device", "reference", "--spp", "1"]] {
        let mut child = folder.command(arguments).spawn().unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        assert!(!text(&output.stderr).contains("panicked"), "{arguments:?}: {}", text(&output.stderr));
        assert_eq!(output.status.code(), Some(0), "{arguments:?}");
    }
    SpectralImage::read(folder.0.join("ball.exr")).unwrap();
}

#[cfg(unix)]
#[test]
fn a_pipe_in_place_of_a_file_is_refused_instead_of_waited_for() {
    let folder = Folder::new("fifo");
    assert!(std::process::Command::new("mkfifo").arg(folder.0.join("pipe")).status().unwrap().success());
    let sample = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/fichet_emissive_20.exr");
    for arguments in [
        &["info", "pipe"][..],
        &["check", "pipe"],
        &["probe", "pipe", "0,0"],
        &["compare", sample, "pipe"],
        &["develop", "pipe", "-o", "a.png"],
        &["develop", sample, "-o", "a.png", "--bands", "pipe"],
    ] {
        fails(&folder, arguments, &["pipe", "plain file"]);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn output_that_cannot_be_written_is_an_error() {
    let folder = Folder::new("full");
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let output = folder.command(&["glass", "N-BK7"]).stdout(full).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("standard output"), "{}", text(&output.stderr));
}

#[test]
fn a_scene_that_needs_more_memory_than_is_allowed_ends_in_one_line() {
    let folder = Folder::new("memory");
    let render = ["render", "ball.json", "--device", "reference", "--spp", "1", "--max-memory"];
    fails(&folder, &[&render[..], &["20K"]].concat(), &["more memory than the 20.0 KiB of --max-memory", "allow more"]);
    fails(&folder, &[&render[..], &["much"]].concat(), &["write a size, as in 500M or 2G"]);
    let output = folder.run(&[&render[..], &["1G"]].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
}

#[test]
fn control_characters_of_files_do_not_reach_the_terminal() {
    let folder = Folder::new("escapes");
    // As a name, and where the reader of pictures quotes what it found.
    std::fs::write(folder.0.join("evil.json"), SCENE.replace("\"ball\"", "\"ball\\u001b[31m\"")).unwrap();
    std::fs::write(folder.0.join("evil.hdr"), "#?RADIANCE\n\u{1b}[31mred\u{7}\n\nX").unwrap();
    std::fs::write(
        folder.0.join("hdr.json"),
        SCENE.replace("{\"constant\": {\"radiance\": 1}}", "{\"image\": {\"file\": \"evil.hdr\"}}"),
    )
    .unwrap();
    for arguments in [
        &["render", "evil.json", "--device", "reference", "--spp", "1"][..],
        &["check", "evil.json"],
        &["info", "evil.json"],
        &["render", "hdr.json"],
    ] {
        let output = folder.run(arguments);
        for bytes in [&output.stdout, &output.stderr] {
            let text = text(bytes);
            assert!(!text.contains(|c: char| c.is_control() && c != '\n' && c != '\t'), "{arguments:?}: {text:?}");
        }
    }
}
