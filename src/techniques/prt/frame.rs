//! What the passes of a frame compute from.

use crate::bake::{Estimate, Reading};
use crate::raster::View;
use crate::world::brdf::{Brdf, Gloss};
use crate::world::camera::Camera;
use crate::world::medium::Medium;
use crate::world::mesh::Mesh;
use glam::Vec3;

/// What becomes of light that enters the solid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Subsurface {
    /// It is lost.
    None,
    /// It leaves elsewhere, by the dipole of Jensen et al. 2001.
    Dipole,
}

/// The technique's own knobs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// Bands n of spherical harmonics: n² coefficients.
    pub bands: usize,
    /// Directions in which the visibility of a vertex is found.
    pub directions: usize,
    /// How they are summed.
    pub method: Estimate,
    /// Which reading of the transfer vectors.
    pub reading: Reading,
    /// Reflections between points of the solid before the one to the eye.
    pub bounces: usize,
    /// What becomes of light that enters the solid.
    pub subsurface: Subsurface,
    /// Poses that a bake of the whole scene has.
    pub poses: usize,
}

/// Light from far away.
#[derive(Debug, Clone, PartialEq)]
pub enum Light {
    /// From one direction.
    Directional {
        /// The unit direction in which it travels.
        direction: Vec3,
        /// Irradiance on a surface that faces it, RGB.
        irradiance: Vec3,
    },
    /// From all around: the n² coefficients of its radiance, RGB, in order l² + l + m.
    Environment(Vec<[f32; 3]>),
}

/// Whether a pass has something to compute of such a surface under such settings. Where it has not, the first axis of its
/// buffer (of a matrix both) has no length: a diffuse surface needs no matrices, and one with a highlight has its diffuse
/// part in them.
pub fn computes(pass: &str, surface: &Brdf, settings: &Settings) -> bool {
    let glossy = surface.gloss != Gloss::None;
    match pass {
        "prt.vectors" => !glossy,
        "prt.matrices" | "prt.exits" => glossy,
        "prt.brdf" | "prt.bounced" => glossy && settings.bounces > 0,
        "prt.scattered" => settings.subsurface != Subsurface::None,
        _ => true,
    }
}

/// The passes that a bake of such a surface under such settings stores: what each vertex sees, and its transfer.
pub fn stored(surface: &Brdf, settings: &Settings) -> Vec<&'static str> {
    // What bounces add to is in `bounced` too.
    let matrices = if computes("prt.bounced", surface, settings) { "prt.bounced" } else { "prt.matrices" };
    let all = ["prt.visibility", "prt.vectors", matrices, "prt.scattered"];
    all.into_iter().filter(|pass| computes(pass, surface, settings)).collect()
}

/// A solid, what lights it, and who looks.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// The solid in its pose, in the scene's unit.
    pub solid: Mesh,
    /// How its surface reflects.
    pub surface: Brdf,
    /// What is below the surface.
    pub medium: Medium,
    /// In the scene's order.
    pub lights: Vec<Light>,
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
    #[expect(clippy::too_many_arguments, reason = "called once, by run.rs, with a scene's parts by name")]
    pub fn new(
        solid: Mesh,
        surface: Brdf,
        medium: Medium,
        lights: Vec<Light>,
        camera: Camera,
        size: [usize; 2],
        background: Vec3,
        settings: Settings,
    ) -> Self {
        let view = View::of(&camera, &solid.bounds(), size);
        Self { solid, surface, medium, lights, camera, view, background, settings }
    }

    /// Whether a pass has something to compute in this frame ([`computes`]).
    pub(super) fn computes(&self, pass: &str) -> bool {
        computes(pass, &self.surface, &self.settings)
    }

    /// Functions of the basis: n².
    pub(super) fn functions(&self) -> usize {
        self.settings.bands * self.settings.bands
    }
}
