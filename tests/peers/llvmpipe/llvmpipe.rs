//! Times the bunny's G-buffer against Mesa llvmpipe, side by side: `tests/peers/llvmpipe/run.sh` builds both halves and
//! starts this one with the path of the other.
//!
//! Both get the same mesh, normals and matrix and take turns of a few frames. The measure is CPU time, of all threads of
//! a process, by the system's own count. That both draw the same is checked first.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program talks to its terminal")]

#[path = "../../../benches/workload.rs"]
mod workload;

use bitlight::pass::{Kept, execute};
use bitlight::raster::NONE;
use bitlight::run::keep_memory;
use bitlight::scene::Assets;
use bitlight::techniques::translucency::{Frame, PASSES};
use glam::Vec3;
use std::error::Error;
use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};
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
        // Its threads are beside the caller's, which waits for them: none is one.
        let mut peer = Peer::start(&program, &mesh, if threads > 1 { threads } else { 0 })?;
        if threads == 1 {
            println!("Peer: {}\n", peer.name);
            peer.ask(&image.display().to_string())?;
            println!("{}\n", agreement(&frame, &fs::read(&image)?)?);
        }
        let [mut ours, mut theirs] = [vec![], vec![]];
        for _ in 0..=TURNS {
            theirs.push(measure(peer.process.id(), || peer.ask(&FRAMES.to_string()))?);
            let render = || (0..FRAMES).try_for_each(|_| execute(&PASSES, &frame, &[GBUFFER], &mut Nothing));
            ours.push(measure(std::process::id(), || Ok(pool.install(render)?))?);
        }
        let [ours, theirs] = [ours, theirs].map(medians);
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
    let (solid, view) = (&frame.solid, &frame.view);
    let counts = [view.width, view.height, solid.positions.len(), solid.triangles.len()];
    let vertices = solid.positions.iter().zip(&solid.normals).flat_map(|(p, n)| [*p, *n]);
    let floats = view.clip_from_world.into_iter().flatten().chain(vertices.flat_map(|v| v.to_array()));
    let mut bytes: Vec<u8> = counts.iter().flat_map(|count| (*count as u32).to_ne_bytes()).collect();
    bytes.extend(floats.flat_map(f32::to_ne_bytes));
    bytes.extend(solid.triangles.iter().flatten().flat_map(|corner| corner.to_ne_bytes()));
    bytes
}

/// The peer's process.
struct Peer {
    process: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
    name: String,
}

impl Peer {
    fn start(program: &str, mesh: &Path, threads: usize) -> Result<Self, Box<dyn Error>> {
        let mut process = Command::new(program)
            .arg(mesh)
            .envs([("LIBGL_ALWAYS_SOFTWARE", "1"), ("GALLIUM_DRIVER", "llvmpipe")])
            .env("LP_NUM_THREADS", threads.to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let input = process.stdin.take().ok_or("no input")?;
        let output = BufReader::new(process.stdout.take().ok_or("no output")?);
        let mut peer = Self { process, input, output, name: String::new() };
        peer.name = peer.answer()?;
        if !peer.name.starts_with("llvmpipe") {
            return Err(format!("the peer is {}, not llvmpipe", peer.name).into());
        }
        peer.ask("1")?;
        Ok(peer)
    }

    fn answer(&mut self) -> Result<String, Box<dyn Error>> {
        let mut line = String::new();
        match self.output.read_line(&mut line)? {
            0 => Err("the peer has ended".into()),
            _ => Ok(line.trim().into()),
        }
    }

    fn ask(&mut self, what: &str) -> Result<(), Box<dyn Error>> {
        writeln!(self.input, "{what}")?;
        self.answer().map(drop)
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        // It only ever waits for the next line; that it has ended already is no matter.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// CPU time and time of what a process does meanwhile.
fn measure(
    process: u32,
    work: impl FnOnce() -> Result<(), Box<dyn Error>>,
) -> Result<[Duration; 2], Box<dyn Error>> {
    let (used, begun) = (cpu_time(process)?, Instant::now());
    work()?;
    let passed = begun.elapsed();
    Ok([cpu_time(process)? - used, passed])
}

/// CPU time of all threads that a process has, in user and system mode.
fn cpu_time(process: u32) -> Result<Duration, Box<dyn Error>> {
    let mut total = 0;
    for thread in fs::read_dir(format!("/proc/{process}/task"))? {
        let text = fs::read_to_string(thread?.path().join("schedstat"))?;
        total += text.split(' ').next().ok_or("an empty schedstat")?.parse::<u64>()?;
    }
    Ok(Duration::from_nanos(total))
}

/// Medians over the turns but the first, in milliseconds a frame.
fn medians(turns: Vec<[Duration; 2]>) -> [f64; 2] {
    [0, 1].map(|which| {
        let mut times: Vec<_> = turns[1..].iter().map(|turn| turn[which]).collect();
        times.sort();
        times[times.len() / 2].as_secs_f64() * 1e3 / FRAMES as f64
    })
}

/// How far the peer's image agrees with ours, in words.
///
/// # Errors
/// If the two do not show the same.
fn agreement(frame: &Frame, image: &[u8]) -> Result<String, Box<dyn Error>> {
    let mut kept = Kept::default();
    execute(&PASSES, frame, &["translucency.visibility", GBUFFER], &mut kept)?;
    let buffer = |name: &str| kept.get(name).ok_or_else(|| format!("{name} was not kept"));
    let (seen, ours) = (buffer("translucency.visibility")?.as_u32(), buffer(GBUFFER)?.as_f32());
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
