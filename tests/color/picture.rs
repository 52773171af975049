//! The picture: spaces, white balance, tone curves, and colours that a screen cannot show.

use abbe::color::adapt::{self, Method, White};
use abbe::color::cie::{self, xyz_of_xy};
use abbe::color::convert;
use abbe::color::space::{D65, Space};
use abbe::compare::lab::{delta_e_2000, lab_of_xyz};
use abbe::develop::gamut::Gamut;
use abbe::develop::oklab::{hue_degrees, oklab_of_xyz};
use abbe::develop::picture::{AUTO_SHARE, Developer, Development, Whole, auto_exposure};
use abbe::develop::tone::{Tone, ToneCurve};
use abbe::spectrum::library::{self, Observer};

const SPACES: [Space; 4] = [Space::Srgb, Space::DisplayP3, Space::Rec2020, Space::AcesCg];

fn unit() -> f64 {
    cie::xyz_of_unit(Observer::Cie1931)[1]
}

fn pixel(xyz: [f64; 3]) -> [f32; 3] {
    xyz.map(|v| (v * unit()) as f32)
}

fn pixel_of_rgb(rgb: [f64; 3]) -> [f32; 3] {
    pixel(convert::xyz_of_linear_srgb(rgb))
}

/// Rounded, not dithered.
fn encoded(d: &Development, xyz: &[[f32; 3]], most: u16) -> Vec<[u16; 3]> {
    Developer::new(d).encoded(xyz, Whole { most, dither: false, width: xyz.len() })
}

fn bytes(xyz: &[[f32; 3]], exposure: f64) -> Vec<[u16; 3]> {
    encoded(&Development { exposure, ..Development::default() }, xyz, 255)
}

fn assert_near(a: &[f64], b: &[f64], tolerance: f64, what: &str) {
    assert_eq!(a.len(), b.len(), "{what}");
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance), "{what}: {a:?} is not {b:?} to {tolerance}");
}

fn level(v: f64) -> u16 {
    (255.0 * convert::srgb_encode(v)).round() as u16
}

#[test]
fn the_picture_is_plain_srgb_where_the_screen_can_show_it() {
    for rgb in [[0.0, 0.0, 0.0], [0.2, 0.5, 0.1], [0.9, 0.0, 0.0], [0.01, 0.02, 0.9]] {
        let expected = rgb.map(level);
        assert_eq!(bytes(&[pixel_of_rgb(rgb)], 0.0), [expected]);
        assert_eq!(bytes(&[pixel_of_rgb(rgb.map(|v| v / 8.0))], 3.0), [expected], "three stops");
    }
}

#[test]
fn spaces_are_their_published_matrices_and_curves() {
    // Made with colour-science 0.4.7 from primaries and white.
    let known = [
        (Space::DisplayP3, [[0.486570948648, 0.265667693169, 0.198217285234], [0.228974564070, 0.691738521837, 0.079286914094]]),
        (Space::Rec2020, [[0.636958048301, 0.144616903586, 0.168880975164], [0.262700212011, 0.677998071519, 0.059301716470]]),
        (Space::AcesCg, [[0.662454181109, 0.134004206456, 0.156187687005], [0.272228716781, 0.674081765811, 0.053689517408]]),
    ];
    for (space, rows) in known {
        for (row, expected) in space.to_xyz().iter().zip(&rows) {
            assert_near(row, expected, 1e-11, &format!("{space:?}"));
        }
    }
    for (v, expected) in [(0.01, 0.045), (0.18, 0.408_846_402_5), (0.5, 0.705_434_702_8), (1.0, 1.0)] {
        assert!((Space::Rec2020.transfer().encode(v) - expected).abs() < 1e-5, "{v}");
    }
    for space in SPACES {
        let t = space.transfer();
        for v in [-0.3, 0.0, 1e-4, 0.003, 0.02, 0.4, 1.0, 5.0] {
            assert!((t.decode(t.encode(v)) - v).abs() < 1e-6, "{space:?} {v}");
        }
        for other in SPACES {
            assert_near(&convert::apply(&space.to(other), [1.0; 3]), &[1.0; 3], 1e-9, "white stays white");
        }
    }
}

