//! The dipole of Jensen et al. 2001, and the attenuation that stands in for Banterle and
//! Chalmers, Eq. 12.

use std::f64::consts::PI;

/// A homogeneous scattering medium in one colour channel. Coefficients are per unit of length
/// (millimetres in the published table), and every distance below is in that unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Medium {
    /// The reduced scattering coefficient σ'_s > 0, per unit of length.
    pub sigma_s_prime: f64,
    /// The absorption coefficient σ_a ≥ 0, per unit of length.
    pub sigma_a: f64,
    /// The relative index of refraction η ≥ 1.
    pub eta: f64,
}

impl Medium {
    /// The same medium with lengths in another unit: `factor` new units make one old unit (1000
    /// from metres to millimetres), so that coefficients are divided by it.
    pub fn with_unit(&self, factor: f64) -> Medium {
        Medium { sigma_s_prime: self.sigma_s_prime / factor, sigma_a: self.sigma_a / factor, eta: self.eta }
    }

    /// The reduced extinction coefficient σ'_t = σ'_s + σ_a, per unit of length.
    pub fn sigma_t_prime(&self) -> f64 {
        self.sigma_s_prime + self.sigma_a
    }

    /// The reduced albedo α' = σ'_s / σ'_t.
    pub fn alpha_prime(&self) -> f64 {
        self.sigma_s_prime / self.sigma_t_prime()
    }

    /// The effective extinction coefficient σ_tr = √(3 σ_a σ'_t), per unit of length.
    pub fn sigma_tr(&self) -> f64 {
        (3.0 * self.sigma_a * self.sigma_t_prime()).sqrt()
    }

    /// The diffuse Fresnel reflectance F_dr from inside, by the rational fit in Jensen et al. 2001.
    pub fn f_dr(&self) -> f64 {
        -1.440 / (self.eta * self.eta) + 0.710 / self.eta + 0.668 + 0.0636 * self.eta
    }

    /// The boundary's mismatch A = (1 + F_dr) / (1 − F_dr).
    pub fn a(&self) -> f64 {
        (1.0 + self.f_dr()) / (1.0 - self.f_dr())
    }

    /// The depth of the real source, z_r = 1 / σ'_t: one mean free path.
    pub fn z_r(&self) -> f64 {
        1.0 / self.sigma_t_prime()
    }

    /// The height of the virtual source above the surface, z_v = z_r (1 + 4A/3), positive.
    pub fn z_v(&self) -> f64 {
        self.z_r() * (1.0 + 4.0 * self.a() / 3.0)
    }

    /// The diffuse reflectance R_d at distance r along the surface, per unit of area; Jensen et al.
    /// 2001.
    ///
    /// The emergent flux is −D times the derivative of the fluence along the outward normal. The
    /// real source lies z_r below the surface, the virtual one, of opposite sign, z_v above it;
    /// the derivative changes sign with the side, so that both terms add, each led by its own
    /// height: z (σ_tr s + 1) e^{−σ_tr s} / s³. With z_r written out
    /// as 1/σ'_t the first term has that factor below the line; the second must not, or its unit is
    /// wrong.
    pub fn r_d(&self, r: f64) -> f64 {
        let term = |z: f64| {
            let s = (r * r + z * z).sqrt();
            let x = self.sigma_tr() * s;
            z * (x + 1.0) * libm::exp(-x) / (s * s * s)
        };
        self.alpha_prime() / (4.0 * PI) * (term(self.z_r()) + term(self.z_v()))
    }

    /// The total diffuse reflectance R_d of Jensen et al. 2001 in closed form:
    /// α'/2 (1 + e^{−4/3 A √(3(1 − α'))}) e^{−√(3(1 − α'))}, the integral of [`Medium::r_d`] over
    /// the plane.
    pub fn total_r_d(&self) -> f64 {
        let alpha = self.alpha_prime();
        // 1 − α' = σ_a / σ'_t, which does not cancel
        let root = (3.0 * self.sigma_a / self.sigma_t_prime()).sqrt();
        alpha / 2.0 * (1.0 + libm::exp(-4.0 / 3.0 * self.a() * root)) * libm::exp(-root)
    }

