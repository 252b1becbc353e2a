//! `translucency.radiosity`: B = [r, 1]ᵗ M [r, 1] with the refracted direction r (Eq. 10, which stands for Eq. 5).
//!
//! Decides errata T5 (the hemisphere of Eq. 5 is about r, so B is not negative for a cubemap that is not) and T13:
//! r depends on the view as well as on the normal; M takes the 4-vector (r, 1).
//!
//! The accumulation point is the box's centre, the point that is shaded lies elsewhere: the lookup follows the
//! refracted ray from the point to where it leaves the bounding box, and takes the direction from the centre to
//! there, in the frame in which the box is a cube (§3: the cure of shift, with that of blindness).
//! Nine coefficients ring below zero opposite a bright side; B is held to ≥ 0. To the letter it is what Eq. 10 gives.

use super::Frame;
use super::gbuffer::shade;
use crate::numeric::order::max;
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, RGB};
use crate::sphere::irradiance;

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "translucency.radiosity",
        equation: "Eq. 10, Eq. 5; T5, T7, T13",
        about: "the light that the refracted direction collects, looked up where its ray leaves the bounding box",
        inputs: &["translucency.gbuffer", "translucency.matrices"],
        axes: &[Axis::Light, Axis::Row, Axis::Column, RGB],
        unit: "irradiance",
    },
    run,
};

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let matrices = inputs.get("translucency.matrices");
    let (center, half) = (frame.bounds.center(), frame.bounds.half_extents());
    shade(frame, inputs.get("translucency.gbuffer"), frame.lights.len(), 3, |light, _, point, normal, out| {
        let (leaves, _) = frame.exit(point, frame.refracted(point, normal));
        let lookup = ((leaves - center) / half).normalize_or_zero();
        for (out, matrix) in out.iter_mut().zip(matrices.slice(light).chunks_exact(16)) {
            let matrix = std::array::from_fn(|row| std::array::from_fn(|column| matrix[row * 4 + column]));
            let radiosity = irradiance::evaluate(&matrix, lookup);
            *out = if frame.paper() { radiosity } else { max(radiosity, 0.0) };
        }
    })
}
