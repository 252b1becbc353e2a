//! Lights: points, directions and environments.

use glam::Vec3;

/// A source of light.
#[derive(Debug, Clone, PartialEq)]
pub enum Light {
    /// A point that shines alike in all directions.
    Point {
        /// In the scene's unit.
        position: Vec3,
        /// Radiant intensity, RGB: irradiance at distance 1 facing the light.
        intensity: Vec3,
    },
    /// Parallel light from far away.
    Directional {
        /// The unit direction in which it travels.
        direction: Vec3,
        /// Irradiance on a surface that faces it, RGB.
        irradiance: Vec3,
    },
    /// Light from all around, as the nine spherical-harmonic coefficients of its radiance: what irradiance needs
    /// (Ramamoorthi and Hanrahan 2001).
    Environment {
        /// RGB coefficients in order l² + l + m.
        coefficients: [[f32; 3]; 9],
    },
}

impl Light {
    /// Whether the light comes from one point or direction, so has a shadow map and a thickness.
    pub fn casts(&self) -> bool {
        !matches!(self, Self::Environment { .. })
    }

    /// The unit direction from `point` towards a casting light, and the irradiance there of a surface that
    /// faces it; both zero for an environment, and at the light's own position.
    #[inline(always)]
    pub fn arriving(&self, point: Vec3) -> (Vec3, Vec3) {
        match self {
            Self::Point { position, intensity } => {
                let to = *position - point;
                let squared = to.length_squared();
                let (towards, facing) = (to / squared.sqrt(), *intensity / squared);
                if squared > 0.0 { (towards, facing) } else { (Vec3::ZERO, Vec3::ZERO) }
            }
            Self::Directional { direction, irradiance } => (-*direction, *irradiance),
            Self::Environment { .. } => (Vec3::ZERO, Vec3::ZERO),
        }
    }
}
