//! The truth beside Mitsuba 3: its radiance stands in tests/peers/mitsuba/*.json, ours is rendered here.

#![allow(clippy::disallowed_methods, reason = "statistics of results, not results")]

#[path = "peers/mitsuba/scenes.rs"]
mod scenes;

use scenes::{Outcome, Table, mean};
use std::path::Path;

/// Samples a pixel.
const SAMPLES: u64 = 64;

fn table(name: &str) -> Table {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/peers/mitsuba");
    Table::read(&folder.join(name).with_extension("json")).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Tests of the blocks and of their mean.
fn compare(table: &Table) -> [Outcome; 2] {
    let ours = table.blocks(&table.render(SAMPLES));
    let theirs: Vec<_> = table.rows.iter().map(|row| row.1).collect();
    [Outcome::new(&ours, &theirs, table.passes), Outcome::new(&[mean(&ours)], &[mean(&theirs)], table.passes)]
}

fn agrees(name: &str) {
    let [blocks, whole] = compare(&table(name));
    assert!(blocks.tests > 200, "{name}: {blocks:?}");
    assert!(blocks.holds() && blocks.spread < 1.5, "{name}: {blocks:?}");
    assert!(whole.holds(), "{name}, all blocks together: {whole:?}");
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
