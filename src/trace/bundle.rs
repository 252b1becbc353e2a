//! Bundles of parallel rays: what each of many points sees of a set of directions, and what is met along the others.
//!
//! Rays of one direction share the shear of [`super::triangle`], so asking which of them are blocked is rasterising the
//! sheared triangles against the sheared points in place of pixels: `cells.rs` sorts the points into the cells of a grid,
//! `hold.rs` holds each triangle against the points in the cells of its box. The bits are those of single rays. The nearest
//! hit is among the few triangles that may block a point, each of which the test of single rays then decides.

use super::cells::{Cells, Grid, LANES};
use super::hold::block;
use super::triangle::{Shear, Slabs, along};
use super::{Hit, Ray};
use crate::numeric::lanes::{BLOCK, wide};
use crate::numeric::order::{clamp, max, max3, min, min3};
use crate::numeric::parallel;
use crate::world::mesh::Mesh;
use glam::Vec3;

/// Directions whose bits share a word.
pub const WORD: usize = 32;

/// Directions that one task takes one after the other, keeping its memory.
const RUN: usize = 4;

/// Which of `directions` each of `points` sees: bit j of word w of point p, `[points][⌈directions / 32⌉]`, is set where
/// the direction 32 w + j is above the horizon of the point's normal (n·ω > 0) and the ray from the point along it meets
/// no triangle of the mesh ([`super::Bvh::blocked`]). All other bits are 0.
///
/// # Panics
/// Where there are not as many normals as points.
pub fn visibility(mesh: &Mesh, points: &[Vec3], normals: &[Vec3], directions: &[Vec3]) -> Vec<u32> {
    assert_eq!(points.len(), normals.len(), "one normal a point");
    let bundle = Bundle::new(mesh, points, normals);
    let words = directions.len().div_ceil(WORD);
    let mut bits = vec![0; points.len() * words];
    for (word, directions) in directions.chunks(WORD).enumerate() {
        let mut seen: Vec<Vec<u8>> = vec![Vec::new(); directions.len()];
        parallel::for_each_chunk(&mut seen, RUN, |run, seen| {
            let mut cells = Cells::default();
            for (seen, direction) in seen.iter_mut().zip(&directions[run * RUN..]) {
                *seen = vec![0; points.len()];
                bundle.look(*direction, &mut cells, seen, block::<false>);
            }
        });
        parallel::for_each_chunk(&mut bits, words * 1024, |run, rows| {
            for (point, row) in (run * 1024..).zip(rows.chunks_exact_mut(words)) {
                let bit = |(bit, seen): (usize, &Vec<u8>)| u32::from(seen[point]) << bit;
                row[word] = seen.iter().enumerate().map(bit).fold(0, |word, bit| word | bit);
            }
        });
    }
    bits
}

/// Where the rays from `points` along `directions` first meet the mesh ([`super::Bvh::nearest`]), of the rays whose bits are
/// set in `wanted`, `[points][⌈directions / 32⌉]`: for each point its set bits ascending. Before them, where each point's
/// begin.
///
/// # Panics
/// Where `wanted` has another length.
pub fn nearest(
    mesh: &Mesh,
    points: &[Vec3],
    directions: &[Vec3],
    wanted: &[u32],
) -> (Vec<usize>, Vec<Option<Hit>>) {
    let words = directions.len().div_ceil(WORD);
    assert_eq!(wanted.len(), points.len() * words, "one row of words a point");
    let bundle = Bundle::new(mesh, points, &[]);
    let mut starts = Vec::with_capacity(points.len());
    let mut total = 0;
    for row in 0..points.len() {
        starts.push(total);
        total += wanted[row * words..(row + 1) * words]
            .iter()
            .map(|bits| bits.count_ones() as usize)
            .sum::<usize>();
    }
    let mut hits = vec![None; total];
    // Where each point's next hit goes.
    let mut next = starts.clone();
    for (word, directions) in directions.chunks(WORD).enumerate() {
        let column: Vec<u32> =
            bundle.order.iter().map(|point| wanted[*point as usize * words + word]).collect();
        let mut found: Vec<Vec<(u32, Option<Hit>)>> = vec![Vec::new(); directions.len()];
        parallel::for_each_chunk(&mut found, RUN, |run, found| {
            let mut cells = Cells::default();
            for (bit, found) in (run * RUN..).zip(found) {
                let set = (0..).zip(&column).filter(|(_, bits)| **bits >> bit & 1 == 1);
                cells.looking.clear();
                cells.looking.extend(set.map(|(point, _)| point));
                bundle.meet(directions[bit], &mut cells, found, block::<true>);
            }
        });
        for (point, hit) in found.into_iter().flatten() {
            hits[next[point as usize]] = hit;
            next[point as usize] += 1;
        }
    }
    (starts, hits)
}

