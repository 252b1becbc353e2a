//! `prt.bounced`: the transfer matrices with light that the surface itself reflects onto the vertex.

use super::Frame;
use super::visibility::read;
use crate::bake;
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, RGB, Twin};

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "prt.bounced",
        equation: "Sloan et al. 2002, §5, of matrices",
        about: "the matrices and what prt.bounces reflections add to them; none without a highlight or without bounces",
        inputs: &["prt.visibility", "prt.matrices", "prt.brdf"],
        axes: &[Axis::Vertex, Axis::Of("row of matrix"), Axis::Of("column of matrix"), RGB],
        unit: "1",
        knob: "prt.bands",
        twin: Twin::PLANNED,
        preview: &[],
    },
    run,
};

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let (solid, settings, functions) = (&frame.stage.solid, &frame.settings, frame.functions());
    if !frame.computes("prt.bounced") {
        return Buffer::f32(&[0, functions, functions, 3], Vec::new());
    }
    let (directions, visibility) = read(frame, inputs);
    let [direct, brdf] = ["matrices", "brdf"].map(|pass| inputs.get(&format!("prt.{pass}")).as_f32());
    let meetings = bake::meetings(solid, &directions, &visibility);
    let values = bake::glossy_bounces(
        solid,
        &directions,
        &meetings,
        settings.method,
        direct,
        settings.bands,
        brdf.as_chunks::<3>().0,
        settings.bounces,
    );
    Buffer::f32(&[solid.positions.len(), functions, functions, 3], values)
}
