//! Sine and cosine of a number of turns in plain arithmetic, so that a loop with them becomes vector
//! instructions. libm's are calls.

use super::lanes::WHOLE;
use std::f64::consts::TAU;

/// sin 2πt and cos 2πt, to 2 · 10⁻¹⁶, of any finite t. The difference of t from the nearest quarter turn is
/// exact, and the Taylor polynomials of degree 17 and 16 are closer than that up to an eighth of a turn.
#[inline(always)]
pub fn sin_cos(turns: f64) -> (f64, f64) {
    // Whole turns are taken off first, so that a huge number, which is nothing else, becomes 0.
    let turns = turns - ((turns + WHOLE) - WHOLE);
    let shifted = turns * 4.0 + WHOLE;
    let quarters = shifted.to_bits();
    let x = TAU * (turns - (shifted - WHOLE) * 0.25);
    let square = x * x;
    let (mut sin, mut cos) = (1.0, 1.0);
    for n in [16.0, 14.0, 12.0, 10.0, 8.0, 6.0, 4.0, 2.0] {
        sin = 1.0 - square * (1.0 / (n * (n + 1.0))) * sin;
        cos = 1.0 - square * (1.0 / (n * (n - 1.0))) * cos;
    }
    let sin = x * sin;
    let (s, c) = if quarters & 1 == 0 { (sin, cos) } else { (cos, sin) };
    let s = if quarters & 2 == 0 { s } else { -s };
    let c = if (quarters.wrapping_add(1)) & 2 == 0 { c } else { -c };
    (s, c)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::{double, random::unit};

    #[test]
    fn the_same_as_libm_and_exact_at_quarters() {
        for i in 0..100_000 {
            let turns = f64::from(unit(9, i, 0, 0)) * 4.0 - 2.0;
            let (sin, cos) = sin_cos(turns);
            let angle = TAU * turns;
            // The angle's own rounding: half an ULP of up to 4π.
            assert!((sin - double::sin(angle)).abs() < 2e-15, "{turns}");
            assert!((cos - double::cos(angle)).abs() < 2e-15, "{turns}");
            assert!((sin * sin + cos * cos - 1.0).abs() < 5e-16, "{turns}");
        }
        for (turns, expected) in [
            (0.0, (0.0, 1.0)),
            (0.25, (1.0, 0.0)),
            (0.5, (0.0, -1.0)),
            (0.75, (-1.0, 0.0)),
            (-0.25, (-1.0, 0.0)),
        ] {
            assert_eq!(sin_cos(turns), expected);
            assert_eq!(sin_cos(turns + 1000.0), expected);
        }
        assert_eq!(sin_cos(1e300), (0.0, 1.0));
    }
}
