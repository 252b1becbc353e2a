//! The visibility buffer: the nearest triangle of every pixel, and its depth.
//!
//! Triangles are set up in runs of a constant length, sorted into tiles, and each tile is filled by one thread.
//! A pixel keeps the largest (reversed) depth, ties going to the lowest triangle, so the order of filling cannot
//! show.

use super::clip::{Vertex, clip, distance, planes};
use super::{SUBPIXELS, View};
use crate::numeric::order::{clamp, max, min};
use crate::numeric::parallel;
use glam::Vec3;
use std::ops::AddAssign;

/// The triangle of a pixel that none covers.
pub const NONE: u32 = u32::MAX;

/// Width and height of a tile, in pixels.
const TILE: usize = 64;

/// Triangles that are set up together.
const RUN: usize = 4096;

/// Vertices that are projected together.
const VERTICES: usize = 4096;

/// The nearest triangle of every pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Visibility {
    /// `height × width` indices of triangles, the top row first; [`NONE`] where there is none.
    pub triangle: Vec<u32>,
    /// As many depths: 1 at the near plane, falling with distance, 0 where there is no triangle.
    pub depth: Vec<f32>,
}

/// A vertex on the screen.
#[derive(Debug, Clone, Copy, Default)]
struct Projected {
    /// In 1/256 pixel, y down.
    x: i32,
    y: i32,
    /// Reversed depth.
    z: f32,
    /// Sides of the image that it lies beyond, and whether its triangles must be clipped.
    code: u32,
}

const LEFT: u32 = 1;
const RIGHT: u32 = 2;
const BELOW: u32 = 4;
const ABOVE: u32 = 8;
const CLIP: u32 = 16;
/// The projection overflowed: its triangles are left out.
const LOST: u32 = 32;

/// A triangle ready to be filled: a positive area, and at least one pixel centre in its box.
#[derive(Debug, Clone, Copy)]
struct Ready {
    x: [i32; 3],
    y: [i32; 3],
    z: [f32; 3],
    triangle: u32,
}

/// The triangles of a run, and for each tile those that touch it.
struct Run {
    ready: Vec<Ready>,
    /// (tile, index into `ready`), ascending.
    touched: Vec<(u32, u32)>,
}

/// The nearest triangle of every pixel of `view`, both sides of a triangle alike.
///
/// With `behind`, a depth for every pixel, only what lies strictly behind it is drawn: the next layer of depth
/// peeling (Everitt 2001).
///
/// # Panics
/// Where a triangle's index is out of range, or the view is larger than [`super::MAX_SIZE`].
pub fn visibility(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    view: &View,
    behind: Option<&[f32]>,
) -> Visibility {
    assert!(view.width.max(view.height) <= super::MAX_SIZE, "{} × {} pixels", view.width, view.height);
    let vertices = project(positions, view);
    let columns = view.width.div_ceil(TILE);
    let runs = parallel::map(triangles.len().div_ceil(RUN), |run| {
        set_up(positions, triangles, &vertices, view, columns, run * RUN)
    });
    let tiles = parallel::map(columns * view.height.div_ceil(TILE), |tile| {
        Tile::new(view, tile % columns * TILE, tile / columns * TILE, behind).fill(&runs, tile as u32)
    });
    let mut whole = Visibility {
        triangle: vec![NONE; view.width * view.height],
        depth: vec![0.0; view.width * view.height],
    };
    for tile in &tiles {
        for row in 0..tile.height {
            let to = (tile.top + row) * view.width + tile.left;
            let from = row * TILE..row * TILE + tile.width;
            whole.triangle[to..to + tile.width].copy_from_slice(&tile.triangle[from.clone()]);
            whole.depth[to..to + tile.width].copy_from_slice(&tile.depth[from]);
        }
    }
    whole
}

fn project(positions: &[Vec3], view: &View) -> Vec<Projected> {
    let planes = planes(view);
    let mut projected = vec![Projected::default(); positions.len()];
    parallel::for_each_chunk(&mut projected, VERTICES, |chunk, out| {
        for (out, position) in out.iter_mut().zip(&positions[chunk * VERTICES..]) {
            *out = on_screen(view.project(*position), &planes, view);
        }
    });
    projected
}

fn on_screen(clip: Vertex, planes: &[Vertex; 5], view: &View) -> Projected {
    let [x, y, _, w] = clip;
    if !(clip[0] + clip[1] + clip[2] + clip[3]).is_finite() {
        return Projected { code: LOST, ..Projected::default() };
    }
    let side = |outside: bool, code: u32| if outside { code } else { 0 };
    // For w < 0 the comparisons are those of the plane too: x ≥ −w is a half-space whatever the sign of w.
    let mut code = side(x < -w, LEFT) | side(x > w, RIGHT) | side(y < -w, BELOW) | side(y > w, ABOVE);
    if planes.iter().any(|plane| distance(*plane, clip) < 0.0) {
        code |= CLIP;
        return Projected { code, ..Projected::default() };
    }
    let (x, y, z) = snap(clip, view);
    Projected { x, y, z, code }
}

