//! The local frame of a vertex, in which BRDFs are given and incident radiance is expressed.

use glam::Vec3;

/// The frame of a unit normal, right-handed, with the rows tangent, bitangent and normal. Its product with a
/// direction of the world is this direction in the frame, where the normal is z.
///
/// The frame of +z is the world's own. For n_z ≥ 0 it is the turn that brings n to z the shortest way; below
/// that it is the turned frame of the mirrored normal (Duff et al. 2017). So it jumps across n_z = 0, which
/// no isotropic BRDF sees. The normal is first brought to length 1 in `f64`.
pub fn frame(normal: Vec3) -> [[f64; 3]; 3] {
    let [x, y, z] = normal.as_dvec3().normalize().to_array();
    let sign = if z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (sign + z);
    let b = x * y * a;
    [[1.0 + sign * x * x * a, sign * b, -sign * x], [b, sign + y * y * a, -y], [x, y, z]]
}
