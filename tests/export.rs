//! `bitlight export` suffices: a reader of its files alone, in plain `f64` and with the papers' equations,
//! comes to the passes that `bitlight render` recorded. What the files say of conventions is read, not
//! assumed: a wrong word is red.
#![cfg(feature = "cli")]

use bitlight::pass::Data;
use bitlight::store::file;
use bitlight_reference::geometry::{Triangle, interpolate, interpolate_normal, nearest_hit};
use bitlight_reference::translucency::cube::{Aabb, rectangle_solid_angle};
use bitlight_reference::translucency::dipole::Medium;
use bitlight_reference::translucency::optics;
use bitlight_reference::vector::{Vec3, add, cross, dot, length, normalize, scale, sub};
use bitlight_reference::{sh, translucency};
use serde_json::Value as Json;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::path::Path;
use std::process::{Command, Output};
use std::sync::LazyLock;

/// Three lights of three kinds; a solid beside the origin, in centimetres; an image that is no square.
const SCENE: &str = r#"
technique = "translucency"
unit = "cm"
image = { width = 40, height = 28 }
camera = { position = [1.6, 4.1, 3.2], target = [0.3, 0.1, -0.2], fov = 38 }
solid = { shape = "torus-knot", resolution = 8, size = 2.4, turn = 20, center = [0.2, 0.1, -0.3] }
material = { name = "Skin1", gloss = 20 }
translucency = { cubemap = 12, shadow = 48, blur = 4 }
light = [
    { kind = "point", position = [-2.4, -3, -2.6], intensity = [60, 52, 42] },
    { kind = "directional", direction = [-0.3, -1, 0.4], irradiance = [3, 2, 1] },
    { kind = "environment", probe = "grace", scale = 0.5 },
]
"#;

fn bitlight(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bitlight"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).env_remove("BITLIGHT_ASSETS").args(arguments);
    command.output().unwrap()
}

/// A real array of any rank.
struct Array {
    shape: Vec<usize>,
    values: Vec<f64>,
}

/// The bytes of an `.npy` file behind its header, its type and its shape.
fn npy(path: &Path) -> (Vec<u8>, String, Vec<usize>) {
    let bytes = std::fs::read(path).unwrap();
    assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00", "{}", path.display());
    let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let header = std::str::from_utf8(&bytes[10..10 + length]).unwrap().to_owned();
    assert!(header.contains("'fortran_order': False"));
    let shape = header.split_once("'shape': (").unwrap().1.split_once(')').unwrap().0;
    let shape = shape.split(',').filter_map(|length| length.trim().parse().ok()).collect();
    (bytes[10 + length..].to_vec(), header, shape)
}

fn words(bytes: &[u8]) -> Vec<u32> {
    bytes.chunks_exact(4).map(|word| u32::from_le_bytes(word.try_into().unwrap())).collect()
}

/// A view as a reader of the export has it.
struct View {
    /// Rows of the matrix whose product with a column is clip space.
    rows: [[f64; 4]; 4],
    size: [usize; 2],
}

/// Everything that the exported files hold, and the passes that were recorded.
struct Frame {
    json: Json,
    arrays: BTreeMap<&'static str, Array>,
    corners: Vec<Triangle>,
    normals: Vec<[Vec3; 3]>,
    obj: String,
    glb: Vec<u8>,
    passes: BTreeMap<String, BTreeMap<String, Vec<f64>>>,
    report: Json,
    command: String,
}

