//! Filling triangles of up to 64 pixels with vectors of eight, as [`Tile::draw`] fills them, with the same bits.

use super::SUBPIXELS;
use super::fill::{LANES, SMALL, Tile, centre};
use super::screen::Projected;
use std::arch::x86_64::*;

/// Fills triangles, each its index and corners.
#[target_feature(enable = "avx2")]
pub(super) fn fill<'a>(tile: &mut Tile, touching: impl Iterator<Item = (u32, [&'a Projected; 3])>) {
    // The tile's first and last pixels, as (x, y, x, y) of pixels.
    let [left, top] = [tile.left, tile.top].map(|pixel| pixel as i32);
    let least = _mm_setr_epi32(left, top, 0, 0);
    let most = _mm_setr_epi32(left + tile.width as i32, top + tile.height as i32, 0, 0);
    for (triangle, corners) in touching {
        let [a, b, c] = [vector(corners[0]), vector(corners[1]), vector(corners[2])];
        let low = _mm_min_epi32(_mm_min_epi32(a, b), c);
        let high = _mm_max_epi32(_mm_max_epi32(a, b), c);
        let reach = _mm_cmpgt_epi32(_mm_sub_epi32(high, low), _mm_set1_epi32(SMALL));
        if _mm_movemask_ps(_mm_castsi128_ps(reach)) & 0b11 != 0 {
            tile.draw(triangle, corners);
            continue;
        }
        // The part of the tile whose centres lie in the triangle's box, as `setup::pixels` has it.
        let first = _mm_srai_epi32::<8>(_mm_add_epi32(low, _mm_set1_epi32(SUBPIXELS / 2 - 1)));
        let last = _mm_srai_epi32::<8>(_mm_add_epi32(high, _mm_set1_epi32(SUBPIXELS / 2)));
        let (first, last) = (_mm_max_epi32(first, least), _mm_min_epi32(last, most));
        let from = [_mm_extract_epi32::<0>(first) as usize, _mm_extract_epi32::<1>(first) as usize];
        let to = [_mm_extract_epi32::<0>(last) as usize, _mm_extract_epi32::<1>(last) as usize];
        draw(tile, triangle, [a, b, c], from, to);
    }
}

#[target_feature(enable = "avx2")]
#[inline]
fn vector(vertex: &Projected) -> __m128i {
    _mm_setr_epi32(vertex[0], vertex[1], vertex[2], vertex[3])
}

/// Fills a triangle in the pixels `from` (x, y) up to `to`.
#[target_feature(enable = "avx2")]
#[inline]
fn draw(tile: &mut Tile, triangle: u32, [a, b, c]: [__m128i; 3], from: [usize; 2], to: [usize; 2]) {
    // x, y and z of the three corners.
    let (ab, cc) = (_mm_unpacklo_epi32(a, b), _mm_unpacklo_epi32(c, c));
    let (x, y) = (_mm_unpacklo_epi64(ab, cc), _mm_unpackhi_epi64(ab, cc));
    let z = _mm_castsi128_ps(_mm_unpacklo_epi64(_mm_unpackhi_epi32(a, b), _mm_unpackhi_epi32(c, c)));
    // Differences from each corner to the next: 0 to 1, 1 to 2, 2 to 0.
    let (dx, dy) = (_mm_sub_epi32(next(x), x), _mm_sub_epi32(next(y), y));
    let z_next = _mm_castsi128_ps(next(_mm_castps_si128(z)));
    let dz = _mm_sub_ps(z_next, z);
    // Twice the area: (x₁−x₀)(y₂−y₀) − (x₂−x₀)(y₁−y₀), with the differences of the first and the last edge.
    let crossed = _mm_mullo_epi32(dx, _mm_shuffle_epi32::<0b10>(dy));
    let area =
        _mm_extract_epi32::<2>(_mm_mullo_epi32(dx, _mm_shuffle_epi32::<0>(dy))) - _mm_cvtsi128_si32(crossed);
    if area == 0 {
        return;
    }
    let plane = Plane::new(dx, dy, dz, z, z_next, area);
    // The edge functions at the first centre, ≥ 0 inside, and their changes along x and y; where the area is negative the
    // edges run the other way round. `fill::kept` is dy < 1 where dx > 0 and dy < 0 elsewhere, −1 where true.
    let (zero, turn) = (_mm_setzero_si128(), _mm_set1_epi32(area >> 31));
    let (dx, dy) =
        (_mm_sub_epi32(_mm_xor_si128(dx, turn), turn), _mm_sub_epi32(_mm_xor_si128(dy, turn), turn));
    let kept = _mm_cmpgt_epi32(_mm_sub_epi32(zero, _mm_cmpgt_epi32(dx, zero)), dy);
    let start = _mm_sub_epi32(
        _mm_mullo_epi32(dx, _mm_sub_epi32(_mm_set1_epi32(centre(from[1])), y)),
        _mm_mullo_epi32(dy, _mm_sub_epi32(_mm_set1_epi32(centre(from[0])), x)),
    );
    let start = each(_mm_sub_epi32(_mm_sub_epi32(start, _mm_set1_epi32(1)), kept));
    let across = each(_mm_sub_epi32(zero, _mm_slli_epi32::<8>(dy)));
    let down = each(_mm_slli_epi32::<8>(dx));
    let triangle = _mm256_set1_epi32(triangle as i32);
    let [x0, y0] = [_mm_cvtsi128_si32(x), _mm_cvtsi128_si32(y)];
    let mut lane = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    let mut column = from[0] - tile.left;
    while column < to[0] - tile.left {
        let at = |i: usize| _mm256_add_epi32(start[i], _mm256_mullo_epi32(across[i], lane));
        let [mut at0, mut at1, mut at2] = [at(0), at(1), at(2)];
        let x = _mm256_add_epi32(_mm256_set1_epi32(centre(from[0]) - x0), _mm256_slli_epi32::<8>(lane));
        let along = _mm256_add_ps(plane.z, _mm256_mul_ps(plane.along_x, _mm256_cvtepi32_ps(x)));
        let mut y = centre(from[1]) - y0;
        for row in &mut tile.rows[from[1] - tile.top..to[1] - tile.top] {
            let slope = _mm256_mul_ps(plane.along_y, _mm256_set1_ps(y as f32));
            // `numeric::order`'s max and min: the second operand is the value where they are equal.
            let depth = _mm256_max_ps(plane.low, _mm256_add_ps(along, slope));
            let depth = _mm256_min_ps(plane.high, depth);
            let outside = _mm256_srai_epi32::<31>(_mm256_or_si256(_mm256_or_si256(at0, at1), at2));
            let (depths, triangles, behind) = (
                &mut row.depth[column..column + LANES],
                &mut row.triangle[column..column + LANES],
                &row.behind[column..column + LANES],
            );
            #[expect(unsafe_code, reason = "vectors of eight values from slices of eight")]
            // SAFETY: each slice holds the 32 bytes that are read and written.
            unsafe {
                let old = _mm256_loadu_ps(depths.as_ptr());
                let whose = _mm256_loadu_si256(triangles.as_ptr().cast());
                let farther = _mm256_cmp_ps::<_CMP_LT_OQ>(depth, _mm256_loadu_ps(behind.as_ptr()));
                // triangle ≥ whose where their maximum is the triangle.
                let not_lower = _mm256_cmpeq_epi32(_mm256_max_epu32(triangle, whose), triangle);
                let equal = _mm256_castps_si256(_mm256_cmp_ps::<_CMP_EQ_OQ>(depth, old));
                let nearer = _mm256_castps_si256(_mm256_cmp_ps::<_CMP_GT_OQ>(depth, old));
                let nearer = _mm256_or_si256(nearer, _mm256_andnot_si256(not_lower, equal));
                let drawn = _mm256_and_si256(nearer, _mm256_castps_si256(farther));
                let drawn = _mm256_andnot_si256(outside, drawn);
                // Whole numbers are blended, since floats would become a masked store, which is slow on AMD.
                let depth = _mm256_blendv_epi8(_mm256_castps_si256(old), _mm256_castps_si256(depth), drawn);
                _mm256_storeu_si256(depths.as_mut_ptr().cast(), depth);
                let whose = _mm256_blendv_epi8(whose, triangle, drawn);
                _mm256_storeu_si256(triangles.as_mut_ptr().cast(), whose);
            }
            at0 = _mm256_add_epi32(at0, down[0]);
            at1 = _mm256_add_epi32(at1, down[1]);
            at2 = _mm256_add_epi32(at2, down[2]);
            y += SUBPIXELS;
        }
        lane = _mm256_add_epi32(lane, _mm256_set1_epi32(LANES as i32));
        column += LANES;
    }
}

