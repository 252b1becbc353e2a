//! Light between the parts of a mesh: what blocked directions meet, and diffuse interreflection along them.
//!
//! A blocked direction looks up what leaves the nearest triangle, interpolated between its corners (Sloan,
//! Kautz and Snyder 2002). The operator (G s)(x) = (1/π) ∫_blocked max(0, n·ω) s(y(x, ω)) dω takes any source
//! s that is given at the vertices: transfer vectors, or plain radiance. Diffuse transfer after k bounces is
//! Σ_{j ≤ k} ρ^{j+1} G^j T.
//!
//! A triangle that is met from behind sends nothing. Where a surface is a saddle, directions just above a
//! vertex's horizon run below the triangles around it and meet some from behind: that light is lost. So a
//! white knot of 720 vertices under constant light keeps between 99.8 and 100 % of it after 30 bounces.

use super::{Directions, Estimate, RUN, Visibility};
use crate::numeric::lanes::wide;
use crate::numeric::parallel;
use crate::trace::Hit;
use crate::trace::bundle::{self, WORD};
use crate::world::mesh::Mesh;
use glam::Vec3;
use std::f64::consts::PI;

/// Where a blocked direction of a vertex ends, on the front of a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Meeting {
    /// The direction's index.
    pub direction: u32,
    /// The triangle's index.
    pub triangle: u32,
    /// Weights of its second and third corner.
    pub weights: [f32; 2],
}

impl Meeting {
    /// The corners that are met and their weights.
    pub(super) fn corners(&self, mesh: &Mesh) -> [(usize, f32); 3] {
        let [a, b, c] = mesh.triangles[self.triangle as usize].map(|corner| corner as usize);
        let [v, w] = self.weights;
        [(a, 1.0 - v - w), (b, v), (c, w)]
    }
}

/// What all vertices meet: 16 bytes for each blocked direction.
#[derive(Debug, Clone, PartialEq)]
pub struct Meetings {
    /// Where the meetings of each vertex end.
    ends: Vec<usize>,
    /// By vertex, then by direction.
    all: Vec<Meeting>,
    /// For each vertex Σ Δω and Σ max(0, n·ω) Δω over all directions above its horizon: 2π and π but for the
    /// quadrature's error.
    hemispheres: Vec<[f64; 2]>,
}

impl Meetings {
    /// The meetings of a vertex, directions ascending.
    pub fn of(&self, vertex: usize) -> &[Meeting] {
        let start = if vertex == 0 { 0 } else { self.ends[vertex - 1] };
        &self.all[start..self.ends[vertex]]
    }

    /// The factors that make a vertex's sums over solid angle right for a constant: for sums without the
    /// cosine, and for sums with it. 1 for the plain sum, and where there is no hemisphere.
    pub(super) fn scales(&self, vertex: usize, estimate: Estimate) -> [f64; 2] {
        let [solid, cosine] = self.hemispheres[vertex];
        if estimate == Estimate::Plain || cosine == 0.0 { [1.0; 2] } else { [2.0 * PI / solid, PI / cosine] }
    }
}

/// Follows every blocked direction to the nearest triangle.
///
/// # Panics
/// Where `visibility` is not that of `mesh` and `directions`.
pub fn meetings(mesh: &Mesh, directions: &Directions, visibility: &Visibility) -> Meetings {
    let (starts, hits) = bundle::nearest(mesh, &mesh.positions, &directions.rays, &visibility.blocked);
    let rows = parallel::map(mesh.positions.len(), |vertex| {
        let (visible, blocked) = visibility.of(vertex);
        let mut hits = hits[starts[vertex]..].iter();
        let normal = mesh.normals[vertex];
        let mut hemisphere = [0.0; 2];
        let mut met = Vec::new();
        for word in 0..visibility.words {
            let mut rest = visible[word] | blocked[word];
            while rest != 0 {
                let bit = rest.trailing_zeros() as usize;
                rest &= rest - 1;
                let direction = word * WORD + bit;
                hemisphere[0] += directions.weight();
                hemisphere[1] += directions.weight() * cosine(normal, directions.exact[direction]);
                if blocked[word] >> bit & 1 == 0 {
                    continue;
                }
                let front = |hit: &Hit| {
                    let corners = mesh.triangles[hit.triangle as usize];
                    front(corners.map(|corner| mesh.positions[corner as usize]), directions.rays[direction])
                };
                if let Some(hit) = hits.next().copied().flatten().filter(front) {
                    met.push(Meeting {
                        direction: direction as u32,
                        triangle: hit.triangle,
                        weights: [hit.u, hit.v],
                    });
                }
            }
        }
        (met, hemisphere)
    });
    let mut meetings = Meetings { ends: Vec::new(), all: Vec::new(), hemispheres: Vec::new() };
    for (met, hemisphere) in rows {
        meetings.all.extend(met);
        meetings.ends.push(meetings.all.len());
        meetings.hemispheres.push(hemisphere);
    }
    meetings
}

