//! `translucency.peel`: the distance from each casting light to the second surface, where the light that
//! entered at the first leaves again: one step of depth peeling (§3, Everitt 2001). Its depth is the greatest
//! below the first's, which `shadow` has found already.

use super::Frame;
use super::shadow::distances_of;
use crate::numeric::parallel;
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, Preview, Twin};

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "translucency.peel",
        equation: "§3, fig. 9; T7",
        about: "distance from the light to the second surface, 0 where there is none",
        inputs: &["translucency.shadow"],
        axes: &[Axis::Caster, Axis::Row, Axis::Column],
        unit: "scene unit",
        knob: "translucency.shadow",
        twin: Twin::PLANNED,
        preview: &[Preview::Value],
    },
    run,
};

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let shadow = inputs.get("translucency.shadow");
    let size = frame.settings.shadow;
    let count = frame.casters.len();
    let values = parallel::images([count, size * size], size, 0.0, |number, row, out| {
        let texels = shadow.slice(number)[row * size * 3..].as_chunks::<3>().0;
        let depths: Vec<f32> = texels.iter().take(size).map(|[_, _, second]| *second).collect();
        distances_of(&frame.casters[number].shadow, row, &depths, out);
    });
    Buffer::f32(&[count, size, size], values)
}
