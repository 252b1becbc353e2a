//! `bitlight diff` as a person meets it: the comparator itself, tested with injected faults.
#![cfg(feature = "cli")]

use bitlight::pass::{Buffer, Channel, Data, Layer};
use bitlight::store::file;
use serde_json::Value as Json;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A knot that renders in a blink.
const SMALL: [&str; 5] = [
    "image.width=24",
    "image.height=16",
    "solid.resolution=6",
    "translucency.shadow=32",
    "translucency.cubemap=8",
];

fn bitlight(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bitlight"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).env_remove("BITLIGHT_ASSETS").args(arguments);
    command.output().unwrap()
}

/// Exit status, standard output, standard error.
fn diff(a: &Path, b: &Path, more: &[&str]) -> (Option<i32>, String, String) {
    let output = bitlight(&[&["diff", a.to_str().unwrap(), b.to_str().unwrap()], more].concat());
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

/// The dump of a frame, all passes, and a copy of it to put faults in.
fn dumps() -> (tempfile::TempDir, PathBuf, PathBuf) {
    let base = tempfile::tempdir().unwrap();
    let [a, b] = ["a", "b"].map(|name| base.path().join(name));
    let mut arguments =
        vec!["render", "scenes/translucency/knot.toml", "--passes", "all", "-o", a.to_str().unwrap()];
    arguments.extend(SMALL.iter().flat_map(|set| ["--set", *set]));
    let output = bitlight(&arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    std::fs::create_dir(&b).unwrap();
    for entry in std::fs::read_dir(&a).unwrap().map(|entry| entry.unwrap()) {
        std::fs::copy(entry.path(), b.join(entry.file_name())).unwrap();
    }
    (base, a, b)
}

/// Changes the layers of an EXR file.
fn change(file: &Path, change: impl FnOnce(&mut Vec<Layer>)) {
    let mut layers = file::read_exr(file).unwrap();
    change(&mut layers);
    file::write_exr(file, &layers).unwrap();
}

/// The values of a channel.
fn values<'a>(layers: &'a mut [Layer], layer: &str, channel: &str) -> &'a mut Vec<f32> {
    let layer = layers.iter_mut().find(|found| found.name == layer).unwrap();
    match &mut layer.channels.iter_mut().find(|found| found.name == channel).unwrap().data {
        Data::F32(values) => values,
        Data::U32(_) => panic!("{channel} has indices"),
    }
}

fn single(name: &str, channels: &[(&str, Vec<f32>)]) -> Layer {
    let channel =
        |(name, values): &(&str, Vec<f32>)| Channel { name: (*name).into(), data: Data::F32(values.clone()) };
    Layer { name: name.into(), width: 2, height: 2, channels: channels.iter().map(channel).collect() }
}

#[test]
fn equal_dumps_are_status_0() {
    let (_keep, a, b) = dumps();
    let (status, out, err) = diff(&a, &b, &[]);
    assert_eq!(status, Some(0), "{out}{err}");
    let lines: Vec<_> = out.lines().collect();
    assert!(lines.iter().any(|line| line.starts_with("same      knot.exr: translucency.gbuffer")), "{out}");
    assert!(lines.iter().any(|line| line.contains("knot.translucency.matrices")), "{out}");
    assert_eq!(*lines.last().unwrap(), format!("{} the same, 0 not", lines.len() - 1));
    assert_eq!(diff(&a.join("knot.exr"), &b.join("knot.exr"), &[]).0, Some(0));
}