/// Snaps to 1/256 pixel, half to even.
fn snap(clip: Vertex, view: &View) -> (i32, i32, f32) {
    let snapped = view.pixel(clip).map(|at| (at * SUBPIXELS as f32).round_ties_even() as i32);
    (snapped[0], snapped[1], clip[2] / clip[3])
}

fn set_up(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    vertices: &[Projected],
    view: &View,
    columns: usize,
    first: usize,
) -> Run {
    let planes = planes(view);
    let mut run = Run { ready: Vec::new(), touched: Vec::new() };
    for (offset, corners) in triangles[first..].iter().take(RUN).enumerate() {
        let triangle = (first + offset) as u32;
        let projected = corners.map(|corner| vertices[corner as usize]);
        let codes = projected.map(|vertex| vertex.code);
        let (all, any) = (codes[0] & codes[1] & codes[2], codes[0] | codes[1] | codes[2]);
        if all & (LEFT | RIGHT | BELOW | ABOVE) != 0 || any & LOST != 0 {
            continue;
        }
        if any & CLIP == 0 {
            let points = projected.map(|vertex| (vertex.x, vertex.y, vertex.z));
            run.add(points, triangle, view, columns);
        } else {
            let polygon = clip(corners.map(|corner| view.project(positions[corner as usize])), &planes);
            let points: Vec<_> = polygon.into_iter().map(|vertex| snap(vertex, view)).collect();
            for pair in points.windows(2).skip(1) {
                run.add([points[0], pair[0], pair[1]], triangle, view, columns);
            }
        }
    }
    run.touched.sort_unstable();
    run
}

/// The range of pixels, of `size`, whose centres lie in [`low`, `high`] (1/256 pixel), as first and one past last.
fn centres(low: i32, high: i32, size: usize) -> (usize, usize) {
    let half = SUBPIXELS / 2;
    let first = (low + half - 1).div_euclid(SUBPIXELS); // ⌈(low − ½) / 1⌉ in pixels
    let last = (high - half).div_euclid(SUBPIXELS);
    (first.max(0) as usize, (last + 1).clamp(0, size as i32) as usize)
}

impl Run {
    fn add(&mut self, mut points: [(i32, i32, f32); 3], triangle: u32, view: &View, columns: usize) {
        let area = |p: [(i32, i32, f32); 3]| {
            let ([x0, x1, x2], [y0, y1, y2]) = (p.map(|p| i64::from(p.0)), p.map(|p| i64::from(p.1)));
            (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        };
        match area(points) {
            0 => return,
            negative if negative < 0 => points.swap(1, 2),
            _ => {}
        }
        let ready =
            Ready { x: points.map(|p| p.0), y: points.map(|p| p.1), z: points.map(|p| p.2), triangle };
        let (left, right) = extent(ready.x, view.width);
        let (top, bottom) = extent(ready.y, view.height);
        if left >= right || top >= bottom {
            return;
        }
        let index = self.ready.len() as u32;
        self.ready.push(ready);
        for row in top / TILE..=(bottom - 1) / TILE {
            for column in left / TILE..=(right - 1) / TILE {
                self.touched.push(((row * columns + column) as u32, index));
            }
        }
    }
}

fn extent(at: [i32; 3], size: usize) -> (usize, usize) {
    centres(at[0].min(at[1]).min(at[2]), at[0].max(at[1]).max(at[2]), size)
}

/// A part of the image that one thread fills.
struct Tile<'a> {
    left: usize,
    top: usize,
    width: usize,
    height: usize,
    /// Row pitch [`TILE`].
    triangle: Vec<u32>,
    depth: Vec<f32>,
    /// Depths of the whole image that must be passed, and its width.
    behind: Option<(&'a [f32], usize)>,
}

impl<'a> Tile<'a> {
    fn new(view: &View, left: usize, top: usize, behind: Option<&'a [f32]>) -> Self {
        Self {
            left,
            top,
            width: TILE.min(view.width - left),
            height: TILE.min(view.height - top),
            triangle: vec![NONE; TILE * TILE],
            depth: vec![0.0; TILE * TILE],
            behind: behind.map(|depth| (depth, view.width)),
        }
    }

    fn fill(mut self, runs: &[Run], tile: u32) -> Self {
        for run in runs {
            let first = run.touched.partition_point(|touched| touched.0 < tile);
            for (_, index) in run.touched[first..].iter().take_while(|touched| touched.0 == tile) {
                self.draw(&run.ready[*index as usize]);
            }
        }
        self
    }

