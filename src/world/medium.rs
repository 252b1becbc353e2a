//! Translucent materials: homogeneous media under the dipole approximation (Jensen, Marschner, Levoy and
//! Hanrahan 2001).

use crate::numeric::double;
use crate::numeric::order::{clamp, max};
use crate::numeric::single::exp;

/// Name, reduced scattering coefficient σs', absorption coefficient σa (both RGB, per millimetre) and index
/// of refraction η of the materials measured by Jensen et al. 2001, their figure 5; η as that paper takes it.
pub const JENSEN_2001: [(&str, [f32; 3], [f32; 3], f32); 12] = [
    ("Apple", [2.29, 2.39, 1.97], [0.0030, 0.0034, 0.046], 1.3),
    ("Chicken1", [0.15, 0.21, 0.38], [0.015, 0.077, 0.19], 1.3),
    ("Chicken2", [0.19, 0.25, 0.32], [0.018, 0.088, 0.20], 1.3),
    ("Cream", [7.38, 5.47, 3.15], [0.0002, 0.0028, 0.0163], 1.3),
    ("Ketchup", [0.18, 0.07, 0.03], [0.061, 0.97, 1.45], 1.3),
    ("Marble", [2.19, 2.62, 3.00], [0.0021, 0.0041, 0.0071], 1.5),
    ("Potato", [0.68, 0.70, 0.55], [0.0024, 0.0090, 0.12], 1.3),
    ("Skimmilk", [0.70, 1.22, 1.90], [0.0014, 0.0025, 0.0142], 1.3),
    ("Skin1", [0.74, 0.88, 1.01], [0.032, 0.17, 0.48], 1.3),
    ("Skin2", [1.09, 1.59, 1.79], [0.013, 0.070, 0.145], 1.3),
    ("Spectralon", [11.6, 20.4, 14.9], [0.0, 0.0, 0.0], 1.3),
    ("Wholemilk", [2.55, 3.21, 3.77], [0.0011, 0.0024, 0.014], 1.3),
];

/// What the dipole of one colour channel is made of; lengths in the scene's unit, coefficients per that unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dipole {
    /// Reduced albedo α' = σs' / σt'.
    pub albedo: f32,
    /// Effective extinction coefficient σtr = √(3 σa σt').
    pub extinction: f32,
    /// Depth of the real source, z_r = 1 / σt'.
    pub real: f32,
    /// Height of the virtual source, z_v = z_r (1 + 4/3 A).
    pub virtual_: f32,
}

impl Dipole {
    /// The dipole of reduced scattering σs', absorption σa (per unit) and index of refraction η, after Jensen
    /// et al. 2001: A = (1 + F_dr) / (1 − F_dr), F_dr = −1.440/η² + 0.710/η + 0.668 + 0.0636 η.
    pub fn new(scattering: f64, absorption: f64, eta: f64) -> Self {
        let reduced = scattering + absorption;
        let diffuse_fresnel = -1.440 / (eta * eta) + 0.710 / eta + 0.668 + 0.0636 * eta;
        let a = (1.0 + diffuse_fresnel) / (1.0 - diffuse_fresnel);
        Self {
            albedo: (scattering / reduced) as f32,
            extinction: (3.0 * absorption * reduced).sqrt() as f32,
            real: (1.0 / reduced) as f32,
            virtual_: ((1.0 + 4.0 / 3.0 * a) / reduced) as f32,
        }
    }

    /// The total diffuse reflectance R_d of a half-space: what the plane integral of the dipole comes to.
    pub fn reflectance(&self) -> f32 {
        0.5 * self.albedo * (exp(-self.extinction * self.real) + exp(-self.extinction * self.virtual_))
    }

    /// The dipole's kernel R_d at distance `d` along the surface: the fraction of the flux that entered at a
    /// point which leaves there, per squared unit of length.
    ///
    /// Both distances are at least the sources' own depths (errata T3), so the kernel is bounded.
    pub fn kernel(&self, d: f32) -> f32 {
        let source = |z: f32| {
            let s = (d * d + z * z).sqrt();
            z * (self.extinction * s + 1.0) * exp(-self.extinction * s) / (s * s * s)
        };
        self.albedo * (0.25 * std::f32::consts::FRAC_1_PI) * (source(self.real) + source(self.virtual_))
    }

