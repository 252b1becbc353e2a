//! Lengths of vectors for loops that become vector instructions: glam's square root is libm's, a call.

use glam::Vec3;

/// The length of a vector.
#[inline(always)]
pub fn length(vector: Vec3) -> f32 {
    vector.dot(vector).sqrt()
}

/// A vector at length 1; zero where it has no direction or is too long or short for its length to be known.
#[inline(always)]
pub fn unit_or_zero(vector: Vec3) -> Vec3 {
    let shrunk = 1.0 / length(vector);
    if shrunk.is_finite() & (shrunk > 0.0) { vector * shrunk } else { Vec3::ZERO }
}

/// Two unit vectors that make a right-handed orthonormal frame with the unit vector `z`, which is its third
/// (Duff et al. 2017).
#[inline(always)]
pub fn frame(z: Vec3) -> [Vec3; 2] {
    let sign = if z.z < 0.0 { -1.0 } else { 1.0 };
    let a = -1.0 / (sign + z.z);
    let b = z.x * z.y * a;
    [Vec3::new(1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x), Vec3::new(b, sign + z.y * z.y * a, -z.y)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::random::unit;

    #[test]
    fn the_bits_are_glams() {
        let bits = |v: Vec3| v.to_array().map(f32::to_bits);
        for i in 0..10_000 {
            let scale = [1e-38, 1e-20, 1e-3, 1.0, 1e19, 1e38][i % 6];
            let v = Vec3::from_array([0, 1, 2].map(|k| (unit(3, i as u64, k, 0) * 2.0 - 1.0) * scale));
            assert_eq!(bits(unit_or_zero(v)), bits(v.normalize_or_zero()), "{v:?}");
            assert_eq!(length(v).to_bits(), v.length().to_bits());
        }
        assert_eq!(unit_or_zero(Vec3::ZERO), Vec3::ZERO);
    }

    #[test]
    fn frames_are_orthonormal_and_right_handed() {
        for i in 0..10_000 {
            let z = unit_or_zero(Vec3::from_array([0, 1, 2].map(|k| unit(4, i, k, 0) * 2.0 - 1.0)));
            for z in [z, Vec3::Z, Vec3::NEG_Z, Vec3::X] {
                let [x, y] = frame(z);
                assert!((x.cross(y) - z).length() < 3e-6 && (x.length() - 1.0).abs() < 3e-6, "{z}");
            }
        }
    }
}
