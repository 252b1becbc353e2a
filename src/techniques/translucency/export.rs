//! What another program needs to reproduce a frame: the conventions spelled out, the camera, lights, shadow
//! and cubemap views, the material, what each pass computes, and the matrices and coefficients as arrays.

use super::cubemap::{FACES, face_view};
use super::{Caster, Frame, Settings};
use crate::Error;
use crate::keys::Values;
use crate::pass::{Buffer, Data, Kept};
use crate::raster::{Axes, View};
use crate::sphere::irradiance::{C1, C2, C3, C4, C5};
use crate::techniques::Export;
use crate::world::Stage;
use crate::world::light::Light;
use crate::world::medium::Medium;
use glam::Vec3;
use serde_json::{Value as Json, json};
use std::f64::consts::PI;

/// The arrays and what each holds. Matrices are `clip_from_world`, row-major.
const ARRAYS: &[(&str, &str)] = &[
    ("camera", "[4, 4] clip_from_world, row-major"),
    ("shadow", "[casting lights, 4, 4] the same of the shadow maps"),
    ("cubemap", "[6, 4, 4] the same of the cubemap's faces"),
    ("sh", "[lights, 9, 3] the projection, RGB; of several accumulation points [lights, points, 9, 3]"),
    ("matrices", "[lights, 3, 4, 4] the matrices of radiosity; of several points [lights, points, 3, 4, 4]"),
    ("positions", "[vertices, 3] of the solid"),
    ("normals", "[vertices, 3] of the solid"),
    ("triangles", "[triangles, 3] of the solid, u32"),
];

pub(super) const EXPORT: Export = Export { arrays: ARRAYS, gather };

/// Gathers facts and arrays from a stage and all its passes. The facts are `conventions`, `image`, `camera`,
/// `lights`, `shadow`, `cubemap`, `points`, `bounds`, `material`, `formulas`; the arrays are in the order of
/// [`ARRAYS`].
///
/// # Errors
/// Those of [`Frame::new`].
///
/// # Panics
/// Where `kept` lacks `translucency.projection` or `translucency.matrices`.
fn gather(stage: &Stage, values: &Values, kept: &Kept) -> Result<(Json, Vec<Buffer>), Error> {
    let frame = Frame::new(stage.clone(), Settings::read(values))?;
    let faces = FACES.map(|axes| face_view(&frame, axes));
    let facts = json!({
        "conventions": conventions(&frame.stage.medium),
        "image": {
            "width": frame.view.width,
            "height": frame.view.height,
            "background": frame.stage.background.to_array(),
            "colour": "linear RGB, Rec. 709 primaries",
        },
        "camera": camera(&frame),
        "lights": (0..frame.stage.lights.len()).map(|light| self::light(&frame, light)).collect::<Vec<_>>(),
        "shadow": frame.casters.iter().map(shadow).collect::<Vec<_>>(),
        "cubemap": cubemap(&frame, &faces),
        "points": {
            "counts": frame.points.counts,
            "about": "accumulation points: the middles of so many equal parts of the cubemap's box along x, y and z, x \
                counting fastest",
        },
        "bounds": {
            "low": frame.bounds.low.to_array(),
            "high": frame.bounds.high.to_array(),
            "centre": frame.bounds.center().to_array(),
            "half_extents": frame.bounds.half_extents().to_array(),
            "of": "the vertices that triangles use; each half extent is at least 1/10,000 of the diagonal's half",
        },
        "material": material(&frame.stage.medium, frame.stage.gloss),
        "formulas": formulas(),
    });
    let pass = |name: &str| kept.get(name).unwrap_or_else(|| panic!("{name} was not run")).clone();
    let matrices = |views: &[&View]| views.iter().flat_map(|view| view.clip_from_world).flatten().collect();
    let shadows: Vec<_> = frame.casters.iter().map(|caster| &caster.shadow.view).collect();
    let vectors = |vectors: &[Vec3]| {
        let values = vectors.iter().flat_map(|vector| vector.to_array()).collect();
        Buffer::f32(&[vectors.len(), 3], values)
    };
    let triangles = Data::U32(frame.stage.solid.triangles.iter().flatten().copied().collect());
    let arrays = vec![
        Buffer::f32(&[4, 4], matrices(&[&frame.view])),
        Buffer::f32(&[shadows.len(), 4, 4], matrices(&shadows)),
        Buffer::f32(&[6, 4, 4], matrices(&faces.each_ref())),
        pass("translucency.projection"),
        pass("translucency.matrices"),
        vectors(&frame.stage.solid.positions),
        vectors(&frame.stage.solid.normals),
        Buffer { shape: vec![frame.stage.solid.triangles.len(), 3], data: triangles },
    ];
    Ok((facts, arrays))
}

