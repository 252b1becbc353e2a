//! Minima, maxima and clamps as comparisons (contract 9): each says what it does with NaN and −0.

use glam::Vec3;

/// The smaller of `a` and `b`; `a` where they compare equal (so −0 and +0 keep the first) or where one is
/// NaN.
#[inline(always)]
pub fn min<T: PartialOrd>(a: T, b: T) -> T {
    if b < a { b } else { a }
}

/// The larger of `a` and `b`; `a` where they compare equal (so −0 and +0 keep the first) or where one is NaN.
#[inline(always)]
pub fn max<T: PartialOrd>(a: T, b: T) -> T {
    if b > a { b } else { a }
}

/// `x` held to `[low, high]`. A NaN stays a NaN; −0 at a bound of +0 stays −0.
#[inline(always)]
pub fn clamp<T: PartialOrd>(x: T, low: T, high: T) -> T {
    min(max(x, low), high)
}

/// [`min`] component by component.
#[inline]
pub fn min3(a: Vec3, b: Vec3) -> Vec3 {
    Vec3::new(min(a.x, b.x), min(a.y, b.y), min(a.z, b.z))
}

/// [`max`] component by component.
#[inline]
pub fn max3(a: Vec3, b: Vec3) -> Vec3 {
    Vec3::new(max(a.x, b.x), max(a.y, b.y), max(a.z, b.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_values_keep_the_first_and_nan_keeps_the_first() {
        assert_eq!(min(-0.0_f32, 0.0).to_bits(), (-0.0_f32).to_bits());
        assert_eq!(max(0.0_f32, -0.0).to_bits(), 0.0_f32.to_bits());
        assert_eq!(min(1.0_f32, f32::NAN), 1.0);
        assert!(max(f32::NAN, 1.0_f32).is_nan());
        assert_eq!(clamp(7.0_f32, 0.0, 1.0), 1.0);
        assert_eq!(clamp(-7.0_f32, 0.0, 1.0), 0.0);
    }
}
