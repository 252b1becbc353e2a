//! What the passes of a frame compute from.

use super::Points;
use crate::Error;
use crate::numeric::order::{max3, min};
use crate::numeric::vector::unit_or_zero;
use crate::raster::{ShadowView, View};
use crate::sphere::irradiance;
use crate::world::camera::Camera;
use crate::world::light::Light;
use crate::world::medium::Medium;
use crate::world::mesh::{Bounds, Mesh};
use glam::Vec3;

/// What a light's shadow map just holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fit {
    /// The solid's bounding box.
    Box,
    /// The solid: the tightest rectangle around its projection.
    Solid,
}

/// Which light the picture shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Show {
    /// Both.
    All,
    /// What the surface reflects, as in fig. 10a and 11a.
    Direct,
    /// What has come through the solid.
    Scattered,
}

/// How an equation is taken where print and correction differ. Each pass's head says what it does under each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reading {
    /// As the errata correct it.
    Corrected,
    /// To the letter of the paper, errors included.
    Paper,
}

/// Where the radiosity is evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Evaluation {
    /// At each pixel.
    Pixel,
    /// At each vertex, and interpolated over the triangle (fig. 6).
    Vertex,
}

/// The technique's own knobs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Width and height of a face of the external cubemap, in texels.
    pub cubemap: usize,
    /// Width and height of a light's shadow map, in texels.
    pub shadow: usize,
    /// Width of the Gaussian that blurs it, in texels; 0 and 1 leave it as it is.
    pub blur: usize,
    /// Which reading of the equations.
    pub reading: Reading,
    /// The thickness at which [`Reading::Paper`] holds the attenuation of Eq. 12, in the scene's unit; `None` for
    /// 10⁻³ of half the bounding box's diagonal.
    pub smallest_d: Option<f32>,
    /// Where the radiosity is evaluated.
    pub evaluation: Evaluation,
    /// Whether only points up to the second surface that the light meets receive it (fig. 9); else all do.
    pub second_layer: bool,
    /// Whether the radiosity is looked up where the refracted ray leaves the box (the cure of fig. 7a); else along
    /// the ray's direction from the centre.
    pub shift_cure: bool,
    /// Whether the six views fill the solid's bounding box (fig. 8, the cure of fig. 7b); else a cube around it.
    pub blindness_cure: bool,
    /// What a light's shadow map just holds.
    pub fit: Fit,
    /// Accumulation points along the longest side of the box that the cubemap's views fill.
    pub accumulation: usize,
    /// Which light the picture shows.
    pub show: Show,
}

/// A light with a shadow map.
#[derive(Debug, Clone, PartialEq)]
pub struct Caster {
    /// Its index among the frame's lights.
    pub light: usize,
    /// Its view of the solid.
    pub shadow: ShadowView,
}

/// A solid, what lights it, and who looks.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// The solid, in the scene's unit.
    pub solid: Mesh,
    /// The solid's bounding box, each half extent at least 10⁻⁴ of the radius so that a flat solid has one too.
    pub bounds: Bounds,
    /// The box whose faces the six views of the cubemap fill: the bounding box, or without the cure of blindness the
    /// cube about its centre that is as wide as its longest side.
    pub viewed: Bounds,
    /// Where light is accumulated.
    pub points: Points,
    /// The material.
    pub medium: Medium,
    /// Exponent of the highlight of casting lights; 0 for none.
    pub gloss: f32,
    /// In the scene's order.
    pub lights: Vec<Light>,
    /// The lights that cast, in the scene's order.
    pub casters: Vec<Caster>,
    /// For each light that is an environment, one matrix a colour whose quadratic form is irradiance.
    pub irradiance: Vec<Option<[[[f32; 4]; 4]; 3]>>,
    /// Who looks.
    pub camera: Camera,
    /// The camera's view.
    pub view: View,
    /// Radiance of pixels that see no surface.
    pub background: Vec3,
    /// The technique's knobs.
    pub settings: Settings,
}

impl Frame {
    /// Prepares a frame; `size` is the image's width and height.
    ///
    /// # Errors
    /// A point light inside or too near the solid's bounding box: the error's key is `light[i]`.
    #[expect(clippy::too_many_arguments, reason = "called once, by run.rs, with a scene's parts by name")]
    pub fn new(
        solid: Mesh,
        medium: Medium,
        gloss: f32,
        lights: Vec<Light>,
        camera: Camera,
        size: [usize; 2],
        background: Vec3,
        settings: Settings,
    ) -> Result<Self, Error> {
        let bounds = solid.bounds();
        let (center, half) = (bounds.center(), bounds.half_extents());
        let half = max3(half, Vec3::splat(half.length() * 1e-4));
        let bounds = Bounds { low: center - half, high: center + half };
        let widest = Vec3::splat(half.max_element());
        let cube = Bounds { low: center - widest, high: center + widest };
        let viewed = if settings.blindness_cure { bounds } else { cube };
        let mut casters = Vec::new();
        for (index, light) in lights.iter().enumerate() {
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
                Fit::Solid => shadow.fitted(solid.used_positions()),
            };
            casters.push(Caster { light: index, shadow });
        }
        let irradiance = lights
            .iter()
            .map(|light| match light {
                Light::Environment { coefficients } => Some(irradiance::matrix(coefficients)),
                _ => None,
            })
            .collect();
        let view = View::of(&camera, &bounds, size);
        Ok(Self {
            solid,
            bounds,
            viewed,
            points: Points::new(viewed.half_extents(), settings.accumulation),
            medium,
            gloss,
            lights,
            casters,
            irradiance,
            camera,
            view,
            background,
            settings,
        })
    }

    /// Whether the letter of the paper is asked for.
    pub(super) fn paper(&self) -> bool {
        self.settings.reading == Reading::Paper
    }

    /// The least thickness with which Eq. 12 is computed, in the scene's unit: the corrected one is bounded and needs
    /// none but 0.
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
        unit_or_zero(self.camera.position - point)
    }

    /// The refracted direction r of §2: the view ray to `point` bent into the medium about the unit `normal` by
    /// Snell's law; always a unit vector that points inward. Where the interpolated normal is averted from the
    /// camera, only the ray's tangential part counts.
    #[inline(always)]
    pub(super) fn refracted(&self, point: Vec3, normal: Vec3) -> Vec3 {
        let ray = -self.towards_camera(point);
        let sine = (ray - normal * ray.dot(normal)) / self.medium.eta;
        let squared = sine.length_squared();
        sine - normal * (if squared < 1.0 { 1.0 - squared } else { 0.0 }).sqrt()
    }
}

/// Where a ray from `point`, inside the box, leaves it, and how far that is: the correction of the shift problem (§3).
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