#[test]
fn white_balance_is_bradford_or_cat16_and_makes_lamps_white() {
    let (a, d65) = (xyz_of_xy([0.44757, 0.40745]), xyz_of_xy(D65));
    // Made with colour-science 0.4.7.
    let known = [
        (Method::Bradford, [[0.8446800065, -0.1179368550, 0.3949731588], [-0.1366338568, 1.1041074614, 0.1292221696]]),
        (Method::Cat16, [[0.9506864668, -0.1873858839, 0.2628976682], [-0.0256671404, 1.0323098336, -0.0115657310]]),
    ];
    for (method, rows) in known {
        for (row, expected) in adapt::matrix(a, d65, method).iter().zip(&rows) {
            assert_near(row, expected, 1e-9, &format!("{method:?}"));
        }
        for observer in [Observer::Cie1931, Observer::Cie1964] {
            let lamps = ["A", "FL11", "LED-B3"].map(|name| White::illuminant(name).expect("a lamp"));
            let others = [White::blackbody(3200.0), White::Chromaticity([0.4, 0.35])];
            for white in lamps.into_iter().chain(others) {
                for space in SPACES {
                    let d = Development {
                        observer,
                        white: Some(white.clone()),
                        method,
                        space,
                        gamut: Gamut::Keep,
                        ..Development::default()
                    };
                    let light = white.xyz(observer).map(|v| (0.5 * cie::xyz_of_unit(observer)[1] * v) as f32);
                    assert_near(&Developer::new(&d).linear(light), &[0.5; 3], 1e-6, &format!("{white:?} in {space:?}"));
                }
            }
        }
    }
    // D65 is white where nothing is asked for, for either observer.
    for observer in [Observer::Cie1931, Observer::Cie1964] {
        let d = Development { observer, gamut: Gamut::Keep, ..Development::default() };
        let light = White::illuminant("D65").expect("D65").xyz(observer).map(|v| (cie::xyz_of_unit(observer)[1] * v) as f32);
        assert_near(&Developer::new(&d).linear(light), &[1.0; 3], 5e-4, "D65");
    }
}

/// Equal radiance of every nm from 400 to 700.
fn spectrum(gain: f64) -> Vec<(f64, [f32; 3])> {
    let line = |nm: f64| library::observer(Observer::Cie1931).eval(nm).map(|v| v * gain);
    (400..=700).map(|nm| (f64::from(nm), pixel(line(f64::from(nm))))).collect()
}

/// Hue in degrees on the screen's own circle: red 0, green 120, blue 240.
fn screen_hue([r, g, b]: [f64; 3]) -> f64 {
    (3f64.sqrt() * (g - b)).atan2(2.0 * r - g - b).to_degrees().rem_euclid(360.0)
}

/// A spectrum as shown: wavelength, linear RGB, and 16 bits.
type Shown = (f64, [f64; 3], [u16; 3]);

fn show_spectrum(d: &Development, gain: f64) -> Vec<Shown> {
    let (nm, xyz): (Vec<f64>, Vec<[f32; 3]>) = spectrum(gain).into_iter().unzip();
    let developer = Developer::new(d);
    let bits = developer.encoded(&xyz, Whole { most: 65535, dither: false, width: xyz.len() });
    nm.into_iter().zip(xyz).zip(bits).map(|((nm, xyz), bits)| (nm, developer.linear(xyz), bits)).collect()
}

/// What is wrong with it: the hue turns back or stands still, or a colour comes twice.
fn faults(space: Space, shown: &[Shown]) -> Vec<String> {
    let mut faults = Vec::new();
    let hue = |linear| hue_degrees(oklab_of_xyz(convert::apply(&space.to_xyz(), linear)));
    for w in shown.windows(2) {
        let turned = (hue(w[0].1) - hue(w[1].1) + 180.0).rem_euclid(360.0) - 180.0;
        if turned <= 1e-4 {
            faults.push(format!("{} nm: the hue turns by {turned}", w[1].0));
        }
        if w[0].2 == w[1].2 {
            faults.push(format!("{} nm: {:?} twice", w[1].0, w[1].2));
        }
    }
    faults
}

