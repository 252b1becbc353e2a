//! e^x in plain arithmetic, so that a loop with it becomes vector instructions. pxfm's is a call, and picks
//! among instructions at run time.

use super::lanes::WHOLE;

/// e^x, correctly rounded (every one of the 2³² inputs was compared with pxfm's: `--ignored` repeats that).
///
/// In `f64`: x = k ln 2 + r with a whole number k and |r| ≤ ½ ln 2, and the Taylor polynomial of degree 12 in
/// r, whose remainder is below 10⁻¹⁵ of the sum. The sum is rounded to `f32` once.
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    // The one input whose result lies too near to the middle between two `f32` for the sum's own rounding.
    if x == f32::from_bits(0xbbf0_edf1) {
        return f32::from_bits(0x3f7e_1fe8);
    }
    // Beyond these ends the result is 0 and infinity.
    let held = if x < -104.0 { -104.0 } else { x };
    let x = f64::from(if held > 89.0 { 89.0 } else { held });
    let shifted = x * std::f64::consts::LOG2_E + WHOLE;
    let k = shifted - WHOLE;
    // ln 2 in two parts, the first with so few bits that its product with k is exact.
    let r = (x - k * 6.931_471_803_691_238e-1) - k * 1.908_214_929_270_587_7e-10;
    let mut rest = 1.0 / 479_001_600.0;
    for factorial in [39_916_800.0, 3_628_800.0, 362_880.0, 40_320.0, 5_040.0, 720.0, 120.0, 24.0, 6.0, 2.0] {
        rest = rest * r + 1.0 / factorial;
    }
    let power = f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52);
    ((1.0 + (r + r * r * rest)) * power) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How many of the inputs with these bits come out other than pxfm's.
    fn different(bits: impl Iterator<Item = u32>) -> Vec<f32> {
        let same = |x: f32| {
            let (ours, theirs) = (exp(x), pxfm::f_expf(x));
            ours.to_bits() == theirs.to_bits() || (ours.is_nan() && theirs.is_nan())
        };
        bits.map(f32::from_bits).filter(|x| !same(*x)).collect()
    }

    #[test]
    fn exp_is_correctly_rounded() {
        assert_eq!(different((0..u32::MAX).step_by(1999)), [0.0; 0]);
        // Around every place where something changes.
        for middle in [0.0, -0.0, -104.0, 89.0, 88.722_84, -87.336_54, -103.278_93, -0.007_352_583_6] {
            let bits = f32::to_bits(middle);
            assert_eq!(different((0..4001).map(|i| bits.wrapping_add(i).wrapping_sub(2000))), [0.0; 0]);
        }
        let ends = [f32::INFINITY, f32::NEG_INFINITY, f32::NAN, f32::MAX, f32::MIN, 0.0, -0.0];
        assert_eq!(different(ends.map(f32::to_bits).into_iter()), [0.0; 0]);
    }

    #[test]
    #[ignore = "a minute in release"]
    fn exp_is_correctly_rounded_everywhere() {
        assert_eq!(different(0..=u32::MAX), [0.0; 0]);
    }
}
