//! `translucency.thickness`: how far the light has come through the solid to each pixel's point (§2.2, fig. 9).
//!
//! Decides errata T12: the thickness is the point's distance from the light less the blurred first distance, both
//! linear and radial; the subtraction is printed the other way round. Blurring and rounding make it negative on lit
//! surfaces: it is held to d ≥ 0. The letter's depth less the distance is negative in the solid, where it would make
//! Eq. 12 negative everywhere; the paper means a thickness, so its reading has the corrected order too, but is not
//! held: it records the negative d that blurring leaves.
//!
//! And T7, of concave solids: only what lies no deeper than the second surface receives scattered light; beyond it the
//! light has left the solid and entered again (point x_c of fig. 9). The test is made at four texels, so the share that
//! is received changes over the width of a texel and not at once. Without `second_layer` every point receives, and x_c
//! shines through as if the solid were full up to it.

use super::gbuffer::shade;
use super::lookup::{Footprint, slack};
use super::{Caster, Frame};
use crate::numeric::order::max;
use crate::pass::{Axis, Buffer, Info, Inputs, Pass};

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "translucency.thickness",
        equation: "§2.2, fig. 9; T7, T12",
        about: "distance through the solid along the light's ray, and the share of scattered light that is received",
        inputs: &["translucency.gbuffer", "translucency.blur", "translucency.peel"],
        axes: &[Axis::Caster, Axis::Row, Axis::Column, Axis::Channel(&["thickness", "receives"])],
        unit: "scene unit; share in [0, 1]",
    },
    run,
};

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let (blur, peel) = (inputs.get("translucency.blur"), inputs.get("translucency.peel"));
    let count = frame.casters.len();
    shade(frame, inputs.get("translucency.gbuffer"), count, 2, |number, _, point, normal, out| {
        let (first, second) = (blur.slice(number), peel.slice(number));
        let Caster { shadow, light } = &frame.casters[number];
        let footprint = Footprint::new(shadow, point);
        let distance = shadow.distance(point);
        let entered = footprint.mean(|texel| first[texel]).unwrap_or(distance);
        let cosine = frame.lights[*light].arriving(point).map_or(0.0, |(towards, _)| normal.dot(towards));
        let slack = slack(shadow, point, cosine);
        // A texel without a second surface hides nothing.
        let receives = match frame.settings.second_layer {
            true => footprint.share(|texel| second[texel] == 0.0 || distance <= second[texel] + slack),
            false => 1.0,
        };
        let d = distance - entered;
        out.copy_from_slice(&[if frame.paper() { d } else { max(d, 0.0) }, receives]);
    })
}