static FRAME: LazyLock<Frame> = LazyLock::new(|| {
    let base = tempfile::tempdir().unwrap();
    let scene = base.path().join("three lights.toml");
    std::fs::write(&scene, SCENE).unwrap();
    let out = base.path().join("out");
    let arguments =
        ["export", scene.to_str().unwrap(), "-o", out.to_str().unwrap(), "--set", "image.width=44"];
    let output = bitlight(&arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let file = |ending: &str| out.join(format!("three lights.{ending}"));
    let text = |ending: &str| std::fs::read_to_string(file(ending)).unwrap();
    for line in
        String::from_utf8(output.stdout).unwrap().lines().filter(|line| !line.starts_with("the passes"))
    {
        assert!(Path::new(line).is_file(), "{line} was announced");
    }
    let json: Json = serde_json::from_str(&text("export.json")).unwrap();
    for name in json["files"].as_object().unwrap().keys() {
        assert!(out.join(name).is_file(), "{name} is listed");
    }

    // The command that the export names, run by a shell, makes the passes.
    let command = json["command_of_the_passes"].as_str().unwrap().to_owned();
    let program = command.replacen("bitlight", env!("CARGO_BIN_EXE_bitlight"), 1);
    assert!(Command::new("sh").args(["-c", &program]).output().unwrap().status.success(), "{command}");
    let real = |data: &Data| match data {
        Data::F32(values) => values.iter().map(|value| f64::from(*value)).collect(),
        Data::U32(values) => values.iter().map(|value| f64::from(*value)).collect(),
    };
    let layers = file::read_exr(&file("exr")).unwrap().into_iter();
    let passes = layers
        .map(|layer| {
            let channels =
                layer.channels.iter().map(|channel| (channel.name.clone(), real(&channel.data))).collect();
            (layer.name.replacen("translucency.", "", 1), channels)
        })
        .collect();

    let names = ["camera", "shadow", "cubemap", "sh", "matrices", "positions", "normals"];
    let arrays: BTreeMap<_, _> = names
        .into_iter()
        .map(|name| {
            let (bytes, header, shape) = npy(&file(&format!("{name}.npy")));
            assert!(header.contains("'<f4'"));
            let values = words(&bytes).into_iter().map(|bits| f64::from(f32::from_bits(bits))).collect();
            (name, Array { shape, values })
        })
        .collect();
    let (bytes, header, shape) = npy(&file("triangles.npy"));
    assert!(header.contains("'<u4'") && shape[1] == 3);
    let triangles: Vec<[usize; 3]> = words(&bytes)
        .chunks_exact(3)
        .map(|triangle| [0, 1, 2].map(|corner| triangle[corner] as usize))
        .collect();
    let vector =
        |name: &str, index: usize| -> Vec3 { arrays[name].values[3 * index..][..3].try_into().unwrap() };
    let gather = |name: &str| triangles.iter().map(|t| t.map(|corner| vector(name, corner))).collect();
    Frame {
        corners: gather("positions"),
        normals: gather("normals"),
        obj: text("obj"),
        glb: std::fs::read(file("glb")).unwrap(),
        report: serde_json::from_str(&text("json")).unwrap(),
        json,
        arrays,
        passes,
        command,
    }
});

impl Frame {
    fn number(&self, pointer: &str) -> f64 {
        number(self.json.pointer(pointer).unwrap_or_else(|| panic!("there is no {pointer}")))
    }

    fn vector(&self, pointer: &str) -> Vec3 {
        vector(self.json.pointer(pointer).unwrap_or_else(|| panic!("there is no {pointer}")))
    }

    fn word(&self, pointer: &str) -> &str {
        self.json.pointer(pointer).and_then(Json::as_str).unwrap_or_else(|| panic!("there is no {pointer}"))
    }

    /// A channel of a recorded pass.
    fn pass(&self, layer: &str, channel: &str) -> &[f64] {
        &self.passes[layer][channel]
    }

    fn rgb(&self, layer: &str, index: usize) -> Vec3 {
        ["R", "G", "B"].map(|channel| self.pass(layer, channel)[index])
    }

    /// The `index`-th matrix of an array, by what the export says of layout and vectors.
    fn view(&self, name: &str, index: usize, size: [usize; 2]) -> View {
        let values = &self.arrays[name].values[16 * index..][..16];
        let by_rows = self.word("/conventions/matrices/layout") == "row-major";
        let columns = self.word("/conventions/matrices/vectors") == "column";
        let at = |row: usize, column: usize| {
            if by_rows == columns { values[4 * row + column] } else { values[4 * column + row] }
        };
        View { rows: [0, 1, 2, 3].map(|row| [0, 1, 2, 3].map(|column| at(row, column))), size }
    }

    /// x/w and y/w of the centre of a pixel, by what the export says of pixels.
    fn ndc(&self, [width, height]: [usize; 2], [column, row]: [usize; 2]) -> [f64; 2] {
        let centre = self.json.pointer("/conventions/pixels/first_centre").unwrap();
        let across = (column as f64 + number(&centre[0])) / width as f64 * 2.0 - 1.0;
        let along = (row as f64 + number(&centre[1])) / height as f64 * 2.0 - 1.0;
        let sign = |pointer: &str, forward: &str| if self.word(pointer) == forward { 1.0 } else { -1.0 };
        [across * sign("/conventions/pixels/x", "right"), along * sign("/conventions/pixels/y", "up")]
    }

    /// The first surface in a pixel: triangle, point, unit normal and z/w.
    fn seen(&self, view: &View, pixel: [usize; 2]) -> Option<(usize, Vec3, Vec3, f64)> {
        let [u, v] = self.ndc(view.size, pixel);
        let [x, y, z, w] = view.rows;
        let less = |a: [f64; 4], k: f64| [0, 1, 2, 3].map(|i| a[i] - k * w[i]);
        let normal = |plane: [f64; 4]| [plane[0], plane[1], plane[2]];
        // The ray is where two planes meet, and begins in the near plane.
        let (across, along) = (less(x, u), less(y, v));
        let start = less(z, self.number("/conventions/depth/near"));
        let origin = meet([across, along, start]);
        let mut direction = normalize(cross(normal(across), normal(along)));
        // Into the image: away from the near plane, towards the far one.
        let farther = |p: Vec3| {
            let depth = apply(z, p) / apply(w, p);
            (depth - self.number("/conventions/depth/near")).abs() > 1e-9
                && (depth - self.number("/conventions/depth/far")).abs()
                    < (self.number("/conventions/depth/near") - self.number("/conventions/depth/far")).abs()
        };
        if !farther(add(origin, scale(1e-3, direction))) {
            direction = scale(-1.0, direction);
        }
        let hit = nearest_hit(origin, direction, &self.corners, 0.0, f64::INFINITY)?;
        let point = interpolate(&self.corners[hit.triangle], hit.u, hit.v);
        let normal = interpolate_normal(&self.normals[hit.triangle], hit.u, hit.v);
        Some((hit.triangle, point, normal, apply(z, point) / apply(w, point)))
    }

    fn camera(&self) -> View {
        self.view("camera", 0, [self.number("/image/width") as usize, self.number("/image/height") as usize])
    }

    fn bounds(&self) -> Aabb {
        Aabb { min: self.vector("/bounds/low"), max: self.vector("/bounds/high") }
    }

    fn medium(&self, channel: usize) -> Medium {
        Medium {
            sigma_s_prime: self.number(&format!("/material/scattering/per_unit/{channel}")),
            sigma_a: self.number(&format!("/material/absorption/per_unit/{channel}")),
            eta: self.number("/material/eta"),
        }
    }

    /// The basis by the table of constants and polynomials.
    fn basis(&self, direction: Vec3) -> Vec<f64> {
        let mut values = vec![f64::NAN; 9];
        for function in self.json["conventions"]["spherical_harmonics"]["functions"].as_array().unwrap() {
            let value = polynomial(function["polynomial"].as_str().unwrap(), direction);
            values[function["index"].as_u64().unwrap() as usize] = number(&function["constant"]) * value;
        }
        values
    }

    /// Irradiance of nine coefficients at a unit vector, by the basis and the factors of the bands; at
    /// least 0.
    fn irradiance(&self, coefficients: &[f64; 9], direction: Vec3) -> f64 {
        let factors = self.vector("/conventions/spherical_harmonics/irradiance/a");
        let band = [0, 1, 1, 1, 2, 2, 2, 2, 2];
        let terms = self.basis(direction);
        let mut sum = 0.0;
        for (index, term) in terms.iter().enumerate() {
            sum += factors[band[index]] * coefficients[index] * term;
        }
        if sum > 0.0 { sum } else { 0.0 }
    }

    /// Irradiance at a surface, RGB, and the cosine at which it arrives.
    fn illuminated(&self, light: &Json, point: Vec3, normal: Vec3) -> (Vec3, f64) {
        let each = |one: &dyn Fn(usize) -> f64| [0, 1, 2].map(one);
        match light["kind"].as_str().unwrap() {
            "point" => {
                let (position, intensity) = (vector(&light["position"]), vector(&light["intensity"]));
                let cosine = dot(normal, normalize(sub(position, point)));
                let rgb = each(&|i| optics::point_light_irradiance(intensity[i], position, point, normal));
                (rgb, if cosine > 0.0 { cosine } else { 0.0 })
            }
            "directional" => {
                let (travel, irradiance) = (vector(&light["direction"]), vector(&light["irradiance"]));
                let cosine = -dot(normal, travel);
                let rgb = each(&|i| optics::directional_light_irradiance(irradiance[i], travel, normal));
                (rgb, if cosine > 0.0 { cosine } else { 0.0 })
            }
            _ => {
                let of = |i: usize| [0, 1, 2, 3, 4, 5, 6, 7, 8].map(|k| number(&light["radiance_sh"][k][i]));
                (each(&|i| self.irradiance(&of(i), normal)), self.number("/material/diffuse_cosine"))
            }
        }
    }

    /// A light's distance of a point, by what the export says of its measure.
    fn distance(&self, shadow: &Json, point: Vec3) -> f64 {
        match shadow["distance"]["measure"].as_str().unwrap() {
            "radial" => length(sub(point, vector(&shadow["distance"]["eye"]))),
            _ => apply([0, 1, 2, 3].map(|i| number(&shadow["distance"]["plane"][i])), point),
        }
    }

    /// Some fifty pixels that see a surface, with the ray's point and normal, away from edges of triangles:
    /// there the snapping of corners does not decide.
    fn pixels(&self) -> Vec<(usize, Vec3, Vec3)> {
        let camera = self.camera();
        let seen = self.pass("vbuffer", "Y");
        let all = (0..seen.len()).filter(|index| index % 3 == 0);
        let found: Vec<_> = all
            .filter_map(|index| {
                let (triangle, point, normal, _) =
                    self.seen(&camera, [index % camera.size[0], index / camera.size[0]])?;
                (triangle as f64 == seen[index]).then_some((index, point, normal))
            })
            .collect();
        assert!(found.len() >= 50, "{} pixels", found.len());
        found
    }

    /// The unit direction from a point to the camera.
    fn towards_camera(&self, point: Vec3) -> Vec3 {
        normalize(sub(self.vector("/camera/position"), point))
    }

    /// The refracted direction at a pixel's point.
    fn refracted(&self, point: Vec3, normal: Vec3) -> Vec3 {
        let ray = scale(-1.0, self.towards_camera(point));
        optics::refraction_vector(ray, normal, self.number("/material/eta"))
    }
}

fn number(json: &Json) -> f64 {
    json.as_f64().unwrap_or_else(|| panic!("{json} is no number"))
}

fn vector(json: &Json) -> Vec3 {
    [0, 1, 2].map(|i| number(&json[i]))
}

fn apply(row: [f64; 4], p: Vec3) -> f64 {
    row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3]
}

