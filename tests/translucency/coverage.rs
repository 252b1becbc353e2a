//! Coverage to the pixel, where centres lie on edges.
//!
//! The top-left rule is what a sample says that lies a little to the right of the centre, and far less below
//! it: it is inside across a left edge, outside across a right one, and on a horizontal edge inside only if
//! that is the top. With whole numbers that little is exact, and it needs no rule.

use bitlight::numeric::random::unit;
use bitlight::raster::{Axes, NONE, View, visibility};
use glam::Vec3;

const SIZE: usize = 32;

/// An image on which pixel coordinates are world coordinates, exactly: pixel (x, y) is at (x − 16, 16 − y).
fn view() -> View {
    let axes = Axes { right: Vec3::X, up: Vec3::Y, forward: Vec3::NEG_Z };
    View::orthographic(Vec3::ZERO, axes, [16.0, 16.0], [-8.0, 8.0], [SIZE, SIZE])
}

/// A point of the grid of 1/256 pixel.
fn world(point: [i64; 2]) -> Vec3 {
    Vec3::new(point[0] as f32 / 256.0 - 16.0, 16.0 - point[1] as f32 / 256.0, 0.0)
}

fn covered(triangle: [[i64; 2]; 3], x: usize, y: usize) -> bool {
    let shifted = |value: i64, by: i128| i128::from(value) * (1 << 60) + by;
    let sample = [shifted(256 * x as i64 + 128, 1 << 30), shifted(256 * y as i64 + 128, 1)];
    let side = |i: usize| {
        let (a, b) = (triangle[i], triangle[(i + 1) % 3]);
        let along = [i128::from(b[0] - a[0]), i128::from(b[1] - a[1])];
        let to = [sample[0] - shifted(a[0], 0), sample[1] - shifted(a[1], 0)];
        along[0] * to[1] - along[1] * to[0]
    };
    let sides = [side(0), side(1), side(2)];
    sides.iter().all(|side| *side > 0) || sides.iter().all(|side| *side < 0)
}

#[test]
fn a_centre_on_an_edge_belongs_to_one_side() {
    let (view, mut on_edge, mut total) = (view(), 0, 0);
    for case in 0..400 {
        // Corners on centres and between, some beyond the image: many edges run through centres.
        let corner = |n: u64, k: u64| (unit(7, case, n, k) * 40.0) as i64 * 128 - 512;
        let triangle: [[i64; 2]; 3] = std::array::from_fn(|n| [corner(n as u64, 0), corner(n as u64, 1)]);
        let seen = visibility(&triangle.map(world), &[[0, 1, 2]], &view);
        for y in 0..SIZE {
            for x in 0..SIZE {
                let (expected, found) = (covered(triangle, x, y), seen.triangle[y * SIZE + x] != NONE);
                assert_eq!(found, expected, "{triangle:?} at ({x}, {y})");
                total += usize::from(found);
                let centre = [256 * x as i64 + 128, 256 * y as i64 + 128];
                on_edge += usize::from((0..3).any(|i| {
                    let (a, b) = (triangle[i], triangle[(i + 1) % 3]);
                    (b[0] - a[0]) * (centre[1] - a[1]) == (b[1] - a[1]) * (centre[0] - a[0])
                }));
            }
        }
    }
    assert!(on_edge > 1000 && total > 10_000, "{on_edge} centres on an edge, {total} covered");
}

/// Corners between the steps of the grid: snapped to the nearest, halves to the even one.
#[test]
fn corners_snap_to_the_nearest_step_halves_to_even() {
    let view = view();
    // A vertical edge in x = 16 + a step's share, just right of the centres of column 15 or left of those
    // of 16.
    for (steps, first) in [(127.5, 16), (128.5, 16), (128.75, 17), (129.5, 17), (127.0, 16), (126.5, 16)] {
        let edge = (steps / 256.0) as f32;
        let corners = [[edge, 20.0], [edge, -20.0], [30.0, 0.0]].map(|[x, y]| Vec3::new(x, y, 0.0));
        let seen = visibility(&corners, &[[0, 1, 2]], &view);
        let found = (0..SIZE).find(|x| seen.triangle[16 * SIZE + x] != NONE);
        assert_eq!(found, Some(first), "an edge at {steps} steps");
    }
}

/// Of triangles in one place the first in the list is seen, whichever way round they run.
#[test]
fn ties_go_to_the_lowest_triangle() {
    let corners = [[0, 0], [6000, 500], [900, 7000]].map(world);
    let triangles = [[1, 1, 2], [0, 1, 2], [2, 1, 0], [1, 2, 0]];
    let seen = visibility(&corners, &triangles, &view());
    assert!(seen.triangle.iter().all(|triangle| [1, NONE].contains(triangle)));
    assert!(seen.triangle.iter().filter(|triangle| **triangle == 1).count() > 200);
}
