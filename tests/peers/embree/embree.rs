//! Times rays against Embree 4, side by side: `tests/peers/embree/run.sh` builds both halves and starts this
//! one with the path of the other.
//!
//! Both get the same mesh and the same rays, answer on one thread and take turns. The measure is CPU time by
//! the system's own count. In how many rays the two answers differ stands beside it.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program talks to its terminal")]

#[path = "../peer.rs"]
mod peer;
#[path = "../../../benches/workload.rs"]
mod workload;

use bitlight::numeric::double::{cos, sin};
use bitlight::numeric::order::max;
use bitlight::numeric::random::unit;
use bitlight::raster::{Axes, NONE, View, visibility};
use bitlight::run::keep_memory;
use bitlight::scene::Assets;
use bitlight::sphere::quadrature::fibonacci;
use bitlight::store::file;
use bitlight::trace::bundle::{self, WORD};
use bitlight::trace::{Bvh, Hit, Ray};
use bitlight::world::camera::Camera;
use bitlight::world::mesh::Mesh;
use bitlight::world::shapes;
use glam::Vec3;
use peer::{Peer, floats, measure, medians, words};
use rayon::ThreadPool;
use std::error::Error;
use std::f64::consts::TAU;
use std::fs;
use std::hint::black_box;
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

/// Turns that count, of each.
const TURNS: usize = 5;

/// The least CPU time of a turn: shorter work is repeated.
const TURN: Duration = Duration::from_millis(200);

/// Directions over the sphere where the mesh is what varies.
const DIRECTIONS: usize = 64;

/// Random rays.
const RAYS: usize = 1_000_000;

/// Width and height of the image.
const SIDE: usize = 1024;

/// Which part of the mesh's radius is the least distance of a hit of Embree's rays from vertices.
const LEAST: f32 = 1e-4;

/// The ways to ask Embree: rays a call, and whether they are called coherent.
const CALLS: [[usize; 2]; 5] = [[1, 0], [8, 0], [8, 1], [16, 0], [16, 1]];

fn main() -> Result<(), Box<dyn Error>> {
    keep_memory();
    let program = std::env::args().nth(1).ok_or("name the peer's program: see run.sh")?.into();
    let folder = tempfile::tempdir()?;
    let [pool, _] = workload::pools();
    let mut bench =
        Bench { program, pool, work: folder.path().join("work"), answers: folder.path().join("answers") };
    let assets = Assets::from_environment();
    let asset = |name: &str| -> Result<Mesh, Box<dyn Error>> {
        Ok(file::read_obj(assets.find(&format!("stanford/{name}.obj"))?)?)
    };
    let bunny = asset("stanford-bunny")?;
    let knots = [8, 25, 79, 250].map(|n| shapes::torus_knot(2, 3, 0.25, 8 * n, n));
    let [armadillo, buddha] = [asset("armadillo")?, asset("buddha")?];
    println!("Peer: {}\n", bench.start(&Work::new(&bunny))?.name);

    println!("Occlusion from every vertex, directions over the sphere, those above the vertex's horizon:\n");
    head(&["mesh", "triangles", "directions"], &RAYS_COLUMNS);
    for directions in [64, 256, 1024] {
        bench.bake("bunny", &bunny, directions)?;
    }
    for knot in knots {
        bench.bake("knot", &knot?, DIRECTIONS)?;
    }
    bench.bake("armadillo", &armadillo, DIRECTIONS)?;
    bench.bake("buddha", &buddha, DIRECTIONS)?;

    println!("\nNearest hits of random rays that start within the sphere about the mesh:\n");
    head(&["mesh", "triangles"], &RAYS_COLUMNS);
    bench.nearest("bunny", &bunny)?;
    bench.nearest("knot", &shapes::torus_knot(2, 3, 0.25, 2000, 250)?)?;

    println!("\nWhat each pixel of a camera sees, {SIDE} × {SIDE}:\n");
    head(&["bunny by", "covered"], &RAYS_COLUMNS);
    bench.primary(&bunny)?;

    println!("\nMaking the tree, CPU ms:\n");
    head(&["mesh", "triangles"], &["bitlight", "Embree", "robust", "ratio"]);
    bench.build("bunny", &bunny)?;
    bench.build("knot", &shapes::torus_knot(2, 3, 0.25, 2000, 250)?)?;
    Ok(())
}