/// The point in three planes n·p + d = 0, by Cramer's rule.
fn meet(planes: [[f64; 4]; 3]) -> Vec3 {
    let [a, b, c] = planes.map(|plane| [plane[0], plane[1], plane[2]]);
    let [d, e, f] = planes.map(|plane| -plane[3]);
    let sum = add(add(scale(d, cross(b, c)), scale(e, cross(c, a))), scale(f, cross(a, b)));
    scale(1.0 / dot(a, cross(b, c)), sum)
}

/// A sum of products such as `x x - y y` or `3 z z - 1`.
fn polynomial(text: &str, [x, y, z]: Vec3) -> f64 {
    let (mut sum, mut product, mut sign) = (0.0, 1.0, 1.0);
    for word in text.split(' ') {
        match word {
            "x" => product *= x,
            "y" => product *= y,
            "z" => product *= z,
            "-" => (sum, product, sign) = (sum + sign * product, 1.0, -1.0),
            word => product *= word.parse::<f64>().unwrap(),
        }
    }
    sum + sign * product
}

fn close(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((found - expected).abs() <= tolerance, "{what}: recorded {found}, recomputed {expected}");
}

#[test]
fn obj_and_glb_hold_the_arrays_bit_for_bit() {
    let frame = &*FRAME;
    let bits = |values: &[f64]| values.iter().map(|value| (*value as f32).to_bits()).collect::<Vec<_>>();
    let rows = |keyword: &str| -> Vec<f64> {
        let lines = frame.obj.lines().filter_map(|line| line.strip_prefix(keyword));
        lines.flat_map(|line| line.split(' ').map(|word| f64::from(word.parse::<f32>().unwrap()))).collect()
    };
    assert_eq!(bits(&rows("v ")), bits(&frame.arrays["positions"].values));
    assert_eq!(bits(&rows("vn ")), bits(&frame.arrays["normals"].values));
    let corners: Vec<Triangle> = frame
        .obj
        .lines()
        .filter_map(|line| line.strip_prefix("f "))
        .map(|line| {
            let mut words = line.split(' ').map(|word| {
                let (vertex, normal) = word.split_once("//").unwrap();
                assert_eq!(vertex, normal);
                let at = 3 * (vertex.parse::<usize>().unwrap() - 1);
                frame.arrays["positions"].values[at..at + 3].try_into().unwrap()
            });
            [(); 3].map(|()| words.next().unwrap())
        })
        .collect();
    assert_eq!(corners, frame.corners);

    let header = words(&frame.glb[..20]);
    assert_eq!((&frame.glb[..4], header[1], header[2] as usize), (&b"glTF"[..], 2, frame.glb.len()));
    assert_eq!((header[3] % 4, header[4]), (0, 0x4e4f_534a));
    let end = 20 + header[3] as usize;
    let gltf: Json = serde_json::from_slice(&frame.glb[20..end]).unwrap();
    let binary = words(&frame.glb[end..end + 8]);
    assert_eq!((end + 8 + binary[0] as usize, binary[1]), (frame.glb.len(), 0x004e_4942));
    assert_eq!(gltf["buffers"][0]["byteLength"], binary[0]);
    let accessor = |index: usize, kind: &str, component: u32| -> Vec<u32> {
        let (accessor, view) = (&gltf["accessors"][index], &gltf["bufferViews"][index]);
        assert_eq!((&accessor["type"], &accessor["componentType"]), (&kind.into(), &component.into()));
        assert_eq!(accessor["bufferView"], index);
        let [offset, length] = ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap() as usize);
        assert_eq!(offset % 4, 0);
        let found = words(&frame.glb[end + 8 + offset..][..length]);
        let parts = if kind == "VEC3" { 3 } else { 1 };
        assert_eq!(accessor["count"].as_u64().unwrap() as usize * parts, found.len());
        found
    };
    let positions = accessor(0, "VEC3", 5126);
    assert_eq!(positions, bits(&frame.arrays["positions"].values));
    assert_eq!(accessor(1, "VEC3", 5126), bits(&frame.arrays["normals"].values));
    let at = |index: u32| -> Vec3 {
        [0, 1, 2].map(|axis| f64::from(f32::from_bits(positions[3 * index as usize + axis])))
    };
    let indices = accessor(2, "SCALAR", 5125);
    assert!(
        indices.chunks_exact(3).map(|t| [at(t[0]), at(t[1]), at(t[2])]).eq(frame.corners.iter().copied())
    );
    for axis in 0..3 {
        let mut values: Vec<f64> =
            positions.iter().skip(axis).step_by(3).map(|b| f64::from(f32::from_bits(*b))).collect();
        values.sort_by(f64::total_cmp);
        assert_eq!(number(&gltf["accessors"][0]["min"][axis]), values[0]);
        assert_eq!(number(&gltf["accessors"][0]["max"][axis]), values[values.len() - 1]);
    }
    let metres = number(&gltf["nodes"][0]["scale"][0]);
    close(metres, frame.number("/conventions/space/unit_in_metres"), 1e-9, "the node's scale");
}

