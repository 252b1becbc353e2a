//! Bundles of parallel rays: what each of many points sees of a set of directions.
//!
//! Rays of one direction share the shear of [`super::triangle`], so asking which of them are blocked is rasterising the
//! sheared triangles, nearer ones or not, against the sheared points in place of pixels. The points are sorted into the
//! cells of a grid; each triangle is held against the points in the cells of its box, eight at a time, in `f32`. Sheared
//! coordinates, scaled to ±2, are rounded once from `f64`, so the three edge functions are off by at most [`SLACK`] times
//! the triangle's width: a point beyond that on the inner side of all three and in front of the triangle is blocked, one
//! beyond it on the outer side of any is not, and for the few between [`hit`] decides. So the bits are those of single rays.

use super::Ray;
use super::triangle::{Shear, hit};
use crate::numeric::lanes::wide;
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
const SLACK: f32 = 32.0 / 2_097_152.0;

/// How far a depth may be off: a coordinate's rounding, with room.
const DEPTH_SLACK: f32 = 1.0 / 2_097_152.0;

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
    /// The mesh's vertices.
    vertices: Vec<Vec3>,
    /// Three of them a triangle.
    triangles: Vec<[u32; 3]>,
    points: Vec<Point>,
    /// The middle of the box around everything, and half its sides.
    center: Vec3,
    half: Vec3,
}

/// A point that looks around.
struct Point {
    position: Vec3,
    normal: Vec3,
    /// Its index among the points that were given.
    index: u32,
    /// The vertex in its place, [`u32::MAX`] if none is known: its triangles do not block it.
    vertex: u32,
}

/// What a task keeps from one direction to the next: points that look along the direction, sorted by cells.
#[derive(Default)]
pub(super) struct Cells {
    vertices: Vec<[f32; 4]>,
    /// The sheared place and the cell of each point that looks along the direction, in the order of points.
    looking: Vec<([f32; 3], u32, u32)>,
    /// Where the points of each cell start, and one end more.
    starts: Vec<u32>,
    pub(super) x: Vec<f32>,
    pub(super) y: Vec<f32>,
    /// Depth along the direction; not a number once the point is blocked.
    pub(super) z: Vec<f32>,
    pub(super) vertex: Vec<u32>,
    point: Vec<u32>,
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
        let triangles = triangles
            .into_iter()
            .map(|old| mesh.triangles[old as usize].map(|v| place[v as usize]))
            .collect();
        let points = order(points.len(), &|point| points[point]).into_iter().map(|index| {
            let at = index as usize;
            let vertex = match mesh.positions.get(at) {
                Some(position) if *position == points[at] => place[at],
                _ => u32::MAX,
            };
            Point { position: points[at], normal: normals[at], index, vertex }
        });
        Self {
            points: points.collect(),
            vertices: sorted.into_iter().map(|old| mesh.positions[old as usize]).collect(),
            triangles,
            center: low * 0.5 + high * 0.5,
            half: high * 0.5 - low * 0.5,
        }
    }

    /// Sets `seen` to 1 for each point that sees the direction.
    fn look(&self, direction: Vec3, cells: &mut Cells, seen: &mut [u8]) {
        let frame = Sheared::new(direction, self);
        shear_all(&frame, &self.vertices, &mut cells.vertices);
        cells.sort(&frame, self, direction);
        block(self, &frame, direction, cells);
        for (number, z) in cells.point.iter().zip(&cells.z) {
            seen[self.points[*number as usize].index as usize] = u8::from(!z.is_nan());
        }
    }
}

/// Sheared space, moved and scaled by powers of two so that everything is within ±2.
pub(super) struct Sheared {
    shear: Shear,
    center: [f64; 3],
    scale: [f64; 3],
    /// Cells along x and y.
    size: [usize; 2],
}

impl Sheared {
    fn new(direction: Vec3, bundle: &Bundle) -> Self {
        let shear = Shear::new(direction);
        let reach = shear.reach(bundle.half);
        // 2^-k for a number in [2^k, 2^(k+1)).
        let scale = |reach: f64| f64::from_bits((2046 - (reach.to_bits() >> 52 & 2047)) << 52);
        let across = scale(max(reach[0], reach[1]));
        let rows = clamp(((bundle.points.len() as f64).sqrt() * 0.8) as usize, 1, 2048);
        Self {
            shear,
            center: shear.apply(bundle.center),
            scale: [across, across, scale(reach[2])],
            size: [rows * 2, rows],
        }
    }

    #[inline(always)]
    fn apply(&self, point: Vec3) -> [f32; 3] {
        let p = self.shear.apply(point);
        [0, 1, 2].map(|axis| ((p[axis] - self.center[axis]) * self.scale[axis]) as f32)
    }

    /// The cell along an axis of a coordinate within ±2.
    #[inline(always)]
    fn cell(&self, axis: usize, coordinate: f32) -> u32 {
        ((coordinate + 2.0) * (self.size[axis] as f32 * 0.25)) as u32
    }
}

wide! {
    fn shear_all(frame: &Sheared, points: &[Vec3], out: &mut Vec<[f32; 4]>) {
        out.clear();
        out.extend(points.iter().map(|point| {
            let [x, y, z] = frame.apply(*point);
            [x, y, z, 0.0]
        }));
    }
}

