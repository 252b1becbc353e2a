//! `prt.final`: the picture. The radiance of the vertices is interpolated at each pixel. Its part from within
//! the solid is multiplied by Schlick's transmittance at the cosine of the interpolated normal. Inner sides
//! are black.

use super::Frame;
use crate::bake;
use crate::numeric::{order::max, parallel, vector::unit_or_zero};
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, Preview, RGB, Twin};
use crate::raster::NONE;
use glam::Vec3;

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "prt.final",
        equation: "-",
        about: "the picture: the radiance of the vertices interpolated, Fresnel's transmittance applied, held to at least 0",
        inputs: &["prt.shading", "prt.vbuffer"],
        axes: &[Axis::Row, Axis::Column, RGB],
        unit: "radiance",
        knob: "image.width",
        twin: Twin::PLANNED,
        preview: &[Preview::Picture],
    },
    run,
};

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let shading = inputs.get("prt.shading").as_f32().as_chunks::<6>().0;
    let seen = inputs.get("prt.vbuffer").as_u32();
    let (view, solid) = (&frame.view, &frame.stage.solid);
    let values = parallel::images([1, seen.len() * 3], 3 * super::RUN, 0.0, |_, chunk, out| {
        let first = chunk * super::RUN;
        for (pixel, out) in (first..).zip(out.as_chunks_mut::<3>().0) {
            if seen[pixel] == NONE {
                *out = frame.stage.background.to_array();
                continue;
            }
            let corners = solid.triangles[seen[pixel] as usize].map(|corner| corner as usize);
            let ndc = view.ndc(pixel % view.width, pixel / view.width);
            let positions = corners.map(|corner| solid.positions[corner]);
            // The inner side of an open mesh is black, as in a bake.
            if !bake::front(positions, positions[0] - frame.stage.camera.position) {
                continue;
            }
            let weights = view.barycentric(positions, ndc);
            let blend = |of: [Vec3; 3]| of[0] * weights[0] + of[1] * weights[1] + of[2] * weights[2];
            let normal = unit_or_zero(blend(corners.map(|corner| solid.normals[corner])));
            let towards = unit_or_zero(frame.stage.camera.position - blend(positions));
            let leaves = frame.stage.medium.transmittance(normal.dot(towards));
            let surface = blend(corners.map(|corner| Vec3::from_slice(&shading[corner][..3])));
            let within = blend(corners.map(|corner| Vec3::from_slice(&shading[corner][3..])));
            *out = (surface + within * leaves).to_array().map(|radiance| max(radiance, 0.0));
        }
    });
    Buffer::f32(&[view.height, view.width, 3], values)
}
