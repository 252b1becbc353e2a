//! Several accumulation points: the oracle's own of projection, matrices and radiosity, and what they are
//! for.

use std::f64::consts::PI;

use bitlight_reference::translucency::cube::{FACES, Face, face_point};
use bitlight_reference::translucency::optics::schlick_transmittance;
use bitlight_reference::translucency::{
    CubemapSample, EQ11_CONSTANTS_AS_PRINTED, eq6_project_samples, eq10_radiosity, eq11_constants,
    eq11_matrix, eq11_matrix_as_printed,
};
use bitlight_reference::vector::{Vec3, add, cross, dot, length, normalize, scale, sub};

use crate::accumulated::interpolated;
use crate::oracle::Drawn;
use crate::world::{BEAM, EVEN, POINT, PROBE, Rendered, SOLIDS, head};
use crate::{U, Worst, larger, smaller};

/// The points of a box: the middles of its parts, x fastest, and half a part's sides; in the scene's unit.
struct Parts {
    middles: Vec<Vec3>,
    half: Vec3,
}

impl Parts {
    fn new(scene: &Rendered, along: usize) -> Self {
        let (centre, half) = (scene.world.viewed.centre(), scene.world.viewed.half_extents());
        let longest = half.into_iter().fold(0.0, larger);
        let counts = half.map(|side| larger((along as f64 * side / longest).round(), 1.0));
        let mut middles = Vec::new();
        for z in 0..counts[2] as usize {
            for y in 0..counts[1] as usize {
                for x in 0..counts[0] as usize {
                    let at = [x, y, z].map(|at| at as f64);
                    middles.push(
                        [0, 1, 2].map(|i| centre[i] - half[i] + (2.0 * at[i] + 1.0) * half[i] / counts[i]),
                    );
                }
            }
        }
        Self { middles, half: [0, 1, 2].map(|i| half[i] / counts[i]) }
    }

    /// A way in directions in which a part is a cube.
    fn scaled(&self, way: Vec3) -> Vec3 {
        [0, 1, 2].map(|i| way[i] / self.half[i])
    }

    /// What each point counts at a place: its weight falls from 1 at its own middle to 0 at the next along
    /// each axis; outside the outermost it stays.
    fn weights(&self, place: Vec3) -> Vec<f64> {
        let end = |pick: fn(f64, f64) -> f64| {
            self.middles.iter().fold(self.middles[0], |end, at| [0, 1, 2].map(|i| pick(end[i], at[i])))
        };
        let (low, high) = (end(smaller), end(larger));
        let held = [0, 1, 2].map(|i| smaller(larger(place[i], low[i]), high[i]));
        let along = |middle: &Vec3, i: usize| 1.0 - (held[i] - middle[i]).abs() / (2.0 * self.half[i]);
        self.middles.iter().map(|middle| (0..3).map(|i| larger(along(middle, i), 0.0)).product()).collect()
    }
}

/// The solid angle of a triangle from the origin (Van Oosterom and Strackee 1983).
fn solid_angle([a, b, c]: [Vec3; 3]) -> f64 {
    let (la, lb, lc) = (length(a), length(b), length(c));
    let below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
    2.0 * libm::atan2(dot(a, cross(b, c)).abs(), below)
}

/// Solids and settings under test, with three points along the longest side.
fn scenes() -> Vec<Rendered> {
    let variants: [(&str, usize, &[&str]); 6] = [
        ("knot", 1, &[]),
        ("cuboid", 2, &[]),
        ("cuboid to the letter", 2, &["translucency.reading=paper"]),
        ("cuboid shifted", 2, &["translucency.shift_cure=false"]),
        ("cuboid in a cube", 2, &["translucency.blindness_cure=false"]),
        ("knot per vertex", 1, &["translucency.evaluation=vertex"]),
    ];
    variants
        .into_iter()
        .map(|(name, solid, set)| {
            let (_, solid, material) = SOLIDS[solid];
            let text = [&head(solid, material), PROBE, POINT, EVEN, BEAM].concat();
            Rendered::new(name, &text, &[set, &["translucency.accumulation=3"]].concat())
        })
        .collect()
}

