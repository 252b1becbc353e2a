//! Which pixels a triangle covers, decided exactly: the oracle for the rasterizer's top-left rule.
//!
//! Coordinates are integers in 1/256 pixel with x rightwards and y downwards, so pixel (px, py)
//! has its centre at (256 px + 128, 256 py + 128). Arithmetic is in `i128`; every coordinate must
//! lie within ±2⁶⁰.

/// One pixel in the units of the snapped coordinates.
pub const SUBPIXELS: i64 = 256;

/// A coordinate in pixels, snapped to the nearest 1/256 pixel, halves to the even multiple.
///
/// `x` must be finite and |x| < 2⁴⁴ pixels: beyond that an `f64` has no fraction left to snap.
pub fn snap_half_even(x: f64) -> i64 {
    let scaled = x * SUBPIXELS as f64; // exact: a power of two
    let below = scaled.floor();
    // Exact but for −0.5 < scaled < 0, where it may round up to 1 or down to 0.5: both lead to 0.
    let rest = scaled - below;
    let below = below as i64;
    if rest > 0.5 || (rest == 0.5 && below % 2 != 0) { below + 1 } else { below }
}

/// The sign of the edge function of a → b at the pixel centre `p` moved by (+ε, +ε²) for an
/// infinitesimal ε > 0: the value at p decides, else its x derivative, else its y derivative. It is
/// 0 for an edge without length alone.
fn side(a: [i64; 2], b: [i64; 2], p: [i128; 2]) -> i128 {
    let [ax, ay] = a.map(i128::from);
    let [bx, by] = b.map(i128::from);
    let value = (bx - ax) * (p[1] - ay) - (by - ay) * (p[0] - ax);
    if value != 0 {
        value.signum()
    } else if by != ay {
        (ay - by).signum()
    } else {
        (bx - ax).signum()
    }
}

/// Whether the triangle covers pixel (px, py) under the top-left rule.
///
/// A centre on an edge belongs to the triangle on its right, or below it where the edge is
/// horizontal. Moving every centre by (+ε, +ε²) says just that, and puts no centre on any edge: so
/// triangles that tile a region cover each centre once, whatever their number and orientation.
/// Both orientations count; a triangle without area covers nothing.
pub fn covers(triangle: [[i64; 2]; 3], px: i64, py: i64) -> bool {
    let centre = [px, py].map(|c| i128::from(c) * i128::from(SUBPIXELS) + i128::from(SUBPIXELS / 2));
    let [a, b, c] = triangle;
    let sides = [side(a, b, centre), side(b, c, centre), side(c, a, centre)];
    // Three equal signs cannot happen on a triangle without area: its edge functions sum to that
    // area, at the moved centre too.
    sides == [1; 3] || sides == [-1; 3]
}

