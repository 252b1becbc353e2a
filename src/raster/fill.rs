//! The visibility buffer: the nearest triangle of every pixel, and its depth.
//!
//! Triangles are set up in runs of a constant length, sorted into tiles, and each tile is filled by one thread.
//! A pixel keeps the largest (reversed) depth, ties going to the lowest triangle, so the order of filling cannot
//! show.

use super::screen::{Projected, project};
use super::setup::{RUN, Run, pixels};
use super::{SUBPIXELS, View};
use crate::numeric::order::{clamp, max, min};
use crate::numeric::parallel;
use glam::Vec3;
use std::ops::Add;

/// The triangle of a pixel that none covers.
pub const NONE: u32 = u32::MAX;

/// Width and height of a tile, in pixels.
pub(super) const TILE: usize = 64;

/// Pixels of a row that may be tested together.
pub(super) const LANES: usize = 8;

/// The longest side of a triangle's box, in 1/256 pixel, for which its edge functions fit in 32 bits: differences of
/// coordinates up to 2¹⁴ make values up to 2 · 2²⁸. Larger ones (up to 2²³) need 64.
pub(super) const SMALL: i32 = 1 << 14;

/// Pixels from row to row of a tile's buffers: what is tested together may reach beyond its last column.
const PITCH: usize = TILE + LANES;

/// The nearest triangle of every pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Visibility {
    /// `height × width` indices of triangles, the top row first; [`NONE`] where there is none.
    pub triangle: Vec<u32>,
    /// As many depths: 1 at the near plane, falling with distance, 0 where there is no triangle.
    pub depth: Vec<f32>,
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
    assert!(max(view.width, view.height) <= super::MAX_SIZE, "{} × {} pixels", view.width, view.height);
    let vertices = project(positions, view);
    let runs = parallel::map(triangles.len().div_ceil(RUN), |run| {
        Run::new(positions, triangles, &vertices, view, run * RUN)
    });
    let columns = view.width.div_ceil(TILE);
    let tiles = parallel::map(columns * view.height.div_ceil(TILE), |number| {
        let mut tile = Tile::new(view, number % columns * TILE, number / columns * TILE, behind);
        for run in &runs {
            fill(&mut tile, run, number, triangles, &vertices);
        }
        tile
    });
    let row = |y: usize| {
        tiles[y / TILE * columns..][..columns].iter().map(move |tile| (tile, &tile.rows[y % TILE]))
    };
    let size = [1, view.width * view.height];
    Visibility {
        triangle: parallel::images(size, view.width, NONE, |_, y, to| {
            row(y).for_each(|(tile, row)| {
                to[tile.left..][..tile.width].copy_from_slice(&row.triangle[..tile.width])
            });
        }),
        depth: parallel::images(size, view.width, 0.0, |_, y, to| {
            row(y).for_each(|(tile, row)| {
                to[tile.left..][..tile.width].copy_from_slice(&row.depth[..tile.width])
            });
        }),
    }
}

/// A part of the image that one thread fills.
pub(super) struct Tile {
    pub(super) left: usize,
    pub(super) top: usize,
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) rows: Vec<Row>,
}

/// What is known of a row of pixels.
#[derive(Clone)]
pub(super) struct Row {
    pub(super) triangle: [u32; PITCH],
    pub(super) depth: [f32; PITCH],
    /// Depths that a pixel must be behind.
    pub(super) behind: [f32; PITCH],
}

impl Tile {
    fn new(view: &View, left: usize, top: usize, behind: Option<&[f32]>) -> Self {
        let (width, height) = (min(TILE, view.width - left), min(TILE, view.height - top));
        let empty = Row { triangle: [NONE; PITCH], depth: [0.0; PITCH], behind: [f32::INFINITY; PITCH] };
        let mut rows = vec![empty; height];
        if let Some(depth) = behind {
            for (row, from) in rows.iter_mut().zip(depth.chunks(view.width).skip(top)) {
                row.behind[..width].copy_from_slice(&from[left..left + width]);
            }
        }
        Self { left, top, width, height, rows }
    }

    /// Fills a triangle.
    pub(super) fn draw(&mut self, triangle: u32, corners: [&Projected; 3]) {
        let (screen, reach) = OnScreen::new(triangle, corners, self);
        if reach <= SMALL {
            self.with_edges(&screen, |value| value as i32);
        } else {
            self.with_edges(&screen, |value| value);
        }
    }

    /// Fills a triangle with edge functions of an integer type that holds all their values: `narrow` makes it of 64
    /// bits.
    #[inline(always)]
    fn with_edges<I: Copy + PartialOrd + Default + Add<Output = I>>(
        &mut self,
        screen: &OnScreen,
        narrow: impl Fn(i64) -> I,
    ) {
        let [left, top, right, bottom] = screen.part;
        let Some(plane) = Plane::new(screen) else { return };
        let sign = if plane.area < 0.0 { -1 } else { 1 };
        let edge = |i: usize, j: usize| {
            let dx = sign * i64::from(screen.x[j] - screen.x[i]);
            let dy = sign * i64::from(screen.y[j] - screen.y[i]);
            let start =
                dx * i64::from(centre(top) - screen.y[i]) - dy * i64::from(centre(left) - screen.x[i]);
            let step = i64::from(SUBPIXELS);
            (narrow(start - i64::from(!kept(dx, dy))), narrow(-dy * step), narrow(dx * step))
        };
        let edges = [edge(0, 1), edge(1, 2), edge(2, 0)];
        let mut row = edges.map(|edge| edge.0);
        for y in top..bottom {
            let mut at = row;
            for x in left..right {
                if at.iter().all(|value| *value >= I::default()) {
                    self.touch(screen, &plane, x, y);
                }
                at = [at[0] + edges[0].1, at[1] + edges[1].1, at[2] + edges[2].1];
            }
            row = [row[0] + edges[0].2, row[1] + edges[1].2, row[2] + edges[2].2];
        }
    }

