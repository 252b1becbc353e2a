//! The keys that scenes of every technique share, and what is made of all keys together: the JSON Schema of
//! scenes, and scenes to start from.

use super::reader::{HIGHLIGHT_NAMES, LIGHT_NAMES, SHAPE_NAMES, UNIT_NAMES};
use crate::keys::{ALL, Key, Kind, Only, PICTURE, PICTURE_AND_TRANSFER, PICTURE_AND_TRUTH, Value};
use crate::techniques::Technique;
use crate::truth;
use serde_json::{Map, Value as Json, json};
use std::fmt::Write;

const ANY: Kind = Kind::Triple(-1e12, 1e12);
const POSITIVE: Kind = Kind::Triple(0.0, 1e12);
const UNIT: Kind = Kind::Triple(0.0, 1.0);

/// The shared keys, in the order in which a scene is written.
const SHARED: &[Key] = &[
    Key::new(
        "",
        "technique",
        Kind::Technique,
        PICTURE_AND_TRANSFER,
        "The technique that renders the scene. Required.",
    ),
    Key::new(
        "",
        "unit",
        Kind::Choice(&UNIT_NAMES),
        ALL,
        "The length of 1 in this file. Materials are measured in millimetres and are converted.",
    )
    .or("\"m\"")
    .example("\"mm\""),
    Key::new(
        "",
        "time",
        Kind::Number(-1e9, 1e9),
        PICTURE_AND_TRUTH,
        "The time that is rendered, in seconds; `--frames` sets it for each frame.",
    )
    .or("0"),
    Key::new(
        "",
        "frame_rate",
        Kind::Number(1e-6, 1e9),
        PICTURE_AND_TRANSFER,
        "Frames a second of `--frames`: frame k is the scene at time k / frame_rate.",
    )
    .or("24"),
    Key::new("image", "width", Kind::Whole(1.0, 8192.0), PICTURE_AND_TRUTH, "Pixels across.").or("512"),
    Key::new("image", "height", Kind::Whole(1.0, 8192.0), PICTURE_AND_TRUTH, "Pixels down.").or("512"),
    Key::new(
        "image",
        "background",
        POSITIVE,
        PICTURE_AND_TRUTH,
        "Linear RGB radiance of pixels that see no surface.",
    )
    .or("[0, 0, 0]"),
    Key::new(
        "image",
        "exposure",
        Kind::Number(-40.0, 40.0),
        PICTURE,
        "Stops by which the PNG preview is brightened; the EXR stays as it is.",
    )
    .or("0"),
    Key::new("camera", "position", ANY, PICTURE_AND_TRUTH, "Where the camera is. Required.")
        .example("[0, 0.5, 4]"),
    Key::new("camera", "target", ANY, PICTURE_AND_TRUTH, "The point in the middle of the picture.")
        .or("[0, 0, 0]"),
    Key::new("camera", "up", ANY, PICTURE_AND_TRUTH, "The direction that is upward in the picture.")
        .or("[0, 1, 0]"),
    Key::new(
        "camera",
        "fov",
        Kind::Number(0.01, 170.0),
        PICTURE_AND_TRUTH,
        "Vertical field of view in degrees.",
    )
    .or("40"),
    Key::new("solid", "shape", Kind::Choice(&SHAPE_NAMES), ALL, "A procedural solid; either this or `file`.")
        .example("\"torus-knot\""),
    Key::new(
        "solid",
        "resolution",
        Kind::Whole(2.0, 2048.0),
        ALL,
        "How finely the shape is divided; triangles grow with its square.",
    )
    .or("64"),
    Key::new(
        "solid",
        "extents",
        Kind::Triple(0.0, 1e12),
        ALL,
        "Side lengths of a cuboid; a thin one is a sheet.",
    )
    .or("[1, 1, 1]"),
    Key::new("solid", "file", Kind::Text, ALL, "An OBJ file below the folder of assets.")
        .example("\"stanford/bunny.obj\"")
        .aside(),
    Key::new(
        "solid",
        "triangles",
        Kind::Whole(0.0, 67_108_864.0),
        ALL,
        "Decimates what has more triangles than this; 0 leaves the file or shape as it is.",
    )
    .or("0"),
    Key::new(
        "solid",
        "size",
        Kind::Number(1e-9, 1e12),
        ALL,
        "The longest side of its bounding box is scaled to this; left as it is where absent.",
    )
    .example("2"),
    Key::new(
        "solid",
        "turn",
        Kind::Number(-36e3, 36e3),
        ALL,
        "Degrees by which it is turned about the vertical, counter-clockwise seen from above.",
    )
    .or("0"),
    Key::new("solid", "center", ANY, ALL, "Where the centre of its bounding box is put.").or("[0, 0, 0]"),
    Key::new(
        "wave",
        "amplitude",
        Kind::Number(0.0, 1e12),
        ALL,
        "By how much a wave along z moves the placed solid along x, by sin 2π(z / length + time / period); \
         0 for none.",
    )
    .or("0"),
    Key::new("wave", "length", Kind::Number(1e-9, 1e12), ALL, "From crest to crest of the wave.").or("1"),
    Key::new(
        "wave",
        "period",
        Kind::Number(1e-9, 1e12),
        ALL,
        "Seconds from crest to crest; crests run towards -z.",
    )
    .or("1"),
    Key::new(
        "bend",
        "angle",
        Kind::Number(-36e3, 36e3),
        ALL,
        "Degrees by which `length` of the placed solid along y is bent towards x, times sin 2π(time / \
         period); 0 for none.",
    )
    .or("0")
    .only(Only::Given),
    Key::new("bend", "length", Kind::Number(1e-9, 1e12), ALL, "The length along y that turns by `angle`.")
        .or("1")
        .only(Only::Given),
    Key::new("bend", "root", Kind::Number(-1e12, 1e12), ALL, "The height y that stays where it is.")
        .or("0")
        .only(Only::Given),
    Key::new(
        "bend",
        "period",
        Kind::Number(1e-9, 1e12),
        ALL,
        "Seconds until the solid has swung to both sides and back.",
    )
    .or("1")
    .only(Only::Given),
    Key::new(
        "material",
        "name",
        Kind::Text,
        ALL,
        "A material measured by Jensen et al. 2001; either this or `scattering` and `absorption`.",
    )
    .example("\"Marble\""),
    Key::new(
        "material",
        "scattering",
        Kind::Triple(0.0, 1e9),
        ALL,
        "Reduced scattering coefficient, RGB, per millimetre.",
    )
    .example("[2.19, 2.62, 3.0]")
    .aside(),
    Key::new(
        "material",
        "absorption",
        Kind::Triple(0.0, 1e9),
        ALL,
        "Absorption coefficient, RGB, per millimetre.",
    )
    .example("[0.0021, 0.0041, 0.0071]")
    .aside(),
    Key::new(
        "material",
        "eta",
        Kind::Number(1.0, 3.5),
        ALL,
        "Index of refraction; that of the named material, or 1.3, where absent.",
    )
    .example("1.5")
    .aside(),
    Key::new("material", "gloss", Kind::Number(0.0, 1e4), PICTURE, "Exponent of the highlight; 0 for none.")
        .or("0"),
    Key::new("surface", "albedo", UNIT, ALL, "Diffuse albedo, RGB.").or("[0.5, 0.5, 0.5]"),
    Key::new(
        "surface",
        "highlight",
        Kind::Choice(&HIGHLIGHT_NAMES),
        ALL,
        "The shape of the highlight on top of the diffuse part.",
    )
    .or("\"none\""),
    Key::new(
        "surface",
        "specular",
        UNIT,
        ALL,
        "Colour of the highlight, RGB; Cook-Torrance takes it at normal incidence. More than 1 with \
         `albedo` may create energy.",
    )
    .or("[0.2, 0.2, 0.2]")
    .only(Only::With("surface.highlight", &["phong", "cook-torrance"])),
    Key::new("surface", "exponent", Kind::Number(0.0, 1e4), ALL, "Exponent of the Phong highlight.")
        .or("20")
        .only(Only::With("surface.highlight", &["phong"])),
    Key::new(
        "surface",
        "roughness",
        Kind::Number(0.01, 1.0),
        ALL,
        "Root mean square slope of the facets of the Cook-Torrance highlight.",
    )
    .or("0.3")
    .only(Only::With("surface.highlight", &["cook-torrance"])),
    Key::new("light", "kind", Kind::Choice(&LIGHT_NAMES), PICTURE_AND_TRUTH, "What kind of light. Required.")
        .example("\"point\""),
    Key::new(
        "light:point",
        "position",
        ANY,
        PICTURE_AND_TRUTH,
        "Where the light is, outside the solid's bounding box.",
    )
    .example("[2, 3, -3]"),
    Key::new(
        "light:point",
        "intensity",
        POSITIVE,
        PICTURE_AND_TRUTH,
        "Radiant intensity, RGB: the irradiance at distance 1.",
    )
    .example("[160, 150, 130]"),
    Key::new(
        "light:directional",
        "direction",
        ANY,
        PICTURE_AND_TRUTH,
        "The direction in which the light travels.",
    )
    .example("[0, -1, 0]"),
    Key::new(
        "light:directional",
        "irradiance",
        POSITIVE,
        PICTURE_AND_TRUTH,
        "Irradiance on a surface that faces the light, RGB.",
    )
    .example("[3, 3, 3]"),
    Key::new(
        "light:environment",
        "file",
        Kind::Text,
        PICTURE_AND_TRUTH,
        "A lat-long Radiance HDR file below the folder of assets; or `probe`, or `radiance`.",
    )
    .example("\"envmaps/grace.hdr\"")
    .aside(),
    Key::new(
        "light:environment",
        "probe",
        Kind::Text,
        PICTURE_AND_TRUTH,
        "A probe published as nine coefficients by Ramamoorthi and Hanrahan 2001.",
    )
    .example("\"eucalyptus\""),
    Key::new(
        "light:environment",
        "radiance",
        POSITIVE,
        PICTURE_AND_TRUTH,
        "The same radiance from everywhere, RGB.",
    )
    .example("[1, 1, 1]")
    .aside(),
    Key::new(
        "light:environment",
        "scale",
        Kind::Number(0.0, 1e12),
        PICTURE_AND_TRUTH,
        "Factor on the environment's radiance.",
    )
    .or("1"),
];

