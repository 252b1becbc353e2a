//! `translucency.final`: radiance towards the camera, L = Σ att(dᵢ) Bᵢ over the lights (Eq. 12 with a
//! projection and a thickness a light: errata T15), plus the direct light; lights are added in the scene's
//! order.

use super::{Frame, Show};
use crate::numeric::{lanes::wide, parallel};
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, Preview, RGB, Twin};

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
        knob: "image.width",
        twin: Twin::PLANNED,
        preview: &[Preview::Picture],
    },
    run,
};

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let [gbuffer, radiosity, attenuation, direct] = ["gbuffer", "radiosity", "attenuation", "direct"]
        .map(|pass| inputs.get(&format!("translucency.{pass}")).as_f32());
    let pixels = frame.view.width * frame.view.height;
    let values = parallel::images([1, pixels * 3], 3 * super::RUN, 0.0, |_, chunk, out| {
        let first = chunk * super::RUN;
        for light in 0..frame.stage.lights.len() {
            let start = (light * pixels + first) * 3;
            let at = start..start + out.len();
            add(frame.settings.show, &direct[at.clone()], &attenuation[at.clone()], &radiosity[at], out);
        }
        let depths = gbuffer[first * 7..].chunks_exact(7).map(|texel| texel[6]);
        for (out, depth) in out.chunks_exact_mut(3).zip(depths) {
            if depth <= 0.0 {
                out.copy_from_slice(&frame.stage.background.to_array());
            }
        }
    });
    Buffer::f32(&[frame.view.height, frame.view.width, 3], values)
}

wide! {
    fn add(show: Show, direct: &[f32], attenuation: &[f32], radiosity: &[f32], out: &mut [f32]) {
        let scattered = attenuation.iter().zip(radiosity).map(|(attenuation, radiosity)| attenuation * radiosity);
        match show {
            Show::All => out.iter_mut().zip(direct.iter().zip(scattered)).for_each(|(out, (a, b))| *out += a + b),
            Show::Direct => out.iter_mut().zip(direct).for_each(|(out, direct)| *out += direct),
            Show::Scattered => out.iter_mut().zip(scattered).for_each(|(out, scattered)| *out += scattered),
        }
    }
}
