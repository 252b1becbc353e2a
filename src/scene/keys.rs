//! Every key of a scene file, with its kind, default and meaning: the one place from which reading, unknown-key
//! hints, `--set`, the JSON Schema and `bitlight init` all come.

use super::value::Value;
use serde_json::{Value as Json, json};
use std::fmt::Write;

/// What values a key takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// Any text.
    Text,
    /// One of these words.
    Choice(&'static [&'static str]),
    /// True or false.
    Flag,
    /// A whole number in this range, ends included.
    Whole(f64, f64),
    /// A finite number in this range, ends included.
    Number(f64, f64),
    /// Three finite numbers, each in this range, ends included.
    Triple(f64, f64),
}

/// One key.
#[derive(Debug, Clone, Copy)]
pub struct Key {
    /// Its table: empty for the top level; a kind of light after a colon.
    pub table: &'static str,
    /// Its name in the table.
    pub name: &'static str,
    /// What it takes.
    pub kind: Kind,
    /// What stands where the file says nothing, as TOML; `None` where the key must be given or may be absent.
    pub default: Option<&'static str>,
    /// A value to start from, as TOML, where there is no default or another is better to start from.
    pub example: &'static str,
    /// What it means, with its unit.
    pub about: &'static str,
}

const fn key(
    table: &'static str,
    name: &'static str,
    kind: Kind,
    default: Option<&'static str>,
    example: &'static str,
    about: &'static str,
) -> Key {
    Key { table, name, kind, default, example, about }
}

const ANY: Kind = Kind::Triple(-1e12, 1e12);
const POSITIVE: Kind = Kind::Triple(0.0, 1e12);
const UNIT: Kind = Kind::Triple(0.0, 1.0);

/// The techniques that a scene may ask for.
pub const TECHNIQUES: &[&str] = &["translucency", "prt"];

/// Whether a technique reads a table. A scene may have tables of others: it can be rendered by them too, with
/// `--set technique=...`.
pub fn reads(technique: &str, table: &str) -> bool {
    match table {
        "surface" => technique == "prt",
        _ => table == technique || !TECHNIQUES.contains(&table),
    }
}

