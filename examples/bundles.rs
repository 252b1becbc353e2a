//! What the visibility of a bake costs with more directions and triangles, one thread and two, as a table in
//! Markdown:
//!
//!     BITLIGHT_ASSETS=… cargo run --release --example bundles
#![allow(clippy::print_stdout, reason = "a table")]

use bitlight::Error;
use bitlight::numeric::parallel;
use bitlight::sphere::quadrature::fibonacci;
use bitlight::store::file;
use bitlight::trace::bundle::visibility;
use bitlight::world::mesh::Mesh;
use bitlight::world::shapes;
use glam::Vec3;
use std::time::Instant;

/// Repeats of a time, whose median counts.
const TIMES: usize = 5;

/// The most memory that this process has had, in MiB; 0 where the system does not say.
fn peak() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let kibibytes =
        status.lines().find_map(|line| line.strip_prefix("VmHWM:")?.split_whitespace().next()?.parse().ok());
    kibibytes.map_or(0.0, |kibibytes: f64| kibibytes / 1024.0)
}

fn row(name: &str, mesh: &Mesh, count: usize) -> Result<(), Error> {
    let directions: Vec<_> =
        fibonacci(count).iter().map(|d| Vec3::new(d[0] as f32, d[1] as f32, d[2] as f32)).collect();
    let before = peak();
    let mut seconds = [[0.0; TIMES]; 2];
    for time in 0..TIMES {
        for threads in 1..=2 {
            let began = Instant::now();
            let seen = || visibility(mesh, &mesh.positions, &mesh.normals, &directions);
            std::hint::black_box(parallel::with_threads(threads, seen)?);
            seconds[threads - 1][time] = began.elapsed().as_secs_f64();
        }
    }
    let [one, two] = seconds.map(|mut seconds| {
        seconds.sort_by(f64::total_cmp);
        seconds[TIMES / 2] * 1e3
    });
    let (triangles, more) = (mesh.triangles.len(), peak() - before);
    println!("| {name} | {triangles} | {count} | {one:.1} | {two:.1} | {:.2} | {more:.1} |", one / two);
    Ok(())
}

fn main() -> Result<(), Error> {
    println!(
        "| mesh | triangles | directions | ms, one thread | two | ratio | MiB over what was had before |"
    );
    println!("|---|---|---|---|---|---|---|");
    // The largest last: memory is counted by its peak.
    if let Some(assets) = std::env::var_os("BITLIGHT_ASSETS") {
        let bunny = file::read_obj(std::path::Path::new(&assets).join("stanford/stanford-bunny.obj"))?;
        for count in [64, 256, 1024] {
            row("bunny", &bunny, count)?;
        }
    }
    for n in [8, 25, 79, 250] {
        row("knot", &shapes::torus_knot(2, 3, 0.35, 8 * n, n)?, 64)?;
    }
    Ok(())
}
