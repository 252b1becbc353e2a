//! `translucency.gbuffer`: position, normal and depth of what each pixel of the camera sees.

use super::Frame;
use crate::numeric::parallel;
use crate::pass::{Axis, Buffer, Info, Inputs, Pass};
use crate::raster::{NONE, surface};
use glam::Vec3;

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "translucency.gbuffer",
        equation: "-",
        about: "position, unit normal and depth along the view's axis; all 0 where the camera sees nothing",
        inputs: &["translucency.visibility"],
        axes: &[Axis::Row, Axis::Column, Axis::Channel(&["x", "y", "z", "nx", "ny", "nz", "depth"])],
        unit: "scene unit",
    },
    run,
};

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let seen = inputs.get("translucency.visibility").as_u32();
    let (view, width) = (&frame.view, frame.view.width);
    let forward = view.clip_from_world[3];
    let mut values = vec![0.0; seen.len() * 7];
    parallel::for_each_chunk(&mut values, 7 * super::RUN, |chunk, out| {
        for (offset, out) in out.chunks_exact_mut(7).enumerate() {
            let index = chunk * super::RUN + offset;
            if seen[index] != NONE {
                let (p, n) = surface(&frame.solid, view, seen[index], index % width, index / width);
                let depth = forward[0] * p.x + forward[1] * p.y + forward[2] * p.z + forward[3];
                out.copy_from_slice(&[p.x, p.y, p.z, n.x, n.y, n.z, depth]);
            }
        }
    });
    Buffer::f32(&[view.height, width, 7], values)
}

/// Position and normal of pixel `index`, if it sees a surface: surfaces lie beyond the near plane, at a positive
/// depth.
#[inline]
pub(super) fn pixel(gbuffer: &Buffer, index: usize) -> Option<(Vec3, Vec3)> {
    let texel = &gbuffer.as_f32()[index * 7..][..7];
    (texel[6] > 0.0).then(|| (Vec3::from_slice(&texel[..3]), Vec3::from_slice(&texel[3..6])))
}

/// An image with `channels` values a pixel for each of `count` lights or casters, 0 where the camera sees nothing:
/// `shade(number, index, position, normal, out)` fills a pixel that sees a surface.
pub(super) fn shade(
    frame: &Frame,
    gbuffer: &Buffer,
    count: usize,
    channels: usize,
    shade: impl Fn(usize, usize, Vec3, Vec3, &mut [f32]) + Sync,
) -> Buffer {
    let pixels = frame.view.width * frame.view.height;
    let mut values = vec![0.0; count * pixels * channels];
    parallel::for_each_chunk(&mut values, channels * super::RUN, |chunk, out| {
        for (offset, out) in out.chunks_exact_mut(channels).enumerate() {
            let index = chunk * super::RUN + offset;
            if let Some((point, normal)) = pixel(gbuffer, index % pixels) {
                shade(index / pixels, index % pixels, point, normal, out);
            }
        }
    });
    Buffer::f32(&[count, frame.view.height, frame.view.width, channels], values)
}
