//! `translucency.held`: where Eq. 12 was not computed with the thickness that was measured.
//!
//! The printed attenuation diverges as 1/d³ at d → 0 and is negative at d < 0 (errata T3). Its reading
//! ([`Reading::Paper`](crate::keys::Reading::Paper)) replaces a thickness of at most `smallest_d`, also a
//! negative one, by `smallest_d`. This is the mask of those pixels: they show the setting and not the
//! equation. The corrected attenuation is bounded, and holds a thickness at 0 alone.

use super::Frame;
use super::attenuation::measured;
use super::gbuffer::shade;
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, Preview, Twin};

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "translucency.held",
        equation: "Eq. 12; T3",
        about: "1 where the thickness was at or below the smallest with which the attenuation is computed, and was held",
        inputs: &["translucency.gbuffer", "translucency.thickness"],
        axes: &[Axis::Light, Axis::Row, Axis::Column, Axis::Channel(&["held"])],
        unit: "0 or 1",
        knob: "image.width",
        twin: Twin::PLANNED,
        preview: &[Preview::Value],
    },
    run,
};

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let (thickness, smallest) = (inputs.get("translucency.thickness"), frame.smallest_d());
    let gbuffer = inputs.get("translucency.gbuffer");
    shade(frame, gbuffer, frame.stage.lights.len(), |light, points, [held]| {
        let [d, _] = measured(frame, thickness, light, points);
        *held = d.map(|d| if d <= smallest { 1.0 } else { 0.0 });
    })
}
