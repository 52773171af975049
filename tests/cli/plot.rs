//! Plots: what is drawn where, and what is left out.

use abbe::cli::plot::{Axis, Curve, Plot};

fn axis(label: &str) -> Axis {
    Axis { label: label.to_string(), ..Axis::default() }
}

fn plot(points: &[(f64, f64)]) -> Plot {
    let curve = Curve { name: "curve".to_string(), points: points.to_vec(), errors: Vec::new() };
    Plot { title: "title".to_string(), x: axis("x"), y: axis("y"), curves: vec![curve], fill: Vec::new() }
}

/// The texts of a picture with the place of each.
fn texts(svg: &str) -> Vec<(f64, f64, String)> {
    let number = |line: &str, name: &str| {
        let rest = line.split(&format!(" {name}=\"")).nth(1)?;
        rest.split('"').next()?.parse::<f64>().ok()
    };
    let one = |line: &str| {
        let content = line.split('>').nth(1)?.split('<').next()?;
        Some((number(line, "x")?, number(line, "y")?, content.to_string()))
    };
    svg.lines().filter(|line| line.starts_with("<text")).filter_map(one).collect()
}

fn tick(svg: &str, text: &str) -> (f64, f64) {
    let all = texts(svg);
    let found = all.iter().find(|t| t.2 == text).unwrap_or_else(|| panic!("no tick {text} among {all:?}"));
    (found.0, found.1)
}

/// The points of every line.
fn lines(svg: &str) -> Vec<Vec<(f64, f64)>> {
    let of = |line: &str| {
        let points = line.split("points=\"").nth(1)?.split('"').next()?;
        points.split(' ').map(|p| p.split_once(',').and_then(|(x, y)| Some((x.parse().ok()?, y.parse().ok()?)))).collect()
    };
    svg.lines().filter(|line| line.starts_with("<polyline")).filter_map(of).collect()
}

#[test]
fn points_lie_at_their_ticks() {
    let svg = plot(&[(380.0, 1.2), (500.0, 1.4), (780.0, 2.0)]).svg();
    let line = &lines(&svg)[0];
    assert!((line[1].0 - tick(&svg, "500").0).abs() < 0.11, "{line:?}");
    // Text stands 4.5 lower than its tick, so that its middle is there.
    assert!((line[1].1 - (tick(&svg, "1.4").1 - 4.5)).abs() < 0.11, "{line:?}");
    assert!(line[0].1 > line[1].1, "y goes up");
}

#[test]
fn ticks_are_round_numbers() {
    for (low, high, some) in [
        (0.0, 1.0, &["0.2", "0.4"][..]),
        (380.0, 780.0, &["400", "450"]),
        (-3.0, 4.0, &["-2", "0", "2"]),
        (0.0, 3.2e-7, &["0", "1.0e-7"]),
        (0.0, 7.1e8, &["2e8", "4e8"]),
        (1.51, 1.53, &["1.515"]),
    ] {
        let svg = plot(&[(low, 0.0), (high, 1.0)]).svg();
        some.iter().for_each(|text| assert!(texts(&svg).iter().any(|t| t.2 == *text), "{low} to {high}: {:?}", texts(&svg)));
        assert!((6..24).contains(&texts(&svg).len()), "{:?}", texts(&svg));
    }
}

#[test]
fn a_power_law_is_straight_on_logarithmic_axes() {
    let points: Vec<(f64, f64)> = (0..=8).map(|i| 2f64.powi(i)).map(|t| (t, 3.0 / t)).collect();
    let mut plot = plot(&points);
    (plot.x.log, plot.y.log) = (true, true);
    let svg = plot.svg();
    let line = &lines(&svg)[0];
    let slope = |a: (f64, f64), b: (f64, f64)| (b.1 - a.1) / (b.0 - a.0);
    for w in line.windows(2) {
        assert!((slope(w[0], w[1]) - slope(line[0], line[8])).abs() < 0.01, "{line:?}");
    }
    assert!((tick(&svg, "10").0 - tick(&svg, "1").0 - (tick(&svg, "100").0 - tick(&svg, "10").0)).abs() < 0.21);
}

#[test]
fn what_has_no_place_breaks_the_line_and_nothing_else() {
    let svg = plot(&[(1.0, 1.0), (2.0, 2.0), (3.0, f64::NAN), (4.0, 1.0), (5.0, f64::INFINITY)]).svg();
    assert_eq!(lines(&svg).iter().map(Vec::len).collect::<Vec<_>>(), [2, 1]);
    let mut log = plot(&[(0.0, 1.0), (1.0, 1.0), (10.0, 0.0), (100.0, 10.0)]);
    (log.x.log, log.y.log) = (true, true);
    assert_eq!(lines(&log.svg()).iter().map(Vec::len).collect::<Vec<_>>(), [1, 1]);
    for points in [&[][..], &[(1.0, 1.0)], &[(1.0, 0.0), (2.0, 0.0)], &[(f64::NAN, f64::NAN)], &[(0.0, 1e300), (1.0, 1e300)]] {
        let svg = plot(points).svg();
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{points:?}: {svg}");
    }
}

#[test]
fn text_cannot_break_the_document() {
    let mut plot = plot(&[(0.0, 0.0), (1.0, 1.0)]);
    plot.title = "a < b & \"c\"</svg>".to_string();
    let svg = plot.svg();
    assert!(svg.contains("a &lt; b &amp; &quot;c&quot;&lt;/svg&gt;"));
    assert_eq!(svg.matches("</svg>").count(), 1);
}

#[test]
fn panels_of_a_grid_stand_side_by_side_and_share_no_names() {
    let svg = abbe::cli::plot::grid(&[plot(&[(0.0, 1.0), (1.0, 2.0)]), plot(&[(5.0, 1.0), (6.0, 2.0)]), plot(&[])], 2);
    let starts: Vec<&str> = svg.lines().filter(|line| line.starts_with("<svg")).collect();
    assert!(starts[0].contains(r#"width="1600" height="960""#), "{}", starts[0]);
    for (panel, place) in starts[1..].iter().zip([r#"x="0" y="0""#, r#"x="800" y="0""#, r#"x="0" y="480""#]) {
        assert!(panel.contains(place), "{panel} is not at {place}");
    }
    let mut names: Vec<&str> = svg.split(" id=\"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
    let all = names.len();
    names.sort();
    names.dedup();
    assert_eq!((names.len(), all), (3, 3), "{names:?}");
    assert_eq!(lines(&svg).len(), 2);
}
