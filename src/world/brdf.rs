//! How a surface reflects: diffuse, Phong and Cook-Torrance, in the local frame whose z axis is the normal;
//! and the drawing of directions in proportion to that.

use crate::numeric::order::{clamp, max, min};
use crate::numeric::single;
use crate::numeric::turns::sin_cos;
use crate::numeric::vector::frame;
use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, PI};

/// A highlight on top of the diffuse part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Gloss {
    /// No highlight.
    None,
    /// (e + 2) / 2π · cosᵉ α about the mirror direction (Phong 1975, normalised after Lafortune and Willems
    /// 1994).
    Phong {
        /// e, at least 0.
        exponent: f32,
    },
    /// D F G / (4 cos θᵢ cos θₒ) (Cook and Torrance 1982): Beckmann's distribution D, their V-grooves G,
    /// Schlick's F from the highlight's colour at normal incidence.
    CookTorrance {
        /// Root mean square slope m of the facets, above 0.
        roughness: f32,
    },
}

/// A bidirectional reflectance distribution function, per steradian.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Brdf {
    /// Diffuse albedo, RGB.
    pub albedo: Vec3,
    /// Colour of the highlight, RGB.
    pub specular: Vec3,
    /// Shape of the highlight.
    pub gloss: Gloss,
}

impl Brdf {
    /// The value for light that comes from `light` and leaves towards `eye`, unit vectors in the local frame;
    /// 0 where one of them is not above the surface.
    pub fn value(&self, light: Vec3, eye: Vec3) -> Vec3 {
        if light.z <= 0.0 || eye.z <= 0.0 {
            return Vec3::ZERO;
        }
        let diffuse = self.albedo * FRAC_1_PI;
        match self.gloss {
            Gloss::None => diffuse,
            Gloss::Phong { exponent } => {
                let cosine = eye.dot(Vec3::new(-light.x, -light.y, light.z));
                let lobe = if cosine > 0.0 { single::pow(cosine, exponent) } else { 0.0 };
                diffuse + self.specular * ((exponent + 2.0) * (0.5 * FRAC_1_PI) * lobe)
            }
            Gloss::CookTorrance { roughness } => {
                let half = (light + eye).normalize();
                let across = half.dot(eye); // the angle to the facet's normal is the same for both
                let distribution = beckmann(half.z * half.z, roughness);
                let grooves = min(1.0, 2.0 * half.z * min(eye.z, light.z) / across);
                let rest = 1.0 - min(across, 1.0);
                let schlick = rest * rest * rest * rest * rest;
                let fresnel = self.specular + (Vec3::ONE - self.specular) * schlick;
                diffuse + fresnel * (distribution * grooves / (4.0 * max(light.z, 1e-6) * max(eye.z, 1e-6)))
            }
        }
    }

    /// Draws a direction towards the light from three uniform numbers, with the density [`Self::pdf`]; none
    /// where it is not above the surface.
    ///
    /// The diffuse part draws by the cosine, and Phong's highlight from its lobe about the mirror direction.
    /// Cook-Torrance's draws the facet's normal from Beckmann's distribution (Walter et al. 2007, Eq. 28 and
    /// 29).
    pub fn sample(&self, eye: Vec3, choice: f32, [u, v]: [f32; 2]) -> Option<Vec3> {
        let light = match self.gloss {
            Gloss::Phong { exponent } if choice >= self.diffuse_share() => {
                let lobe = polar(single::pow(1.0 - u, 1.0 / (exponent + 1.0)), v);
                let mirror = Vec3::new(-eye.x, -eye.y, eye.z);
                let [x, y] = frame(mirror);
                x * lobe.x + y * lobe.y + mirror * lobe.z
            }
            Gloss::CookTorrance { roughness } if choice >= self.diffuse_share() => {
                let slopes = -(roughness * roughness) * single::log(1.0 - u);
                let half = polar(1.0 / (1.0 + slopes).sqrt(), v);
                half * (2.0 * half.dot(eye)) - eye
            }
            _ => cosine([u, v]),
        };
        (light.z > 0.0).then_some(light)
    }

    /// The density per steradian with which [`Self::sample`] draws `light`.
    pub fn pdf(&self, light: Vec3, eye: Vec3) -> f32 {
        if light.z <= 0.0 || eye.z <= 0.0 {
            return 0.0;
        }
        let share = self.diffuse_share();
        let diffuse = share * (light.z * FRAC_1_PI);
        match self.gloss {
            Gloss::None => diffuse,
            Gloss::Phong { exponent } => {
                let cosine = eye.dot(Vec3::new(-light.x, -light.y, light.z));
                let lobe = if cosine > 0.0 { single::pow(cosine, exponent) } else { 0.0 };
                diffuse + (1.0 - share) * ((exponent + 1.0) * (0.5 * FRAC_1_PI) * lobe)
            }
            Gloss::CookTorrance { roughness } => {
                let half = (light + eye).normalize();
                diffuse
                    + (1.0 - share) * (beckmann(half.z * half.z, roughness) * half.z / (4.0 * half.dot(eye)))
            }
        }
    }

    /// The share of the draws that the diffuse part makes: its share of the two colours, at least a tenth.
    /// Where there is a highlight it is at most nine tenths (a Cook-Torrance one of no colour still reflects
    /// at grazing angles).
    fn diffuse_share(&self) -> f32 {
        if self.gloss == Gloss::None {
            return 1.0;
        }
        let (diffuse, specular) = (self.albedo.element_sum(), self.specular.element_sum());
        clamp(diffuse / max(diffuse + specular, f32::MIN_POSITIVE), 0.1, 0.9)
    }
}

/// A direction with density cos θ / π from two uniform numbers.
pub fn cosine([u, v]: [f32; 2]) -> Vec3 {
    polar((1.0 - u).sqrt(), v)
}

/// The unit vector at a cosine to z, `turns` around it.
pub fn polar(cosine: f32, turns: f32) -> Vec3 {
    let sine = max(1.0 - cosine * cosine, 0.0).sqrt();
    let (s, c) = sin_cos(f64::from(turns));
    Vec3::new(sine * c as f32, sine * s as f32, cosine)
}

/// Beckmann's distribution of facets at the squared cosine to the normal.
fn beckmann(squared: f32, roughness: f32) -> f32 {
    let slopes = (1.0 - squared) / (squared * roughness * roughness);
    single::exp(-slopes) / (PI * roughness * roughness * squared * squared)
}
