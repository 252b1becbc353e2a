//! `translucency.peel`: the distance from each casting light to the second surface, by one step of depth peeling
//! (§3, Everitt 2001): where the light that entered at the first surface leaves again.

use super::Frame;
use super::shadow::distances_of;
use crate::numeric::parallel;
use crate::pass::{Axis, Buffer, Info, Inputs, Pass};
use crate::raster::visibility;

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
    let mut values = vec![0.0; frame.casters.len() * size * size];
    let maps = values.chunks_exact_mut(size * size);
    for (number, (caster, map)) in frame.casters.iter().zip(maps).enumerate() {
        let first: Vec<f32> = shadow.slice(number).chunks_exact(2).map(|texel| texel[1]).collect();
        let solid = &frame.solid;
        let visible = visibility(&solid.positions, &solid.triangles, &caster.shadow.view, Some(&first));
        parallel::for_each_chunk(map, size, |row, out| {
            distances_of(&caster.shadow, row, &visible.depth[row * size..][..size], out);
        });
    }
    Buffer::f32(&[frame.casters.len(), size, size], values)
}
