//! The passes that fill pixels, against rays: cubemap, shadow, peel, vbuffer, gbuffer.

use bitlight_reference::translucency::cube::{FACES, texel_point};
use bitlight_reference::vector::{add, dot, length, sub};

use crate::oracle::{Candidate, Drawn, View};
use crate::world::{CENTRE, POINT, Rendered, all, head, scenes};
use crate::{U, Worst, larger};

const NONE: u32 = u32::MAX;

/// The centre of a pixel.
fn centre(index: usize, width: usize) -> (f64, f64) {
    ((index % width) as f64 + 0.5, (index / width) as f64 + 0.5)
}

/// Of `all` pixels, at most one in `one_in` may have more than one answer.
fn few(what: &str, unclear: usize, all: usize, one_in: usize) {
    eprintln!("{what}: {unclear} of {all} pixels lie at an edge and have more than one answer");
    assert!(unclear * one_in <= all, "{what}: {unclear} of {all} pixels are unclear");
}

/// The oracle's own faces are the texels of the reference.
#[test]
fn the_views_of_the_cubemap_look_along_the_reference_texels() {
    for scene in all() {
        let (bounds, size) = (&scene.world.viewed, scene.world.cubemap);
        for face in FACES {
            let view = View::onto_face(face, bounds, size);
            for (i, j) in [(0, 0), (8, 0), (3, 7)] {
                let on_cube = texel_point(face, size as u32, i, j);
                let half = bounds.half_extents();
                let point = add(bounds.centre(), [0, 1, 2].map(|axis| on_cube[axis] * half[axis]));
                let (origin, _) = view.ray(f64::from(i) + 0.5, f64::from(j) + 0.5);
                assert!(length(sub(origin, point)) < 1e-12, "{face:?}");
            }
        }
    }
}

/// Irradiance and cosine of the nearest triangle of each texel's ray. The tolerance is the change over the
/// rounding of the place on the triangle, and 16 operations on terms of the irradiance's magnitude.
#[test]
fn cubemap() {
    for scene in all() {
        let (world, size) = (&scene.world, scene.world.cubemap);
        let recorded = scene.buffer("cubemap");
        assert_eq!(recorded.shape, [world.lamps.len(), 6, size, size, 4]);
        let mut worst = Worst::new(format!("cubemap of {}", scene.name));
        let (mut unclear, mut covered) = (0, 0);
        for (number, face) in FACES.into_iter().enumerate() {
            let view = View::onto_face(face, &world.viewed, size);
            let drawn = Drawn::new(world, &view);
            for texel in 0..size * size {
                let (x, y) = centre(texel, size);
                let seen = drawn.seen(x, y, None);
                unclear += usize::from(!seen.clear());
                covered += usize::from(!seen.none);
                for (light, lamp) in world.lamps.iter().enumerate() {
                    let at = ((light * 6 + number) * size * size + texel) * 4;
                    let found = &recorded.as_f32()[at..at + 4];
                    if seen.none && found.iter().all(|value| *value == 0.0) {
                        continue;
                    }
                    // Of several triangles the one that fits best.
                    let fit = |triangle: usize| {
                        let (point, normal) = drawn.surface(triangle, x, y, true);
                        let expected = lamp.illuminates(point, normal);
                        let spread = drawn.spread(triangle, x, y, |p, n| lamp.illuminates(p, n));
                        let tolerance: [f64; 4] = std::array::from_fn(|i| {
                            let magnitude = if i < 3 { lamp.magnitude(point, i) } else { 1.0 };
                            spread[i] + 16.0 * U * magnitude
                        });
                        let share = |i: usize| (f64::from(found[i]) - expected[i]).abs() / tolerance[i];
                        ((0..4).map(share).fold(0.0, larger), expected, tolerance)
                    };
                    let fits = seen.nearest.iter().map(|one| fit(one.triangle));
                    let best = fits.min_by(|a, b| a.0.total_cmp(&b.0));
                    let (_, expected, tolerance) = best.unwrap_or((0.0, [0.0; 4], [0.0; 4]));
                    for i in 0..4 {
                        worst.check(found[i], expected[i], tolerance[i], (light, face, x, y, i));
                    }
                }
            }
        }
        few(scene.name, unclear, 6 * size * size, 10);
        let share = covered as f64 / (6 * size * size) as f64;
        eprintln!("{}: the six views see a surface in {share:.3} of their texels", scene.name);
        // Within the cube the cuboid of 7 × 19 × 3.5 has these faces, but for texels at its edges.
        let expected = if scene.name == "cuboid in a cube" { 0.166..0.247 } else { 0.25..1.001 };
        assert!(expected.contains(&share), "{}: the faces see {share}", scene.name);
        worst.done(covered * 16);
    }
}