/// The conventions by which everything is to be read.
fn conventions(medium: &Medium) -> Json {
    json!({
        "space": {
            "handedness": "right",
            "up": "y",
            "unit_in_metres": f64::from(medium.millimetres) / 1000.0,
            "triangles": "three vertices from 0, counter-clockwise seen from outside; both sides are drawn",
        },
        "matrices": {
            "layout": "row-major",
            "vectors": "column",
            "clip": "(x, y, z, w) = clip_from_world (p.x, p.y, p.z, 1)",
        },
        "depth": {
            "of": "z/w",
            "near": 1,
            "far": 0,
            "about": "reversed; 0 is infinitely far in a perspective view, the far plane in an orthographic one",
        },
        "pixels": {
            "origin": "upper left",
            "x": "right",
            "y": "down",
            "first_centre": [0.5, 0.5],
            "from_clip": "((x/w/2 + 1/2) width, (1/2 - y/w/2) height)",
            "coverage": "corners snapped to 1/256 pixel, half to even; top-left rule; nearest depth, ties to the lowest triangle",
        },
        "lat_long": {
            "about": "environment maps: column u width, row v height; theta = pi v from +y, phi = 2 pi u",
            "direction": "(sin theta cos phi, cos theta, sin theta sin phi)",
            "examples": [
                {"u": 0.0, "v": 0.5, "direction": [1, 0, 0]},
                {"u": 0.25, "v": 0.5, "direction": [0, 0, 1]},
                {"u": 0.5, "v": 0.5, "direction": [-1, 0, 0]},
                {"u": 0.5, "v": 0.0, "direction": [0, 1, 0]},
            ],
        },
        "spherical_harmonics": spherical_harmonics(),
    })
}

fn spherical_harmonics() -> Json {
    let factor = |numerator: f64, denominator: f64| (numerator / (denominator * PI)).sqrt();
    let functions = [
        (0, 0, "1", factor(1.0, 4.0)),
        (1, -1, "y", factor(3.0, 4.0)),
        (1, 0, "z", factor(3.0, 4.0)),
        (1, 1, "x", factor(3.0, 4.0)),
        (2, -2, "x y", factor(15.0, 4.0)),
        (2, -1, "y z", factor(15.0, 4.0)),
        (2, 0, "3 z z - 1", factor(5.0, 16.0)),
        (2, 1, "x z", factor(15.0, 4.0)),
        (2, 2, "x x - y y", factor(15.0, 16.0)),
    ];
    let function = |(l, m, polynomial, constant): &(i32, i32, &str, f64)| json!({"index": l * l + l + m, "l": l, "m": m, "constant": constant, "polynomial": polynomial});
    json!({
        "basis": "real, without the Condon-Shortley phase, +sin |m| phi for m < 0, orthonormal; \
            constant times polynomial in the world's own x, y, z of a unit vector",
        "polar_axis": "z",
        "order": "l l + l + m",
        "functions": functions.iter().map(function).collect::<Vec<_>>(),
        "irradiance": {
            "about": "of radiance L at the unit normal n: the sum of a[l] L[l, m] Y[l, m](n), which is [n, 1] M [n, 1]",
            "a": [PI, 2.0 * PI / 3.0, PI / 4.0],
            "c": [C1, C2, C3, C4, C5],
            "matrix": [
                "c1 L22, c1 L2-2, c1 L21, c2 L11",
                "c1 L2-2, -c1 L22, c1 L2-1, c2 L1-1",
                "c1 L21, c1 L2-1, c3 L20, c2 L10",
                "c2 L11, c2 L1-1, c2 L10, c4 L00 - c5 L20",
            ],
        },
    })
}

