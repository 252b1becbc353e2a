//! What must hold whatever the equations: conservation, units, symmetry, linearity.

use std::f64::consts::PI;

use bitlight::pass::{Given, Kept, execute};
use bitlight::run;
use bitlight::scene::{Assets, Scene};
use bitlight::techniques::translucency::{Frame, PASSES, Settings, TECHNIQUE};
use bitlight::world::Stage;
use bitlight::world::light::Light;
use bitlight::world::mesh::Mesh;
use bitlight_reference::translucency::cube::texel_solid_angle;
use bitlight_reference::translucency::optics::schlick_hemispherical_reflectance;
use glam::Vec3;

use crate::world::{BEAM, EVEN, POINT, PROBE, Rendered, SOLIDS, head, render, scenes};
use crate::{U, Worst, larger};

fn of<'a>(kept: &'a Kept, pass: &str) -> &'a [f32] {
    kept.get(&format!("translucency.{pass}")).unwrap().as_f32()
}

/// In a constant environment of radiance L a solid receives πL everywhere. A box filled by its solid is
/// covered in every texel, under either reading, so c₀₀ = F̄ πL √(4π), the other eight vanish, and B = π F̄
/// πL everywhere. A sphere covers the inscribed disc of each face.
#[test]
fn a_constant_environment() {
    let radiance = [0.5, 0.75, 1.5];
    let letter = "translucency.reading=paper";
    for (number, disc, set) in
        [(2, false, &[][..]), (0, true, &[]), (2, false, &[letter]), (0, true, &[letter])]
    {
        let (name, solid, material) = SOLIDS[number];
        let scene = Rendered::new(name, &(head(solid, material) + EVEN), set);
        let entering = 1.0 - schlick_hemispherical_reflectance(scene.world.eta);
        let (size, mut covered) = (scene.world.cubemap, 0.0);
        let mut worst = Worst::new(format!("constant environment on {name}"));
        for (index, texel) in scene.buffer("cubemap").as_f32().chunks_exact(4).enumerate() {
            let [s, t] = [index % size, index / size % size].map(|i| (2 * i + 1) as f64 / size as f64 - 1.0);
            let inside = !disc || s * s + t * t < 1.0;
            for channel in 0..3 {
                let expected = if inside { PI * radiance[channel] } else { 0.0 };
                worst.check(texel[channel], expected, 8.0 * U * PI * radiance[channel], (s, t, channel));
            }
            if inside {
                covered +=
                    texel_solid_angle(size as u32, (index % size) as u32, (index / size % size) as u32);
            }
        }
        assert_eq!(disc, covered < 4.0 * PI - 1e-9);
        for channel in 0..3 {
            let entered = entering * PI * radiance[channel];
            let c00 = entered * covered / (4.0 * PI).sqrt();
            for i in 0..9 {
                let found = scene.buffer("projection").as_f32()[i * 3 + channel];
                // A disc on each face has the symmetry of the cube, which no other of the nine has.
                let expected = if i == 0 { c00 } else { 0.0 };
                worst.check(found, expected, 16.0 * U * c00, ("coefficient", i, channel));
            }
            for index in (0..scene.pixels()).filter(|index| scene.pixel(*index).is_some()) {
                let found = scene.buffer("radiosity").as_f32()[index * 3 + channel];
                let expected = PI * entered * covered / (4.0 * PI);
                worst.check(found, expected, 64.0 * U * expected, ("radiosity", index, channel));
            }
        }
        worst.done(1000);
    }
}

/// At no thickness the surface sends R_d/π back through the transmittance to the eye, less π of B (T10).
#[test]
fn attenuation_at_the_lit_surface() {
    let mut worst = Worst::new("attenuation at no thickness");
    for scene in scenes() {
        for (number, (light, _)) in scene.world.casters.iter().enumerate() {
            for index in 0..scene.pixels() {
                let Some((point, normal)) = scene.pixel(index) else { continue };
                let texel = &scene.buffer("thickness").slice(number)[index * 2..][..2];
                if texel != [0.0, 1.0] {
                    continue;
                }
                for channel in 0..3 {
                    let albedo = scene.world.media[channel].total_r_d() / (PI * PI);
                    let expected = scene.world.leaving(point, normal) * albedo;
                    let found = scene.buffer("attenuation").slice(*light)[index * 3 + channel];
                    worst.check(found, expected, 48.0 * U * albedo, (scene.name, light, index, channel));
                }
            }
        }
    }
    worst.done(200);
}

