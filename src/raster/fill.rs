//! The visibility buffer: the nearest triangle of every pixel, and its depth.
//!
//! Triangles are set up in runs of a constant length, sorted into tiles, and each tile is filled by one thread.
//! A pixel keeps the largest (reversed) depth, ties going to the lowest triangle, so the order of filling cannot
//! show.

use super::screen::project;
use super::setup::{RUN, Ready, Run, set_up};
use super::{SUBPIXELS, View};
use crate::numeric::order::{clamp, max, min};
use crate::numeric::parallel;
use glam::Vec3;
use std::ops::Add;

/// The triangle of a pixel that none covers.
pub const NONE: u32 = u32::MAX;

/// Width and height of a tile, in pixels.
pub(super) const TILE: usize = 64;

/// Pixels of a row that are tested together.
const LANES: usize = 8;

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
    let columns = view.width.div_ceil(TILE);
    let tiles = columns * view.height.div_ceil(TILE);
    let runs = parallel::map(triangles.len().div_ceil(RUN), |run| {
        let mut ready = set_up(positions, triangles, &vertices, view, run * RUN);
        ready.shrink_to_fit();
        Run::new(ready, columns, tiles)
    });
    let tiles = parallel::map(tiles, |tile| {
        let mut part = Tile::new(view, tile % columns * TILE, tile / columns * TILE, behind);
        fill(&mut part, &runs, tile);
        part
    });
    let mut whole = Visibility {
        triangle: vec![NONE; view.width * view.height],
        depth: vec![0.0; view.width * view.height],
    };
    for tile in &tiles {
        for (y, row) in (tile.top..).zip(&tile.rows) {
            let to = y * view.width + tile.left;
            whole.triangle[to..to + tile.width].copy_from_slice(&row.triangle[..tile.width]);
            whole.depth[to..to + tile.width].copy_from_slice(&row.depth[..tile.width]);
        }
    }
    whole
}

/// A part of the image that one thread fills.
struct Tile {
    left: usize,
    top: usize,
    width: usize,
    height: usize,
    rows: Vec<Row>,
}

/// What is known of a row of pixels.
#[derive(Clone)]
struct Row {
    triangle: [u32; PITCH],
    depth: [f32; PITCH],
    /// Depths that a pixel must be behind.
    behind: [f32; PITCH],
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

    /// Fills what the triangles of `runs` cover of the tile, whose number is `number`; `small` fills a part of one that
    /// spans up to 64 pixels.
    #[inline(always)]
    fn fill(&mut self, runs: &[Run], number: usize, small: impl Fn(&mut Self, &Ready)) {
        for run in runs {
            if run.begins.is_empty() {
                for ready in &run.ready {
                    self.draw(ready, &small);
                }
            } else {
                for index in &run.touched[run.begins[number] as usize..run.begins[number + 1] as usize] {
                    self.draw(&run.ready[*index as usize], &small);
                }
            }
        }
    }

    #[inline(always)]
    fn draw(&mut self, ready: &Ready, small: impl Fn(&mut Self, &Ready)) {
        // Differences of coordinates up to 2¹⁴ make edge values up to 2·2²⁸: 32 bits suffice for triangles of
        // up to 64 pixels. Larger ones (up to 2²³) need 64.
        let reach = |at: [i32; 3]| max(max(at[0], at[1]), at[2]) - min(min(at[0], at[1]), at[2]);
        if max(reach(ready.x), reach(ready.y)) <= 1 << 14 {
            small(self, ready);
        } else {
            self.large(ready);
        }
    }

    /// The part of a triangle's box in the tile: first column and row, and one past the last.
    #[inline(always)]
    fn part(&self, ready: &Ready) -> [usize; 4] {
        [
            max(usize::from(ready.left), self.left),
            max(usize::from(ready.top), self.top),
            min(usize::from(ready.right), self.left + self.width),
            min(usize::from(ready.bottom), self.top + self.height),
        ]
    }

    /// Fills a triangle of any size with edge functions of 64 bits.
    #[inline(never)]
    fn large(&mut self, ready: &Ready) {
        self.with_edges(ready, |value| value);
    }

    /// Fills a triangle of up to 64 pixels with edge functions of 32 bits.
    fn small(&mut self, ready: &Ready) {
        self.with_edges(ready, |value| value as i32);
    }