#[test]
fn the_axes_are_those_that_the_conventions_name() {
    let frame = &*FRAME;
    let [right, up, forward] =
        ["right", "up", "forward"].map(|axis| frame.vector(&format!("/camera/axes/{axis}")));
    assert_eq!(frame.word("/conventions/space/handedness"), "right");
    close(dot(cross(right, up), forward), -1.0, 1e-6, "handedness");
    let upward =
        ["x", "y", "z"].iter().position(|axis| *axis == frame.word("/conventions/space/up")).unwrap();
    assert!(up[upward] > 0.3 && right[upward].abs() < 1e-6);
    let view = frame.camera();
    let target = frame.vector("/camera/target");
    let clip = view.rows.map(|row| apply(row, target));
    close(clip[0] / clip[3], 0.0, 1e-5, "the target is in the middle");
    close(clip[1] / clip[3], 0.0, 1e-5, "the target is in the middle");
    let tangent = bitlight::numeric::double::tan(frame.number("/camera/vertical_fov_degrees") * PI / 360.0);
    let corner = add(target, scale(tangent * clip[3], up));
    close(apply(view.rows[1], corner) / apply(view.rows[3], corner), 1.0, 1e-5, "the field of view");
    for (triangle, normals) in frame.corners.iter().zip(&frame.normals) {
        let facing = cross(sub(triangle[1], triangle[0]), sub(triangle[2], triangle[0]));
        assert!(dot(facing, normals[0]) > 0.0, "triangles run counter-clockwise seen from outside");
    }
    let inverse = 1000.0 * frame.number("/conventions/space/unit_in_metres");
    for of in ["scattering", "absorption"] {
        let [per_mm, per_unit] =
            ["per_millimetre", "per_unit"].map(|unit| frame.vector(&format!("/material/{of}/{unit}")));
        for channel in 0..3 {
            close(per_unit[channel], per_mm[channel] * inverse, 1e-6, of);
        }
    }
}

