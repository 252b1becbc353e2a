//! The points and normals of a mesh that pixels see.

use super::{NONE, View};
use crate::numeric::lanes::{BLOCK, wide};
use crate::numeric::vector::unit_or_zero;
use crate::world::mesh::Mesh;
use glam::Vec3;

/// Points of a surface that pixels see, one in each lane. The lanes from `count` on have leftovers.
#[derive(Debug, Clone)]
pub struct SurfacePoints {
    /// How many there are.
    pub count: usize,
    /// The index of each one's pixel.
    pub pixel: [u32; BLOCK],
    /// x, y and z, in the scene's unit.
    pub position: [[f32; BLOCK]; 3],
    /// x, y and z of the unit normal; zero where the corners' normals cancel.
    pub normal: [[f32; BLOCK]; 3],
}

impl SurfacePoints {
    /// No point yet.
    pub const NONE: Self =
        Self { count: 0, pixel: [0; BLOCK], position: [[0.0; BLOCK]; 3], normal: [[0.0; BLOCK]; 3] };

    /// The position in a lane.
    #[inline(always)]
    pub fn position(&self, lane: usize) -> Vec3 {
        Vec3::new(self.position[0][lane], self.position[1][lane], self.position[2][lane])
    }

    /// The normal in a lane.
    #[inline(always)]
    pub fn normal(&self, lane: usize) -> Vec3 {
        Vec3::new(self.normal[0][lane], self.normal[1][lane], self.normal[2][lane])
    }
}

/// Hands what the pixels of a view see to `each`, a block of points at a time: `seen` are their triangles
/// from pixel `first` on, [`NONE`] where there is none.
pub fn surfaces(mesh: &Mesh, view: &View, seen: &[u32], first: usize, mut each: impl FnMut(&SurfacePoints)) {
    let (mut points, mut corners) = (SurfacePoints::NONE, Corners::NONE);
    let (mut x, mut y) = (first % view.width, first / view.width);
    for (pixel, triangle) in (first as u32..).zip(seen) {
        if *triangle != NONE {
            points.pixel[points.count] = pixel;
            corners.set(points.count, mesh, *triangle, view.ndc(x, y));
            points.count += 1;
            if points.count == BLOCK {
                interpolate(view, &corners, &mut points);
                each(&points);
                points.count = 0;
            }
        }
        (x, y) = if x + 1 < view.width { (x + 1, y) } else { (0, y + 1) };
    }
    if points.count > 0 {
        interpolate(view, &corners, &mut points);
        each(&points);
    }
}

/// The triangles of pixels, and where the pixels are.
struct Corners {
    /// x, y, z of each corner.
    positions: [[[f32; BLOCK]; 3]; 3],
    normals: [[[f32; BLOCK]; 3]; 3],
    /// x/w and y/w of the pixels' centres.
    ndc: [[f32; BLOCK]; 2],
}

impl Corners {
    const NONE: Self =
        Self { positions: [[[0.0; BLOCK]; 3]; 3], normals: [[[0.0; BLOCK]; 3]; 3], ndc: [[0.0; BLOCK]; 2] };

    #[inline(always)]
    fn set(&mut self, lane: usize, mesh: &Mesh, triangle: u32, ndc: [f32; 2]) {
        for (corner, vertex) in mesh.triangles[triangle as usize].into_iter().enumerate() {
            let (position, normal) = (mesh.positions[vertex as usize], mesh.normals[vertex as usize]);
            for axis in 0..3 {
                self.positions[corner][axis][lane] = position[axis];
                self.normals[corner][axis][lane] = normal[axis];
            }
        }
        (self.ndc[0][lane], self.ndc[1][lane]) = (ndc[0], ndc[1]);
    }
}

wide! {
    fn interpolate(view: &View, corners: &Corners, points: &mut SurfacePoints) {
        for lane in 0..BLOCK {
            let three = |of: &[[[f32; BLOCK]; 3]; 3]| {
                let corner = |i: usize| Vec3::new(of[i][0][lane], of[i][1][lane], of[i][2][lane]);
                [corner(0), corner(1), corner(2)]
            };
            let (positions, normals) = (three(&corners.positions), three(&corners.normals));
            let weights = view.barycentric(positions, [corners.ndc[0][lane], corners.ndc[1][lane]]);
            let blend = |of: [Vec3; 3]| of[0] * weights[0] + of[1] * weights[1] + of[2] * weights[2];
            let (position, normal) = (blend(positions), unit_or_zero(blend(normals)));
            (points.position[0][lane], points.position[1][lane], points.position[2][lane]) = position.into();
            (points.normal[0][lane], points.normal[1][lane], points.normal[2][lane]) = normal.into();
        }
    }
}
