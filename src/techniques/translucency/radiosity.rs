//! `translucency.radiosity`: B = [r, 1]ᵗ M [r, 1] with the refracted direction r (Eq. 10, which stands for
//! Eq. 5).
//!
//! Decides errata T5 (the hemisphere of Eq. 5 is about r, so B is not negative for a cubemap that is not) and
//! T13: r depends on the view as well as on the normal; M takes the 4-vector (r, 1).
//!
//! The accumulation point is the box's centre, but the shaded point lies elsewhere. So the lookup follows the
//! refracted ray from the shaded point to where it leaves the bounding box. It takes the direction from the
//! centre to there, in the frame in which the box is a cube (§3: the cure of shift, with that of blindness).
//! With several accumulation points (`points`), those around the shaded one are interpolated, each with a
//! lookup from itself.
//!
//! Without `shift_cure` the refracted ray starts in the centre (fig. 7a). Without `blindness_cure` the box is
//! the cube that the views of `cubemap` fill, and the ray may point at a texel that is empty (fig. 7b).
//!
//! Fig. 6 compares two evaluations: at each pixel, or with `evaluation = "vertex"` at each vertex. The latter
//! takes the vertex's refracted direction and lookup, and interpolates with the weights of position and
//! normal.
//!
//! Nine coefficients ring below zero opposite a bright side, so B is held to ≥ 0. To the letter it is what
//! Eq. 10 gives.

use super::frame::exit;
use super::gbuffer::shade;
use super::{Evaluation, Frame};
use crate::numeric::lanes::{BLOCK, wide};
use crate::numeric::vector::unit_or_zero;
use crate::numeric::{order::max, parallel};
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, Preview, RGB, Twin};
use crate::raster::SurfacePoints;
use crate::sphere::irradiance;
use glam::Vec3;

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "translucency.radiosity",
        equation: "Eq. 10, Eq. 5, fig. 6 and 7; T5, T7, T13",
        about: "the light that the refracted direction collects, looked up where its ray leaves the bounding box",
        inputs: &["translucency.vbuffer", "translucency.gbuffer", "translucency.matrices"],
        axes: &[Axis::Light, Axis::Row, Axis::Column, RGB],
        unit: "irradiance",
        knob: "image.width",
        twin: Twin::PLANNED,
        preview: &[Preview::Colour],
    },
    run,
};

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let seen = inputs.get("translucency.vbuffer").as_u32();
    let (gbuffer, matrices) = (inputs.get("translucency.gbuffer"), inputs.get("translucency.matrices"));
    let count = frame.stage.lights.len();
    let matrices: Vec<_> = (0..count).map(|light| of_points(matrices.slice(light))).collect();
    match frame.settings.evaluation {
        Evaluation::Pixel => shade(frame, gbuffer, count, |light, points, out| match &matrices[light][..] {
            [one] => radiosities(frame, one, points, out),
            several => {
                for lane in 0..points.count {
                    [out[0][lane], out[1][lane], out[2][lane]] =
                        interpolated(frame, several, points.position(lane), points.normal(lane));
                }
            }
        }),
        Evaluation::Vertex => {
            let vertices: Vec<_> = matrices.iter().map(|matrices| at_vertices(frame, matrices)).collect();
            shade(frame, gbuffer, count, |light, points, out: &mut [_; 3]| {
                for lane in 0..points.count {
                    let pixel = points.pixel[lane] as usize;
                    let corners =
                        frame.stage.solid.triangles[seen[pixel] as usize].map(|corner| corner as usize);
                    let (x, y) = (pixel % frame.view.width, pixel / frame.view.width);
                    let positions = corners.map(|corner| frame.stage.solid.positions[corner]);
                    let weights = frame.view.barycentric(positions, frame.view.ndc(x, y));
                    let of = corners.map(|corner| vertices[light][corner]);
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
type Matrices = [[[f32; 4]; 4]; 3];

/// The matrices of one light for each accumulation point.
fn of_points(entries: &[f32]) -> Vec<Matrices> {
    let entry = |of: &[f32], row: usize| [0, 1, 2, 3].map(|column| of[row * 4 + column]);
    let three = |of: &[f32]| [0, 4, 8].map(|first| [0, 1, 2, 3].map(|row| entry(of, first + row)));
    entries.chunks_exact(48).map(three).collect()
}

/// The radiosity at every vertex for the matrices of one light.
fn at_vertices(frame: &Frame, matrices: &[Matrices]) -> Vec<[f32; 3]> {
    let mut values = vec![[0.0; 3]; frame.stage.solid.positions.len()];
    parallel::for_each_chunk(&mut values, super::RUN, |chunk, out| {
        for (vertex, out) in (chunk * super::RUN..).zip(out) {
            let (point, normal) = (frame.stage.solid.positions[vertex], frame.stage.solid.normals[vertex]);
            *out = match matrices {
                [one] => radiosity(frame, one, point, normal),
                several => interpolated(frame, several, point, normal),
            };
        }
    });
    values
}

wide! {
    /// The radiosity at points of the surface for the matrices of the one accumulation point.
    fn radiosities(frame: &Frame, matrices: &Matrices, points: &SurfacePoints, out: &mut [[f32; BLOCK]; 3]) {
        for lane in 0..BLOCK {
            [out[0][lane], out[1][lane], out[2][lane]] =
                radiosity(frame, matrices, points.position(lane), points.normal(lane));
        }
    }
}

/// Eq. 10 for the matrices of the one accumulation point.
#[inline(always)]
fn radiosity(frame: &Frame, matrices: &Matrices, point: Vec3, normal: Vec3) -> [f32; 3] {
    let (center, half) = (frame.viewed.center(), frame.viewed.half_extents());
    let from = if frame.settings.shift_cure { point } else { center };
    let (leaves, _) = exit(&frame.viewed, from, frame.refracted(point, normal));
    evaluate(frame, matrices, unit_or_zero((leaves - center) / half))
}

/// Eq. 10 for the matrices of each of several accumulation points, interpolated between those around `point`.
fn interpolated(frame: &Frame, matrices: &[Matrices], point: Vec3, normal: Vec3) -> [f32; 3] {
    let (center, half, points) = (frame.viewed.center(), frame.viewed.half_extents(), frame.points);
    let cured = frame.settings.shift_cure;
    let (leaves, _) = exit(&frame.viewed, if cured { point } else { center }, frame.refracted(point, normal));
    let leaves = (leaves - center) / half * points.scale();
    let mut total = [0.0; 3];
    for (index, weight) in points.around((point - center) / half) {
        // Uncured, the ray starts in the centre, and its direction is the same from every point.
        let from = if cured { points.place(index) } else { Vec3::ZERO };
        let here = evaluate(frame, &matrices[index], unit_or_zero(leaves - from));
        for (total, here) in total.iter_mut().zip(here) {
            *total += weight * here;
        }
    }
    total
}

/// [lookup, 1]ᵗ M [lookup, 1] for each of three matrices.
#[inline(always)]
fn evaluate(frame: &Frame, matrices: &Matrices, lookup: Vec3) -> [f32; 3] {
    let held = |channel: usize| {
        let radiosity = irradiance::evaluate(&matrices[channel], lookup);
        if frame.paper() { radiosity } else { max(radiosity, 0.0) }
    };
    [held(0), held(1), held(2)]
}
