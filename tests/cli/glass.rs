//! `abbe glass` against catalogue values.

use super::support::{Folder, fails, text};
use serde_json::Value;

fn json(arguments: &[&str]) -> Vec<Value> {
    let folder = Folder::new("glass-json");
    let output = folder.run(&[&["glass"], arguments, &["--json"]].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn near(value: &Value, expected: f64, tolerance: f64) {
    let v = value.as_f64().unwrap_or_else(|| panic!("{value} is no number"));
    assert!((v - expected).abs() <= tolerance, "{v} is not {expected} to {tolerance}");
}

#[test]
fn numbers_are_those_of_the_catalogue() {
    let glasses = json(&["n-bk7", "SF10", "--step", "100"]);
    let [bk7, sf10] = &glasses[..] else { panic!("{glasses:?}") };
    assert_eq!(bk7["name"], "N-BK7");
    near(&bk7["n_d"], 1.516800, 1e-6);
    near(&bk7["n_f"], 1.522376, 1e-6);
    near(&bk7["n_c"], 1.514322, 1e-6);
    near(&bk7["v_d"], 64.17, 5e-3);
    // The greatest errors of two and three terms over the visible.
    near(&sf10["cauchy"][0]["greatest_error"], 4.3e-3, 5e-5);
    near(&sf10["cauchy"][1]["greatest_error"], 6.3e-4, 5e-6);
    assert_eq!(sf10["cauchy"][1]["coefficients_um"].as_array().unwrap().len(), 3);
    assert_eq!(sf10["nm"], serde_json::json!([380.0, 480.0, 580.0, 680.0, 780.0]));
    // n^2 = 1 + sum B l^2 / (l^2 - C) at 480 nm, with the catalogue's coefficients.
    let terms = [(1.03961212, 0.00600069867), (0.231792344, 0.0200179144), (1.01046945, 103.560653)];
    let l2 = 0.48f64 * 0.48;
    let n = (1.0 + terms.iter().map(|(b, c)| b * l2 / (l2 - c)).sum::<f64>()).sqrt();
    near(&bk7["n"][1], n, 1e-9);
}

#[test]
fn what_is_not_known_is_not_shown() {
    // Measured from 435.83 nm to 656.27 nm, which is the C line rounded.
    let b270 = &json(&["B270", "--step", "200"])[0];
    assert_eq!(b270["cauchy_range_nm"], serde_json::json!([435.83, 656.27]));
    assert!(b270["n"][0].is_null() && b270["n"][1].is_f64() && b270["n"][2].is_null(), "{b270}");
    near(&b270["v_d"], 58.5, 0.3);
}

#[test]
fn the_text_tells_source_licence_range_and_what_a_cauchy_formula_costs() {
    let folder = Folder::new("glass-text");
    let output = folder.run(&["glass", "SF10", "water", "-o", "n.svg"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let said = text(&output.stdout);
    for part in
        ["off by up to 4.3e-3", "off by up to 6.3e-4", "source: SCHOTT", "licence: CC0", "known from 380 to 2500 nm", "1.333403"]
    {
        assert!(said.contains(part), "no '{part}' in {said}");
    }
    let svg = std::fs::read_to_string(folder.0.join("n.svg")).unwrap();
    assert_eq!(svg.matches("<polyline").count(), 2);
    assert!(svg.contains(">SF10</text>") && svg.contains(">water</text>") && svg.trim_end().ends_with("</svg>"));
}

#[test]
fn names_are_listed_and_filtered() {
    let all = json(&[]);
    assert!(all.len() > 200, "{}", all.len());
    let some = json(&["--list", "lasf"]);
    assert!(some.len() > 5 && some.len() < all.len() / 10, "{}", some.len());
    assert!(some.iter().all(|row| row["name"].as_str().unwrap().to_lowercase().contains("lasf")));
    let folder = Folder::new("glass-list");
    let said = text(&folder.run(&["glass", "--list", "N-BK7"]).stdout);
    assert!(said.lines().any(|line| line.starts_with("N-BK7") && line.contains("1.51680") && line.contains("64.17")), "{said}");
}

#[test]
fn wrong_names_are_answered_with_the_nearest() {
    let folder = Folder::new("glass-wrong");
    fails(&folder, &["glass", "N-BK8"], &["N-BK8", "did you mean \"N-BK7\""]);
    fails(&folder, &["glass", "N-BK7", "daimond", "-o", "n.svg"], &["diamond"]);
    fails(&folder, &["glass", "crown"], &["crowns are", "N-BK7"]);
    fails(&folder, &["glass", "--list", "no such"], &["no such"]);
    fails(&folder, &["glass", "--list", "SF", "--nd", "3..4"], &["no glass lies"]);
    fails(&folder, &["glass", "--list", "SF", "--vd", "40..30"], &["--vd", "40..30"]);
    fails(&folder, &["glass", "none.agf"], &["none.agf"]);
    fails(&folder, &["glass", "N-BK7", "-o", "n.png"], &[".svg"]);
    fails(&folder, &["glass", "N-BK7", "-o", "nowhere/n.svg"], &["nowhere"]);
    fails(&folder, &["glass", "N-BK7", "--step", "0"], &["--step"]);
}

#[test]
fn glasses_of_a_file_and_those_within_ranges_are_listed() {
    let folder = Folder::new("glass-file");
    std::fs::copy("tests/data/measured/formulas.agf", folder.0.join("made.agf")).expect("a catalogue");
    let said = text(&folder.run(&["glass", "made.agf"]).stdout);
    assert!(said.contains("F13") && said.contains("n_d 1.516800"), "{said}");
    let said = text(&folder.run(&["glass", "--list", "ohara/", "--nd", "1.9..2.1", "--vd", "20..30"]).stdout);
    assert!(said.contains("ohara/S-LAH79") && !said.contains("S-BSL7"), "{said}");
}

#[test]
fn names_are_listed_by_kind() {
    let names = |arguments: &[&str]| -> Vec<String> {
        json(&[&["--list"], arguments].concat()).iter().map(|row| row["name"].as_str().unwrap().to_string()).collect()
    };
    for (kind, of_it, not) in [
        ("gem", &["diamond", "moissanite", "sapphire e", "ZrO2-Y2O3/Wood"][..], "CaF2"),
        ("crystal", &["calcite", "quartz e", "diamond", "ice"], "water"),
        ("liquid", &["water", "ethanol", "toluene/Kedenburg"], "PMMA"),
        ("plastic", &["PMMA", "polycarbonate", "NAS-21/Sultanova"], "ethanol"),
        ("glass", &["N-BK7", "F2", "fused silica", "ohara/S-TIH6"], "quartz"),
    ] {
        let listed = names(&["--kind", kind]);
        let has = |name: &str| listed.iter().any(|n| n == name);
        assert!(of_it.iter().all(|name| has(name)) && !has(not), "{kind}: {listed:?}");
    }
    let dense = names(&["ohara/", "--kind", "glass", "--nd", "1.8..1.9", "--vd", "25..40"]);
    assert!(dense.len() > 5 && dense.iter().all(|name| name.starts_with("ohara/")), "{dense:?}");
    let folder = Folder::new("glass-kinds");
    fails(&folder, &["glass", "--list", "ohara", "--kind", "gem"], &["no glass lies", "--kind"]);
    fails(&folder, &["glass", "--list", "--kind", "metal"], &["metal", "crystal"]);
}
