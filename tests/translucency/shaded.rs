//! What a light's maps and the surface make of the radiosity: blur, thickness, attenuation, direct, final.

use std::f64::consts::PI;

use bitlight_reference::translucency::blur::{blur, blur_as_printed, centred_taps, paper_taps};
use bitlight_reference::translucency::optics::{
    effective_diffuse_cosine, schlick_reflectance, schlick_transmittance,
};
use bitlight_reference::translucency::{
    eq12_radiance, eq12_radiance_as_printed, thickness as eq_thickness, thickness_as_printed,
};
use bitlight_reference::vector::{Vec3, add, dot, length, normalize, sub};

use crate::oracle::View;
use crate::world::{Lamp, Rendered, all};
use crate::{U, Worst, larger, smaller};

/// The Gaussian as a plain double sum. Two sums of five rounded products and a quotient: some 16 operations
/// on positive numbers. What has no surface in reach is 0 to the bit. To the letter the kernel is another,
/// and the clear value, 1.5 radii behind the box's centre, takes part (T6, T12).
#[test]
fn blurred() {
    for scene in all() {
        let world = &scene.world;
        for (number, (_, view)) in scene.world.casters.iter().enumerate() {
            let mut worst = Worst::new(format!("blur {number} of {}", scene.name));
            let shadow: Vec<f64> = scene
                .buffer("shadow")
                .slice(number)
                .chunks_exact(3)
                .map(|texel| f64::from(texel[0]))
                .collect();
            let (bounds, [width, height]) = (&world.bounds, view.size);
            let clear = view.distance(bounds.centre()) + 1.5 * length(bounds.half_extents());
            let expected = match world.paper {
                true => blur_as_printed(&shadow, width, height, &paper_taps(world.blur), clear),
                false => blur(&shadow, width, height, &centred_taps(world.blur)),
            };
            for (index, expected) in expected.into_iter().enumerate() {
                let found = scene.buffer("blur").slice(number)[index];
                worst.check(
                    found,
                    expected,
                    16.0 * U * expected,
                    (index % view.size[0], index / view.size[0]),
                );
            }
            worst.done(view.size[0] * view.size[1]);
        }
    }
}

/// The four texels around a point and their weights, and by how much a weight may be off.
struct Around {
    texels: [(usize, f64); 4],
    error: f64,
}

impl Around {
    fn new(view: &View, point: Vec3) -> Self {
        let [x, y] = view.pixel(point);
        let ([x, y], size) = ([x - 0.5, y - 0.5], view.size[0]);
        let (column, row) = (libm::floor(x), libm::floor(y));
        let held = |at: f64| smaller(larger(at, 0.0), size as f64 - 1.0) as usize;
        let one = |right: f64, below: f64| {
            let weight = |past: f64, side: f64| if side == 1.0 { past } else { 1.0 - past };
            let index = held(row + below) * size + held(column + right);
            (index, weight(x - column, right) * weight(y - row, below))
        };
        Self {
            texels: [one(0.0, 0.0), one(1.0, 0.0), one(0.0, 1.0), one(1.0, 1.0)],
            error: 2.0 * view.rounding(point) + 4.0 * U,
        }
    }

    /// The least and the most weight of the texels of which something holds, which may be unsure.
    fn share(&self, holds: impl Fn(usize) -> Option<bool>) -> (f64, f64) {
        let (mut least, mut most) = (0.0, 0.0);
        for (texel, weight) in self.texels {
            let sure = holds(texel);
            least += if sure == Some(true) { weight } else { 0.0 };
            most += if sure == Some(false) { 0.0 } else { weight };
        }
        let (none, all) = (most == 0.0, self.texels.iter().all(|(texel, _)| holds(*texel) == Some(true)));
        match (none, all) {
            (true, _) => (0.0, 0.0),
            (_, true) => (1.0 - 4.0 * U, 1.0),
            _ => (larger(least - 4.0 * self.error, 0.0), smaller(most + 4.0 * self.error, 1.0)),
        }
    }
}

/// a ≤ b, where they differ by more than an error.
fn surely(a: f64, b: f64, error: f64) -> Option<bool> {
    ((a - b).abs() > error).then_some(a <= b)
}

/// How much farther than a texel says a point of its surface may lie, and the error of that: a texel's width,
/// times one plus the slope of the surface, at most the root of the map's size. A cosine is exact to some
/// [`U`].
fn slack(view: &View, point: Vec3, cosine: f64) -> (f64, f64) {
    let at = |cosine: f64| {
        let cosine = smaller(larger(cosine.abs(), 1e-9), 1.0);
        let slope = (1.0 - cosine * cosine).sqrt() / cosine;
        view.texel_size(point) * (1.0 + smaller(slope, (view.size[0] as f64).sqrt()))
    };
    let here = at(cosine);
    // Where the light is frontal the sine is the root of a rounded 1 − c²: off by up to √(8U).
    let change = (at(cosine + 8.0 * U) - here).abs() + (at(cosine - 8.0 * U) - here).abs();
    (here, change + 16.0 * U * here)
}

