//! Bundles of parallel rays: which of a set of directions each of many points sees, and what its rays meet
//! along the others.
//!
//! Rays of one direction share the shear of [`super::triangle`]. To ask which of them are blocked is then to
//! rasterise the sheared triangles onto the sheared points, in place of pixels. The bits are those of single
//! rays. The nearest hit is among the few triangles that may block a point, and the test of single rays
//! decides each of these.
//!
//! - `morton.rs` puts mesh and points in order. A *place* is the index of a position in that order.
//! - `cells.rs` sorts the points into the cells of a grid. A *front* is the least depth of the points in some
//!   neighbouring cells.
//! - `hold.rs` *holds* each triangle against the points in the cells of its box: it tests which of them the
//!   triangle blocks. `hold_avx2.rs` and `hold_avx512.rs` have the twins.

use super::cells::{Cells, Grid};
use super::hold;
use super::morton::{Bundle, LANES};
use super::triangle::{Shear, Slabs, along};
use super::{Hit, Ray};
#[cfg(target_arch = "x86_64")]
use crate::numeric::lanes::has_avx512;
use crate::numeric::lanes::{BLOCK, wide};
use crate::numeric::order::{max, min};
use crate::numeric::parallel;
use crate::world::mesh::Mesh;
use glam::Vec3;

/// Directions whose bits share a word.
pub const WORD: usize = 32;

/// Directions that one task takes one after the other, reusing its buffers.
const RUN: usize = 4;

/// Which of `directions` each of `points` sees: bit j of word w of point p, `[points][⌈directions / 32⌉]`, is
/// set where the direction 32 w + j is above the horizon of the point's normal (n·ω > 0) and the ray from the
/// point along it meets no triangle of the mesh ([`super::Bvh::blocked`]). All other bits are 0.
///
/// # Panics
/// Where there are not as many normals as points.
pub fn visibility(mesh: &Mesh, points: &[Vec3], normals: &[Vec3], directions: &[Vec3]) -> Vec<u32> {
    assert_eq!(points.len(), normals.len(), "one normal a point");
    let bundle = Bundle::new(mesh, points, normals);
    let words = directions.len().div_ceil(WORD);
    let mut bits = vec![0; points.len() * words];
    for (word, directions) in directions.chunks(WORD).enumerate() {
        let mut seen: Vec<Vec<u8>> = vec![Vec::new(); directions.len()];
        parallel::for_each_chunk(&mut seen, RUN, |run, seen| {
            let mut cells = Cells::default();
            for (seen, direction) in seen.iter_mut().zip(&directions[run * RUN..]) {
                *seen = vec![0; points.len()];
                bundle.look(*direction, &mut cells, seen, block::<false>);
            }
        });
        parallel::for_each_chunk(&mut bits, words * 1024, |run, rows| {
            for (point, row) in (run * 1024..).zip(rows.chunks_exact_mut(words)) {
                let bit = |(bit, seen): (usize, &Vec<u8>)| u32::from(seen[point]) << bit;
                row[word] = seen.iter().enumerate().map(bit).fold(0, |word, bit| word | bit);
            }
        });
    }
    bits
}

/// Where the rays from `points` along `directions` first meet the mesh ([`super::Bvh::nearest`]), of the rays
/// whose bits are set in `wanted`, `[points][⌈directions / 32⌉]`. The second list has the hits, point by
/// point, each point's bits ascending. The first list says where each point's hits begin.
///
/// # Panics
/// Where `wanted` has another length.
pub fn nearest(
    mesh: &Mesh,
    points: &[Vec3],
    directions: &[Vec3],
    wanted: &[u32],
) -> (Vec<usize>, Vec<Option<Hit>>) {
    let words = directions.len().div_ceil(WORD);
    assert_eq!(wanted.len(), points.len() * words, "one row of words a point");
    let bundle = Bundle::new(mesh, points, &[]);
    let mut starts = Vec::with_capacity(points.len());
    let mut total = 0;
    for row in 0..points.len() {
        starts.push(total);
        total += wanted[row * words..(row + 1) * words]
            .iter()
            .map(|bits| bits.count_ones() as usize)
            .sum::<usize>();
    }
    let mut hits = vec![None; total];
    // Where each point's next hit goes.
    let mut next = starts.clone();
    for (word, directions) in directions.chunks(WORD).enumerate() {
        let column: Vec<u32> =
            bundle.order.iter().map(|point| wanted[*point as usize * words + word]).collect();
        let mut found: Vec<Vec<(u32, Option<Hit>)>> = vec![Vec::new(); directions.len()];
        parallel::for_each_chunk(&mut found, RUN, |run, found| {
            let mut cells = Cells::default();
            for (bit, found) in (run * RUN..).zip(found) {
                let set = (0..).zip(&column).filter(|(_, bits)| **bits >> bit & 1 == 1);
                cells.looking.clear();
                cells.looking.extend(set.map(|(point, _)| point));
                bundle.meet(directions[bit], &mut cells, found, block::<true>);
            }
        });
        for (point, hit) in found.into_iter().flatten() {
            hits[next[point as usize]] = hit;
            next[point as usize] += 1;
        }
    }
    (starts, hits)
}

