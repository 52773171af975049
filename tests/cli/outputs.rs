//! What is read is never written over, whatever names and links say.

use crate::support::{Folder, fails, text, write_film};

/// A scene whose floor is the picture `wood.png`, named as what it would render to.
fn textured(folder: &Folder) {
    let scene = r#"{"film": {"width": 8, "height": 6, "bins": 4},
        "camera": {"orthographic": {"eye": [0.5, 0.5, 4], "target": [0.5, 0.5, 0], "height": 1}},
        "materials": {"wood": {"diffuse": {"reflectance": {"texture": "wood.png"}}}},
        "shapes": [{"quad": {"corner": [0, 0, 0], "edge_u": [1, 0, 0], "edge_v": [0, 1, 0]}, "material": "wood"}],
        "lights": [{"constant": {"radiance": 1}}]}"#;
    std::fs::write(folder.0.join("wood.json"), scene).unwrap();
    let sky = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/scenes/sky.png");
    std::fs::copy(sky, folder.0.join("wood.png")).unwrap();
}

const QUICK: [&str; 5] = ["--device", "reference", "--spp", "1", "--quiet"];

#[test]
fn a_render_replaces_no_file_of_its_scene() {
    let folder = Folder::new("inputs");
    textured(&folder);
    let picture = std::fs::read(folder.0.join("wood.png")).unwrap();
    let render = |more: &[&'static str]| [&["render", "wood.json"], &QUICK[..], more].concat();
    // By default the picture of wood.json goes to wood.png.
    fails(&folder, &render(&[]), &["wood.png", "one of the files to be read", "choose another name with -o"]);
    assert_eq!(std::fs::read(folder.0.join("wood.png")).unwrap(), picture);
    let output = folder.run(&render(&["-o", "floor.exr"]));
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(std::fs::read(folder.0.join("wood.png")).unwrap(), picture);
}

#[cfg(unix)]
#[test]
fn a_render_replaces_no_scene_by_way_of_a_link() {
    let folder = Folder::new("linked");
    let scene = std::fs::read(folder.0.join("ball.json")).unwrap();
    std::os::unix::fs::symlink("ball.json", folder.0.join("out.exr")).unwrap();
    let arguments = [&["render", "ball.json", "-o", "out.exr"], &QUICK[..]].concat();
    fails(&folder, &arguments, &["out.exr", "one of the files to be read"]);
    assert_eq!(std::fs::read(folder.0.join("ball.json")).unwrap(), scene);
}

#[test]
fn other_commands_replace_nothing_that_they_read() {
    let folder = Folder::new("read");
    write_film(&folder.0.join("a.exr"), (2, 2, 4), &[&|_, _| 1.0, &|_, _| 1.0]);
    std::fs::write(folder.0.join("bands.svg"), "S0.430,000000nm 380 480\n").unwrap();
    let said = "one of the files to be read";
    fails(&folder, &["develop", "a.exr", "-o", "a.exr"], &["a.exr", said]);
    fails(&folder, &["develop", "a.exr", "-o", "./a.exr"], &["a.exr", said]);
    fails(&folder, &["bench", "ball.json", "-o", "ball.json"], &["ball.json", said]);
    fails(&folder, &["probe", "a.exr", "0,0", "--bands", "bands.svg", "-o", "bands.svg"], &["bands.svg", said]);
}
