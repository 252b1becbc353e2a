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
    /// Pixels whose centres lie in its box and in the image: first column and row, and one past the last.
    left: u16,
    top: u16,
    right: u16,
    bottom: u16,
}

/// The triangles of a run, in order, and for each tile those that touch it.
struct Run {
    ready: Vec<Ready>,
    /// Indices into `ready`, those of one tile after those of another, ascending in each; empty where the image has
    /// one tile, which all touch.
    touched: Vec<u32>,
    /// Where each tile's part of `touched` begins, and where the last ends.
    begins: Vec<u32>,
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
    let tiles = columns * view.height.div_ceil(TILE);
    let runs = parallel::map(triangles.len().div_ceil(RUN), |run| {
        let mut ready = set_up(positions, triangles, &vertices, view, run * RUN);
        ready.shrink_to_fit();
        Run::new(ready, columns, tiles)
    });
    let tiles = parallel::map(tiles, |tile| {
        Tile::new(view, tile % columns * TILE, tile / columns * TILE, behind).fill(&runs, tile)
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
#[inline]
fn snap(clip: Vertex, view: &View) -> (i32, i32, f32) {
    // Adding 1.5 · 2⁵² leaves no bit for a fraction: the addition rounds half to even, and the sum's low bits are
    // the whole number. `round_ties_even` would be a call on processors before SSE 4.1.
    let whole = |at: f32| (f64::from(at * SUBPIXELS as f32) + 6_755_399_441_055_744.0).to_bits() as i32;
    let [x, y] = view.pixel(clip);
    (whole(x), whole(y), clip[2] / clip[3])
}

/// The triangles of a run that cover something, from the `first` on.
fn set_up(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    vertices: &[Projected],
    view: &View,
    first: usize,
) -> Vec<Ready> {
    let run = &triangles[first..triangles.len().min(first + RUN)];
    let mut ready = Vec::with_capacity(run.len());
    for (triangle, corners) in (first as u32..).zip(run) {
        let [a, b, c] = corners.map(|corner| vertices[corner as usize]);
        if a.code & b.code & c.code & (LEFT | RIGHT | BELOW | ABOVE) != 0 {
            continue;
        }
        let any = a.code | b.code | c.code;
        if any & (CLIP | LOST) == 0 {
            ready.extend(prepared([(a.x, a.y, a.z), (b.x, b.y, b.z), (c.x, c.y, c.z)], triangle, view));
        } else if any & LOST == 0 {
            let polygon = clip(corners.map(|corner| view.project(positions[corner as usize])), &planes(view));
            let points: Vec<_> = polygon.into_iter().map(|vertex| snap(vertex, view)).collect();
            for pair in points.windows(2).skip(1) {
                ready.extend(prepared([points[0], pair[0], pair[1]], triangle, view));
            }
        }
    }
    ready
}

/// A triangle made ready, with its corners in the order that makes its area positive; nothing where it has no area
/// or no pixel's centre in its box.
#[inline]
fn prepared([a, b, c]: [(i32, i32, f32); 3], triangle: u32, view: &View) -> Option<Ready> {
    let (left, right) = centres([a.0, b.0, c.0], view.width);
    let (top, bottom) = centres([a.1, b.1, c.1], view.height);
    if left >= right || top >= bottom {
        return None;
    }
    let cross = |p: (i32, i32, f32), q: (i32, i32, f32)| i64::from(p.0 - a.0) * i64::from(q.1 - a.1);
    let area = cross(b, c) - cross(c, b);
    let (b, c) = if area < 0 { (c, b) } else { (b, c) };
    (area != 0).then_some(Ready {
        x: [a.0, b.0, c.0],
        y: [a.1, b.1, c.1],
        z: [a.2, b.2, c.2],
        triangle,
        left: left as u16,
        top: top as u16,
        right: right as u16,
        bottom: bottom as u16,
    })
}

/// The range of pixels, of `size`, whose centres lie between the least and the greatest of `at` (1/256 pixel), as
/// first and one past last.
#[inline]
fn centres(at: [i32; 3], size: usize) -> (i32, i32) {
    let (low, high) = (at[0].min(at[1]).min(at[2]), at[0].max(at[1]).max(at[2]));
    let half = SUBPIXELS / 2;
    // ⌈low − ½⌉ and ⌊high − ½⌋ + 1 in pixels; the shift is a division that rounds down.
    let first = (low + half - 1) >> SUBPIXELS.trailing_zeros();
    let last = ((high - half) >> SUBPIXELS.trailing_zeros()) + 1;
    (first.max(0), last.min(size as i32))
}

impl Run {
    /// Sorts triangles into `tiles` tiles, `columns` in a row, by counting.
    fn new(ready: Vec<Ready>, columns: usize, tiles: usize) -> Self {
        if tiles == 1 {
            return Self { ready, touched: Vec::new(), begins: Vec::new() };
        }
        let touches = |ready: &Ready| {
            let tile = |pixel: u16| usize::from(pixel) / TILE;
            let (left, right) = (tile(ready.left), tile(ready.right - 1));
            (tile(ready.top)..=tile(ready.bottom - 1))
                .flat_map(move |row| (left..=right).map(move |column| row * columns + column))
        };
        let mut begins = vec![0; tiles + 1];
        for tile in ready.iter().flat_map(touches) {
            begins[tile + 1] += 1;
        }
        for tile in 0..tiles {
            begins[tile + 1] += begins[tile];
        }
        let mut next: Vec<u32> = begins[..tiles].to_vec();
        let mut touched = vec![0; begins[tiles] as usize];
        for (index, one) in ready.iter().enumerate() {
            for tile in touches(one) {
                touched[next[tile] as usize] = index as u32;
                next[tile] += 1;
            }
        }
        Self { ready, touched, begins }
    }
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

    fn fill(mut self, runs: &[Run], tile: usize) -> Self {
        for run in runs {
            if run.begins.is_empty() {
                run.ready.iter().for_each(|ready| self.draw(ready));
            } else {
                let touched = &run.touched[run.begins[tile] as usize..run.begins[tile + 1] as usize];
                touched.iter().for_each(|index| self.draw(&run.ready[*index as usize]));
            }
        }
        self
    }

    fn draw(&mut self, ready: &Ready) {
        // Differences of coordinates up to 2¹⁴ make edge values up to 2·2²⁸: 32 bits suffice for triangles of
        // up to 64 pixels. Larger ones (up to 2²³) need 64.
        let reach = |at: [i32; 3]| at[0].max(at[1]).max(at[2]) - at[0].min(at[1]).min(at[2]);
        if reach(ready.x) <= 1 << 14 && reach(ready.y) <= 1 << 14 {
            self.draw_with(ready, |value| value as i32, |a, b| a + b, |value| value >= 0);
        } else {
            self.draw_with(ready, |value| value, |a, b| a + b, |value| value >= 0);
        }
    }

    /// Fills one triangle with edge functions of an integer type that holds all their values: `narrow` makes it of
    /// 64 bits, `add` and `inside` step and test it.
    #[inline(always)]
    fn draw_with<I: Copy>(
        &mut self,
        ready: &Ready,
        narrow: impl Fn(i64) -> I,
        add: impl Fn(I, I) -> I,
        inside: impl Fn(I) -> bool,
    ) {
        let left = usize::from(ready.left).max(self.left);
        let top = usize::from(ready.top).max(self.top);
        let right = usize::from(ready.right).min(self.left + self.width);
        let bottom = usize::from(ready.bottom).min(self.top + self.height);
        let centre = |pixel: usize| pixel as i32 * SUBPIXELS + SUBPIXELS / 2;
        let edge = |i: usize, j: usize| {
            let dx = i64::from(ready.x[j] - ready.x[i]);
            let dy = i64::from(ready.y[j] - ready.y[i]);
            // Top-left rule: a centre on an edge belongs to the triangle whose top or left edge it is.
            let kept = dy < 0 || (dy == 0 && dx > 0);
            let start = dx * i64::from(centre(top) - ready.y[i]) - dy * i64::from(centre(left) - ready.x[i]);
            let step = i64::from(SUBPIXELS);
            (narrow(start - i64::from(!kept)), narrow(-dy * step), narrow(dx * step))
        };
        let edges = [edge(0, 1), edge(1, 2), edge(2, 0)];
        let mut plane = None;
        let mut row = edges.map(|edge| edge.0);
        for y in top..bottom {
            let mut at = row;
            for x in left..right {
                if inside(at[0]) && inside(at[1]) && inside(at[2]) {
                    let plane = plane.get_or_insert_with(|| Plane::new(ready));
                    self.touch(x, y, plane.depth(centre(x), centre(y)), ready.triangle);
                }
                at = [add(at[0], edges[0].1), add(at[1], edges[1].1), add(at[2], edges[2].1)];
            }
            row = [add(row[0], edges[0].2), add(row[1], edges[1].2), add(row[2], edges[2].2)];
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
