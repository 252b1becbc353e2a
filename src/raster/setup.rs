//! Which triangles may cover something, and the tiles of the image that each touches.

use super::View;
use super::clip::{clip, planes};
use super::screen::{CLIP, LOST, Projected, SIDES, project, snap};
use super::tile::{TILE, first_centre, past_centre};
use crate::numeric::lanes::wide;
use crate::numeric::order::{max, min};
use crate::numeric::parallel;
use glam::Vec3;

/// Triangles of a run.
const RUN: usize = 4096;

/// Triangles in runs, sorted into tiles, and their vertices on the screen.
pub(super) struct Sorted<'a> {
    triangles: &'a [[u32; 3]],
    vertices: Vec<Projected>,
    runs: Vec<Run>,
}

impl<'a> Sorted<'a> {
    /// Projects the vertices and sorts the triangles into the tiles of a view.
    pub(super) fn new(positions: &[Vec3], triangles: &'a [[u32; 3]], view: &View) -> Self {
        let vertices = project(positions, view);
        let runs = parallel::map(triangles.len().div_ceil(RUN), |run| {
            Run::new(positions, triangles, &vertices, view, run * RUN)
        });
        Self { triangles, vertices, runs }
    }

    /// Calls `each` with the triangles that touch a tile: one's index in the mesh, and its corners on the
    /// screen.
    #[inline(always)]
    pub(super) fn touching(&self, tile: usize, mut each: impl FnMut(u32, [&Projected; 3])) {
        for run in &self.runs {
            run.touching(tile, self.triangles, &self.vertices, &mut each);
        }
    }
}

/// The triangles of a run that may cover something, sorted by the tiles that they touch.
struct Run {
    /// The index of the run's first triangle.
    first: u32,
    /// What clipping left of triangles: corners, and the index in the mesh of the triangle that they come
    /// from.
    clipped: Vec<(u32, [Projected; 3])>,
    /// The triangles of each tile, one tile after the other. A number below [`RUN`] is a place in the run,
    /// one from [`RUN`] on a place in `clipped`.
    touched: Vec<u32>,
    /// Where each tile's part of `touched` begins, and where the last ends.
    begins: Vec<u32>,
}

/// A triangle, as in [`Run::touched`], and the first and last columns and rows of the tiles that its box
/// touches.
#[derive(Clone, Copy, Default)]
struct Touching {
    triangle: u32,
    left: u8,
    top: u8,
    right: u8,
    bottom: u8,
}

impl Run {
    /// Sorts the triangles of a run, from the `first` on, into the tiles of a view.
    fn new(
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        vertices: &[Projected],
        view: &View,
        first: usize,
    ) -> Self {
        let triangles = &triangles[first..min(triangles.len(), first + RUN)];
        let (mut found, mut clipped) = (vec![Touching::default(); triangles.len()], Vec::new());
        let (count, clip) = touching(triangles, vertices, view, &mut found);
        found.truncate(count);
        if clip {
            for (triangle, corners) in (first as u32..).zip(triangles) {
                let points = clip_one(corners, positions, vertices, view);
                for pair in points.windows(2).skip(1) {
                    let corners = [points[0], pair[0], pair[1]];
                    let (touching, covers) = Touching::new((RUN + clipped.len()) as u32, &corners, view);
                    if covers {
                        clipped.push((triangle, corners));
                        found.push(touching);
                    }
                }
            }
        }
        let (touched, begins) = sorted(&found, view);
        Self { first: first as u32, clipped, touched, begins }
    }

    /// [`Sorted::touching`] for the triangles of this run.
    #[inline(always)]
    fn touching(
        &self,
        tile: usize,
        triangles: &[[u32; 3]],
        vertices: &[Projected],
        mut each: impl FnMut(u32, [&Projected; 3]),
    ) {
        for place in &self.touched[self.begins[tile] as usize..self.begins[tile + 1] as usize] {
            if (*place as usize) < RUN {
                let triangle = self.first + place;
                let [a, b, c] = triangles[triangle as usize];
                each(triangle, [&vertices[a as usize], &vertices[b as usize], &vertices[c as usize]]);
            } else {
                let (triangle, [a, b, c]) = &self.clipped[*place as usize - RUN];
                each(*triangle, [a, b, c]);
            }
        }
    }
}

