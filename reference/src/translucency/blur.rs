//! The Gaussian that filters the shadow map, Banterle and Chalmers, section 3.

/// The taps of the corrected filter of width n: (offset in texels, weight), 2⌊n/2⌋ + 1 of them
/// centred on the texel, with a standard deviation of n/4 texels and weights that sum to 1.
///
/// The paper's n = 8 gives nine taps: an even count would have no centre. n = 0 and n = 1 give the
/// one tap (0, 1), which filters nothing.
pub fn centred_taps(n: u32) -> Vec<(i64, f64)> {
    let reach = i64::from(n / 2);
    gaussian(n, -reach..=reach, 0.0)
}

/// The taps of the filter to the letter: n of them at −⌊n/2⌋ … n − 1 − ⌊n/2⌋ with the same standard
/// deviation, about their own middle. For the paper's even n = 8 the middle is −1/2: the depth is
/// shifted by half a texel. n = 0 is taken for n = 1, which filters nothing.
pub fn paper_taps(n: u32) -> Vec<(i64, f64)> {
    let first = -i64::from(n / 2);
    let last = first + i64::from(if n > 0 { n } else { 1 }) - 1;
    gaussian(n, first..=last, (first + last) as f64 / 2.0)
}

fn gaussian(n: u32, offsets: std::ops::RangeInclusive<i64>, middle: f64) -> Vec<(i64, f64)> {
    let sigma = f64::from(n) / 4.0;
    let mut taps = Vec::new();
    let mut sum = 0.0;
    for offset in offsets {
        let x = offset as f64 - middle;
        // n = 0 has one tap and no width
        let weight = if x == 0.0 { 1.0 } else { libm::exp(-x * x / (2.0 * sigma * sigma)) };
        taps.push((offset, weight));
        sum += weight;
    }
    for tap in &mut taps {
        tap.1 /= sum;
    }
    taps
}

/// The mean offset Σ offset · weight of a filter, in texels: how far it shifts an image.
pub fn shift(taps: &[(i64, f64)]) -> f64 {
    let mut sum = 0.0;
    for &(offset, weight) in taps {
        sum += offset as f64 * weight;
    }
    sum
}

/// A depth map filtered in both directions by the same taps to the letter, every texel alike; row-major,
/// `width` × `height`.
///
/// A texel without a surface holds 0, which stands for the `clear` value, as does what lies outside the map:
/// the filter mixes it in at silhouettes.
pub fn blur_as_printed(
    map: &[f64],
    width: usize,
    height: usize,
    taps: &[(i64, f64)],
    clear: f64,
) -> Vec<f64> {
    assert_eq!(map.len(), width * height, "the map is not width × height");
    let at = |x: i64, y: i64| -> f64 {
        let inside = x >= 0 && y >= 0 && (x as usize) < width && (y as usize) < height;
        let depth = if inside { map[y as usize * width + x as usize] } else { 0.0 };
        if depth == 0.0 { clear } else { depth }
    };
    let mut result = Vec::new();
    for y in 0..height as i64 {
        for x in 0..width as i64 {
            let mut depth = 0.0;
            for &(dy, wy) in taps {
                for &(dx, wx) in taps {
                    depth += wy * wx * at(x + dx, y + dy);
                }
            }
            result.push(depth);
        }
    }
    result
}

/// A depth map filtered in both directions by the same taps; row-major, `width` × `height`.
///
/// A texel without a surface holds 0, and takes no part: the result is Σ w d / Σ w over the taps
/// that lie in the map and hold a surface, and 0 where there is none. This is the plain double sum
/// over rows and columns; two separate passes that normalise in between would give another result
/// beside empty texels.
pub fn blur(map: &[f64], width: usize, height: usize, taps: &[(i64, f64)]) -> Vec<f64> {
    assert_eq!(map.len(), width * height, "the map is not width × height");
    let at = |x: i64, y: i64| -> f64 {
        let inside = x >= 0 && y >= 0 && (x as usize) < width && (y as usize) < height;
        if inside { map[y as usize * width + x as usize] } else { 0.0 }
    };
    let mut result = Vec::new();
    for y in 0..height as i64 {
        for x in 0..width as i64 {
            let (mut depth, mut total) = (0.0, 0.0);
            for &(dy, wy) in taps {
                for &(dx, wx) in taps {
                    let d = at(x + dx, y + dy);
                    if d != 0.0 {
                        depth += wy * wx * d;
                        total += wy * wx;
                    }
                }
            }
            result.push(if total > 0.0 { depth / total } else { 0.0 });
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_even_filter_shifts_by_half_a_texel() {
        let paper = paper_taps(8);
        assert_eq!((paper.len(), paper[0].0, paper[7].0), (8, -4, 3));
        assert!((shift(&paper) + 0.5).abs() < 1e-15, "{}", shift(&paper));
        let centred = centred_taps(8);
        assert_eq!((centred.len(), centred[0].0, centred[8].0), (9, -4, 4));
        assert!(shift(&centred).abs() < 1e-16);
        for taps in [paper, centred, centred_taps(0), centred_taps(1), paper_taps(1), centred_taps(7)] {
            assert!((taps.iter().map(|t| t.1).sum::<f64>() - 1.0).abs() < 1e-15);
        }
        assert_eq!(centred_taps(0), [(0, 1.0)]);
        assert_eq!(paper_taps(0), [(0, 1.0)]);
        assert_eq!(centred_taps(1), [(0, 1.0)]);
    }

    /// On a ramp the shift is visible as half a texel of depth; the centred filter keeps it.
    #[test]
    fn a_ramp_keeps_its_depth_under_the_centred_filter_alone() {
        let (w, h) = (20, 12);
        let map: Vec<f64> = (0..w * h).map(|k| 100.0 + (k % w) as f64).collect();
        let middle = 6 * w + 10;
        assert!((blur(&map, w, h, &centred_taps(8))[middle] - map[middle]).abs() < 1e-12);
        assert!((blur(&map, w, h, &paper_taps(8))[middle] - map[middle] + 0.5).abs() < 1e-12);
    }

    #[test]
    fn empty_texels_are_mixed_in_to_the_letter() {
        let (w, h) = (9, 7);
        let map: Vec<f64> = (0..w * h).map(|k| if k % w >= 5 { 3.5 } else { 0.0 }).collect();
        let result = blur_as_printed(&map, w, h, &paper_taps(2), 7.5);
        let column = |x: usize| result[3 * w + x];
        assert!((column(4) - 7.5).abs() < 1e-14 && (column(6) - 3.5).abs() < 1e-14);
        assert!((column(5) - 5.5).abs() < 1e-14, "half of each: {}", column(5));
        assert_eq!(blur_as_printed(&[0.0; 6], 3, 2, &paper_taps(1), 2.0), [2.0; 6]);
    }

    #[test]
    fn empty_texels_take_no_part() {
        let (w, h) = (9, 7);
        // a constant surface on the right half keeps its depth up to the silhouette and the border
        let map: Vec<f64> = (0..w * h).map(|k| if k % w >= 5 { 3.5 } else { 0.0 }).collect();
        let result = blur(&map, w, h, &centred_taps(4));
        for (k, d) in result.iter().enumerate() {
            if k % w >= 3 {
                assert!((d - 3.5).abs() < 1e-14, "texel {k}: {d}");
            } else {
                assert_eq!(*d, 0.0, "texel {k} has no surface in reach");
            }
        }
        assert_eq!(blur(&[0.0; 6], 3, 2, &centred_taps(8)), [0.0; 6]);
        assert_eq!(blur(&map, w, h, &centred_taps(0)), map);
    }
}
