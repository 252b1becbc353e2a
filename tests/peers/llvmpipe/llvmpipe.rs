//! Times the bunny's G-buffer against Mesa llvmpipe, side by side: `tests/peers/llvmpipe/run.sh` builds both
//! halves and starts this one with the path of the other.
//!
//! Both get the same mesh, normals and matrix and take turns of a few frames. The measure is CPU time, of all
//! threads of a process, by the system's own count. That both draw the same is checked first.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program talks to its terminal")]

#[path = "../peer.rs"]
mod peer;
#[path = "../../../benches/workload.rs"]
mod workload;

use bitlight::pass::{Given, Kept, execute};
use bitlight::raster::NONE;
use bitlight::run::keep_memory;
use bitlight::scene::Assets;
use bitlight::techniques::translucency::{Frame, PASSES};
use glam::Vec3;
use peer::{Peer, floats, measure, medians, words};
use std::error::Error;
use std::fs;
use std::process::Command;
use workload::{BUNNY, GBUFFER, Nothing, Workload};

/// Turns that each takes, and frames of a turn.
const TURNS: usize = 6;
const FRAMES: usize = 5;

/// Width and height of the image.
const SIDE: usize = 1024;

fn main() -> Result<(), Box<dyn Error>> {
    keep_memory();
    let program = std::env::args().nth(1).ok_or("name the peer's program: see run.sh")?;
    let folder = tempfile::tempdir()?;
    let [mesh, image] = ["mesh", "image"].map(|name| folder.path().join(name));
    let work = Workload::new(&BUNNY, 1, &workload::side(SIDE), &Assets::from_environment())?;
    let frame = work.prepare(0)?;
    fs::write(&mesh, bytes(&frame))?;

    let mut rows = String::new();
    for (pool, threads) in workload::pools().iter().zip(workload::THREADS) {
        let mut command = Command::new(&program);
        command.arg(&mesh).envs([("LIBGL_ALWAYS_SOFTWARE", "1"), ("GALLIUM_DRIVER", "llvmpipe")]);
        // Its threads are beside the caller's, which waits for them: none is one.
        command.env("LP_NUM_THREADS", if threads > 1 { threads } else { 0 }.to_string());
        let mut peer = Peer::start(&mut command, "llvmpipe")?;
        peer.ask("1")?;
        if threads == 1 {
            println!("Peer: {}\n", peer.name);
            peer.ask(&image.display().to_string())?;
            println!("{}\n", agreement(&frame, &fs::read(&image)?)?);
        }
        let [mut ours, mut theirs] = [vec![], vec![]];
        for _ in 0..=TURNS {
            theirs.push(peer.measure(&FRAMES.to_string())?);
            let render = || {
                (0..FRAMES).try_for_each(|_| execute(&PASSES, &frame, &[GBUFFER], Given::new(), &mut Nothing))
            };
            ours.push(measure(std::process::id(), || Ok(pool.install(render)?))?);
        }
        // Milliseconds a frame, by all turns but the first.
        let [ours, theirs] =
            [ours, theirs].map(|turns| medians(&turns[1..]).map(|time| time * 1e3 / FRAMES as f64));
        rows += &format!(
            "| {threads} | {:.1} | {:.1} | {:.2} | {:.1} | {:.1} | {:.2} |\n",
            ours[0],
            theirs[0],
            ours[0] / theirs[0],
            ours[1],
            theirs[1],
            ours[1] / theirs[1]
        );
        eprintln!("{threads} thread(s): done");
    }
    println!(
        "| threads | CPU ms, bitlight | CPU ms, llvmpipe | ratio | clock ms, bitlight | clock ms, llvmpipe | ratio |"
    );
    println!("|---|---|---|---|---|---|---|\n{rows}");
    Ok(())
}

/// What the peer reads: see llvmpipe.c.
fn bytes(frame: &Frame) -> Vec<u8> {
    let (solid, view) = (&frame.stage.solid, &frame.view);
    let counts = [view.width, view.height, solid.positions.len(), solid.triangles.len()];
    let vertices = solid.positions.iter().zip(&solid.normals).flat_map(|(p, n)| [*p, *n]);
    let values = view.clip_from_world.into_iter().flatten().chain(vertices.flat_map(|v| v.to_array()));
    let mut bytes = words(counts.map(|count| count as u32));
    bytes.extend(floats(values));
    bytes.extend(words(solid.triangles.iter().flatten().copied()));
    bytes
}

/// How far the peer's image agrees with ours, in words.
///
/// # Errors
/// If the two do not show the same.
fn agreement(frame: &Frame, image: &[u8]) -> Result<String, Box<dyn Error>> {
    let mut kept = Kept::default();
    execute(&PASSES, frame, &["translucency.vbuffer", GBUFFER], Given::new(), &mut kept)?;
    let buffer = |name: &str| kept.get(name).ok_or_else(|| format!("{name} was not kept"));
    let (seen, ours) = (buffer("translucency.vbuffer")?.as_u32(), buffer(GBUFFER)?.as_f32());
    let theirs: Vec<f32> = image.as_chunks().0.iter().map(|value| f32::from_ne_bytes(*value)).collect();
    if theirs.len() != 9 * seen.len() {
        return Err("the peer's image has another size".into());
    }
    let (depths, rest) = theirs.split_at(seen.len());
    let (positions, normals) = rest.split_at(4 * seen.len());
    let vector = |values: &[f32], at: usize| Vec3::new(values[at], values[at + 1], values[at + 2]);
    let near = frame.view.clip_from_world[2][3];
    let [mut covered, mut either, mut same] = [0; 3];
    let radius = frame.bounds.radius();
    for pixel in 0..seen.len() {
        let [here, there] = [seen[pixel] != NONE, depths[pixel] > 0.0];
        covered += usize::from(here && there);
        either += usize::from(here || there);
        let depth = (near / depths[pixel] - ours[7 * pixel + 6]).abs();
        let position = vector(ours, 7 * pixel).distance(vector(positions, 4 * pixel));
        let normal = vector(ours, 7 * pixel + 3).distance(vector(normals, 4 * pixel));
        let close = depth < 1e-4 * radius && position < 1e-4 * radius && normal < 1e-2;
        same += usize::from(here && there && close);
    }
    let text = format!(
        "Of {either} pixels that either covers, both cover {covered}. Of these, {same} agree in depth and position \
         within 1e-4 of the solid's radius and in the normal within 1e-2."
    );
    if covered < 100_000 || 1000 * same < 999 * either {
        return Err(format!("The two do not draw the same. {text}").into());
    }
    Ok(text)
}
