//! What the passes of a frame compute from.

use super::{Fit, Points, Settings};
use crate::Error;
use crate::keys::Reading;
use crate::numeric::order::{max3, min};
use crate::numeric::vector::unit_or_zero;
use crate::raster::{ShadowView, View};
use crate::sphere::irradiance;
use crate::world::Stage;
use crate::world::light::Light;
use crate::world::mesh::Bounds;
use glam::Vec3;

/// A light with a shadow map.
#[derive(Debug, Clone, PartialEq)]
pub struct Caster {
    /// Its index among the frame's lights.
    pub light: usize,
    /// Its view of the solid.
    pub shadow: ShadowView,
}

/// What a frame is made of, and what its passes derive from that alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Solid, lights and camera.
    pub stage: Stage,
    /// The solid's bounding box. Each half extent is at least 10⁻⁴ of the radius, so that a flat solid's box
    /// is not flat.
    pub bounds: Bounds,
    /// The box whose faces the six views of the cubemap fill: the bounding box, or without the cure of
    /// blindness the cube about its centre that is as wide as its longest side.
    pub viewed: Bounds,
    /// Where light is accumulated.
    pub points: Points,
    /// The lights that cast, in the scene's order.
    pub casters: Vec<Caster>,
    /// For each light that is an environment, one matrix a colour whose quadratic form is irradiance.
    pub irradiance: Vec<Option<[[[f32; 4]; 4]; 3]>>,
    /// The camera's view.
    pub view: View,
    /// The technique's knobs.
    pub settings: Settings,
}

impl Frame {
    /// Prepares a frame.
    ///
    /// # Errors
    /// A point light inside or too near the solid's bounding box: the error's key is `light[i]`.
    ///
    /// # Panics
    /// Where an environment has coefficients of fewer than three bands.
    pub fn new(stage: Stage, settings: Settings) -> Result<Self, Error> {
        let bounds = stage.solid.bounds();
        let (center, half) = (bounds.center(), bounds.half_extents());
        let half = max3(half, Vec3::splat(half.length() * 1e-4));
        let bounds = Bounds { low: center - half, high: center + half };
        let widest = Vec3::splat(half.max_element());
        let cube = Bounds { low: center - widest, high: center + widest };
        let viewed = if settings.blindness_cure { bounds } else { cube };
        let mut casters = Vec::new();
        for (index, light) in stage.lights.iter().enumerate() {
            let shadow = match light {
                Light::Point { position, .. } => ShadowView::point(*position, center, half, settings.shadow)
                    .map_err(|error| error.key(format!("light[{index}].position")))?,
                Light::Directional { direction, .. } => {
                    ShadowView::directional(*direction, center, half, settings.shadow)
                }
                Light::Environment { .. } => continue,
            };
            let shadow = match settings.fit {
                Fit::Box => shadow,
                Fit::Solid => shadow.fitted(stage.solid.used_positions()),
            };
            casters.push(Caster { light: index, shadow });
        }
        let irradiance = stage.lights.iter().map(|light| light.nine().map(|nine| irradiance::matrix(&nine)));
        let irradiance = irradiance.collect();
        let view = View::of(&stage.camera, &bounds, stage.size);
        let points = Points::new(viewed.half_extents(), settings.accumulation);
        Ok(Self { stage, bounds, viewed, points, casters, irradiance, view, settings })
    }

    /// Whether the letter of the paper is asked for.
    pub(super) fn paper(&self) -> bool {
        self.settings.reading == Reading::Paper
    }

    /// The least thickness with which Eq. 12 is computed, in the scene's unit. The corrected equation is
    /// bounded, so its least is 0.
    pub(super) fn smallest_d(&self) -> f32 {
        match self.settings.reading {
            Reading::Corrected => 0.0,
            Reading::Paper => self.settings.smallest_d.unwrap_or(1e-3 * self.bounds.radius()),
        }
    }

    /// The index of a light among the casters.
    pub(super) fn caster(&self, light: usize) -> Option<usize> {
        self.casters.iter().position(|caster| caster.light == light)
    }

    /// The unit direction from `point` towards the camera.
    #[inline(always)]
    pub(super) fn towards_camera(&self, point: Vec3) -> Vec3 {
        unit_or_zero(self.stage.camera.position - point)
    }

    /// The refracted direction r of §2: the view ray to `point` bent into the medium about the unit `normal`
    /// by Snell's law; always a unit vector that points inward. Where the interpolated normal faces away from
    /// the camera, only the ray's tangential part counts.
    #[inline(always)]
    pub(super) fn refracted(&self, point: Vec3, normal: Vec3) -> Vec3 {
        let ray = -self.towards_camera(point);
        let sine = (ray - normal * ray.dot(normal)) / self.stage.medium.eta;
        let squared = sine.length_squared();
        sine - normal * (if squared < 1.0 { 1.0 - squared } else { 0.0 }).sqrt()
    }
}

/// Where a ray from `point`, inside the box, leaves it, and how far that is: the correction of the shift
/// problem (§3).
#[inline(always)]
pub(super) fn exit(bounds: &Bounds, point: Vec3, direction: Vec3) -> (Vec3, f32) {
    let (low, high) = (bounds.low, bounds.high);
    let meets = |low: f32, high: f32, point: f32, direction: f32| {
        let t = (if direction > 0.0 { high } else { low } - point) / direction;
        // A component of 0 never meets its two planes.
        if direction != 0.0 { t } else { f32::MAX }
    };
    let nearest = min(f32::MAX, meets(low.x, high.x, point.x, direction.x));
    let nearest = min(nearest, meets(low.y, high.y, point.y, direction.y));
    let nearest = min(nearest, meets(low.z, high.z, point.z, direction.z));
    let t = if nearest > 0.0 && nearest < f32::MAX { nearest } else { 0.0 };
    (point + direction * t, t)
}
