//! Holding triangles against points: which points in the cells of its box a triangle blocks, several points
//! at a time, in `f32`.
//!
//! Sheared coordinates are scaled to ±2 and rounded once from `f64`. So the three edge functions are off by
//! at most [`SLACK`] times the triangle's width. A point that is inside all three edges by more than that,
//! and in front of the triangle, is blocked. A point that is outside an edge by more than that is not. For
//! the few in between [`hit`] decides.

use super::Ray;
use super::cells::{Cells, Grid, Lanes};
use super::morton::{Bundle, LANES};
use super::triangle::hit;
use crate::numeric::order::{max, min};
use glam::Vec3;

/// How far an edge function may be off, as a fraction of the triangle's width plus a cell's, for coordinates
/// within ±2.
///
/// Rounding moves a coordinate by up to 2⁻²³ and a difference of two by δ = 2⁻²¹ with its own rounding. A
/// product of two differences, neither longer than the widths' sum D, is then off by 2 δ D + 2⁻²⁴ D². An edge
/// function, the difference of two products, is off by under 5 δ D. The third one, the area less the two
/// others, is off by under 20 δ D.
///
/// A point from other cells, at a distance R from the first corner of a triangle of width S, has functions
/// off by up to 4 δ R + 2 δ S. It is never taken for one inside. If all three functions exceed the slack,
/// their sum, the area, exceeds 96 δ S. The point is then near the mean of the corners with the functions as
/// weights: R is under 1.3 S, and the functions are off by under 8 δ S, which is less than the slack.
pub(super) const SLACK: f32 = 32.0 / 2_097_152.0;

/// How far a depth may be off: a coordinate's rounding, with room.
pub(super) const DEPTH_SLACK: f32 = 1.0 / 2_097_152.0;

/// Holds every triangle against the points in the cells of its box, [`LANES`] at a time: marks the points
/// that it blocks, or with `COLLECT` adds to `cells.pairs` those that it may block.
pub(super) fn walk<const COLLECT: bool>(bundle: &Bundle, grid: &Grid, direction: Vec3, cells: &mut Cells) {
    let columns = grid.size[0];
    let Cells { sheared, starts, lanes, pairs, .. } = cells;
    let triangles =
        bundle.triangles.iter().flat_map(|[a, b, c]| (0..LANES).map(|lane| [a[lane], b[lane], c[lane]]));
    for (index, triangle) in (0..).zip(triangles) {
        let [a, b, c] = triangle.map(|corner| sheared[corner as usize]);
        let (mut low, mut high) = ([0.0; 4], [0.0; 4]);
        for axis in 0..4 {
            low[axis] = min(min(a[axis], b[axis]), c[axis]);
            high[axis] = max(max(a[axis], b[axis]), c[axis]);
        }
        let rows = [grid.cell(1, low[1]), grid.cell(1, high[1])];
        let span = [grid.cell(0, low[0]), grid.cell(0, high[0])];
        let (e, f) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
        let area = e[0] * f[1] - e[1] * f[0];
        let turned = area < 0.0;
        let test = Test {
            a: [a[0], a[1]],
            e: if turned { f } else { e },
            f: if turned { e } else { f },
            area: area.abs(),
            slack: SLACK * (max(high[0] - low[0], high[1] - low[1]) + grid.width),
            behind: high[2] + DEPTH_SLACK,
            ahead: low[2] - DEPTH_SLACK,
            corners: triangle,
        };
        // The cells of row r have the points of rows r and r + 1. They start at (r + 1) · columns, since row
        // −1 comes first.
        let mut row = rows[0] + 1;
        loop {
            let mut at = starts[row * columns + span[0]] as usize;
            let end = starts[row * columns + span[1] + 1] as usize;
            while at < end {
                let doubtful = test.some::<COLLECT>(lanes, at, end - at);
                if doubtful != 0 {
                    let Lanes { place, z, .. } = lanes;
                    if COLLECT {
                        collect(pairs, &place[at..], index, doubtful);
                    } else {
                        decide(bundle, &place[at..], &mut z[at..], direction, &triangle, doubtful);
                    }
                }
                at += LANES;
            }
            row += 2;
            if row > rows[1] + 1 {
                break;
            }
        }
    }
}

/// A triangle, as it is held against points.
struct Test {
    /// The first corner.
    a: [f32; 2],
    /// The edges from it to the two others, counter-clockwise.
    e: [f32; 2],
    f: [f32; 2],
    /// Twice the area.
    area: f32,
    /// How far the edge functions may be off.
    slack: f32,
    /// No point beyond this depth is blocked.
    behind: f32,
    /// Every point inside and before this depth is blocked.
    ahead: f32,
    corners: [u32; 3],
}

impl Test {
    /// Takes `count` points from `at` on, [`LANES`] at most. Marks those that are certainly blocked, and
    /// returns a bit for each other one that may be. With `COLLECT` none is certain.
    #[inline(always)]
    fn some<const COLLECT: bool>(&self, lanes: &mut Lanes, at: usize, count: usize) -> u32 {
        let x: &[f32; LANES] = lanes.x[at..][..LANES].try_into().expect("as many");
        let y: &[f32; LANES] = lanes.y[at..][..LANES].try_into().expect("as many");
        let place: &[u32; LANES] = lanes.place[at..][..LANES].try_into().expect("as many");
        let z: &mut [f32; LANES] = (&mut lanes.z[at..][..LANES]).try_into().expect("as many");
        let mut doubtful = [0_u32; LANES];
        for lane in 0..LANES {
            let (px, py) = (x[lane] - self.a[0], y[lane] - self.a[1]);
            let u = px * self.f[1] - py * self.f[0];
            let v = self.e[0] * py - self.e[1] * px;
            let w = self.area - u - v;
            let least = min(min(u, v), w);
            let own = (place[lane] == self.corners[0])
                | (place[lane] == self.corners[1])
                | (place[lane] == self.corners[2]);
            let counts = (lane < count) & !own & (z[lane] <= self.behind);
            let may = counts & (least >= -self.slack);
            let must = counts & !COLLECT & (least > self.slack) & (z[lane] < self.ahead);
            doubtful[lane] = u32::from(may & !must);
            // All ones are not a number: every later comparison with it is false.
            z[lane] = f32::from_bits(z[lane].to_bits() | if must { u32::MAX } else { 0 });
        }
        (0..LANES).fold(0, |bits, lane| bits | doubtful[lane] << lane)
    }
}

/// Adds the places of the points that `bits` names to `pairs`, each with the triangle.
#[inline(always)]
pub(super) fn collect(pairs: &mut Vec<[u32; 2]>, place: &[u32], triangle: u32, mut bits: u32) {
    while bits != 0 {
        pairs.push([place[bits.trailing_zeros() as usize], triangle]);
        bits &= bits - 1;
    }
}

/// Traces the rays of the points that the quick test leaves open, a bit each in `doubtful`, and marks those
/// that are blocked.
#[cold]
#[inline(never)]
pub(super) fn decide(
    bundle: &Bundle,
    place: &[u32],
    z: &mut [f32],
    direction: Vec3,
    triangle: &[u32; 3],
    mut doubtful: u32,
) {
    let corners = triangle.map(|corner| bundle.place(corner));
    while doubtful != 0 {
        let lane = doubtful.trailing_zeros() as usize;
        doubtful &= doubtful - 1;
        if hit(&Ray::new(bundle.place(place[lane]), direction), &corners, 0).is_some() {
            z[lane] = f32::NAN;
        }
    }
}
