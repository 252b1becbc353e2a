//! `translucency.thickness`: how far the light has come through the solid to each pixel's point (§2.2, fig.
//! 9).
//!
//! Decides errata T12: the thickness is the point's distance from the light less the blurred first distance,
//! both linear and radial; the subtraction is printed the other way round. Blurring and rounding make it
//! negative on lit surfaces, so it is held to d ≥ 0. As printed, depth less distance, it would be negative in
//! the whole solid, and Eq. 12 with it. The paper means a thickness, so its reading has the corrected order
//! too. That reading is not held: it records the negative d that blurring leaves.
//!
//! Decides T7, for concave solids: only what lies no deeper than the second surface receives scattered light;
//! beyond it the light has left the solid and entered again (point x_c of fig. 9). The test is made at four
//! texels, so the share that is received changes over the width of a texel and not at once. Without
//! `second_layer` every point receives, and x_c shines through as if the solid were full up to it.

use super::gbuffer::shade;
use super::lookup::{Footprints, slack};
use super::{Caster, Frame};
use crate::numeric::lanes::{BLOCK, wide};
use crate::numeric::order::max;
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, Preview, Twin};
use crate::raster::SurfacePoints;

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "translucency.thickness",
        equation: "§2.2, fig. 9; T7, T12",
        about: "distance through the solid along the light's ray, and the share of scattered light that is received",
        inputs: &["translucency.gbuffer", "translucency.blur", "translucency.peel"],
        axes: &[Axis::Caster, Axis::Row, Axis::Column, Axis::Channel(&["thickness", "receives"])],
        unit: "scene unit; share in [0, 1]",
        knob: "image.width",
        twin: Twin::PLANNED,
        preview: &[Preview::Value, Preview::Value],
    },
    run,
};

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let (blur, peel) = (inputs.get("translucency.blur"), inputs.get("translucency.peel"));
    shade(frame, inputs.get("translucency.gbuffer"), frame.casters.len(), |number, points, out| {
        thickness(frame, &frame.casters[number], blur.slice(number), peel.slice(number), points, out);
    })
}

wide! {
    fn thickness(
        frame: &Frame,
        caster: &Caster,
        first: &[f32],
        second: &[f32],
        points: &SurfacePoints,
        out: &mut [[f32; BLOCK]; 2],
    ) {
        let (shadow, light) = (&caster.shadow, frame.stage.lights[caster.light].casting());
        let footprints = Footprints::new(shadow, points);
        let first = footprints.gather(points.count, |texel| first[texel]);
        let second = footprints.gather(points.count, |texel| second[texel]);
        let (everywhere, as_measured) = (!frame.settings.second_layer, frame.paper());
        for lane in 0..BLOCK {
            let (point, normal) = (points.position(lane), points.normal(lane));
            let distance = shadow.distance(point);
            let d = distance - footprints.mean(&first, lane, distance);
            let limit = slack(shadow, point, normal.dot(light.arriving(point).0));
            // A texel without a second surface hides nothing.
            let receives =
                footprints.share(&second, lane, |second| (second == 0.0) | (distance <= second + limit));
            out[0][lane] = if as_measured { d } else { max(d, 0.0) };
            out[1][lane] = if everywhere { 1.0 } else { receives };
        }
    }
}