/// Distance from the light less the blurred first distance, looked up between four texels without the empty
/// ones; and the share of the four beyond whose second surface the point does not lie. Distances are exact to
/// some [`U`], and a weight to the rounding of the place on the map, which mixes in the difference of the
/// texels.
#[test]
fn thickness() {
    for scene in all() {
        let world = &scene.world;
        for (number, (light, view)) in world.casters.iter().enumerate() {
            let name = format!("of light {light} on {}", scene.name);
            let mut worst = Worst::new(format!("thickness {name}"));
            let mut received = Worst::new(format!("received {name}"));
            let (blur, peel) = (scene.buffer("blur").slice(number), scene.buffer("peel").slice(number));
            let (mut deep, mut shaded, mut skipped, mut negative) = (0, 0, 0, 0);
            for index in 0..scene.pixels() {
                let found = &scene.buffer("thickness").slice(number)[index * 2..][..2];
                let Some((point, normal)) = scene.pixel(index) else {
                    assert_eq!(found, [0.0; 2]);
                    continue;
                };
                let (around, distance) = (Around::new(view, point), view.distance(point));
                let rounding = 8.0 * U * (distance + length(point));
                let filled: Vec<(f64, f64)> = around
                    .texels
                    .iter()
                    .map(|(texel, weight)| (f64::from(blur[*texel]), *weight))
                    .filter(|(distance, _)| *distance > 0.0)
                    .collect();
                let weight: f64 = filled.iter().map(|(_, weight)| weight).sum();
                let entered = filled.iter().map(|(first, weight)| first * weight).sum::<f64>() / weight;
                let apart: f64 = filled.iter().map(|(first, _)| (first - entered).abs()).sum();
                if weight > 1e-3 {
                    // The print has the order the other way round; what it means is a thickness.
                    let expected = match world.paper {
                        true => -thickness_as_printed(entered, distance),
                        false => eq_thickness(entered, distance),
                    };
                    negative += usize::from(expected < 0.0);
                    deep += usize::from(expected > 1.0);
                    let tolerance = rounding + apart * around.error / weight;
                    worst.check(found[0], expected, tolerance, (index % 40, index / 40));
                } else {
                    skipped += 1;
                }
                let cosine =
                    world.lamps[*light].arriving(point).map_or(0.0, |(towards, _)| dot(normal, towards));
                let (slack, error) = slack(view, point, cosine);
                let (least, most) = match world.second_layer {
                    true => around.share(|texel| match f64::from(peel[texel]) {
                        0.0 => Some(true),
                        second => surely(distance, second + slack, rounding + error),
                    }),
                    false => (1.0, 1.0),
                };
                shaded += usize::from(most < 0.5);
                let (middle, reach) = ((least + most) / 2.0, (most - least) / 2.0);
                received.check(found[1], middle, reach + 1e-12, (index % 40, index / 40));
            }
            eprintln!(
                "{name}: {deep} pixels deeper than 1, {shaded} receive less than half, {skipped} skipped, {negative} negative"
            );
            assert_eq!(negative > 0, world.paper, "{name}: {negative} are negative");
            // The point shines from behind, so that most of what is seen is deep.
            assert!(deep > 100 || matches!(world.lamps[*light], Lamp::Directional { .. }), "{name}: {deep}");
            assert!(skipped * 50 < worst.count, "{name}: {skipped}");
            let convex = scene.name.starts_with("sphere") || scene.name.starts_with("cuboid");
            assert!(shaded > 5 || convex || !world.second_layer, "{name}: {shaded}");
            worst.done(100);
            received.done(100);
        }
    }
}

/// Errors of a transmittance: its cosine is exact to four [`U`], over which it changes by five times as much
/// at most, and it has eight roundings of its own.
const TRANSMITTANCE: f64 = 28.0 * U;

