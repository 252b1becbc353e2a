//! The command as a person meets it: files, exit status, messages.
#![cfg(feature = "cli")]

use bitlight::store::file;
use bitlight::techniques::{self, translucency};
use serde_json::Value as Json;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const KNOT: &str = "scenes/translucency/knot.toml";
/// A knot that renders in a blink.
const SMALL: [&str; 10] = [
    "--set",
    "image.width=24",
    "--set",
    "image.height=16",
    "--set",
    "solid.resolution=6",
    "--set",
    "translucency.shadow=32",
    "--set",
    "translucency.cubemap=8",
];

fn bitlight(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bitlight"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).env_remove("BITLIGHT_ASSETS").args(arguments);
    command.output().unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn folder() -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().to_string_lossy().into_owned();
    (folder, path)
}

fn render(out: &str, more: &[&str]) -> Output {
    bitlight(&[&["render", KNOT, "-o", out], &SMALL[..], more].concat())
}

fn report(out: &str) -> Json {
    serde_json::from_slice(&std::fs::read(Path::new(out).join("knot.json")).unwrap()).unwrap()
}

fn passes(report: &Json) -> Vec<&str> {
    report["passes"].as_array().unwrap().iter().map(|pass| pass["name"].as_str().unwrap()).collect()
}

#[test]
fn render_writes_what_it_says_and_runs_no_more_than_needed() {
    let (_keep, out) = folder();
    let output = render(&out, &["--passes", "shadow,translucency.blur"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let report = report(&out);
    assert_eq!(passes(&report), ["translucency.shadow", "translucency.blur"]);
    assert_eq!(report["passes"][0]["shape"], serde_json::json!([1, 32, 32, 3]));
    assert_eq!(report["passes"][0]["type"], "f32");
    assert_eq!(report["passes"][0]["digest"].as_str().unwrap().len(), 64);
    assert!(report["passes"][0]["seconds"].as_f64().unwrap() >= 0.0);
    assert_eq!((&report["scene"], &report["settings"]["translucency.shadow"]), (&KNOT.into(), &32.into()));
    let layers = file::read_exr(&Path::new(&out).join("knot.exr")).unwrap();
    let names: Vec<_> = layers.iter().map(|layer| layer.name.as_str()).collect();
    assert_eq!(names, ["translucency.shadow.caster0", "translucency.blur.caster0"]);
}

#[test]
fn all_passes_come_as_exr_npy_png_and_json() {
    let (_keep, out) = folder();
    let output = render(&out, &["--passes", "all", "--threads", "2"]);
    assert!(output.status.success(), "{}", stderr(&output));
    for line in stdout(&output).lines().filter(|line| !line.ends_with("in passes")) {
        assert!(Path::new(line).is_file(), "{line} was announced");
    }
    let known: Vec<_> = translucency::TECHNIQUE.passes.iter().map(|info| info.name).collect();
    assert_eq!(passes(&report(&out)), known);
    let file = |name: &str| Path::new(&out).join(name);
    let matrices = file::read_npy(&file("knot.translucency.matrices.npy")).unwrap();
    assert_eq!(matrices.shape, [2, 3, 4, 4]);
    let layers = file::read_exr(&file("knot.exr")).unwrap();
    assert_eq!(layers[0].name, "translucency.final", "viewers show the first part");
    assert!(file("knot.png").is_file() && file("knot.passes.png").is_file());
}

#[test]
fn exposure_brightens_the_preview_alone() {
    let (_keep, out) = folder();
    let file = |name: &str| std::fs::read(Path::new(&out).join(name)).unwrap();
    assert!(render(&out, &[]).status.success());
    let (picture, values) = (file("knot.png"), file("knot.exr"));
    assert!(render(&out, &["--set", "image.exposure=2"]).status.success());
    assert!(file("knot.png") != picture && file("knot.exr") == values);
}

#[test]
fn the_default_is_the_picture_and_leaves_out_nothing_that_it_needs() {
    let (_keep, out) = folder();
    assert!(render(&out, &[]).status.success());
    let layers = file::read_exr(&Path::new(&out).join("knot.exr")).unwrap();
    assert_eq!(layers.len(), 1);
    let report = report(&out);
    let ran = passes(&report);
    let idle: Vec<_> = translucency::TECHNIQUE
        .passes
        .iter()
        .map(|info| info.name)
        .filter(|name| !ran.contains(name))
        .collect();
    assert_eq!(idle, ["translucency.held"], "final needs every pass but the mask");
}

const WAVE: [&str; 4] = ["--set", "wave.amplitude=3", "--set", "wave.length=20"];

#[test]
fn a_sequence_is_its_frames_one_by_one() {
    let (_keep, out) = folder();
    let output = render(&out, &[&WAVE[..], &["--frames", "0..3", "--passes", "all"]].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    let mut pictures = Vec::new();
    for number in 0..3 {
        let (_keep, single) = folder();
        let time = format!("time={}", f64::from(number) / 24.0);
        let one = render(&single, &[&WAVE[..], &["--set", &time, "--passes", "all"]].concat());
        assert!(one.status.success(), "{}", stderr(&one));
        let names = |folder: &str| {
            let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name());
            entries.map(|name| name.into_string().unwrap()).collect::<std::collections::BTreeSet<_>>()
        };
        let frame = format!("knot.{number:04}.");
        for name in names(&single) {
            let (theirs, ours) =
                (Path::new(&single).join(&name), Path::new(&out).join(name.replacen("knot.", &frame, 1)));
            assert!(stdout(&output).contains(&*ours.to_string_lossy()), "{} is announced", ours.display());
            if !name.ends_with("json") {
                assert!(
                    std::fs::read(theirs).unwrap() == std::fs::read(&ours).unwrap(),
                    "{}",
                    ours.display()
                );
                continue;
            }
            // All but the seconds.
            let read = |path: &Path| {
                let mut json: Json = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
                for pass in json["passes"].as_array_mut().unwrap() {
                    pass.as_object_mut().unwrap().remove("seconds");
                }
                json
            };
            assert_eq!(read(&theirs), read(&ours));
        }
        let all = names(&out).into_iter().filter(|name| name.starts_with(&frame)).count();
        assert_eq!(all, names(&single).len(), "of frame {number}");
        pictures.push(std::fs::read(Path::new(&out).join(format!("{frame}exr"))).unwrap());
    }
    assert!(pictures[0] != pictures[1] && pictures[1] != pictures[2], "the solid moves");
}

#[test]
fn a_sequence_without_a_frame_or_with_a_bad_one_is_refused() {
    let (_keep, out) = folder();
    for (frames, part) in [
        ("0..0", "no frame"),
        ("3..1", "no frame"),
        ("3", "two whole numbers"),
        ("-1..2", "two whole numbers"),
    ] {
        let output = render(&out, &[&format!("--frames={frames}")]);
        assert_eq!(output.status.code(), Some(2), "{frames}");
        assert!(stderr(&output).contains(part) && stderr(&output).contains("0..3"), "{}", stderr(&output));
    }
    assert_eq!(std::fs::read_dir(&out).unwrap().count(), 0);
    // A crest of the wave meets the light, at x = -24 + 60 sin 2π(-36/144 + t): when it stands there.
    let wave = ["wave.amplitude=24", "wave.length=144", "light[0].position=[-24,0,0]", "frame_rate=4"];
    let set: Vec<_> = wave.iter().flat_map(|set| ["--set", set]).collect();
    let output = render(&out, &[&set[..], &["--frames", "2..5"]].concat());
    assert_eq!(output.status.code(), Some(2), "{}", stdout(&output));
    assert!(stderr(&output).contains("light[0].position: frame 3: "), "{}", stderr(&output));
    assert!(Path::new(&out).join("knot.0002.json").is_file(), "the frame before it stays");
}

#[test]
fn bad_input_is_status_2_and_a_message_that_helps() {
    let (_keep, out) = folder();
    let missing = "scenes/translucency/knto.toml";
    let cases: [(&[&str], &[&str]); 10] = [
        (&["render", missing], &["knto.toml", "bitlight init"]),
        (&["render", KNOT, "-o", &out, "--set", "camera.foov=30"], &["camera.foov", "did you mean fov?"]),
        (&["render", KNOT, "-o", &out, "--passes", "finale"], &["\"finale\"", "did you mean \"final\"?"]),
        (
            &["render", KNOT, "-o", &out, "--set", "light[0].position=[0,0,0]"],
            &["light[0].position", "inside"],
        ),
        (
            &["render", "scenes/assets/translucency/buddha.toml", "-o", &out],
            &["stanford/buddha.obj", "--assets DIR"],
        ),
        (&["render", KNOT, "-o", "/proc/none"], &["/proc/none", "-o"]),
        (&["render", KNOT, "-o", &out, "--threads", "100000"], &["100000 threads", "at most 1024"]),
        (&["passes", "fur"], &["\"fur\"", "translucency"]),
        (&["init", "fur"], &["\"fur\"", "translucency"]),
        (&["sh", "project", "grase"], &["did you mean \"grace\"?"]),
    ];
    for (arguments, parts) in cases {
        let output = bitlight(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        for part in parts {
            assert!(stderr(&output).contains(part), "{arguments:?} said {}", stderr(&output));
        }
    }
    assert_eq!(bitlight(&["rendre"]).status.code(), Some(2));
    assert_eq!(std::fs::read_dir(&out).map_or(0, Iterator::count), 0, "a refused render leaves no file");
}

/// A golden of the small knot in a folder of its own.
fn bless(golden: &str, scene: &str, more: &[&str]) -> Output {
    let mut arguments = vec!["bless", scene, "--golden", golden, "--pixels"];
    arguments.extend(SMALL.iter().copied().chain(more.iter().copied()));
    bitlight(&arguments)
}

/// A copy of the knot's scene with one word changed, in a folder `scenes`.
fn changed(folder: &str, from: &str, to: &str) -> String {
    let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(KNOT)).unwrap();
    assert!(text.contains(from));
    let path = PathBuf::from(folder).join("scenes/knot.toml");
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(&path, text.replace(from, to)).unwrap();
    path.to_string_lossy().into_owned()
}

#[test]
fn verify_passes_a_golden_and_names_the_first_pixel_of_a_fault() {
    let (_keep, base) = folder();
    let golden = format!("{base}/golden");
    let scene = changed(&base, "fov", "fov");
    let missing = bitlight(&["verify", &scene, "--golden", &golden]);
    assert_eq!(missing.status.code(), Some(1), "a missing golden fails");
    assert!(stdout(&missing).contains("bitlight bless"));

    assert!(bless(&golden, &scene, &["--reason", "the first"]).status.success());
    let same = bitlight(&["verify", &scene, "--golden", &golden]);
    assert!(
        same.status.success() && stdout(&same).contains("1 passed, 0 failed, 0 skipped"),
        "{}",
        stdout(&same)
    );

    // One value of one pixel in the kept pixels, and its digest in the manifest, as if the code had changed.
    let exr = format!("{golden}/knot/passes.exr");
    let mut layers = file::read_exr(Path::new(&exr)).unwrap();
    let blur = layers.iter_mut().find(|layer| layer.name == "translucency.blur.caster0").unwrap();
    let bitlight::pass::Data::F32(values) = &mut blur.channels[0].data else { panic!() };
    let at = values.iter().position(|value| *value > 0.0).unwrap();
    values[at] = values[at].next_up();
    let place = format!("pixel ({}, {})", at % 32, at / 32);
    file::write_exr(Path::new(&exr), &layers).unwrap();
    let manifest = format!("{golden}/knot.json");
    let mut json: Json = serde_json::from_slice(&std::fs::read(&manifest).unwrap()).unwrap();
    for pass in json["passes"].as_array_mut().unwrap() {
        if pass["name"] == "translucency.blur" {
            pass["digest"] = "0".repeat(64).into();
        }
    }
    std::fs::write(&manifest, json.to_string()).unwrap();
    let fault = bitlight(&["verify", &scene, "--golden", &golden, "-o", &base]);
    let text = stdout(&fault);
    assert_eq!(fault.status.code(), Some(1));
    assert!(text.contains("translucency.blur differs first"), "{text}");
    assert!(text.contains(&place) && text.contains("(1 ULP)") && text.contains("1 pixels differ"), "{text}");
    assert!(Path::new(&base).join("knot.translucency.blur.caster0.difference.png").is_file());
}

#[test]
fn bless_keeps_why_and_what_and_a_changed_scene_is_told_from_changed_code() {
    let (_keep, base) = folder();
    let golden = format!("{base}/golden");
    let scene = changed(&base, "fov", "fov");
    assert_eq!(bless(&golden, &scene, &["--reason", " "]).status.code(), Some(2), "a reason is needed");
    assert!(bless(&golden, &scene, &["--reason", "the first"]).status.success());
    assert!(stdout(&bless(&golden, &scene, &["--reason", "again"])).contains("nothing has changed"));

    changed(&base, "fov = 30", "fov = 31");
    let moved = bitlight(&["verify", &scene, "--golden", &golden]);
    assert_eq!(moved.status.code(), Some(1));
    assert!(stdout(&moved).contains("camera.fov = 30, the scene has 31"), "{}", stdout(&moved));
    assert!(bitlight(&["bless", &scene, "--golden", &golden, "--reason", "a wider view"]).status.success());
    assert!(bitlight(&["verify", &scene, "--golden", &golden]).status.success());

    let history = std::fs::read_to_string(format!("{golden}/knot.history")).unwrap();
    let entries: Vec<_> = history.lines().filter(|line| !line.starts_with(' ')).collect();
    assert!(entries.len() == 2 && entries[0].ends_with("the first") && entries[1].ends_with("a wider view"));
    assert!(
        history.contains("translucency.gbuffer: ") && history.contains("settings: camera.fov"),
        "{history}"
    );
    assert_eq!(
        history.matches("translucency.cubemap").count(),
        1,
        "the cubemap does not see the camera: {history}"
    );
}

#[test]
fn a_scene_without_its_asset_is_reported_as_skipped() {
    let output = bitlight(&["verify", "scenes/assets/translucency/buddha.toml", "--assets", "/nowhere"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(stdout(&output).contains("skipped: /nowhere/stanford/buddha.obj"), "{}", stdout(&output));
    assert!(stdout(&output).contains("0 passed, 0 failed, 1 skipped"));
}

/// A file with one layer of four pixels.
fn four(path: &str, layer: &str, channels: &[(&str, [f32; 4])]) {
    use bitlight::pass::{Channel, Data, Layer};
    let channels = channels
        .iter()
        .map(|(name, values)| Channel { name: (*name).into(), data: Data::F32(values.to_vec()) });
    let layer = Layer { name: layer.into(), width: 4, height: 1, channels: channels.collect() };
    file::write_exr(Path::new(path), &[layer]).unwrap();
}

#[test]
fn join_puts_images_on_one_scale_and_their_difference_beside_them() {
    let (_keep, base) = folder();
    let [a, b, c, out] = ["a.exr", "b.exr", "c.exr", "out.png"].map(|name| format!("{base}/{name}"));
    // The greatest value of both is white; 0.05 apart is white twenty times over, 0.025 a half.
    four(
        &a,
        "t.b.light0",
        &[("R", [1.0, 0.5, 0.0, 0.2]), ("G", [1.0, 0.5, 0.0, 0.2]), ("B", [0.0, 0.5, 0.0, 0.2])],
    );
    four(
        &b,
        "t.b.light0",
        &[("R", [0.9, 0.5, 0.0, 0.25]), ("G", [1.0, 0.475, 0.0, 0.2]), ("B", [0.0, 0.5, 0.0, 0.2])],
    );
    let joined = bitlight(&["join", &format!("{a}:b"), &b, "--difference", "20", "-o", &out]);
    assert!(joined.status.success(), "{}", stderr(&joined));
    assert_eq!(stdout(&joined), format!("{out}\n"));
    let picture = image::open(&out).unwrap().into_rgb8();
    assert_eq!(picture.dimensions(), (3 * (4 + 12) + 12, 1 + 20 + 2 * 12));
    let row = |index: u32| (0..4).map(|x| picture.get_pixel(12 + index * 16 + x, 12).0).collect::<Vec<_>>();
    // 188, 183, 124 and 137 are the sRGB codes of 0.5, 0.475, 0.2 and 0.25.
    assert_eq!(row(0), [[255, 255, 0], [188; 3], [0; 3], [124; 3]]);
    assert_eq!(row(1), [[243, 255, 0], [188, 183, 188], [0; 3], [137, 124, 124]]);
    assert_eq!(row(2), [[255, 0, 0], [0, 188, 0], [0; 3], [255, 0, 0]]);
    // Another layer has a scale of its own, and one channel is grey.
    four(&c, "t.c", &[("Y", [8.0, 4.0, 0.0, -1.0])]);
    assert!(bitlight(&["join", &a, &format!("{c}:t.c"), "-o", &out]).status.success());
    let picture = image::open(&out).unwrap().into_rgb8();
    assert_eq!([0, 1, 2, 3].map(|x| picture.get_pixel(28 + x, 12).0), [[255; 3], [188; 3], [0; 3], [0; 3]]);

    let depth = format!("{base}/depth.exr");
    four(&depth, "t.g", &[("nx", [0.0; 4]), ("depth", [0.0; 4])]);
    std::fs::remove_file(&out).unwrap();
    let cases: [(&[&str], &str); 7] = [
        (&[&a, "--difference", "10"], "of two images"),
        (&[&a, &c, "--difference", "10"], "differ in size or channels"),
        (&[&a, &b, "--difference", "0"], "no gain"),
        (&[&format!("{a}:final")], "has no layer final; it has t.b.light0"),
        (&[&format!("{base}/none.exr")], "none.exr"),
        (&[&depth], "is no picture"),
        (&[&a, "--label", "a", "--label", "b"], "2 labels for 1 images"),
    ];
    for (arguments, part) in cases {
        let refused = bitlight(&[&["join", "-o", &out], arguments].concat());
        assert!(refused.status.code() == Some(2) && stderr(&refused).contains(part), "{}", stderr(&refused));
    }
    assert!(!Path::new(&out).exists(), "what is refused writes nothing");
}

#[test]
fn figures_say_what_they_need() {
    let figures = |argument: &str| {
        let mut command = Command::new("bash");
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/figures.sh");
        command.arg(script).arg(argument).env_remove("BITLIGHT_ASSETS").output().unwrap()
    };
    let help = figures("--help");
    assert!(help.status.success() && stdout(&help).contains("difference times 10"), "{}", stderr(&help));
    for (argument, part) in [("6", "set BITLIGHT_ASSETS to the folder"), ("4", "there is no figure 4")] {
        let refused = figures(argument);
        assert!(refused.status.code() == Some(2) && stderr(&refused).contains(part), "{}", stderr(&refused));
    }
}

#[test]
fn passes_lists_every_pass_with_its_equation() {
    let text = stdout(&bitlight(&["passes"]));
    for info in techniques::ALL.iter().flat_map(|technique| technique.passes) {
        assert!(text.contains(info.name) && text.contains(info.equation), "{}", info.name);
    }
    assert!(!stdout(&bitlight(&["passes", "prt"])).contains("translucency."));
}

#[test]
fn init_writes_a_scene_that_renders() {
    let (_keep, base) = folder();
    let scene = format!("{base}/mine.toml");
    for technique in techniques::ALL.iter().map(|technique| technique.name) {
        std::fs::write(&scene, bitlight(&["init", technique]).stdout).unwrap();
        let output = bitlight(&[&["render", &scene, "-o", &base, "--passes", "all"], &SMALL[..]].concat());
        assert!(output.status.success(), "{}", stderr(&output));
    }
}

#[test]
fn info_describes_an_image() {
    let (_keep, out) = folder();
    render(&out, &["--passes", "vbuffer"]);
    let text = stdout(&bitlight(&["info", &format!("{out}/knot.exr")]));
    assert!(text.contains("translucency.vbuffer (24 x 16)") && text.contains("u32"), "{text}");
    assert_eq!(bitlight(&["info", "Cargo.toml"]).status.code(), Some(2));
}

fn json(output: &Output) -> Json {
    assert!(output.status.success(), "{}", stderr(output));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn sh_projects_rotates_converts_and_evaluates() {
    let (_keep, base) = folder();
    let published = json(&bitlight(&["sh", "project", "grace", "--bands", "3"]));
    assert_eq!((&published["bands"], &published["convention"]), (&3.into(), &"bitlight".into()));
    let file = format!("{base}/grace.json");
    std::fs::write(&file, published.to_string()).unwrap();
    let number = |json: &Json, row: usize| json["coefficients"][row][0].as_f64().unwrap();
    assert!((number(&published, 0) - 0.78908).abs() < 1e-6);

    // A quarter turn about y takes x to -z: the coefficient of z becomes that of -x.
    let turned = json(&bitlight(&["sh", "rotate", &file, "--axis", "0,1,0", "--degrees", "90"]));
    assert!((number(&turned, 2) + number(&published, 3)).abs() < 1e-9, "{turned}");
    let phased = json(&bitlight(&["sh", "rotate", &file, "--to", "condon-shortley"]));
    assert_eq!(number(&phased, 3), -number(&published, 3));
    std::fs::write(format!("{base}/phased.json"), phased.to_string()).unwrap();

    let at =
        |file: &str| json(&bitlight(&["sh", "eval", file, "--direction", "1,-2,0.5"]))["radiance"].clone();
    assert_eq!(at(&file), at(&format!("{base}/phased.json")), "a function does not depend on its convention");
    let basis = json(&bitlight(&["sh", "eval", "--direction", "0,0,1", "--bands", "2"]));
    assert!((basis["basis"][2].as_f64().unwrap() - 0.488_602_511_9).abs() < 1e-9);

    std::fs::write(
        format!("{base}/short.json"),
        r#"{"bands": 2, "convention": "bitlight", "coefficients": [[1, 1, 1]]}"#,
    )
    .unwrap();
    let refused = bitlight(&["sh", "rotate", &format!("{base}/short.json")]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(stderr(&refused).contains("has 1 coefficients; 2 bands have 4"), "{}", stderr(&refused));
}

#[test]
fn goldens_are_small() {
    fn bytes(folder: &Path) -> u64 {
        let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
        entries
            .map(
                |entry| {
                    if entry.path().is_dir() { bytes(&entry.path()) } else { entry.metadata().unwrap().len() }
                },
            )
            .sum()
    }
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden");
    let total = bytes(&golden);
    assert!(total < 20 << 20, "golden/ has {total} bytes");
}
