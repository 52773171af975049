//! `abbe denoise` and `abbe render --denoise`.

use crate::support::{Folder, fails, text};
use abbe::output::SpectralImage;

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