/// The first and the second hit along the ray of each texel: their distance, and the first one's depth. The
/// tolerance is the change of depth over the distance that snapping moves a point, and the rounding of the
/// depth plane.
#[test]
fn shadow_and_peel() {
    for scene in scenes() {
        let world = &scene.world;
        let (shadow, peel) = (scene.buffer("shadow"), scene.buffer("peel"));
        assert_eq!(world.casters.len(), 2);
        for (number, (light, view)) in world.casters.iter().enumerate() {
            let [width, height] = view.size;
            assert_eq!(
                (&shadow.shape[1..], &peel.shape[1..]),
                (&[height, width, 3][..], &[height, width][..])
            );
            let drawn = Drawn::new(world, view);
            let name = format!("of light {light} on {}", scene.name);
            let mut first = Worst::new(format!("shadow {name}"));
            let mut depths = Worst::new(format!("depth {name}"));
            let mut second = Worst::new(format!("peel {name}"));
            let (mut unclear, mut hit, mut hit_twice) = (0, 0, 0);
            for texel in 0..width * height {
                let (x, y) = centre(texel, width);
                let found = &shadow.slice(number)[texel * 3..][..2];
                let seen = drawn.seen(x, y, None);
                unclear += usize::from(!seen.clear());
                let expected = |one: &Candidate| {
                    let (distance, slope) = view.distance_of(one.depth, x, y);
                    (distance, slope * one.slack + 8.0 * U * distance)
                };
                if found[0] == 0.0 || seen.nearest.is_empty() {
                    let none = seen.none && (seen.nearest.is_empty() || drawn.on_rim(x, y));
                    assert!(none && found == [0.0; 2], "{name}: {found:?} at ({x}, {y})");
                    assert_eq!(peel.slice(number)[texel], 0.0, "{name}: nothing is behind nothing");
                    continue;
                }
                hit += 1;
                let best = seen.nearest.iter().min_by(|a, b| {
                    let share = |one: &Candidate| (one.depth - f64::from(found[1])).abs() / one.slack;
                    share(a).total_cmp(&share(b))
                });
                let best = best.unwrap();
                let (distance, tolerance) = expected(best);
                first.check(found[0], distance, tolerance, (x, y));
                depths.check(found[1], best.depth, best.slack, (x, y));

                // Behind the first depth lies none of the triangles that have it; only where it is clear
                // which one has.
                if !seen.clear() {
                    continue;
                }
                let but = [best.triangle];
                let behind = drawn.seen(x, y, Some((f64::from(found[1]), &but)));
                unclear += usize::from(!behind.clear());
                let found = peel.slice(number)[texel];
                if found == 0.0 {
                    assert!(behind.none, "{name}: no second surface at ({x}, {y})");
                    continue;
                }
                hit_twice += 1;
                let fits = behind.nearest.iter().map(expected);
                let share =
                    |(distance, tolerance): &(f64, f64)| (distance - f64::from(found)).abs() / tolerance;
                let best = fits.min_by(|a, b| share(a).total_cmp(&share(b)));
                let (distance, tolerance) = best.unwrap_or((0.0, 0.0));
                second.check(found, distance, tolerance, (x, y));
            }
            few(&name, unclear, width * height, 7);
            // Closed solids are left where they were entered, but for few texels at the rim.
            assert!(hit_twice * 100 >= hit * 85, "{name}: {hit_twice} of {hit} rays leave");
            first.done(width * height / 6);
            depths.done(width * height / 6);
            second.done(width * height / 7);
        }
    }
}