impl Bundle {
    /// Sets `seen` to 1 for each point that sees the direction; `block` marks the others.
    fn look(
        &self,
        direction: Vec3,
        cells: &mut Cells,
        seen: &mut [u8],
        block: impl Fn(&Self, &Grid, Vec3, &mut Cells),
    ) {
        look_along(direction, &self.normals, &mut cells.looking);
        self.hold(direction, cells, block);
        cells.blocked.clear();
        cells.blocked.resize(self.places[0].len(), false);
        for (place, z) in cells.lanes.place.iter().zip(&cells.lanes.z).take(2 * cells.looking.len()) {
            cells.blocked[*place as usize] |= z.is_nan();
        }
        for point in &cells.looking {
            let free = !cells.blocked[self.points[*point as usize] as usize];
            seen[self.order[*point as usize] as usize] = u8::from(free);
        }
    }

    /// Finds what each point of `cells.looking` meets along the direction, and appends it to `found` with the
    /// point's index among those that were given. `collect` finds the triangles that a point may meet.
    fn meet(
        &self,
        direction: Vec3,
        cells: &mut Cells,
        found: &mut Vec<(u32, Option<Hit>)>,
        collect: impl Fn(&Self, &Grid, Vec3, &mut Cells),
    ) {
        if cells.looking.is_empty() {
            return;
        }
        cells.pairs.clear();
        self.hold(direction, cells, collect);
        cells.met.resize(self.places[0].len(), None);
        let (shear, slabs) = (Shear::new(direction), Slabs::new(&Ray::new(Vec3::ZERO, direction)));
        for [place, triangle] in &cells.pairs {
            let (group, lane) = (*triangle as usize / LANES, *triangle as usize % LANES);
            let corners = [0, 1, 2].map(|corner| self.place(self.triangles[group][corner][lane]));
            let ray = Ray::new(self.place(*place), direction);
            let slabs = Slabs { origin: ray.origin.to_array(), ..slabs };
            let Some(hit) = along(&shear, &slabs, &ray, &corners, self.indices[*triangle as usize]) else {
                continue;
            };
            let met = &mut cells.met[*place as usize];
            if met.is_none_or(|met| (hit.t, hit.triangle) < (met.t, met.triangle)) {
                *met = Some(hit);
            }
        }
        let met = cells.looking.iter().map(|point| {
            let place = self.points[*point as usize];
            (self.order[*point as usize], cells.met[place as usize].take())
        });
        found.extend(met);
    }

    /// Shears everything, sorts the points of `cells.looking` into cells, and has `by` hold the triangles
    /// against them.
    fn hold(&self, direction: Vec3, cells: &mut Cells, by: impl Fn(&Self, &Grid, Vec3, &mut Cells)) {
        let frame = Sheared::new(direction, self);
        let ends = shear(&frame, &self.places, &mut cells.sheared);
        let grid = Grid::new(self, ends, cells.looking.len());
        cells.sort(&grid, self);
        by(self, &grid, direction, cells);
    }
}

/// Marks the points that triangles block, or with `COLLECT` finds the triangles that may block them:
/// [`hold::walk`], or the widest twin that the processor has.
fn block<const COLLECT: bool>(bundle: &Bundle, grid: &Grid, direction: Vec3, cells: &mut Cells) {
    #[cfg(target_arch = "x86_64")]
    #[expect(
        unsafe_code,
        reason = "the twins with wider instructions, for a processor that was just looked at"
    )]
    if has_avx512() {
        // SAFETY: the processor has AVX-512.
        return unsafe { super::hold_avx512::walk::<COLLECT>(bundle, grid, direction, cells) };
    } else if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        return unsafe { super::hold_avx2::walk::<COLLECT>(bundle, grid, direction, cells) };
    }
    hold::walk::<COLLECT>(bundle, grid, direction, cells);
}

/// Sheared space, moved and scaled by powers of two so that everything is within ±2.
struct Sheared {
    shear: Shear,
    center: [f64; 3],
    scale: [f64; 3],
}

