//! `prt.scattered`: light that enters the solid and leaves after many scatterings, by the dipole integrated
//! over the mesh (Jensen et al. 2001, Eq. 4 and 5; as transfer Wang, Tran and Luebke 2005).

use super::Frame;
use super::visibility::read;
use crate::bake;
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, RGB, Twin};

/// The largest solid angle that vertices taken together may span, in steradians. This keeps the error below a
/// percent.
const SPREAD: f32 = 0.1;

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "prt.scattered",
        equation: "Jensen et al. 2001, Eq. 4 and 5",
        about: "the transfer vector of light that was scattered in the solid, but for Fresnel's transmittance towards the eye; \
            none without prt.subsurface",
        inputs: &["prt.visibility"],
        axes: &[Axis::Vertex, Axis::Coefficient, RGB],
        unit: "1",
        knob: "prt.bands",
        twin: Twin::PLANNED,
        preview: &[],
    },
    run,
};

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let (solid, settings, functions) = (&frame.stage.solid, &frame.settings, frame.functions());
    if !frame.computes("prt.scattered") {
        return Buffer::f32(&[0, functions, 3], Vec::new());
    }
    let (directions, visibility) = read(frame, inputs);
    let entering = bake::irradiance(
        solid,
        &directions,
        &visibility,
        settings.bands,
        &frame.stage.medium,
        settings.method,
    );
    let values = bake::multiple_scattering(solid, &entering, functions, &frame.stage.medium, SPREAD);
    Buffer::f32(&[solid.positions.len(), functions, 3], values)
}
