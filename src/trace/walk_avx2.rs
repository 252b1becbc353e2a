//! The walk with eight boxes or triangles at a time, and four in `f64`: with the bits of `walk::portable`.

use super::build::Parts;
use super::bvh::{Block, Node, WIDTH};
use super::triangle::{PADDING, Slabs};
use super::walk::{self, Best, Entered, Sight};
use super::{Hit, Ray};
use std::arch::x86_64::*;

/// Half a vector: doubles are tested four at a time.
const HALF: usize = WIDTH / 2;

/// `Bvh::nearest` with eight lanes.
#[target_feature(enable = "avx2")]
pub(super) fn nearest(parts: &Parts, ray: &Ray) -> Option<Hit> {
    walk::nearest(
        parts,
        ray,
        |node, slabs, most| enter(node, slabs, most),
        |near| least(near),
        |near, lane| without(near, lane),
        |block, places, sight, best| meet(block, places, sight, best),
    )
}

/// `Bvh::blocked` with eight lanes.
#[target_feature(enable = "avx2")]
pub(super) fn blocked(parts: &Parts, ray: &Ray) -> bool {
    walk::blocked(
        parts,
        ray,
        |node, slabs, most| enter(node, slabs, most),
        |block, places, sight, best| meet(block, places, sight, best),
    )
}

#[target_feature(enable = "avx2")]
#[inline]
fn load(from: &[f32; WIDTH]) -> __m256 {
    #[expect(unsafe_code, reason = "a vector of eight values")]
    // SAFETY: the array holds the 32 bytes that are read.
    unsafe {
        _mm256_loadu_ps(from.as_ptr())
    }
}

/// `Slabs::interval` of eight boxes: their first and second planes of an axis by `planes`. A bit for each box that a ray is
/// in, up to `most`.
#[target_feature(enable = "avx2")]
#[inline]
fn intervals(slabs: &Slabs, most: f32, planes: impl Fn(usize) -> [__m256; 2]) -> (u32, __m256, __m256) {
    let (mut near, mut far) = (_mm256_setzero_ps(), _mm256_set1_ps(f32::INFINITY));
    for axis in 0..3 {
        let at = |plane: __m256| {
            let from = _mm256_sub_ps(plane, _mm256_set1_ps(slabs.origin[axis]));
            _mm256_mul_ps(from, _mm256_set1_ps(slabs.inverse[axis]))
        };
        let [first, second] = planes(axis);
        // `numeric::order`'s max and min: the second operand is the value where one is no number.
        near = _mm256_max_ps(at(first), near);
        far = _mm256_min_ps(at(second), far);
    }
    let near = _mm256_mul_ps(near, _mm256_set1_ps(1.0 - PADDING));
    let far = _mm256_mul_ps(far, _mm256_set1_ps(1.0 + PADDING));
    let met = _mm256_and_ps(
        _mm256_cmp_ps::<_CMP_LE_OQ>(near, far),
        _mm256_cmp_ps::<_CMP_LE_OQ>(near, _mm256_set1_ps(most)),
    );
    (_mm256_movemask_ps(met) as u32, near, far)
}

/// Tests a ray against the eight boxes of a node, up to `most`.
#[target_feature(enable = "avx2")]
#[inline]
fn enter(node: &Node, slabs: &Slabs, most: f32) -> Entered<__m128i> {
    let planes = |axis: usize| {
        let first = slabs.first[axis];
        [load(&node.bounds[axis][first]), load(&node.bounds[axis][first ^ 1])]
    };
    let (mask, near, far) = intervals(slabs, most, planes);
    let far = _mm256_min_ps(far, _mm256_set1_ps(most));
    let out = _mm256_castps_si256(_mm256_cmp_ps::<_CMP_NLE_UQ>(near, far));
    let high =
        _mm256_or_si256(_mm256_srli_epi32::<16>(_mm256_castps_si256(near)), _mm256_srli_epi32::<16>(out));
    let near = _mm_packus_epi32(_mm256_castsi256_si128(high), _mm256_extracti128_si256::<1>(high));
    Entered { mask, near }
}

#[target_feature(enable = "avx2")]
#[inline]
fn least(near: __m128i) -> (u16, usize) {
    let least = _mm_cvtsi128_si32(_mm_minpos_epu16(near)) as u32;
    (least as u16, (least >> 16) as usize)
}

#[target_feature(enable = "avx2")]
#[inline]
fn without(near: __m128i, lane: usize) -> __m128i {
    let is = _mm_cmpeq_epi16(_mm_setr_epi16(0, 1, 2, 3, 4, 5, 6, 7), _mm_set1_epi16(lane as i16));
    _mm_or_si128(near, is)
}