impl Sheared {
    fn new(direction: Vec3, bundle: &Bundle) -> Self {
        let shear = Shear::new(direction);
        let reach = shear.reach(bundle.half);
        // 2^-k for a number in [2^k, 2^(k+1)).
        let scale = |reach: f64| f64::from_bits((2046 - (reach.to_bits() >> 52 & 2047)) << 52);
        let across = scale(max(reach[0], reach[1]));
        Self { shear, center: shear.apply(bundle.center), scale: [across, across, scale(reach[2])] }
    }

    #[inline(always)]
    fn apply(&self, point: Vec3) -> [f32; 3] {
        let p = self.shear.apply(point);
        [0, 1, 2].map(|axis| ((p[axis] - self.center[axis]) * self.scale[axis]) as f32)
    }
}

wide! {
    /// Shears all positions; returns the least and the greatest x and y.
    fn shear(frame: &Sheared, places: &[Vec<f32>; 3], out: &mut Vec<[f32; 4]>) -> [[f32; 2]; 2] {
        out.resize(places[0].len(), [0.0; 4]);
        let mut block = [[0.0; BLOCK]; 3];
        let mut ends = [[[f32::INFINITY; BLOCK], [f32::NEG_INFINITY; BLOCK]]; 2];
        for (number, out) in out.chunks_mut(BLOCK).enumerate() {
            let [x, y, z] = [0, 1, 2].map(|axis| &places[axis][number * BLOCK..][..out.len()]);
            for lane in 0..out.len() {
                let place = frame.apply(Vec3::new(x[lane], y[lane], z[lane]));
                for axis in 0..3 {
                    block[axis][lane] = place[axis];
                }
            }
            for axis in 0..2 {
                for lane in 0..out.len() {
                    ends[axis][0][lane] = min(ends[axis][0][lane], block[axis][lane]);
                    ends[axis][1][lane] = max(ends[axis][1][lane], block[axis][lane]);
                }
            }
            for (lane, out) in out.iter_mut().enumerate() {
                *out = [block[0][lane], block[1][lane], block[2][lane], 0.0];
            }
        }
        ends.map(|[low, high]| [low.into_iter().fold(f32::INFINITY, min), high.into_iter().fold(f32::NEG_INFINITY, max)])
    }
}