/// Eq. 6 from each point: its texels have directions and solid angles of their own. The points are in f32 in
/// the pass, and a texel's solid angle here is that of two triangles, not of four corners.
#[test]
fn projection_on_several_points() {
    for scene in scenes() {
        let (parts, size) = (Parts::new(&scene, 3), scene.world.cubemap);
        let (lights, points) = (scene.world.lamps.len(), parts.middles.len());
        assert!(points >= 3, "{points} points");
        let projection = scene.buffer("projection");
        assert_eq!(projection.shape, [lights, points, 9, 3]);
        let (centre, half) = (scene.world.viewed.centre(), scene.world.viewed.half_extents());
        let mut worst = Worst::new(format!("projection on {points} points of {}", scene.name));
        for (number, middle) in parts.middles.iter().enumerate() {
            // A place on a texel, from its corner (0, 0) to (1, 1).
            let seen = |face: Face, texel: [usize; 2], within: [f64; 2]| {
                let [s, t] = [0, 1].map(|i| 2.0 * (texel[i] as f64 + within[i]) / size as f64 - 1.0);
                let on_cube = face_point(face, s, -t);
                parts.scaled(sub([0, 1, 2].map(|i| centre[i] + half[i] * on_cube[i]), *middle))
            };
            for (light, channel) in (0..lights).flat_map(|light| [0, 1, 2].map(|channel| (light, channel))) {
                let mut samples = Vec::new();
                for (index, texel) in scene.buffer("transmit").slice(light).chunks_exact(3).enumerate() {
                    let at = |x: f64, y: f64| {
                        seen(FACES[index / (size * size)], [index % size, index / size % size], [x, y])
                    };
                    let [a, b, c, d] = [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)];
                    samples.push(CubemapSample {
                        direction: normalize(at(0.5, 0.5)),
                        solid_angle: solid_angle([a, b, c]) + solid_angle([a, c, d]),
                        irradiance: f64::from(texel[channel]),
                    });
                }
                let whole: f64 = samples.iter().map(|sample| sample.solid_angle).sum();
                assert!((whole - 4.0 * PI).abs() < 1e-9, "the point sees all of the box");
                let magnitude: f64 =
                    samples.iter().map(|sample| sample.irradiance * sample.solid_angle).sum();
                for (i, mut expected) in eq6_project_samples(3, &samples).into_iter().enumerate() {
                    if scene.world.paper && [1, 4, 5].contains(&i) {
                        expected = -expected;
                    }
                    let found = projection.slice(light)[(number * 9 + i) * 3 + channel];
                    let tolerance = 1.001 * U * expected.abs() + 8.0 * U * magnitude;
                    worst.check(found, expected, tolerance, (light, number, i, channel));
                }
            }
        }
        worst.done(300);
    }
}

/// Eq. 11 for each point: an entry is a rounded constant times a coefficient, or two of these.
#[test]
fn matrices_of_several_points() {
    for scene in scenes() {
        let (points, lights) = (Parts::new(&scene, 3).middles.len(), scene.world.lamps.len());
        let (projection, matrices) = (scene.buffer("projection"), scene.buffer("matrices"));
        assert_eq!(matrices.shape, [lights, points, 3, 4, 4]);
        let mut worst = Worst::new(format!("matrices of {points} points of {}", scene.name));
        for (index, found) in matrices.as_f32().chunks_exact(16).enumerate() {
            let (number, channel) = (index / 3, index % 3);
            let e: [f64; 9] =
                std::array::from_fn(|i| f64::from(projection.as_f32()[number * 27 + i * 3 + channel]));
            let expected = match scene.world.paper {
                true => eq11_matrix_as_printed(&e, &EQ11_CONSTANTS_AS_PRINTED),
                false => eq11_matrix(&e, &eq11_constants()),
            };
            for (entry, (found, expected)) in found.iter().zip(expected.as_flattened()).enumerate() {
                let terms = if entry == 15 { e[0].abs() + e[6].abs() } else { expected.abs() };
                worst.check(*found, *expected, 3.0 * U * terms, (index, entry));
            }
        }
        worst.done(400);
    }
}

