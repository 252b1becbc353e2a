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
use crate::numeric::{order::max, parallel};
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, RGB};
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
    let (seen, gbuffer) =
        (inputs.get("translucency.visibility").as_u32(), inputs.get("translucency.gbuffer"));
    let (matrices, count) = (inputs.get("translucency.matrices"), frame.lights.len());
    match frame.settings.evaluation {
        Evaluation::Pixel => shade(frame, gbuffer, count, 3, |light, _, point, normal, out| {
            out.copy_from_slice(&radiosity(frame, matrices.slice(light), point, normal));
        }),
        Evaluation::Vertex => {
            let vertices = at_vertices(frame, matrices);
            let each = frame.solid.positions.len();
            shade(frame, gbuffer, count, 3, |light, index, _, _, out| {
                let corners = frame.solid.triangles[seen[index] as usize].map(|corner| corner as usize);
                let (x, y) = (index % frame.view.width, index / frame.view.width);
                let positions = corners.map(|corner| frame.solid.positions[corner]);
                let weights = frame.view.barycentric(positions, x, y);
                let of = corners.map(|corner| vertices[light * each + corner]);
                for (channel, out) in out.iter_mut().enumerate() {
                    *out = of[0][channel] * weights[0]
                        + of[1][channel] * weights[1]
                        + of[2][channel] * weights[2];
                }
            })
        }
    }
}

/// The radiosity at every vertex, a run of all vertices for each light.
fn at_vertices(frame: &Frame, matrices: &Buffer) -> Vec<[f32; 3]> {
    let each = frame.solid.positions.len();
    let mut values = vec![[0.0; 3]; frame.lights.len() * each];
    parallel::for_each_chunk(&mut values, super::RUN, |chunk, out| {
        for (offset, out) in out.iter_mut().enumerate() {
            let (light, vertex) =
                ((chunk * super::RUN + offset) / each, (chunk * super::RUN + offset) % each);
            let (point, normal) = (frame.solid.positions[vertex], frame.solid.normals[vertex]);
            *out = radiosity(frame, matrices.slice(light), point, normal);
        }
    });
    values
}

/// Eq. 10 at a point of the surface for the three matrices of one light.
fn radiosity(frame: &Frame, matrices: &[f32], point: Vec3, normal: Vec3) -> [f32; 3] {
    let (center, half) = (frame.viewed.center(), frame.viewed.half_extents());
    let from = if frame.settings.shift_cure { point } else { center };
    let (leaves, _) = exit(&frame.viewed, from, frame.refracted(point, normal));
    let lookup = ((leaves - center) / half).normalize_or_zero();
    std::array::from_fn(|channel| {
        let entries = &matrices[channel * 16..][..16];
        let matrix = std::array::from_fn(|row| std::array::from_fn(|column| entries[row * 4 + column]));
        let radiosity = irradiance::evaluate(&matrix, lookup);
        if frame.paper() { radiosity } else { max(radiosity, 0.0) }
    })
}
