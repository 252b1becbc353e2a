//! What a bake costs a vertex: `cargo bench --bench bake -- [OBJ [DIRECTIONS]]`, processor time of one
//! thread, the least of three turns. Without a file, a torus knot of 12,800 vertices.
#![allow(clippy::print_stdout, reason = "a table is what it is for")]
#![allow(clippy::disallowed_methods, reason = "a clock")]

use bitlight::bake::{
    Directions, Estimate, brdf, diffuse_bounces, gather, glossy_bounces, irradiance, matrices, meetings,
    multiple_scattering, vectors, visibility,
};
use bitlight::keys::Reading;
use bitlight::numeric::parallel::with_threads;
use bitlight::store::file;
use bitlight::world::brdf::{Brdf, Gloss};
use bitlight::world::medium::Medium;
use bitlight::world::shapes;
use glam::Vec3;
use std::hint::black_box;
use std::time::Instant;

/// Seconds that this thread has run, where the system says; else those that have passed.
fn seconds(start: Instant) -> f64 {
    let run = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let run = run.and_then(|run| run.split_whitespace().next()?.parse::<f64>().ok());
    run.map_or_else(|| start.elapsed().as_secs_f64(), |nanoseconds| nanoseconds * 1e-9)
}

/// Microseconds a vertex, the least of three.
fn time<T>(vertices: usize, work: impl Fn() -> T) -> f64 {
    let once = || {
        let start = Instant::now();
        let before = seconds(start);
        black_box(work());
        seconds(start) - before
    };
    (0..3).map(|_| once()).fold(f64::INFINITY, |least, time| if time < least { time } else { least }) * 1e6
        / vertices as f64
}

fn table(file: Option<&str>, count: usize) {
    let mesh = file.map_or_else(|| shapes::torus_knot(2, 3, 0.3, 400, 32), file::read_obj).expect("a mesh");
    let directions = Directions::new(count);
    let seen = visibility(&mesh, &directions);
    let met = meetings(&mesh, &directions, &seen);
    let vertices = mesh.positions.len();
    let blocked: u32 = seen.blocked.iter().map(|word| word.count_ones()).sum();
    println!(
        "{vertices} vertices, {count} directions, {:.0} of them blocked a vertex; µs a vertex",
        f64::from(blocked) / vertices as f64
    );
    println!("{:40} {:9.2}", "visibility", time(vertices, || visibility(&mesh, &directions)));
    for bands in [4, 5, 6, 10] {
        for estimate in [Estimate::Plain, Estimate::Control] {
            let of = || vectors(&mesh, &directions, &seen, bands, Reading::Corrected, estimate);
            println!("{:40} {:9.2}", format!("vectors, {bands} bands, {estimate:?}"), time(vertices, of));
        }
    }
    let some = if vertices < 10_000 { vertices } else { 10_000 };
    for bands in [3, 5, 6] {
        for estimate in [Estimate::Plain, Estimate::Control] {
            let of = || matrices(&mesh, &directions, &seen, bands, estimate, 0..some);
            println!("{:40} {:9.2}", format!("matrices, {bands} bands, {estimate:?}"), time(some, of));
        }
    }
    println!("{:40} {:9.2}", "meetings", time(vertices, || meetings(&mesh, &directions, &seen)));
    let direct = vectors(&mesh, &directions, &seen, 5, Reading::Corrected, Estimate::Control);
    let once = || gather(&mesh, &directions, &met, Estimate::Control, &direct, 25);
    println!("{:40} {:9.2}", "a diffuse bounce, 5 bands", time(vertices, once));
    let three =
        || diffuse_bounces(&mesh, &directions, &met, Estimate::Control, &direct, 5, Vec3::splat(0.5), 3);
    println!("{:40} {:9.2}", "three diffuse bounces in RGB, 5 bands", time(vertices, three));
    let medium = Medium::new([0.74, 0.88, 1.01], [0.032, 0.17, 0.48], 1.3, 10.0);
    let entering = irradiance(&mesh, &directions, &seen, 5, &medium, Estimate::Control);
    for spread in [0.1, 0.03] {
        let of = || multiple_scattering(&mesh, &entering, 25, &medium, spread);
        println!("{:40} {:9.2}", format!("multiple scattering, 5 bands, {spread}"), time(vertices, of));
    }
    if vertices < 20_000 {
        let gloss =
            Brdf { albedo: Vec3::splat(0.5), specular: Vec3::ONE, gloss: Gloss::Phong { exponent: 8.0 } };
        let gloss = brdf::matrix(&gloss, 4);
        let first = matrices(&mesh, &directions, &seen, 4, Estimate::Control, 0..vertices);
        let of = || glossy_bounces(&mesh, &directions, &met, Estimate::Control, &first, 4, &gloss, 1);
        println!("{:40} {:9.2}", "a glossy bounce in RGB, 4 bands", time(vertices, of));
    }
}

fn main() {
    let arguments: Vec<String> =
        std::env::args().skip(1).filter(|argument| !argument.starts_with("--")).collect();
    let count = arguments.get(1).map_or(1024, |count| count.parse().expect("a number of directions"));
    with_threads(1, || table(arguments.first().map(String::as_str), count)).expect("a thread");
}
