//! Where paths of the reference start, which it finds out by itself: the same closed forms as for the GPU.

use abbe::reference::ReferenceIntegrator;
use abbe::render::Renderer;
use abbe::stats::BatchStats;
use abbe::validate::{Verdict, all};

/// No row of the case fails, and errors are below so many times what counts for the GPU.
fn holds(id: &str, times: f64) {
    let case = all().into_iter().find(|case| case.id == id).expect("a case of this name");
    let mut stats = BatchStats::default();
    let open = |scene: &abbe::scene::Scene, seed, _, _| {
        ReferenceIntegrator::new(scene, scene.reference, seed).map(|r| Box::new(r) as Box<dyn Renderer>)
    };
    let outcomes = case.run(&open, 1, &mut stats).expect("the reference renders");
    assert_eq!(stats.dropped(), 0);
    for o in outcomes {
        println!("{o:?}");
        assert!(o.verdict != Verdict::Failed && o.greatest_sigma <= times * o.largest_sigma, "{o:?}");
    }
}

#[test]
fn paths_start_in_the_volumes_around_them() {
    holds("starts", 5.0);
    holds("starts-lamp", 5.0);
}

#[test]
fn sensors_and_lamps_that_lie_in_surfaces_count_as_on_the_side_that_they_look_to() {
    holds("touching", 5.0);
    holds("touching-lamp", 5.0);
}
