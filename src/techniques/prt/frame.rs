//! What the passes of a frame compute from.

use super::{Settings, Subsurface};
use crate::raster::View;
use crate::world::Stage;
use crate::world::brdf::{Brdf, Gloss};

/// Whether a pass has something to compute for a surface under some settings. Where it has not, the first
/// axis of its buffer has length 0, in `prt.brdf` the first two. A diffuse surface needs no matrices; one
/// with a highlight has its diffuse part in them.
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

/// What a frame is made of, and the technique's knobs.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Solid, lights and camera. All lights are far away.
    pub stage: Stage,
    /// The camera's view.
    pub view: View,
    /// The technique's knobs.
    pub settings: Settings,
}

impl Frame {
    /// Prepares a frame.
    pub fn new(stage: Stage, settings: Settings) -> Self {
        let view = View::of(&stage.camera, &stage.solid.bounds(), stage.size);
        Self { stage, view, settings }
    }

    /// Whether a pass has something to compute in this frame ([`computes`]).
    pub(super) fn computes(&self, pass: &str) -> bool {
        computes(pass, &self.stage.surface, &self.settings)
    }

    /// Functions of the basis: n².
    pub(super) fn functions(&self) -> usize {
        self.settings.bands * self.settings.bands
    }
}
