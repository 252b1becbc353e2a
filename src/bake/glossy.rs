//! Glossy interreflection: what blocked directions bring from surfaces with any BRDF.
//!
//! With M_q the transfer matrix of a vertex q, the radiance that leaves it towards the world's direction o is
//! y(D_q o)·B M_q L = y(o)·X_q L, X_q = D_qᵀ B M_q. Where the direction ω of a vertex x meets a triangle, the
//! matrix of x gains y(R_x ω) ⊗ y(−ω)·Σ w_q X_q over the triangle's corners, times the solid angle. One
//! bounce does this once to the matrices of the bounce before; transfer is the sum over all. Exit radiance is
//! the series of B in `bands` bands, also for exits below a corner's own horizon.

use super::bounce::Meetings;
use super::frame::frame;
use super::{Directions, Estimate, RUN};
use crate::numeric::lanes::wide;
use crate::numeric::parallel;
use crate::sphere::rotation::Rotation;
use crate::sphere::sh;
use crate::world::mesh::Mesh;

/// Transfer matrices with `bounces` interreflections, RGB, `[vertices][bands²][bands²][3]`, from the `direct`
/// ones ([`super::matrices`] of all vertices) and a BRDF's `matrix` ([`super::brdf::matrix`]).
///
/// Memory: the result has 12 bands⁴ bytes a vertex, and a bounce takes three times that while it is computed,
/// beside `direct`.
///
/// # Panics
/// Where `direct` has not bands⁴ items a vertex, or `matrix` not bands⁴.
#[expect(clippy::too_many_arguments, reason = "the equation's parts, each its own")]
pub fn glossy_bounces(
    mesh: &Mesh,
    directions: &Directions,
    meetings: &Meetings,
    estimate: Estimate,
    direct: &[f32],
    bands: usize,
    matrix: &[[f32; 3]],
    bounces: usize,
) -> Vec<f32> {
    let functions = bands * bands;
    assert_eq!(direct.len(), mesh.positions.len() * functions * functions, "one matrix a vertex");
    assert_eq!(matrix.len(), functions * functions, "a matrix as large as the vertices'");
    let mut total: Vec<f32> = direct.iter().flat_map(|entry| [*entry; 3]).collect();
    let mut term = total.clone();
    let basis = basis(directions, bands);
    for _ in 0..bounces {
        exits(mesh, bands, matrix, &mut term);
        term = arrive(mesh, directions, meetings, estimate, bands, &basis, &term);
        total.iter_mut().zip(&term).for_each(|(sum, t)| *sum += t);
    }
    total
}

/// The basis at every direction, `[directions][bands²]`.
fn basis(directions: &Directions, bands: usize) -> Vec<f64> {
    let mut all = vec![0.0; directions.count() * bands * bands];
    for (row, direction) in all.chunks_exact_mut(bands * bands).zip(&directions.exact) {
        sh::evaluate(bands, *direction, row);
    }
    all
}

/// Replaces the matrices of arriving light by X, those of leaving light in the world's frame.
fn exits(mesh: &Mesh, bands: usize, brdf: &[[f32; 3]], matrices: &mut [f32]) {
    let functions = bands * bands;
    let width = functions * 3;
    parallel::for_each_chunk(matrices, functions * width, |vertex, matrix| {
        let [t, b, n] = frame(mesh.normals[vertex]);
        let back = [0, 1, 2].map(|axis| [t[axis], b[axis], n[axis]]);
        let rotation = Rotation::new(bands, back).expect("a frame is a rotation");
        let mut leaving = vec![0.0; functions * width];
        for (sums, factors) in leaving.chunks_exact_mut(width).zip(brdf.chunks_exact(functions)) {
            for (factor, row) in factors.iter().zip(matrix.chunks_exact(width)) {
                // Of an isotropic BRDF most factors are 0.
                if *factor != [0.0; 3] {
                    add_coloured(sums, factor.map(f64::from), row);
                }
            }
        }
        let turned = rotation.rotate_columns(&leaving, width);
        matrix.iter_mut().zip(turned).for_each(|(out, entry)| *out = entry as f32);
    });
}

/// The matrices of arriving light, from those of leaving light.
fn arrive(
    mesh: &Mesh,
    directions: &Directions,
    meetings: &Meetings,
    estimate: Estimate,
    bands: usize,
    basis: &[f64],
    exits: &[f32],
) -> Vec<f32> {
    let functions = bands * bands;
    let width = functions * 3;
    let mut arriving = vec![0.0; exits.len()];
    parallel::for_each_chunk(&mut arriving, RUN * functions * width, |run, rows| {
        let mut sums = vec![0.0; functions * width];
        let mut leaving = vec![0.0; width];
        for (index, out) in rows.chunks_exact_mut(functions * width).enumerate() {
            let vertex = run * RUN + index;
            sums.fill(0.0);
            for meeting in meetings.of(vertex) {
                let direction = meeting.direction as usize;
                let basis = &basis[direction * functions..(direction + 1) * functions];
                leaving.fill(0.0);
                let [a, b, c] = meeting.corners(mesh).map(|(corner, weight)| {
                    (weight, &exits[corner * functions * width..(corner + 1) * functions * width])
                });
                for l in 0..bands {
                    // y_lm(−ω) = (−1)^l y_lm(ω)
                    let sign = if l % 2 == 0 { 1.0 } else { -1.0 };
                    for k in l * l..(l + 1) * (l + 1) {
                        let row = k * width..(k + 1) * width;
                        let rows = [(a.0, &a.1[row.clone()]), (b.0, &b.1[row.clone()]), (c.0, &c.1[row])];
                        mix(&mut leaving, (sign * basis[k]) as f32, rows);
                    }
                }
                outer(&mut sums, basis, &leaving);
            }
            let [scale, _] = meetings.scales(vertex, estimate);
            let share = scale * directions.weight();
            let rotation = Rotation::new(bands, frame(mesh.normals[vertex])).expect("a frame is a rotation");
            sums.iter_mut().for_each(|sum| *sum *= share);
            for (out, entry) in out.iter_mut().zip(rotation.rotate_columns(&sums, width)) {
                *out = entry as f32;
            }
        }
    });
    arriving
}

wide! {
    /// Adds `factor` times the weighted sum of three rows.
    fn mix(sums: &mut [f32], factor: f32, rows: [(f32, &[f32]); 3]) {
        let [a, b, c] = rows;
        let (p, q, r) = (factor * a.0, factor * b.0, factor * c.0);
        for (((sum, x), y), z) in sums.iter_mut().zip(a.1).zip(b.1).zip(c.1) {
            *sum += p * x + q * y + r * z;
        }
    }
}

wide! {
    /// Adds a row of colours, times a colour.
    fn add_coloured(sums: &mut [f64], factor: [f64; 3], row: &[f32]) {
        for (sums, row) in sums.as_chunks_mut::<3>().0.iter_mut().zip(row.as_chunks::<3>().0) {
            for channel in 0..3 {
                sums[channel] += factor[channel] * f64::from(row[channel]);
            }
        }
    }
}

wide! {
    /// Adds the product of a column and a row.
    fn outer(sums: &mut [f64], column: &[f64], row: &[f32]) {
        for (sums, factor) in sums.chunks_exact_mut(row.len()).zip(column) {
            for (sum, x) in sums.iter_mut().zip(row) {
                *sum += factor * f64::from(*x);
            }
        }
    }
}
