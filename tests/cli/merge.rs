//! Renders of different seeds become one file.

use crate::support::{Folder, SCENE, fails, text};
use abbe::output::SpectralImage;
use std::process::Output;

fn run(folder: &Folder, arguments: &str) -> Output {
    let output = folder.run(&arguments.split_whitespace().collect::<Vec<_>>());
    assert!(output.status.success(), "{arguments}: {}", text(&output.stderr));
    output
}

fn render(folder: &Folder, arguments: &str) {
    run(folder, &format!("render ball.json --device reference --quiet {arguments}"));
}

fn image(folder: &Folder, name: &str) -> SpectralImage {
    SpectralImage::read(folder.0.join(name)).unwrap()
}

/// Samples of the seeds 7, 2 and 5.
const SEEDS: [(u32, u32); 3] = [(7, 16), (2, 80), (5, 32)];

fn seeds(name: &str, aov: &str) -> Folder {
    let folder = Folder::new(name);
    for (seed, spp) in SEEDS {
        render(&folder, &format!("--seed {seed} --spp {spp} --aov {aov} -o s{seed}.exr"));
    }
    folder
}

#[test]
fn means_of_seeds_weigh_by_samples_and_errors_by_their_squares() {
    let folder = seeds("seeds", "error,depth");
    run(&folder, "merge s7.exr s2.exr s5.exr -o merged.exr");
    let (merged, parts) = (image(&folder, "merged.exr"), SEEDS.map(|(seed, _)| image(&folder, &format!("s{seed}.exr"))));
    let weights = SEEDS.map(|(_, spp)| f64::from(spp) / 128.0);
    let near = |a: f32, b: f64| assert!((f64::from(a) - b).abs() <= 2e-7 * b.abs(), "{a} {b}");
    for (i, value) in merged.data.iter().enumerate() {
        near(*value, parts.iter().zip(weights).map(|(part, w)| w * f64::from(part.data[i])).sum());
    }
    let mut kinds = [0; 4];
    for (name, values) in &merged.others {
        let of = |pixel: usize| parts.each_ref().map(|part| f64::from(part.other(name).unwrap()[pixel])).into_iter().zip(weights);
        for (pixel, value) in values.iter().enumerate() {
            match name.split('.').next().unwrap() {
                "XYZ" => near(*value, of(pixel).map(|(x, w)| w * x).sum()),
                "error" => near(*value, of(pixel).map(|(e, w)| (w * e).powi(2)).sum::<f64>().sqrt()),
                // The second of the three has the least seed.
                "depth" => assert_eq!(*value, parts[1].other(name).unwrap()[pixel]),
                _ => continue,
            }
        }
        let kind = ["XYZ", "error", "depth"].iter().position(|kind| name.starts_with(kind)).unwrap_or(3);
        kinds[kind] += 1;
    }
    assert_eq!(kinds, [3, 5, 1, 3], "XYZ, errors of Y and four bins, depth, and R G B");
    let said = |name: &str| merged.attribute(name).unwrap();
    assert_eq!((said("abbe.samples"), said("abbe.batches")), ("128", "68"));
    assert_eq!((said("abbe.seed"), said("abbe.samplesOfSeeds")), ("2 5 7", "80 32 16"));
    let errors =
        |image: &SpectralImage| image.attribute("abbe.meanErrors").unwrap().split(' ').map(|e| e.parse().unwrap()).collect();
    let of_parts: [Vec<f64>; 3] = parts.each_ref().map(errors);
    for (b, error) in errors(&merged).into_iter().enumerate() {
        let expected = of_parts.iter().zip(weights).map(|(e, w): (&Vec<f64>, f64)| (w * e[b]).powi(2)).sum::<f64>().sqrt();
        near(error as f32, expected);
    }
    // The picture is that of the file.
    run(&folder, "develop merged.exr -o again.png");
    let bytes = |name: &str| std::fs::read(folder.0.join(name)).unwrap();
    assert_eq!(bytes("again.png"), bytes("merged.png"));
}

#[test]
fn the_order_of_seeds_changes_nothing_and_merged_ones_merge_again() {
    let folder = seeds("seed-order", "error");
    run(&folder, "merge s7.exr s2.exr s5.exr -o a.exr");
    run(&folder, "merge s5.exr s7.exr s2.exr -o b.exr");
    assert_eq!(image(&folder, "a.exr"), image(&folder, "b.exr"));
    run(&folder, "merge s7.exr s5.exr -o first.exr");
    run(&folder, "merge first.exr s2.exr -o c.exr");
    let (once, twice) = (image(&folder, "a.exr"), image(&folder, "c.exr"));
    for name in ["abbe.seed", "abbe.samplesOfSeeds", "abbe.samples", "abbe.rays"] {
        assert_eq!(once.attribute(name), twice.attribute(name));
    }
    let values = |image: &SpectralImage| [image.data.clone(), image.errors().unwrap()].concat();
    for (a, b) in values(&once).into_iter().zip(values(&twice)) {
        assert!((a - b).abs() <= 1e-6 * b.abs(), "{a} {b}");
    }
    fails(&folder, &["merge", "a.exr", "s5.exr", "-o", "d.exr"], &["s5.exr", "seed 5", "a.exr", "the same random numbers"]);
}

#[test]
fn what_cannot_be_merged_is_refused_by_what_differs() {
    let folder = Folder::new("other-seeds");
    render(&folder, "--spp 2 --seed 1 --aov error -o a.exr");
    // Seeds fold to 32 bits.
    render(&folder, "--spp 2 --seed 4294967296 -o folded.exr");
    render(&folder, "--spp 2 --seed 2 -o plain.exr");
    let changes = [
        ("--size 9x6", "size"),
        ("--channels 5", "number of bins"),
        ("--max-depth 3", "greatest depth"),
        ("--without merging", "techniques"),
    ];
    for (change, says) in changes {
        render(&folder, &format!("--spp 2 --seed 2 {change} -o b.exr"));
        fails(&folder, &["merge", "a.exr", "b.exr", "-o", "c.exr"], &["b.exr", says, "a.exr"]);
    }
    std::fs::write(folder.0.join("ball.json"), SCENE.replace("0.75", "0.5")).unwrap();
    render(&folder, "--spp 2 --seed 2 -o b.exr");
    fails(&folder, &["merge", "a.exr", "b.exr", "-o", "c.exr"], &["b.exr", "content of the scene's files", "a.exr"]);
    fails(&folder, &["merge", "a.exr", "folded.exr", "-o", "c.exr"], &["4294967296", "the same random numbers as seed 1"]);
    let foreign = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/fichet_emissive_20.exr");
    fails(&folder, &["merge", "a.exr", foreign, "-o", "c.exr"], &["does not say its seed", "oiiotool"]);
    fails(&folder, &["merge", "a.exr", "none.exr", "-o", "c.exr"], &["none.exr", "cannot read"]);
    fails(&folder, &["merge", "a.exr", "plain.exr", "-o", "a.exr"], &["a.exr", "one of the files to be read"]);

    // Errors are there where all have them.
    let some = run(&folder, "merge a.exr plain.exr -o some.exr");
    assert!(text(&some.stderr).contains("plain.exr has no errors"), "{}", text(&some.stderr));
    assert!(image(&folder, "some.exr").errors().is_none());
}
