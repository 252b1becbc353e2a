//! `translucency.shadow`: the distance from each casting light to the first surface (§2.2, Williams 1978).
//!
//! Decides errata T12: the recorded distance is linear, and radial for a point light, so that it may be
//! subtracted from a point's distance. Both readings have it so, since no other distance can be subtracted.
//! Beside it stand the rasterized depths of the first surface and of the second; `peel` is made from the
//! latter. One filling finds both (§3 fills twice). All are 0 where the light sees nothing.

use super::Frame;
use crate::numeric::{lanes::wide, parallel};
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, Preview, Twin};
use crate::raster::{ShadowView, two_depths};

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "translucency.shadow",
        equation: "§2.2; T12",
        about: "distance from the light to the first surface, its rasterized depth, and that of the second; 0 where there \
            is none",
        inputs: &[],
        axes: &[Axis::Caster, Axis::Row, Axis::Column, Axis::Channel(&["distance", "depth", "second"])],
        unit: "scene unit; depths in [0, 1], 1 nearest",
        knob: "translucency.shadow",
        twin: Twin::PLANNED,
        preview: &[Preview::Value, Preview::Value, Preview::Value],
    },
    run,
};

fn run(frame: &Frame, _: &Inputs<'_>) -> Buffer {
    let size = frame.settings.shadow;
    let solid = &frame.stage.solid;
    let maps: Vec<_> = frame
        .casters
        .iter()
        .map(|caster| two_depths(&solid.positions, &solid.triangles, &caster.shadow.view))
        .collect();
    let values = parallel::images([maps.len(), size * size * 3], size * 3, 0.0, |number, row, out| {
        let [first, second] = maps[number].each_ref().map(|depths| &depths[row * size..][..size]);
        let mut distances = vec![0.0; size];
        distances_of(&frame.casters[number].shadow, row, first, &mut distances);
        for (x, out) in out.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            *out = [distances[x], first[x], second[x]];
        }
    });
    Buffer::f32(&[frame.casters.len(), size, size, 3], values)
}

wide! {
    /// The distances of what a row of texels sees, from their rasterized depths. A texel that sees nothing
    /// has depth 0 and distance 0.
    pub(super) fn distances_of(shadow: &ShadowView, row: usize, depths: &[f32], out: &mut [f32]) {
        for (x, (out, depth)) in out.iter_mut().zip(depths).enumerate() {
            let distance = shadow.texel_distance(x, row, *depth);
            *out = if *depth > 0.0 { distance } else { 0.0 };
        }
    }
}
