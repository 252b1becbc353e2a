//! The few vector operations that the equations need, on `[f64; 3]`.

/// A point, direction or RGB triple: x, y, z (or red, green, blue).
pub type Vec3 = [f64; 3];

/// a + b.
pub fn add(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// a − b.
pub fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// s · a.
pub fn scale(s: f64, a: Vec3) -> Vec3 {
    [s * a[0], s * a[1], s * a[2]]
}

/// a · b, summed from x to z.
pub fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a × b, right-handed.
pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The Euclidean length of a.
pub fn length(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

/// a / |a|; a must not be zero.
pub fn normalize(a: Vec3) -> Vec3 {
    let l = length(a);
    [a[0] / l, a[1] / l, a[2] / l]
}

/// An orthonormal right-handed frame (tangent, bitangent, axis) about the unit vector `axis`.
///
/// The first tangent is perpendicular to the world axis that `axis` leans on least, so the cross
/// product never degenerates; ties go to the lowest index.
pub fn frame(axis: Vec3) -> [Vec3; 3] {
    let mut least = 0;
    for i in 1..3 {
        if axis[i].abs() < axis[least].abs() {
            least = i;
        }
    }
    let mut least_axis = [0.0; 3];
    least_axis[least] = 1.0;
    let tangent = normalize(cross(least_axis, axis));
    [tangent, cross(axis, tangent), axis]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_right_handed_and_orthonormal() {
        for axis in [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.6, 0.0, -0.8], normalize([1.0, 1.0, 1.0])] {
            let [t, b, n] = frame(axis);
            for (u, v) in [(t, b), (b, n), (n, t)] {
                assert!(dot(u, v).abs() < 1e-15 && (length(u) - 1.0).abs() < 1e-15);
            }
            assert!((dot(cross(t, b), n) - 1.0).abs() < 1e-15);
        }
    }
}
