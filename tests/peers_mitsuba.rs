//! The truth beside Mitsuba 3: its radiance stands in tests/peers/mitsuba/*.json, ours is rendered here.

#![allow(clippy::disallowed_methods, reason = "statistics of results, not results")]

#[path = "peers/mitsuba/scenes.rs"]
mod scenes;

use bitlight::truth::{Model, Volume};
use bitlight::world::brdf::{Brdf, Gloss};
use scenes::{Outcome, Table, mean};
use std::path::Path;

/// Samples a pixel.
const SAMPLES: u64 = 64;

fn table(name: &str, change: impl FnOnce(&mut Model)) -> Table {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/peers/mitsuba");
    let table = Table::changed(&folder.join(name).with_extension("json"), change);
    table.unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Tests of the blocks and of their mean.
fn compare(table: &Table) -> [Outcome; 2] {
    let ours = table.blocks(&table.render(SAMPLES));
    let theirs: Vec<_> = table.rows.iter().map(|row| row.1).collect();
    [Outcome::new(&ours, &theirs, table.passes), Outcome::new(&[mean(&ours)], &[mean(&theirs)], table.passes)]
}

fn agrees(name: &str) {
    let [blocks, whole] = compare(&table(name, |_| ()));
    assert!(blocks.tests > 150, "{name}: {blocks:?}");
    assert!(blocks.holds() && blocks.spread < 1.5, "{name}: {blocks:?}");
    assert!(whole.holds(), "{name}, all blocks together: {whole:?}");
}

/// A scene that is a little wrong.
fn differs(name: &str, change: impl FnOnce(&mut Model)) {
    let [blocks, whole] = compare(&table(name, change));
    assert!(!(blocks.holds() && blocks.spread < 1.5 && whole.holds()), "{name}: {blocks:?}, {whole:?}");
}

#[test]
fn small_faults_are_found() {
    let brdf = |change: fn(&mut Brdf)| {
        move |model: &mut Model| {
            let Model::Surface { brdf, .. } = model else { panic!("no surface") };
            change(brdf);
        }
    };
    let volume = |change: fn(&mut Volume)| {
        move |model: &mut Model| {
            let Model::Medium(volume) = model else { panic!("no medium") };
            change(volume);
        }
    };
    differs("diffuse-sky", brdf(|brdf| brdf.albedo *= 0.99));
    differs("phong-sky", brdf(|brdf| brdf.specular *= 0.98));
    differs("phong-sun", brdf(|brdf| brdf.gloss = Gloss::Phong { exponent: 28.0 }));
    differs("cook-torrance-lamp", brdf(|brdf| brdf.gloss = Gloss::CookTorrance { roughness: 0.29 }));
    differs("translucent-constant", volume(|volume| volume.eta = 1.28));
    differs("translucent-sky", volume(|volume| volume.absorption = volume.absorption.map(|a| a * 1.05)));
    differs("translucent-forward", volume(|volume| volume.anisotropy = 0.45));
}

#[test]
fn one_wrong_block_is_found() {
    let right = [[1.0; 3], [1e-6; 3]];
    let wrong = [[1.0, 1.01, 1.0], [1e-6; 3]];
    let theirs = vec![right; 100];
    let mut ours = theirs.clone();
    assert!(Outcome::new(&ours, &theirs, 128).holds());
    ours[7] = wrong;
    let outcome = Outcome::new(&ours, &theirs, 128);
    assert!(outcome.passed == 299 && !outcome.holds(), "{outcome:?}");
    // Black on both sides is no test.
    assert_eq!(Outcome::new(&[[[0.0; 3]; 2]], &[[[0.0; 3]; 2]], 128).tests, 0);
}

macro_rules! scenes {
    ($($test:ident $name:literal)*) => {
        $(#[test]
        fn $test() {
            agrees($name);
        })*
    };
}

scenes! {
    diffuse_under_sky_and_sun "diffuse-sky"
    diffuse_under_a_lamp "diffuse-lamp"
    phong_under_a_sky "phong-sky"
    phong_in_the_sun "phong-sun"
    cook_torrance_under_a_sky "cook-torrance-sky"
    cook_torrance_under_a_lamp "cook-torrance-lamp"
    translucent_under_even_light "translucent-constant"
    translucent_under_a_sky "translucent-sky"
    translucent_with_forward_scattering "translucent-forward"
}
