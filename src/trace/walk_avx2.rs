//! The twin of `walk::portable` with AVX2: eight boxes or triangles at a time, four in `f64`, and the same
//! bits.

use super::node::{BLOCK_TRIANGLES, BLOCK_VERTICES, Block, Node, Parts, WIDTH};
use super::triangle::{PADDING, Slabs};
use super::walk::{self, Best, Entered, Sight};
use super::{Hit, Ray};
use std::arch::x86_64::*;

/// Doubles are tested four at a time.
const HALF: usize = WIDTH / 2;

/// `Bvh::nearest` with eight lanes.
#[target_feature(enable = "avx2")]
pub(super) fn nearest(parts: &Parts, ray: &Ray) -> Option<Hit> {
    walk::nearest(
        parts,
        ray,
        |node, slabs, most| enter::<true>(parts, node, slabs, most),
        |near| least(near),
        |near, lane| without(near, lane),
        |block, sight, best| meet(block, sight, best),
    )
}

/// `Bvh::blocked` with eight lanes.
#[target_feature(enable = "avx2")]
pub(super) fn blocked(parts: &Parts, ray: &Ray) -> bool {
    walk::blocked(
        parts,
        ray,
        |node, slabs, most| enter::<false>(parts, node, slabs, most),
        |block, sight, best| meet(block, sight, best),
    )
}

/// `Slabs::interval` of eight boxes; `planes` gives their first and second planes along an axis. Before the
/// two ends comes a mask: all ones for each box that the ray enters, at most at `most`.
#[target_feature(enable = "avx2")]
#[inline]
fn intervals(slabs: &Slabs, most: f32, planes: impl Fn(usize) -> [__m256; 2]) -> (__m256, __m256, __m256) {
    let (mut near, mut far) = (_mm256_setzero_ps(), _mm256_set1_ps(f32::INFINITY));
    for axis in 0..3 {
        let at = |plane: __m256| {
            let from = _mm256_sub_ps(plane, _mm256_set1_ps(slabs.origin[axis]));
            _mm256_mul_ps(from, _mm256_set1_ps(slabs.inverse[axis]))
        };
        let [first, second] = planes(axis);
        // As `numeric::order`'s max and min: the result is the second operand where one is not a number.
        near = _mm256_max_ps(at(first), near);
        far = _mm256_min_ps(at(second), far);
    }
    let near = _mm256_mul_ps(near, _mm256_set1_ps(1.0 - PADDING));
    let far = _mm256_mul_ps(far, _mm256_set1_ps(1.0 + PADDING));
    let met = _mm256_and_ps(
        _mm256_cmp_ps::<_CMP_LE_OQ>(near, far),
        _mm256_cmp_ps::<_CMP_LE_OQ>(near, _mm256_set1_ps(most)),
    );
    (met, near, far)
}

/// Tests a ray against the boxes of a node, up to `most`. (`NEAREST` makes a copy for each walk, so that it
/// is inlined.)
#[target_feature(enable = "avx2")]
#[inline]
fn enter<const NEAREST: bool>(parts: &Parts, index: usize, slabs: &Slabs, most: f32) -> Entered<__m128i> {
    let node = &parts.nodes[index];
    let planes = |axis: usize| {
        let plane = |side: usize| {
            let steps = _mm_cvtsi64_si128(i64::from_le_bytes(node.steps[axis][side]));
            let steps = _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(steps));
            let along = _mm256_mul_ps(steps, _mm256_set1_ps(node.step[axis]));
            _mm256_add_ps(_mm256_set1_ps(node.origin[axis]), along)
        };
        let first = slabs.first[axis];
        [plane(first), plane(first ^ 1)]
    };
    let (met, near, _) = intervals(slabs, most, planes);
    let numbers = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    let there = _mm256_cmpgt_epi32(_mm256_set1_epi32(node.count() as i32), numbers);
    let met = _mm256_and_si256(_mm256_castps_si256(met), there);
    // All ones for other children.
    let near = _mm256_or_si256(_mm256_castps_si256(near), _mm256_xor_si256(met, _mm256_set1_epi32(-1)));
    let high = _mm256_srli_epi32::<16>(near);
    let near = _mm_packus_epi32(_mm256_castsi256_si128(high), _mm256_extracti128_si256::<1>(high));
    let mask = _mm256_movemask_ps(_mm256_castsi256_ps(met)) as u32;
    // Most children are visited, so the first and the last are prefetched while there is other work.
    fetch(parts, node, mask.trailing_zeros() as usize);
    fetch(parts, node, 31 - (mask | 1).leading_zeros() as usize);
    Entered { mask, near }
}