wide! {
    /// Finds the triangles of a run whose boxes hold the centre of a pixel. Returns how many there are, and
    /// whether others must be clipped, which are left out. The loop has no branch, since no processor could
    /// predict which triangles these are.
    fn touching(
        triangles: &[[u32; 3]],
        vertices: &[Projected],
        view: &View,
        found: &mut [Touching],
    ) -> (usize, bool) {
        let (mut codes, mut count) = (0, 0);
        for (place, [a, b, c]) in (0..).zip(triangles) {
            let [a, b, c] = [vertices[*a as usize], vertices[*b as usize], vertices[*c as usize]];
            let any = a[3] | b[3] | c[3];
            codes |= any;
            let (touching, covers) = Touching::new(place, &[a, b, c], view);
            found[count] = touching;
            count += usize::from(covers & ((any & (CLIP | LOST)) | (a[3] & b[3] & c[3] & SIDES) == 0));
        }
        (count, codes & CLIP != 0)
    }
}

impl Touching {
    /// The tiles that a triangle's box touches, and whether a pixel's centre lies in the box and in the
    /// image. If none does, the triangle touches nothing.
    #[inline(always)]
    fn new(triangle: u32, [a, b, c]: &[Projected; 3], view: &View) -> (Self, bool) {
        // All four numbers of a vertex, since they are one vector; only x and y become pixels.
        let (mut first, mut last) = ([0; 4], [0; 4]);
        for i in 0..4 {
            first[i] = first_centre(min(min(a[i], b[i]), c[i]));
            last[i] = past_centre(max(max(a[i], b[i]), c[i]));
        }
        let (left, top) = (max(first[0], 0), max(first[1], 0));
        let (right, bottom) = (min(last[0], view.width as i32), min(last[1], view.height as i32));
        let tile = |pixel: i32| (pixel as u32 / TILE as u32) as u8;
        let touching = Self {
            triangle,
            left: tile(left),
            top: tile(top),
            right: tile(right.wrapping_sub(1)),
            bottom: tile(bottom.wrapping_sub(1)),
        };
        (touching, (left < right) & (top < bottom))
    }

    /// Calls `touch` with the number of each tile, `columns` in a row.
    #[inline(always)]
    fn tiles(&self, columns: usize, mut touch: impl FnMut(usize)) {
        for row in usize::from(self.top)..=usize::from(self.bottom) {
            for column in usize::from(self.left)..=usize::from(self.right) {
                touch(row * columns + column);
            }
        }
    }
}

/// What clipping leaves of a triangle: the corners of a convex polygon. None where it need not be clipped.
#[inline(never)]
fn clip_one(triangle: &[u32; 3], positions: &[Vec3], vertices: &[Projected], view: &View) -> Vec<Projected> {
    let [a, b, c] = triangle.map(|corner| vertices[corner as usize][3]);
    if (a | b | c) & CLIP == 0 || (a | b | c) & LOST != 0 || a & b & c & SIDES != 0 {
        return Vec::new();
    }
    let polygon = clip(triangle.map(|corner| view.project(positions[corner as usize])), &planes(view));
    let snapped = |vertex| {
        let [x, y, z] = snap(vertex, view);
        [x, y, z, 0]
    };
    polygon.into_iter().map(snapped).collect()
}

/// Sorts triangles by the tiles that they touch (a counting sort). Returns the triangles of each tile, one
/// tile after the other, and where each tile's begin.
fn sorted(found: &[Touching], view: &View) -> (Vec<u32>, Vec<u32>) {
    let columns = view.width.div_ceil(TILE);
    let tiles = columns * view.height.div_ceil(TILE);
    if tiles == 1 {
        return (found.iter().map(|one| one.triangle).collect(), vec![0, found.len() as u32]);
    }
    let mut begins = vec![0; tiles + 1];
    for one in found {
        one.tiles(columns, |tile| begins[tile + 1] += 1);
    }
    for tile in 0..tiles {
        begins[tile + 1] += begins[tile];
    }
    let mut next: Vec<u32> = begins[..tiles].to_vec();
    let mut touched = vec![0; begins[tiles] as usize];
    for one in found {
        one.tiles(columns, |tile| {
            touched[next[tile] as usize] = one.triangle;
            next[tile] += 1;
        });
    }
    (touched, begins)
}