/// Tests a ray against those triangles of a block whose places have a bit.
#[target_feature(enable = "avx2")]
#[inline]
fn meet(block: &Block, places: u32, sight: &Sight, best: &mut Best) {
    let planes = |axis: usize| {
        let [a, b, c] = [0, 1, 2].map(|corner| load(&block.corners[corner][axis]));
        // `triangle::ends`, with `numeric::order`'s min and max.
        let low = _mm256_min_ps(c, _mm256_min_ps(b, a));
        let high = _mm256_max_ps(c, _mm256_max_ps(b, a));
        // Blends go by the sign.
        let flip = _mm256_set1_ps(sight.slabs.inverse[axis]);
        [_mm256_blendv_ps(low, high, flip), _mm256_blendv_ps(high, low, flip)]
    };
    let (mask, near, far) = intervals(&sight.slabs, best.most, planes);
    let mask = mask & places;
    if mask & 0xF != 0 {
        let interval = [_mm256_castps256_ps128(near), _mm256_castps256_ps128(far)];
        meet_half(block, 0, mask & 0xF, interval, sight, best);
    }
    if mask >> HALF != 0 {
        let interval = [_mm256_extractf128_ps::<1>(near), _mm256_extractf128_ps::<1>(far)];
        meet_half(block, HALF, mask >> HALF, interval, sight, best);
    }
}

/// `triangle::within` for four triangles.
#[target_feature(enable = "avx2")]
#[inline]
fn meet_half(block: &Block, half: usize, mask: u32, interval: [__m128; 2], sight: &Sight, best: &mut Best) {
    let (axes, by) = (sight.shear.axes, sight.shear.by.map(|by| _mm256_set1_pd(by)));
    let origin = sight.origin.map(|origin| _mm256_set1_pd(origin));
    let corner = |corner: usize| {
        let [x, y, z] = axes.map(|axis| {
            let values: &[f32; HALF] =
                block.corners[corner][axis][half..half + HALF].try_into().expect("four");
            #[expect(unsafe_code, reason = "a vector of four values")]
            // SAFETY: the array holds the 16 bytes that are read.
            let values = unsafe { _mm_loadu_ps(values.as_ptr()) };
            _mm256_cvtps_pd(values)
        });
        [
            _mm256_sub_pd(_mm256_sub_pd(x, _mm256_mul_pd(by[0], z)), origin[0]),
            _mm256_sub_pd(_mm256_sub_pd(y, _mm256_mul_pd(by[1], z)), origin[1]),
            _mm256_sub_pd(_mm256_mul_pd(z, by[2]), origin[2]),
        ]
    };
    let [a, b, c] = [corner(0), corner(1), corner(2)];
    let edge = |p: [__m256d; 3], q: [__m256d; 3]| {
        _mm256_sub_pd(_mm256_mul_pd(p[0], q[1]), _mm256_mul_pd(p[1], q[0]))
    };
    let [u, v, w] = [edge(c, b), edge(a, c), edge(b, a)];
    let zero = _mm256_setzero_pd();
    let negative = |x: __m256d| _mm256_cmp_pd::<_CMP_LT_OQ>(x, zero);
    let positive = |x: __m256d| _mm256_cmp_pd::<_CMP_GT_OQ>(x, zero);
    let negative = _mm256_or_pd(_mm256_or_pd(negative(u), negative(v)), negative(w));
    let positive = _mm256_or_pd(_mm256_or_pd(positive(u), positive(v)), positive(w));
    let mask = mask & !(_mm256_movemask_pd(_mm256_and_pd(negative, positive)) as u32);
    if mask == 0 {
        return;
    }
    let sum = _mm256_add_pd(_mm256_add_pd(u, v), w);
    let depth = _mm256_add_pd(_mm256_mul_pd(u, a[2]), _mm256_mul_pd(v, b[2]));
    let t = _mm256_div_pd(_mm256_add_pd(depth, _mm256_mul_pd(w, c[2])), sum);
    let mask = mask & _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_GT_OQ>(t, zero)) as u32;
    let held = _mm_min_ps(interval[1], _mm_max_ps(interval[0], _mm256_cvtpd_ps(t)));
    let to = |from: __m128| {
        let mut to = [0.0; HALF];
        #[expect(unsafe_code, reason = "four values to an array of four")]
        // SAFETY: the array holds the 16 bytes that are written.
        unsafe {
            _mm_storeu_ps(to.as_mut_ptr(), from);
        }
        to
    };
    let [t, u, v] =
        [held, _mm256_cvtpd_ps(_mm256_div_pd(v, sum)), _mm256_cvtpd_ps(_mm256_div_pd(w, sum))].map(to);
    let mut left = mask;
    while left != 0 {
        let lane = left.trailing_zeros() as usize & (HALF - 1);
        left &= left - 1;
        if t[lane] > 0.0 && t[lane] <= best.most {
            best.take(Hit { triangle: block.triangles[half + lane], t: t[lane], u: u[lane], v: v[lane] });
        }
    }
}