/// Prefetches the child at a place. Where there is none, the address is arbitrary.
#[target_feature(enable = "avx2")]
#[inline]
fn fetch(parts: &Parts, node: &Node, place: usize) {
    let inner = parts.nodes.as_ptr().wrapping_add(node.node(place)).cast::<i8>();
    let block = parts.blocks.as_ptr().wrapping_add(node.block(place)).cast::<i8>();
    let child = std::hint::select_unpredictable(place < node.inner(), inner, block);
    #[expect(unsafe_code, reason = "a hint")]
    #[allow(unused_unsafe, reason = "older compilers call it unsafe")]
    // SAFETY: any address may be prefetched.
    unsafe {
        _mm_prefetch::<_MM_HINT_T0>(child);
        _mm_prefetch::<_MM_HINT_T0>(child.wrapping_add(64));
    }
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

/// The coordinates along an axis of all first, second and third corners.
#[target_feature(enable = "avx2")]
#[inline]
fn corners(block: &Block, axis: usize) -> [__m256; 3] {
    let vertices: &[f32; BLOCK_VERTICES] = &block.vertices[axis];
    #[expect(unsafe_code, reason = "a vector of eight values")]
    // SAFETY: the array holds the 32 bytes that are read.
    let vertices = unsafe { _mm256_loadu_ps(vertices.as_ptr()) };
    [0, 1, 2].map(|corner| {
        let numbers = _mm256_set1_epi32((block.corners >> (3 * corner * BLOCK_TRIANGLES)) as i32);
        // The permutation reads the lowest three bits of each number.
        let numbers = _mm256_srlv_epi32(numbers, _mm256_setr_epi32(0, 3, 6, 9, 12, 15, 32, 32));
        _mm256_permutevar8x32_ps(vertices, numbers)
    })
}

/// Tests a ray against the triangles of a block.
#[target_feature(enable = "avx2")]
#[inline]
fn meet(block: &Block, sight: &Sight, best: &mut Best) {
    let planes = |axis: usize| {
        let [a, b, c] = corners(block, axis);
        // `triangle::ends`, with `numeric::order`'s min and max.
        let low = _mm256_min_ps(c, _mm256_min_ps(b, a));
        let high = _mm256_max_ps(c, _mm256_max_ps(b, a));
        // A blend picks by the sign.
        let flip = _mm256_set1_ps(sight.slabs.inverse[axis]);
        [_mm256_blendv_ps(low, high, flip), _mm256_blendv_ps(high, low, flip)]
    };
    let (met, near, far) = intervals(&sight.slabs, best.most, planes);
    let mask = _mm256_movemask_ps(met) as u32 & ((1 << block.count()) - 1);
    if mask == 0 {
        return;
    }
    let [x, y, z] = sight.shear.axes;
    let corners = [corners(block, x), corners(block, y), corners(block, z)];
    let (lower, upper) = (mask & ((1 << HALF) - 1), mask >> HALF);
    if lower != 0 {
        meet_half::<0>(block, lower, &corners, [near, far], sight, best);
    }
    if upper != 0 {
        meet_half::<1>(block, upper, &corners, [near, far], sight, best);
    }
}

/// `triangle::within` for the first or the second four triangles. `corners` has the coordinates along each of
/// the shear's axes.
#[target_feature(enable = "avx2")]
#[inline]
fn meet_half<const WHICH: i32>(
    block: &Block,
    mask: u32,
    corners: &[[__m256; 3]; 3],
    interval: [__m256; 2],
    sight: &Sight,
    best: &mut Best,
) {
    let Sight { shear, origin, .. } = sight;
    let corner = |corner: usize| {
        let wide = |axis: usize| _mm256_cvtps_pd(_mm256_extractf128_ps::<WHICH>(corners[axis][corner]));
        let (x, y, z) = (wide(0), wide(1), wide(2));
        let across = |value: __m256d, axis: usize| {
            let sheared = _mm256_sub_pd(value, _mm256_mul_pd(_mm256_set1_pd(shear.by[axis]), z));
            _mm256_sub_pd(sheared, _mm256_set1_pd(origin[axis]))
        };
        let along = _mm256_mul_pd(z, _mm256_set1_pd(shear.by[2]));
        [across(x, 0), across(y, 1), _mm256_sub_pd(along, _mm256_set1_pd(origin[2]))]
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
    let [near, far] = interval;
    let (near, far) = (_mm256_extractf128_ps::<WHICH>(near), _mm256_extractf128_ps::<WHICH>(far));
    let held = _mm_min_ps(far, _mm_max_ps(near, _mm256_cvtpd_ps(t)));
    let to = |from: __m128| {
        let mut to = [0.0; HALF];
        #[expect(unsafe_code, reason = "four values to an array of four")]
        // SAFETY: the array holds the 16 bytes that are written.
        unsafe {
            _mm_storeu_ps(to.as_mut_ptr(), from);
        }
        to
    };
    let t = to(held);
    let u = to(_mm256_cvtpd_ps(_mm256_div_pd(v, sum)));
    let v = to(_mm256_cvtpd_ps(_mm256_div_pd(w, sum)));
    let mut left = mask;
    while left != 0 {
        let lane = left.trailing_zeros() as usize % HALF;
        left &= left - 1;
        if t[lane] > 0.0 && t[lane] <= best.most {
            let triangle = block.triangles[(WHICH as usize * HALF + lane) % BLOCK_TRIANGLES];
            best.take(Hit { triangle, t: t[lane], u: u[lane], v: v[lane] });
        }
    }
}
