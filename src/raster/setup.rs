//! Triangles made ready to be filled, and sorted into the tiles that they touch.

use super::SUBPIXELS;
use super::View;
use super::clip::{clip, planes};
use super::fill::TILE;
use super::screen::{ABOVE, BELOW, CLIP, LEFT, LOST, Projected, RIGHT, snap};
use crate::numeric::lanes::{BLOCK, wide};
use crate::numeric::order::{max, min};
use glam::Vec3;

/// Triangles that are set up together.
pub(super) const RUN: usize = 64 * BLOCK;

/// A triangle that may cover something: at least one pixel centre lies in its box.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ready {
    /// Corners in 1/256 pixel, and their depths.
    pub(super) x: [i32; 3],
    pub(super) y: [i32; 3],
    pub(super) z: [f32; 3],
    pub(super) triangle: u32,
    /// Pixels whose centres lie in its box and in the image: first column and row, and one past the last.
    pub(super) left: u16,
    pub(super) top: u16,
    pub(super) right: u16,
    pub(super) bottom: u16,
}

/// Three corners, each x and y in 1/256 pixel and depth, of as many triangles as there are lanes.
struct Corners {
    x: [[i32; BLOCK]; 3],
    y: [[i32; BLOCK]; 3],
    z: [[f32; BLOCK]; 3],
}

wide! {
    /// The triangles of a run that cover something, in order; `first` is the first of `triangles`.
    pub(super) fn set_up(
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        vertices: &[Projected],
        view: &View,
        first: usize,
    ) -> Vec<Ready> {
        let run = &triangles[first..min(triangles.len(), first + RUN)];
        let mut ready = Vec::with_capacity(run.len());
        for (triangles, first) in run.chunks(BLOCK).zip((first..).step_by(BLOCK)) {
            block(positions, triangles, vertices, view, first as u32, &mut ready);
        }
        ready
    }
}

#[inline(always)]
fn block(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    vertices: &[Projected],
    view: &View,
    first: u32,
    ready: &mut Vec<Ready>,
) {
    let mut corners = Corners { x: [[0; BLOCK]; 3], y: [[0; BLOCK]; 3], z: [[0.0; BLOCK]; 3] };
    // Codes that any corner has, and that all have.
    let (mut any, mut all) = (0, [0; BLOCK]);
    for (lane, triangle) in triangles.iter().enumerate() {
        let [a, b, c] = triangle.map(|corner| vertices[corner as usize]);
        for (corner, at) in [a, b, c].into_iter().enumerate() {
            (corners.x[corner][lane], corners.y[corner][lane], corners.z[corner][lane]) = (at.x, at.y, at.z);
        }
        any |= a.code | b.code | c.code;
        all[lane] = a.code & b.code & c.code;
    }
    if any & (CLIP | LOST) != 0 {
        return clipped(positions, triangles, vertices, view, first, ready);
    }
    let boxes = Boxes::new(&corners, view);
    for (lane, triangle) in (first..).take(triangles.len()).enumerate() {
        if boxes.kept[lane] != 0 && all[lane] & (LEFT | RIGHT | BELOW | ABOVE) == 0 {
            ready.push(corners.ready(&boxes, lane, triangle));
        }
    }
}

/// A block of triangles some of which must be clipped, one by one.
#[inline(never)]
fn clipped(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    vertices: &[Projected],
    view: &View,
    first: u32,
    ready: &mut Vec<Ready>,
) {
    let mut one = |points: [(i32, i32, f32); 3], triangle: u32| {
        let mut corners = Corners { x: [[0; BLOCK]; 3], y: [[0; BLOCK]; 3], z: [[0.0; BLOCK]; 3] };
        for (corner, at) in points.into_iter().enumerate() {
            (corners.x[corner][0], corners.y[corner][0], corners.z[corner][0]) = at;
        }
        let boxes = Boxes::new(&corners, view);
        if boxes.kept[0] != 0 {
            ready.push(corners.ready(&boxes, 0, triangle));
        }
    };
    for (triangle, corners) in (first..).zip(triangles) {
        let [a, b, c] = corners.map(|corner| vertices[corner as usize]);
        let any = a.code | b.code | c.code;
        if a.code & b.code & c.code & (LEFT | RIGHT | BELOW | ABOVE) != 0 || any & LOST != 0 {
            continue;
        }
        if any & CLIP == 0 {
            one([(a.x, a.y, a.z), (b.x, b.y, b.z), (c.x, c.y, c.z)], triangle);
        } else {
            let polygon = clip(corners.map(|corner| view.project(positions[corner as usize])), &planes(view));
            let points: Vec<_> = polygon.into_iter().map(|vertex| snap(vertex, view)).collect();
            for pair in points.windows(2).skip(1) {
                one([points[0], pair[0], pair[1]], triangle);
            }
        }
    }
}

