//! Light, shading and the picture.

use super::{PI, Rendered, assert_near};
use bitlight::raster::NONE;
use bitlight_reference::vector::{Vec3, add, cross, dot, normalize, scale, sub};
use bitlight_reference::{geometry, sh, tables};

#[test]
fn light_is_a_probe_without_higher_bands_and_a_delta() {
    let rendered = Rendered::new(&["prt.bands=5"]);
    let probe = tables::probe("uffizi").unwrap();
    let mut expected = vec![[0.0; 3]; 25];
    for (index, rgb) in expected.iter_mut().take(9).enumerate() {
        *rgb = [0, 1, 2].map(|channel| probe.channel(channel)[index]);
    }
    assert_near(rendered.row("light", 0), expected.as_flattened(), 1e-6, "the probe");
    let towards = normalize([1.0, 2.0, -0.5]);
    let delta: Vec<_> = sh::eval(5, towards).iter().flat_map(|y| [3.0, 2.0, 1.0].map(|e| e * y)).collect();
    assert_near(rendered.row("light", 1), &delta, 1e-6, "the direction");
}

/// The coefficients of all lights together, by colour.
fn light(rendered: &Rendered) -> [Vec<f64>; 3] {
    [0, 1, 2].map(|channel| {
        (0..9)
            .map(|i| (0..2).map(|light| f64::from(rendered.row("light", light)[i * 3 + channel])).sum())
            .collect()
    })
}

#[test]
fn a_diffuse_vertex_sends_out_transfer_times_light_and_what_was_scattered_apart() {
    let rendered = Rendered::new(&["prt.subsurface=dipole"]);
    let light = light(&rendered);
    for (pass, first) in [("vectors", 0), ("scattered", 3)] {
        let of = |vertex: usize, channel: usize| -> f64 {
            let row = rendered.row(pass, vertex);
            (0..9).map(|i| f64::from(row[i * 3 + channel]) * light[channel][i]).sum()
        };
        let count = rendered.mesh.positions.len();
        let expected: Vec<_> = (0..count).flat_map(|v| [0, 1, 2].map(|channel| of(v, channel))).collect();
        let found: Vec<_> =
            (0..count).flat_map(|v| rendered.row("shading", v)[first..first + 3].to_vec()).collect();
        assert_near(&found, &expected, 1e-6, pass);
    }
}

/// Σ over the sphere of what M L makes of light, times the BRDF towards the eye: no exit table, no matrix of
/// the BRDF.
#[test]
fn a_glossy_vertex_sends_out_what_arrives_times_the_brdf() {
    glossy(&Rendered::new(&["surface.highlight=phong"]), "matrices", 1);
    // With bounces each colour has a matrix of its own.
    glossy(&Rendered::new(&["surface.highlight=phong", "prt.bounces=1"]), "bounced", 3);
}

fn glossy(rendered: &Rendered, pass: &str, channels: usize) {
    let light = light(rendered);
    let rule = super::transfer::hemisphere();
    let eye = [1.0, 9.0, 26.0];
    let (mut found, mut expected) = (Vec::new(), Vec::new());
    for vertex in (0..rendered.mesh.positions.len()).step_by(5) {
        let axes = bitlight::bake::frame(rendered.mesh.normals[vertex]);
        let towards = normalize(sub(eye, rendered.position(vertex)));
        let exit = axes.map(|axis| dot(axis, towards));
        if exit[2] < 0.02 {
            continue; // the last exit of the table stands for these
        }
        let matrix = rendered.row(pass, vertex);
        for channel in 0..3 {
            let arriving: Vec<f64> = (0..9)
                .map(|i| {
                    (0..9)
                        .map(|j| {
                            f64::from(matrix[(i * 9 + j) * channels + channel % channels]) * light[channel][j]
                        })
                        .sum()
                })
                .collect();
            let (albedo, specular) = ([0.8, 0.5, 0.25][channel], [0.5, 0.25, 0.75][channel]);
            let radiance = rule.iter().map(|(direction, weight)| {
                let mirrored = [-direction[0], -direction[1], direction[2]];
                let lobe = dot(exit, mirrored).max(0.0).powi(7);
                let value = albedo / PI + specular * 9.0 / (2.0 * PI) * lobe;
                weight * direction[2] * value * sh::reconstruct(&arriving, *direction)
            });
            expected.push(radiance.sum());
            found.push(rendered.row("shading", vertex)[channel]);
        }
    }
    assert!(found.len() > 50, "{}", found.len());
    assert_near(&found, &expected, 5e-4, "shading"); // the table of exits is interpolated
}