    /// Fills a triangle with edge functions of an integer type that holds all their values: `narrow` makes it of 64
    /// bits.
    #[inline(always)]
    fn with_edges<I: Copy + PartialOrd + Default + Add<Output = I>>(
        &mut self,
        ready: &Ready,
        narrow: impl Fn(i64) -> I,
    ) {
        let [left, top, right, bottom] = self.part(ready);
        let Some(plane) = Plane::new(ready) else { return };
        let sign = if plane.area < 0.0 { -1 } else { 1 };
        let edge = |i: usize, j: usize| {
            let dx = sign * i64::from(ready.x[j] - ready.x[i]);
            let dy = sign * i64::from(ready.y[j] - ready.y[i]);
            let start = dx * i64::from(centre(top) - ready.y[i]) - dy * i64::from(centre(left) - ready.x[i]);
            let step = i64::from(SUBPIXELS);
            (narrow(start - i64::from(!kept(dx, dy))), narrow(-dy * step), narrow(dx * step))
        };
        let edges = [edge(0, 1), edge(1, 2), edge(2, 0)];
        let mut row = edges.map(|edge| edge.0);
        for y in top..bottom {
            let mut at = row;
            for x in left..right {
                if at.iter().all(|value| *value >= I::default()) {
                    self.touch(ready, &plane, x, y);
                }
                at = [at[0] + edges[0].1, at[1] + edges[1].1, at[2] + edges[2].1];
            }
            row = [row[0] + edges[0].2, row[1] + edges[1].2, row[2] + edges[2].2];
        }
    }

    #[inline(always)]
    fn touch(&mut self, ready: &Ready, plane: &Plane, x: usize, y: usize) {
        let (row, at) = (&mut self.rows[y - self.top], x - self.left);
        let depth = plane.depth(ready, centre(x), centre(y));
        let nearer = depth > row.depth[at] || (depth == row.depth[at] && ready.triangle < row.triangle[at]);
        if depth < row.behind[at] && nearer {
            (row.depth[at], row.triangle[at]) = (depth, ready.triangle);
        }
    }