#[test]
fn a_ray_through_each_pixel_finds_what_the_camera_saw() {
    let frame = &*FRAME;
    let camera = frame.camera();
    let size = [camera.size[0], camera.size[1]];
    let recorded = frame.pass("vbuffer", "Y");
    let (mut surfaces, mut other) = (0, 0);
    for (index, recorded) in recorded.iter().enumerate().filter(|(index, _)| index % 3 == 0) {
        let seen = frame.seen(&camera, [index % size[0], index / size[0]]);
        let triangle = seen.map_or(f64::from(u32::MAX), |(triangle, ..)| triangle as f64);
        if triangle != *recorded {
            other += 1; // snapping moves an edge by 1/512 pixel
            continue;
        }
        let Some((_, point, normal, _)) = seen else { continue };
        surfaces += 1;
        for (axis, (p, n)) in [("x", "nx"), ("y", "ny"), ("z", "nz")].into_iter().enumerate() {
            close(frame.pass("gbuffer", p)[index], point[axis], 2e-6, "a point");
            close(frame.pass("gbuffer", n)[index], normal[axis], 2e-5, "a normal");
        }
        close(frame.pass("gbuffer", "depth")[index], apply(camera.rows[3], point), 2e-6, "a depth");
    }
    assert!(surfaces > 50 && other * 50 < surfaces, "{surfaces} surfaces, {other} other triangles");
}