#[test]
fn one_last_place_in_one_pixel_is_found_there_and_in_its_pass() {
    let (keep, a, b) = dumps();
    let mut at = 0;
    change(&b.join("knot.exr"), |layers| {
        let blur = values(layers, "translucency.blur.caster0", "Y");
        at = blur.iter().position(|value| *value > 0.0).unwrap();
        blur[at] = blur[at].next_up();
        // A later pass in the flow, and an earlier part of the file.
        let last = values(layers, "translucency.final", "G");
        last[7] += 1.0;
    });
    let pictures = keep.path().join("pictures");
    let (status, out, _) = diff(&a, &b, &["-o", pictures.to_str().unwrap()]);
    assert_eq!(status, Some(1));
    let blur = out.lines().find(|line| line.contains("translucency.blur.caster0")).unwrap();
    let place = format!("1 pixels differ, first pixel ({}, {}), channel Y: ", at % 32, at / 32);
    assert!(blur.starts_with("differs   knot.exr: ") && blur.contains(&place), "{blur}");
    assert!(blur.contains("(1 ULP)"), "{blur}");
    assert!(
        out.lines().last().unwrap().ends_with(" the same, 2 not; translucency.blur diverges first"),
        "{out}"
    );
    assert!(pictures.join("knot.translucency.blur.caster0.difference.png").is_file());
    assert_eq!(std::fs::read_dir(&pictures).unwrap().count(), 2, "a picture a differing layer, and no more");

    let (status, out, _) = diff(&a.join("knot.exr"), &b.join("knot.exr"), &["--json"]);
    assert_eq!(status, Some(1));
    let json: Json = serde_json::from_str(&out).unwrap();
    assert_eq!((&json["same"], &json["diverges_first"]), (&false.into(), &"translucency.blur".into()));
    let layers = json["layers"].as_array().unwrap();
    let blur = layers.iter().find(|layer| layer["layer"] == "translucency.blur.caster0").unwrap();
    assert_eq!(
        (&blur["result"], &blur["pixels"], &blur["first"]["ulps"]),
        (&"differs".into(), &1.into(), &1.into())
    );
    assert_eq!((&blur["first"]["column"], &blur["first"]["row"]), (&(at % 32).into(), &(at / 32).into()));
    let distance = blur["first"]["b"].as_f64().unwrap() - blur["first"]["a"].as_f64().unwrap();
    assert_eq!(blur["largest"].as_f64(), Some(distance));
    let texels = 32.0 * 32.0;
    assert_eq!(blur["mean"].as_f64(), Some(distance / texels));
    assert_eq!(blur["rmse"].as_f64(), Some(distance / texels.sqrt()));
    assert_eq!(layers.iter().filter(|layer| layer["result"] == "same").count(), layers.len() - 2);
}

#[test]
fn an_array_names_its_indices_and_a_file_in_one_folder_is_a_difference() {
    let (_keep, a, b) = dumps();
    let path = b.join("knot.translucency.matrices.npy");
    let mut array = file::read_npy(&path).unwrap();
    assert_eq!(array.shape, [2, 3, 4, 4]);
    let Data::F32(values) = &mut array.data else { panic!() };
    values[48 + 16 + 2 * 4 + 3] += 0.5;
    file::write_npy(&path, &array).unwrap();
    std::fs::remove_file(b.join("knot.translucency.projection.npy")).unwrap();
    file::write_npy(&b.join("more.npy"), &Buffer::f32(&[1], vec![0.0])).unwrap();
    let (status, out, _) = diff(&a, &b, &[]);
    assert_eq!(status, Some(1));
    assert!(
        out.contains("knot.translucency.matrices: largest 5.000e-1") && out.contains("first [1, 1, 2, 3]: "),
        "{out}"
    );
    assert!(out.contains("only in A knot.translucency.projection.npy"), "{out}");
    assert!(out.contains("only in B more.npy"), "{out}");
    assert!(out.ends_with(" 3 not; translucency.matrices diverges first\n"), "{out}");
    let flat = Buffer::f32(&[6, 4, 4], array.as_f32().to_vec());
    file::write_npy(&path, &Buffer::f32(&[6, 16], array.as_f32().to_vec())).unwrap();
    let other = b.join("flat.npy");
    file::write_npy(&other, &flat).unwrap();
    let (status, out, _) = diff(&other, &path, &[]);
    assert_eq!(status, Some(1));
    assert!(out.contains("an array of shape [6, 4, 4] in A, an array of shape [6, 16] in B"), "{out}");
}

#[test]
fn other_sizes_channels_types_and_layers_are_differences_and_named() {
    let (_keep, a, b) = dumps();
    change(&b.join("knot.exr"), |layers| {
        let find = |name: &str| layers.iter().position(|layer| layer.name == name).unwrap();
        let [size, channels, types, gone] = [
            "translucency.direct.light0",
            "translucency.final",
            "translucency.gbuffer",
            "translucency.vbuffer",
        ]
        .map(find);
        let picture = &mut layers[size];
        (picture.width, picture.height) = (picture.height, picture.width);
        layers[channels].channels[0].name = "A".into();
        let count = 24 * 16;
        layers[types].channels[0].data = Data::U32(vec![0; count]);
        layers.remove(gone);
        layers.push(single("mine", &[("Y", vec![0.0; 4])]));
    });
    let (status, out, _) = diff(&a.join("knot.exr"), &b.join("knot.exr"), &[]);
    assert_eq!(status, Some(1));
    for line in [
        "mismatch  translucency.direct.light0: 24 x 16 in A, 16 x 24 in B",
        "mismatch  translucency.final: channels B G R in A, A G R in B",
        "mismatch  translucency.gbuffer: channel depth is f32 in A, u32 in B",
        "only in A translucency.vbuffer",
        "only in B mine",
    ] {
        assert!(out.lines().any(|found| found == line), "{line}\n{out}");
    }
    assert!(out.ends_with(" 5 not; translucency.gbuffer diverges first\n"), "{out}");
}