/// The columns that all tables of rays end with: million rays a CPU second, Embree's by calls of 1, 8 and 16
/// rays and those of its robust scene; CPU time over that of the fastest of Embree's plain scene; of a
/// million rays, how many the plain and the robust scene answer otherwise than bitlight.
const RAYS_COLUMNS: [&str; 9] =
    ["rays", "bitlight", "Embree by 1", "by 8", "by 16", "robust", "ratio", "differ", "differ, robust"];

/// Prints a table's head.
fn head(first: &[&str], rest: &[&str]) {
    let columns: Vec<_> = first.iter().chain(rest).copied().collect();
    println!("| {} |\n|{}", columns.join(" | "), "---|".repeat(columns.len()));
}

/// What the peer reads: see embree.c.
struct Work<'a> {
    mesh: &'a Mesh,
    directions: Vec<Vec3>,
    rays: Vec<Ray>,
    view: [Vec3; 4],
}

impl<'a> Work<'a> {
    fn new(mesh: &'a Mesh) -> Self {
        Self { mesh, directions: vec![], rays: vec![], view: [Vec3::ZERO; 4] }
    }

    fn bytes(&self) -> Vec<u8> {
        let Self { mesh, directions, rays, view } = self;
        let sizes = [mesh.positions.len(), mesh.triangles.len(), directions.len(), rays.len(), SIDE];
        let mut bytes = words(sizes.map(|size| size as u32));
        bytes.extend(floats([LEAST * mesh.bounds().radius()]));
        bytes.extend(floats(mesh.positions.iter().chain(&mesh.normals).flat_map(|vector| vector.to_array())));
        bytes.extend(words(mesh.triangles.iter().flatten().copied()));
        let rays = rays.iter().flat_map(|ray| [ray.origin, ray.direction]);
        bytes.extend(floats(
            directions.iter().copied().chain(rays).chain(*view).flat_map(|vector| vector.to_array()),
        ));
        bytes
    }
}

struct Bench {
    program: PathBuf,
    pool: ThreadPool,
    work: PathBuf,
    answers: PathBuf,
}

impl Bench {
    fn start(&self, work: &Work) -> Result<Peer, Box<dyn Error>> {
        fs::write(&self.work, work.bytes())?;
        let mut peer = Peer::start(Command::new(&self.program).arg(&self.work), "Embree")?;
        peer.ask("build 0")?;
        peer.ask("build 1")?;
        Ok(peer)
    }

    fn bake(&mut self, name: &str, mesh: &Mesh, directions: usize) -> Result<(), Box<dyn Error>> {
        let directions =
            fibonacci(directions).iter().map(|d| Vec3::from_array(d.map(|d| d as f32))).collect();
        let work = Work { directions, ..Work::new(mesh) };
        let mut peer = self.start(&work)?;
        let ours = || bundle::visibility(mesh, &mesh.positions, &mesh.normals, &work.directions);
        let (seen, width) = (self.pool.install(ours), work.directions.len().div_ceil(WORD));
        // The peer's answers: 0 free, 1 blocked, 2 no ray.
        let (bvh, least) = (Bvh::new(mesh), LEAST * mesh.bounds().radius());
        let mut count = |answers: &[u8]| {
            let [mut rays, mut differ, mut near] = [0; 3];
            let points =
                mesh.positions.iter().zip(seen.chunks(width).zip(answers.chunks(work.directions.len())));
            for (point, (row, answers)) in points {
                for (direction, answer) in answers.iter().enumerate() {
                    let free = row[direction / WORD] >> (direction % WORD) & 1 == 1;
                    rays += usize::from(*answer < 2);
                    if free != (*answer == 0) {
                        let hit = bvh.nearest(&Ray::new(*point, work.directions[direction]));
                        differ += 1;
                        near += usize::from(hit.is_some_and(|hit| hit.t < least));
                    }
                }
            }
            eprintln!("{name}: of {differ} rays that differ {near} hit nearer than Embree looks");
            [rays, differ]
        };
        let calls = |robust: usize| {
            let bake = move |[width, coherent]: [usize; 2]| {
                [0, 1].map(|order| (width, format!("bake {robust} {width} {coherent} {order}")))
            };
            CALLS.map(bake).into_iter().flatten().collect::<Vec<_>>()
        };
        let row = format!("{name} | {} | {}", mesh.triangles.len(), work.directions.len());
        self.row(&row, &mut peer, calls, &mut count, &|| drop(black_box(ours())))
    }

