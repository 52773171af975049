//! `--set`: keys of the scene file from the command line.

use crate::support::{Folder, fails, text};
use abbe::output::SpectralImage;

fn bins(folder: &Folder, arguments: &[&str]) -> Vec<f32> {
    let output = folder.run(&[&["render"], arguments, &["--device", "reference", "--quiet"]].concat());
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    SpectralImage::read(folder.0.join(arguments[2])).unwrap().data
}

#[test]
fn a_key_that_is_set_is_as_if_it_stood_in_the_file() {
    let folder = Folder::new("set");
    let scene = std::fs::read_to_string(folder.0.join("ball.json")).unwrap();
    let mut document: serde_json::Value = serde_json::from_str(&scene).unwrap();
    document["film"]["bins"] = 6.into();
    document["max_depth"] = 3.into();
    std::fs::write(folder.0.join("changed.json"), document.to_string()).unwrap();
    let set = ["--set", "film.bins=6", "--set", "max_depth=3"];
    let changed = bins(&folder, &["changed.json", "-o", "a.exr", "--spp", "16"]);
    let through_options = bins(&folder, &[&["ball.json", "-o", "b.exr", "--spp", "16"], &set[..]].concat());
    assert_eq!(changed, through_options);
    assert_ne!(changed, bins(&folder, &["ball.json", "-o", "c.exr", "--spp", "16"]));
    // A render that goes on has the same keys, and one with others is another scene.
    bins(&folder, &[&["ball.json", "-o", "d.exr", "--spp", "8", "--keep-checkpoint"], &set[..]].concat());
    fails(&folder, &["render", "ball.json", "--resume", "d.exr", "--device", "reference", "--spp", "16"], &["scene's files"]);
    let output = folder.run(&["render", "--resume", "d.exr", "--spp", "16", "--quiet"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(changed, SpectralImage::read(folder.0.join("d.exr")).unwrap().data);
}

#[test]
fn wrong_keys_are_errors_as_in_the_file() {
    let folder = Folder::new("set-wrong");
    fails(&folder, &["check", "ball.json", "--set", "film.bnis=6"], &["$.film", "bnis", "bins"]);
    fails(&folder, &["check", "ball.json", "--set", "film.bins=many"], &["$.film.bins"]);
    fails(&folder, &["check", "ball.json", "--set", "film.bins"], &["sets nothing"]);
    fails(&folder, &["check", "ball.json", "--set", "shapes[99].material=red"], &["shapes[99]", "no element 99"]);
    let glb = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/bunny.glb");
    fails(&folder, &["check", glb, "--set", "film.bins=6"], &["a glTF file has none"]);
}
