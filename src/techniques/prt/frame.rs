//! What the passes of a frame compute from.

use crate::raster::{Axes, View};
use crate::world::brdf::Brdf;
use crate::world::camera::Camera;
use crate::world::medium::Medium;
use crate::world::mesh::Mesh;
use glam::Vec3;

/// How directions are summed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// The whole, known exactly, less what is hidden.
    Control,
    /// What is seen.
    Quadrature,
}

/// How an equation is taken where print and correction differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reading {
    /// As the errata correct it.
    Corrected,
    /// To the letter of the paper, errors included.
    Paper,
}

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
    pub method: Method,
    /// Which reading of the equations.
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
        let view = View::perspective(
            camera.position,
            Axes::looking(camera.target - camera.position, camera.up),
            camera.tangents(size[0], size[1]),
            camera.near(&solid.bounds()),
            size,
        );
        Self { solid, surface, medium, lights, camera, view, background, settings }
    }
}