/// All keys, in the order in which a scene is written: shared ones, those of each technique, those of the
/// ground truth.
pub fn all(techniques: &[&'static Technique]) -> Vec<&'static Key> {
    let own = techniques.iter().flat_map(|technique| technique.keys);
    SHARED.iter().chain(own).chain(truth::KEYS).collect()
}

/// Whether a technique reads a table. A scene may have tables of others: it can be rendered by them too, with
/// `--set technique=...`.
pub fn reads(technique: &Technique, table: &str) -> bool {
    let common = !["material", "surface"].contains(&table) && SHARED.iter().any(|key| key.base() == table);
    common || table == technique.name || technique.tables.contains(&table)
}

/// The tables in the order of a scene file.
fn tables(keys: &[&Key]) -> Vec<&'static str> {
    let mut tables: Vec<_> = keys.iter().map(|key| key.base()).collect();
    tables.dedup();
    tables
}

/// The JSON Schema (draft 2020-12) of scenes of these techniques, by which editors complete and check them.
pub fn schema(techniques: &[&'static Technique]) -> Json {
    let keys = all(techniques);
    let properties = |table: &str| -> Map<String, Json> {
        let mut properties = Map::new();
        for key in keys.iter().filter(|key| key.base() == table) {
            // A key that several kinds of light have is described once: the kinds must agree on its type.
            let mut schema = match key.kind {
                Kind::Technique => {
                    json!({"enum": techniques.iter().map(|technique| technique.name).collect::<Vec<_>>()})
                }
                kind => kind.schema(),
            };
            let scope = key.light().map(|kind| format!("({kind}) ")).unwrap_or_default();
            schema["description"] = json!(format!("{scope}{}", key.about));
            if let Some(default) = key.default.and_then(|text| Value::parse(text).ok()) {
                schema["default"] = default.to_json();
            }
            properties.entry(key.name).or_insert(schema);
        }
        properties
    };
    let object = |table: &str, required: &[&str]| {
        json!({
            "type": "object",
            "additionalProperties": false,
            "properties": properties(table),
            "required": required,
        })
    };
    let mut root = object("", &["technique", "camera", "solid", "light"]);
    for table in tables(&keys).into_iter().filter(|table| !table.is_empty()) {
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

/// A scene of a technique with every key, its meaning and its default: what stands behind a `#` may be left
/// out.
pub fn template(technique: &'static Technique) -> String {
    let mut text =
        String::from("# A scene of bitlight. Lines behind a # show defaults and alternatives.\n\n");
    let (keys, light) = (all(&[technique]), technique.lights[0]);
    let of_it = |table: &&str| *table == "truth" || reads(technique, table);
    for table in tables(&keys).into_iter().filter(of_it) {
        match table {
            "" => {}
            "light" => text.push_str("\n[[light]]\n"),
            _ => writeln!(text, "\n[{table}]").unwrap_or_default(),
        }
        for key in keys.iter().filter(|key| key.base() == table) {
            let of = key.light();
            let aside = key.aside || of.is_some_and(|of| of != light);
            let (value, aside) = match (key.name, key.default) {
                ("technique", _) => (format!("\"{}\"", technique.name), false),
                ("kind", _) => (format!("\"{light}\""), false),
                (_, Some(default)) if key.example.is_empty() => (default.to_owned(), true),
                (_, Some(_)) => (key.example.to_owned(), false),
                (_, None) => (key.example.to_owned(), aside),
            };
            let scope = of.map(|kind| format!("{kind} light: ")).unwrap_or_default();
            let mark = if aside { "# " } else { "" };
            let assignment = format!("{mark}{} = {value}", key.name);
            writeln!(text, "{assignment:<42} # {scope}{} Takes {}.", key.about, key.kind.describe())
                .unwrap_or_default();
        }
    }
    text
}
