//! `translucency.matrices`: three symmetric 4×4 matrices a light, one a colour, whose quadratic form is the
//! radiosity (Eq. 11 after Ramamoorthi and Hanrahan 2001). With several accumulation points (`points`), each
//! point has three.
//!
//! Decides errata T1 (the last row mirrors the last column), T9 (the constants are exact) and T10: the
//! constants already hold the clamped cosine, so a constant E gives B = πE; `attenuation` divides by that π.
//!
//! To the letter the last row has c₁E₁₁ and c₂E₂₋₁ where the last column has c₂E₁₁ and c₂E₁₋₁, and
//! the constants have six digits, of which c₂'s and c₃'s last is wrong; nothing divides by π.

use super::Frame;
use crate::keys::Reading;
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, RGB, Twin};
use crate::sphere::irradiance;

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "translucency.matrices",
        equation: "Eq. 11; T1, T9, T10",
        about: "for each accumulation point and colour the matrix M of B(r) = [r, 1]ᵗ M [r, 1]; a single point has no axis",
        inputs: &["translucency.projection"],
        axes: &[
            Axis::Light,
            Axis::Several("point"),
            RGB,
            Axis::Of("row of matrix"),
            Axis::Of("column of matrix"),
        ],
        unit: "irradiance",
        knob: "translucency.accumulation",
        twin: Twin::PLANNED,
        preview: &[],
    },
    run,
};

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let projection = inputs.get("translucency.projection");
    let lights = frame.stage.lights.len();
    let mut values = Vec::with_capacity(lights * frame.points.count() * 48);
    for terms in projection.as_f32().chunks_exact(27) {
        let coefficients = std::array::from_fn(|i| [terms[3 * i], terms[3 * i + 1], terms[3 * i + 2]]);
        let matrices = match frame.settings.reading {
            Reading::Corrected => irradiance::matrix(&coefficients),
            Reading::Paper => irradiance::matrix_as_printed(&coefficients),
        };
        values.extend(matrices.iter().flatten().flatten());
    }
    Buffer::f32(&frame.points.shape(lights, &[3, 4, 4]), values)
}