    fn nearest(&mut self, name: &str, mesh: &Mesh) -> Result<(), Box<dyn Error>> {
        let work = Work { rays: rays(mesh), ..Work::new(mesh) };
        let mut peer = self.start(&work)?;
        let bvh = Bvh::new(mesh);
        let ours = || work.rays.iter().map(|ray| bvh.nearest(ray)).collect::<Vec<_>>();
        let hits = self.pool.install(ours);
        let mut count = |answers: &[u8]| {
            let pairs = hits.iter().zip(triangles(answers));
            [
                hits.len(),
                pairs.filter(|(hit, triangle)| hit.map_or(NONE, |hit| hit.triangle) != *triangle).count(),
            ]
        };
        let row = format!("{name} | {}", mesh.triangles.len());
        self.row(&row, &mut peer, |robust| calls("nearest", robust), &mut count, &|| drop(black_box(ours())))
    }

    fn primary(&mut self, mesh: &Mesh) -> Result<(), Box<dyn Error>> {
        let bounds = mesh.bounds();
        let camera = Camera {
            position: bounds.center() + Vec3::Z * (2.5 * bounds.radius()),
            target: bounds.center(),
            up: Vec3::Y,
            fov: 36.0,
        };
        let axes = Axes::looking(camera.target - camera.position, camera.up);
        let tangents = camera.tangents(SIDE, SIDE);
        let view = View::perspective(camera.position, axes, tangents, camera.near(&bounds), [SIDE, SIDE]);
        let [right, up] = [axes.right * tangents[0], axes.up * tangents[1]];
        let step = 2.0 / SIDE as f32;
        let image = [camera.position, axes.forward - right + up, right * step, up * -step];
        let mut peer = self.start(&Work { view: image, ..Work::new(mesh) })?;

        let raster = || visibility(&mesh.positions, &mesh.triangles, &view).triangle;
        let bvh = Bvh::new(mesh);
        let trace = || {
            let pixel = |pixel: usize| {
                let [x, y] = [pixel % SIDE, pixel / SIDE].map(|at| at as f32 + 0.5);
                let ray = Ray::new(image[0], image[1] + image[2] * x + image[3] * y);
                bvh.nearest(&ray).map_or(NONE, |hit: Hit| hit.triangle)
            };
            (0..SIDE * SIDE).map(pixel).collect()
        };
        let ways: [(&str, &(dyn Fn() -> Vec<u32> + Sync)); 2] =
            [("`raster::visibility`", &raster), ("`Bvh::nearest`", &trace)];
        for (name, ours) in ways {
            let seen = self.pool.install(ours);
            let covered =
                seen.iter().filter(|triangle| **triangle != NONE).count() as f64 / seen.len() as f64;
            let mut count = |answers: &[u8]| {
                [
                    seen.len(),
                    seen.iter().zip(triangles(answers)).filter(|(ours, theirs)| **ours != *theirs).count(),
                ]
            };
            let row = format!("{name} | {:.0} %", covered * 100.0);
            self.row(&row, &mut peer, |robust| calls("primary", robust), &mut count, &|| {
                drop(black_box(ours()))
            })?;
        }
        Ok(())
    }

    fn build(&mut self, name: &str, mesh: &Mesh) -> Result<(), Box<dyn Error>> {
        let mut peer = self.start(&Work::new(mesh))?;
        let mut times = [vec![], vec![], vec![]];
        for _ in 0..TURNS {
            for robust in [0, 1] {
                times[robust].push(peer.measure(&format!("build {robust}"))?);
            }
            times[2].push(self.ours(1, &|| drop(black_box(Bvh::new(mesh))))?);
        }
        let [plain, robust, ours] = times.map(|turns| medians(&turns)[0] * 1e3);
        let count = mesh.triangles.len();
        println!("| {name} | {count} | {ours:.0} | {plain:.0} | {robust:.0} | {:.2} |", ours / plain);
        Ok(())
    }

    fn ours(&self, repeats: usize, work: &(dyn Fn() + Sync)) -> Result<[Duration; 2], Box<dyn Error>> {
        measure(std::process::id(), || {
            self.pool.install(|| (0..repeats).for_each(|_| work()));
            Ok(())
        })
    }