    /// The attenuation over thickness d that replaces the one of Banterle and Chalmers, Eq. 12;
    /// without unit.
    ///
    /// The irradiance is constant over a plane at distance d: attenuation(d) = 1/π · ∫ R_d(√(ρ² +
    /// d²)) 2πρ dρ. The substitution s² = ρ² + d² + z² makes each term the exact derivative of
    /// −e^{−σ_tr s}/s, so what is left is 1/π · α'/2 · Σ z e^{−σ_tr s}/s with s = √(d² + z²) for
    /// z = z_r and z_v. The 1/π is due because B of a constant irradiance E is πE: at d = 0 the
    /// product is R_d E, the dipole's own radiosity. A thickness below 0 counts as 0.
    pub fn attenuation(&self, d: f64) -> f64 {
        let d = if d > 0.0 { d } else { 0.0 };
        let term = |z: f64| {
            let s = (d * d + z * z).sqrt();
            z * libm::exp(-self.sigma_tr() * s) / s
        };
        self.alpha_prime() / (2.0 * PI) * (term(self.z_r()) + term(self.z_v()))
    }
}

/// ∫ f(ρ) 2πρ dρ over the whole plane for a smooth kernel that first varies on the length `scale`
/// and falls at least as fast as ρ⁻³: the truth for what has a closed form above, and for what has
/// none.
///
/// The trapezoidal rule in ln ρ, which converges exponentially, and which sees the mean free path
/// and the far longer reach of the diffusion alike; from e⁻²⁰ to e³⁶ times `scale` both rests are
/// below 10⁻¹⁵ of the integral.
pub fn plane_integral(f: impl Fn(f64) -> f64, scale: f64) -> f64 {
    let steps_per_unit = 16;
    let mut sum = 0.0;
    for i in -20 * steps_per_unit..=36 * steps_per_unit {
        let rho = scale * libm::exp(f64::from(i) / f64::from(steps_per_unit));
        sum += f(rho) * 2.0 * PI * rho * rho / f64::from(steps_per_unit);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables::{JENSEN_2001, material};

    fn each_medium() -> impl Iterator<Item = Medium> {
        JENSEN_2001.into_iter().flat_map(|m| [0, 1, 2].map(|c| m.medium(c)))
    }

    #[test]
    fn marble_green() {
        let m = material("Marble").unwrap().medium(1);
        assert!((m.sigma_tr() - 0.179_656).abs() < 1e-6, "{}", m.sigma_tr());
        assert!((m.total_r_d() - 0.790_960).abs() < 5e-7, "{}", m.total_r_d());
    }

    #[test]
    fn total_reflectance_is_the_integral_of_the_kernel() {
        for m in each_medium() {
            let quadrature = plane_integral(|r| m.r_d(r), m.z_v());
            assert!((quadrature - m.total_r_d()).abs() < 1e-13, "{m:?}: {quadrature} {}", m.total_r_d());
        }
    }

    #[test]
    fn attenuation_is_the_integral_of_the_kernel_over_a_plane_at_that_depth() {
        for m in each_medium() {
            for d in [0.0, 0.1, 1.0, 10.0] {
                let scale = (m.z_v() * m.z_v() + d * d).sqrt();
                let integral = plane_integral(|rho| m.r_d((rho * rho + d * d).sqrt()), scale) / PI;
                assert!((integral - m.attenuation(d)).abs() < 1e-13, "{m:?} at {d}");
            }
        }
    }

    #[test]
    fn attenuation_at_the_surface_is_the_reflectance_over_pi_and_falls_from_there() {
        for m in each_medium() {
            assert!((m.attenuation(0.0) - m.total_r_d() / PI).abs() < 1e-15);
            assert_eq!(m.attenuation(-3.0), m.attenuation(0.0));
            let mut last = m.attenuation(0.0);
            for i in 1..=60 {
                let next = m.attenuation(f64::from(i) * 0.25);
                assert!(next > 0.0 && next < last);
                last = next;
            }
        }
    }

    #[test]
    fn attenuation_does_not_depend_on_the_unit_of_length() {
        for m in each_medium() {
            let metres = m.with_unit(1e-3);
            for d in [0.0, 0.3, 4.0] {
                let ratio = metres.attenuation(d * 1e-3) / m.attenuation(d);
                assert!((ratio - 1.0).abs() < 1e-12, "{ratio}");
            }
        }
    }

    /// Diffusion without absorption loses nothing: Spectralon reflects all.
    #[test]
    fn no_absorption_reflects_everything() {
        let m = material("Spectralon").unwrap().medium(0);
        assert_eq!((m.sigma_tr(), m.total_r_d()), (0.0, 1.0));
    }
}