/// Eq. 12 without B: transmittance to the eye times the dipole at the recorded thickness, for the share
/// received; for an environment at the length of the refracted ray in the box. The exponent's relative error
/// is that of the result.
#[test]
fn attenuation() {
    for scene in all() {
        let world = &scene.world;
        let mut worst = Worst::new(format!("attenuation of {}", scene.name));
        let mut brightest = 0.0;
        for light in 0..world.lamps.len() {
            let caster = world.casters.iter().position(|caster| caster.0 == light);
            for index in 0..scene.pixels() {
                let found = &scene.buffer("attenuation").slice(light)[index * 3..][..3];
                let Some((point, normal)) = scene.pixel(index) else {
                    assert_eq!(found, [0.0; 3]);
                    continue;
                };
                let (d, error, receives) = match caster {
                    Some(caster) => {
                        let texel = &scene.buffer("thickness").slice(caster)[index * 2..][..2];
                        (f64::from(texel[0]), 0.0, f64::from(texel[1]))
                    }
                    None => {
                        let (d, error) = through(scene, point, normal);
                        (d, error, 1.0)
                    }
                };
                let transmittance = world.leaving(point, normal);
                for channel in 0..3 {
                    let medium = &world.media[channel];
                    let eq12 = |transmittance: f64, d: f64| match world.paper {
                        true => {
                            let d = larger(d, world.smallest_d);
                            receives * eq12_radiance_as_printed(transmittance, medium, d, 1.0)
                        }
                        false => receives * eq12_radiance(transmittance, medium, larger(d, 0.0), 1.0),
                    };
                    let (expected, full) = (eq12(transmittance, d), eq12(1.0, d));
                    let exponent = medium.sigma_tr() * (larger(d, 0.0) + medium.z_v());
                    let thinner = eq12(1.0, d - error);
                    let tolerance = full * TRANSMITTANCE
                        + expected * (16.0 + 6.0 * exponent) * U
                        + transmittance * (thinner - full).abs();
                    worst.check(
                        found[channel],
                        expected,
                        tolerance,
                        (light, index % 40, index / 40, channel),
                    );
                    // T3: nothing is brighter than the surface itself, at any thickness; to the letter it is.
                    let most = medium.total_r_d() / (PI * PI);
                    brightest = larger(brightest, f64::from(found[channel]) / most);
                }
            }
        }
        let printed = scene.world.paper;
        eprintln!("{}: the brightest is {brightest:.3} of the surface's own", scene.name);
        assert_eq!(brightest > 1.0 + 16.0 * U, printed, "{}: {brightest}", scene.name);
        worst.done(1000);
    }
}

/// The mask of the pixels whose thickness was at or below the smallest: 0, or what the letter is held at,
/// which is exact to some [`U`] where the default is a part of the box. A thickness as near to it as that is
/// left out.
#[test]
fn held() {
    for scene in all() {
        let world = &scene.world;
        let (mut count, mut unclear) = ([0, 0], 0);
        for light in 0..world.lamps.len() {
            let caster = world.casters.iter().position(|caster| caster.0 == light);
            for index in 0..scene.pixels() {
                let found = scene.buffer("held").slice(light)[index];
                let Some((point, normal)) = scene.pixel(index) else {
                    assert_eq!(found, 0.0);
                    continue;
                };
                let (d, error) = match caster {
                    Some(caster) => (f64::from(scene.buffer("thickness").slice(caster)[index * 2]), 0.0),
                    None => through(scene, point, normal),
                };
                let smallest = if world.paper { world.smallest_d } else { 0.0 };
                if (d - smallest).abs() <= error + 8.0 * U * smallest && error + smallest > 0.0 {
                    unclear += 1;
                    continue;
                }
                assert_eq!(found, if d <= smallest { 1.0 } else { 0.0 }, "{}: {d} at {index}", scene.name);
                count[usize::from(found == 1.0)] += 1;
            }
        }
        eprintln!("{}: {count:?} pixels not held and held, {unclear} unclear", scene.name);
        assert!(count[0] > 500 && count[1] > 50 && unclear < 20, "{}: {count:?}", scene.name);
    }
}

/// The length of the refracted ray in the box, and its error: the direction is exact to some [`U`], the
/// wall's place to some [`U`] of its coordinate.
fn through(scene: &Rendered, point: Vec3, normal: Vec3) -> (f64, f64) {
    let (bounds, r) = (&scene.world.bounds, scene.world.refracted(point, normal));
    let at = |r: Vec3| length(sub(bounds.exit(point, r), point)) / length(r);
    let here = at(r);
    let mut error = 0.0;
    for axis in 0..3 {
        let mut turned = r;
        turned[axis] += 8.0 * U;
        error += (at(turned) - here).abs();
        let moved = 4.0 * U * larger(bounds.max[axis].abs(), bounds.min[axis].abs());
        error += moved / larger(r[axis].abs(), 1e-3);
    }
    (here, error + 8.0 * U * here)
}

