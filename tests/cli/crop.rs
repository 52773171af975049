//! `--crop`: a part of a picture, in files that say where it lies.

use crate::support::{Folder, fails, text};
use abbe::output::{SpectralImage, Window};
use exr::prelude::Vec2;

const RENDER: [&str; 7] = ["render", "ball.json", "--device", "reference", "--spp", "16", "--quiet"];
const PART: [&str; 2] = ["--crop", "3,1,4,3"];

fn run(folder: &Folder, arguments: &[&str]) -> String {
    let output = folder.run(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stdout) + &text(&output.stderr)
}

#[test]
fn a_part_is_cut_from_the_whole_bit_by_bit() {
    let folder = Folder::new("crop");
    for (estimator, name) in [("backward", "a"), ("forward", "b")] {
        let reference = format!("reference={estimator}");
        let [whole, part] = ["whole", "part"].map(|of| format!("{name}-{of}.exr"));
        let more = ["--aov", "depth,normal", "--set", &reference, "-o"];
        run(&folder, &[&RENDER[..], &more, &[&whole]].concat());
        run(&folder, &[&RENDER[..], &PART, &more, &[&part]].concat());
        let [whole, part] = [whole, part].map(|name| SpectralImage::read(folder.0.join(name)).unwrap());
        assert_eq!(part.window, Window { x: 3, y: 1, size: [4, 3], picture: [8, 6] });
        let cut = whole.cut(part.window);
        assert_eq!(part.data, cut.data, "{estimator}");
        // Exposures are of the pictures.
        let others = ["XYZ.X", "XYZ.Y", "XYZ.Z", "depth.Z", "normal.X", "normal.Y", "normal.Z"];
        others.iter().for_each(|name| assert_eq!(part.other(name), cut.other(name), "{estimator}: {name}"));
    }
    // As any program finds it.
    let meta = exr::meta::MetaData::read_from_file(folder.0.join("a-part.exr"), true).unwrap();
    let header = &meta.headers[0];
    assert_eq!((header.own_attributes.layer_position, header.layer_size), (Vec2(3, 1), Vec2(4, 3)));
    let display = header.shared_attributes.display_window;
    assert_eq!((display.position, display.size), (Vec2(0, 0), Vec2(8, 6)));
    let mut png = image::open(folder.0.join("a-part.png")).unwrap();
    assert_eq!((png.width(), png.height()), (4, 3));

    // What reads such files counts in the picture.
    assert!(run(&folder, &["info", "a-part.exr"]).contains("4x3 from 3,1 of 8x6"));
    let [of_whole, of_part] = ["a-whole.exr", "a-part.exr"].map(|name| run(&folder, &["probe", name, "5,2"]));
    assert_eq!(of_whole, of_part);
    fails(&folder, &["probe", "a-part.exr", "2,2"], &["3,1 to 6,3"]);
    let compared = run(&folder, &["compare", "a-part.exr", "a-whole.exr", "--max-rel-mse", "0"]);
    assert!(compared.contains("4x3 from 3,1 of 8x6"), "{compared}");
    run(&folder, &["develop", "a-part.exr", "-o", "d.png"]);
    png = image::open(folder.0.join("d.png")).unwrap();
    assert_eq!((png.width(), png.height()), (4, 3));
    run(&folder, &[&RENDER[..], &PART, &["-o", "noisy.exr", "--denoise"]].concat());
    let denoised = SpectralImage::read(folder.0.join("noisy.denoised.exr")).unwrap();
    assert_eq!(denoised.window, Window { x: 3, y: 1, size: [4, 3], picture: [8, 6] });
}

#[test]
fn parts_go_on_and_are_merged_as_parts() {
    let folder = Folder::new("crop-parts");
    run(&folder, &[&RENDER[..], &PART, &["-o", "whole.exr"]].concat());
    run(
        &folder,
        &[
            "render",
            "ball.json",
            "--device",
            "reference",
            "--spp",
            "8",
            "--quiet",
            PART[0],
            PART[1],
            "-o",
            "a.exr",
            "--keep-checkpoint",
        ],
    );
    fails(&folder, &[&RENDER[..], &["--resume", "a.exr"]].concat(), &["another part of the picture"]);
    run(&folder, &["render", "--resume", "a.exr", "--spp", "16", "--quiet"]);
    let [whole, resumed] = ["whole.exr", "a.exr"].map(|name| SpectralImage::read(folder.0.join(name)).unwrap());
    assert_eq!((whole.window, &whole.data), (resumed.window, &resumed.data));
    for share in ["1/2", "2/2"] {
        let file = format!("{}.checkpoint", &share[..1]);
        run(&folder, &[&RENDER[..], &PART, &["--share", share, "-o", &file]].concat());
    }
    run(&folder, &["merge", "1.checkpoint", "2.checkpoint", "-o", "merged.exr"]);
    assert_eq!(SpectralImage::read(folder.0.join("merged.exr")).unwrap().window, whole.window);
    run(&folder, &[&RENDER[..], &PART, &["--seed", "1", "-o", "one.exr"]].concat());
    run(&folder, &[&RENDER[..], &["--crop", "2,1,4,3", "--seed", "2", "-o", "two.exr"]].concat());
    run(&folder, &["merge", "whole.exr", "one.exr", "-o", "seeds.exr"]);
    assert_eq!(SpectralImage::read(folder.0.join("seeds.exr")).unwrap().window, whole.window);
    fails(&folder, &["merge", "whole.exr", "two.exr", "-o", "x.exr"], &["another size", "4x3 from 2,1"]);
}

#[test]
fn what_is_no_part_is_refused_and_check_says_what_one_is() {
    let folder = Folder::new("crop-none");
    for part in ["5,1,4,3", "0,4,1,3", "8,0,1,1", "0,0,9,1"] {
        fails(&folder, &["check", "ball.json", "--crop", part], &["no part of a picture of 8x6"]);
    }
    fails(&folder, &["check", "ball.json", "--crop", "1,1,0,3"], &["x,y,width,height"]);
    let glass = ["--set", "materials.white={\"dielectric\": {\"ior\": 1.5}}"];
    let checked = run(&folder, &[&["check", "ball.json"], &PART[..], &glass].concat());
    assert!(checked.contains("4x3 pixels from 3,1 of 8x6, 25.00 %"), "{checked}");
}
