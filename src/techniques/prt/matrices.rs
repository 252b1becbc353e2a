//! `prt.matrices`: M, which maps the coefficients of the light to those of the radiance that arrives at a
//! vertex, in the vertex's own frame (T of Feng et al. 2007, Eq. 5).

use super::Frame;
use super::visibility::read;
use crate::bake;
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, Twin};

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "prt.matrices",
        equation: "Feng et al. 2007, Eq. 5",
        about: "the transfer matrix of each vertex of a surface with a highlight: rows are functions of the vertex's \
            frame, columns of the world; none without a highlight",
        inputs: &["prt.visibility"],
        axes: &[Axis::Vertex, Axis::Of("row of matrix"), Axis::Of("column of matrix")],
        unit: "1",
        knob: "prt.bands",
        twin: Twin::PLANNED,
        preview: &[],
    },
    run,
};

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    if !frame.computes("prt.matrices") {
        return Buffer::f32(&[0, frame.functions(), frame.functions()], Vec::new());
    }
    let (directions, visibility) = read(frame, inputs);
    let vertices = frame.stage.solid.positions.len();
    let (bands, method) = (frame.settings.bands, frame.settings.method);
    let values = bake::matrices(&frame.stage.solid, &directions, &visibility, bands, method, 0..vertices);
    Buffer::f32(&[vertices, frame.functions(), frame.functions()], values)
}