/// What the surface itself sends back: R_d between two transmittances, and the normalised Blinn-Phong lobe
/// with Schlick's reflectance, in the share of the four texels that the light reaches.
#[test]
fn direct() {
    for scene in all() {
        let world = &scene.world;
        let mut worst = Worst::new(format!("direct of {}", scene.name));
        let (mut lit, mut dark) = (0, 0);
        for (light, lamp) in world.lamps.iter().enumerate() {
            for index in 0..scene.pixels() {
                let found = &scene.buffer("direct").slice(light)[index * 3..][..3];
                let Some((point, normal)) = scene.pixel(index) else {
                    assert_eq!(found, [0.0; 3]);
                    continue;
                };
                let share = lit_share(scene, light, point, normal);
                lit += usize::from(share.0 > 0.5);
                dark += usize::from(share.1 < 0.5);
                for channel in 0..3 {
                    let (full, error) = unshadowed(scene, lamp, channel, point, normal);
                    let (middle, reach) = ((share.0 + share.1) / 2.0, (share.1 - share.0) / 2.0);
                    let tolerance = full * reach + error;
                    worst.check(
                        found[channel],
                        full * middle,
                        tolerance,
                        (light, index % 40, index / 40, channel),
                    );
                }
            }
        }
        assert!(lit > 100 && dark > 50, "{}: {lit} lit, {dark} dark", scene.name);
        worst.done(1000);
    }
}

/// The share of the four texels around a point that the light reaches, at least and at most; all of an
/// environment's.
fn lit_share(scene: &Rendered, light: usize, point: Vec3, normal: Vec3) -> (f64, f64) {
    let world = &scene.world;
    let Some(number) = world.casters.iter().position(|caster| caster.0 == light) else { return (1.0, 1.0) };
    let Some((towards, _)) = world.lamps[light].arriving(point) else { return (1.0, 1.0) };
    let view = &world.casters[number].1;
    let cosine = dot(normal, towards);
    if cosine < -8.0 * U {
        return (0.0, 0.0);
    }
    let (slack, error) = slack(view, point, cosine);
    let distance = view.distance(point);
    let error = error + 8.0 * U * (distance + length(point));
    Around::new(view, point).share(|texel| match f64::from(scene.buffer("shadow").slice(number)[texel * 3]) {
        0.0 => Some(true),
        first => surely(distance - slack, first, error),
    })
}

/// The radiance in one channel without shadow, and its error. Transmittances are exact to [`TRANSMITTANCE`],
/// a cosine to four [`U`], (n·h)ⁿ to n times the relative error of n·h.
fn unshadowed(scene: &Rendered, lamp: &Lamp, channel: usize, point: Vec3, normal: Vec3) -> (f64, f64) {
    let world = &scene.world;
    let albedo = world.media[channel].total_r_d();
    let out = world.leaving(point, normal);
    let irradiance = lamp.illuminates(point, normal)[channel];
    let irradiance_error = 8.0 * U * lamp.magnitude(point, channel) + 8.0 * U * irradiance;
    let cosine = match lamp.arriving(point) {
        Some((towards, _)) => dot(normal, towards),
        None => effective_diffuse_cosine(),
    };
    let within = schlick_transmittance(world.eta, cosine);
    let mut reflected = albedo / PI * out * within;
    let mut error = albedo / PI * (TRANSMITTANCE * (out + within) + 16.0 * U * out * within);
    if let Some((towards, _)) = lamp.arriving(point)
        && world.gloss > 0.0
    {
        let eye = world.towards_eye(point);
        let half = normalize(add(towards, eye));
        let along = larger(dot(normal, half), 0.0);
        let lobe = (world.gloss + 8.0) / (8.0 * PI) * libm::pow(along, world.gloss);
        let reflectance = schlick_reflectance(world.eta, dot(eye, half));
        reflected += lobe * reflectance;
        let narrow = world.gloss * 8.0 * U / larger(along, 1e-6);
        error += lobe * (TRANSMITTANCE + reflectance * (narrow + 16.0 * U));
    }
    (reflected * irradiance, error * irradiance + reflected * irradiance_error)
}

/// Σ att · B + direct over the lights, and the background elsewhere. Two roundings a term and one an
/// addition.
#[test]
fn final_() {
    for scene in all() {
        let lights = scene.world.lamps.len();
        let mut worst = Worst::new(format!("final of {}", scene.name));
        let value = |pass: &str, light: usize, at: usize| f64::from(scene.buffer(pass).slice(light)[at]);
        for index in 0..scene.pixels() {
            for channel in 0..3 {
                let at = index * 3 + channel;
                let found = scene.buffer("final").as_f32()[at];
                let mut expected = 0.0;
                for light in 0..lights {
                    expected += value("attenuation", light, at) * value("radiosity", light, at);
                    expected += value("direct", light, at);
                }
                if scene.pixel(index).is_none() {
                    assert_eq!(expected, 0.0);
                    expected = scene.world.background[channel];
                }
                worst.check(found, expected, (2.0 + lights as f64) * U * expected, (index % 40, index / 40));
            }
        }
        worst.done(scene.pixels() * 3);
    }
}