    /// Measures one row and prints it. `calls` are the peer's ways of a plain (0) or robust (1) scene: of
    /// each width the one that is fastest in a trial is timed. `count` counts the rays and those whose
    /// answers differ.
    fn row(
        &self,
        name: &str,
        peer: &mut Peer,
        calls: impl Fn(usize) -> Vec<(usize, String)>,
        count: &mut dyn FnMut(&[u8]) -> [usize; 2],
        ours: &(dyn Fn() + Sync),
    ) -> Result<(), Box<dyn Error>> {
        let mut fastest: Vec<(usize, String, Duration)> = vec![];
        for (width, call) in calls(0) {
            let time = peer.measure(&call)?[0];
            match fastest.iter_mut().find(|known| known.0 == width) {
                Some(known) if time < known.2 => *known = (width, call, time),
                Some(_) => {}
                None => fastest.push((width, call, time)),
            }
        }
        // The robust scene gets the call that is fastest of all on the plain one.
        let best = fastest.iter().min_by_key(|known| known.2).ok_or("no way")?;
        let number = calls(0).iter().position(|call| call.1 == best.1).ok_or("no way")?;
        let robust = calls(1).swap_remove(number).1;
        let repeats = |time: Duration| TURN.as_nanos().div_ceil(time.as_nanos().max(1)) as usize;
        let mut differ = vec![];
        for call in [&best.1, &robust] {
            peer.ask(call)?;
            peer.ask(&format!("save {}", self.answers.display()))?;
            differ.push(count(&fs::read(&self.answers)?));
        }
        let rays = differ[0][0];
        let theirs: Vec<_> = fastest.iter().map(|way| &way.1).chain([&robust]).collect();
        let times = repeats(best.2);
        let mine = repeats(self.ours(1, ours)?[0]);
        let mut turns = vec![vec![]; theirs.len() + 1];
        for _ in 0..TURNS {
            for (turns, call) in turns.iter_mut().zip(&theirs) {
                let mut total = [Duration::ZERO; 2];
                for _ in 0..times {
                    let turn = peer.measure(call)?;
                    total = [total[0] + turn[0], total[1] + turn[1]];
                }
                turns.push(total.map(|time| time / times as u32));
            }
            turns[theirs.len()].push(self.ours(mine, ours)?.map(|time| time / mine as u32));
        }
        let seconds: Vec<_> = turns.iter().map(|turns| medians(turns)[0]).collect();
        let speed = |seconds: f64| format!("{:.2}", rays as f64 / seconds / 1e6);
        let speeds: Vec<_> = seconds[..theirs.len()].iter().map(|seconds| speed(*seconds)).collect();
        let mine = seconds[theirs.len()];
        let least = seconds[..fastest.len()].iter().copied().reduce(|a, b| if b < a { b } else { a });
        let ratio = mine / least.ok_or("no way")?;
        let parts = differ.iter().map(|[rays, differ]| format!("{:.1}", *differ as f64 * 1e6 / *rays as f64));
        println!(
            "| {name} | {rays} | {} | {} | {ratio:.2} | {} |",
            speed(mine),
            speeds.join(" | "),
            parts.collect::<Vec<_>>().join(" | ")
        );
        eprintln!("{name}: {}", theirs.iter().map(|call| call.as_str()).collect::<Vec<_>>().join(", "));
        Ok(())
    }
}

/// The peer's ways of one kind of work.
fn calls(what: &str, robust: usize) -> Vec<(usize, String)> {
    CALLS.iter().map(|[width, coherent]| (*width, format!("{what} {robust} {width} {coherent}"))).collect()
}

/// The triangles of the peer's hits.
fn triangles(answers: &[u8]) -> impl Iterator<Item = u32> {
    answers.as_chunks::<8>().0.iter().map(|[_, _, _, _, triangle @ ..]| u32::from_ne_bytes(*triangle))
}

/// Rays that start evenly within the sphere about the mesh, in directions spread evenly.
fn rays(mesh: &Mesh) -> Vec<Ray> {
    let (center, radius) = (mesh.bounds().center(), mesh.bounds().radius());
    let direction = |ray: usize, first: u64| {
        let number = |which| f64::from(unit(1, ray as u64, 0, which));
        let (z, angle) = (2.0 * number(first) - 1.0, TAU * number(first + 1));
        let across = (1.0 - z * z).sqrt();
        Vec3::new((across * cos(angle)) as f32, (across * sin(angle)) as f32, z as f32)
    };
    let ray = |ray: usize| {
        // The greatest of three even numbers is spread as the distance within a ball.
        let far = [5, 6]
            .iter()
            .fold(unit(1, ray as u64, 0, 4), |far, which| max(far, unit(1, ray as u64, 0, *which)));
        Ray::new(center + direction(ray, 0) * (radius * far), direction(ray, 2))
    };
    (0..RAYS).map(ray).collect()
}