#[test]
fn a_ray_through_each_texel_finds_the_distance_and_depth_of_the_shadow_map() {
    let frame = &*FRAME;
    for (number_, shadow) in frame.json["shadow"].as_array().unwrap().iter().enumerate() {
        let size = shadow["size"].as_u64().unwrap() as usize;
        let view = frame.view("shadow", number_, [size; 2]);
        let layer = format!("shadow.caster{number_}");
        let [distances, depths] = ["distance", "depth"].map(|channel| frame.pass(&layer, channel));
        let (mut surfaces, mut other) = (0, 0);
        for index in (0..size * size).step_by(7) {
            let seen = frame.seen(&view, [index % size, index / size]);
            if seen.is_some() != (distances[index] > 0.0) {
                other += 1;
                continue;
            }
            let Some((.., point, _, depth)) = seen else { continue };
            surfaces += 1;
            // Snapping moves edges by 1/512 texel, which shows where the surface is steep or another lies
            // behind.
            if (depths[index] - depth).abs() > 3e-4 {
                other += 1;
                continue;
            }
            close(distances[index], frame.distance(shadow, point), 2e-3, "a distance");
        }
        assert!(surfaces > 50 && other * 20 < surfaces, "{layer}: {surfaces} surfaces, {other} others");
    }
    assert_eq!(frame.json["shadow"][1]["light"], 1);
    assert_eq!(
        (&frame.json["lights"][1]["caster"], &frame.json["lights"][2]["caster"]),
        (&1.into(), &Json::Null)
    );
}

#[test]
fn the_light_at_cubemap_texels_is_that_of_the_lights() {
    let frame = &*FRAME;
    let size = frame.number("/cubemap/size") as usize;
    let (mut surfaces, mut other) = (0, 0);
    for face in 0..6 {
        let view = frame.view("cubemap", face, [size; 2]);
        // The face's axes, and the matrix, say the same of where a texel lies.
        let axes = &frame.json["cubemap"]["faces"][face];
        let [right, up, outward] = ["right", "up", "outward"].map(|axis| vector(&axes[axis]));
        let half = frame.vector("/bounds/half_extents");
        let on = add(add(outward, scale(0.25, right)), scale(-0.5, up));
        let point = add(frame.vector("/bounds/centre"), [0, 1, 2].map(|i| on[i] * half[i]));
        let clip = view.rows.map(|row| apply(row, point));
        close(clip[0] / clip[3], 0.25, 1e-5, "right");
        close(clip[1] / clip[3], -0.5, 1e-5, "up");
        for texel in (0..size * size).step_by(3) {
            let index = face * size * size + texel;
            let Some((_, point, normal, _)) = frame.seen(&view, [texel % size, texel / size]) else {
                continue;
            };
            surfaces += 1;
            for (light, facts) in frame.json["lights"].as_array().unwrap().iter().enumerate() {
                let layer = format!("cubemap.light{light}");
                let (irradiance, cosine) = frame.illuminated(facts, point, normal);
                let near = |found: f64, expected: f64| (found - expected).abs() <= 2e-4 * (1.0 + expected);
                let recorded = frame.rgb(&layer, index);
                let same = (0..3).all(|channel| near(recorded[channel], irradiance[channel]))
                    && near(frame.pass(&layer, "cosine")[index], cosine);
                other += usize::from(!same);
            }
        }
    }
    // Snapping moves edges by 1/512 texel, which shows where the surface is steep or another lies behind.
    assert!(surfaces > 50 && other * 20 < 3 * surfaces, "{surfaces} surfaces, {other} other lights");
}

