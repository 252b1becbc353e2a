//! The twin of `fill.rs` with AVX2. Triangles with edge functions of 32 bits are filled eight pixels of a row
//! at a time, with the bits of `fill::small`.

use super::SUBPIXELS;
use super::batch::Batch;
use super::fill::{batches, large, touch};
use super::setup::Sorted;
use super::tile::{LANES, Tile, centre};
use std::arch::x86_64::*;

/// `fill::fill` with eight lanes.
#[target_feature(enable = "avx2")]
pub(super) fn fill<const TWO: bool>(tile: &mut Tile, sorted: &Sorted<'_>, number: usize) {
    batches(tile, sorted, number, |tile, batch, lane| small::<TWO>(tile, batch, lane), large::<TWO>);
}

#[target_feature(enable = "avx2")]
#[inline]
fn small<const TWO: bool>(tile: &mut Tile, batch: &Batch, lane: usize) {
    let [left, top, right, bottom] = batch.part(lane);
    if right - left == 1 && bottom - top == 1 {
        // Where triangles are smaller than pixels, most boxes hold one centre.
        if batch.start[0][lane] | batch.start[1][lane] | batch.start[2][lane] >= 0 {
            touch::<TWO>(tile, batch, lane, left, top);
        }
        return;
    }
    let whole = |of: &[[i32; _]; 3]| [0, 1, 2].map(|i| _mm256_set1_epi32(of[i][lane]));
    let (start, across, down) = (whole(&batch.start), whole(&batch.across), whole(&batch.down));
    let (low, high) = (_mm256_set1_ps(batch.low[lane]), _mm256_set1_ps(batch.high[lane]));
    let triangle = _mm256_set1_epi32(batch.triangle[lane] as i32);
    let mut step = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    let mut column = left - tile.left;
    while column < right - tile.left {
        let at = |i: usize| _mm256_add_epi32(start[i], _mm256_mullo_epi32(across[i], step));
        let [mut at0, mut at1, mut at2] = [at(0), at(1), at(2)];
        let x = _mm256_set1_epi32(centre(left) - batch.x[0][lane]);
        let x = _mm256_cvtepi32_ps(_mm256_add_epi32(x, _mm256_slli_epi32::<8>(step)));
        let along = _mm256_mul_ps(_mm256_set1_ps(batch.along[0][lane]), x);
        let along = _mm256_add_ps(_mm256_set1_ps(batch.z[0][lane]), along);
        let mut y = centre(top) - batch.y[0][lane];
        for row in &mut tile.rows[top - tile.top..bottom - tile.top] {
            let depth = _mm256_add_ps(along, _mm256_set1_ps(batch.along[1][lane] * y as f32));
            // As `numeric::order`'s max and min: the result is the second operand where both are equal.
            let depth = _mm256_min_ps(high, _mm256_max_ps(low, depth));
            let outside = _mm256_srai_epi32::<31>(_mm256_or_si256(_mm256_or_si256(at0, at1), at2));
            let (depths, triangles, seconds) = (
                &mut row.depth[column..column + LANES],
                &mut row.triangle[column..column + LANES],
                &mut row.second[column..column + LANES],
            );
            #[expect(unsafe_code, reason = "vectors of eight values from slices of eight")]
            // SAFETY: each slice holds the 32 bytes that are read and written.
            unsafe {
                let old = _mm256_loadu_ps(depths.as_ptr());
                let whose = _mm256_loadu_si256(triangles.as_ptr().cast());
                // triangle ≥ whose where their maximum is the triangle.
                let not_lower = _mm256_cmpeq_epi32(_mm256_max_epu32(triangle, whose), triangle);
                let equal = _mm256_castps_si256(_mm256_cmp_ps::<_CMP_EQ_OQ>(depth, old));
                let nearer = _mm256_castps_si256(_mm256_cmp_ps::<_CMP_GT_OQ>(depth, old));
                let nearer = _mm256_or_si256(nearer, _mm256_andnot_si256(not_lower, equal));
                let drawn = _mm256_andnot_si256(outside, nearer);
                if TWO {
                    let second = _mm256_loadu_ps(seconds.as_ptr());
                    let candidate = _mm256_max_ps(_mm256_min_ps(old, depth), second);
                    let kept = _mm256_castsi256_ps(_mm256_or_si256(outside, equal));
                    blend(seconds, candidate, second, _mm256_castps_si256(kept));
                }
                blend(depths, old, depth, drawn);
                let whose = _mm256_blendv_epi8(whose, triangle, drawn);
                _mm256_storeu_si256(triangles.as_mut_ptr().cast(), whose);
            }
            at0 = _mm256_add_epi32(at0, down[0]);
            at1 = _mm256_add_epi32(at1, down[1]);
            at2 = _mm256_add_epi32(at2, down[2]);
            y += SUBPIXELS;
        }
        step = _mm256_add_epi32(step, _mm256_set1_epi32(LANES as i32));
        column += LANES;
    }
}

/// Writes `a`, or `b` where the mask is set, to eight numbers. The blend is one of integers, since one of
/// floats would become a masked store, which is slow on AMD.
#[target_feature(enable = "avx2")]
#[inline]
fn blend(to: &mut [f32], a: __m256, b: __m256, mask: __m256i) {
    let blended = _mm256_blendv_epi8(_mm256_castps_si256(a), _mm256_castps_si256(b), mask);
    assert!(to.len() >= LANES);
    #[expect(unsafe_code, reason = "eight values to a slice of eight")]
    // SAFETY: the slice holds the 32 bytes that are written.
    unsafe {
        _mm256_storeu_si256(to.as_mut_ptr().cast(), blended);
    }
}