fn camera(frame: &Frame) -> Json {
    let (camera, view) = (&frame.stage.camera, &frame.view);
    let Axes { right, up, forward } = Axes::looking(camera.target - camera.position, camera.up);
    json!({
        "position": camera.position.to_array(),
        "target": camera.target.to_array(),
        "up": camera.up.to_array(),
        "vertical_fov_degrees": camera.fov,
        "tangents_of_half_angles": camera.tangents(view.width, view.height),
        "axes": {"right": right.to_array(), "up": up.to_array(), "forward": forward.to_array()},
        "near": view.linear(1.0),
        "clip_from_world": view.clip_from_world,
    })
}

fn light(frame: &Frame, light: usize) -> Json {
    let mut json = match &frame.stage.lights[light] {
        Light::Point { position, intensity } => json!({
            "kind": "point",
            "position": position.to_array(),
            "intensity": intensity.to_array(),
            "about": "irradiance of a surface that faces it: intensity / distance^2",
        }),
        Light::Directional { direction, irradiance } => json!({
            "kind": "directional",
            "direction": direction.to_array(),
            "irradiance": irradiance.to_array(),
            "about": "direction in which the light travels; irradiance of a surface that faces it",
        }),
        environment @ Light::Environment { .. } => json!({
            "kind": "environment",
            "radiance_sh": environment.nine(),
            "irradiance_matrices": frame.irradiance[light],
            "about": "nine coefficients of radiance, RGB; for each of R, G, B the matrix M of its irradiance",
        }),
    };
    json["caster"] = json!(frame.caster(light));
    json
}

fn shadow(Caster { light, shadow }: &Caster) -> Json {
    let view = &shadow.view;
    let distance = match shadow.eye {
        Some(eye) => json!({"measure": "radial", "eye": eye.to_array()}),
        None => json!({"measure": "plane", "plane": shadow.plane}),
    };
    json!({
        "light": light,
        "size": view.width,
        "distance": distance,
        "distance_about": "of a point p: |p - eye| (radial), plane . (p, 1) (plane); in the scene's unit",
        "ahead": shadow.plane,
        "half_extents": shadow.half,
        "middle": shadow.middle,
        "half_extents_about": "of the map, and the way of its middle from the axis along its sides (not 0 where it is \
            fitted to the solid); times ahead . (p, 1) where the distance is radial",
        "projection": if shadow.eye.is_some() { "perspective" } else { "orthographic" },
        "near": view.linear(1.0),
        "far": if shadow.eye.is_some() { Json::Null } else { json!(view.linear(0.0)) },
        "clip_from_world": view.clip_from_world,
    })
}

fn cubemap(frame: &Frame, views: &[View; 6]) -> Json {
    let names = ["+x", "-x", "+y", "-y", "+z", "-z"];
    let face = |index: usize| {
        let [right, up] = FACES[index];
        json!({
            "face": names[index],
            "right": right.to_array(),
            "up": up.to_array(),
            "outward": right.cross(up).to_array(),
            "clip_from_world": views[index].clip_from_world,
        })
    };
    json!({
        "size": frame.settings.cubemap,
        "about": "orthographic views from outside, each of which fills its face of the bounding box; faces are stacked \
            downward in this order",
        "direction": "of a texel, in the frame in which the box is the cube [-1, 1]^3: normalize(outward + s right + t up), \
            s = (2 column + 1)/size - 1, t = 1 - (2 row + 1)/size",
        "faces": (0..6).map(face).collect::<Vec<_>>(),
    })
}

fn material(medium: &Medium, gloss: f32) -> Json {
    let per_unit = |per_mm: [f32; 3]| per_mm.map(|value| f64::from(value) * f64::from(medium.millimetres));
    let dipoles = &medium.dipoles;
    json!({
        "scattering": {"per_millimetre": medium.scattering, "per_unit": per_unit(medium.scattering)},
        "absorption": {"per_millimetre": medium.absorption, "per_unit": per_unit(medium.absorption)},
        "eta": medium.eta,
        "reduced_albedo": dipoles.map(|dipole| dipole.albedo),
        "effective_extinction": dipoles.map(|dipole| dipole.extinction),
        "real_source_depth": dipoles.map(|dipole| dipole.real),
        "virtual_source_height": dipoles.map(|dipole| dipole.virtual_),
        "total_reflectance": dipoles.map(|dipole| dipole.reflectance()),
        "schlick_f0": 1.0 - medium.transmittance(1.0),
        "diffuse_cosine": Medium::diffuse_cosine(),
        "gloss": gloss,
        "about": "RGB; scattering is sigma_s', absorption sigma_a, effective_extinction sigma_tr per scene unit, the two \
            source distances z_r and z_v in the scene's unit",
    })
}