#[test]
fn the_projection_is_that_of_the_texels_in_the_basis_that_the_table_spells_out() {
    let frame = &*FRAME;
    for direction in [[0.6, -0.8, 0.0], [-0.48, 0.6, 0.64], [0.36, 0.48, -0.8]] {
        for (ours, theirs) in frame.basis(direction).iter().zip(sh::eval(3, direction)) {
            close(*ours, theirs, 1e-12, "the basis");
        }
    }
    let size = frame.number("/cubemap/size") as usize;
    let edge = |k: usize| 2.0 * k as f64 / size as f64 - 1.0;
    assert_eq!(frame.arrays["sh"].shape, [3, 9, 3]);
    for light in 0..3 {
        let mut sums = [[0.0; 9]; 3];
        for index in 0..6 * size * size {
            let (face, row, column) = (index / (size * size), index / size % size, index % size);
            let axes = &frame.json["cubemap"]["faces"][face];
            let [right, up, outward] = ["right", "up", "outward"].map(|axis| vector(&axes[axis]));
            let (s, t) =
                ((2 * column + 1) as f64 / size as f64 - 1.0, 1.0 - (2 * row + 1) as f64 / size as f64);
            let basis = frame.basis(normalize(add(outward, add(scale(s, right), scale(t, up)))));
            let angle = rectangle_solid_angle(edge(column), edge(column + 1), edge(row), edge(row + 1));
            let layer = |of: &str| format!("{of}.light{light}");
            let transmittance = optics::schlick_transmittance(
                frame.number("/material/eta"),
                frame.pass(&layer("cubemap"), "cosine")[index],
            );
            for (channel, sums) in sums.iter_mut().enumerate() {
                let entering = frame.rgb(&layer("cubemap"), index)[channel] * transmittance;
                close(
                    frame.rgb(&layer("transmit"), index)[channel],
                    entering,
                    1e-5 * (1.0 + entering),
                    "transmit",
                );
                for k in 0..9 {
                    sums[k] += entering * basis[k] * angle;
                }
            }
        }
        let constants = [0, 1, 2, 3, 4]
            .map(|k| frame.number(&format!("/conventions/spherical_harmonics/irradiance/c/{k}")));
        for (channel, sums) in sums.iter().enumerate() {
            let recorded =
                [0, 1, 2, 3, 4, 5, 6, 7, 8].map(|k| frame.arrays["sh"].values[light * 27 + k * 3 + channel]);
            for k in 0..9 {
                close(recorded[k], sums[k], 2e-5 * (1.0 + sums[0]), "a coefficient");
            }
            let matrix = translucency::eq11_matrix(&recorded, &constants);
            for (i, expected) in matrix.iter().flatten().enumerate() {
                let found = frame.arrays["matrices"].values[light * 48 + channel * 16 + i];
                close(found, *expected, 1e-5 * (1.0 + recorded[0]), "a matrix");
            }
        }
    }
}

#[test]
fn radiosity_and_attenuation_follow_from_the_files_at_fifty_pixels() {
    let frame = &*FRAME;
    let bounds = frame.bounds();
    let f0 = frame.number("/material/schlick_f0");
    close(f0, optics::schlick_f0(frame.number("/material/eta")), 1e-6, "F0");
    for channel in 0..3 {
        let (medium, at) =
            (frame.medium(channel), |of: &str| frame.number(&format!("/material/{of}/{channel}")));
        close(at("reduced_albedo"), medium.alpha_prime(), 1e-6, "alpha'");
        close(at("effective_extinction"), medium.sigma_tr(), 1e-6 * medium.sigma_tr(), "sigma_tr");
        close(at("real_source_depth"), medium.z_r(), 1e-6 * medium.z_r(), "z_r");
        close(at("virtual_source_height"), medium.z_v(), 1e-6 * medium.z_v(), "z_v");
        close(at("total_reflectance"), medium.total_r_d(), 2e-6, "R_d");
    }
    for (index, point, normal) in frame.pixels() {
        let refracted = frame.refracted(point, normal);
        let lookup = bounds.lookup_direction(point, refracted);
        let cosine = dot(normal, frame.towards_camera(point));
        let leaving = optics::schlick_transmittance(frame.number("/material/eta"), cosine);
        for (light, facts) in frame.json["lights"].as_array().unwrap().iter().enumerate() {
            let layer = |of: &str| format!("{of}.light{light}");
            let (d, receives) = match facts["caster"].as_u64() {
                Some(caster) => {
                    let layer = format!("thickness.caster{caster}");
                    (frame.pass(&layer, "thickness")[index], frame.pass(&layer, "receives")[index])
                }
                None => (length(sub(bounds.exit(point, refracted), point)), 1.0),
            };
            for channel in 0..3 {
                let coefficients = [0, 1, 2, 3, 4, 5, 6, 7, 8]
                    .map(|k| frame.arrays["sh"].values[light * 27 + k * 3 + channel]);
                let radiosity = frame.irradiance(&coefficients, lookup);
                let found = frame.rgb(&layer("radiosity"), index)[channel];
                close(found, radiosity, 1e-4 * (1.0 + coefficients[0]), &layer("radiosity"));
                let attenuation =
                    receives * translucency::eq12_radiance(leaving, &frame.medium(channel), d, 1.0);
                let found = frame.rgb(&layer("attenuation"), index)[channel];
                close(found, attenuation, 2e-5 * (attenuation + 0.01), &layer("attenuation"));
            }
        }
    }
}