/// Eq. 10 from each point to where the refracted ray leaves the box, and the mean of the points around.
#[test]
fn radiosity_between_several_points() {
    for scene in scenes() {
        let parts = Parts::new(&scene, 3);
        let (points, width) = (parts.middles.len(), scene.world.camera.size[0]);
        let drawn = Drawn::new(&scene.world, &scene.world.camera);
        let mut worst = Worst::new(format!("radiosity between {points} points of {}", scene.name));
        let mut between = 0;
        for index in (0..scene.pixels()).filter(|index| scene.pixel(*index).is_some()) {
            let (point, normal) = scene.pixel(index).unwrap();
            let weights = parts.weights(point);
            assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-9);
            between += usize::from(weights.iter().all(|weight| *weight < 0.9));
            for light in 0..scene.world.lamps.len() {
                let matrices = scene.buffer("matrices").slice(light);
                for channel in 0..3 {
                    let at = |point, normal| radiosity_at(&scene, &parts, matrices, channel, point, normal);
                    let (expected, tolerance) = match scene.world.per_vertex {
                        true => {
                            let triangle = scene.buffer("vbuffer").as_u32()[index] as usize;
                            let place = ((index % width) as f64 + 0.5, (index / width) as f64 + 0.5);
                            interpolated(&scene, &drawn, at, triangle, place)
                        }
                        false => at(point, normal),
                    };
                    let found = scene.buffer("radiosity").slice(light)[index * 3 + channel];
                    worst.check(found, expected, tolerance, (light, index, channel));
                }
            }
        }
        assert!(between > 100, "{}: {between} pixels lie between points", scene.name);
        worst.done(1500);
    }
}

/// The radiosity of one channel at a point of the surface, and its tolerance: what some four roundings of the
/// box move where the ray leaves and the weights, and the rounding of a sum of sixteen.
fn radiosity_at(
    scene: &Rendered,
    parts: &Parts,
    matrices: &[f32],
    channel: usize,
    point: Vec3,
    normal: Vec3,
) -> (f64, f64) {
    let (bounds, cured) = (&scene.world.viewed, scene.world.shift_cure);
    let r = scene.world.refracted(point, normal);
    let leaves = bounds.exit(point, r);
    let (mut expected, mut tolerance) = (0.0, 0.0);
    for (number, weight) in parts.weights(point).into_iter().enumerate() {
        let entries = &matrices[(number * 3 + channel) * 16..][..16];
        let matrix: [[f64; 4]; 4] =
            std::array::from_fn(|i| std::array::from_fn(|j| f64::from(entries[i * 4 + j])));
        // Without the cure of shift, the refracted direction itself.
        let lookup = |leaves: Vec3| {
            let from = if cured { parts.middles[number] } else { sub(leaves, r) };
            normalize(parts.scaled(sub(leaves, from)))
        };
        let here = eq10_radiosity(&matrix, lookup(leaves));
        let held = if scene.world.paper { here } else { larger(here, 0.0) };
        expected += weight * held;
        tolerance += weight * 16.0 * U * entries.iter().map(|entry| f64::from(*entry).abs()).sum::<f64>();
        for i in 0..3 {
            let by = 4.0 * U * larger(bounds.max[i].abs(), bounds.min[i].abs());
            let mut moved = leaves;
            moved[i] += by;
            let change = (eq10_radiosity(&matrix, lookup(moved)) - here).abs();
            tolerance += weight * change + by / parts.half[i] * held.abs();
        }
    }
    (expected, tolerance)
}