/// Pixels that agree within `tolerance` of `magnitude`, of all.
fn agreeing(a: &[f32], b: &[f32], tolerance: f64) -> (usize, f64) {
    let close = |(a, b): &(&f32, &f32)| {
        (f64::from(**a) - f64::from(**b)).abs() <= tolerance * larger(f64::from(a.abs()), 0.01)
    };
    let far = a.iter().zip(b).filter(|pair| !close(pair));
    let worst = far.clone().map(|(a, b)| (f64::from(*a) - f64::from(*b)).abs()).fold(0.0, larger);
    (far.count(), worst)
}

/// A scene in millimetres, and the same in metres.
fn in_two_units(solid: &str, material: &str) -> (String, String) {
    let millimetres = [&head(solid, material), PROBE, POINT, EVEN, BEAM].concat();
    let mut metres = millimetres.replace("unit = \"mm\"", "unit = \"m\"");
    for (from, to) in [
        (
            "position = [6, 8, 46], target = [1, -2, 0.5]",
            "position = [0.006, 0.008, 0.046], target = [0.001, -0.002, 0.0005]",
        ),
        ("center = [1.5, -2.25, 0.75]", "center = [0.0015, -0.00225, 0.00075]"),
        ("position = [-22, 16, -30]", "position = [-0.022, 0.016, -0.03]"),
        ("intensity = [5200, 4600, 3800]", "intensity = [0.0052, 0.0046, 0.0038]"),
    ] {
        assert!(metres.contains(from), "{from}");
        metres = metres.replace(from, to);
    }
    let size = solid.split("size = ").nth(1).unwrap().split(',').next().unwrap().trim();
    let small = format!("size = {}", size.parse::<f64>().unwrap() / 1000.0);
    metres = metres.replace(&format!("size = {size}"), &small);
    (millimetres, metres)
}

/// T11 to the letter: in metres every value of the attenuation is 10⁶ times that in millimetres, that of held
/// pixels too. It goes with the cube of a thickness, a difference of distances: 10⁻³ of a value, for one in a
/// hundred more.
#[test]
fn to_the_letter_metres_are_a_million_times_as_bright() {
    for (name, solid, material) in [SOLIDS[0], SOLIDS[1]] {
        let (millimetres, metres) = in_two_units(solid, material);
        let letter = ["translucency.reading=paper"];
        let (a, b) = (render(&millimetres, &letter).1, render(&metres, &letter).1);
        let scaled: Vec<f32> = of(&a, "attenuation").iter().map(|value| value * 1e6).collect();
        let (far, worst) = agreeing(&scaled, of(&b, "attenuation"), 1e-3);
        eprintln!("{name}: {far} of {} are not 10⁶ times as bright, by up to {worst:.1e}", scaled.len());
        assert!(far * 100 <= scaled.len(), "{name}: {far} of {}, by up to {worst:e}", scaled.len());
        assert!(scaled.iter().filter(|value| **value > 1.0).count() > 500, "{name} is dark");
    }
}

/// T11: the same scene in metres, its intensities divided by 1000², has the same picture. Lengths are rounded
/// anew, so a vertex may snap to the next 1/256 pixel: one value in a hundred may differ by more than 10⁻⁵.
#[test]
fn metres_are_millimetres() {
    for (name, solid, material) in SOLIDS {
        let solid = if solid.contains("size") { solid.to_owned() } else { format!("{solid}, size = 19") };
        let (millimetres, metres) = in_two_units(&solid, material);
        let (a, b) = (render(&millimetres, &[]).1, render(&metres, &[]).1);
        for pass in ["projection", "radiosity", "attenuation", "direct", "final"] {
            let (a, b) = (of(&a, pass), of(&b, pass));
            let (far, worst) = agreeing(a, b, 1e-5);
            eprintln!("{name}: {pass} in metres: {far} of {} differ, by up to {worst:.1e}", a.len());
            assert!(far * 100 <= a.len(), "{name}: {pass}: {far} of {} differ, by up to {worst:e}", a.len());
        }
    }
}