#[test]
fn thickness_follows_from_the_light_s_view_and_the_blurred_distance() {
    let frame = &*FRAME;
    let mut thick = 0;
    for (number_, shadow) in frame.json["shadow"].as_array().unwrap().iter().enumerate() {
        let size = shadow["size"].as_u64().unwrap() as usize;
        let view = frame.view("shadow", number_, [size; 2]);
        let blur = frame.pass(&format!("blur.caster{number_}"), "Y");
        for (index, point, _) in frame.pixels() {
            let clip = view.rows.map(|row| apply(row, point));
            // The inverse of the pixels' convention: 0 at the upper left corner, a first centre at 1/2.
            let at = |axis: usize| {
                let (first, last) =
                    (frame.ndc([size; 2], [0, 0])[axis], frame.ndc([size; 2], [size - 1; 2])[axis]);
                (clip[axis] / clip[3] - first) / (last - first) * (size - 1) as f64
            };
            let (x, y) = (at(0), at(1));
            let (mut sum, mut weight) = (0.0, 0.0);
            for (column, row) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
                let (column, row) = (x.floor() + column, y.floor() + row);
                let share = (1.0 - (x - column).abs()) * (1.0 - (y - row).abs());
                let held = |at: f64| (at as usize).clamp(0, size - 1);
                let distance = blur[held(row) * size + held(column)];
                if distance > 0.0 {
                    (sum, weight) = (sum + share * distance, weight + share);
                }
            }
            if weight < 1e-3 {
                continue; // where a rounding decides which texels count
            }
            let d = translucency::thickness(sum / weight, frame.distance(shadow, point));
            let found = frame.pass(&format!("thickness.caster{number_}"), "thickness")[index];
            close(found, d, 2e-4, "a thickness");
            thick += usize::from(d > 0.05);
        }
    }
    assert!(thick > 50, "{thick} points with something before them");
}

#[test]
fn the_lat_long_convention_is_that_of_the_maps() {
    let map =
        bitlight::sphere::environment::LatLong::new(400, 200, vec![glam::Vec3::ZERO; 400 * 200]).unwrap();
    for example in FRAME.json["conventions"]["lat_long"]["examples"].as_array().unwrap() {
        let [column, row] =
            [("u", 400.0), ("v", 200.0)].map(|(key, size)| (number(&example[key]) * size) as usize);
        let away = sub(map.direction(column, row), vector(&example["direction"]));
        assert!(length(away) < 0.02, "{example}");
    }
}

#[test]
fn the_table_of_passes_is_what_a_render_records() {
    let frame = &*FRAME;
    let (ours, theirs) =
        (frame.json["passes"].as_array().unwrap(), frame.report["passes"].as_array().unwrap());
    assert_eq!(ours.len(), theirs.len());
    for (ours, theirs) in ours.iter().zip(theirs) {
        for key in ["name", "shape", "type", "digest"] {
            assert_eq!(ours[key], theirs[key], "{}", frame.command);
        }
        let axes = ours["axes"].as_array().unwrap().iter().map(|axis| axis["length"].clone());
        assert_eq!(Json::from(axes.collect::<Vec<_>>()), ours["shape"]);
        let point = ours["axes"].as_array().unwrap().iter().find(|axis| axis["name"] == "point");
        assert_eq!(point, None, "a single accumulation point has no axis");
        assert!(!ours["equation"].as_str().unwrap().is_empty() && ours["unit"].is_string());
        let short = ours["name"].as_str().unwrap().strip_prefix("translucency.").unwrap();
        assert!(frame.json["formulas"][short].is_string(), "{short} has a formula");
    }
    assert_eq!(frame.json["settings"], frame.report["settings"]);
    assert_eq!(frame.json["settings"]["image.width"], 44);
}

#[test]
fn bad_input_is_status_2_and_leaves_no_file() {
    let base = tempfile::tempdir().unwrap();
    let out = base.path().to_str().unwrap();
    let knot = "scenes/translucency/knot.toml";
    let cases: [(&[&str], &str); 3] = [
        (&["scenes/none.toml", "-o", out], "bitlight init"),
        (&[knot, "-o", out, "--set", "light[0].position=[0,0,0]"], "inside"),
        (&[knot, "-o", "/proc/none"], "/proc/none"),
    ];
    for (arguments, part) in cases {
        let output = bitlight(&[&["export"], arguments].concat());
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(String::from_utf8_lossy(&output.stderr).contains(part), "{arguments:?}");
    }
    assert_eq!(std::fs::read_dir(out).unwrap().count(), 0);
}
