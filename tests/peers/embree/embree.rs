//! Times rays against Embree 4, side by side: `tests/peers/embree/run.sh` builds both halves and starts this one with the
//! path of the other.
//!
//! Both get the same mesh and the same rays, answer on one thread and take turns. The measure is CPU time by the system's
//! own count. In how many rays the two answers differ stands beside it.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program talks to its terminal")]

#[path = "../peer.rs"]
mod peer;
#[path = "../../../benches/workload.rs"]
mod workload;

use bitlight::numeric::random::unit;
use bitlight::numeric::double::{cos, sin};
use bitlight::raster::{Axes, NONE, View, visibility};
use bitlight::run::keep_memory;
use bitlight::scene::Assets;
use bitlight::sphere::quadrature::fibonacci;
use bitlight::world::{Camera, Mesh, obj, shapes};
use glam::Vec3;
use peer::{Peer, floats, measure, medians, words};
use std::error::Error;
use std::f64::consts::TAU;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// Turns that count of each.
const TURNS: usize = 5;

/// The least CPU time of a turn: short work is repeated.
const TURN: Duration = Duration::from_millis(200);

/// Directions over the sphere where the mesh is what varies.
const DIRECTIONS: usize = 64;

/// Random rays.
const RAYS: usize = 1_000_000;

/// Width and height of the image.
const SIDE: usize = 1024;

/// Which part of the mesh's radius is the least distance of a hit of Embree's rays from vertices.
const LEAST: f32 = 1e-4;

fn main() -> Result<(), Box<dyn Error>> {
    keep_memory();
    let program = PathBuf::from(std::env::args().nth(1).ok_or("name the peer's program: see run.sh")?);
    let assets = Assets::from_environment();
    let asset = |name: &str| -> Result<Mesh, Box<dyn Error>> {
        Ok(obj::read(assets.find(&format!("stanford/{name}.obj"))?)?)
    };
    let knot = |n: usize| shapes::torus_knot(2, 3, 0.25, 8 * n, n);
    let bunny = asset("stanford-bunny")?;
    Ok(())
}
