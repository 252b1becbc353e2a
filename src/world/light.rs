//! Lights: points, directions and environments.

use crate::sphere::environment::Environment;
use glam::Vec3;
use std::sync::Arc;

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
    /// Light from all around.
    Environment {
        /// Its radiance.
        environment: Arc<Environment>,
        /// RGB coefficients of its radiance in order l² + l + m, in as many bands as the technique takes.
        coefficients: Vec<[f32; 3]>,
    },
}

impl Light {
    /// Whether the light comes from one point or direction, so has a shadow map and a thickness.
    pub fn casts(&self) -> bool {
        !matches!(self, Self::Environment { .. })
    }

    /// The first nine coefficients of an environment, which irradiance needs (Ramamoorthi and Hanrahan 2001).
    ///
    /// # Panics
    /// Where it has fewer.
    pub fn nine(&self) -> Option<[[f32; 3]; 9]> {
        match self {
            Self::Environment { coefficients, .. } => Some(std::array::from_fn(|index| coefficients[index])),
            _ => None,
        }
    }

    /// The light as loops over many points take it.
    pub fn casting(&self) -> Casting {
        let (position, towards, power) = match *self {
            Self::Point { position, intensity } => (Some(position), Vec3::ZERO, intensity),
            Self::Directional { direction, irradiance } => (None, -direction, irradiance),
            Self::Environment { .. } => (None, Vec3::ZERO, Vec3::ZERO),
        };
        Casting { near: position.is_some(), position: position.unwrap_or_default(), towards, power }
    }
}

/// A casting light of either kind, whose light arrives without a branch.
#[derive(Debug, Clone, Copy)]
pub struct Casting {
    /// Whether it is a point.
    near: bool,
    position: Vec3,
    /// The unit direction towards one that is not.
    towards: Vec3,
    /// Radiant intensity of a point, irradiance of a direction.
    power: Vec3,
}

impl Casting {
    /// The unit direction from `point` towards the light, and the irradiance there of a surface that faces
    /// it; both zero for an environment, and at the light's own position.
    #[inline(always)]
    pub fn arriving(&self, point: Vec3) -> (Vec3, Vec3) {
        let to = self.position - point;
        let squared = to.length_squared();
        let (towards, facing) = (to / squared.sqrt(), self.power / squared);
        let apart = squared > 0.0;
        let near = (if apart { towards } else { Vec3::ZERO }, if apart { facing } else { Vec3::ZERO });
        if self.near { near } else { (self.towards, self.power) }
    }
}
