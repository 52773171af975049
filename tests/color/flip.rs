//! FLIP against the authors' own evaluator (flip-evaluator 1.7, low dynamic range, 67.02 pixels per degree) on pictures made by formulas.

use abbe::compare::flip::{PIXELS_PER_DEGREE, flip};

fn picture(width: usize, height: usize, k: f64) -> Vec<[f32; 3]> {
    let pixel = |p: usize| {
        let (x, y) = ((p % width) as f64, (p / width) as f64);
        let r = 0.5 + 0.5 * (0.31 * x + 0.1 * k).sin() * (0.17 * y).cos();
        let g = (x * 7.0 + y * 13.0 + k * 5.0) % 32.0 / 31.0;
        let b = if (x - 20.0).powi(2) + (y - 15.0 - k).powi(2) < 81.0 { 0.9 } else { 0.1 + 0.004 * x };
        [r, g, b].map(|v| v as f32)
    };
    (0..width * height).map(pixel).collect()
}

fn mean(map: &[f32]) -> f64 {
    map.iter().map(|v| f64::from(*v)).sum::<f64>() / map.len() as f64
}

fn near(what: &str, value: impl Into<f64>, expected: f64) {
    let value = value.into();
    assert!((value - expected).abs() < 1e-4, "{what}: {value} is not {expected}");
}

#[test]
fn the_map_is_that_of_the_authors() {
    for ((width, height, k), average, greatest, at_20_10, first, last) in [
        ((48, 40, 1.0), 0.27617022, 0.87580335, 0.22764257, 0.56302786, 0.1452323),
        ((48, 40, 3.0), 0.36906126, 0.8600526, 0.49815068, 0.8600526, 0.48458835),
        ((64, 16, 6.0), 0.43204112, 0.8930415, 0.7903566, 0.8930415, 0.3788172),
    ] {
        let map = flip(&picture(width, height, 0.0), &picture(width, height, k), width, PIXELS_PER_DEGREE);
        let what = format!("{width}x{height}, {k}");
        near(&what, mean(&map), average);
        near(&what, map.iter().copied().fold(0.0, f32::max), greatest);
        near(&what, map[10 * width + 20], at_20_10);
        near(&what, map[0], first);
        near(&what, map[map.len() - 1], last);
    }
}

#[test]
fn plain_colours_differ_as_published_and_a_dot_stays_where_it_is() {
    let plain = |rgb: [f32; 3]| vec![rgb; 400];
    let between = |a: Vec<[f32; 3]>, b: Vec<[f32; 3]>| mean(&flip(&a, &b, 20, PIXELS_PER_DEGREE));
    near("black, white", between(plain([0.0; 3]), plain([1.0; 3])), 0.96738619);
    near("green, blue", between(plain([0.0, 1.0, 0.0]), plain([0.0, 0.0, 1.0])), 1.0);
    assert_eq!(between(picture(20, 20, 2.0), picture(20, 20, 2.0)), 0.0);
    assert_eq!(between(plain([1.0; 3]), plain([5.0; 3])), 0.0, "what is brighter than white is white");

    let mut dot = plain([0.0; 3]);
    dot[10 * 20 + 10] = [1.0; 3];
    let map = flip(&plain([0.0; 3]), &dot, 20, PIXELS_PER_DEGREE);
    near("all", mean(&map), 0.03577321);
    near("the dot", map[10 * 20 + 10], 0.8649065);
    near("beside it", map[10 * 20 + 14], 0.018017033);
}
