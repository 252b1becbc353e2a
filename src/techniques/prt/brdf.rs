//! `prt.brdf`: B, the matrix of the surface's BRDF times the cosine, from functions of the light to functions
//! of the exit direction o. y(o)ᵗ B M L is the radiance that leaves a vertex towards o. Bounces take it as it
//! is in these bands. Radiance towards the camera is exact in o (`exits`).

use super::Frame;
use crate::bake::brdf;
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, RGB, Twin};

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "prt.brdf",
        equation: "Sloan et al. 2002, §4",
        about: "the matrix of the surface: rows are functions of the exit, columns of the light, both in the vertex's \
            frame; none without a highlight or without bounces",
        inputs: &[],
        axes: &[Axis::Of("row of matrix"), Axis::Of("column of matrix"), RGB],
        unit: "1",
        knob: "prt.bands",
        twin: Twin::PLANNED,
        preview: &[],
    },
    run,
};

fn run(frame: &Frame, _: &Inputs<'_>) -> Buffer {
    if !frame.computes("prt.brdf") {
        return Buffer::f32(&[0, 0, 3], Vec::new());
    }
    let matrix = brdf::matrix(&frame.stage.surface, frame.settings.bands);
    Buffer::f32(&[frame.functions(), frame.functions(), 3], matrix.into_flattened())
}
