//! The twin of `hold::walk` with AVX2, eight points at a time: what is certain there is certain here.

use super::cells::{BLOCK_COLUMNS, Cells, Grid, Lanes};
use super::hold::{DEPTH_SLACK, SLACK, collect, decide};
use super::morton::Bundle;
use glam::Vec3;
use std::arch::x86_64::*;

/// Triangles that are set up together, and points that one is held against at a time.
const LANES: usize = 8;

/// Eight triangles, one in each lane.
#[repr(align(32))]
#[derive(Default)]
struct Batch {
    /// The first corner, the edges from it to the second and to the third, twice the area, and how far the
    /// edge functions may be off. Edges and area are turned so that the area is not negative.
    numbers: [[f32; LANES]; 8],
    /// Depths beyond which no point is blocked, and before which every point inside is.
    depths: [[f32; LANES]; 2],
    /// First and last column, first and last row of the cells.
    cells: [[i32; LANES]; 4],
    /// The number of the first triangle.
    first: u32,
}

/// `hold::walk` with eight lanes.
#[target_feature(enable = "avx2")]
pub(super) fn walk<const COLLECT: bool>(bundle: &Bundle, grid: &Grid, direction: Vec3, cells: &mut Cells) {
    let mut batch = Batch::default();
    for [a, b, c] in &bundle.triangles {
        for ((a, b), c) in a.as_chunks().0.iter().zip(b.as_chunks().0).zip(c.as_chunks().0) {
            let mut left = prepare([a, b, c], grid, cells, &mut batch);
            while left != 0 {
                let lane = left.trailing_zeros() as usize & (LANES - 1);
                left &= left - 1;
                let triangle = [a[lane], b[lane], c[lane]];
                hold::<COLLECT>(bundle, grid, direction, cells, &batch, lane, &triangle);
            }
            batch.first += LANES as u32;
        }
    }
}

