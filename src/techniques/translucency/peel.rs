//! `translucency.peel`: the distance from each casting light to the second surface, by one step of depth peeling
//! (§3, Everitt 2001): where the light that entered at the first surface leaves again.

use super::Frame;
use crate::pass::{Axis, Buffer, Info, Inputs, Pass};
use crate::raster::{NONE, visibility};

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "translucency.peel",
        equation: "§3, fig. 9; T7",
        about: "distance from the light to the second surface, 0 where there is none",
        inputs: &["translucency.shadow"],
        axes: &[Axis::Caster, Axis::Row, Axis::Column],
        unit: "scene unit",
    },
    run,
};

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let shadow = inputs.get("translucency.shadow");
    let size = frame.settings.shadow;
    let mut values = Vec::with_capacity(frame.casters.len() * size * size);
    for (number, caster) in frame.casters.iter().enumerate() {
        let first: Vec<f32> = shadow.slice(number).chunks_exact(2).map(|texel| texel[1]).collect();
        let solid = &frame.solid;
        let visible = visibility(&solid.positions, &solid.triangles, &caster.shadow.view, Some(&first));
        values.extend(visible.triangle.iter().zip(&visible.depth).enumerate().map(
            |(index, (triangle, depth))| match *triangle {
                NONE => 0.0,
                _ => caster.shadow.texel_distance(index % size, index / size, *depth),
            },
        ));
    }
    Buffer::f32(&[frame.casters.len(), size, size], values)
}