/// The depth of a triangle as a plane over the screen, each number eight times.
struct Plane {
    /// At the first corner.
    z: __m256,
    /// Its change along x and y a 1/256 pixel.
    along_x: __m256,
    along_y: __m256,
    /// The least and the greatest at a corner.
    low: __m256,
    high: __m256,
}

impl Plane {
    /// From the differences along the three edges. Those from the first corner to the last are the last edge's negated,
    /// which turns no rounding round.
    #[target_feature(enable = "avx2")]
    #[inline]
    fn new(dx: __m128i, dy: __m128i, dz: __m128, z: __m128, z_next: __m128, area: i32) -> Self {
        // dz₂ dy₀ − dz₀ dy₂ and dz₀ dx₂ − dz₂ dx₀ over the area.
        let (dx, dy) = (_mm_cvtepi32_ps(dx), _mm_cvtepi32_ps(dy));
        let first = _mm_unpacklo_ps(dy, _mm_movehl_ps(dx, dx)); // dy₀, dx₂
        let second = _mm_unpacklo_ps(_mm_movehl_ps(dy, dy), dx); // dy₂, dx₀
        let along = _mm_sub_ps(
            _mm_mul_ps(_mm_shuffle_ps::<0b0010>(dz, dz), first),
            _mm_mul_ps(_mm_shuffle_ps::<0b1000>(dz, dz), second),
        );
        let along = _mm_div_ps(along, _mm_set1_ps(area as f32));
        let third = _mm_movehl_ps(z, z);
        // min(min(z₀, z₁), z₂): the second operand where they are equal.
        let low = _mm_min_ps(third, _mm_min_ps(z_next, z));
        let high = _mm_max_ps(third, _mm_max_ps(z_next, z));
        Self {
            z: _mm256_broadcastss_ps(z),
            along_x: _mm256_broadcastss_ps(along),
            along_y: _mm256_broadcastss_ps(_mm_movehdup_ps(along)),
            low: _mm256_broadcastss_ps(low),
            high: _mm256_broadcastss_ps(high),
        }
    }
}

/// The next of three corners, in each lane; the fourth keeps its own.
#[target_feature(enable = "avx2")]
#[inline]
fn next(of: __m128i) -> __m128i {
    _mm_shuffle_epi32::<0b11_00_10_01>(of)
}

/// Each of the first three numbers, eight times.
#[target_feature(enable = "avx2")]
#[inline]
fn each(of: __m128i) -> [__m256i; 3] {
    [
        _mm256_broadcastd_epi32(of),
        _mm256_broadcastd_epi32(_mm_shuffle_epi32::<0b01>(of)),
        _mm256_broadcastd_epi32(_mm_shuffle_epi32::<0b10>(of)),
    ]
}
