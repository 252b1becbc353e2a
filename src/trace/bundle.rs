//! Bundles of parallel rays: what each of many points sees of a set of directions.
//!
//! Rays of one direction share the shear of [`super::triangle`], so asking which of them are blocked is rasterising the
//! sheared triangles, nearer ones or not, against the sheared points in place of pixels. The points are sorted into the
//! cells of a grid; each triangle is held against the points in the cells of its box, eight at a time, in `f32`. Sheared
//! coordinates, scaled to ±2, are rounded once from `f64`, so the three edge functions are off by at most `SLACK` times
//! the triangle's width: a point beyond that on the inner side of all three and in front of the triangle is blocked, one
//! beyond it on the outer side of any is not, and for the few between [`hit`] decides. So the bits are those of single rays.

use super::Ray;
use super::triangle::{Shear, hit};
use crate::numeric::lanes::{BLOCK, wide};
use crate::numeric::order::{clamp, max, max3, min, min3};
use crate::numeric::parallel;
use crate::world::mesh::Mesh;
use glam::Vec3;

/// Directions whose bits share a word.
pub const WORD: usize = 32;

/// Points that a triangle is held against at a time.
pub(super) const LANES: usize = 8;

/// Directions that one task takes one after the other, keeping its memory.
const RUN: usize = 4;

/// How far an edge function may be off, as a part of the triangle's width plus a cell's, coordinates being within ±2.
///
/// Rounding moves a coordinate by up to 2⁻²³ and a difference of two by δ = 2⁻²¹ with its own rounding. A product of two
/// differences, neither longer than the widths' sum D, is then off by 2 δ D + 2⁻²⁴ D², an edge function, which is the
/// difference of two, by under 5 δ D, and the third, which is the area less the two others, by under 20 δ D.
pub(super) const SLACK: f32 = 32.0 / 2_097_152.0;

/// Rows of the grid for each square root of a triangle.
const ROWS: f32 = 0.4;

/// Columns of the grid for each square root of a point that looks.
const COLUMNS: f32 = 3.0;

/// Columns that share a front.
pub(super) const BLOCK_COLUMNS: usize = 8;

/// How far a depth may be off: a coordinate's rounding, with room.
pub(super) const DEPTH_SLACK: f32 = 1.0 / 2_097_152.0;

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
                bundle.look(*direction, &mut cells, seen);
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

/// A mesh and points, in an order in which neighbours in space are neighbours in memory.
pub(super) struct Bundle {
    /// The mesh's vertices, then those points that are none; one list a coordinate.
    places: [Vec<f32>; 3],
    /// Three vertices a triangle, eight triangles together; the last stands for those that are missing.
    pub(super) triangles: Vec<[[u32; 3]; LANES]>,
    /// Of each point its place, its normal, and its index among the points that were given.
    points: Vec<u32>,
    normals: [Vec<f32>; 3],
    order: Vec<u32>,
    /// The middle of the box around everything, and half its sides.
    center: Vec3,
    half: Vec3,
}

/// What a task keeps from one direction to the next.
#[derive(Default)]
pub(super) struct Cells {
    /// Sheared places.
    pub(super) sheared: Vec<[f32; 4]>,
    /// The points that look along the direction.
    looking: Vec<u32>,
    /// Whether what looks from a place is blocked.
    blocked: Vec<bool>,
    /// Where each cell's points start, and the last one's end. A cell has the points of two rows of the grid, its own and
    /// the next, so that a triangle that is no higher than a row has all its points in cells of one row, side by side.
    pub(super) starts: Vec<u32>,
    /// The least depth of a point in [`BLOCK_COLUMNS`] neighbouring cells and the [`BLOCK_COLUMNS`] after them: a triangle
    /// no wider than that and before this depth blocks nothing.
    pub(super) fronts: Vec<f32>,
    /// The points as they are sorted: sheared place, and the bits of the place's number; and their cells.
    sorted: Vec<[f32; 4]>,
    cells: Vec<u32>,
    /// The points of all cells, each twice.
    pub(super) lanes: Lanes,
}