    /// [`Self::small`] on eight pixels of a row at a time, with the same bits.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    #[inline]
    fn small_avx2(&mut self, ready: &Ready) {
        use std::arch::x86_64::*;
        let [left, top, right, bottom] = self.part(ready);
        let Some(plane) = Plane::new(ready) else { return };
        // The three edges side by side: 0 to 1, 1 to 2, 2 to 0, the other way round where the area is negative.
        let corners = |at: [i32; 3]| _mm_setr_epi32(at[0], at[1], at[2], 0);
        let (x, y) = (corners(ready.x), corners(ready.y));
        let turn = _mm_set1_epi32(if plane.area < 0.0 { -1 } else { 0 });
        let along = |at| {
            _mm_sub_epi32(_mm_xor_si128(_mm_sub_epi32(_mm_shuffle_epi32::<0b1100_1001>(at), at), turn), turn)
        };
        let (dx, dy) = (along(x), along(y));
        let start = _mm_sub_epi32(
            _mm_mullo_epi32(dx, _mm_sub_epi32(_mm_set1_epi32(centre(top)), y)),
            _mm_mullo_epi32(dy, _mm_sub_epi32(_mm_set1_epi32(centre(left)), x)),
        );
        // kept(dx, dy) is dy < 1 where dx > 0, dy < 0 elsewhere; −1 where true.
        let zero = _mm_setzero_si128();
        let kept = _mm_cmpgt_epi32(_mm_sub_epi32(zero, _mm_cmpgt_epi32(dx, zero)), dy);
        let start = _mm_sub_epi32(_mm_sub_epi32(start, _mm_set1_epi32(1)), kept);
        let across = _mm_sub_epi32(zero, _mm_slli_epi32::<8>(dy));
        let down = _mm_slli_epi32::<8>(dx);
        let edges = |of: __m128i| {
            [
                _mm256_broadcastd_epi32(of),
                _mm256_broadcastd_epi32(_mm_shuffle_epi32::<1>(of)),
                _mm256_broadcastd_epi32(_mm_shuffle_epi32::<2>(of)),
            ]
        };
        let (start, across, down) = (edges(start), edges(across), edges(down));
        let triangle = _mm256_set1_epi32(ready.triangle as i32);
        let (low, high) = (_mm256_set1_ps(plane.low), _mm256_set1_ps(plane.high));
        let mut lane = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
        let mut x = left;
        while x < right {
            let at = |i: usize| _mm256_add_epi32(start[i], _mm256_mullo_epi32(across[i], lane));
            let [mut at0, mut at1, mut at2] = [at(0), at(1), at(2)];
            let from =
                _mm256_add_epi32(_mm256_set1_epi32(centre(left) - ready.x[0]), _mm256_slli_epi32::<8>(lane));
            let slope = _mm256_mul_ps(_mm256_set1_ps(plane.along[0]), _mm256_cvtepi32_ps(from));
            let along = _mm256_add_ps(_mm256_set1_ps(ready.z[0]), slope);
            lane = _mm256_add_epi32(lane, _mm256_set1_epi32(LANES as i32));
            let mut y = centre(top) - ready.y[0];
            for row in &mut self.rows[top - self.top..bottom - self.top] {
                let column = x - self.left..x - self.left + LANES;
                let (depths, triangles, behind) =
                    (&mut row.depth[column.clone()], &mut row.triangle[column.clone()], &row.behind[column]);
                let outside = _mm256_or_si256(_mm256_or_si256(at0, at1), at2);
                let depth = _mm256_add_ps(along, _mm256_set1_ps(plane.along[1] * y as f32));
                // `numeric::order`'s max and min: the second operand is the value where they are equal.
                let depth = _mm256_min_ps(high, _mm256_max_ps(low, depth));
                #[expect(unsafe_code, reason = "vectors of eight values from slices of eight")]
                // SAFETY: each slice holds the 32 bytes that are read and written.
                unsafe {
                    let old = _mm256_loadu_ps(depths.as_ptr());
                    let whose = _mm256_loadu_si256(triangles.as_ptr().cast());
                    let farther = _mm256_cmp_ps::<_CMP_LT_OQ>(depth, _mm256_loadu_ps(behind.as_ptr()));
                    // triangle ≥ whose where their maximum is the triangle.
                    let not_lower = _mm256_cmpeq_epi32(_mm256_max_epu32(triangle, whose), triangle);
                    let tie = _mm256_andnot_ps(
                        _mm256_castsi256_ps(not_lower),
                        _mm256_cmp_ps::<_CMP_EQ_OQ>(depth, old),
                    );
                    let nearer = _mm256_or_ps(_mm256_cmp_ps::<_CMP_GT_OQ>(depth, old), tie);
                    let drawn = _mm256_castps_si256(_mm256_and_ps(nearer, farther));
                    // The sign is set outside.
                    let drawn = _mm256_andnot_si256(_mm256_srai_epi32::<31>(outside), drawn);
                    // Whole numbers are blended, since floats would become a masked store, which is slow on AMD.
                    let [old, depth] = [old, depth].map(|depth| _mm256_castps_si256(depth));
                    _mm256_storeu_si256(depths.as_mut_ptr().cast(), _mm256_blendv_epi8(old, depth, drawn));
                    let whose = _mm256_blendv_epi8(whose, triangle, drawn);
                    _mm256_storeu_si256(triangles.as_mut_ptr().cast(), whose);
                }
                at0 = _mm256_add_epi32(at0, down[0]);
                at1 = _mm256_add_epi32(at1, down[1]);
                at2 = _mm256_add_epi32(at2, down[2]);
                y += SUBPIXELS;
            }
            x += LANES;
        }
    }
}

/// Fills what the triangles of `runs` cover of a tile, whose number is `number`.
fn fill(tile: &mut Tile, runs: &[Run], number: usize) {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2")]
        fn avx2(tile: &mut Tile, runs: &[Run], number: usize) {
            tile.fill(runs, number, |tile, ready| tile.small_avx2(ready));
        }
        if std::arch::is_x86_feature_detected!("avx2") {
            #[expect(unsafe_code, reason = "the same function, for a processor that was just looked at")]
            // SAFETY: the processor has AVX2.
            return unsafe { avx2(tile, runs, number) };
        }
    }
    tile.fill(runs, number, Tile::small);
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
    fn new(ready: &Ready) -> Option<Self> {
        let ([x0, x1, x2], [y0, y1, y2], [z0, z1, z2]) = (ready.x, ready.y, ready.z);
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
    fn depth(&self, ready: &Ready, x: i32, y: i32) -> f32 {
        let depth =
            ready.z[0] + self.along[0] * (x - ready.x[0]) as f32 + self.along[1] * (y - ready.y[0]) as f32;
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
fn centre(pixel: usize) -> i32 {
    pixel as i32 * SUBPIXELS + SUBPIXELS / 2
}