/// What each pass computes, in letters that a text editor shows: p a point, n its unit normal, v and l the
/// unit directions towards the camera and the light.
fn formulas() -> Json {
    json!({
        "reading": "corrected, evaluated at each pixel, with both cures, the second layer, one accumulation point and \
            all light; where the settings say otherwise, the heads of the source files of the passes and of points.rs do",
        "symbols": "p a point, n its unit normal, v and l the unit directions towards the camera and the light; \
            E(l) the irradiance of a surface that faces the light; F(c) = F0 + (1 - F0)(1 - c)^5 with c held to [0, 1], \
            T(c) = 1 - F(c); [n, 1] M [n, 1] a quadratic form; bilinear: of the four texels around where p falls on the \
            map, those outside it being those of its edge",
        "cubemap": "E(l) max(0, n.l) at the first surface of each texel, and max(0, n.l); of an environment \
            max(0, [n, 1] M [n, 1]), and diffuse_cosine; unshadowed; 0 without a surface",
        "transmit": "cubemap times T(cosine)",
        "projection": "sum over texels of transmit Y(direction) times the texel's solid angle on the cube [-1, 1]^3",
        "matrices": "the matrix of irradiance (conventions.spherical_harmonics) of the projection",
        "shadow": "distance of the first surface at each texel's centre, and its depth z/w; 0 without a surface",
        "peel": "distance of the nearest surface whose depth is strictly below that of shadow; 0 without one",
        "blur": "Gaussian of shadow's distance in both directions: offsets -floor(width/2) ... floor(width/2), standard \
            deviation width/4 texels; texels without a surface and those outside have no weight, the sum is divided by \
            the weights, and is 0 without any",
        "vbuffer": "the triangle that covers the pixel's centre and is nearest; 4294967295 without one",
        "gbuffer": "p and n, interpolated in perspective at the pixel's centre, n normalised; depth is w of clip_from_world p",
        "thickness": "d = max(0, distance(p) - blur), blur bilinear without the texels that are 0 (distance(p) if all \
            are); receives = bilinear share of the texels at which peel is 0 or at least distance(p) - slack; slack = \
            texel (1 + min(sqrt(1 - c^2)/max(|c|, 0.001), sqrt(size))), c = n.l, texel = 2 max(half_extents)/size, times \
            ahead.(p, 1) where the distance is radial",
        "radiosity": "r = t/eta - sqrt(1 - |t|^2/eta^2) n, t = -v + (v.n) n; q where the ray from p along r leaves the \
            bounding box; max(0, [u, 1] M [u, 1]), u = normalize((q - centre)/half_extents), M of matrices",
        "attenuation": "receives T(n.v)/pi W(d)/pi, W(d) = alpha'/2 (z_r exp(-sigma_tr s_r)/s_r + z_v exp(-sigma_tr \
            s_v)/s_v), s_r = sqrt(d^2 + z_r^2), s_v = sqrt(d^2 + z_v^2); of an environment d = |q - p|, receives = 1",
        "held": "1 where d is at most the least that attenuation is computed with: 0, or to the letter smallest_d",
        "direct": "lit E(l) max(0, n.l) (R_d T(n.v) T(n.l)/pi + (gloss + 8)/(8 pi) max(0, n.h)^gloss F(v.h)), h halfway \
            between v and l, no highlight where gloss is 0; lit = bilinear share of the texels at which shadow is 0 or \
            at least distance(p) - slack; of an environment R_d T(n.v)/pi T(diffuse_cosine) max(0, [n, 1] M [n, 1]); \
            R_d is total_reflectance",
        "final": "sum over lights of direct + attenuation radiosity; the background where there is no surface",
    })
}
