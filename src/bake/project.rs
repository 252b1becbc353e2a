//! Projection onto the basis of V(ω) times a weight that depends on the angle to the normal alone:
//! ∫ V(ω) k(n·ω) y_i(ω) dω, as a sum over directions.
//!
//! One kernel serves all that follows: k = 1 gives the visibility itself (and the printed vectors), k = cos/π
//! the corrected ones, k = cos F_t what enters a translucent solid. Without occluders the integral is known:
//! a zonal function's coefficients are those of its profile, z_l = 2π ∫₀¹ k(c) P_l(c) dc, times y_i(n)
//! (Ramamoorthi and Hanrahan 2001, §3).

use super::{Directions, Estimate, RUN, Visibility};
use crate::numeric::lanes::wide;
use crate::numeric::parallel;
use crate::sphere::quadrature::gauss_legendre;
use crate::sphere::sh;
use crate::trace::bundle::WORD;
use crate::world::mesh::Mesh;
use std::f64::consts::PI;
use std::ops::Range;

/// Functions that are summed together.
const TILE: usize = 16;

/// The basis at every direction.
pub(super) struct Table {
    /// `[tiles][directions]`: [`TILE`] functions each, the last tile filled up with 0.
    values: Vec<[f64; TILE]>,
    count: usize,
}

impl Table {
    pub(super) fn new(bands: usize, directions: &Directions) -> Self {
        let (count, functions) = (directions.count(), bands * bands);
        let mut values = vec![[0.0; TILE]; functions.div_ceil(TILE) * count];
        let mut all = vec![0.0; functions];
        for (index, direction) in directions.exact.iter().enumerate() {
            sh::evaluate(bands, *direction, &mut all);
            for (tile, part) in all.chunks(TILE).enumerate() {
                values[tile * count + index][..part.len()].copy_from_slice(part);
            }
        }
        Self { values, count }
    }

    /// Σ weight · y over `terms` (direction, weight), in their order, into `sums` (bands² items).
    pub(super) fn sum(&self, terms: &[(u32, f64)], sums: &mut [f64]) {
        for (tile, out) in sums.chunks_mut(TILE).enumerate() {
            let total = tile_sum(&self.values[tile * self.count..(tile + 1) * self.count], terms);
            out.copy_from_slice(&total[..out.len()]);
        }
    }
}

wide! {
    fn tile_sum(values: &[[f64; TILE]], terms: &[(u32, f64)]) -> [f64; TILE] {
        let mut total = [0.0; TILE];
        for (direction, weight) in terms {
            let row = &values[*direction as usize];
            for lane in 0..TILE {
                total[lane] += weight * row[lane];
            }
        }
        total
    }
}

/// z_l = 2π ∫₀¹ k(c) P_l(c) dc for l below `bands`, exact for polynomials k to degree 64.
pub(super) fn zonal(bands: usize, k: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut integrals = vec![0.0; bands];
    for (node, weight) in gauss_legendre(33 + bands.div_ceil(2)) {
        let c = 0.5 * (node + 1.0);
        let (mut below, mut legendre) = (0.0, 1.0);
        for (l, integral) in integrals.iter_mut().enumerate() {
            *integral += PI * weight * k(c) * legendre;
            let l = l as f64;
            (below, legendre) = (legendre, ((2.0 * l + 1.0) * c * legendre - l * below) / (l + 1.0));
        }
    }
    integrals
}

/// Appends the directions whose bits are set, in order, each with k of its cosine to `normal` times its solid
/// angle.
fn terms(
    directions: &Directions,
    normal: [f64; 3],
    bits: &[u32],
    k: &impl Fn(f64) -> f64,
    terms: &mut Vec<(u32, f64)>,
) {
    let solid_angle = directions.weight();
    for (index, word) in bits.iter().enumerate() {
        let mut rest = *word;
        while rest != 0 {
            let direction = index * WORD + rest.trailing_zeros() as usize;
            rest &= rest - 1;
            let [x, y, z] = directions.exact[direction];
            let cosine = normal[0] * x + normal[1] * y + normal[2] * z;
            // The horizon was decided in `f32`. A direction on it may lie below it by a rounding.
            let cosine = if cosine > 0.0 { cosine } else { 0.0 };
            terms.push((direction as u32, solid_angle * k(cosine)));
        }
    }
}

/// ∫ V(ω) k(n·ω) y_i(ω) dω of each of `vertices` in `f64`, handed to `put` with the vertex and its `width`
/// items of the result.
#[expect(clippy::too_many_arguments, reason = "the integral's parts, each its own")]
pub(super) fn project<T: Clone + Default + Send>(
    mesh: &Mesh,
    directions: &Directions,
    visibility: &Visibility,
    bands: usize,
    estimate: Estimate,
    k: impl Fn(f64) -> f64 + Sync,
    vertices: Range<usize>,
    (width, put): (usize, impl Fn(usize, &[f64], &mut [T]) + Sync),
) -> Vec<T> {
    let table = Table::new(bands, directions);
    let profile = zonal(bands, &k);
    let mut results = vec![T::default(); vertices.len() * width];
    parallel::for_each_chunk(&mut results, RUN * width, |run, results| {
        let (mut sums, mut rest) = (vec![0.0; bands * bands], vec![0.0; bands * bands]);
        let (mut seen, mut hidden) = (Vec::new(), Vec::new());
        for (index, result) in results.chunks_exact_mut(width).enumerate() {
            let vertex = vertices.start + run * RUN + index;
            let normal = mesh.normals[vertex].as_dvec3().to_array();
            let (visible, blocked) = visibility.of(vertex);
            seen.clear();
            terms(directions, normal, visible, &k, &mut seen);
            table.sum(&seen, &mut sums);
            if estimate == Estimate::Control {
                hidden.clear();
                terms(directions, normal, blocked, &k, &mut hidden);
                table.sum(&hidden, &mut rest);
                control(&profile, normal, [&seen, &hidden], &mut sums, &rest);
            }
            put(vertex, &sums, result);
        }
    });
    results
}

/// Adds to `sums`, which are over the visible directions, the visible part of what the sums over the whole
/// hemisphere (`sums` + `rest`) lack.
fn control(
    profile: &[f64],
    normal: [f64; 3],
    [seen, hidden]: [&[(u32, f64)]; 2],
    sums: &mut [f64],
    rest: &[f64],
) {
    let total = |terms: &[(u32, f64)]| terms.iter().fold(0.0, |total, (_, weight)| total + weight);
    let (seen, hidden) = (total(seen), total(hidden));
    if seen == 0.0 {
        return;
    }
    let part = seen / (seen + hidden);
    let mut exact = vec![0.0; sums.len()];
    sh::evaluate(profile.len(), normal, &mut exact);
    for (l, z) in profile.iter().enumerate() {
        for i in l * l..(l + 1) * (l + 1) {
            sums[i] += part * (z * exact[i] - (sums[i] + rest[i]));
        }
    }
}
