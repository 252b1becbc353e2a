//! `cargo bench --bench frame` times the translucency technique at the paper's settings, on one thread and on
//! two:
//!
//! - `frame`: whole frames of each solid, from the solid at rest to the picture, camera, light and shape
//!   changing every time;
//! - `pass`: each pass of the bunny by itself;
//! - `triangles`, `pixels`: whole frames of a knot as either grows;
//! - `1024²`: depth, normal and position of the bunny alone, at 1024 × 1024.
//!
//! `-- pass` runs one group. The Stanford models need `BITLIGHT_ASSETS`; without it they are left out, the
//! knot stands in for the bunny, and the program says so. `cargo bench --bench table` makes the tables of
//! docs/measurements.md.

#![allow(clippy::print_stderr, reason = "what is left out must be seen")]

mod workload;

use bitlight::pass::Timings;
use bitlight::run::keep_memory;
use bitlight::scene::Assets;
use bitlight::techniques::translucency::PASSES;
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, SamplingMode};
use rayon::ThreadPool;
use std::time::{Duration, Instant};
use workload::{FINAL, GBUFFER, KNOT, MODELS, Model, Nothing, Workload};

/// Frames of a round.
const ROUND: usize = 12;

fn group<'a>(criterion: &'a mut Criterion, name: &str) -> BenchmarkGroup<'a, WallTime> {
    let mut group = criterion.benchmark_group(name);
    group.sampling_mode(SamplingMode::Flat).sample_size(10);
    group.warm_up_time(Duration::from_millis(200)).measurement_time(Duration::from_millis(800));
    group
}

/// Times what `frame` makes of each number by its own clock, in each pool.
fn bench(
    group: &mut BenchmarkGroup<'_, WallTime>,
    pools: &[ThreadPool],
    name: &str,
    frame: impl Fn(usize) -> Duration + Sync,
) {
    for pool in pools {
        let threads = pool.current_num_threads();
        let name = format!("{name}, {threads} thread{}", if threads > 1 { "s" } else { "" });
        group.bench_function(name, |bencher| {
            bencher.iter_custom(|count| pool.install(|| (0..count as usize).map(&frame).sum()));
        });
    }
}

/// Times whole frames.
fn whole(group: &mut BenchmarkGroup<'_, WallTime>, pools: &[ThreadPool], name: &str, work: &Workload) {
    bench(group, pools, name, |number| {
        let begun = Instant::now();
        work.render(number, FINAL, &mut Nothing);
        begun.elapsed()
    });
}

/// Times what of a request for a pass `counts`, by the clock of the recorder.
fn part(
    group: &mut BenchmarkGroup<'_, WallTime>,
    pools: &[ThreadPool],
    (work, pass): (&Workload, &str),
    counts: impl Fn(&str) -> bool + Sync,
) {
    bench(group, pools, pass, |number| {
        let mut timings = Timings::new(workload::clock);
        work.render(number, pass, &mut timings);
        let seconds = timings.passes.iter().filter(|pass| counts(pass.0)).map(|pass| pass.1);
        Duration::from_secs_f64(seconds.sum())
    });
}

fn load(model: &Model, set: &[String]) -> Workload {
    Workload::new(model, ROUND, set, &Assets::from_environment()).unwrap_or_else(|error| panic!("{error}"))
}

fn frames(criterion: &mut Criterion) {
    let (pools, mut group) = (workload::pools(), group(criterion, "frame"));
    for model in [KNOT].iter().chain(&MODELS) {
        match Workload::new(model, ROUND, &[], &Assets::from_environment()) {
            Ok(work) => {
                let name = format!("{}, {} triangles", model.name, work.triangles);
                whole(&mut group, &pools, &name, &work);
            }
            Err(error) => eprintln!("left out: {error}"),
        }
    }
}

fn passes(criterion: &mut Criterion) {
    let model = workload::first(&Assets::from_environment());
    let (pools, mut group) = (workload::pools(), group(criterion, &format!("pass, {}", model.name)));
    let work = load(&model, &[]);
    for name in PASSES.iter().map(|pass| pass.info.name) {
        part(&mut group, &pools, (&work, name), |pass| pass == name);
    }
}

fn growth(criterion: &mut Criterion) {
    let pools = workload::pools();
    for (name, settings) in workload::growth() {
        let mut group = group(criterion, name);
        for set in settings {
            let work = load(&KNOT, &set);
            let name = format!("{} triangles, {} pixels", work.triangles, work.pixels);
            whole(&mut group, &pools, &name, &work);
        }
    }
}

fn gbuffer(criterion: &mut Criterion) {
    let model = workload::first(&Assets::from_environment());
    let (pools, mut group) = (workload::pools(), group(criterion, &format!("1024², {}", model.name)));
    part(&mut group, &pools, (&load(&model, &workload::side(1024)), GBUFFER), |_| true);
}

fn main() {
    keep_memory();
    let mut criterion = Criterion::default().configure_from_args();
    for group in [frames, passes, growth, gbuffer] {
        group(&mut criterion);
    }
    criterion.final_summary();
}
