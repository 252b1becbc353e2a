//! `prt.visibility`: which of the directions each vertex sees, V of every transfer integral
//! ([`crate::bake::visibility`]).

use super::Frame;
use crate::bake::{self, Directions, Visibility};
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, Twin};

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "prt.visibility",
        equation: "V of Nowrouzezahrai et al. 2007, §3, and of Feng et al. 2007, Eq. 5",
        about: "a bit for each direction, the lowest first: above the vertex's horizon and met by no triangle",
        inputs: &[],
        axes: &[Axis::Vertex, Axis::Of("word")],
        unit: "bits",
        knob: "prt.directions",
        twin: Twin::PLANNED,
        preview: &[],
    },
    run,
};

fn run(frame: &Frame, _: &Inputs<'_>) -> Buffer {
    let seen = bake::visibility(&frame.stage.solid, &Directions::new(frame.settings.directions));
    Buffer::u32(&[frame.stage.solid.positions.len(), seen.words], seen.visible)
}

/// The directions of a frame, and what its vertices see and do not see of them.
pub(super) fn read(frame: &Frame, inputs: &Inputs<'_>) -> (Directions, Visibility) {
    let directions = Directions::new(frame.settings.directions);
    let bits = inputs.get("prt.visibility").as_u32().to_vec();
    let visibility = Visibility::from_bits(&frame.stage.solid, &directions, bits);
    (directions, visibility)
}