    /// The attenuation of Banterle and Chalmers, Eq. 12, to the letter, at thickness `d` > 0:
    /// (σ_tr d + 1) e^(−σ_tr d) / (σ'_t d³), per squared unit of length.
    ///
    /// It has neither the kernel's albedo and 1/4π nor its virtual source, and d itself where the kernel has
    /// the distance from the source, so it diverges at 0 (errata T3, T11).
    #[inline(always)]
    pub fn as_printed(&self, d: f32) -> f32 {
        let x = self.extinction * d;
        self.real * ((x + 1.0) * exp(-x) / (d * d * d))
    }

    /// The kernel integrated over a plane at distance `d`: the fraction of an even irradiance on one side of
    /// a wall that leaves on the other; [`Self::reflectance`] at d = 0. A number without a unit.
    ///
    /// ∫ R_d(√(ρ² + d²)) 2πρ dρ has a closed form, since e^(−σs)/s is the antiderivative of the kernel in s.
    #[inline(always)]
    pub fn wall(&self, d: f32) -> f32 {
        let d = max(d, 0.0);
        let source = |z: f32| {
            let s = (d * d + z * z).sqrt();
            z * exp(-self.extinction * s) / s
        };
        0.5 * self.albedo * (source(self.real) + source(self.virtual_))
    }
}

/// A material in the scene's unit: three dipoles and the surface's index of refraction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Medium {
    /// Red, green, blue.
    pub dipoles: [Dipole; 3],
    /// Index of refraction η, at least 1.
    pub eta: f32,
    /// Reduced scattering coefficient σs' that the dipoles are made of, RGB, per millimetre.
    pub scattering: [f32; 3],
    /// Absorption coefficient σa that the dipoles are made of, RGB, per millimetre.
    pub absorption: [f32; 3],
    /// Length of the scene's unit, in millimetres.
    pub millimetres: f32,
}

impl Medium {
    /// The medium of coefficients per millimetre (Jensen's unit) in a scene whose unit is `millimetres` long
    /// (errata T8).
    pub fn new(scattering: [f32; 3], absorption: [f32; 3], eta: f32, millimetres: f32) -> Self {
        let scale = f64::from(millimetres);
        let dipoles = std::array::from_fn(|i| {
            Dipole::new(f64::from(scattering[i]) * scale, f64::from(absorption[i]) * scale, f64::from(eta))
        });
        Self { dipoles, eta, scattering, absorption, millimetres }
    }

    /// Schlick's Fresnel transmittance (1994) for light that meets the surface at `cosine` to its normal; the
    /// cosine is held to [0, 1].
    #[inline(always)]
    pub fn transmittance(&self, cosine: f32) -> f32 {
        let ratio = (self.eta - 1.0) / (self.eta + 1.0);
        let normal = ratio * ratio;
        let m = 1.0 - clamp(cosine, 0.0, 1.0);
        1.0 - (normal + (1.0 - normal) * (m * m * m * m * m))
    }

    /// The cosine at which the transmittance equals its cosine-weighted mean over the hemisphere, whatever η:
    /// the mean of (1 − c)⁵ is 1/21, so it is 1 − 21^(−1/5). An environment's light enters at this cosine.
    pub fn diffuse_cosine() -> f32 {
        (1.0 - double::pow(21.0, -0.2)) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_the_reference_crates() {
        // Typed in twice, from the same source: a slip in one copy shows.
        for (ours, theirs) in JENSEN_2001.iter().zip(&bitlight_reference::tables::JENSEN_2001) {
            assert_eq!(ours.0, theirs.name);
            assert_eq!(ours.1.map(|x| x.to_string()), theirs.sigma_s_prime.map(|x| x.to_string()));
            assert_eq!(ours.2.map(|x| x.to_string()), theirs.sigma_a.map(|x| x.to_string()));
            assert_eq!(ours.3.to_string(), theirs.eta.to_string());
        }
    }
}
