//! Prescriptions from strangers: an error of one line each, or a lens through which rays go somewhere or nowhere.

use super::mutation::{Random, mutate, mutate_json};
use super::sweep;
use abbe::lens::{LensRay, Prescription, Tracer, library, zmx};
use abbe::scene::load_lens;
use abbe::spectrum::measured::decode;
use glam::{DVec3, dvec3};
use serde_json::Value;

/// An even asphere, an old glass, a model glass, planes in air, comments.
const ZMX: &str = "VERS 1\nMODE SEQ\nNAME a lens\nUNIT MM X W X\nENPD 1.0E+1\nGCAT SCHOTT OHARA\nFTYP 0 0 2 3\nYFLN 0 5 10\nSURF 0\n  TYPE STANDARD\n  CURV 0\n  DISZ INFINITY\nSURF 1\n  COMM front\n  TYPE EVENASPH\n  CURV 2.5E-2 0 0 0\n  CONI -6.0E-1\n  PARM 1 0\n  PARM 2 -1.0E-6\n  PARM 3 2.0E-9\n  DISZ 6\n  GLAS BK7 0 0 1.5168 64.17\n  DIAM 1.2E+1 1 0 0 1 \"\"\nSURF 2\n  TYPE STANDARD\n  CURV -1.0E-2\n  DISZ 2\n  GLAS ___BLANK 1 0 1.7 30 0\n  DIAM 12\nSURF 3\n  TYPE STANDARD\n  CURV -1.0E-3\n  DISZ 1\n  DIAM 12\nSURF 4\n  STOP\n  TYPE STANDARD\n  CURV 0\n  DISZ 50\n  DIAM 8\nSURF 5\n  TYPE STANDARD\n  CURV 0\n  DISZ 0\n  DIAM 10\n";

/// Whatever was accepted can be traced and summed up without a panic.
fn use_it(lens: &Prescription) {
    lens.check().expect("what was accepted is in order");
    let paraxial = lens.paraxial(550.0);
    let _ = (paraxial.back_focus(), paraxial.f_number(), lens.crossings());
    for d in [DVec3::Z, dvec3(0.0, 0.3, 0.9).normalize(), -DVec3::Z] {
        let out = Tracer::new(lens, 550.0).trace(LensRay { o: dvec3(0.0, 0.003, 0.0), d });
        assert!(
            out.is_none_or(|out| out.ray.o.is_finite() && (0.0..=1.0 + 1e-9).contains(&out.transmission)),
            "{lens:?}: {out:?}"
        );
    }
}

#[test]
fn twenty_thousand_changed_prescriptions_are_read_or_refused() {
    let inputs = sweep::count(20_000).min(100_000);
    let mut random = Random(26);
    let mut accepted = 0;
    for _ in 0..inputs * 7 / 10 {
        let mut bytes = ZMX.as_bytes().to_vec();
        mutate(&mut bytes, &mut random);
        match zmx::read(&decode(&bytes)) {
            Ok(lens) => {
                accepted += 1;
                use_it(&lens);
            }
            Err(fault) => assert!(!fault.problem.contains('\n') && !fault.remedy.is_empty(), "{fault:?}"),
        }
    }
    let path = std::env::temp_dir().join(format!("abbe-hostile-lens-{}.json", std::process::id()));
    let name = path.to_str().expect("a path of letters");
    for i in 0..inputs * 3 / 10 {
        let text = library::LENSES[i % 4].1;
        let mut document: Value = serde_json::from_str(text).expect("a lens that ships");
        mutate_json(&mut document, &mut random);
        std::fs::write(&path, document.to_string()).expect("a place for the input");
        match load_lens(name, None) {
            Ok(lens) => {
                accepted += 1;
                use_it(&lens);
            }
            Err(e) => assert!(!e.to_string().contains('\n'), "{e}"),
        }
    }
    std::fs::remove_file(&path).expect("the input is removed");
    println!("{accepted} of {inputs} accepted");
    assert!((inputs / 20..inputs * 19 / 20).contains(&accepted), "{accepted} of {inputs} accepted: nothing is tried");
}
