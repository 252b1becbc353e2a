//! `translucency.final`: radiance towards the camera, L = Σ att(dᵢ) Bᵢ over the lights (Eq. 12 with a projection and
//! a thickness a light: errata T15), plus the direct light; lights are added in the scene's order.

use super::gbuffer::pixel;
use super::{Frame, Show};
use crate::numeric::parallel;
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, RGB};

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "translucency.final",
        equation: "Eq. 12, Eq. 3; T15",
        about: "the picture: attenuated radiosity and direct light of all lights",
        inputs: &[
            "translucency.gbuffer",
            "translucency.radiosity",
            "translucency.attenuation",
            "translucency.direct",
        ],
        axes: &[Axis::Row, Axis::Column, RGB],
        unit: "radiance",
    },
    run,
};

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let gbuffer = inputs.get("translucency.gbuffer");
    let [radiosity, attenuation, direct] = ["radiosity", "attenuation", "direct"]
        .map(|pass| inputs.get(&format!("translucency.{pass}")).as_f32());
    let pixels = frame.view.width * frame.view.height;
    let mut values = vec![0.0; pixels * 3];
    parallel::for_each_chunk(&mut values, 3 * super::RUN, |chunk, out| {
        for (offset, out) in out.chunks_exact_mut(3).enumerate() {
            let index = chunk * super::RUN + offset;
            if pixel(gbuffer, index).is_none() {
                out.copy_from_slice(&frame.background.to_array());
                continue;
            }
            for light in 0..frame.lights.len() {
                for (channel, out) in out.iter_mut().enumerate() {
                    let at = (light * pixels + index) * 3 + channel;
                    *out += match frame.settings.show {
                        Show::All => direct[at] + attenuation[at] * radiosity[at],
                        Show::Direct => direct[at],
                        Show::Scattered => attenuation[at] * radiosity[at],
                    };
                }
            }
        }
    });
    Buffer::f32(&[frame.view.height, frame.view.width, 3], values)
}