/// Eq. 5 without harmonics and with the shaded point for its accumulation point, as §2.1 would have it if it
/// could be afforded: the cosine-weighted irradiance that entered where each ray from the point leaves the
/// cuboid, over the hemisphere about r. By the middles of 96 × 192 equal parts in (cos² θ, φ), where the
/// cosine is in the measure.
fn brute_force(scene: &Rendered, point: Vec3, r: Vec3) -> f64 {
    let (n, m) = (96, 192);
    let side = normalize(cross(r, if r[0].abs() < 0.7 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] }));
    let other = cross(r, side);
    let (bounds, mut total) = (&scene.world.bounds, 0.0);
    for i in 0..n {
        let squared = (f64::from(i) + 0.5) / f64::from(n); // sin² θ
        let (sine, cosine) = (squared.sqrt(), (1.0 - squared).sqrt());
        for j in 0..m {
            let phi = 2.0 * PI * (f64::from(j) + 0.5) / f64::from(m);
            let across = add(scale(sine * libm::cos(phi), side), scale(sine * libm::sin(phi), other));
            let leaves = bounds.exit(point, add(scale(cosine, r), across));
            // The face that it leaves by: the one it is nearest to.
            let (mut normal, mut nearest) = ([0.0; 3], f64::INFINITY);
            for axis in 0..3 {
                for (sign, wall) in [(1.0, bounds.max[axis]), (-1.0, bounds.min[axis])] {
                    let off = (leaves[axis] - wall).abs();
                    if off < nearest {
                        nearest = off;
                        normal = [0.0; 3];
                        normal[axis] = sign;
                    }
                }
            }
            let [irradiance, .., cosine_in] = scene.world.lamps[0].illuminates(leaves, normal);
            total += irradiance * schlick_transmittance(scene.world.eta, cosine_in);
        }
    }
    PI * total / f64::from(n * m)
}

/// A bar six times as long as wide, lit from beyond one end: what it gathers falls along it. Nine
/// coefficients of the one centre miss that by more than the whole; from four points on, what remains is
/// mostly theirs, not the points'.
#[test]
fn several_points_follow_the_light_along_a_bar() {
    let mut errors = Vec::new();
    for along in [1, 2, 4, 6, 12] {
        let text = head("shape = \"cuboid\", resolution = 6, extents = [18, 3, 3]", "name = \"Marble\"")
            .replace("cubemap = 12", &format!("cubemap = 48, accumulation = {along}"))
            + "[[light]]\nkind = \"point\"\nposition = [24, -2, 1]\nintensity = [900, 900, 900]\n";
        let scene = Rendered::new("bar", &text, &[]);
        let (mut error, mut whole, mut ends) = (0.0, 0.0, [[0.0; 3]; 2]);
        for index in (0..scene.pixels()).filter(|index| scene.pixel(*index).is_some()) {
            let (point, normal) = scene.pixel(index).unwrap();
            let expected = brute_force(&scene, point, scene.world.refracted(point, normal));
            let found = f64::from(scene.buffer("radiosity").as_f32()[index * 3]);
            error += (found - expected) * (found - expected);
            whole += expected * expected;
            let (bounds, third) = (&scene.world.bounds, 6.0);
            for (end, ends) in ends.iter_mut().enumerate() {
                let off = if end == 0 { bounds.max[0] - point[0] } else { point[0] - bounds.min[0] };
                if off < third {
                    *ends = add(*ends, [found, expected, 1.0]);
                }
            }
        }
        let error = (error / whole).sqrt();
        let [found, expected] = [0, 1].map(|i| ends[0][i] / ends[0][2] / (ends[1][i] / ends[1][2]));
        eprintln!(
            "{along} along the bar: error {:.1} % of the brute force's RMS; lit third {found:.2} times the dark one, \
            {expected:.2} by brute force",
            error * 100.0
        );
        errors.push((error, found));
    }
    let (one, two) = (errors[0], errors[1]);
    assert!(two.0 < 0.6 * one.0 && two.1 > 1.5 * one.1, "{errors:?}");
    for four_and_more in &errors[2..] {
        assert!(four_and_more.0 < 0.2 * one.0 && four_and_more.1 > two.1, "{errors:?}");
    }
}