#[test]
fn a_tolerance_leaves_out_what_is_within() {
    let (_keep, a, b) = dumps();
    change(&b.join("knot.exr"), |layers| {
        values(layers, "translucency.final", "R")[3] += 0.25;
        values(layers, "translucency.final", "G")[5] += 0.75;
    });
    let (a, b) = (a.join("knot.exr"), b.join("knot.exr"));
    let (status, out, _) = diff(&a, &b, &["--tolerance", "0.5"]);
    assert_eq!(status, Some(1));
    assert!(out.contains("1 pixels differ, first pixel (5, 0), channel G"), "{out}");
    let (status, out, _) = diff(&a, &b, &["--tolerance", "1"]);
    assert_eq!(status, Some(0));
    assert!(
        out.contains("same      translucency.final: largest 7.500e-1"),
        "what is within still shows: {out}"
    );
}

#[test]
fn a_nan_of_a_foreign_dump_differs_and_is_counted() {
    let base = tempfile::tempdir().unwrap();
    let [a, b] = ["a.exr", "b.exr"].map(|name| base.path().join(name));
    let colour = |r: [f32; 4]| single("t", &[("R", r.to_vec()), ("G", vec![1.0; 4])]);
    file::write_exr(&a, &[colour([0.0, 1.0, 2.0, 3.0])]).unwrap();
    file::write_exr(&b, &[colour([0.0, 1.0, f32::NAN, f32::INFINITY])]).unwrap();
    let (status, out, _) = diff(&a, &b, &["--tolerance", "9", "-o", base.path().to_str().unwrap()]);
    assert_eq!(status, Some(1));
    assert!(
        out.contains(
            "; 2 values are not finite; 2 pixels differ, first pixel (0, 1), channel R: 2.0 in A, NaN in B"
        ),
        "{out}"
    );
    let json: Json = serde_json::from_str(&diff(&a, &b, &["--json"]).1).unwrap();
    assert_eq!(
        (&json["layers"][0]["not_finite"], &json["layers"][0]["first"]["b"]),
        (&2.into(), &"NaN".into())
    );
    assert_eq!(diff(&b, &b, &[]).0, Some(0), "the same NaN is the same");
    let picture = image::open(base.path().join("a.t.difference.png")).unwrap().into_rgb8();
    assert_eq!([[0, 0], [0, 1]].map(|[x, y]| picture.get_pixel(x, y).0), [[40; 3], [255, 255, 0]]);
}

#[test]
fn a_foreign_file_without_names_is_paired_and_the_order_of_channels_does_not_matter() {
    let base = tempfile::tempdir().unwrap();
    let [a, b] = ["a.exr", "b.exr"].map(|name| base.path().join(name));
    let (red, green) = (("R", vec![1.0, 2.0, 3.0, -0.0]), ("G", vec![5.0; 4]));
    file::write_exr(&a, &[single("translucency.final", &[red.clone(), green.clone()])]).unwrap();
    file::write_exr(&b, &[single("", &[green, ("R", vec![1.0, 2.0, 3.0, 0.0])])]).unwrap();
    for (a, b) in [(&a, &b), (&b, &a)] {
        let (status, out, _) = diff(a, b, &[]);
        assert!(status == Some(0) && out.contains("same      translucency.final\n"), "{out}");
    }
    file::write_exr(&a, &[single("t.a", std::slice::from_ref(&red)), single("t.b", &[red])]).unwrap();
    let (status, out, _) = diff(&a, &b, &[]);
    assert_eq!(
        (status, out.matches("only in").count()),
        (Some(1), 3),
        "two layers and none of that name: {out}"
    );
}

#[test]
fn what_cannot_be_read_is_status_2_and_named() {
    let (_keep, a, b) = dumps();
    let broken = b.join("knot.exr");
    let whole = std::fs::read(&broken).unwrap();
    std::fs::write(&broken, &whole[..whole.len() / 2]).unwrap();
    let empty = b.join("empty");
    std::fs::create_dir(&empty).unwrap();
    let array = b.join("knot.translucency.matrices.npy");
    std::fs::write(&array, b"no array").unwrap();
    let file = a.join("knot.exr");
    let nowhere = PathBuf::from("nowhere.exr");
    let cases: [(&Path, &Path, &str); 6] = [
        (&a, &b, "knot.exr"),
        (&file, &broken, "b/knot.exr"),
        (&file, &nowhere, "nowhere.exr"),
        (&file, &b, "compare two files or two folders"),
        (&a, &empty, "has no .exr and no .npy file"),
        (&array, &array, "is no .npy file"),
    ];
    for (a, b, part) in cases {
        let (status, _, err) = diff(a, b, &[]);
        assert_eq!(status, Some(2), "{err}");
        assert!(err.contains(part) && err.contains("; "), "{part}: {err}");
    }
    let (status, _, err) = diff(&a, &a, &["--tolerance", "-1"]);
    assert!(status == Some(2), "{err}");
}