/// All keys, in the order in which a scene is written.
pub const KEYS: &[Key] = &[
    key(
        "",
        "technique",
        Kind::Choice(TECHNIQUES),
        None,
        "\"translucency\"",
        "The technique that renders the scene. Required.",
    ),
    key(
        "",
        "unit",
        Kind::Choice(&["m", "cm", "mm"]),
        Some("\"m\""),
        "\"mm\"",
        "The length of 1 in this file. Materials are measured in millimetres and are converted.",
    ),
    key(
        "",
        "time",
        Kind::Number(-1e9, 1e9),
        Some("0"),
        "",
        "The time that is rendered, in seconds; `--frames` sets it for each frame.",
    ),
    key(
        "",
        "frame_rate",
        Kind::Number(1e-6, 1e9),
        Some("24"),
        "",
        "Frames a second of `--frames`: frame k is the scene at time k / frame_rate.",
    ),
    key("image", "width", Kind::Whole(1.0, 8192.0), Some("512"), "", "Pixels across."),
    key("image", "height", Kind::Whole(1.0, 8192.0), Some("512"), "", "Pixels down."),
    key(
        "image",
        "background",
        POSITIVE,
        Some("[0, 0, 0]"),
        "",
        "Linear RGB radiance of pixels that see no surface.",
    ),
    key(
        "image",
        "exposure",
        Kind::Number(-40.0, 40.0),
        Some("0"),
        "",
        "Stops by which the PNG preview is brightened; the EXR stays as it is.",
    ),
    key("camera", "position", ANY, None, "[0, 0.5, 4]", "Where the camera is. Required."),
    key("camera", "target", ANY, Some("[0, 0, 0]"), "", "The point in the middle of the picture."),
    key("camera", "up", ANY, Some("[0, 1, 0]"), "", "The direction that is upward in the picture."),
    key("camera", "fov", Kind::Number(0.01, 170.0), Some("40"), "", "Vertical field of view in degrees."),
    key(
        "solid",
        "shape",
        Kind::Choice(SHAPES),
        None,
        "\"torus-knot\"",
        "A procedural solid; either this or `file`.",
    ),
    key(
        "solid",
        "resolution",
        Kind::Whole(2.0, 2048.0),
        Some("64"),
        "",
        "How finely the shape is divided; triangles grow with its square.",
    ),
    key(
        "solid",
        "extents",
        Kind::Triple(0.0, 1e12),
        Some("[1, 1, 1]"),
        "",
        "Side lengths of a cuboid; a thin one is a sheet.",
    ),
    key(
        "solid",
        "file",
        Kind::Text,
        None,
        "\"stanford/bunny.obj\"",
        "An OBJ file below the folder of assets.",
    ),
    key(
        "solid",
        "triangles",
        Kind::Whole(0.0, 67_108_864.0),
        Some("0"),
        "",
        "Decimates what has more triangles than this; 0 leaves the file or shape as it is.",
    ),
    key(
        "solid",
        "size",
        Kind::Number(1e-9, 1e12),
        None,
        "2",
        "The longest side of its bounding box is scaled to this; left as it is where absent.",
    ),
    key(
        "solid",
        "turn",
        Kind::Number(-36e3, 36e3),
        Some("0"),
        "",
        "Degrees by which it is turned about the vertical, counter-clockwise seen from above.",
    ),
    key("solid", "center", ANY, Some("[0, 0, 0]"), "", "Where the centre of its bounding box is put."),
    key(
        "wave",
        "amplitude",
        Kind::Number(0.0, 1e12),
        Some("0"),
        "",
        "By how much a wave along z moves the placed solid along x, by sin 2π(z / length + time / period); 0 for none.",
    ),
    key("wave", "length", Kind::Number(1e-9, 1e12), Some("1"), "", "From crest to crest of the wave."),
    key(
        "wave",
        "period",
        Kind::Number(1e-9, 1e12),
        Some("1"),
        "",
        "Seconds from crest to crest; crests run towards -z.",
    ),
    key(
        "bend",
        "angle",
        Kind::Number(-36e3, 36e3),
        Some("0"),
        "",
        "Degrees by which `length` of the placed solid along y is bent towards x, times sin 2π(time / period); 0 for none.",
    ),
    key(
        "bend",
        "length",
        Kind::Number(1e-9, 1e12),
        Some("1"),
        "",
        "The length along y that turns by `angle`.",
    ),
    key("bend", "root", Kind::Number(-1e12, 1e12), Some("0"), "", "The height y that stays where it is."),
    key(
        "bend",
        "period",
        Kind::Number(1e-9, 1e12),
        Some("1"),
        "",
        "Seconds until the solid has swung to both sides and back.",
    ),
    key(
        "material",
        "name",
        Kind::Text,
        None,
        "\"Marble\"",
        "A material measured by Jensen et al. 2001; either this or `scattering` and `absorption`.",
    ),
    key(
        "material",
        "scattering",
        Kind::Triple(0.0, 1e9),
        None,
        "[2.19, 2.62, 3.0]",
        "Reduced scattering coefficient, RGB, per millimetre.",
    ),
    key(
        "material",
        "absorption",
        Kind::Triple(0.0, 1e9),
        None,
        "[0.0021, 0.0041, 0.0071]",
        "Absorption coefficient, RGB, per millimetre.",
    ),
    key(
        "material",
        "eta",
        Kind::Number(1.0, 3.5),
        None,
        "1.5",
        "Index of refraction; that of the named material, or 1.3, where absent.",
    ),
    key("material", "gloss", Kind::Number(0.0, 1e4), Some("0"), "", "Exponent of the highlight; 0 for none."),
    key("surface", "albedo", UNIT, Some("[0.5, 0.5, 0.5]"), "", "Diffuse albedo, RGB."),
    key(
        "surface",
        "highlight",
        Kind::Choice(&["none", "phong", "cook-torrance"]),
        Some("\"none\""),
        "",
        "The shape of the highlight on top of the diffuse part.",
    ),
    key(
        "surface",
        "specular",
        UNIT,
        Some("[0.2, 0.2, 0.2]"),
        "",
        "Colour of the highlight, RGB; Cook-Torrance takes it at normal incidence. More than 1 with `albedo` may create energy.",
    ),
    key("surface", "exponent", Kind::Number(0.0, 1e4), Some("20"), "", "Exponent of the Phong highlight."),
    key(
        "surface",
        "roughness",
        Kind::Number(0.01, 1.0),
        Some("0.3"),
        "",
        "Root mean square slope of the facets of the Cook-Torrance highlight.",
    ),
    key(
        "light",
        "kind",
        Kind::Choice(&["point", "directional", "environment"]),
        None,
        "\"point\"",
        "What kind of light. Required.",
    ),
    key(
        "light:point",
        "position",
        ANY,
        None,
        "[2, 3, -3]",
        "Where the light is, outside the solid's bounding box.",
    ),
    key(
        "light:point",
        "intensity",
        POSITIVE,
        None,
        "[160, 150, 130]",
        "Radiant intensity, RGB: the irradiance at distance 1.",
    ),
    key(
        "light:directional",
        "direction",
        ANY,
        None,
        "[0, -1, 0]",
        "The direction in which the light travels.",
    ),
    key(
        "light:directional",
        "irradiance",
        POSITIVE,
        None,
        "[3, 3, 3]",
        "Irradiance on a surface that faces the light, RGB.",
    ),
    key(
        "light:environment",
        "file",
        Kind::Text,
        None,
        "\"envmaps/grace.hdr\"",
        "A lat-long Radiance HDR file below the folder of assets; or `probe`, or `radiance`.",
    ),
    key(
        "light:environment",
        "probe",
        Kind::Text,
        None,
        "\"eucalyptus\"",
        "A probe published as nine coefficients by Ramamoorthi and Hanrahan 2001.",
    ),
    key(
        "light:environment",
        "radiance",
        POSITIVE,
        None,
        "[1, 1, 1]",
        "The same radiance from everywhere, RGB.",
    ),
    key(
        "light:environment",
        "scale",
        Kind::Number(0.0, 1e12),
        Some("1"),
        "",
        "Factor on the environment's radiance.",
    ),
    key(
        "translucency",
        "cubemap",
        Kind::Whole(1.0, 2048.0),
        Some("64"),
        "",
        "Texels along a side of a face of the external cubemap.",
    ),
    key(
        "translucency",
        "accumulation",
        Kind::Whole(1.0, 16.0),
        Some("1"),
        "",
        "Accumulation points along the longest side of the solid's box, and along the others in proportion.",
    ),
    key(
        "translucency",
        "shadow",
        Kind::Whole(1.0, 8192.0),
        Some("512"),
        "",
        "Texels along a side of a light's shadow map.",
    ),
    key(
        "translucency",
        "blur",
        Kind::Whole(0.0, 256.0),
        Some("8"),
        "",
        "Width in texels of the Gaussian that smooths the shadow map; 0 for none.",
    ),
    key(
        "translucency",
        "reading",
        Kind::Choice(&["corrected", "paper"]),
        Some("\"corrected\""),
        "",
        "Whether the equations are computed as the errata correct them or to the letter of the print.",
    ),
    key(
        "translucency",
        "smallest_d",
        Kind::Number(1e-9, 1e12),
        None,
        "0.01",
        "Thickness below which the printed Eq. 12 is held; 0.001 of half the bounding box's diagonal where absent.",
    ),
    key(
        "translucency",
        "evaluation",
        Kind::Choice(&["pixel", "vertex"]),
        Some("\"pixel\""),
        "",
        "Whether the radiosity is evaluated at each pixel, or at each vertex and interpolated (fig. 6).",
    ),
    key(
        "translucency",
        "second_layer",
        Kind::Flag,
        Some("true"),
        "",
        "Whether only points up to the second surface that the light meets receive it (fig. 9), or all.",
    ),
    key(
        "translucency",
        "shift_cure",
        Kind::Flag,
        Some("true"),
        "",
        "Whether the radiosity is looked up where the refracted ray leaves the box (fig. 7a), or along its direction.",
    ),
    key(
        "translucency",
        "blindness_cure",
        Kind::Flag,
        Some("true"),
        "",
        "Whether the cubemap's views fill the solid's bounding box (fig. 8), or a cube around it (fig. 7b).",
    ),
    key(
        "translucency",
        "fit",
        Kind::Choice(&["box", "solid"]),
        Some("\"box\""),
        "",
        "What a shadow map just holds: the solid's bounding box, or the solid itself, which wastes fewer texels.",
    ),
    key(
        "translucency",
        "show",
        Kind::Choice(&["all", "direct", "scattered"]),
        Some("\"all\""),
        "",
        "Which light the picture shows: what the surface reflects, what has come through the solid, or both.",
    ),
    key(
        "prt",
        "bands",
        Kind::Whole(1.0, 10.0),
        Some("5"),
        "",
        "Bands n of spherical harmonics: light and transfer have n² coefficients.",
    ),
    key(
        "prt",
        "directions",
        Kind::Whole(1.0, 65536.0),
        Some("512"),
        "",
        "Directions in which the visibility of a vertex is found.",
    ),
    key(
        "prt",
        "method",
        Kind::Choice(&["control", "quadrature"]),
        Some("\"control\""),
        "",
        "How integrals are estimated: with what the sum over the whole hemisphere lacks as a control, or as plain sums.",
    ),
    key(
        "prt",
        "reading",
        Kind::Choice(&["corrected", "paper"]),
        Some("\"corrected\""),
        "",
        "Whether transfer vectors are as the errata correct them, or the print's, without cosine, albedo and bounces.",
    ),
    key(
        "prt",
        "bounces",
        Kind::Whole(0.0, 64.0),
        Some("0"),
        "",
        "How often light is reflected between points of the solid before it is reflected to the eye.",
    ),
    key(
        "prt",
        "subsurface",
        Kind::Choice(&["none", "dipole"]),
        Some("\"none\""),
        "",
        "Whether light that enters the material of [material] leaves elsewhere, by the dipole of Jensen et al. 2001.",
    ),
    key(
        "prt",
        "poses",
        Kind::Whole(1.0, 100_000.0),
        Some("1"),
        "",
        "Poses that `bitlight bake` stores: pose k is frame k.",
    ),
    key(
        "truth",
        "model",
        Kind::Choice(&["surface", "medium", "dipole"]),
        None,
        "\"surface\"",
        "What the ground truth traces: light between surfaces, in the medium, or by the dipole; what the technique approximates if absent.",
    ),
    key(
        "truth",
        "bands",
        Kind::Whole(0.0, 32.0),
        Some("0"),
        "",
        "Bands to which the ground truth sees environments and directions of light; 0 for the lights themselves.",
    ),
    key(
        "truth",
        "bounces",
        Kind::Whole(0.0, 10_000.0),
        None,
        "8",
        "The most reflections between points of the solid before the one to the eye, as prt.bounces; no limit if absent.",
    ),
    key(
        "truth",
        "anisotropy",
        Kind::Number(-0.99, 0.99),
        Some("0"),
        "",
        "Mean cosine of the scattering angle in the medium of the ground truth.",
    ),
    key(
        "truth",
        "filter",
        Kind::Choice(&["point", "box"]),
        Some("\"point\""),
        "",
        "Where the ground truth samples a pixel: in its centre, which the passes shade, or all over its area.",
    ),
];