/// A mesh and points, in an order in which neighbours in space are neighbours in memory.
pub(super) struct Bundle {
    /// The mesh's vertices, then those points that are none; one list a coordinate.
    places: [Vec<f32>; 3],
    /// The three vertices of sixteen triangles, one list a corner; the last triangle stands for those that are missing.
    pub(super) triangles: Vec<[[u32; LANES]; 3]>,
    /// Of each of these its index in the mesh.
    indices: Vec<u32>,
    /// Of each point its place, its normal, and its index among the points that were given.
    pub(super) points: Vec<u32>,
    normals: [Vec<f32>; 3],
    pub(super) order: Vec<u32>,
    /// The middle of the box around everything, and half its sides.
    center: Vec3,
    half: Vec3,
}

/// The three lowest ten-bit coordinates of a point in the box, their bits interleaved (Morton 1966).
fn morton(point: Vec3, low: Vec3, scale: f32) -> u32 {
    let spread = |value: f32| {
        let mut bits = clamp(value * scale, 0.0, 1023.0) as u32;
        for (shift, mask) in [(16, 0x0300_00ff), (8, 0x0300_f00f), (4, 0x030c_30c3), (2, 0x0924_9249)] {
            bits = (bits | bits << shift) & mask;
        }
        bits
    };
    let place = point - low;
    spread(place.x) | spread(place.y) << 1 | spread(place.z) << 2
}

impl Bundle {
    /// `normals` are one a point, or none where [`Self::look`] is not asked for.
    pub(super) fn new(mesh: &Mesh, points: &[Vec3], normals: &[Vec3]) -> Self {
        let all = || mesh.positions.iter().chain(points);
        let first = mesh.positions[0];
        let (low, high) = all().fold((first, first), |(low, high), p| (min3(low, *p), max3(high, *p)));
        let scale = 1023.0 / max((high - low).max_element(), f32::MIN_POSITIVE);
        let order = |count: usize, place: &dyn Fn(usize) -> Vec3| {
            let mut keys: Vec<(u32, u32)> =
                (0..count).map(|index| (morton(place(index), low, scale), index as u32)).collect();
            keys.sort_unstable();
            keys.into_iter().map(|(_, index)| index).collect::<Vec<u32>>()
        };
        let sorted = order(mesh.positions.len(), &|vertex| mesh.positions[vertex]);
        let mut place = vec![0; sorted.len()];
        (0..).zip(&sorted).for_each(|(new, old)| place[*old as usize] = new);
        let centroid = |triangle: usize| {
            let [a, b, c] = mesh.triangles[triangle].map(|corner| mesh.positions[corner as usize] / 3.0);
            a + b + c
        };
        let mut indices = order(mesh.triangles.len(), &centroid);
        indices.resize(indices.len().next_multiple_of(LANES), indices[indices.len() - 1]);
        let together = |some: &[u32]| {
            let mut corners = [[0; LANES]; 3];
            for (lane, old) in some.iter().enumerate() {
                for (corner, vertex) in mesh.triangles[*old as usize].iter().enumerate() {
                    corners[corner][lane] = place[*vertex as usize];
                }
            }
            corners
        };
        let triangles: Vec<_> = indices.chunks(LANES).map(together).collect();
        let mut places: Vec<Vec3> = sorted.iter().map(|old| mesh.positions[*old as usize]).collect();
        let order = order(points.len(), &|point| points[point]);
        let numbers = order.iter().map(|index| {
            let index = *index as usize;
            if mesh.positions.get(index) == Some(&points[index]) {
                return place[index];
            }
            places.push(points[index]);
            places.len() as u32 - 1
        });
        let numbers = numbers.collect();
        let lists = |of: &dyn Fn(usize) -> Vec3, count: usize| {
            [0, 1, 2].map(|axis| (0..count).map(|index| of(index)[axis]).collect::<Vec<f32>>())
        };
        Self {
            places: lists(&|index| places[index], places.len()),
            triangles,
            indices,
            points: numbers,
            normals: lists(
                &|index| normals[order[index] as usize],
                if normals.is_empty() { 0 } else { order.len() },
            ),
            order,
            center: low * 0.5 + high * 0.5,
            half: high * 0.5 - low * 0.5,
        }
    }