    fn draw(&mut self, ready: &Ready) {
        // Differences of coordinates up to 2¹⁴ make edge values up to 2·2²⁸: 32 bits suffice for triangles of
        // up to 64 pixels. Larger ones (up to 2²³) need 64.
        let reach = |at: [i32; 3]| at[0].max(at[1]).max(at[2]) - at[0].min(at[1]).min(at[2]);
        if reach(ready.x) <= 1 << 14 && reach(ready.y) <= 1 << 14 {
            self.draw_with::<i32>(ready);
        } else {
            self.draw_with::<i64>(ready);
        }
    }

    /// Fills one triangle with edge functions of the integer type `I`, which must hold all their values.
    fn draw_with<I: Copy + AddAssign + PartialOrd + Default + TryFrom<i64>>(&mut self, ready: &Ready) {
        let (left, right) = extent(ready.x, self.left + self.width);
        let (top, bottom) = extent(ready.y, self.top + self.height);
        let (left, top) = (left.max(self.left), top.max(self.top));
        if left >= right || top >= bottom {
            return;
        }
        let centre = |pixel: usize| pixel as i32 * SUBPIXELS + SUBPIXELS / 2;
        let narrow = |value: i64| I::try_from(value).unwrap_or_else(|_| unreachable!("bounded by draw"));
        let edges: [(I, I, I); 3] = std::array::from_fn(|i| {
            let j = (i + 1) % 3;
            let dx = i64::from(ready.x[j] - ready.x[i]);
            let dy = i64::from(ready.y[j] - ready.y[i]);
            // Top-left rule: a centre on an edge belongs to the triangle whose top or left edge it is.
            let kept = dy < 0 || (dy == 0 && dx > 0);
            let start = dx * i64::from(centre(top) - ready.y[i]) - dy * i64::from(centre(left) - ready.x[i]);
            let step = i64::from(SUBPIXELS);
            (narrow(start - i64::from(!kept)), narrow(-dy * step), narrow(dx * step))
        });
        let plane = Plane::new(ready);
        let zero = I::default();
        let mut at_row = edges.map(|edge| edge.0);
        for y in top..bottom {
            let mut at = at_row;
            for x in left..right {
                if at[0] >= zero && at[1] >= zero && at[2] >= zero {
                    self.touch(x, y, plane.depth(centre(x), centre(y)), ready.triangle);
                }
                at.iter_mut().zip(&edges).for_each(|(value, edge)| *value += edge.1);
            }
            at_row.iter_mut().zip(&edges).for_each(|(value, edge)| *value += edge.2);
        }
    }

    #[inline]
    fn touch(&mut self, x: usize, y: usize, depth: f32, triangle: u32) {
        if self.behind.is_some_and(|(behind, width)| depth >= behind[y * width + x]) {
            return;
        }
        let at = (y - self.top) * TILE + x - self.left;
        if depth > self.depth[at] || (depth == self.depth[at] && triangle < self.triangle[at]) {
            self.depth[at] = depth;
            self.triangle[at] = triangle;
        }
    }
}

/// The depth of a triangle as a plane over the screen.
struct Plane {
    x: i32,
    y: i32,
    z: f32,
    /// Change of depth a 1/256 pixel.
    along: [f32; 2],
    low: f32,
    high: f32,
}

impl Plane {
    fn new(ready: &Ready) -> Self {
        let ([x0, x1, x2], [y0, y1, y2], [z0, z1, z2]) = (ready.x, ready.y, ready.z);
        // Exact: differences of snapped coordinates are whole numbers up to 2²⁴.
        let [ax, ay, bx, by] = [x1 - x0, y1 - y0, x2 - x0, y2 - y0].map(|difference| difference as f32);
        let area = (i64::from(x1 - x0) * i64::from(y2 - y0) - i64::from(x2 - x0) * i64::from(y1 - y0)) as f32;
        let (az, bz) = (z1 - z0, z2 - z0);
        Self {
            x: x0,
            y: y0,
            z: z0,
            along: [(az * by - bz * ay) / area, (bz * ax - az * bx) / area],
            low: min(min(z0, z1), z2),
            high: max(max(z0, z1), z2),
        }
    }

    /// The depth at a pixel's centre, summed from left to right. On a sliver the slopes are steep and rounding
    /// would leave the triangle: the depth is held to that of its corners.
    #[inline]
    fn depth(&self, x: i32, y: i32) -> f32 {
        let depth = self.z + self.along[0] * (x - self.x) as f32 + self.along[1] * (y - self.y) as f32;
        clamp(depth, self.low, self.high)
    }
}
