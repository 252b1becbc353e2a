//! The twin of `hold::walk` with AVX-512: sixteen triangles are set up, and a triangle is held against
//! sixteen points, at a time.

use super::cells::{BLOCK_COLUMNS, Cells, Grid, Lanes};
use super::hold::{DEPTH_SLACK, SLACK, collect, decide};
use super::morton::{Bundle, LANES};
use crate::numeric::order::min;
use glam::Vec3;
use std::arch::x86_64::*;

/// The most triangles that wait to be held against points.
const ROOM: usize = 256;

/// As many points as the caches have room for; where there are more, they are prefetched.
const CACHED: usize = 1 << 17;

/// Triangles that may block something, one list for each of their numbers. No branch stands between two of
/// them, so a processor works on several at once.
#[repr(align(64))]
struct Queue {
    length: usize,
    /// The first corner, the edges from it to the second and to the third, twice the area, how far the edge
    /// functions may be off, and the depths beyond which no point is blocked and before which every point
    /// inside is. Edges and area are turned so that the area is not negative.
    numbers: [[f32; ROOM]; 10],
    /// The first cell, how many cells of a row, how many more rows of cells, the corners' places, and the
    /// triangle's number.
    cells: [[i32; ROOM]; 7],
}

/// `hold::walk` with sixteen lanes.
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
pub(super) fn walk<const COLLECT: bool>(bundle: &Bundle, grid: &Grid, direction: Vec3, cells: &mut Cells) {
    let mut queue = Queue { length: 0, numbers: [[0.0; ROOM]; 10], cells: [[0; ROOM]; 7] };
    for (group, triangles) in bundle.triangles.iter().enumerate() {
        prepare(triangles, group, grid, cells, &mut queue);
        if queue.length > ROOM - LANES {
            hold::<COLLECT>(bundle, grid, direction, cells, &mut queue);
        }
    }
    hold::<COLLECT>(bundle, grid, direction, cells, &mut queue);
}

/// The coordinates of sixteen places.
#[target_feature(enable = "avx512f,avx512dq")]
#[inline]
fn gather(places: &[u32; LANES], sheared: &[[f32; 4]]) -> [__m512; 3] {
    #[expect(unsafe_code, reason = "a vector of sixteen values")]
    // SAFETY: the array holds the 64 bytes that are read.
    let all = unsafe { _mm512_loadu_si512(places.as_ptr().cast()) };
    let count = _mm512_set1_epi32(sheared.len() as i32);
    assert!(_mm512_cmplt_epu32_mask(all, count) == u16::MAX, "places of the mesh");
    let place = |lane: usize| {
        #[expect(
            unsafe_code,
            reason = "vectors of four values, at places that were compared with the list's length"
        )]
        // SAFETY: the place is below the list's length.
        unsafe {
            _mm_loadu_ps(sheared.as_ptr().add(places[lane] as usize).cast())
        }
    };
    // Lanes n, n + 4, n + 8 and n + 12, four coordinates of each.
    let four = |lane: usize| {
        let low = _mm256_set_m128(place(lane + 4), place(lane));
        let high = _mm256_set_m128(place(lane + 12), place(lane + 8));
        _mm512_insertf32x8::<1>(_mm512_castps256_ps512(low), high)
    };
    let (a, b, c, d) = (four(0), four(1), four(2), four(3));
    let (xy, zw) = (_mm512_unpacklo_ps(a, b), _mm512_unpackhi_ps(a, b));
    let (more_xy, more_zw) = (_mm512_unpacklo_ps(c, d), _mm512_unpackhi_ps(c, d));
    [
        _mm512_shuffle_ps::<0b01_00_01_00>(xy, more_xy),
        _mm512_shuffle_ps::<0b11_10_11_10>(xy, more_xy),
        _mm512_shuffle_ps::<0b01_00_01_00>(zw, more_zw),
    ]
}

