//! Files that are missing, cut off, empty, enormous, or of another kind than they say.

use super::{Place, SCENE, assert_refused, bitlight, command};
use bitlight::store::file;
use std::fs::File;
use std::process::Stdio;

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// A file longer than any that is read, which takes no room on the disk.
fn sparse(place: &Place, name: &str) -> String {
    File::create(place.path(name)).unwrap().set_len(5 << 30).unwrap();
    place.path(name)
}

#[test]
fn every_reader_names_a_file_that_it_cannot_read() {
    let place = Place::new(SCENE);
    for ending in ["obj", "hdr", "exr", "toml", "json"] {
        let call = |file: &str| match ending {
            "toml" => bitlight(&["render", file, "-o", &place.path("out")]),
            "json" => bitlight(&["sh", "rotate", file]),
            _ => bitlight(&["info", file]),
        };
        let name = |what: &str| format!("{what}.{ending}");
        assert_refused(&call(&place.path(&name("missing"))), &[&name("missing"), "No such file"], ending);
        std::fs::create_dir(place.path(&name("folder"))).unwrap();
        assert_refused(&call(&place.path(&name("folder"))), &[&name("folder"), "directory"], ending);
        assert_refused(&call(&place.write(&name("empty"), "")), &[&name("empty")], ending);
        assert_refused(
            &call(&place.write(&name("noise"), [0x93, 0, 0xff, b'\n'].repeat(999))),
            &[&name("noise")],
            ending,
        );
        assert_refused(&call(&sparse(&place, &name("sparse"))), &[&name("sparse"), "longer than"], ending);
    }
    assert_eq!(place.out(), [""; 0]);
}

#[test]
fn a_file_that_never_ends_is_read_to_the_limit_alone() {
    let place = Place::new(SCENE);
    for arguments in [&["render", "/dev/zero", "-o", &place.path("out")][..], &["sh", "rotate", "/dev/zero"]]
    {
        assert_refused(&bitlight(arguments), &["/dev/zero", "longer than"], "/dev/zero");
    }
}

#[test]
fn a_golden_is_read_with_the_same_care() {
    let place = Place::new(SCENE);
    let (scene, golden) = (place.path("a.toml"), place.path(""));
    let verify = || bitlight(&["verify", &scene, "--golden", &golden]);
    std::fs::create_dir(place.path("a.json")).unwrap();
    assert_refused(&verify(), &["a.json", "directory", "version control"], "a folder");
    std::fs::remove_dir(place.path("a.json")).unwrap();
    for noise in [
        &b"\xff\xfe"[..],
        b"",
        b"{}",
        b"[[[[",
        b"{\"set\": 5}",
        b"{\"set\": [], \"settings\": {}, \"passes\": [{}]}",
    ] {
        place.write("a.json", noise);
        assert_refused(&verify(), &["a.json", "is no golden manifest", "version control"], "noise");
    }
    // Digests shorter than any, as a hand might leave them.
    place.write(
        "a.json",
        r#"{"set": [], "settings": {}, "pixels": false, "passes": [
        {"name": "translucency.cubemap", "shape": [1], "type": "f32", "digest": "é"}]}"#,
    );
    let blessed = bitlight(&["bless", &scene, "--golden", &golden, "--reason", "a test"]);
    assert!(blessed.status.success(), "{}", super::stderr(&blessed));
    for nowhere in ["..", "/", "."] {
        let output = bitlight(&["verify", nowhere, "--golden", &place.path("golden")]);
        assert_refused(&output, &["cannot be read"], nowhere);
    }
}