/// The ranges of pixels whose centres lie in the boxes of triangles, and whether there are any.
struct Boxes {
    left: [i32; BLOCK],
    right: [i32; BLOCK],
    top: [i32; BLOCK],
    bottom: [i32; BLOCK],
    kept: [i32; BLOCK],
}

impl Boxes {
    #[inline(always)]
    fn new(corners: &Corners, view: &View) -> Self {
        let none = [0; BLOCK];
        let mut boxes = Self { left: none, right: none, top: none, bottom: none, kept: none };
        let (width, height) = (view.width as i32, view.height as i32);
        for lane in 0..BLOCK {
            let [x, y] = [&corners.x, &corners.y].map(|at| [at[0][lane], at[1][lane], at[2][lane]]);
            let ((left, right), (top, bottom)) = (centres(x, width), centres(y, height));
            (boxes.left[lane], boxes.right[lane]) = (left, right);
            (boxes.top[lane], boxes.bottom[lane]) = (top, bottom);
            boxes.kept[lane] = i32::from((left < right) & (top < bottom));
        }
        boxes
    }
}

/// The range of pixels, of `size`, whose centres lie between the least and the greatest of `at` (1/256 pixel), as
/// first and one past last.
#[inline(always)]
fn centres(at: [i32; 3], size: i32) -> (i32, i32) {
    let (low, high) = (min(min(at[0], at[1]), at[2]), max(max(at[0], at[1]), at[2]));
    let half = SUBPIXELS / 2;
    // ⌈low − ½⌉ and ⌊high − ½⌋ + 1 in pixels; the shift is a division that rounds down.
    let first = (low + (half - 1)) >> SUBPIXELS.trailing_zeros();
    let last = ((high - half) >> SUBPIXELS.trailing_zeros()) + 1;
    (max(first, 0), min(last, size))
}

impl Corners {
    /// The triangle of a lane made ready.
    #[inline(always)]
    fn ready(&self, boxes: &Boxes, lane: usize, triangle: u32) -> Ready {
        Ready {
            x: [self.x[0][lane], self.x[1][lane], self.x[2][lane]],
            y: [self.y[0][lane], self.y[1][lane], self.y[2][lane]],
            z: [self.z[0][lane], self.z[1][lane], self.z[2][lane]],
            triangle,
            left: boxes.left[lane] as u16,
            top: boxes.top[lane] as u16,
            right: boxes.right[lane] as u16,
            bottom: boxes.bottom[lane] as u16,
        }
    }
}

/// The triangles of a run, in order, and for each tile those that touch it.
pub(super) struct Run {
    pub(super) ready: Vec<Ready>,
    /// Indices into `ready`, those of one tile after those of another, ascending in each; empty where the image has
    /// one tile, which all touch.
    pub(super) touched: Vec<u32>,
    /// Where each tile's part of `touched` begins, and where the last ends.
    pub(super) begins: Vec<u32>,
}

impl Run {
    /// Sorts triangles into `tiles` tiles, `columns` in a row, by counting.
    pub(super) fn new(ready: Vec<Ready>, columns: usize, tiles: usize) -> Self {
        if tiles == 1 {
            return Self { ready, touched: Vec::new(), begins: Vec::new() };
        }
        let mut begins = vec![0; tiles + 1];
        for one in &ready {
            one.touches(columns, |tile| begins[tile + 1] += 1);
        }
        for tile in 0..tiles {
            begins[tile + 1] += begins[tile];
        }
        let mut next: Vec<u32> = begins[..tiles].to_vec();
        let mut touched = vec![0; begins[tiles] as usize];
        for (index, one) in (0..).zip(&ready) {
            one.touches(columns, |tile| {
                touched[next[tile] as usize] = index;
                next[tile] += 1;
            });
        }
        Self { ready, touched, begins }
    }
}

impl Ready {
    /// Calls `touch` with the number of each tile that the box touches, `columns` tiles in a row.
    #[inline(always)]
    fn touches(&self, columns: usize, mut touch: impl FnMut(usize)) {
        let [left, top, right, bottom] =
            [self.left, self.top, self.right - 1, self.bottom - 1].map(|pixel| usize::from(pixel) / TILE);
        for row in top..=bottom {
            for column in left..=right {
                touch(row * columns + column);
            }
        }
    }
}