/// The world reflected in x: the picture is reflected too. Centres on edges go another way, and the snapped
/// vertices are rounded anew: one value in a hundred may differ by more than rounding.
#[test]
fn a_mirrored_scene_has_a_mirrored_picture() {
    for (name, solid, material) in SOLIDS {
        let text = [&head(solid, material), PROBE, POINT, EVEN, BEAM].concat();
        let scene = Scene::parse(&text, "mirror.toml".as_ref(), &[]).unwrap();
        let stage = run::Loaded::new(&scene, &Assets::default(), &[]).unwrap().stage(&scene).unwrap();
        let frame = Frame::new(stage, Settings::read(&scene.values)).unwrap();
        let flip = |v: Vec3| Vec3::new(-v.x, v.y, v.z);
        let lights = frame.stage.lights.iter().map(|light| match light {
            Light::Point { position, intensity } => {
                Light::Point { position: flip(*position), intensity: *intensity }
            }
            Light::Directional { direction, irradiance } => {
                Light::Directional { direction: flip(*direction), irradiance: *irradiance }
            }
            Light::Environment { environment, coefficients } => {
                let (environment, mut coefficients) = (environment.clone(), coefficients.clone());
                // Odd in x: x, xy and xz.
                for i in [3, 4, 7] {
                    coefficients[i] = coefficients[i].map(|value| -value);
                }
                Light::Environment { environment, coefficients }
            }
        });
        let solid = &frame.stage.solid;
        let mesh = Mesh::new(
            solid.positions.iter().map(|p| flip(*p)).collect(),
            Some(solid.normals.iter().map(|n| flip(*n)).collect()),
            solid.triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect(),
        )
        .unwrap();
        let mut camera = frame.stage.camera;
        (camera.position, camera.target, camera.up) =
            (flip(camera.position), flip(camera.target), flip(camera.up));
        let mirrored = Stage { solid: mesh.into(), lights: lights.collect(), camera, ..frame.stage.clone() };
        let mirrored = Frame::new(mirrored, frame.settings).unwrap();
        let picture = |frame: &Frame| {
            let mut kept = Kept::default();
            execute(&PASSES, frame, &["translucency.final"], Given::new(), &mut kept).unwrap();
            kept
        };
        let (first, second) = (picture(&frame), picture(&mirrored));
        let (a, b) = (&first, &second);
        let turned: Vec<f32> = (0..of(b, "final").len())
            .map(|at| {
                let (row, column, channel) = (at / 120, at / 3 % 40, at % 3);
                of(b, "final")[(row * 40 + 39 - column) * 3 + channel]
            })
            .collect();
        let (far, worst) = agreeing(of(a, "final"), &turned, 1e-4);
        eprintln!("{name} mirrored: {far} of {} differ, by up to {worst:.1e}", turned.len());
        assert!(far * 100 <= turned.len(), "{name}: {far} of {} differ, by up to {worst:e}", turned.len());
        let mut coefficients = Worst::new(format!("mirrored coefficients of {name}"));
        for (i, (a, b)) in of(a, "projection").iter().zip(of(b, "projection")).enumerate() {
            let sign = if [3, 4, 7].contains(&(i / 3 % 9)) { -1.0 } else { 1.0 };
            // Relative to that light's and channel's first: a texel at an edge is one of 864.
            let whole = f64::from(of(&first, "projection")[i / 27 * 27 + i % 3]);
            coefficients.check(*b, sign * f64::from(*a), 1e-5 * whole, i);
        }
        coefficients.done(108);
    }
}

/// Light is linear: the picture of four lights is the sum of the four pictures, up to the rounding of the
/// sum.
#[test]
fn lights_add() {
    for (name, solid, material) in SOLIDS {
        let head = head(solid, material).replace("[0.125, 0.25, 0.5]", "[0, 0, 0]");
        let together = render(&[&head, PROBE, POINT, EVEN, BEAM].concat(), &[]).1;
        let parts = [PROBE, POINT, EVEN, BEAM].map(|light| render(&(head.clone() + light), &[]).1);
        let mut worst = Worst::new(format!("lights on {name}"));
        for (at, found) in of(&together, "final").iter().enumerate() {
            let expected = parts.iter().map(|part| f64::from(of(part, "final")[at])).sum::<f64>();
            worst.check(*found, expected, 8.0 * U * expected, at);
        }
        worst.done(3000);
        // And twice the light is twice the picture, to the bit.
        let (bright, once) =
            (POINT.replace("[5200, 4600, 3800]", "[10400, 9200, 7600]"), of(&parts[1], "final"));
        let twice = render(&(head + &bright), &[]).1;
        assert!(of(&twice, "final").iter().zip(once).all(|(twice, once)| *twice == 2.0 * once), "{name}");
    }
}