    pub(super) fn place(&self, index: u32) -> Vec3 {
        let ([x, y, z], index) = (&self.places, index as usize);
        Vec3::new(x[index], y[index], z[index])
    }

    /// Sets `seen` to 1 for each point that sees the direction; `block` marks the others.
    pub(super) fn look(
        &self,
        direction: Vec3,
        cells: &mut Cells,
        seen: &mut [u8],
        block: impl Fn(&Self, &Grid, Vec3, &mut Cells),
    ) {
        look_along(direction, &self.normals, &mut cells.looking);
        self.hold(direction, cells, block);
        cells.blocked.clear();
        cells.blocked.resize(self.places[0].len(), false);
        for (place, z) in cells.lanes.place.iter().zip(&cells.lanes.z).take(2 * cells.looking.len()) {
            cells.blocked[*place as usize] |= z.is_nan();
        }
        for point in &cells.looking {
            let free = !cells.blocked[self.points[*point as usize] as usize];
            seen[self.order[*point as usize] as usize] = u8::from(free);
        }
    }

    /// Finds, for each point of `cells.looking`, by its index among those that were given, what it meets along the
    /// direction; `collect` finds the triangles that it may meet.
    pub(super) fn meet(
        &self,
        direction: Vec3,
        cells: &mut Cells,
        found: &mut Vec<(u32, Option<Hit>)>,
        collect: impl Fn(&Self, &Grid, Vec3, &mut Cells),
    ) {
        if cells.looking.is_empty() {
            return;
        }
        cells.pairs.clear();
        self.hold(direction, cells, collect);
        cells.met.resize(self.places[0].len(), None);
        let (shear, slabs) = (Shear::new(direction), Slabs::new(&Ray::new(Vec3::ZERO, direction)));
        for [place, triangle] in &cells.pairs {
            let (group, lane) = (*triangle as usize / LANES, *triangle as usize % LANES);
            let corners = [0, 1, 2].map(|corner| self.place(self.triangles[group][corner][lane]));
            let ray = Ray::new(self.place(*place), direction);
            let slabs = Slabs { origin: ray.origin.to_array(), ..slabs };
            let Some(hit) = along(&shear, &slabs, &ray, &corners, self.indices[*triangle as usize]) else {
                continue;
            };
            let met = &mut cells.met[*place as usize];
            if met.is_none_or(|met| (hit.t, hit.triangle) < (met.t, met.triangle)) {
                *met = Some(hit);
            }
        }
        let met = cells.looking.iter().map(|point| {
            let place = self.points[*point as usize];
            (self.order[*point as usize], cells.met[place as usize].take())
        });
        found.extend(met);
    }