/// The procedural solids.
pub const SHAPES: &[&str] = &["sphere", "torus-knot", "genus-3", "cuboid"];

impl Kind {
    /// What the key takes, for a person.
    pub(super) fn describe(self) -> String {
        let range = |low: f64, high: f64| match (low, high) {
            (low, high) if low == -high && high >= 1e12 => String::new(),
            (low, high) if high >= 1e6 => format!(" from {low} to {high:e}"),
            _ => format!(" from {low} to {high}"),
        };
        match self {
            Self::Text => "a text in quotes".into(),
            Self::Flag => "true or false".into(),
            Self::Choice(words) => format!("one of \"{}\"", words.join("\", \"")),
            Self::Whole(low, high) => format!("a whole number{}", range(low, high)),
            Self::Number(low, high) => format!("a number{}", range(low, high)),
            Self::Triple(low, high) => format!("three numbers{} in brackets", range(low, high)),
        }
    }

    /// Whether `value` is of this kind.
    pub(super) fn accepts(self, value: &Value) -> bool {
        let within = |x: f64, low: f64, high: f64| low <= x && x <= high; // false for a NaN
        match (self, value) {
            (Self::Text, Value::Text(_)) | (Self::Flag, Value::Flag(_)) => true,
            (Self::Choice(words), Value::Text(text)) => words.contains(&text.as_str()),
            (Self::Whole(low, high), Value::Number(x)) => x.fract() == 0.0 && within(*x, low, high),
            (Self::Number(low, high), Value::Number(x)) => within(*x, low, high),
            (Self::Triple(low, high), Value::Numbers(all)) => {
                all.len() == 3 && all.iter().all(|x| within(*x, low, high))
            }
            _ => false,
        }
    }