#[test]
fn a_rainbow_shows_its_colours_in_order_without_bands() {
    for space in [Space::Srgb, Space::DisplayP3, Space::Rec2020] {
        for gain in [0.05, 0.3, 1.0, 3.0] {
            let walk = |gamut| {
                let all = show_spectrum(&Development { space, gamut, ..Development::default() }, gain);
                // Beyond, the light itself hardly changes its chromaticity.
                all.into_iter().filter(|(nm, ..)| (410.0..=690.0).contains(nm)).collect::<Vec<_>>()
            };
            let shown = walk(Gamut::Map);
            let found = faults(space, &shown);
            assert!(found.is_empty(), "{space:?}, {gain}: {found:?}");
            // Cutting off what is negative does show bands, so the comparison can tell. Rec.2020's primaries are spectral.
            assert!(faults(space, &walk(Gamut::Clip)).len() > 20 || space == Space::Rec2020, "{space:?}, {gain}");

            // Names by the hue on an sRGB screen; each for some nm, in this order.
            if space == Space::Srgb {
                let names = [("violet", 253.0..300.0), ("blue", 205.0..253.0), ("cyan", 165.0..205.0), ("green", 75.0..165.0)];
                let more = [("yellow", 45.0..75.0), ("orange", 12.0..45.0), ("red", -15.0..12.0)];
                let name = |linear: [f64; 3]| {
                    let max = linear.into_iter().fold(0.0, f64::max);
                    let hue = screen_hue(linear.map(|v| convert::srgb_encode(v / max)));
                    let hue = if hue > 345.0 { hue - 360.0 } else { hue };
                    names.iter().chain(&more).find(|(_, range)| range.contains(&hue)).map_or("none", |(name, _)| *name)
                };
                let mut order: Vec<(&str, u32)> = Vec::new();
                for (_, linear, _) in &shown {
                    match order.last_mut() {
                        Some((last, count)) if *last == name(*linear) => *count += 1,
                        _ => order.push((name(*linear), 1)),
                    }
                }
                assert_eq!(
                    order.iter().map(|o| o.0).collect::<Vec<_>>(),
                    ["violet", "blue", "cyan", "green", "yellow", "orange", "red"]
                );
                assert!(order.iter().all(|o| o.1 >= 5), "{order:?}");
                // Red is not pink: hardly any green or blue in it.
                for (nm, _, [r, g, b]) in shown.iter().filter(|(nm, ..)| *nm >= 615.0) {
                    assert!(f64::from(*g.max(b)) < 0.17 * f64::from(*r), "{nm} nm: {r} {g} {b}");
                }
            }
        }
    }
}

#[test]
fn colours_outside_keep_lightness_and_nearly_their_hue() {
    for space in SPACES {
        let developer = Developer::new(&Development { space, ..Development::default() });
        let to_srgb = convert::multiply(&Space::Srgb.to_xyz(), &space.to(Space::Srgb));
        let (mut compared, mut last) = (0, 0.0);
        for (nm, xyz) in spectrum(0.1) {
            let rgb = developer.linear(xyz);
            assert!(rgb.iter().all(|v| (0.0..=1.0).contains(v)), "{space:?} {nm} nm: {rgb:?}");
            let own = oklab_of_xyz(xyz.map(|v| f64::from(v) / unit()));
            let shown = oklab_of_xyz(convert::apply(&to_srgb, rgb));
            // The spaces' D65 is rounded, ACEScg's white is another: the balance of white moves lightness a little.
            let tolerance = if space == Space::AcesCg { 0.05 } else { 2e-4 };
            assert!((shown[0] / own[0] - 1.0).abs() < tolerance, "{space:?} {nm} nm: lightness {} to {}", own[0], shown[0]);
            let turn = (hue_degrees(shown) - hue_degrees(own) + 180.0).rem_euclid(360.0) - 180.0;
            assert!(turn.abs() < 30.0, "{space:?} {nm} nm: the hue turns by {turn}");
            compared += 1;
            last = shown[0];
        }
        assert!(compared == 301 && last > 0.0);
        // Brighter light of one colour is never shown darker, and nothing jumps at the border of the gamut.
        for (_, xyz) in spectrum(1.0).into_iter().step_by(10) {
            let sum = |k: f32| developer.linear(xyz.map(|v| v * k)).iter().sum::<f64>();
            let levels: Vec<f64> = (0..200).map(|i| sum(0.05 * i as f32)).collect();
            assert!(levels.windows(2).all(|w| w[0] <= w[1] + 1e-6));
            let white = pixel([0.9505, 1.0, 1.089]);
            let mixed = |t: f32| developer.linear(std::array::from_fn(|i| 0.3 * (t * xyz[i] + (1.0 - t) * white[i])));
            for i in 0..1000 {
                let (a, b) = (mixed(0.001 * i as f32), mixed(0.001 * (i + 1) as f32));
                assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 0.012), "{space:?}: {a:?} to {b:?}");
            }
        }
    }
}