    /// Shears everything, sorts the points of `cells.looking` into cells and holds the triangles against them.
    fn hold(&self, direction: Vec3, cells: &mut Cells, by: impl Fn(&Self, &Grid, Vec3, &mut Cells)) {
        let frame = Sheared::new(direction, self);
        let ends = shear(&frame, &self.places, &mut cells.sheared);
        let grid = Grid::new(self, ends, cells.looking.len());
        cells.sort(&grid, self);
        by(self, &grid, direction, cells);
    }
}

/// Sheared space, moved and scaled by powers of two so that everything is within ±2.
struct Sheared {
    shear: Shear,
    center: [f64; 3],
    scale: [f64; 3],
}

impl Sheared {
    fn new(direction: Vec3, bundle: &Bundle) -> Self {
        let shear = Shear::new(direction);
        let reach = shear.reach(bundle.half);
        // 2^-k for a number in [2^k, 2^(k+1)).
        let scale = |reach: f64| f64::from_bits((2046 - (reach.to_bits() >> 52 & 2047)) << 52);
        let across = scale(max(reach[0], reach[1]));
        Self { shear, center: shear.apply(bundle.center), scale: [across, across, scale(reach[2])] }
    }

    #[inline(always)]
    fn apply(&self, point: Vec3) -> [f32; 3] {
        let p = self.shear.apply(point);
        [0, 1, 2].map(|axis| ((p[axis] - self.center[axis]) * self.scale[axis]) as f32)
    }
}

wide! {
    /// Shears all places; returns the ends of x and y.
    fn shear(frame: &Sheared, places: &[Vec<f32>; 3], out: &mut Vec<[f32; 4]>) -> [[f32; 2]; 2] {
        out.resize(places[0].len(), [0.0; 4]);
        let mut block = [[0.0; BLOCK]; 3];
        let mut ends = [[[f32::INFINITY; BLOCK], [f32::NEG_INFINITY; BLOCK]]; 2];
        for (number, out) in out.chunks_mut(BLOCK).enumerate() {
            let [x, y, z] = [0, 1, 2].map(|axis| &places[axis][number * BLOCK..][..out.len()]);
            for lane in 0..out.len() {
                let place = frame.apply(Vec3::new(x[lane], y[lane], z[lane]));
                for axis in 0..3 {
                    block[axis][lane] = place[axis];
                }
            }
            for axis in 0..2 {
                for lane in 0..out.len() {
                    ends[axis][0][lane] = min(ends[axis][0][lane], block[axis][lane]);
                    ends[axis][1][lane] = max(ends[axis][1][lane], block[axis][lane]);
                }
            }
            for (lane, out) in out.iter_mut().enumerate() {
                *out = [block[0][lane], block[1][lane], block[2][lane], 0.0];
            }
        }
        ends.map(|[low, high]| [low.into_iter().fold(f32::INFINITY, min), high.into_iter().fold(f32::NEG_INFINITY, max)])
    }
}

wide! {
    /// The points with n·ω > 0.
    fn look_along(direction: Vec3, normals: &[Vec<f32>; 3], looking: &mut Vec<u32>) {
        let count = normals[0].len();
        looking.resize(count, 0);
        let (mut found, mut above) = (0, [0_u8; BLOCK]);
        for first in (0..count).step_by(BLOCK) {
            let length = min(BLOCK, count - first);
            let [x, y, z] = [0, 1, 2].map(|axis| &normals[axis][first..][..length]);
            for lane in 0..length {
                let cosine = x[lane] * direction.x + y[lane] * direction.y + z[lane] * direction.z;
                above[lane] = u8::from(cosine > 0.0);
            }
            // Every point is written, and the next one over it unless it counts.
            for lane in 0..length {
                looking[found] = (first + lane) as u32;
                found += usize::from(above[lane]);
            }
        }
        looking.truncate(found);
    }
}