/// The picture of the direct light and that of the scattered light are the sums of their passes, and add up
/// to the picture of both.
#[test]
fn direct_and_scattered_light_add() {
    let (name, solid, material) = SOLIDS[1];
    let text =
        [&head(solid, material).replace("[0.125, 0.25, 0.5]", "[0, 0, 0]"), PROBE, POINT, BEAM].concat();
    let [all, direct, scattered] =
        ["all", "direct", "scattered"].map(|show| render(&text, &[&format!("translucency.show={show}")]).1);
    let mut worst = Worst::new(format!("shown of {name}"));
    let length = of(&all, "final").len();
    for at in 0..length {
        let sum =
            |pass: &str| (0..3).map(|light| f64::from(of(&all, pass)[light * length + at])).sum::<f64>();
        let [whole, one, other] = [&all, &direct, &scattered].map(|kept| f64::from(of(kept, "final")[at]));
        worst.check(of(&direct, "final")[at], sum("direct"), 4.0 * U * one, at);
        worst.check(of(&all, "final")[at], one + other, 8.0 * U * whole, at);
    }
    worst.done(3000);
    assert!(of(&scattered, "final").iter().filter(|value| **value > 0.0).count() > 300);
}

/// Scenes without a casting light and with three: buffers have as many slices as there are casters, and each
/// light's slices are those that it has alone.
#[test]
fn any_number_of_casters() {
    let (_, solid, material) = SOLIDS[1];
    let head = head(solid, material);
    let none = render(&[&head, PROBE].concat(), &[]).1;
    for pass in ["shadow", "peel", "blur", "thickness"] {
        let buffer = none.get(&format!("translucency.{pass}")).unwrap();
        assert_eq!((buffer.shape[0], buffer.data.len()), (0, 0), "{pass}");
    }
    let background = [0.125, 0.25, 0.5];
    let lit = of(&none, "final").chunks_exact(3).filter(|pixel| *pixel != background).count();
    assert!(lit > 200, "{lit} pixels are not background");

    let second = POINT.replace("[-22, 16, -30]", "[30, 20, 20]");
    let many = render(&[&head, POINT, PROBE, BEAM, &second].concat(), &[]).1;
    for (light, caster, text) in [(0, 0, POINT), (2, 1, BEAM), (3, 2, &second)] {
        let alone = render(&[&head, text].concat(), &[]).1;
        let passes = TECHNIQUE.passes.iter();
        for info in passes.filter(|info| info.axes[0] == bitlight::pass::Axis::Light) {
            let slice = many.get(info.name).unwrap().slice(light);
            assert!(slice == alone.get(info.name).unwrap().slice(0), "{} of light {light}", info.name);
        }
        for pass in ["shadow", "peel", "blur", "thickness"] {
            let (many, alone) =
                [&many, &alone].map(|kept| kept.get(&format!("translucency.{pass}")).unwrap()).into();
            assert!(many.slice(caster) == alone.slice(0), "{pass} of light {light}");
        }
    }
}

/// A light without red gives green and blue what it gives them with red, in every pass.
#[test]
fn colours_do_not_mix() {
    let (_, solid, material) = SOLIDS[1];
    let lit = |intensity: [f32; 3]| {
        let light =
            format!("[[light]]\nkind = \"point\"\nposition = [-22, 16, -30]\nintensity = {intensity:?}\n");
        render(&(head(solid, material) + &light), &[]).1
    };
    let (white, cyan) = (lit([900.0; 3]), lit([0.0, 900.0, 900.0]));
    let mut positive = 0;
    for pass in ["cubemap", "transmit", "projection", "radiosity", "direct", "final"] {
        let stride = if pass == "cubemap" { 4 } else { 3 };
        let values =
            |kept, channel: usize| of(kept, pass).iter().skip(channel).step_by(stride).copied().collect();
        for channel in [1, 2] {
            let (white, cyan): (Vec<f32>, Vec<f32>) = (values(&white, channel), values(&cyan, channel));
            assert!(white == cyan, "{pass} channel {channel}");
            positive += white.iter().filter(|value| **value > 0.0).count();
        }
    }
    assert!(positive > 1000, "{positive}");
}