/// Each pixel's ray against all triangles in `f64`.
#[test]
fn the_picture_is_interpolated_where_a_ray_meets_the_solid() {
    let rendered = Rendered::new(&["prt.subsurface=dipole"]);
    let triangles = rendered.triangles();
    let eye = [1.0, 9.0, 26.0];
    let forward = normalize(sub([1.0, 0.5, 0.0], eye));
    let right = normalize(cross(forward, [0.1, 1.0, 0.0]));
    let up = cross(right, forward);
    let tangent = (15.0_f64).to_radians().tan();
    let r0 = ((1.3_f64 - 1.0) / 2.3).powi(2);
    let (seen, picture) = (rendered.buffer("vbuffer").as_u32(), rendered.buffer("final").as_f32());
    let [width, height] = rendered.scene.size;
    let (mut found, mut expected) = (Vec::new(), Vec::new());
    for pixel in 0..width * height {
        let rgb = &picture[pixel * 3..][..3];
        if seen[pixel] == NONE {
            assert_eq!(rgb, [0.25, 0.5, 0.125]);
            continue;
        }
        let x = (2.0 * ((pixel % width) as f64 + 0.5) / width as f64 - 1.0) * tangent * width as f64
            / height as f64;
        let y = (1.0 - 2.0 * ((pixel / width) as f64 + 0.5) / height as f64) * tangent;
        let ray = add(forward, add(scale(x, right), scale(y, up)));
        // Snapped corners may cover a pixel whose centre just misses: near an edge weights leave 0 to 1 a
        // little.
        let triangle = &triangles[seen[pixel] as usize];
        let normal = geometry::face_normal(triangle);
        let t = dot(normal, sub(triangle[0], eye)) / dot(normal, ray);
        let point = add(eye, scale(t, ray));
        let [a, b, c] = *triangle;
        let whole = dot(normal, cross(sub(b, a), sub(c, a)));
        let v = dot(normal, cross(sub(c, b), sub(point, b))) / whole;
        let w = dot(normal, cross(sub(a, c), sub(point, c))) / whole;
        let weights = [v, w, 1.0 - v - w];
        let corners = rendered.mesh.triangles[seen[pixel] as usize].map(|corner| corner as usize);
        let blend = |of: &dyn Fn(usize) -> f64| -> f64 { (0..3).map(|i| weights[i] * of(corners[i])).sum() };
        let normal: Vec3 = normalize([0, 1, 2].map(|axis| blend(&|corner| rendered.normal(corner)[axis])));
        let cosine = dot(normal, normalize(sub(eye, point))).clamp(0.0, 1.0);
        let through = 1.0 - r0 - (1.0 - r0) * (1.0 - cosine).powi(5);
        for channel in 0..3 {
            let part =
                |first: usize| blend(&|corner| f64::from(rendered.row("shading", corner)[first + channel]));
            expected.push((part(0) + through * part(3)).max(0.0));
            found.push(rgb[channel]);
        }
    }
    assert!(found.len() > 150, "{}", found.len());
    assert_near(&found, &expected, 2e-4, "the picture");
}

#[test]
fn inner_sides_are_black() {
    let sphere = ["solid.shape=sphere", "bend.angle=0", "camera.up=[0,1,0]"];
    let from = |camera: &'static str| Rendered::new(&[&sphere[..], &[camera]].concat());
    let inside = from("camera.position=[1,2,0]");
    assert!(inside.buffer("vbuffer").as_u32().iter().all(|triangle| *triangle != NONE));
    assert!(inside.buffer("final").as_f32().iter().all(|value| *value == 0.0));
    let outside = from("camera.position=[1,0.5,30]");
    let (seen, picture) = (outside.buffer("vbuffer").as_u32(), outside.buffer("final").as_f32());
    let pixels: Vec<_> =
        seen.iter().zip(picture.as_chunks::<3>().0).filter(|(seen, _)| **seen != NONE).collect();
    let lit = pixels.iter().filter(|(_, rgb)| **rgb != [0.0; 3]).count();
    assert!(pixels.len() > 100 && lit > pixels.len() * 9 / 10, "{lit} of {}", pixels.len());
}

#[test]
fn a_white_convex_solid_in_an_even_environment_is_as_bright_as_that() {
    let even =
        super::SCENE.replace("probe = \"uffizi\"", "radiance = [2, 3, 4]").replace("[3, 2, 1]", "[0, 0, 0]");
    for highlight in ["none", "phong"] {
        let set =
            ["solid.shape=sphere", "bend.angle=0", "surface.albedo=[1,1,1]", "surface.specular=[0,0,0]"];
        let mut set: Vec<_> = set.map(str::to_owned).to_vec();
        set.extend([
            format!("surface.highlight={highlight}"),
            "prt.method=control".into(),
            "prt.bands=5".into(),
        ]);
        let scene = bitlight::scene::Scene::parse(&even, "a.toml".as_ref(), &set).unwrap();
        let mut kept = bitlight::pass::Kept::default();
        bitlight::run::render(&scene, &Default::default(), &["prt.shading"], &mut kept).unwrap();
        for vertex in kept.get("prt.shading").unwrap().as_f32().chunks_exact(6) {
            for (found, exact) in vertex.iter().zip([2.0, 3.0, 4.0]) {
                // Through a matrix, five bands of the clamped cosine are not all of it.
                assert!((found - exact).abs() < 0.01 * exact, "{highlight}: {vertex:?}");
            }
        }
    }
}