#[test]
fn golden_pixels_of_another_shape_or_type_are_damaged_not_compared() {
    use bitlight::pass::Buffer;
    let place = Place::new(SCENE);
    let (scene, golden) = (place.path("a.toml"), place.path(""));
    let blessed = bitlight(&["bless", &scene, "--golden", &golden, "--pixels", "--reason", "a test"]);
    assert!(blessed.status.success(), "{}", super::stderr(&blessed));
    let manifest = std::fs::read_to_string(place.path("a.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&manifest).unwrap();
    // A digest that differs makes the pixels be looked at.
    let other = |name: &str| {
        let mut json = json.clone();
        for pass in json["passes"].as_array_mut().unwrap() {
            if pass["name"] == name {
                pass["digest"] = "0".repeat(64).into();
            }
        }
        place.write("a.json", json.to_string());
    };
    let verify = || bitlight(&["verify", &scene, "--golden", &golden, "-o", &place.path("out")]);
    let file = place.0.path().join("a/translucency.matrices.npy");
    for wrong in [Buffer::u32(&[1, 3, 4, 4], vec![0; 48]), Buffer::f32(&[2], vec![0.0; 2])] {
        file::write_npy(&file, &wrong).unwrap();
        other("translucency.matrices");
        assert_refused(&verify(), &["matrices.npy", "does not fit its manifest"], "npy");
    }
    let file = place.0.path().join("a/passes.exr");
    let mut layers = file::read_exr(&file).unwrap();
    for layer in &mut layers {
        layer.channels.remove(0);
    }
    layers.retain(|layer| !layer.channels.is_empty());
    file::write_exr(&file, &layers).unwrap();
    other("translucency.cubemap");
    assert_refused(&verify(), &["passes.exr", "does not fit its manifest"], "exr");
}

#[test]
fn a_text_that_is_not_utf8_is_refused_by_its_line() {
    let place = Place::new(SCENE);
    place.write("a.toml", [SCENE.as_bytes(), b"# gr\xfc\xdfe\n"].concat());
    let line = format!("a.toml:{}: ", SCENE.lines().count() + 1);
    assert_refused(&place.render(&[]), &[&line, "is not UTF-8", "save the scene as UTF-8"], "Latin-1");
    place.write("a.toml", SCENE.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<_>>());
    assert_refused(&place.render(&[]), &["a.toml:1: "], "UTF-16");
    place.write("a.toml", format!("\u{feff}{}", SCENE.replace('\n', "\r\n")));
    assert!(place.render(&[]).status.success(), "a byte-order mark and CRLF are text");
}

#[test]
fn meshes_that_are_none_are_refused_by_line() {
    let place = Place::new(&SCENE.replace("shape = \"cuboid\"\nresolution = 3", "file = \"a.obj\""));
    let cases: [(&str, &str); 10] = [
        ("", "no triangle"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no triangle"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "a.obj:4: "),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "a.obj:4: "),
        ("v 0 0 0\nv 1 0 nan\n", "a.obj:2: "),
        ("v 0 0 0\nv 1 0 1e39\n", "a.obj:2: "),
        ("v 0 0 0\nv 1 0\n", "a.obj:2: "),
        ("v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\nf 1 1 2\n", "no triangle of the mesh has an area"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", "a.obj:4: "),
        ("v 0 0 1e-30\nv 1e-30 0 0\nv 0 1e-30 0\nf 1 2 3\n", "solid.size"),
    ];
    for (text, part) in cases {
        place.write("a.obj", text);
        assert_refused(&place.render(&[]), &[part], text);
    }
    assert_eq!(place.out(), [""; 0], "a refused render leaves no file");
}

#[test]
fn environments_that_are_none_are_refused() {
    let place = Place::new(&SCENE.replace(
        "kind = \"point\"\nposition = [0, 3, 3]\nintensity = [9, 9, 9]",
        "kind = \"environment\"\nfile = \"a.hdr\"",
    ));
    let map = |size: &str, texels: &[u8]| [format!("#?RADIANCE\n\n{size}\n").as_bytes(), texels].concat();
    let cases: [(Vec<u8>, &str); 6] = [
        (map("-Y 2 +X 2", &[9, 9, 9, 128].repeat(3)), "no Radiance HDR image"),
        (map("-Y 0 +X 2", &[]), "has no texel"),
        (map("-Y 99999 +X 99999", &[9; 64]), "is over"),
        (map("-Y 99999999999999999999 +X 2", &[9; 64]), "no Radiance HDR image"),
        (map("+Y 2 -X 2", &[9; 64]), "no Radiance HDR image"),
        (b"\x89PNG\r\n\x1a\n and so on".to_vec(), "no Radiance HDR image"),
    ];
    for (bytes, part) in cases {
        place.write("a.hdr", &bytes);
        assert_refused(&place.render(&[]), &["a.hdr", part], &String::from_utf8_lossy(&bytes));
    }
    place.write("a.hdr", map("-Y 1 +X 1", &[255, 255, 255, 255]));
    let brightest = place.render(&[]);
    assert_refused(&brightest, &["light[0].scale", "brighter than numbers go"], "the brightest texel");
    place.write("a.hdr", map("-Y 1 +X 1", &[255, 255, 255, 240]));
    let bright = place.render(&[]);
    assert!(bright.status.success(), "{}", super::stderr(&bright));
    let bright = place.render(&["--set", "light[0].scale=1e12"]);
    assert_refused(&bright, &["light[0].scale", "brighter than numbers go"], "an infinite environment");
}

#[test]
fn coefficients_that_are_none_are_refused() {
    let place = Place::new(SCENE);
    let good = r#"{"bands": 1, "convention": "bitlight", "coefficients": [[1, 1, 1]]}"#;
    let file = place.write("good.json", good);
    assert!(bitlight(&["sh", "rotate", &file]).status.success());
    let cases: Vec<(String, &str)> = vec![
        ("[1, 2]".into(), "has no array"),
        ("null".into(), "has no array"),
        (good.replace('}', ""), "is no JSON"),
        (good.replace("1, 1, 1", "1, 1"), "coefficients[0]"),
        (good.replace("1, 1, 1", "1, null, 1"), "coefficients[0]"),
        (good.replace("1, 1, 1", "1, NaN, 1"), "is no JSON"),
        (good.replace("1, 1, 1", "1, 1e999, 1"), "is no JSON"),
        (good.replace("\": 1", "\": -1"), "\"bands\""),
        (good.replace("\": 1", "\": 18446744073709551615"), "bands"),
        (good.replace("\": 1", "\": 33"), "1 to 32"),
        (good.replace("\": 1", "\": 2"), "2 bands have 4"),
        (good.replace("\"bitlight\"", "\"bitligth\""), "did you mean"),
        (format!("{}{}", "[".repeat(100_000), "]".repeat(100_000)), "is no JSON"),
    ];
    for (text, part) in &cases {
        let file = place.write("bad.json", text);
        let what = text.chars().take(99).collect::<String>();
        assert_refused(&bitlight(&["sh", "eval", &file, "--direction", "0,0,1"]), &["bad.json", part], &what);
    }
    let file = place.write("huge.json", good.replace("bitlight", "4pi").replace("1, 1, 1", "1.7e308, 1, 1"));
    let output = bitlight(&["sh", "rotate", &file, "--to", "bitlight"]);
    assert_refused(&output, &["beyond the range of numbers"], "an overflow");
    for degrees in ["nan", "inf", "1e400"] {
        let output = bitlight(&["sh", "rotate", &place.path("good.json"), "--degrees", degrees]);
        assert_eq!(output.status.code(), Some(2), "{degrees}: {}", super::stderr(&output));
    }
    for direction in ["0,0,0", "nan,0,1", "1,2", "inf,0,0", "1e-200,0,0", "1,2,3,4", ""] {
        let output = bitlight(&["sh", "eval", "--direction", direction]);
        assert_eq!(output.status.code(), Some(2), "{direction}: {}", super::stderr(&output));
    }
}

#[test]
fn an_asset_must_be_a_plain_file() {
    let place = Place::new(&SCENE.replace("shape = \"cuboid\"\nresolution = 3", "file = \"a.obj\""));
    std::fs::create_dir(place.path("a.obj")).unwrap();
    assert_refused(&place.render(&[]), &["a.obj", "there is no such asset", "--assets"], "a folder");
    for name in ["", "..", "/", "/dev/zero", "a\\u0000b"] {
        let set = format!("solid.file=\"{name}\"");
        assert_refused(&place.render(&["--set", &set]), &["there is no such asset"], name);
    }
    std::fs::remove_dir(place.path("a.obj")).unwrap();
    place.write("a.obj", TRIANGLE);
    assert!(place.render(&[]).status.success());
}

#[test]
fn dumps_that_are_none_are_refused_not_different() {
    let place = Place::new(SCENE);
    assert!(place.render(&["--passes", "all"]).status.success());
    let good = place.path("out/a.exr");
    let array = place.path("out/a.translucency.matrices.npy");
    let (image, numbers) = (std::fs::read(&good).unwrap(), std::fs::read(&array).unwrap());
    let cut = place.write("cut.exr", &image[..image.len() / 2]);
    assert_refused(
        &bitlight(&["diff", &good, &cut]),
        &["cut.exr", "see whether the file is whole"],
        "half an EXR",
    );
    let cut = place.write("cut.npy", &numbers[..numbers.len() - 1]);
    assert_refused(&bitlight(&["diff", &array, &cut]), &["cut.npy", "more or fewer values"], "a cut array");
    let out = place.path("out");
    assert_refused(
        &bitlight(&["diff", &out, &good]),
        &["out", "two files or two folders"],
        "a folder and a file",
    );
    assert_refused(&bitlight(&["diff", &out, &place.path("nowhere")]), &["nowhere"], "nothing");
    assert_refused(&bitlight(&["diff", &good, &good, "--tolerance", "nan"]), &["--tolerance"], "no distance");
    assert_refused(&bitlight(&["diff", &good, &place.path("a.toml")]), &["a.toml"], "a scene");
}

/// The texts that people redirect: a full disk behind standard output is an error, a closed pipe is none.
#[test]
fn standard_output_that_refuses_is_told() {
    if !std::path::Path::new("/dev/full").exists() {
        super::skip("a full standard output", "this system has no /dev/full");
        return;
    }
    let full = || Stdio::from(File::options().write(true).open("/dev/full").unwrap());
    let output = command().args(["passes"]).stdout(full()).stderr(Stdio::piped()).output().unwrap();
    assert_refused(&output, &["cannot print", "No space left"], "/dev/full");
}
