//! Coverage is exact (contract 7): held against integer arithmetic from the snapped vertices on, and against
//! the rule that a closed surface seen from inside is seen once in every pixel.

use bitlight::numeric::random::{bits, unit};
use bitlight::raster::{Axes, NONE, View, two_depths, visibility};
use bitlight_reference::coverage::{covers, snap_half_even};
use glam::Vec3;

const SIZE: usize = 32;

/// A view in which the world's x and y are the image's x and y in pixels, y up from the image's lower edge.
/// All its factors are powers of two, so vertices at multiples of 1/1024 pixel reach the snapping unrounded.
fn screen() -> View {
    let axes = Axes { right: Vec3::X, up: Vec3::Y, forward: Vec3::NEG_Z };
    let half = SIZE as f32 / 2.0;
    View::orthographic(Vec3::new(half, half, 0.0), axes, [half, half], [-1.0, 1.0], [SIZE, SIZE])
}

/// A random triangle in pixels, y down, of one of the kinds that go wrong.
fn triangle(index: u64) -> [[f64; 2]; 3] {
    let random = |dimension: u64| f64::from(unit(11, index, 0, dimension));
    let grid = |x: f64, steps: f64| (x * steps).floor() / steps;
    let anywhere = |dimension: u64, span: f64, steps: f64| {
        grid((random(dimension) - 0.5) * span + SIZE as f64 / 2.0, steps)
    };
    let corner =
        |i: u64, span: f64, steps: f64| [anywhere(2 * i, span, steps), anywhere(2 * i + 1, span, steps)];
    match index % 6 {
        // Of any size, near the image.
        0 => [0, 1, 2].map(|i| corner(i, 48.0, 1024.0)),
        // Smaller than a pixel, or a few.
        1 => {
            let [x, y] = corner(0, 32.0, 1024.0);
            [0, 1, 2].map(|i| {
                [x + anywhere(2 * i + 2, 3.0, 1024.0) - 16.0, y + anywhere(2 * i + 3, 3.0, 1024.0) - 16.0]
            })
        }
        // Slivers: three corners nearly on a line.
        2 => {
            let (a, b) = (corner(0, 40.0, 1024.0), corner(1, 40.0, 1024.0));
            let t = random(9);
            let along =
                |axis: usize| grid(a[axis] + t * (b[axis] - a[axis]), 256.0) + grid(random(8), 128.0) / 64.0;
            [a, b, [along(0), along(1)]]
        }
        // Corners on pixel centres: edges run through centres.
        3 => [0, 1, 2].map(|i| corner(i, 40.0, 1.0).map(|x| x + 0.5)),
        // Far outside, but within the guard band: differences that need 64 bits.
        4 => [0, 1, 2].map(|i| corner(i, 30_000.0, 256.0)),
        // Exactly between two steps of the grid: half to even.
        _ => [0, 1, 2].map(|i| corner(i, 36.0, 256.0).map(|x| x + 1.0 / 512.0)),
    }
}

#[test]
fn a_hundred_thousand_triangles_cover_what_the_exact_oracle_says() {
    let view = screen();
    let mut covered = 0;
    for index in 0..100_000 {
        let corners = triangle(index);
        let positions = corners.map(|[x, y]| Vec3::new(x as f32, (SIZE as f64 - y) as f32, 0.0));
        let seen = visibility(&positions, &[[0, 1, 2]], &view);
        let snapped = corners.map(|corner| corner.map(snap_half_even));
        for (pixel, triangle) in seen.triangle.iter().enumerate() {
            let (x, y) = ((pixel % SIZE) as i64, (pixel / SIZE) as i64);
            let expected = covers(snapped, x, y);
            assert_eq!(*triangle != NONE, expected, "triangle {index} {corners:?} at pixel ({x}, {y})");
            covered += usize::from(expected);
        }
    }
    assert!(covered > 1_000_000, "the triangles covered {covered} pixels only: the test shows nothing");
}

/// How often each pixel of `view` is drawn when every triangle is drawn alone.
fn counts(positions: &[Vec3], triangles: &[[u32; 3]], view: &View) -> Vec<u32> {
    let mut counts = vec![0; view.width * view.height];
    for triangle in triangles {
        let seen = visibility(positions, &[*triangle], view);
        seen.triangle.iter().zip(&mut counts).for_each(|(id, count)| *count += u32::from(*id != NONE));
    }
    counts
}