#[test]
fn highlights_never_invert_and_keep_their_hue() {
    let ramp: Vec<[f32; 3]> = (0..400).map(|i| pixel_of_rgb([f64::from(i) / 40.0; 3])).collect();
    let levels: Vec<u16> = bytes(&ramp, 0.0).iter().map(|p| p[1]).collect();
    assert!(levels.is_sorted() && levels[399] == 255);
    assert_eq!(bytes(&[pixel_of_rgb([1.0; 3])], 0.0)[0][0], level(1.0 - 0.1 * (-1.0f64).exp()));
    let red = bytes(&[pixel_of_rgb([50.0, 1.0, 1.0])], 0.0)[0];
    assert!(red[0] > 250 && red[1] < 60 && red[1] == red[2], "{red:?}");
    let bad = [[f32::NAN, 1.0, 1.0], [1e4, f32::INFINITY, 1.0], [0.0, -1.0, 0.0], [f32::MAX; 3]];
    for gamut in [Gamut::Map, Gamut::Clip, Gamut::Keep] {
        for tone in [Tone::None, Tone::Reinhard, Tone::Aces, Tone::AgX] {
            let d = Development { gamut, tone, ..Development::default() };
            assert_eq!(encoded(&d, &bad, 255)[..3], [[0; 3]; 3]);
            assert!(Developer::new(&d).linear(bad[3]).iter().all(|v| v.is_finite()), "{gamut:?} {tone:?}");
        }
    }
}

#[test]
fn tone_curves_are_those_of_their_authors() {
    // Hill's matrices for sRGB, as he rounds them.
    let into = [[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]];
    let back = [[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]];
    let fit = |v: f64| (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081);
    let aces = ToneCurve::new(Tone::Aces, Space::Srgb);
    for rgb in [[0.18; 3], [1.0; 3], [0.9, 0.1, 0.05], [0.02, 4.0, 0.3], [10.0, 8.0, 20.0]] {
        let expected = convert::apply(&back, convert::apply(&into, rgb).map(fit));
        assert_near(&aces.apply(rgb), &expected, 1e-3, "ACES");
    }
    // Reinhard: chromaticity stays, four times white is white.
    let reinhard = ToneCurve::new(Tone::Reinhard, Space::Srgb);
    assert_near(&reinhard.apply([4.0; 3]), &[1.0; 3], 1e-9, "Reinhard's white");
    let shown = reinhard.apply([2.0, 1.0, 0.5]);
    assert!((shown[0] / shown[1] - 2.0).abs() < 1e-9 && (shown[1] / shown[2] - 2.0).abs() < 1e-9);
    // AgX as three.js r160 has it, with matrices of four digits between sRGB and Rec.2020.
    let agx = ToneCurve::new(Tone::AgX, Space::Srgb);
    for (rgb, expected) in [
        ([0.18; 3], [0.21455, 0.21450, 0.21450]),
        ([1.0; 3], [0.59023, 0.59014, 0.59010]),
        ([0.9, 0.1, 0.05], [0.64570, 0.18640, 0.11990]),
        ([0.02, 4.0, 0.3], [0.58623, 0.86809, 0.50214]),
    ] {
        assert_near(&agx.apply(rgb), &expected, 1e-3, "AgX");
    }
    let (dim, bright) = (agx.apply([0.5, 0.02, 0.02]), agx.apply([50.0, 2.0, 2.0]));
    assert!(bright[1] / bright[0] > 2.0 * dim[1] / dim[0], "bright colours pale: {dim:?} {bright:?}");
    for tone in [Tone::None, Tone::Reinhard, Tone::Aces, Tone::AgX] {
        for space in SPACES {
            let curve = ToneCurve::new(tone, space);
            let grey: Vec<[f64; 3]> = (1..=120).map(|i| curve.apply([(f64::from(i) * 0.1 - 9.0).exp2(); 3])).collect();
            assert!(
                grey.iter().all(|[r, g, b]| (r - g).abs() < 2e-3 && (g - b).abs() < 2e-3),
                "{tone:?} in {space:?} tints grey"
            );
            assert!(grey.windows(2).all(|w| w[0][1] <= w[1][1]), "{tone:?}");
        }
    }
}

