//! `translucency.radiosity`: B = [r, 1]ᵗ M [r, 1] with the refracted direction r (Eq. 10, which stands for Eq. 5).
//!
//! Decides errata T5 (the hemisphere of Eq. 5 is about r, so B is not negative for a cubemap that is not) and T13:
//! r depends on the view as well as on the normal; M takes the 4-vector (r, 1).
//!
//! The accumulation point is the box's centre, the point that is shaded lies elsewhere: the lookup follows the
//! refracted ray from the point to where it leaves the bounding box, and takes the direction from the centre to
//! there, in the frame in which the box is a cube (§3: the cure of shift, with that of blindness).
//! Without `shift_cure` the direction is the refracted one itself, as from the centre (fig. 7a); without
//! `blindness_cure` the box is the cube that the views of `cubemap` fill, where the ray may point at what they left
//! empty (fig. 7b).
//!
//! Fig. 6 compares two evaluations: at each pixel, or with `evaluation = "vertex"` at each vertex, with the refracted
//! direction and the lookup of the vertex, and interpolated with the weights of position and normal.
//!
//! Nine coefficients ring below zero opposite a bright side; B is held to ≥ 0. To the letter it is what Eq. 10 gives.

use super::frame::exit;
use super::gbuffer::shade;
use super::{Evaluation, Frame};
use crate::numeric::lanes::{BLOCK, wide};
use crate::numeric::vector::unit_or_zero;
use crate::numeric::{order::max, parallel};
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, RGB};
use crate::raster::Points;
use crate::sphere::irradiance;
use glam::Vec3;

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "translucency.radiosity",
        equation: "Eq. 10, Eq. 5, fig. 6 and 7; T5, T7, T13",
        about: "the light that the refracted direction collects, looked up where its ray leaves the bounding box",
        inputs: &["translucency.visibility", "translucency.gbuffer", "translucency.matrices"],
        axes: &[Axis::Light, Axis::Row, Axis::Column, RGB],
        unit: "irradiance",
    },
    run,
};

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let seen = inputs.get("translucency.visibility").as_u32();
    let (gbuffer, matrices) = (inputs.get("translucency.gbuffer"), inputs.get("translucency.matrices"));
    let count = frame.lights.len();
    match frame.settings.evaluation {
        Evaluation::Pixel => shade(frame, gbuffer, count, |light, points, out| {
            radiosities(frame, &three(matrices.slice(light)), points, out);
        }),
        Evaluation::Vertex => {
            let vertices = at_vertices(frame, matrices);
            let each = frame.solid.positions.len();
            shade(frame, gbuffer, count, |light, points, out: &mut [_; 3]| {
                for lane in 0..points.count {
                    let pixel = points.pixel[lane] as usize;
                    let corners = frame.solid.triangles[seen[pixel] as usize].map(|corner| corner as usize);
                    let (x, y) = (pixel % frame.view.width, pixel / frame.view.width);
                    let positions = corners.map(|corner| frame.solid.positions[corner]);
                    let weights = frame.view.barycentric(positions, frame.view.ndc(x, y));
                    let of = corners.map(|corner| vertices[light * each + corner]);
                    for (channel, out) in out.iter_mut().enumerate() {
                        out[lane] = of[0][channel] * weights[0]
                            + of[1][channel] * weights[1]
                            + of[2][channel] * weights[2];
                    }
                }
            })
        }
    }
}

/// The matrices of red, green and blue.
fn three(entries: &[f32]) -> [[[f32; 4]; 4]; 3] {
    [0, 4, 8]
        .map(|first| [0, 1, 2, 3].map(|row| [0, 1, 2, 3].map(|column| entries[(first + row) * 4 + column])))
}

/// The radiosity at every vertex, a run of all vertices for each light.
fn at_vertices(frame: &Frame, matrices: &Buffer) -> Vec<[f32; 3]> {
    let each = frame.solid.positions.len();
    let mut values = vec![[0.0; 3]; frame.lights.len() * each];
    for (light, values) in values.chunks_exact_mut(each).enumerate() {
        let matrices = three(matrices.slice(light));
        parallel::for_each_chunk(values, super::RUN, |chunk, out| {
            for (vertex, out) in (chunk * super::RUN..).zip(out) {
                *out =
                    radiosity(frame, &matrices, frame.solid.positions[vertex], frame.solid.normals[vertex]);
            }
        });
    }
    values
}

wide! {
    /// The radiosity at points for the three matrices of one light.
    fn radiosities(
        frame: &Frame,
        matrices: &[[[f32; 4]; 4]; 3],
        points: &Points,
        out: &mut [[f32; BLOCK]; 3],
    ) {
        for lane in 0..BLOCK {
            [out[0][lane], out[1][lane], out[2][lane]] =
                radiosity(frame, matrices, points.position(lane), points.normal(lane));
        }
    }
}

/// Eq. 10 at a point of the surface for the three matrices of one light.
#[inline(always)]
fn radiosity(frame: &Frame, matrices: &[[[f32; 4]; 4]; 3], point: Vec3, normal: Vec3) -> [f32; 3] {
    let (center, half) = (frame.viewed.center(), frame.viewed.half_extents());
    let from = if frame.settings.shift_cure { point } else { center };
    let (leaves, _) = exit(&frame.viewed, from, frame.refracted(point, normal));
    let lookup = unit_or_zero((leaves - center) / half);
    let held = |channel: usize| {
        let radiosity = irradiance::evaluate(&matrices[channel], lookup);
        if frame.paper() { radiosity } else { max(radiosity, 0.0) }
    };
    [held(0), held(1), held(2)]
}
