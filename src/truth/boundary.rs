//! A smooth boundary between two dielectrics: how much it reflects, and where the rest goes.

use glam::Vec3;

/// The reflectance of unpolarised light that meets the boundary at `cosine` ≥ 0 to its normal (Fresnel 1823);
/// 1 beyond the critical angle. `eta` is the index of the other side relative to that of this one.
pub fn fresnel(cosine: f32, eta: f32) -> f32 {
    let squared = 1.0 - (1.0 - cosine * cosine) / (eta * eta);
    if squared <= 0.0 {
        return 1.0;
    }
    let beyond = squared.sqrt();
    let across = (cosine - eta * beyond) / (cosine + eta * beyond);
    let along = (eta * cosine - beyond) / (eta * cosine + beyond);
    0.5 * (across * across + along * along)
}

/// The unit vector along which a ray goes on behind the boundary (Snell's law); none beyond the critical
/// angle. `direction` meets the boundary against the unit `normal`, and `eta` is the index behind relative to
/// that before.
pub fn refract(direction: Vec3, normal: Vec3, eta: f32) -> Option<Vec3> {
    let cosine = -direction.dot(normal);
    let tangential = (direction + normal * cosine) / eta;
    let squared = 1.0 - tangential.length_squared();
    (squared > 0.0).then(|| tangential - normal * squared.sqrt())
}

/// The direction in which a mirror with the unit `normal` sends `direction`.
pub(super) fn mirror(direction: Vec3, normal: Vec3) -> Vec3 {
    direction - normal * (2.0 * direction.dot(normal))
}