/// Sets sixteen triangles up and queues those that may block a point in their cells.
#[target_feature(enable = "avx512f,avx512dq")]
#[inline]
fn prepare(triangles: &[[u32; LANES]; 3], group: usize, grid: &Grid, cells: &Cells, queue: &mut Queue) {
    let [a, b, c] = [
        gather(&triangles[0], &cells.sheared),
        gather(&triangles[1], &cells.sheared),
        gather(&triangles[2], &cells.sheared),
    ];
    let least = |axis: usize| _mm512_min_ps(_mm512_min_ps(a[axis], b[axis]), c[axis]);
    let most = |axis: usize| _mm512_max_ps(_mm512_max_ps(a[axis], b[axis]), c[axis]);
    let (low, high) = ([least(0), least(1), least(2)], [most(0), most(1), most(2)]);
    // Places are above the grid's low end and not far beyond its high one.
    let cell = |axis: usize, of: __m512| {
        let from = _mm512_sub_ps(of, _mm512_set1_ps(grid.low[axis]));
        let cell = _mm512_cvttps_epi32(_mm512_mul_ps(from, _mm512_set1_ps(grid.per[axis])));
        _mm512_min_epi32(cell, _mm512_set1_epi32(grid.size[axis] as i32 - 1))
    };
    let [left, right, top, bottom] = [cell(0, low[0]), cell(0, high[0]), cell(1, low[1]), cell(1, high[1])];
    let behind = _mm512_add_ps(high[2], _mm512_set1_ps(DEPTH_SLACK));

    // A front says nothing of a triangle that is wider than a block or higher than a row.
    let wide =
        _mm512_cmpgt_epi32_mask(_mm512_sub_epi32(right, left), _mm512_set1_epi32(BLOCK_COLUMNS as i32));
    let tall = _mm512_cmpgt_epi32_mask(_mm512_sub_epi32(bottom, top), _mm512_set1_epi32(1));
    let one = _mm512_set1_epi32(1);
    let row = _mm512_mullo_epi32(_mm512_add_epi32(top, one), _mm512_set1_epi32(grid.blocks() as i32));
    let block = _mm512_srli_epi32::<{ BLOCK_COLUMNS.trailing_zeros() }>(left);
    let at = _mm512_add_epi32(row, _mm512_add_epi32(block, one));
    let count = _mm512_set1_epi32(cells.fronts.len() as i32);
    assert!(_mm512_cmplt_epu32_mask(at, count) == u16::MAX, "a front a block");
    #[expect(unsafe_code, reason = "sixteen values of a list")]
    // SAFETY: each place was just compared with the list's length.
    let fronts = unsafe { _mm512_i32gather_ps::<4>(at, cells.fronts.as_ptr()) };
    let kept = _mm512_cmp_ps_mask::<_CMP_LE_OQ>(fronts, behind) | wide | tall;

    let [ex, ey] = [_mm512_sub_ps(b[0], a[0]), _mm512_sub_ps(b[1], a[1])];
    let [fx, fy] = [_mm512_sub_ps(c[0], a[0]), _mm512_sub_ps(c[1], a[1])];
    let area = _mm512_sub_ps(_mm512_mul_ps(ex, fy), _mm512_mul_ps(ey, fx));
    let sign = _mm512_and_ps(area, _mm512_set1_ps(-0.0));
    let turned = |value: __m512| _mm512_xor_ps(value, sign);
    let size = _mm512_max_ps(_mm512_sub_ps(high[0], low[0]), _mm512_sub_ps(high[1], low[1]));
    let slack = _mm512_mul_ps(_mm512_add_ps(size, _mm512_set1_ps(grid.width)), _mm512_set1_ps(SLACK));
    let ahead = _mm512_sub_ps(low[2], _mm512_set1_ps(DEPTH_SLACK));
    let numbers =
        [a[0], a[1], turned(ex), turned(ey), turned(fx), turned(fy), turned(area), slack, behind, ahead];
    let first = queue.length;
    assert!(first <= ROOM - LANES, "room for sixteen");
    for (list, numbers) in queue.numbers.iter_mut().zip(numbers) {
        let packed = _mm512_maskz_compress_ps(kept, numbers);
        #[expect(unsafe_code, reason = "sixteen values to a list with room for them")]
        // SAFETY: the list holds the 64 bytes that are written.
        unsafe {
            _mm512_storeu_ps(list.as_mut_ptr().add(first), packed);
        }
    }
    let corner = |corner: usize| {
        #[expect(unsafe_code, reason = "a vector of sixteen values")]
        // SAFETY: the array holds the 64 bytes that are read.
        unsafe {
            _mm512_loadu_si512(triangles[corner].as_ptr().cast())
        }
    };
    // The cells of row r have the points of rows r and r + 1. They start at (r + 1) · columns, since row −1
    // comes first.
    let first_row = _mm512_mullo_epi32(_mm512_add_epi32(top, one), _mm512_set1_epi32(grid.size[0] as i32));
    let start = _mm512_add_epi32(first_row, left);
    let span = _mm512_add_epi32(_mm512_sub_epi32(right, left), one);
    let more = _mm512_srli_epi32::<1>(_mm512_sub_epi32(bottom, top));
    let lanes = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    let number = _mm512_add_epi32(_mm512_set1_epi32((group * LANES) as i32), lanes);
    let whole = [start, span, more, corner(0), corner(1), corner(2), number];
    for (list, numbers) in queue.cells.iter_mut().zip(whole) {
        let packed = _mm512_maskz_compress_epi32(kept, numbers);
        #[expect(unsafe_code, reason = "sixteen values to a list with room for them")]
        // SAFETY: the list holds the 64 bytes that are written.
        unsafe {
            _mm512_storeu_si512(list.as_mut_ptr().add(first).cast(), packed);
        }
    }
    queue.length += kept.count_ones() as usize;
}