#[test]
fn every_space_shows_a_patch_alike() {
    // A colour within all gamuts, developed to each space and read back as XYZ.
    let xyz = convert::xyz_of_linear_srgb([0.6, 0.3, 0.1]);
    let white = xyz_of_xy(D65);
    for space in [Space::Srgb, Space::DisplayP3, Space::Rec2020] {
        let d = Development { space, ..Development::default() };
        let shown = encoded(&d, &[pixel(xyz)], 65535)[0].map(|v| space.transfer().decode(f64::from(v) / 65535.0));
        let back = convert::apply(&space.to_xyz(), shown);
        assert!(delta_e_2000(lab_of_xyz(back, white), lab_of_xyz(xyz, white)) < 0.005, "{space:?}");
    }
}

#[test]
fn dither_keeps_the_mean_and_spares_black_and_white() {
    let developer = Developer::new(&Development { gamut: Gamut::Clip, ..Development::default() });
    let shown =
        |v: f64, dither| developer.encoded(&vec![pixel_of_rgb([v; 3]); 128 * 128], Whole { most: 255, dither, width: 128 });
    for v in [0.0, 1.0] {
        assert!(shown(v, true).iter().flatten().all(|&b| f64::from(b) == 255.0 * v));
    }
    for v in [0.0031, 0.2, 0.7] {
        let exact = 255.0 * convert::srgb_encode(v);
        for c in 0..3 {
            let mean = shown(v, true).iter().map(|p| f64::from(p[c])).sum::<f64>() / 16384.0;
            assert!((mean - exact).abs() < 0.01, "{v}: {mean} is not {exact}");
        }
        assert!(shown(v, true).iter().flatten().all(|&b| (f64::from(b) - exact).abs() < 1.0));
        assert!(shown(v, false).windows(2).all(|w| w[0] == w[1]));
    }
}

#[test]
fn the_automatic_exposure_shows_the_scene() {
    let show = |pixels: &[f64]| -> Vec<u16> {
        let xyz: Vec<[f32; 3]> = pixels.iter().map(|&v| pixel_of_rgb([v; 3])).collect();
        bytes(&xyz, auto_exposure(&xyz, Observer::Cie1931, AUTO_SHARE)).iter().map(|p| p[0]).collect()
    };
    // Any scale of light gives the same picture.
    for scale in [1e-6, 1.0, 1e6] {
        let ramp: Vec<f64> = (1..=1000).map(|i| scale * f64::from(i) / 1000.0).collect();
        assert_eq!(show(&ramp)[989], level(0.9), "the 99th percentile");
    }
    // A strip of light in the dark is exposed for; a small lamp over a lit room is not.
    let strip: Vec<f64> = (0..1000).map(|i| if i < 5 { 5.0 } else { 0.0 }).collect();
    assert_eq!(show(&strip)[3], level(0.9));
    let room: Vec<f64> = (0..1000).map(|i| if i < 20 { 50.0 } else { 0.5 }).collect();
    assert_eq!(show(&room)[900], level(0.15));
    assert_eq!(show(&[0.0; 8]), [0; 8]);
    assert!(show(&[]).is_empty());
    // Another percentile, another observer.
    let ramp: Vec<[f32; 3]> = (1..=1000).map(|i| pixel_of_rgb([f64::from(i) / 1000.0; 3])).collect();
    let stops = |observer, share| auto_exposure(&ramp, observer, share);
    assert!((stops(Observer::Cie1931, 0.5) - (0.9f64 / 0.5).log2()).abs() < 3e-3);
    let other = (cie::xyz_of_unit(Observer::Cie1964)[1] / unit()).log2();
    assert!((stops(Observer::Cie1964, 0.5) - stops(Observer::Cie1931, 0.5) - other).abs() < 1e-5);
}

#[test]
fn extremes_are_kept_from_single_precision() {
    let at = |exposure: f64| Developer::new(&Development { exposure, ..Development::default() });
    let (white, none) = ([[100.0f32; 3]], [[0.0f32; 3]]);
    assert!([-20.0, 0.0, 20.0].into_iter().all(|stops| at(stops).suits_single_precision(&white)));
    // Squares and cubes of 1e13 and more would not fit, nor would the factors themselves.
    assert!([50.0, 100.0, 140.0].into_iter().all(|stops| !at(stops).suits_single_precision(&white)));
    assert!([-150.0, 150.0].into_iter().all(|stops| !at(stops).suits_single_precision(&none)));
    assert!(!at(0.0).suits_single_precision(&[[1e20; 3]]) && at(0.0).suits_single_precision(&[[f32::INFINITY; 3]]));
}
