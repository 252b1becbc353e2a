//! `bake/` against closed forms, against itself by other routes, and against the reference crate.
#![allow(clippy::disallowed_methods, reason = "an oracle may use the standard library")]
#![allow(clippy::print_stdout, reason = "figures beside what is asserted of them")]

mod bounces;
mod matrices;
mod odd;
mod scattering;
mod truth;
mod twin;
mod vectors;

use bitlight::numeric::random::unit;
use bitlight::world::mesh::Mesh;
use bitlight::world::shapes;
use glam::Vec3;

const PI: f64 = std::f64::consts::PI;

/// A small concave mesh: every vertex sees other parts of it.
fn knot() -> Mesh {
    shapes::torus_knot(2, 3, 0.3, 60, 12).unwrap()
}

/// Some light that is the same in every run: coefficients that fall with the band.
fn light(bands: usize) -> Vec<f64> {
    (0..bands * bands)
        .map(|i| (f64::from(unit(5, i as u64, 0, 0)) - 0.4) / (1.0 + i.isqrt() as f64))
        .collect()
}

fn dot(a: &[f32], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| f64::from(*a) * b).sum()
}

/// Root mean square difference of two results.
fn rms(a: &[f32], b: &[f32]) -> f64 {
    let square: f64 = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum();
    (square / a.len() as f64).sqrt()
}

/// The mesh turned inside out.
fn inverted(mesh: &Mesh) -> Mesh {
    let normals = mesh.normals.iter().map(|n| -*n).collect();
    let triangles = mesh.triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
    Mesh::new(mesh.positions.clone(), Some(normals), triangles).unwrap()
}

/// A square grid of (cells + 1)² vertices about the origin in the plane z = `height`, `side` long, that faces
/// up or down.
fn grid(cells: usize, side: f32, height: f32, up: bool) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let at = |i: usize| side * (i as f32 / cells as f32 - 0.5);
    let positions =
        (0..=cells).flat_map(|j| (0..=cells).map(move |i| Vec3::new(at(i), at(j), height))).collect();
    let mut triangles = Vec::new();
    for j in 0..cells {
        for i in 0..cells {
            let a = (j * (cells + 1) + i) as u32;
            let (b, c, d) = (a + 1, a + cells as u32 + 2, a + cells as u32 + 1);
            triangles.extend(if up { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] });
        }
    }
    (positions, triangles)
}
