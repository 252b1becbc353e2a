//! How a surface reflects: diffuse, Phong and Cook-Torrance, in the local frame whose z axis is the normal.

use crate::numeric::order::{max, min};
use crate::numeric::single;
use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, PI};

/// A highlight on top of the diffuse part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Gloss {
    /// No highlight.
    None,
    /// (e + 2) / 2π · cosᵉ α about the mirror direction (Phong 1975, normalised after Lafortune and Willems 1994).
    Phong {
        /// e, at least 0.
        exponent: f32,
    },
    /// D F G / (4 cos θᵢ cos θₒ) (Cook and Torrance 1982): Beckmann's distribution D, their V-grooves G, Schlick's F from
    /// the highlight's colour at normal incidence.
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
    /// The value for light that comes from `light` and leaves towards `eye`, unit vectors in the local frame; 0 where one
    /// of them is not above the surface.
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
                let squared = half.z * half.z;
                let slopes = (1.0 - squared) / (squared * roughness * roughness);
                let distribution = single::exp(-slopes) / (PI * roughness * roughness * squared * squared);
                let grooves = min(1.0, 2.0 * half.z * min(eye.z, light.z) / across);
                let rest = 1.0 - min(across, 1.0);
                let schlick = rest * rest * rest * rest * rest;
                let fresnel = self.specular + (Vec3::ONE - self.specular) * schlick;
                diffuse + fresnel * (distribution * grooves / (4.0 * max(light.z, 1e-6) * max(eye.z, 1e-6)))
            }
        }
    }
}