    #[inline(always)]
    fn touch(&mut self, screen: &OnScreen, plane: &Plane, x: usize, y: usize) {
        let (row, at) = (&mut self.rows[y - self.top], x - self.left);
        let depth = plane.depth(screen, centre(x), centre(y));
        let nearer = depth > row.depth[at] || (depth == row.depth[at] && screen.triangle < row.triangle[at]);
        if depth < row.behind[at] && nearer {
            (row.depth[at], row.triangle[at]) = (depth, screen.triangle);
        }
    }
}

/// Fills what the triangles of a run cover of a tile, whose number is `number`.
fn fill(tile: &mut Tile, run: &Run, number: usize, triangles: &[[u32; 3]], vertices: &[Projected]) {
    let touching = run.touching(number, triangles, vertices);
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        #[expect(unsafe_code, reason = "the same function, for a processor that was just looked at")]
        // SAFETY: the processor has AVX2.
        return unsafe { super::avx2::fill(tile, touching) };
    }
    touching.for_each(|(triangle, corners)| tile.draw(triangle, corners));
}

/// A triangle on the screen.
struct OnScreen {
    /// Corners in 1/256 pixel, and their depths.
    x: [i32; 3],
    y: [i32; 3],
    z: [f32; 3],
    triangle: u32,
    /// The part of a tile whose centres lie in the triangle's box: first column and row, and one past the last.
    part: [usize; 4],
}

impl OnScreen {
    /// A triangle that touches a tile, and the longer side of its box.
    #[inline(always)]
    fn new(triangle: u32, [a, b, c]: [&Projected; 3], tile: &Tile) -> (Self, i32) {
        let ([left, top], [right, bottom]) = pixels(a, b, c);
        let side = |i: usize| max(max(a[i], b[i]), c[i]) - min(min(a[i], b[i]), c[i]);
        let depth = |vertex: &Projected| f32::from_bits(vertex[2] as u32);
        let screen = Self {
            x: [a[0], b[0], c[0]],
            y: [a[1], b[1], c[1]],
            z: [depth(a), depth(b), depth(c)],
            triangle,
            part: [
                max(left, tile.left as i32) as usize,
                max(top, tile.top as i32) as usize,
                min(right, (tile.left + tile.width) as i32) as usize,
                min(bottom, (tile.top + tile.height) as i32) as usize,
            ],
        };
        (screen, max(side(0), side(1)))
    }
}

/// The depth of a triangle as a plane over the screen.
struct Plane {
    /// Twice the area in squared 1/256 pixels, below 0 where the corners run clockwise on the screen.
    area: f32,
    /// Change of depth along x and y a 1/256 pixel.
    along: [f32; 2],
    /// The least and the greatest depth at a corner.
    low: f32,
    high: f32,
}

impl Plane {
    /// Nothing for a triangle without area.
    #[inline(always)]
    fn new(screen: &OnScreen) -> Option<Self> {
        let ([x0, x1, x2], [y0, y1, y2], [z0, z1, z2]) = (screen.x, screen.y, screen.z);
        // Exact: differences of snapped coordinates are whole numbers up to 2²⁴.
        let area = i64::from(x1 - x0) * i64::from(y2 - y0) - i64::from(x2 - x0) * i64::from(y1 - y0);
        let [ax, ay, bx, by] = [x1 - x0, y1 - y0, x2 - x0, y2 - y0].map(|difference| difference as f32);
        let (area, az, bz) = (area as f32, z1 - z0, z2 - z0);
        (area != 0.0).then(|| Self {
            area,
            along: [(az * by - bz * ay) / area, (bz * ax - az * bx) / area],
            low: min(min(z0, z1), z2),
            high: max(max(z0, z1), z2),
        })
    }

    /// The depth at a pixel's centre, summed from left to right. On a sliver the slopes are steep and rounding would
    /// leave the triangle: the depth is held to that of its corners.
    #[inline(always)]
    fn depth(&self, screen: &OnScreen, x: i32, y: i32) -> f32 {
        let [x, y] = [x - screen.x[0], y - screen.y[0]];
        let depth = screen.z[0] + self.along[0] * x as f32 + self.along[1] * y as f32;
        clamp(depth, self.low, self.high)
    }
}

/// The top-left rule: whether a centre on an edge belongs to the triangle, whose top or left edge it is.
#[inline(always)]
fn kept(dx: i64, dy: i64) -> bool {
    dy < 0 || (dy == 0 && dx > 0)
}

/// The centre of a column or row of pixels, in 1/256 pixel.
#[inline(always)]
pub(super) fn centre(pixel: usize) -> i32 {
    pixel as i32 * SUBPIXELS + SUBPIXELS / 2
}