    fn schema(self) -> Json {
        match self {
            Self::Text => json!({"type": "string"}),
            Self::Flag => json!({"type": "boolean"}),
            Self::Choice(words) => json!({"enum": words}),
            Self::Whole(low, high) => {
                json!({"type": "integer", "minimum": low as i64, "maximum": high as i64})
            }
            Self::Number(low, high) => json!({"type": "number", "minimum": low, "maximum": high}),
            Self::Triple(low, high) => json!({"type": "array", "minItems": 3, "maxItems": 3,
                "items": {"type": "number", "minimum": low, "maximum": high}}),
        }
    }
}

/// The tables in the order of a scene file, without the kinds of light.
fn tables() -> Vec<&'static str> {
    let mut tables: Vec<_> = KEYS.iter().map(|key| base(key.table)).collect();
    tables.dedup();
    tables
}

fn base(table: &str) -> &str {
    table.split(':').next().unwrap_or(table)
}

/// The JSON Schema (draft 2020-12) of a scene, by which editors complete and check it.
pub fn schema() -> Json {
    let properties = |table: &str| -> serde_json::Map<String, Json> {
        let mut properties = serde_json::Map::new();
        for key in KEYS.iter().filter(|key| base(key.table) == table) {
            // A key of several kinds of light (`file`) is described once; the kinds agree on its type.
            let mut schema = key.kind.schema();
            let scope = key.table.split_once(':').map(|(_, kind)| format!("({kind}) ")).unwrap_or_default();
            schema["description"] = json!(format!("{scope}{}", key.about));
            if let Some(default) = key.default.and_then(|text| Value::parse(text).ok()) {
                schema["default"] = default.to_json();
            }
            properties.entry(key.name).or_insert(schema);
        }
        properties
    };
    let object = |table: &str, required: &[&str]| json!({"type": "object", "additionalProperties": false, "properties": properties(table), "required": required});
    let mut root = object("", &["technique", "camera", "solid", "light"]);
    for table in tables().into_iter().filter(|table| !table.is_empty()) {
        root["properties"][table] = match table {
            "light" => json!({"type": "array", "minItems": 1, "items": object(table, &["kind"])}),
            "camera" => object(table, &["position"]),
            _ => object(table, &[]),
        };
    }
    let mut schema = json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A scene of bitlight",
    });
    schema
        .as_object_mut()
        .into_iter()
        .for_each(|schema| schema.extend(root.as_object().cloned().unwrap_or_default()));
    schema
}

