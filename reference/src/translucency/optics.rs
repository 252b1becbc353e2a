//! Fresnel, refraction and lights for Banterle and Chalmers, sections 2.1 and 2.2.

use crate::vector::{Vec3, add, dot, length, scale, sub};

/// The reflectance at normal incidence, F0 = ((η − 1)/(η + 1))², for the relative index η.
pub fn schlick_f0(eta: f64) -> f64 {
    let root = (eta - 1.0) / (eta + 1.0);
    root * root
}

/// The Fresnel reflectance of Schlick 1994: F0 + (1 − F0)(1 − c)⁵ with the cosine of incidence c
/// clamped to [0, 1].
pub fn schlick_reflectance(eta: f64, cosine: f64) -> f64 {
    let c = if cosine > 0.0 { cosine } else { 0.0 };
    let rest = if c < 1.0 { 1.0 - c } else { 0.0 };
    let f0 = schlick_f0(eta);
    f0 + (1.0 - f0) * (rest * rest * rest * rest * rest)
}

/// The transmittance F_t = 1 − F of Banterle and Chalmers, sections 2 and 2.1, by Schlick 1994.
pub fn schlick_transmittance(eta: f64, cosine: f64) -> f64 {
    1.0 - schlick_reflectance(eta, cosine)
}

/// The mean of Schlick's reflectance over the hemisphere, weighted by the cosine:
/// 2 ∫ F(c) c dc = F0 + (1 − F0)/21.
pub fn schlick_hemispherical_reflectance(eta: f64) -> f64 {
    let f0 = schlick_f0(eta);
    f0 + (1.0 - f0) / 21.0
}

/// The cosine at which Schlick's reflectance equals its hemispherical mean, 1 − 21^(−1/5): that of
/// a diffuse environment as a whole, the same for every η.
pub fn effective_diffuse_cosine() -> f64 {
    1.0 - libm::pow(21.0, -0.2)
}

/// The refraction vector r of Banterle and Chalmers, Eq. 5 and Eq. 10: the unit direction, pointing
/// into the object, of a view ray refracted by Snell's law at a surface with outward normal.
///
/// `view` is the unit direction in which the view ray travels, from the eye to the surface; η ≥ 1. Its
/// part along the surface is divided by η, and the rest goes against the normal: t/η − √(1 − |t|²/η²) n.
/// So the result is a unit vector that points inwards whatever the normal, also one that faces away.
pub fn refraction_vector(view: Vec3, normal: Vec3, eta: f64) -> Vec3 {
    let tangential = add(view, scale(-dot(view, normal), normal));
    let sine_squared = dot(tangential, tangential) / (eta * eta);
    let root = if sine_squared < 1.0 { (1.0 - sine_squared).sqrt() } else { 0.0 };
    add(scale(1.0 / eta, tangential), scale(-root, normal))
}

/// The irradiance of a point light at a surface point: I max(0, n · ω) / distance².
///
/// `intensity` is the radiant intensity I per steradian, the same in all directions; `normal` is a
/// unit vector; the light must not lie at the point.
pub fn point_light_irradiance(intensity: f64, light: Vec3, point: Vec3, normal: Vec3) -> f64 {
    let towards = sub(light, point);
    let distance = length(towards);
    let cosine = dot(normal, towards) / distance;
    if cosine > 0.0 { intensity * cosine / (distance * distance) } else { 0.0 }
}

/// The irradiance of a directional light at a surface point: E max(0, −n · ω).
///
/// `irradiance` is that on a plane facing the light; `travel` is the unit direction in which the
/// light travels; `normal` is a unit vector.
pub fn directional_light_irradiance(irradiance: f64, travel: Vec3, normal: Vec3) -> f64 {
    let cosine = -dot(normal, travel);
    if cosine > 0.0 { irradiance * cosine } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sh::gauss_legendre;
    use crate::vector::{cross, normalize};

    #[test]
    fn schlick_at_its_ends() {
        assert!((schlick_reflectance(1.5, 1.0) - 0.04).abs() < 1e-15);
        assert_eq!(schlick_reflectance(1.5, 0.0), 1.0);
        assert_eq!(schlick_reflectance(1.5, -0.4), 1.0);
        assert_eq!(schlick_reflectance(1.5, 1.0 + 1e-9), schlick_f0(1.5));
        assert_eq!(schlick_transmittance(1.3, 0.0), 0.0);
    }

    #[test]
    fn effective_cosine_gives_the_hemispherical_mean() {
        for eta in [1.0, 1.3, 1.5, 2.4] {
            let mut mean = 0.0;
            for (node, weight) in gauss_legendre(4) {
                let c = (node + 1.0) / 2.0;
                mean += weight * schlick_reflectance(eta, c) * c;
            }
            assert!((mean - schlick_hemispherical_reflectance(eta)).abs() < 1e-14);
            assert!((schlick_reflectance(eta, effective_diffuse_cosine()) - mean).abs() < 1e-14);
        }
        assert!((effective_diffuse_cosine() - 0.456_054).abs() < 5e-7, "{}", effective_diffuse_cosine());
    }

    #[test]
    fn refraction_obeys_snell() {
        let normal = normalize([0.2, 0.9, -0.3]);
        for eta in [1.0, 1.3, 1.5] {
            for view in [[0.0, -1.0, 0.0], [0.6, -0.8, 0.0], [-0.9, -0.3, 0.1]] {
                let view = normalize(view);
                let r = refraction_vector(view, normal, eta);
                assert!((length(r) - 1.0).abs() < 1e-15);
                assert!(dot(r, normal) < 0.0, "points inwards");
                // sines about the normal stand as 1 : 1/η and turn about the same axis
                let (a, b) = (cross(view, normal), cross(r, normal));
                assert!(length(sub(a, scale(eta, b))) < 1e-14);
            }
        }
        let straight = refraction_vector(scale(-1.0, normal), normal, 1.5);
        assert!(length(add(straight, normal)) < 1e-15);
    }

    #[test]
    fn refraction_at_grazing_and_averted_normals_is_a_unit_vector() {
        let normal = [0.0, 1.0, 0.0];
        let grazing = refraction_vector([1.0, 0.0, 0.0], normal, 1.5);
        assert!((grazing[0] - 1.0 / 1.5).abs() < 1e-15 && grazing[1] < 0.0);
        for (view, eta) in [([0.8, 0.6, 0.0], 1.3), (normal, 2f64.sqrt()), (normal, 1.0)] {
            assert!((length(refraction_vector(view, normal, eta)) - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn lights_fall_off_with_cosine_and_distance() {
        let up = [0.0, 1.0, 0.0];
        assert_eq!(point_light_irradiance(12.0, [0.0, 2.0, 0.0], [0.0; 3], up), 3.0);
        let slant = point_light_irradiance(1.0, [3.0, 4.0, 0.0], [0.0; 3], up);
        assert!((slant - 0.8 / 25.0).abs() < 1e-17);
        assert_eq!(point_light_irradiance(1.0, [0.0, -1.0, 0.0], [0.0; 3], up), 0.0);
        assert_eq!(directional_light_irradiance(2.0, [0.6, -0.8, 0.0], up), 1.6);
        assert_eq!(directional_light_irradiance(2.0, [0.6, 0.8, 0.0], up), 0.0);
    }
}
