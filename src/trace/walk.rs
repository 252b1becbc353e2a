//! A ray's walk through a tree.
//!
//! The children of a node that a ray enters stay together as one entry of the stack. The nearest child of the
//! top entry is visited next. So a node needs neither a loop over its children nor a sort, whose branches no
//! processor predicts.

use super::node::{Block, LEVELS, Node, Parts, WIDTH};
use super::triangle::{Shear, Slabs};
use super::{Hit, Ray};
use std::mem::MaybeUninit;

/// What the tests of boxes and triangles need of a ray.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sight {
    pub(super) slabs: Slabs,
    pub(super) shear: Shear,
    /// The sheared origin.
    pub(super) origin: [f64; 3],
}

impl Sight {
    #[inline(always)]
    fn new(ray: &Ray) -> Self {
        let shear = Shear::new(ray.direction);
        Self { slabs: Slabs::new(ray), shear, origin: shear.apply(ray.origin) }
    }
}

/// The children of a node whose boxes a ray enters and that it has not visited yet.
#[derive(Clone, Copy)]
pub(super) struct Entered<N> {
    /// A bit for each child, by its place.
    pub(super) mask: u32,
    /// For each child the upper half of the bits of the t at which the ray enters it; all ones for other
    /// children.
    pub(super) near: N,
}

/// The nearest hit so far.
#[derive(Debug, Clone, Copy)]
pub(super) struct Best {
    pub(super) hit: Option<Hit>,
    /// The largest t that counts.
    pub(super) most: f32,
}

impl Best {
    /// Takes a hit whose t is at most `most`, if it is better.
    #[inline(always)]
    pub(super) fn take(&mut self, hit: Hit) {
        if self.hit.is_none_or(|best| hit.t < best.t || hit.triangle < best.triangle) {
            *self = Self { hit: Some(hit), most: hit.t };
        }
    }
}

/// [`super::Bvh::nearest`] by four functions: `enter` tests the boxes of a node up to some t, `least` finds
/// the least of eight numbers and its place, `without` removes the number at a place, and `meet` tests the
/// triangles of a block.
#[inline(always)]
pub(super) fn nearest<N: Copy>(
    parts: &Parts,
    ray: &Ray,
    enter: impl Fn(usize, &Slabs, f32) -> Entered<N>,
    least: impl Fn(N) -> (u16, usize),
    without: impl Fn(N, usize) -> N,
    meet: impl Fn(&Block, &Sight, &mut Best),
) -> Option<Hit> {
    let sight = Sight::new(ray);
    let mut best = Best { hit: None, most: ray.far };
    let mut stack = [const { MaybeUninit::<(N, u32, u32)>::uninit() }; LEVELS];
    let (mut length, mut index) = (0, 0);
    loop {
        let Entered { mut mask, mut near } = enter(index, &sight.slabs, best.most);
        index = loop {
            if mask == 0 {
                if length == 0 {
                    return best.hit;
                }
                length -= 1;
                #[expect(unsafe_code, reason = "an item that was written")]
                // SAFETY: all items below the length were written.
                let top = unsafe { stack[length].assume_init() };
                (near, mask, index) = (top.0, top.1, top.2 as usize);
            }
            let (t, place) = least(near);
            // Where the nearest is too far, all are.
            if u32::from(t) > best.most.to_bits() >> 16 {
                mask = 0;
                continue;
            }
            (near, mask) = (without(near, place), mask & !(1 << place));
            let node = &parts.nodes[index];
            if place < node.inner() {
                stack[length] = MaybeUninit::new((near, mask, index as u32));
                length += usize::from(mask != 0);
                break node.node(place);
            }
            meet(&parts.blocks[node.block(place)], &sight, &mut best);
        };
    }
}

/// [`super::Bvh::blocked`] by `enter` and `meet`, as for [`nearest`].
#[inline(always)]
pub(super) fn blocked<N>(
    parts: &Parts,
    ray: &Ray,
    enter: impl Fn(usize, &Slabs, f32) -> Entered<N>,
    meet: impl Fn(&Block, &Sight, &mut Best),
) -> bool {
    let sight = Sight::new(ray);
    let mut best = Best { hit: None, most: ray.far };
    let mut stack = [const { MaybeUninit::<(u32, u32)>::uninit() }; LEVELS];
    let (mut length, mut index) = (0, 0);
    loop {
        let mut mask = enter(index, &sight.slabs, ray.far).mask;
        index = loop {
            if mask == 0 {
                if length == 0 {
                    return false;
                }
                length -= 1;
                #[expect(unsafe_code, reason = "an item that was written")]
                // SAFETY: all items below the length were written.
                let top = unsafe { stack[length].assume_init() };
                (mask, index) = (top.0, top.1 as usize);
            }
            let (node, place) = (&parts.nodes[index], mask.trailing_zeros() as usize);
            mask &= mask - 1;
            if place < node.inner() {
                stack[length] = MaybeUninit::new((mask, index as u32));
                length += usize::from(mask != 0);
                break node.node(place);
            }
            meet(&parts.blocks[node.block(place)], &sight, &mut best);
            if best.hit.is_some() {
                return true;
            }
        };
    }
}

/// The walk without intrinsics.
pub(super) mod portable {
    use super::super::triangle::{interval, within};
    use super::*;

    /// Tests a ray against the eight boxes of a node, up to `most`.
    #[inline(always)]
    fn enter(node: &Node, slabs: &Slabs, most: f32) -> Entered<[u16; WIDTH]> {
        let mut entered = Entered { mask: 0, near: [u16::MAX; WIDTH] };
        for lane in 0..node.count() {
            let side = |flip: usize| {
                [0, 1, 2].map(|axis| node.plane(axis, node.steps[axis][slabs.first[axis] ^ flip][lane]))
            };
            let [near, far] = slabs.interval(side(0), side(1));
            if near <= far && near <= most {
                entered.mask |= 1 << lane;
                entered.near[lane] = (near.to_bits() >> 16) as u16;
            }
        }
        entered
    }

    #[inline(always)]
    fn least(near: [u16; WIDTH]) -> (u16, usize) {
        (1..WIDTH)
            .fold((near[0], 0), |least, lane| if near[lane] < least.0 { (near[lane], lane) } else { least })
    }

    #[inline(always)]
    fn without(mut near: [u16; WIDTH], lane: usize) -> [u16; WIDTH] {
        near[lane] = u16::MAX;
        near
    }

    #[inline(always)]
    fn meet(block: &Block, sight: &Sight, best: &mut Best) {
        for (place, triangle) in block.triangles.iter().enumerate().take(block.count()) {
            let corners = block.corners(place);
            let [near, far] = interval(&sight.slabs, &corners);
            if near <= far && near <= best.most {
                let hit = within(&sight.shear, sight.origin, &corners, *triangle, [near, far], best.most);
                hit.into_iter().for_each(|hit| best.take(hit));
            }
        }
    }

    pub(in super::super) fn nearest(parts: &Parts, ray: &Ray) -> Option<Hit> {
        super::nearest(
            parts,
            ray,
            |node, slabs, most| enter(&parts.nodes[node], slabs, most),
            least,
            without,
            meet,
        )
    }

    pub(in super::super) fn blocked(parts: &Parts, ray: &Ray) -> bool {
        super::blocked(parts, ray, |node, slabs, most| enter(&parts.nodes[node], slabs, most), meet)
    }
}
