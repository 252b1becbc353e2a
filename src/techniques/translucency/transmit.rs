//! `translucency.transmit`: the irradiance that enters, F_t(η, ω_in) E (§2.1), with Schlick's approximation
//! of the Fresnel transmittance (Schlick 1994) at the cosine that `cubemap` recorded.

use super::Frame;
use crate::numeric::parallel;
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, Preview, RGB, Twin};

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "translucency.transmit",
        equation: "§2.1, Schlick 1994",
        about: "the irradiance that the surface lets in: Fresnel transmittance times the cubemap",
        inputs: &["translucency.cubemap"],
        axes: &[Axis::Light, Axis::Face, Axis::Row, Axis::Column, RGB],
        unit: "irradiance",
        knob: "translucency.cubemap",
        twin: Twin::PLANNED,
        preview: &[Preview::Colour],
    },
    run,
};

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let cubemap = inputs.get("translucency.cubemap");
    let texels = cubemap.as_f32();
    let values = parallel::images([1, texels.len() / 4 * 3], 3 * super::RUN, 0.0, |_, chunk, out| {
        let texels = texels[chunk * super::RUN * 4..].chunks_exact(4);
        for (out, texel) in out.chunks_exact_mut(3).zip(texels) {
            let transmittance = frame.stage.medium.transmittance(texel[3]);
            out.copy_from_slice(&[
                transmittance * texel[0],
                transmittance * texel[1],
                transmittance * texel[2],
            ]);
        }
    });
    let mut shape = cubemap.shape.clone();
    shape[4] = 3;
    Buffer::f32(&shape, values)
}