/// A scene with every key, its meaning and its default: what stands behind a `#` may be left out.
pub fn template(technique: &str) -> String {
    let mut text =
        String::from("# A scene of bitlight. Lines behind a # show defaults and alternatives.\n\n");
    // The kind of light to start from, and of several ways to give it the one that is shown.
    let (kind, way) = if technique == "prt" { ("environment", "probe") } else { ("point", "") };
    for table in tables().into_iter().filter(|table| reads(technique, table)) {
        match table {
            "" => {}
            "light" => text.push_str("\n[[light]]\n"),
            _ => writeln!(text, "\n[{table}]").unwrap_or_default(),
        }
        for key in KEYS.iter().filter(|key| base(key.table) == table) {
            let of = key.table.split_once(':').map(|(_, kind)| kind);
            let other_light = of.is_some_and(|of| of != kind || (of == "environment" && key.name != way));
            let optional = other_light
                || table == "truth"
                || matches!(key.name, "file" | "scattering" | "absorption" | "eta" | "smallest_d");
            let (value, optional) = match (key.name, key.default) {
                ("technique", _) => (format!("\"{technique}\""), false),
                ("kind", _) => (format!("\"{kind}\""), false),
                (_, Some(default)) if key.example.is_empty() => (default.to_owned(), true),
                (_, Some(_)) => (key.example.to_owned(), false),
                (_, None) => (key.example.to_owned(), optional),
            };
            let scope = of.map(|kind| format!("{kind} light: ")).unwrap_or_default();
            let mark = if optional { "# " } else { "" };
            let assignment = format!("{mark}{} = {value}", key.name);
            writeln!(text, "{assignment:<42} # {scope}{} Takes {}.", key.about, key.kind.describe())
                .unwrap_or_default();
        }
    }
    text
}
