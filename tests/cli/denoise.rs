//! `abbe denoise` and `abbe render --denoise`.

use crate::support::{Folder, SCENE, fails, text};
use abbe::output::{SpectralImage, write_image};

const RENDER: [&str; 8] = ["render", "ball.json", "--device", "reference", "--size", "16x12", "--spp", "16"];

fn run(folder: &Folder, arguments: &[&str]) -> String {
    let output = folder.run(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

fn bytes(folder: &Folder, name: &str) -> Vec<u8> {
    std::fs::read(folder.0.join(name)).unwrap()
}

#[test]
fn a_render_is_denoised_at_once_or_later_and_itself_left_as_it_is() {
    let folder = Folder::new("denoise");
    let said = run(&folder, &[&RENDER[..], &["--denoise", "-o", "once.exr"]].concat());
    assert!(said.contains("once.denoised.exr") && said.contains("once.denoised.png"), "{said}");
    run(&folder, &[&RENDER[..], &["--aov", "denoise", "-o", "later.exr"]].concat());
    let raw = SpectralImage::read(folder.0.join("later.exr")).unwrap();
    assert_eq!(raw.data, SpectralImage::read(folder.0.join("once.exr")).unwrap().data);
    let before = bytes(&folder, "later.exr");
    run(&folder, &["denoise", "later.exr", "-o", "later.denoised.exr"]);
    assert_eq!(before, bytes(&folder, "later.exr"));
    assert_eq!(bytes(&folder, "once.denoised.png"), bytes(&folder, "later.denoised.png"));
    let denoised = SpectralImage::read(folder.0.join("later.denoised.exr")).unwrap();
    assert_eq!(denoised.data, SpectralImage::read(folder.0.join("once.denoised.exr")).unwrap().data);
    assert_ne!(denoised.data, raw.data);
    // Of other channels those that are not for the denoiser alone stay, and errors are others.
    let names = |image: &SpectralImage| image.others.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    let kept: Vec<String> = names(&raw).into_iter().filter(|name| !name.starts_with("half.")).collect();
    assert_eq!(names(&denoised), kept);
    assert_eq!(denoised.other("depth.Z"), raw.other("depth.Z"));
    assert_ne!(denoised.other("error.Y"), raw.other("error.Y"));
    assert_eq!(denoised.attribute("abbe.scene"), Some("ball"));
    assert_eq!(denoised.attribute("EV"), raw.attribute("EV"));
    // The picture is that of the file.
    run(&folder, &["develop", "later.denoised.exr", "-o", "developed.png"]);
    assert_eq!(bytes(&folder, "developed.png"), bytes(&folder, "later.denoised.png"));
    // Depth and normals are those of all samples; the halves differ.
    assert!(raw.other("half.depth.Z").unwrap().iter().any(|v| *v != 0.0));
    // And what is denoised is not denoised again.
    fails(&folder, &["denoise", "later.denoised.exr", "-o", "twice.exr"], &["denoised already"]);
    fails(&folder, &["denoise", "later.exr", "-o", "later.exr"], &["would be replaced"]);
    fails(&folder, &["denoise", "later.exr", "-o", "later.png"], &[".exr"]);
}

#[test]
fn what_the_denoiser_lacks_is_named() {
    let folder = Folder::new("denoise-lacks");
    run(&folder, &[&RENDER[..], &["-o", "plain.exr"]].concat());
    fails(&folder, &["denoise", "plain.exr", "-o", "out.exr"], &["plain.exr", "half.430,000000nm", "--aov denoise"]);
    run(&folder, &[&RENDER[..7], &["1", "--aov", "denoise", "-o", "one.exr"]].concat());
    fails(&folder, &["denoise", "one.exr", "-o", "out.exr"], &["not finite", "two batches"]);
    fails(&folder, &["render", "ball.json", "--denoise", "--share", "1/2", "-o", "a.checkpoint"], &["share"]);
}

#[test]
fn one_batch_is_written_as_it_is_and_nothing_that_looks_denoised_is_left() {
    let folder = Folder::new("denoise-one");
    let render = |spp: &str, more: &[&str]| {
        let output = folder.run(&[&RENDER[..7], &[spp, "--denoise", "-o", "one.exr"], more].concat());
        assert!(output.status.success(), "{spp}: {}", text(&output.stderr));
        (text(&output.stdout), text(&output.stderr))
    };
    let files = ["one.exr", "one.png", "one.denoised.exr", "one.denoised.png"];
    let is_there = || files.map(|file| folder.0.join(file).exists());
    render("2", &[]);
    assert_eq!(is_there(), [true; 4]);
    let (said, warned) = render("1", &[]);
    assert_eq!(is_there(), [true, true, false, false], "those before were of another render");
    assert!(
        !said.contains("denoised") && warned.contains("one.exr is not denoised") && warned.contains("longer"),
        "{said}{warned}"
    );
    assert_eq!(SpectralImage::read(folder.0.join("one.exr")).unwrap().attribute("abbe.batches"), Some("1"));
    let said: serde_json::Value = serde_json::from_str(&render("1", &["--json"]).0).unwrap();
    assert_eq!(said["denoised"], serde_json::json!([]));
    assert!(said["warnings"].to_string().contains("not denoised"), "{said}");
    // A frame is done with that.
    let frame = || text(&folder.run(&[&RENDER[..7], &["1", "--denoise", "--frames", "3"]].concat()).stderr);
    assert!(frame().contains("ball.0003.exr is not denoised") && frame().contains("ball.0003.exr is done already"));
}

#[test]
fn a_render_that_goes_on_has_the_same_halves() {
    let folder = Folder::new("denoise-resume");
    let render = |spp: &str, name: &str, more: &[&str]| run(&folder, &[&RENDER[..7], &[spp, "-o", name], more].concat());
    render("24", "whole.exr", &["--denoise"]);
    render("8", "parts.exr", &["--denoise", "--keep-checkpoint"]);
    run(&folder, &["render", "--resume", "parts.exr", "--spp", "24"]);
    for name in ["whole.exr", "whole.denoised.exr"] {
        let parts = SpectralImage::read(folder.0.join(name.replace("whole", "parts"))).unwrap();
        let whole = SpectralImage::read(folder.0.join(name)).unwrap();
        assert_eq!(whole.data, parts.data, "{name}");
        assert_eq!(whole.others, parts.others, "{name}");
    }
    // A checkpoint without halves is not gone on with as if it had them.
    render("8", "none.exr", &["--keep-checkpoint"]);
    fails(&folder, &[&RENDER[..7], &["24", "--denoise", "--resume", "none.exr"]].concat(), &["halves"]);
}

#[test]
fn what_lies_behind_glass_is_kept_for_the_denoiser_alone() {
    let folder = Folder::new("denoise-behind");
    let names = |image: &SpectralImage, of: &str| image.others.iter().filter(|(name, _)| name.starts_with(of)).count();
    let read = |name: &str| SpectralImage::read(folder.0.join(name)).unwrap();
    run(&folder, &[&RENDER[..], &["--aov", "denoise", "-o", "bare.exr"]].concat());
    assert_eq!(names(&read("bare.exr"), "behind."), 0);
    // A pane before a part of the ball.
    let pane = r#"{"disc": {"center": [1, 0, 2], "normal": [0, 0, 1], "radius": 1}, "material": "pane"}, {"sphere""#;
    let scene = SCENE.replace(r#"{"sphere""#, pane);
    let scene = scene.replace(r#""white":"#, r#""pane": {"thin_dielectric": {"ior": 1.5}}, "white":"#);
    std::fs::write(folder.0.join("ball.json"), scene).unwrap();
    run(&folder, &[&RENDER[..], &["--aov", "depth,normal,albedo", "-o", "seen.exr"]].concat());
    assert_eq!(names(&read("seen.exr"), "behind."), 0);
    run(&folder, &[&RENDER[..], &["--aov", "denoise", "-o", "pane.exr"]].concat());
    let (bare, mut pane) = (read("bare.exr"), read("pane.exr"));
    assert_eq!((names(&pane, "behind."), names(&pane, "half.behind.")), (7, 7));
    assert!(pane.attribute("abbe.behind").unwrap().contains("neither smooth glass nor a mirror"));
    assert_ne!(pane.other("albedo.R"), bare.other("albedo.R"));
    assert_eq!(pane.other("behind.albedo.R"), bare.other("albedo.R"));
    assert!(pane.other("half.behind.depth.Z").unwrap().iter().any(|v| *v != 0.0));
    run(&folder, &["denoise", "pane.exr", "-o", "with.exr"]);
    assert_eq!(names(&read("with.exr"), "behind.") + names(&read("with.exr"), "half."), 0);
    // Of two seeds, what is seen and its halves are those of the one.
    run(&folder, &[&RENDER[..], &["--aov", "denoise", "--seed", "5", "-o", "other.exr"]].concat());
    run(&folder, &["merge", "pane.exr", "other.exr", "-o", "merged.exr"]);
    for name in ["depth.Z", "behind.depth.Z", "half.depth.Z", "half.behind.depth.Z"] {
        assert_eq!(read("merged.exr").other(name), pane.other(name), "{name}");
        assert_ne!(read("other.exr").other(name), pane.other(name), "{name}");
    }
    // Files of before, which have none, are denoised by what is seen first.
    pane.others.retain(|(name, _)| !name.contains("behind."));
    write_image(&folder.0.join("older.exr"), &pane).unwrap();
    run(&folder, &["denoise", "older.exr", "-o", "without.exr"]);
    assert_ne!(read("with.exr").data, read("without.exr").data);
    // Half of it is named as all else that is missing.
    pane.others.push(("behind.depth.Z".to_string(), vec![1.0; pane.width * pane.height]));
    write_image(&folder.0.join("half.exr"), &pane).unwrap();
    fails(&folder, &["denoise", "half.exr", "-o", "out.exr"], &["half.behind.depth.Z"]);
}