#[test]
fn every_pixel_of_a_jittered_sheet_is_drawn_once() {
    // A sheet over the whole image: 12 × 12 cells whose inner corners lie anywhere, some on pixel centres.
    let cells = 12_usize;
    for seed in 0..20 {
        let positions: Vec<Vec3> = (0..(cells + 1) * (cells + 1))
            .map(|index| {
                let (column, row) = (index % (cells + 1), index / (cells + 1));
                let jitter = |dimension| (unit(seed, index as u64, 1, dimension) - 0.5) * 2.0;
                let place = |at: usize, dimension| match at {
                    0 => -1.0,
                    at if at == cells => SIZE as f32 + 1.0,
                    at => {
                        let spread = at as f32 * SIZE as f32 / cells as f32 + jitter(dimension);
                        if bits(seed, index as u64, 2, dimension).is_multiple_of(3) {
                            spread.floor() + 0.5
                        } else {
                            spread
                        }
                    }
                };
                Vec3::new(place(column, 0), place(row, 1), 0.0)
            })
            .collect();
        let triangles: Vec<[u32; 3]> = (0..cells * cells)
            .flat_map(|cell| {
                let a = (cell / cells * (cells + 1) + cell % cells) as u32;
                let (b, c, d) = (a + 1, a + cells as u32 + 1, a + cells as u32 + 2);
                [[a, b, d], [a, d, c]]
            })
            .collect();
        let counts = counts(&positions, &triangles, &screen());
        // Jittered cells may fold over; a fold is drawn an odd number of times, a seam an even number or
        // none.
        assert!(counts.iter().all(|count| count % 2 == 1), "seed {seed}: {counts:?}");
        assert!(counts.iter().filter(|count| **count == 1).count() > SIZE * SIZE * 3 / 4);
    }
}

#[test]
fn a_solid_seen_from_inside_is_drawn_once_in_every_pixel_though_planes_clip_it() {
    // An icosahedron around the camera: its triangles run behind the camera (the near plane clips them) and,
    // under a narrow field of view, far beyond the image (the guard band does).
    let solid = bitlight::world::shapes::sphere(1).unwrap();
    let (mut near, mut guard) = (0, 0);
    for trial in 0..200 {
        let random = |dimension: u64| unit(5, trial, 3, dimension) - 0.5;
        let eye = Vec3::new(random(0), random(1), random(2)) * 0.8;
        let forward = Vec3::new(random(3), random(4), random(5) + 0.01);
        let half = [2.0, 0.3, 0.01, 0.0003][trial as usize % 4];
        let axes = Axes::looking(forward, Vec3::Y);
        let view = View::perspective(eye, axes, [half, half * 0.75], 1e-3, [48, 36]);
        let clips: Vec<[f32; 4]> = solid.positions.iter().map(|position| view.project(*position)).collect();
        near += usize::from(clips.iter().any(|clip| clip[3] < 1e-3));
        guard += usize::from(clips.iter().any(|clip| clip[0].abs() > clip[3].abs() * 32_768.0 / 48.0));
        let counts = counts(&solid.positions, &solid.triangles, &view);
        assert!(counts.iter().all(|count| *count == 1), "trial {trial}, eye {eye}, half {half}: {counts:?}");
    }
    assert!(
        near > 150 && guard > 50,
        "clipped by the near plane {near} times, by the guard band {guard} times"
    );
}

#[test]
fn the_order_of_triangles_changes_nothing_but_their_numbers() {
    let solid = bitlight::world::shapes::torus_knot(2, 3, 0.35, 80, 12).unwrap();
    let axes = Axes::looking(Vec3::new(-1.0, -2.0, -3.0), Vec3::Y);
    let view = View::perspective(Vec3::new(1.5, 3.0, 4.5), axes, [0.4, 0.4], 0.1, [100, 90]);
    let forward = visibility(&solid.positions, &solid.triangles, &view);
    let reversed: Vec<_> = solid.triangles.iter().rev().copied().collect();
    let backward = visibility(&solid.positions, &reversed, &view);
    assert_eq!(forward.depth, backward.depth);
    let last = solid.triangles.len() as u32 - 1;
    let renamed = backward.triangle.iter().map(|id| if *id == NONE { NONE } else { last - id });
    let other = forward.triangle.iter().zip(renamed).filter(|(a, b)| **a != *b).count();
    assert!(other <= 3, "{other} pixels name another triangle: only ties may");
}