/// Points in the order of cells.
#[derive(Default)]
pub(super) struct Lanes {
    pub(super) x: Vec<f32>,
    pub(super) y: Vec<f32>,
    /// Depth along the direction; not a number once the point is blocked.
    pub(super) z: Vec<f32>,
    /// The point's place, to leave out the triangles around it.
    pub(super) place: Vec<u32>,
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
    fn new(mesh: &Mesh, points: &[Vec3], normals: &[Vec3]) -> Self {
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
        let triangles = order(mesh.triangles.len(), &centroid);
        let eight = |eight: &[u32]| {
            std::array::from_fn(|lane| {
                let old = eight[min(lane, eight.len() - 1)];
                mesh.triangles[old as usize].map(|corner| place[corner as usize])
            })
        };
        let triangles: Vec<_> = triangles.chunks(LANES).map(eight).collect();
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
            points: numbers,
            normals: lists(&|index| normals[order[index] as usize], order.len()),
            order,
            center: low * 0.5 + high * 0.5,
            half: high * 0.5 - low * 0.5,
        }
    }

    fn place(&self, index: u32) -> Vec3 {
        Vec3::from_array([0, 1, 2].map(|axis| self.places[axis][index as usize]))
    }

    /// Sets `seen` to 1 for each point that sees the direction.
    fn look(&self, direction: Vec3, cells: &mut Cells, seen: &mut [u8]) {
        let frame = Sheared::new(direction, self);
        let ends = shear(&frame, &self.places, &mut cells.sheared);
        look_along(direction, &self.normals, &mut cells.looking);
        let grid = Grid::new(self, ends, cells.looking.len());
        cells.sort(&grid, self);
        block(self, &grid, direction, cells);
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

/// Cells of sheared space.
pub(super) struct Grid {
    pub(super) low: [f32; 2],
    /// Cells a unit.
    pub(super) per: [f32; 2],
    /// Cells along x and y.
    pub(super) size: [usize; 2],
    /// The larger side of a cell, in sheared units.
    pub(super) width: f32,
}

impl Grid {
    /// A grid between the `ends` of the sheared places, whose rows are about as high as triangles if these are alike.
    fn new(bundle: &Bundle, ends: [[f32; 2]; 2], looking: usize) -> Self {
        let rows = clamp(((bundle.triangles.len() * LANES) as f32).sqrt() * ROWS, 1.0, 2048.0);
        let columns = clamp((looking as f32).sqrt() * COLUMNS, 1.0, 2048.0);
        let size = [columns, rows];
        let low = [ends[0][0], ends[1][0]];
        let side = ends.map(|[low, high]| max(high - low, f32::MIN_POSITIVE));
        let width = max(side[0] / columns, side[1] / rows);
        let per = [0, 1].map(|axis| min(size[axis] / side[axis], 1e9));
        Self { low, per, size: size.map(|size| size as usize + 1), width }
    }

    /// Blocks of a row, with one before the first for the points' second place.
    pub(super) fn blocks(&self) -> usize {
        self.size[0].div_ceil(BLOCK_COLUMNS) + 1
    }

    /// The cell along an axis of a coordinate.
    #[inline(always)]
    fn cell(&self, axis: usize, coordinate: f32) -> usize {
        min(((coordinate - self.low[axis]) * self.per[axis]) as i32 as usize, self.size[axis] - 1)
    }
}

impl Cells {
    /// Sorts the points that look along the direction by cells.
    fn sort(&mut self, grid: &Grid, bundle: &Bundle) {
        let [columns, rows] = grid.size;
        let blocks = grid.blocks();
        self.starts.clear();
        self.starts.resize(columns * (rows + 2) + 2, 0);
        self.fronts.clear();
        self.fronts.resize(blocks * (rows + 2) + 2, f32::INFINITY);
        self.cells.resize(self.looking.len(), 0);
        for (point, to) in self.looking.iter().zip(&mut self.cells) {
            let [x, y, z, _] = self.sheared[bundle.points[*point as usize] as usize];
            let (column, row) = (grid.cell(0, x), grid.cell(1, y));
            let cell = row * columns + column;
            self.starts[cell + columns + 2] += 1;
            let front = &mut self.fronts[(row + 1) * blocks + column / BLOCK_COLUMNS + 1];
            *front = min(*front, z);
            *to = cell as u32;
        }
        // What each cell has with the next row's points, and each front with its neighbours'.
        for at in 0..columns * (rows + 1) {
            self.starts[at + 2] += self.starts[at + columns + 2];
        }
        for at in 0..blocks * (rows + 1) {
            let [own, next] = [at, at + blocks].map(|at| min(self.fronts[at], self.fronts[at + 1]));
            self.fronts[at] = min(own, next);
        }
        let mut total = 0;
        for start in &mut self.starts {
            total += *start;
            *start = total;
        }
        let count = 2 * self.looking.len();
        self.sorted.resize(count, [0.0; 4]);
        for (point, cell) in self.looking.iter().zip(&self.cells) {
            let number = bundle.points[*point as usize];
            let [x, y, z, _] = self.sheared[number as usize];
            for cell in [*cell as usize, *cell as usize + columns] {
                let next = &mut self.starts[cell + 1];
                self.sorted[*next as usize] = [x, y, z, f32::from_bits(number)];
                *next += 1;
            }
        }
        let lanes = &mut self.lanes;
        for list in [&mut lanes.x, &mut lanes.y, &mut lanes.z] {
            list.resize(count + LANES, 0.0);
        }
        lanes.place.resize(count + LANES, 0);
        spread(&self.sorted, lanes);
    }
}

wide! {
    /// Makes one list a coordinate.
    fn spread(sorted: &[[f32; 4]], lanes: &mut Lanes) {
        let coordinates = lanes.x.iter_mut().zip(&mut lanes.y).zip(&mut lanes.z);
        for (([x, y, z, number], ((to_x, to_y), to_z)), place) in sorted.iter().zip(coordinates).zip(&mut lanes.place) {
            (*to_x, *to_y, *to_z, *place) = (*x, *y, *z, number.to_bits());
        }
    }
}

/// Holds every triangle against the points in the cells of its box, eight at a time.
fn walk(bundle: &Bundle, grid: &Grid, direction: Vec3, cells: &mut Cells) {
    let columns = grid.size[0];
    let Cells { sheared, starts, lanes, .. } = cells;
    for triangle in bundle.triangles.as_flattened() {
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
            corners: *triangle,
        };
        // The cells of row r, which come after a row of r - 1's, have the points of rows r and r + 1.
        let mut row = rows[0] + 1;
        loop {
            let mut at = starts[row * columns + span[0]] as usize;
            let end = starts[row * columns + span[1] + 1] as usize;
            while at < end {
                let doubtful = test.eight(lanes, at, end - at);
                if doubtful != 0 {
                    decide(bundle, lanes, direction, triangle, at, doubtful);
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

/// Marks the points that the triangles block.
fn block(bundle: &Bundle, grid: &Grid, direction: Vec3, cells: &mut Cells) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        #[expect(
            unsafe_code,
            reason = "the twin with wider instructions, for a processor that was just looked at"
        )]
        // SAFETY: the processor has AVX2.
        return unsafe { super::avx2::walk(bundle, grid, direction, cells) };
    }
    walk(bundle, grid, direction, cells);
}

/// A triangle as eight points at a time are held against it.
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
    /// Beyond this depth no point is blocked,
    behind: f32,
    /// and before this one every point inside is.
    ahead: f32,
    corners: [u32; 3],
}

