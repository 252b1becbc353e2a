//! `translucency.gbuffer`: position, normal and depth of what each pixel of the camera sees.

use super::Frame;
use crate::numeric::lanes::BLOCK;
use crate::numeric::{order::min, parallel};
use crate::pass::{Axis, Buffer, Info, Inputs, Pass, Preview, Twin};
use crate::raster::{SurfacePoints, surfaces};

pub(super) const PASS: Pass<Frame> = Pass {
    info: Info {
        name: "translucency.gbuffer",
        equation: "-",
        about: "position, unit normal and depth along the view's axis; all 0 where the camera sees nothing",
        inputs: &["translucency.vbuffer"],
        axes: &[Axis::Row, Axis::Column, Axis::Channel(&["x", "y", "z", "nx", "ny", "nz", "depth"])],
        unit: "scene unit",
        knob: "image.width",
        twin: Twin::PLANNED,
        preview: &[Preview::Place, Preview::Direction, Preview::Value],
    },
    run,
};

fn run(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let seen = inputs.get("translucency.vbuffer").as_u32();
    let view = &frame.view;
    let forward = view.clip_from_world[3];
    let values = parallel::images([1, seen.len() * 7], 7 * super::RUN, 0.0, |_, chunk, out| {
        let first = chunk * super::RUN;
        surfaces(&frame.stage.solid, view, &seen[first..][..out.len() / 7], first, |points| {
            for lane in 0..points.count {
                let (p, n) = (points.position(lane), points.normal(lane));
                let depth = forward[0] * p.x + forward[1] * p.y + forward[2] * p.z + forward[3];
                let at = (points.pixel[lane] as usize - first) * 7;
                out[at..at + 7].copy_from_slice(&[p.x, p.y, p.z, n.x, n.y, n.z, depth]);
            }
        });
    });
    Buffer::f32(&[view.height, view.width, 7], values)
}

/// Makes an image of `CHANNELS` channels for each of `count` lights or casters, 0 where the camera sees
/// nothing. `shade(number, points, out)` computes the channels of several points at once, which pixels see.
/// Surfaces lie beyond the near plane, so their depth is positive.
pub(super) fn shade<const CHANNELS: usize>(
    frame: &Frame,
    gbuffer: &Buffer,
    count: usize,
    shade: impl Fn(usize, &SurfacePoints, &mut [[f32; BLOCK]; CHANNELS]) + Sync,
) -> Buffer {
    let (pixels, texels) = (frame.view.width * frame.view.height, gbuffer.as_f32());
    let size = [count, pixels * CHANNELS];
    let values = parallel::images(size, CHANNELS * super::RUN, 0.0, |number, chunk, out| {
        let first = chunk * super::RUN;
        let run = texels[first * 7..min(first + super::RUN, pixels) * 7].as_chunks::<7>().0;
        // The pixels that see a surface, collected without a branch.
        let (mut covered, mut count) = ([0_u16; super::RUN], 0);
        for (pixel, texel) in run.iter().enumerate() {
            covered[count] = pixel as u16;
            count += usize::from(texel[6] > 0.0);
        }
        let (mut points, mut shaded) = (SurfacePoints::NONE, [[0.0; BLOCK]; CHANNELS]);
        for covered in covered[..count].chunks(BLOCK) {
            points.count = covered.len();
            for (lane, pixel) in covered.iter().enumerate() {
                let texel = run[usize::from(*pixel)];
                points.pixel[lane] = first as u32 + u32::from(*pixel);
                for axis in 0..3 {
                    points.position[axis][lane] = texel[axis];
                    points.normal[axis][lane] = texel[3 + axis];
                }
            }
            shade(number, &points, &mut shaded);
            let (out, _) = out.as_chunks_mut::<CHANNELS>();
            for (lane, pixel) in covered.iter().enumerate() {
                out[usize::from(*pixel)] = std::array::from_fn(|channel| shaded[channel][lane]);
            }
        }
    });
    Buffer::f32(&[count, frame.view.height, frame.view.width, CHANNELS], values)
}