wide! {
    /// The points with n·ω > 0.
    fn look_along(direction: Vec3, normals: &[Vec<f32>; 3], looking: &mut Vec<u32>) {
        let count = normals[0].len();
        looking.resize(count, 0);
        let (mut found, mut above) = (0, [0_u8; BLOCK]);
        for first in (0..count).step_by(BLOCK) {
            let length = min(BLOCK, count - first);
            let [x, y, z] = [0, 1, 2].map(|axis| &normals[axis][first..][..length]);
            for lane in 0..length {
                let cosine = x[lane] * direction.x + y[lane] * direction.y + z[lane] * direction.z;
                above[lane] = u8::from(cosine > 0.0);
            }
            // Every point is written; the next one overwrites it unless it counts.
            for lane in 0..length {
                looking[found] = (first + lane) as u32;
                found += usize::from(above[lane]);
            }
        }
        looking.truncate(found);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::random::unit;
    use crate::sphere::quadrature::fibonacci;
    use crate::trace::Bvh;
    use crate::world::mesh::Mesh;
    use crate::world::shapes;

    /// What all points see of a direction, by one of the walks.
    fn seen(
        bundle: &Bundle,
        direction: Vec3,
        points: usize,
        by: impl Fn(&Bundle, &Grid, Vec3, &mut Cells),
    ) -> Vec<u8> {
        let mut seen = vec![0; points];
        bundle.look(direction, &mut Cells::default(), &mut seen, by);
        seen
    }

    /// A knot between two fans of triangles. The triangles are wider and higher than any block of cells, and
    /// their own corners look away from the knot.
    fn screened() -> Mesh {
        let knot = shapes::torus_knot(2, 3, 0.35, 96, 12).unwrap();
        let (mut positions, mut triangles) = (knot.positions, knot.triangles);
        for side in [-1.0_f32, 1.0] {
            let corner = positions.len() as u32;
            positions.push(Vec3::new(-5.0, -4.0, 3.0) * side);
            for step in 0..10 {
                positions.push(Vec3::new(4.0, step as f32 - 4.0, 2.0 - step as f32 * 0.1) * side);
            }
            triangles.extend((1..10).map(|step| {
                if side > 0.0 {
                    [corner, corner + step, corner + step + 1]
                } else {
                    [corner, corner + step + 1, corner + step]
                }
            }));
        }
        Mesh::new(positions, None, triangles).unwrap()
    }

    #[test]
    fn every_walk_sees_what_single_rays_see() {
        let even: Vec<_> = fibonacci(40).iter().map(|d| Vec3::from_array(d.map(|d| d as f32))).collect();
        // Through corners and edges of a box of squares.
        let straight: Vec<_> =
            (0..27).map(|i| Vec3::new((i % 3) as f32, (i / 3 % 3) as f32, (i / 9) as f32) - 1.0).collect();
        let knot = screened();
        let mut turned = knot.normals.clone();
        turned.iter_mut().skip(96 * 12).for_each(|normal| *normal = -*normal);
        let cuboid = shapes::cuboid(Vec3::new(1.0, 1.1, 0.9), 6).unwrap();
        // Few points, far from each other, among small triangles: here it shows if a block of cells is left
        // out by mistake.
        let place = |number: u64| Vec3::from_array([0, 1, 2].map(|axis| unit(1, number, axis, 0)));
        let corners = (0..2400).map(|i| place(i / 3) + place(i + 5000) * 0.14).collect();
        let soup =
            Mesh::new(corners, None, (0..800).map(|i| [0, 1, 2].map(|corner| 3 * i + corner)).collect())
                .unwrap();
        let dust: Vec<_> = (0..8).map(|i| place(i + 9000)).collect();
        for direction in &even {
            agree(&knot, &knot.positions, &knot.normals, *direction);
            agree(&knot, &knot.positions, &turned, *direction);
            agree(&soup, &dust, &vec![*direction; dust.len()], *direction);
        }
        for direction in straight.iter().filter(|direction| **direction != Vec3::ZERO).chain(&even) {
            agree(&cuboid, &cuboid.positions, &vec![*direction; cuboid.positions.len()], *direction);
        }
    }

    /// Each walk against single rays.
    fn agree(mesh: &Mesh, points: &[Vec3], normals: &[Vec3], direction: Vec3) {
        let (bundle, bvh) = (Bundle::new(mesh, points, normals), Bvh::new(mesh));
        let single: Vec<u8> = points
            .iter()
            .zip(normals)
            .map(|(p, n)| u8::from(n.dot(direction) > 0.0 && !bvh.blocked(&Ray::new(*p, direction))))
            .collect();
        let of = |by: &dyn Fn(&Bundle, &Grid, Vec3, &mut Cells)| seen(&bundle, direction, single.len(), by);
        assert!(of(&hold::walk::<false>) == single, "{direction}: the portable walk");
        // What every third point meets, whether or not it looks along the direction.
        let third = (0..points.len() as u32).step_by(3);
        let first: Vec<_> =
            third.clone().map(|p| bvh.nearest(&Ray::new(points[p as usize], direction))).collect();
        let met = |by: &dyn Fn(&Bundle, &Grid, Vec3, &mut Cells)| {
            let mut cells = Cells::default();
            let (mut found, mut met) = (Vec::new(), vec![None; first.len()]);
            let looking = (0..).zip(&bundle.order).filter(|(_, point)| **point % 3 == 0);
            cells.looking.extend(looking.map(|(place, _)| place));
            bundle.meet(direction, &mut cells, &mut found, by);
            assert_eq!(found.len(), first.len());
            found.into_iter().for_each(|(point, hit)| met[point as usize / 3] = hit);
            met
        };
        assert!(met(&hold::walk::<true>) == first, "{direction}: what the portable walk meets");
        #[cfg(target_arch = "x86_64")]
        #[expect(unsafe_code, reason = "the twins, for a processor that was just looked at")]
        {
            if std::arch::is_x86_feature_detected!("avx2") {
                // SAFETY: the processor has AVX2.
                let avx2 = of(&|b, g, d, c| unsafe { crate::trace::hold_avx2::walk::<false>(b, g, d, c) });
                assert!(avx2 == single, "{direction}: eight lanes");
                // SAFETY: the processor has AVX2.
                let avx2 = met(&|b, g, d, c| unsafe { crate::trace::hold_avx2::walk::<true>(b, g, d, c) });
                assert!(avx2 == first, "{direction}: what eight lanes meet");
            }
            if has_avx512() {
                // SAFETY: the processor has AVX-512.
                let avx512 =
                    of(&|b, g, d, c| unsafe { crate::trace::hold_avx512::walk::<false>(b, g, d, c) });
                assert!(avx512 == single, "{direction}: sixteen lanes");
                // SAFETY: the processor has AVX-512.
                let avx512 =
                    met(&|b, g, d, c| unsafe { crate::trace::hold_avx512::walk::<true>(b, g, d, c) });
                assert!(avx512 == first, "{direction}: what sixteen lanes meet");
            }
        }
    }
}
