//! `prt.vectors`: T of a diffuse surface, whose product with light is the radiance that leaves
//! (Nowrouzezahrai et al. 2007, §3), with as many diffuse interreflections as are asked for.
//!
//! Decides erratum L1: the cosine and ρ/π are in T. Under [`Reading::Paper`] they are not, and there are no
//! bounces.

use super::Frame;
use super::visibility::read;
use crate::bake;
use crate::keys::Reading;
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, RGB, Twin};
use glam::Vec3;

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "prt.vectors",
        equation: "Nowrouzezahrai et al. 2007, §3; L1",
        about: "the transfer vector of each vertex of a diffuse surface, albedo and bounces included; none with a highlight",
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
    let (solid, settings) = (&frame.stage.solid, &frame.settings);
    if !frame.computes("prt.vectors") {
        return Buffer::f32(&[0, frame.functions(), 3], Vec::new());
    }
    let (directions, visibility) = read(frame, inputs);
    let direct =
        bake::vectors(solid, &directions, &visibility, settings.bands, settings.reading, settings.method);
    let (albedo, bounces) = match settings.reading {
        Reading::Corrected => (frame.stage.surface.albedo, settings.bounces),
        Reading::Paper => (Vec3::ONE, 0),
    };
    let values = if bounces == 0 {
        direct.iter().flat_map(|value| (albedo * *value).to_array()).collect()
    } else {
        let meetings = bake::meetings(solid, &directions, &visibility);
        bake::diffuse_bounces(
            solid,
            &directions,
            &meetings,
            settings.method,
            &direct,
            settings.bands,
            albedo,
            bounces,
        )
    };
    Buffer::f32(&[solid.positions.len(), frame.functions(), 3], values)
}