/// The coordinates of eight places.
#[target_feature(enable = "avx2")]
#[inline]
fn gather(places: &[u32; LANES], sheared: &[[f32; 4]]) -> [__m256; 3] {
    let place = |lane: usize| {
        let place: &[f32; 4] = &sheared[places[lane] as usize];
        #[expect(unsafe_code, reason = "a vector of four values")]
        // SAFETY: the array holds the 16 bytes that are read.
        unsafe {
            _mm_loadu_ps(place.as_ptr())
        }
    };
    let two = |lane: usize| _mm256_set_m128(place(lane + 4), place(lane));
    let [a, b, c, d] = [two(0), two(1), two(2), two(3)];
    let (xy, zw) = (_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
    let (more_xy, more_zw) = (_mm256_unpacklo_ps(c, d), _mm256_unpackhi_ps(c, d));
    [
        _mm256_shuffle_ps::<0b01_00_01_00>(xy, more_xy),
        _mm256_shuffle_ps::<0b11_10_11_10>(xy, more_xy),
        _mm256_shuffle_ps::<0b01_00_01_00>(zw, more_zw),
    ]
}

#[target_feature(enable = "avx2")]
#[inline]
fn store(to: &mut [f32; LANES], from: __m256) {
    #[expect(unsafe_code, reason = "eight values to an array of eight")]
    // SAFETY: the array holds the 32 bytes that are written.
    unsafe {
        _mm256_storeu_ps(to.as_mut_ptr(), from);
    }
}

#[target_feature(enable = "avx2")]
#[inline]
fn store_whole(to: &mut [i32; LANES], from: __m256i) {
    #[expect(unsafe_code, reason = "eight values to an array of eight")]
    // SAFETY: the array holds the 32 bytes that are written.
    unsafe {
        _mm256_storeu_si256(to.as_mut_ptr().cast(), from);
    }
}

/// Sets eight triangles up; returns a bit for each that may block a point in its cells.
#[target_feature(enable = "avx2")]
#[inline]
fn prepare([a, b, c]: [&[u32; LANES]; 3], grid: &Grid, cells: &Cells, batch: &mut Batch) -> u32 {
    let [a, b, c] = [gather(a, &cells.sheared), gather(b, &cells.sheared), gather(c, &cells.sheared)];
    let low = [0, 1, 2].map(|axis| _mm256_min_ps(_mm256_min_ps(a[axis], b[axis]), c[axis]));
    let high = [0, 1, 2].map(|axis| _mm256_max_ps(_mm256_max_ps(a[axis], b[axis]), c[axis]));
    // Places are above the grid's low end and not far beyond its high one.
    let cell = |axis: usize, of: &[__m256; 3]| {
        let from = _mm256_sub_ps(of[axis], _mm256_set1_ps(grid.low[axis]));
        let cell = _mm256_cvttps_epi32(_mm256_mul_ps(from, _mm256_set1_ps(grid.per[axis])));
        _mm256_min_epi32(cell, _mm256_set1_epi32(grid.size[axis] as i32 - 1))
    };
    let [left, right, top, bottom] = [cell(0, &low), cell(0, &high), cell(1, &low), cell(1, &high)];
    for (to, from) in batch.cells.iter_mut().zip([left, right, top, bottom]) {
        store_whole(to, from);
    }
    let edge = |to: &[__m256; 3], axis: usize| _mm256_sub_ps(to[axis], a[axis]);
    let (e, f) = ([edge(&b, 0), edge(&b, 1)], [edge(&c, 0), edge(&c, 1)]);
    let area = _mm256_sub_ps(_mm256_mul_ps(e[0], f[1]), _mm256_mul_ps(e[1], f[0]));
    let sign = _mm256_and_ps(area, _mm256_set1_ps(-0.0));
    let turned = |value: __m256| _mm256_xor_ps(value, sign);
    let size = _mm256_max_ps(_mm256_sub_ps(high[0], low[0]), _mm256_sub_ps(high[1], low[1]));
    let slack = _mm256_mul_ps(_mm256_add_ps(size, _mm256_set1_ps(grid.width)), _mm256_set1_ps(SLACK));
    let numbers = [a[0], a[1], turned(e[0]), turned(e[1]), turned(f[0]), turned(f[1]), turned(area), slack];
    for (to, from) in batch.numbers.iter_mut().zip(numbers) {
        store(to, from);
    }
    let behind = _mm256_add_ps(high[2], _mm256_set1_ps(DEPTH_SLACK));
    store(&mut batch.depths[0], behind);
    store(&mut batch.depths[1], _mm256_sub_ps(low[2], _mm256_set1_ps(DEPTH_SLACK)));

    // A front says nothing of a triangle that is wider than a block or higher than a row.
    let wide = _mm256_cmpgt_epi32(_mm256_sub_epi32(right, left), _mm256_set1_epi32(BLOCK_COLUMNS as i32));
    let wide = _mm256_or_si256(wide, _mm256_cmpgt_epi32(_mm256_sub_epi32(bottom, top), _mm256_set1_epi32(1)));
    let row = _mm256_mullo_epi32(
        _mm256_add_epi32(top, _mm256_set1_epi32(1)),
        _mm256_set1_epi32(grid.blocks() as i32),
    );
    let block = _mm256_srli_epi32::<{ BLOCK_COLUMNS.trailing_zeros() as i32 }>(left);
    let mut at = [0; LANES];
    store_whole(&mut at, _mm256_add_epi32(row, _mm256_add_epi32(block, _mm256_set1_epi32(1))));
    let fronts = at.map(|at| cells.fronts[at as usize]);
    #[expect(unsafe_code, reason = "a vector of eight values")]
    // SAFETY: the array holds the 32 bytes that are read.
    let fronts = unsafe { _mm256_loadu_ps(fronts.as_ptr()) };
    let before = _mm256_cmp_ps::<_CMP_LE_OQ>(fronts, behind);
    _mm256_movemask_ps(_mm256_or_ps(before, _mm256_castsi256_ps(wide))) as u32
}

/// Holds one triangle against the points in its cells.
#[target_feature(enable = "avx2")]
#[inline]
fn hold<const COLLECT: bool>(
    bundle: &Bundle,
    grid: &Grid,
    direction: Vec3,
    cells: &mut Cells,
    batch: &Batch,
    lane: usize,
    triangle: &[u32; 3],
) {
    let Cells { starts, lanes, pairs, .. } = cells;
    let all = |number: usize| _mm256_set1_ps(batch.numbers[number][lane]);
    let [ax, ay, ex, ey, fx, fy, area, slack] =
        [all(0), all(1), all(2), all(3), all(4), all(5), all(6), all(7)];
    let (behind, ahead) = (_mm256_set1_ps(batch.depths[0][lane]), _mm256_set1_ps(batch.depths[1][lane]));
    let own = [0, 1, 2].map(|number| _mm256_set1_epi32(triangle[number] as i32));
    let numbers = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    let [left, right, top, bottom] = [0, 1, 2, 3].map(|end| batch.cells[end][lane] as usize);
    // The cells of row r have the points of rows r and r + 1. They start at (r + 1) · columns, since row −1
    // comes first.
    let mut row = top + 1;
    loop {
        let start = row * grid.size[0];
        let mut at = starts[start + left] as usize;
        let end = starts[start + right + 1] as usize;
        while at < end {
            let [x, y, z, place] = load(lanes, at);
            let (px, py) = (_mm256_sub_ps(x, ax), _mm256_sub_ps(y, ay));
            let u = _mm256_sub_ps(_mm256_mul_ps(px, fy), _mm256_mul_ps(py, fx));
            let v = _mm256_sub_ps(_mm256_mul_ps(py, ex), _mm256_mul_ps(px, ey));
            let w = _mm256_sub_ps(_mm256_sub_ps(area, u), v);
            let least = _mm256_min_ps(w, _mm256_min_ps(u, v));
            let inside = _mm256_cmp_ps::<_CMP_GE_OQ>(_mm256_add_ps(least, slack), _mm256_setzero_ps());
            let before = _mm256_cmp_ps::<_CMP_LE_OQ>(z, behind);
            let counts = _mm256_cmpgt_epi32(_mm256_set1_epi32((end - at) as i32), numbers);
            let is = |number: usize| _mm256_cmpeq_epi32(_mm256_castps_si256(place), own[number]);
            let corners = _mm256_or_si256(_mm256_or_si256(is(0), is(1)), is(2));
            let may = _mm256_castps_si256(_mm256_and_ps(inside, before));
            let may = _mm256_and_si256(_mm256_andnot_si256(corners, counts), may);
            if COLLECT {
                let bits = _mm256_movemask_ps(_mm256_castsi256_ps(may)) as u32;
                collect(pairs, &lanes.place[at..], batch.first + lane as u32, bits);
            } else if _mm256_testz_si256(may, may) == 0 {
                let must = _mm256_and_ps(
                    _mm256_cmp_ps::<_CMP_GT_OQ>(least, slack),
                    _mm256_cmp_ps::<_CMP_LT_OQ>(z, ahead),
                );
                let must = _mm256_and_si256(_mm256_castps_si256(must), may);
                // All ones are not a number: every later comparison with it is false.
                let marked = _mm256_or_ps(z, _mm256_castsi256_ps(must));
                let z: &mut [f32; LANES] = (&mut lanes.z[at..at + LANES]).try_into().expect("eight values");
                store(z, marked);
                let doubtful = _mm256_movemask_ps(_mm256_castsi256_ps(_mm256_andnot_si256(must, may)));
                if doubtful != 0 {
                    let Lanes { place, z, .. } = lanes;
                    decide(bundle, &place[at..], &mut z[at..], direction, triangle, doubtful as u32);
                }
            }
            at += LANES;
        }
        row += 2;
        if row > bottom + 1 {
            break;
        }
    }
}

/// The sheared places and the numbers of eight points.
#[target_feature(enable = "avx2")]
#[inline]
fn load(lanes: &Lanes, at: usize) -> [__m256; 4] {
    let points = lanes.z.len();
    assert!(
        at + LANES <= points
            && lanes.x.len() == points
            && lanes.y.len() == points
            && lanes.place.len() == points
    );
    #[expect(unsafe_code, reason = "vectors of eight values")]
    // SAFETY: each list has the 32 bytes from `at` on.
    unsafe {
        [
            _mm256_loadu_ps(lanes.x.as_ptr().add(at)),
            _mm256_loadu_ps(lanes.y.as_ptr().add(at)),
            _mm256_loadu_ps(lanes.z.as_ptr().add(at)),
            _mm256_loadu_ps(lanes.place.as_ptr().add(at).cast()),
        ]
    }
}
