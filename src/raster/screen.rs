//! Vertices on the screen: projected, snapped to 1/256 pixel, with a code of the sides of the image that they
//! lie beyond.

use super::{SUBPIXELS, View};
use crate::numeric::lanes::{BLOCK, WHOLE, wide};
use crate::numeric::parallel;
use glam::Vec3;

/// Vertices that one thread projects together.
const RUN: usize = 64 * BLOCK;

/// A vertex on the screen: x and y (down) in 1/256 pixel, the bits of the reversed depth, and the code of
/// what it lies beyond. The first three are without meaning where the code has [`CLIP`] or [`LOST`].
pub(super) type Projected = [i32; 4];

const LEFT: i32 = 1;
const RIGHT: i32 = 2;
const BELOW: i32 = 4;
const ABOVE: i32 = 8;
/// Beyond one side of the image.
pub(super) const SIDES: i32 = LEFT | RIGHT | BELOW | ABOVE;
/// Before the near plane or beyond the guard band.
pub(super) const CLIP: i32 = 16;
/// The projection overflowed: its triangles are left out.
pub(super) const LOST: i32 = 32;

/// The vertices of a mesh on the screen of a view.
pub(super) fn project(positions: &[Vec3], view: &View) -> Vec<Projected> {
    parallel::images([1, positions.len()], RUN, [0; 4], |_, chunk, out| {
        run(&positions[chunk * RUN..][..out.len()], view, out);
    })
}

wide! {
    fn run(positions: &[Vec3], view: &View, out: &mut [Projected]) {
        for (out, positions) in out.chunks_mut(BLOCK).zip(positions.chunks(BLOCK)) {
            block(positions, view, out);
        }
    }
}

#[inline(always)]
fn block(positions: &[Vec3], view: &View, out: &mut [Projected]) {
    let mut at = [[0.0_f32; BLOCK]; 3];
    for (lane, position) in positions.iter().enumerate() {
        (at[0][lane], at[1][lane], at[2][lane]) = (position.x, position.y, position.z);
    }
    let guard = view.guard();
    let (mut x, mut y, mut z, mut code) = ([0; BLOCK], [0; BLOCK], [0; BLOCK], [0; BLOCK]);
    for lane in 0..BLOCK {
        let clip = view.project(Vec3::new(at[0][lane], at[1][lane], at[2][lane]));
        [x[lane], y[lane], z[lane]] = snap(clip, view);
        code[lane] = beyond(clip, guard);
    }
    for (lane, out) in out.iter_mut().enumerate() {
        *out = [x[lane], y[lane], z[lane], code[lane]];
    }
}

/// What clip coordinates lie beyond, by the signs of `clip::planes`, written as comparisons.
#[inline(always)]
fn beyond([x, y, z, w]: [f32; 4], [guard_x, guard_y]: [f32; 2]) -> i32 {
    let side = |outside: bool, code: i32| if outside { code } else { 0 };
    // For w < 0 the comparisons are those of the plane too: x ≥ −w is a half-space whatever the sign of w.
    side(x < -w, LEFT)
        | side(x > w, RIGHT)
        | side(y < -w, BELOW)
        | side(y > w, ABOVE)
        | side((z > w) | (x < -(guard_x * w)) | (x > guard_x * w), CLIP)
        | side((y < -(guard_y * w)) | (y > guard_y * w), CLIP)
        | side(!(x + y + z + w).is_finite(), LOST)
}

/// x and y snapped to 1/256 pixel, half to even, and the bits of the depth.
#[inline(always)]
pub(super) fn snap(clip: [f32; 4], view: &View) -> [i32; 3] {
    let whole = |at: f32| (f64::from(at * SUBPIXELS as f32) + WHOLE).to_bits() as i32;
    let [x, y] = view.pixel(clip);
    [whole(x), whole(y), (clip[2] / clip[3]).to_bits() as i32]
}