/// Whether a ray along `direction` meets the triangle from the front, the side from which the corners run
/// counter-clockwise.
pub(crate) fn front([a, b, c]: [Vec3; 3], direction: Vec3) -> bool {
    let [a, b, c] = [a, b, c].map(Vec3::as_dvec3);
    (b - a).cross(c - a).dot(direction.as_dvec3()) < 0.0
}

/// max(0, n·ω).
fn cosine(normal: Vec3, [x, y, z]: [f64; 3]) -> f64 {
    let cosine = f64::from(normal.x) * x + f64::from(normal.y) * y + f64::from(normal.z) * z;
    if cosine > 0.0 { cosine } else { 0.0 }
}

/// What arrives at every vertex from a `source` given at the vertices, `[vertices][width]`, and would leave a
/// white vertex again: (1/π) ∫ max(0, n·ω) s dω over what is met.
///
/// Under [`Estimate::Control`] the weights of a vertex are scaled so that those of its hemisphere, the
/// visible part included, sum to 1: a source that is everywhere 1 adds what the sky's share in
/// [`super::vectors`] lacks to 1.
///
/// # Panics
/// Where `source` has not `width` items for each vertex.
pub fn gather(
    mesh: &Mesh,
    directions: &Directions,
    meetings: &Meetings,
    estimate: Estimate,
    source: &[f32],
    width: usize,
) -> Vec<f32> {
    assert_eq!(source.len(), mesh.positions.len() * width, "{width} items a vertex");
    let mut gathered = vec![0.0; source.len()];
    parallel::for_each_chunk(&mut gathered, RUN * width, |run, rows| {
        let mut sums = vec![0.0; width];
        for (index, row) in rows.chunks_exact_mut(width).enumerate() {
            let vertex = run * RUN + index;
            let [_, scale] = meetings.scales(vertex, estimate);
            let share = scale * directions.weight() / PI;
            sums.fill(0.0);
            for meeting in meetings.of(vertex) {
                let weight =
                    share * cosine(mesh.normals[vertex], directions.exact[meeting.direction as usize]);
                let [a, b, c] = meeting.corners(mesh).map(|(corner, part)| {
                    (weight * f64::from(part), &source[corner * width..(corner + 1) * width])
                });
                add(&mut sums, a, b, c);
            }
            row.iter_mut().zip(&sums).for_each(|(out, sum)| *out = *sum as f32);
        }
    });
    gathered
}

wide! {
    /// Adds three rows, each times its weight.
    fn add(sums: &mut [f64], a: (f64, &[f32]), b: (f64, &[f32]), c: (f64, &[f32])) {
        for (((sum, x), y), z) in sums.iter_mut().zip(a.1).zip(b.1).zip(c.1) {
            *sum += a.0 * f64::from(*x) + b.0 * f64::from(*y) + c.0 * f64::from(*z);
        }
    }
}

/// Transfer vectors with `bounces` diffuse interreflections, RGB, `[vertices][bands²][3]`, albedo included:
/// times L they give the radiance that leaves.
///
/// `direct` are [`super::vectors`] (albedo 1). The albedo is one for the whole mesh, so each bounce is
/// gathered once for all three colours.
///
/// # Panics
/// Where `direct` has not `bands`² items for each vertex.
#[expect(clippy::too_many_arguments, reason = "the equation's parts, each its own")]
pub fn diffuse_bounces(
    mesh: &Mesh,
    directions: &Directions,
    meetings: &Meetings,
    estimate: Estimate,
    direct: &[f32],
    bands: usize,
    albedo: Vec3,
    bounces: usize,
) -> Vec<f32> {
    let mut power = albedo;
    let mut total: Vec<f32> = direct.iter().flat_map(|t| (power * *t).to_array()).collect();
    let mut term = direct.to_vec();
    for _ in 0..bounces {
        term = gather(mesh, directions, meetings, estimate, &term, bands * bands);
        power *= albedo;
        for (sum, t) in total.chunks_exact_mut(3).zip(&term) {
            sum.iter_mut().zip((power * *t).to_array()).for_each(|(sum, t)| *sum += t);
        }
    }
    total
}