/// All pixels of a width × height image that the triangle covers, as (px, py), row by row.
pub fn covered_pixels(triangle: [[i64; 2]; 3], width: i64, height: i64) -> Vec<(i64, i64)> {
    let mut pixels = Vec::new();
    for py in 0..height {
        for px in 0..width {
            if covers(triangle, px, py) {
                pixels.push((px, py));
            }
        }
    }
    pixels
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How many of the triangles cover each pixel of an n × n image.
    fn counts(triangles: &[[[i64; 2]; 3]], n: i64) -> Vec<u32> {
        let mut counts = vec![0; (n * n) as usize];
        for &t in triangles {
            for (px, py) in covered_pixels(t, n, n) {
                counts[(py * n + px) as usize] += 1;
            }
        }
        counts
    }

    #[test]
    fn snapping_rounds_halves_to_even() {
        let unit = 1.0 / 256.0;
        for (x, expected) in [
            (0.0, 0),
            (0.5, 0),
            (1.5, 2),
            (2.5, 2),
            (-0.5, 0),
            (-1.5, -2),
            (-2.5, -2),
            (0.75, 1),
            (-0.75, -1),
            (0.49999, 0),
            (0.5f64.next_down(), 0),
            (0.5f64.next_up(), 1),
            ((-0.5f64).next_down(), -1),
            ((-0.5f64).next_up(), 0),
            (-1e-30, 0),
            (1e9 + 0.5, 1_000_000_000),
        ] {
            assert_eq!(snap_half_even(x * unit), expected, "{x}/256");
        }
    }

    #[test]
    fn the_rule_is_top_left() {
        // A square whose four borders pass through pixel centres keeps its top row and left column.
        let (low, high) = (2 * 256 + 128, 5 * 256 + 128);
        let square = [[[low, low], [high, low], [high, high]], [[low, low], [high, high], [low, high]]];
        let counts = counts(&square, 8);
        for py in 0..8 {
            for px in 0..8 {
                let inside = (2..5).contains(&px) && (2..5).contains(&py);
                assert_eq!(counts[py * 8 + px], u32::from(inside), "({px}, {py})");
            }
        }
    }

    /// Quads with every corner a multiple of half a pixel, in the eight symmetries of the square,
    /// both diagonals and both orientations: a mesh covers each centre of its box once.
    #[test]
    fn a_mesh_of_quads_covers_each_pixel_once() {
        let n = 6; // pixels
        let size = n * 256;
        for symmetry in 0..8 {
            for diagonal in 0..4 {
                for step in [128, 256, 384] {
                    let place = |x: i64, y: i64| {
                        let (x, y) = if symmetry & 1 == 0 { (x, y) } else { (y, x) };
                        let x = if symmetry & 2 == 0 { x } else { size - x };
                        [x, if symmetry & 4 == 0 { y } else { size - y }]
                    };
                    let mut triangles = Vec::new();
                    for j in 0..size / step {
                        for i in 0..size / step {
                            let (x0, y0) = (i * step, j * step);
                            let (x1, y1) = (x0 + step, y0 + step);
                            let [p, q, r, s] = [place(x0, y0), place(x1, y0), place(x1, y1), place(x0, y1)];
                            triangles.extend(match diagonal {
                                0 => [[p, q, r], [p, r, s]],
                                1 => [[p, q, s], [q, r, s]],
                                2 => [[r, q, p], [p, r, s]],
                                _ => [[s, q, p], [q, r, s]],
                            });
                        }
                    }
                    assert!(counts(&triangles, n).iter().all(|&c| c == 1), "{symmetry} {diagonal} {step}");
                }
            }
        }
    }

    /// A sheared mesh: interior corners are displaced by odd amounts and by pixel multiples, so
    /// that edges run through centres at many slopes.
    #[test]
    fn a_sheared_mesh_covers_each_pixel_once() {
        let corner = |i: i64, j: i64| {
            let border = i == 0 || j == 0 || i == 4 || j == 4;
            let shift =
                if border { [0, 0] } else { [(i * 77 + j * 128) % 300 - 150, (i * 128 - j * 53) % 200] };
            [i * 512 + shift[0], j * 512 + shift[1]]
        };
        let mut triangles = Vec::new();
        for j in 0..4 {
            for i in 0..4 {
                let (p, q, r, s) = (corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1));
                triangles.extend([[p, q, r], [s, r, p]]);
            }
        }
        assert!(counts(&triangles, 8).iter().all(|&c| c == 1));
    }

    #[test]
    fn a_fan_around_a_pixel_centre_covers_each_pixel_once() {
        let centre = [5 * 256 + 128; 2];
        let (low, mid, high) = (128, 5 * 256 + 128, 10 * 256 + 128);
        let eight = [
            [low, low],
            [mid, low],
            [high, low],
            [high, mid],
            [high, high],
            [mid, high],
            [low, high],
            [low, mid],
        ];
        let four = [[low, low], [high, low], [high, high], [low, high]];
        for ring in [&eight[..], &four[..]] {
            for reversed in [false, true] {
                let mut fan = Vec::new();
                for (i, &a) in ring.iter().enumerate() {
                    let b = ring[(i + 1) % ring.len()];
                    fan.push(if reversed { [centre, b, a] } else { [centre, a, b] });
                }
                let counts = counts(&fan, 11);
                for py in 0..11 {
                    for px in 0..11 {
                        let inside = px < 10 && py < 10;
                        assert_eq!(counts[py * 11 + px], u32::from(inside), "({px}, {py})");
                    }
                }
            }
        }
    }

    #[test]
    fn no_area_covers_nothing() {
        for line in [[[0, 0], [512, 512], [1024, 1024]], [[128, 128]; 3], [[0, 128], [900, 128], [300, 128]]]
        {
            assert_eq!(covered_pixels(line, 4, 4), []);
        }
    }
}