impl Test {
    /// Marks those of `count` points from `at` on, of eight at most, that are blocked for certain; a bit for each that may
    /// be.
    #[inline(always)]
    fn eight(&self, lanes: &mut Lanes, at: usize, count: usize) -> u32 {
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
            let must = counts & (least > self.slack) & (z[lane] < self.ahead);
            doubtful[lane] = u32::from(may & !must);
            // All ones are not a number, which no later comparison counts.
            z[lane] = f32::from_bits(z[lane].to_bits() | if must { u32::MAX } else { 0 });
        }
        (0..LANES).fold(0, |bits, lane| bits | doubtful[lane] << lane)
    }
}

/// Traces the rays of the points that the quick test leaves open.
#[cold]
#[inline(never)]
pub(super) fn decide(
    bundle: &Bundle,
    lanes: &mut Lanes,
    direction: Vec3,
    triangle: &[u32; 3],
    at: usize,
    mut doubtful: u32,
) {
    let corners = triangle.map(|corner| bundle.place(corner));
    while doubtful != 0 {
        let lane = doubtful.trailing_zeros() as usize;
        doubtful &= doubtful - 1;
        let origin = bundle.place(lanes.place[at + lane]);
        if hit(&Ray::new(origin, direction), &corners, 0).is_some() {
            lanes.z[at + lane] = f32::NAN;
        }
    }
}
