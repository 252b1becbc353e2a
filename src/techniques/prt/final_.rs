//! `prt.final`: the picture, the radiance of the vertices interpolated over what each pixel sees.

use super::Frame;
use crate::numeric::{order::max, parallel};
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, RGB};
use crate::raster::NONE;

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "prt.final",
        equation: "-",
        about: "the picture: the radiance of the vertices interpolated, held to at least 0",
        inputs: &["prt.shading", "prt.seen"],
        axes: &[Axis::Row, Axis::Column, RGB],
        unit: "radiance",
    },
    run,
};

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let shading = inputs.get("prt.shading").as_f32().as_chunks::<3>().0;
    let seen = inputs.get("prt.seen").as_u32();
    let (view, solid) = (&frame.view, &frame.solid);
    let values = parallel::images([1, seen.len() * 3], 3 * super::RUN, 0.0, |_, chunk, out| {
        let first = chunk * super::RUN;
        for (pixel, out) in (first..).zip(out.as_chunks_mut::<3>().0) {
            if seen[pixel] == NONE {
                *out = frame.background.to_array();
                continue;
            }
            let corners = solid.triangles[seen[pixel] as usize].map(|corner| corner as usize);
            let ndc = view.ndc(pixel % view.width, pixel / view.width);
            let weights = view.barycentric(corners.map(|corner| solid.positions[corner]), ndc);
            let [a, b, c] = corners.map(|corner| shading[corner]);
            for channel in 0..3 {
                let radiance = a[channel] * weights[0] + b[channel] * weights[1] + c[channel] * weights[2];
                out[channel] = max(radiance, 0.0);
            }
        }
    });
    Buffer::f32(&[view.height, view.width, 3], values)
}
