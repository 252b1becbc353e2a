//! `translucency.shadow`: the distance from each casting light to the first surface (§2.2, Williams 1978).
//!
//! Decides errata T12: the recorded distance is linear, and radial for a point light, so that it may be subtracted
//! from a point's distance; under both readings, as nothing else can be. Beside it stands the rasterized depth, by which
//! `peel` tells the second surface from the first without rounding. Both are 0 where the light sees nothing.

use super::Frame;
use crate::pass::{Axis, Buffer, Info, Inputs, Pass};
use crate::raster::{NONE, visibility};

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "translucency.shadow",
        equation: "§2.2; T12",
        about: "distance from the light to the first surface, 0 where there is none, and its rasterized depth",
        inputs: &[],
        axes: &[Axis::Caster, Axis::Row, Axis::Column, Axis::Channel(&["distance", "depth"])],
        unit: "scene unit; depth in [0, 1], 1 nearest",
    },
    run,
};

fn run(frame: &Frame, _: &Inputs<'_>) -> Buffer {
    let size = frame.settings.shadow;
    let mut values = Vec::with_capacity(frame.casters.len() * size * size * 2);
    for caster in &frame.casters {
        let solid = &frame.solid;
        let visible = visibility(&solid.positions, &solid.triangles, &caster.shadow.view, None);
        for (index, (triangle, depth)) in visible.triangle.iter().zip(&visible.depth).enumerate() {
            let distance = match *triangle {
                NONE => 0.0,
                _ => caster.shadow.texel_distance(index % size, index / size, *depth),
            };
            values.extend([distance, *depth]);
        }
    }
    Buffer::f32(&[frame.casters.len(), size, size, 2], values)
}