/// Each triangle alone, and of every pixel's depths the greatest, and the greatest below that.
#[test]
fn two_depths_are_those_of_the_triangles_drawn_alone() {
    let solid = bitlight::world::shapes::torus_knot(2, 3, 0.35, 40, 6).unwrap();
    // Every triangle twice, so that each depth is reached twice; some from afar, so that they share pixels.
    let triangles: Vec<_> = solid.triangles.iter().chain(&solid.triangles).copied().collect();
    for (eye, size) in [(Vec3::new(1.5, 3.0, 4.5), [100, 90]), (Vec3::new(30.0, 5.0, 9.0), [9, 70])] {
        let axes = Axes::looking(-eye, Vec3::Y);
        let half = 2.0 / eye.length();
        let view = View::perspective(eye, axes, [half, half], 0.1, size);
        let (mut first, mut second) = (vec![0.0_f32; size[0] * size[1]], vec![0.0_f32; size[0] * size[1]]);
        let alone: Vec<_> =
            solid.triangles.iter().map(|one| visibility(&solid.positions, &[*one], &view).depth).collect();
        for pixel in 0..first.len() {
            let mut depths: Vec<f32> =
                alone.iter().map(|depth| depth[pixel]).filter(|depth| *depth > 0.0).collect();
            depths.sort_by(|a, b| b.total_cmp(a));
            depths.dedup();
            first[pixel] = depths.first().copied().unwrap_or_default();
            second[pixel] = depths.get(1).copied().unwrap_or_default();
        }
        let found = two_depths(&solid.positions, &triangles, &view);
        assert!(second.iter().filter(|depth| **depth > 0.0).count() > 100, "the test shows nothing");
        assert_eq!(found, [first, second]);
    }
}

/// Triangles of up to 64 pixels are filled in 32 bits, larger ones in 64: on both sides of that the pixels
/// are the same.
#[test]
fn a_large_triangle_is_filled_like_the_small_ones_that_it_is_made_of() {
    let size = 300;
    let axes = Axes { right: Vec3::X, up: Vec3::Y, forward: Vec3::NEG_Z };
    let view = View::orthographic(Vec3::ZERO, axes, [150.0, 150.0], [-1.0, 1.0], [size, size]);
    for trial in 0..40 {
        // Corners at multiples of 4: four levels down the parts' corners are on the grid of 1/256 pixel too.
        let place = |n: u64, dimension| ((unit(5, trial, n, dimension) * 290.0 - 145.0) / 4.0).round() * 4.0;
        let whole = [0, 1, 2].map(|n| Vec3::new(place(n, 0), place(n, 1), 0.0));
        let mut parts = vec![whole];
        for _ in 0..4 {
            parts = parts
                .iter()
                .flat_map(|[a, b, c]| {
                    let (ab, bc, ca) = ((*a + *b) * 0.5, (*b + *c) * 0.5, (*c + *a) * 0.5);
                    [[*a, ab, ca], [ab, *b, bc], [ca, bc, *c], [ab, bc, ca]]
                })
                .collect();
        }
        let seen = visibility(&whole, &[[0, 1, 2]], &view);
        let corners: Vec<Vec3> = parts.as_flattened().to_vec();
        let triangles: Vec<[u32; 3]> =
            (0..parts.len() as u32).map(|part| [0, 1, 2].map(|i| 3 * part + i)).collect();
        let made = visibility(&corners, &triangles, &view);
        for pixel in 0..size * size {
            assert_eq!(
                seen.triangle[pixel] == NONE,
                made.triangle[pixel] == NONE,
                "trial {trial}, pixel {pixel}"
            );
        }
    }
}

/// Nothing nearer than the near plane is drawn, and what crosses it is cut there.
#[test]
fn the_near_plane_cuts_at_its_own_distance() {
    let axes = Axes::looking(Vec3::NEG_Z, Vec3::Y);
    let view = View::perspective(Vec3::ZERO, axes, [1.0, 1.0], 1.0, [64, 64]);
    // A triangle before the plane, up to a thousandth from it; and one just beyond.
    let across = |z: f32| [Vec3::new(-9.0, -9.0, z), Vec3::new(9.0, -9.0, z), Vec3::new(0.0, 9.0, z)];
    for z in [-0.3, -0.55, -0.7, -0.999] {
        assert!(visibility(&across(z), &[[0, 1, 2]], &view).triangle.iter().all(|id| *id == NONE), "{z}");
    }
    assert!(visibility(&across(-1.001), &[[0, 1, 2]], &view).triangle.contains(&0));
    // A floor from before the plane to far beyond: row by row at height −½ it lies at 1/2 over the row's
    // tangent.
    let floor = [Vec3::new(-9.0, -0.5, -0.6), Vec3::new(9.0, -0.5, -0.6), Vec3::new(0.0, -0.5, -30.0)];
    let seen = visibility(&floor, &[[0, 1, 2]], &view);
    for y in 0..64 {
        let down = (2 * y + 1) as f32 / 64.0 - 1.0;
        let distance = 0.5 / down;
        let expected = down > 0.0 && (1.0..20.0).contains(&distance);
        if expected || down <= 0.0 || distance < 0.99 {
            assert_eq!(seen.triangle[y * 64 + 32] != NONE, expected, "row {y} at distance {distance}");
        }
    }
    assert!(seen.depth.iter().all(|depth| *depth <= 1.0));
}
