//! The page's files: nothing from outside, and all that they name is there.

use std::collections::BTreeSet;
use std::path::Path;

fn files() -> Vec<(String, String)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/view/page");
    let entries = std::fs::read_dir(folder).expect("the page").map(|entry| entry.expect("a file").path());
    entries
        .map(|path| {
            (path.file_name().expect("a name").to_string_lossy().into_owned(), std::fs::read_to_string(&path).expect("text"))
        })
        .collect()
}

#[test]
fn the_page_loads_nothing_from_elsewhere_and_has_no_code_within_html() {
    for (name, text) in files() {
        let outside = text.replace("http://www.w3.org/2000/svg", "").replace("\"https:\"", "");
        assert!(!outside.contains("http://") && !outside.contains("https://") && !outside.contains("url(//"), "{name}");
        assert!(
            !text.contains(" style=\"") && !text.contains("javascript:") && !text.contains(" onclick="),
            "{name}: the policy forbids it"
        );
        assert!(!text.contains("innerHTML"), "{name}: names of a scene are text, not HTML");
    }
}

#[test]
fn every_element_that_a_module_asks_for_by_name_is_there() {
    let files = files();
    let text = |name: &str| &files.iter().find(|(n, _)| n == name).expect(name).1;
    let made: String = files.iter().map(|(_, text)| text.as_str()).collect();
    let html = text("index.html");
    for (name, module) in files.iter().filter(|(name, _)| name.ends_with(".js")) {
        let asked: BTreeSet<&str> = module.split("$(\"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
        for id in asked {
            let is_there = html.contains(&format!("id=\"{id}\""))
                || made.contains(&format!("id: \"{id}\""))
                || made.contains(&format!("(\"{id}\", \""));
            assert!(is_there, "{name} asks for {id}");
        }
        for import in module.lines().filter(|line| line.starts_with("import")) {
            let file = import.split("\"./").nth(1).and_then(|rest| rest.split('"').next()).expect("a file");
            assert!(files.iter().any(|(n, _)| n == file), "{name} imports {file}");
        }
    }
}
