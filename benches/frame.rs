//! Frames of the translucency technique at the paper's settings: 512 × 512 pixels, 64 × 64 texels a face, a shadow map
//! of 512 × 512 under one point light. `cargo bench --bench frame` times whole frames of every solid that is there and
//! each pass of the knot; `-- bunny` those of one.
//!
//! The Stanford models need `BITLIGHT_ASSETS`; without it they are left out, and that is said.

#![allow(clippy::print_stderr, reason = "what is left out must be seen")]

use bitlight::pass::{Info, Recorder, Timings, execute};
use bitlight::run;
use bitlight::scene::{Assets, Scene};
use bitlight::techniques::translucency::{Frame, PASSES};
use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use std::time::Duration;

/// The paper's settings; the solid covers about half of the image.
fn scene(solid: &str) -> Scene {
    let text = format!(
        "technique = \"translucency\"\nunit = \"mm\"\n[camera]\nposition = [0, 8, 84]\nfov = 36\n[solid]\n{solid}\n\
         size = 50\n[material]\nname = \"Skin1\"\n[[light]]\nkind = \"point\"\nposition = [-40, 50, -70]\n\
         intensity = [160000, 150000, 140000]\n"
    );
    Scene::parse(&text, "bench.toml".as_ref(), &[]).unwrap_or_else(|error| panic!("{error}"))
}

/// A sink that keeps nothing.
struct Nothing;

impl Recorder for Nothing {
    fn record(&mut self, _: &Info, _: bool, buffer: &bitlight::pass::Buffer) -> Result<(), bitlight::Error> {
        black_box(buffer);
        Ok(())
    }
}

fn render(frame: &Frame) {
    execute(&PASSES, frame, &["translucency.final"], &mut Nothing).unwrap_or_else(|error| panic!("{error}"));
}

fn frames(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("frame");
    group.sample_size(20);
    let knot = "shape = \"torus-knot\"\nresolution = 64";
    let models =
        ["stanford-bunny", "buddha", "armadillo"].map(|name| format!("file = \"stanford/{name}.obj\""));
    for solid in std::iter::once(knot.to_owned()).chain(models) {
        let name = solid.split('"').nth(1).unwrap_or_default().to_owned();
        match run::frame(&scene(&solid), &Assets::from_environment()) {
            Ok(frame) => {
                let name = format!("{name}, {} triangles", frame.solid.triangles.len());
                group.bench_function(name, |bencher| bencher.iter(|| render(&frame)));
            }
            Err(error) => eprintln!("left out: {error}"),
        }
    }
    group.finish();
}

/// Each pass by itself: its share of the time of a request for it, by the clock of the recorder.
fn passes(criterion: &mut Criterion) {
    let frame = run::frame(&scene("shape = \"torus-knot\"\nresolution = 64"), &Assets::default());
    let frame = frame.unwrap_or_else(|error| panic!("{error}"));
    let mut group = criterion.benchmark_group("pass");
    group.sample_size(20);
    for name in PASSES.iter().map(|pass| pass.info.name) {
        group.bench_function(name, |bencher| {
            bencher.iter_custom(|frames| {
                let mut total = Duration::ZERO;
                for _ in 0..frames {
                    let mut timings = Timings::default();
                    execute(&PASSES, &frame, &[name], &mut timings).unwrap_or_else(|error| panic!("{error}"));
                    total += timings
                        .passes
                        .iter()
                        .filter(|pass| pass.0 == name)
                        .map(|pass| pass.1)
                        .sum::<Duration>();
                }
                total
            });
        });
    }
    group.finish();
}

criterion_group!(benches, frames, passes);
criterion_main!(benches);