/// Holds the triangles of the queue against the points in their cells, and empties it.
#[target_feature(enable = "avx512f,avx512dq")]
#[inline]
fn hold<const COLLECT: bool>(
    bundle: &Bundle,
    grid: &Grid,
    direction: Vec3,
    cells: &mut Cells,
    queue: &mut Queue,
) {
    let Cells { starts, lanes: Lanes { x, y, z, place }, pairs, .. } = cells;
    let Queue { length, numbers, cells } = queue;
    let (count, points) = (min(*length, ROOM), z.len());
    let (x, y, place) = (&x[..points], &y[..points], &place[..points]);
    let (starts, columns) = (starts.as_slice(), grid.size[0]);
    if points > CACHED {
        for item in 0..count {
            let at = starts[cells[0][item] as usize] as usize;
            for list in [x.as_ptr(), y.as_ptr(), z.as_ptr(), place.as_ptr().cast()] {
                #[expect(unsafe_code, reason = "a hint")]
                #[allow(unused_unsafe, reason = "older compilers call it unsafe")]
                // SAFETY: any address may be prefetched.
                unsafe {
                    _mm_prefetch::<_MM_HINT_T0>(list.wrapping_add(at).cast());
                }
            }
        }
    }
    for item in 0..count {
        let all = |number: usize| _mm512_set1_ps(numbers[number][item]);
        let [ax, ay, ex, ey, fx, fy, area, slack, behind, ahead] =
            [all(0), all(1), all(2), all(3), all(4), all(5), all(6), all(7), all(8), all(9)];
        let outside = _mm512_xor_ps(slack, _mm512_set1_ps(-0.0));
        let (mut start, span) = (cells[0][item] as usize, cells[1][item] as usize);
        let mut more = cells[2][item];
        loop {
            let mut at = starts[start] as usize;
            let end = starts[start + span] as usize;
            // Up to fifteen points of other cells, or lanes of padding, are tested as well; `SLACK` says why
            // that is right.
            loop {
                assert!(at + LANES <= points, "room after the last point");
                #[expect(unsafe_code, reason = "vectors of sixteen values")]
                // SAFETY: each list has the 64 bytes from `at` on.
                let (px, py, pz, own) = unsafe {
                    let of = |list: *const f32| _mm512_loadu_ps(list.add(at));
                    let own = _mm512_loadu_si512(place.as_ptr().add(at).cast());
                    (of(x.as_ptr()), of(y.as_ptr()), of(z.as_ptr()), own)
                };
                let (px, py) = (_mm512_sub_ps(px, ax), _mm512_sub_ps(py, ay));
                let u = _mm512_sub_ps(_mm512_mul_ps(px, fy), _mm512_mul_ps(py, fx));
                let v = _mm512_sub_ps(_mm512_mul_ps(py, ex), _mm512_mul_ps(px, ey));
                let w = _mm512_sub_ps(_mm512_sub_ps(area, u), v);
                let least = _mm512_min_ps(w, _mm512_min_ps(u, v));
                let mut may = _mm512_cmp_ps_mask::<_CMP_LE_OQ>(pz, behind);
                may = _mm512_mask_cmp_ps_mask::<_CMP_GE_OQ>(may, least, outside);
                for corner in 3..6 {
                    may = _mm512_mask_cmpneq_epi32_mask(may, own, _mm512_set1_epi32(cells[corner][item]));
                }
                if COLLECT {
                    collect(pairs, &place[at..], cells[6][item] as u32, u32::from(may));
                } else if may != 0 {
                    let must = _mm512_mask_cmp_ps_mask::<_CMP_GT_OQ>(may, least, slack);
                    let must = _mm512_mask_cmp_ps_mask::<_CMP_LT_OQ>(must, pz, ahead);
                    #[expect(unsafe_code, reason = "some of sixteen values")]
                    // SAFETY: the list holds the 64 bytes from `at` on that may be written.
                    unsafe {
                        _mm512_mask_storeu_ps(z.as_mut_ptr().add(at), must, _mm512_set1_ps(f32::NAN));
                    }
                    let doubtful = may & !must;
                    if doubtful != 0 {
                        let (place, z) = (&place[at..], &mut z[at..]);
                        decide_queued(bundle, place, z, direction, &cells[3..], item, u32::from(doubtful));
                    }
                }
                at += LANES;
                if at >= end {
                    break;
                }
            }
            if more <= 0 {
                break;
            }
            more -= 1;
            start += 2 * columns;
        }
    }
    *length = 0;
}

/// `decide` for a triangle of the queue, whose corners only this function reads one by one.
#[cold]
#[inline(never)]
fn decide_queued(
    bundle: &Bundle,
    place: &[u32],
    z: &mut [f32],
    direction: Vec3,
    corners: &[[i32; ROOM]],
    item: usize,
    doubtful: u32,
) {
    let triangle = [0, 1, 2].map(|corner| corners[corner][item] as u32);
    decide(bundle, place, z, direction, &triangle, doubtful);
}
