//! smoke
#[test]
fn smoke() {
    for e in std::fs::read_dir("/work/main/scenes/compare").unwrap() {
        let p = e.unwrap().path();
        if p.extension().is_some_and(|e| e == "json") {
            match abbe::scene::load(&p, &abbe::scene::LoadOptions::default()) {
                Ok(s) => println!("{}: {} shapes {} mats {} interiors {:?}", s.name, s.shapes.len(), s.materials.len(), s.interiors.len(), s.notes),
                Err(e) => println!("{e}"),
            }
        }
    }
}
