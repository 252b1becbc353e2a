//! `prt.vbuffer`: the triangle that each pixel of the camera sees.

use super::Frame;
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, Preview, Twin};
use crate::raster::visibility;

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "prt.vbuffer",
        equation: "-",
        about: "the index of the triangle that the camera sees, 4294967295 where there is none",
        inputs: &[],
        axes: &[Axis::Row, Axis::Column],
        unit: "index",
        knob: "image.width",
        twin: Twin::PLANNED,
        preview: &[Preview::Index],
    },
    run,
};

fn run(frame: &Frame, _: &Inputs<'_>) -> Buffer {
    let seen = visibility(&frame.stage.solid.positions, &frame.stage.solid.triangles, &frame.view);
    Buffer::u32(&[frame.view.height, frame.view.width], seen.triangle)
}
