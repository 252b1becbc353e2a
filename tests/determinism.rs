//! The same bits with any number of threads (contract 3), against the goldens' own manifests.
#![cfg(feature = "threads")]

use bitlight::compare::{Golden, Verdict};
use bitlight::numeric::parallel::with_threads;
use bitlight::scene::{Assets, Scene};
use bitlight::store::file;
use std::path::Path;

#[test]
fn every_asset_free_scene_has_its_golden_bits_with_1_2_3_and_7_threads() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut verified = 0;
    for scene in file::below(&root.join("scenes"), "toml").unwrap() {
        let read = Scene::read(&scene, &[]).unwrap();
        if !read.assets().is_empty() {
            continue;
        }
        for threads in [1, 2, 3, 7] {
            let verdict =
                with_threads(threads, || Golden::verify(&root.join("golden"), &scene, &Assets::default()));
            let all = read.technique.passes.len();
            assert_eq!(
                verdict.unwrap().unwrap(),
                Verdict::Same(all),
                "{} on {threads} threads",
                scene.display()
            );
            verified += 1;
        }
    }
    assert!(verified >= 8, "two scenes at least, four times each: {verified}");
}