impl Cells {
    /// Sorts the points that look along the direction by cells.
    fn sort(&mut self, frame: &Sheared, bundle: &Bundle, direction: Vec3) {
        let columns = frame.size[0] + 1;
        self.starts.clear();
        self.starts.resize(columns * (frame.size[1] + 1) + 2, 0);
        self.looking.clear();
        for (number, point) in (0..).zip(&bundle.points) {
            if point.normal.dot(direction) > 0.0 {
                let place = frame.apply(point.position);
                let cell = frame.cell(1, place[1]) * columns as u32 + frame.cell(0, place[0]);
                self.starts[cell as usize + 2] += 1;
                self.looking.push((place, cell, number));
            }
        }
        let mut total = 0;
        for start in &mut self.starts {
            total += *start;
            *start = total;
        }
        let count = self.looking.len();
        for list in [&mut self.x, &mut self.y, &mut self.z] {
            list.clear();
            list.resize(count + LANES, 0.0);
        }
        for list in [&mut self.vertex, &mut self.point] {
            list.clear();
            list.resize(count + LANES, 0);
        }
        for (place, cell, number) in &self.looking {
            let next = &mut self.starts[*cell as usize + 1];
            let at = *next as usize;
            *next += 1;
            let point = &bundle.points[*number as usize];
            [self.x[at], self.y[at], self.z[at]] = *place;
            (self.vertex[at], self.point[at]) = (point.vertex, *number);
        }
        self.point.truncate(count);
    }
}

/// Holds every triangle against the points in the cells of its box, `eight` at a time.
#[inline(always)]
pub(super) fn walk(
    bundle: &Bundle,
    frame: &Sheared,
    direction: Vec3,
    cells: &mut Cells,
    eight: impl Fn(&Test, &mut Cells, usize, usize) -> u32,
) {
    let columns = frame.size[0] + 1;
    let width = 4.0 / frame.size[1] as f32;
    for triangle in &bundle.triangles {
        let [a, b, c] = triangle.map(|corner| cells.vertices[corner as usize]);
        let (mut low, mut high) = ([0.0; 4], [0.0; 4]);
        for axis in 0..4 {
            low[axis] = min(min(a[axis], b[axis]), c[axis]);
            high[axis] = max(max(a[axis], b[axis]), c[axis]);
        }
        let rows = [frame.cell(1, low[1]) as usize, frame.cell(1, high[1]) as usize];
        let span = [frame.cell(0, low[0]) as usize, frame.cell(0, high[0]) as usize];
        let (mut e, mut f) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
        let mut area = e[0] * f[1] - e[1] * f[0];
        if area < 0.0 {
            (e, f, area) = (f, e, -area);
        }
        let test = Test {
            a: [a[0], a[1]],
            e,
            f,
            area,
            slack: SLACK * (max(high[0] - low[0], high[1] - low[1]) + width),
            behind: high[2] + DEPTH_SLACK,
            ahead: low[2] - DEPTH_SLACK,
            corners: *triangle,
        };
        for row in rows[0]..=rows[1] {
            let mut at = cells.starts[row * columns + span[0]] as usize;
            let end = cells.starts[row * columns + span[1] + 1] as usize;
            while at < end {
                let doubtful = eight(&test, cells, at, end - at);
                if doubtful != 0 {
                    decide(bundle, cells, direction, triangle, at, doubtful);
                }
                at += LANES;
            }
        }
    }
}

/// Marks the points that the triangles block.
fn block(bundle: &Bundle, frame: &Sheared, direction: Vec3, cells: &mut Cells) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        #[expect(
            unsafe_code,
            reason = "the twin with wider instructions, for a processor that was just looked at"
        )]
        // SAFETY: the processor has AVX2.
        return unsafe { super::avx2::look(bundle, frame, direction, cells) };
    }
    walk(bundle, frame, direction, cells, |test, cells, at, count| test.eight(cells, at, count));
}

/// A triangle as eight points at a time are held against it.
pub(super) struct Test {
    /// The first corner.
    pub(super) a: [f32; 2],
    /// The edges from it to the two others, counter-clockwise.
    pub(super) e: [f32; 2],
    pub(super) f: [f32; 2],
    /// Twice the area.
    pub(super) area: f32,
    /// How far the edge functions may be off.
    pub(super) slack: f32,
    /// Beyond this depth no point is blocked,
    pub(super) behind: f32,
    /// and before this one every point inside is.
    pub(super) ahead: f32,
    pub(super) corners: [u32; 3],
}

impl Test {
    /// Marks those of `count` points from `at` on, of eight at most, that are blocked for certain; a bit for each that may
    /// be.
    #[inline(always)]
    fn eight(&self, cells: &mut Cells, at: usize, count: usize) -> u32 {
        let x: &[f32; LANES] = cells.x[at..][..LANES].try_into().expect("as many");
        let y: &[f32; LANES] = cells.y[at..][..LANES].try_into().expect("as many");
        let vertex: &[u32; LANES] = cells.vertex[at..][..LANES].try_into().expect("as many");
        let z: &mut [f32; LANES] = (&mut cells.z[at..][..LANES]).try_into().expect("as many");
        let mut doubtful = [0_u32; LANES];
        for lane in 0..LANES {
            let (px, py) = (x[lane] - self.a[0], y[lane] - self.a[1]);
            let u = px * self.f[1] - py * self.f[0];
            let v = self.e[0] * py - self.e[1] * px;
            let w = self.area - u - v;
            let least = min(min(u, v), w);
            let own = (vertex[lane] == self.corners[0])
                | (vertex[lane] == self.corners[1])
                | (vertex[lane] == self.corners[2]);
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
fn decide(
    bundle: &Bundle,
    cells: &mut Cells,
    direction: Vec3,
    triangle: &[u32; 3],
    at: usize,
    mut doubtful: u32,
) {
    let corners = triangle.map(|corner| bundle.vertices[corner as usize]);
    while doubtful != 0 {
        let lane = doubtful.trailing_zeros() as usize;
        doubtful &= doubtful - 1;
        let origin = bundle.points[cells.point[at + lane] as usize].position;
        if hit(&Ray::new(origin, direction), &corners, 0).is_some() {
            cells.z[at + lane] = f32::NAN;
        }
    }
}
