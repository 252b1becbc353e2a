//! Holding a triangle against eight points at a time, as `bundle::eight` does, with the same bits.

use super::bundle::{Bundle, Cells, LANES, Sheared, Test, walk};
use glam::Vec3;
use std::arch::x86_64::*;

/// `bundle::look` with eight lanes.
#[target_feature(enable = "avx2")]
pub(super) fn look(bundle: &Bundle, frame: &Sheared, direction: Vec3, cells: &mut Cells) {
    walk(bundle, frame, direction, cells, |test, cells, at, count| eight(test, cells, at, count));
}

#[target_feature(enable = "avx2")]
#[inline]
fn eight(test: &Test, cells: &mut Cells, at: usize, count: usize) -> u32 {
    let (x, y, z) = (&cells.x[at..at + LANES], &cells.y[at..at + LANES], &mut cells.z[at..at + LANES]);
    let vertex = &cells.vertex[at..at + LANES];
    #[expect(unsafe_code, reason = "vectors of eight values from slices of eight")]
    // SAFETY: each slice holds the 32 bytes that are read.
    let (x, y, depth, vertex) = unsafe {
        (
            _mm256_loadu_ps(x.as_ptr()),
            _mm256_loadu_ps(y.as_ptr()),
            _mm256_loadu_ps(z.as_ptr()),
            _mm256_loadu_si256(vertex.as_ptr().cast()),
        )
    };
    let (px, py) = (_mm256_sub_ps(x, _mm256_set1_ps(test.a[0])), _mm256_sub_ps(y, _mm256_set1_ps(test.a[1])));
    let product = |a: __m256, b: f32| _mm256_mul_ps(a, _mm256_set1_ps(b));
    let u = _mm256_sub_ps(product(px, test.f[1]), product(py, test.f[0]));
    let v = _mm256_sub_ps(product(py, test.e[0]), product(px, test.e[1]));
    let w = _mm256_sub_ps(_mm256_sub_ps(_mm256_set1_ps(test.area), u), v);
    let least = _mm256_min_ps(w, _mm256_min_ps(u, v));
    let may = _mm256_and_ps(
        _mm256_cmp_ps::<_CMP_GE_OQ>(least, _mm256_set1_ps(-test.slack)),
        _mm256_cmp_ps::<_CMP_LE_OQ>(depth, _mm256_set1_ps(test.behind)),
    );
    let within =
        _mm256_cmpgt_epi32(_mm256_set1_epi32(count as i32), _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7));
    let may = _mm256_and_si256(_mm256_castps_si256(may), within);
    if _mm256_testz_si256(may, may) != 0 {
        return 0;
    }
    let corner = |number: usize| _mm256_cmpeq_epi32(vertex, _mm256_set1_epi32(test.corners[number] as i32));
    let own = _mm256_or_si256(_mm256_or_si256(corner(0), corner(1)), corner(2));
    let may = _mm256_andnot_si256(own, may);
    let must = _mm256_and_ps(
        _mm256_cmp_ps::<_CMP_GT_OQ>(least, _mm256_set1_ps(test.slack)),
        _mm256_cmp_ps::<_CMP_LT_OQ>(depth, _mm256_set1_ps(test.ahead)),
    );
    let must = _mm256_and_si256(_mm256_castps_si256(must), may);
    let marked = _mm256_or_si256(_mm256_castps_si256(depth), must);
    #[expect(unsafe_code, reason = "eight values to a slice of eight")]
    // SAFETY: the slice holds the 32 bytes that are written.
    unsafe {
        _mm256_storeu_si256(z.as_mut_ptr().cast(), marked);
    }
    _mm256_movemask_ps(_mm256_castsi256_ps(_mm256_andnot_si256(must, may))) as u32
}
