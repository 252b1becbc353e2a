//! `translucency.cubemap`: irradiance on the solid as six cameras outside see it (§2.1, fig. 3, fig. 8).
//!
//! Decides errata T14: the six views are orthographic, and each exactly fills its face of the bounding box,
//! which is thereby scaled to a cube (the cure of blindness, fig. 8). Texel and direction then agree with the
//! ray-box correction of `radiosity`: a texel stands for the point of the box's face that it covers, and in
//! the cube's frame for the direction from the centre to that point. Perspective views would need a distance
//! that the paper does not give, and would see less than the whole face.
//!
//! Without `blindness_cure` the views fill the faces of the cube about the box (fig. 7b): unscaled, the solid
//! leaves a part of a face empty wherever its box is shorter than the longest side.
//!
//! The paper renders "the illuminated object" without saying whether it shades itself. Here it does not: no
//! part of a convex solid shades another, and the paper's model is of convex solids.
//!
//! An environment lights by its irradiance at the normal, and enters at the one cosine whose Schlick
//! transmittance is that of diffuse light.

use super::Frame;
use crate::numeric::{order::max, parallel};
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, Preview, Twin};
use crate::raster::{Axes, View, surfaces, visibility};
use crate::sphere::irradiance;
use crate::world::medium::Medium;
use glam::Vec3;

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "translucency.cubemap",
        equation: "§2.1, fig. 3 and 8; T14",
        about: "irradiance on the solid seen by six orthographic cameras on the faces of its bounding box, and the cosine at which the light arrives",
        inputs: &[],
        axes: &[Axis::Light, Axis::Face, Axis::Row, Axis::Column, Axis::Channel(&["R", "G", "B", "cosine"])],
        unit: "irradiance; cosine in [0, 1]",
        knob: "translucency.cubemap",
        twin: Twin::PLANNED,
        preview: &[Preview::Colour, Preview::Value],
    },
    run,
};

/// The right and up axes of the six faces seen from outside; a face's own axis is right × up.
pub(super) const FACES: [[Vec3; 2]; 6] = [
    [Vec3::NEG_Z, Vec3::Y],
    [Vec3::Z, Vec3::Y],
    [Vec3::X, Vec3::NEG_Z],
    [Vec3::X, Vec3::Z],
    [Vec3::X, Vec3::Y],
    [Vec3::NEG_X, Vec3::Y],
];

/// The view of one face.
pub(super) fn face_view(frame: &Frame, [right, up]: [Vec3; 2]) -> View {
    let half = frame.viewed.half_extents();
    let extent = |axis: Vec3| half.dot(axis.abs());
    let axes = Axes { right, up, forward: up.cross(right) };
    let depth = extent(axes.forward) * 1.01; // a little more than the box, so that rounding cannot clip its faces
    let size = frame.settings.cubemap;
    View::orthographic(
        frame.viewed.center(),
        axes,
        [extent(right), extent(up)],
        [-depth, depth],
        [size, size],
    )
}

fn run(frame: &Frame, _: &Inputs<'_>) -> Buffer {
    let (solid, size) = (&frame.stage.solid, frame.settings.cubemap);
    let faces = parallel::map(6, |face| {
        let view = face_view(frame, FACES[face]);
        (visibility(&solid.positions, &solid.triangles, &view).triangle, view)
    });
    let images = [frame.stage.lights.len() * 6, size * size * 4];
    let values = parallel::images(images, 4 * super::RUN, 0.0, |number, chunk, out| {
        let (light, (seen, view)) = (number / 6, &faces[number % 6]);
        let first = chunk * super::RUN;
        surfaces(solid, view, &seen[first..][..out.len() / 4], first, |points| {
            for lane in 0..points.count {
                let (irradiance, cosine) =
                    illuminated(frame, light, points.position(lane), points.normal(lane));
                let at = (points.pixel[lane] as usize - first) * 4;
                out[at..at + 4].copy_from_slice(&[irradiance.x, irradiance.y, irradiance.z, cosine]);
            }
        });
    });
    Buffer::f32(&[frame.stage.lights.len(), 6, size, size, 4], values)
}

/// Irradiance on a surface, and the cosine at which it arrives.
fn illuminated(frame: &Frame, light: usize, point: Vec3, normal: Vec3) -> (Vec3, f32) {
    if let Some(matrices) = &frame.irradiance[light] {
        // Nine coefficients of a bright source ring below zero on its far side.
        let channel = |matrix| max(irradiance::evaluate(matrix, normal), 0.0);
        return (Vec3::from_array(matrices.each_ref().map(channel)), Medium::diffuse_cosine());
    }
    let (towards, facing) = frame.stage.lights[light].casting().arriving(point);
    let cosine = max(normal.dot(towards), 0.0);
    (facing * cosine, cosine)
}