/// The recorded triangle is one that may be nearest, and a pixel is empty only where the rays around it miss.
fn check_visibility(scene: &Rendered, band: f64, one_in: usize) {
    let world = &scene.world;
    let [width, height] = world.camera.size;
    let recorded = scene.buffer("vbuffer");
    assert_eq!(recorded.shape, [height, width]);
    let drawn = Drawn::with_band(world, &world.camera, band);
    let (mut unclear, mut covered) = (0, 0);
    for (index, found) in recorded.as_u32().iter().enumerate() {
        let (x, y) = centre(index, width);
        let seen = drawn.seen(x, y, None);
        unclear += usize::from(!seen.clear());
        if *found == NONE {
            let rim = seen.nearest.is_empty() || drawn.on_rim(x, y);
            assert!(seen.none && rim, "{}: ({x}, {y}) is empty; it sees {:?}", scene.name, seen.nearest);
        } else {
            covered += 1;
            let allowed = seen.nearest.iter().any(|one| one.triangle == *found as usize);
            assert!(allowed, "{}: ({x}, {y}) has {found}; it sees {:?}", scene.name, seen.nearest);
        }
    }
    few(scene.name, unclear, width * height, one_in);
    assert!(covered * 12 > width * height, "{}: the camera sees too little", scene.name);
}

/// Position, normal and depth of the recorded triangle where the ray through the pixel's centre meets it. The
/// tolerance is the change over the rounding of the place, and 8 operations on the corners' coordinates.
fn check_gbuffer(scene: &Rendered) {
    let world = &scene.world;
    let width = world.camera.size[0];
    let drawn = Drawn::new(world, &world.camera);
    let mut worst = Worst::new(format!("gbuffer of {}", scene.name));
    let recorded = scene.buffer("gbuffer").as_f32();
    for (index, triangle) in scene.buffer("vbuffer").as_u32().iter().enumerate() {
        let found = &recorded[index * 7..][..7];
        if *triangle == NONE {
            assert_eq!(found, [0.0; 7]);
            continue;
        }
        let (x, y) = centre(index, width);
        let values = |point: [f64; 3], normal: [f64; 3]| {
            let depth = world.camera.ahead(point);
            [point[0], point[1], point[2], normal[0], normal[1], normal[2], depth]
        };
        let (point, normal) = drawn.surface(*triangle as usize, x, y, true);
        let (expected, spread) = (values(point, normal), drawn.spread(*triangle as usize, x, y, values));
        for i in 0..7 {
            let magnitude = match i {
                0..3 => length(point),
                3..6 => 1.0,
                _ => length(point) + length(world.eye),
            };
            worst.check(found[i], expected[i], spread[i] + 8.0 * U * magnitude, (x, y, i));
        }
    }
    worst.done(7 * scene.pixels() / 12);
}

#[test]
fn visibility() {
    scenes().iter().for_each(|scene| check_visibility(scene, crate::oracle::SNAP, 10));
}

#[test]
fn gbuffer() {
    scenes().iter().for_each(check_gbuffer);
}

/// A camera within the solid: triangles cross the near plane and the guard band, and are clipped. A corner
/// that clipping makes may lie 2¹⁴ pixels off, where `f32` is exact to 10⁻³ pixel: the band is 1/64 pixel.
#[test]
fn visibility_and_gbuffer_from_inside() {
    for (name, solid, look) in [
        ("inside a sphere", "shape = \"sphere\", resolution = 6, size = 20", "fov = 100"),
        ("inside a cuboid", "shape = \"cuboid\", resolution = 2, extents = [20, 16, 30]", "fov = 150"),
        ("beside a wall", "shape = \"cuboid\", resolution = 2, extents = [7.75, 60, 40]", "fov = 120"),
    ] {
        let camera = "position = [6, 8, 46], target = [1, -2, 0.5], up = [0.25, 1, 0], fov = 27";
        let text = head(solid, "name = \"Marble\"");
        assert!(text.contains(camera));
        let inside = format!("position = [5.5, -1, -2], target = [5.25, 3, 6], up = [1, 0.25, 0], {look}");
        let text = text.replace(camera, &inside) + POINT;
        let scene = Rendered::new(name, &text, &[]);
        let (eye, bounds) = (scene.world.eye, &scene.world.bounds);
        assert!((0..3).all(|axis| (eye[axis] - CENTRE[axis]).abs() < bounds.half_extents()[axis] + 0.2));
        check_visibility(&scene, 1.0 / 64.0, 5);
        check_gbuffer(&scene);
        // Some triangle does cross the near plane.
        let crosses = |triangle: &&[[f64; 3]; 3]| {
            let ahead = triangle.map(|corner| scene.world.camera.ahead(corner));
            ahead.iter().any(|ahead| *ahead < 0.0) && ahead.iter().any(|ahead| *ahead > 0.0)
        };
        assert!(scene.world.triangles.iter().filter(crosses).count() > 3, "{name}");
        assert!(dot(scene.world.camera.forward, scene.world.camera.forward) > 0.99);
    }
}
