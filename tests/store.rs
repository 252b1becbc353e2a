//! The store of a bake as processes meet it: killed, beside one another, damaged, refused.
#![cfg(feature = "cli")]

use bitlight::numeric::random::unit;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

const SCENE: &str = r#"technique = "prt"
frame_rate = 8
image = { width = 8, height = 8 }
camera = { position = [0, 0, 6] }
solid = { shape = "cuboid", resolution = 6 }
bend = { angle = 60 }
prt = { directions = 64, bounces = 1, poses = 8 }
light = [{ kind = "environment", radiance = [1, 1, 1] }]
"#;

struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        let place = Self(tempfile::tempdir().unwrap());
        std::fs::write(place.0.path().join("a.toml"), SCENE).unwrap();
        place
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn command(&self, store: &str, more: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_bitlight"));
        command.arg("bake").arg(self.path("a.toml")).arg("-o").arg(self.path(store)).args(more);
        command.env_remove("BITLIGHT_ASSETS").stdin(Stdio::null()).stdout(Stdio::null());
        command.arg("--threads=2").stderr(Stdio::piped());
        command
    }

    fn bake(&self, store: &str, more: &[&str]) -> Output {
        self.command(store, more).stdout(Stdio::piped()).output().unwrap()
    }

    fn check(&self, store: &str) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_bitlight"));
        command.args(["bake", "--check"]).arg(self.path(store)).output().unwrap()
    }

    fn bytes(&self, store: &str) -> BTreeMap<String, Vec<u8>> {
        files(&self.path(store))
    }
}

fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    let name = |entry: &std::fs::DirEntry| entry.file_name().into_string().unwrap();
    entries.map(|entry| (name(&entry), std::fs::read(entry.path()).unwrap())).collect()
}

/// What is baked, to the bit. Where it changes, so does the format in `store/manifest.rs`.
#[test]
fn a_store_of_this_format_has_these_bits() {
    let place = Place::new();
    let said = done(&place.bake("store", &["--poses", "0..2"]));
    assert!(said.contains("digest 9f9ffdf626d31d70"), "{said}");
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn done(output: &Output) -> String {
    assert!(output.status.success(), "{}", stderr(output));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn assert_refused(output: &Output, parts: &[&str]) {
    let text = stderr(output);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.starts_with("error: ") && text.lines().count() == 1 && text.contains("; "), "{text}");
    parts.iter().for_each(|part| assert!(text.contains(part), "{part:?} is not in {text}"));
}

#[test]
fn a_bake_that_is_killed_twenty_times_ends_in_the_same_bytes() {
    let place = Place::new();
    let begun = Instant::now();
    done(&place.bake("whole", &[]));
    let takes = begun.elapsed().as_micros() as f32;
    let whole = place.bytes("whole");
    assert_eq!(whole.len(), 3 + 8 * 2);
    let (mut kills, mut round, mut attempts) = (0, 0, 0);
    let mut torn = 0; // kills that left a file half written or a pose without its lines
    while kills < 20 || torn == 0 {
        let store = format!("store{round}");
        let mut child = place.command(&store, &[]).spawn().unwrap();
        // From before the first file to about the end.
        std::thread::sleep(Duration::from_micros((unit(5, attempts, 0, 0) * takes) as u64));
        attempts += 1;
        assert!(attempts < 2000, "a bake is over before it can be killed");
        if child.try_wait().unwrap().is_some() {
            assert_eq!(place.bytes(&store), whole, "finished in time");
            round += 1;
            continue;
        }
        child.kill().unwrap(); // SIGKILL
        child.wait().unwrap();
        kills += 1;
        if place.path(&store).join("manifest.json").exists() {
            done(&place.check(&store));
            let names: Vec<_> = place.bytes(&store).into_keys().collect();
            torn += usize::from(names.iter().any(|name| name.ends_with(".tmp")) || names.len() % 2 == 0);
        }
    }
    for round in 0..=round {
        done(&place.bake(&format!("store{round}"), &[]));
        assert_eq!(place.bytes(&format!("store{round}")), whole, "resumed, nothing left over");
    }
    println_past(&format!("{kills} kills in {attempts} bakes, {torn} of them amid a pose's files"));
}

/// Says so past the test harness, which would keep the output of a passing test to itself.
fn println_past(text: &str) {
    use std::io::Write;
    let mut screen = std::io::stderr();
    writeln!(screen, "{text}").unwrap();
}

#[test]
fn parts_one_after_the_other_or_at_the_same_time_are_the_whole() {
    let place = Place::new();
    done(&place.bake("whole", &[]));
    assert!(done(&place.bake("parts", &["--poses", "3..8"])).contains("5 baked; 5 poses"));
    assert!(done(&place.bake("parts", &["--poses", "0..4"])).contains("3 baked, 1 were there; 8 poses"));
    assert_eq!(place.bytes("parts"), place.bytes("whole"));
    assert!(done(&place.bake("parts", &[])).contains("0 baked, 8 were there"));
    // Overlapping, so that some poses are baked by both.
    for attempt in 0..3 {
        let store = format!("both{attempt}");
        let ranges = ["0..5", "3..8", "2..6"];
        let children = ranges.map(|poses| place.command(&store, &["--poses", poses]).spawn().unwrap());
        for child in children {
            let output = child.wait_with_output().unwrap();
            assert!(output.status.success(), "{}", stderr(&output));
        }
        assert_eq!(place.bytes(&store), place.bytes("whole"));
    }
    let threads = place.bake("threads", &["--set", "image.width=9", "--set", "camera.fov=20"]);
    done(&threads);
    assert_eq!(place.bytes("threads"), place.bytes("whole"), "the camera has no part in it");
}

#[test]
fn what_is_damaged_is_refused_by_name_and_repaired() {
    let place = Place::new();
    done(&place.bake("store", &["--poses", "0..2"]));
    let whole = place.bytes("store");
    let file = place.path("store/pose.0001.vectors.npy");
    let mut bytes = std::fs::read(&file).unwrap();
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    std::fs::write(&file, &bytes).unwrap();
    assert_refused(&place.check("store"), &["pose.0001.vectors.npy: has other values", "--repair"]);
    assert_refused(&place.bake("store", &["--poses", "0..2"]), &["pose.0001.vectors.npy", "--repair"]);
    std::fs::remove_file(&file).unwrap();
    assert_refused(&place.check("store"), &["pose.0001.vectors.npy: is not there"]);
    assert!(done(&place.bake("store", &["--poses", "0..2", "--repair"])).contains("1 baked, 1 were there"));
    assert_eq!(place.bytes("store"), whole);

    let manifest = place.path("store/manifest.json");
    for text in ["", "{}", "null", "[1]", "{\"poses\": [{}]}", "\u{fffd}"] {
        std::fs::write(&manifest, text).unwrap();
        assert_refused(&place.check("store"), &["manifest.json: is damaged, or no manifest"]);
        assert_refused(&place.bake("store", &[]), &["manifest.json"]);
        assert_eq!(std::fs::read(&manifest).unwrap(), text.as_bytes(), "nothing is written over it");
    }
    let deep = "[".repeat(100_000);
    std::fs::write(&manifest, deep).unwrap();
    assert_refused(&place.check("store"), &["manifest.json: is damaged"]);
    std::fs::remove_file(&manifest).unwrap();
    std::fs::create_dir(&manifest).unwrap();
    assert_refused(&place.bake("store", &[]), &["manifest.json"]);
}

#[test]
fn what_cannot_be_baked_is_refused_and_leaves_nothing() {
    let place = Place::new();
    done(&place.bake("store", &["--poses", "0..1"]));
    let whole = place.bytes("store");
    let other = place.bake("store", &["--set", "prt.bands=4"]);
    assert_refused(&other, &["manifest.json: was baked with prt.bands = 5, and the scene has 4", "-o"]);
    assert_eq!(place.bytes("store"), whole);
    // What such a surface does not read is no part of it.
    for set in ["surface.exponent=3", "material.gloss=3", "unit=mm", "light[0].radiance=[2,1,1]"] {
        done(&place.bake("store", &["--set", set, "--poses", "0..1"]));
    }
    assert_refused(
        &place.bake("store", &["--set", "surface.highlight=phong"]),
        &["was baked with surface.highlight = none, and the scene has phong"],
    );
    // Where light goes through the solid, what that is made of counts, and the unit in which it is given.
    let through = ["--poses=0..1", "--set=prt.subsurface=dipole"];
    done(&place.bake("through", &through));
    for (set, part) in [
        ("--set=material.eta=1.4", "baked with material.eta = nothing, and the scene has 1.4"),
        ("--set=unit=mm", "baked with unit = m, and the scene has mm"),
        ("--set=prt.subsurface=none", "baked with prt.subsurface = dipole, and the scene has none"),
    ] {
        assert_refused(&place.bake("through", &[&through[..], &[set]].concat()), &[part]);
    }
    done(&place.bake("through", &[&through[..], &["--set=material.gloss=3"]].concat()));
    // More poses belong to the same store.
    done(&place.bake("store", &["--set", "prt.poses=9", "--poses", "0..1"]));
    let bent = place.bake("none", &["--set", "bend.angle=3600", "--poses", "2..3"]);
    assert_refused(&bent, &["a.toml: bend.angle: pose 2: bends the solid into itself"]);
    assert_refused(
        &place.bake("never", &["--set", "technique=translucency"]),
        &["technique", "bakes nothing"],
    );
    assert_refused(&place.bake("never", &["--set", "light[0].kind=point"]), &["light[0]"]);
    assert_refused(
        &place.bake(
            "never",
            &[
                "--set",
                "solid.shape=sphere",
                "--set",
                "solid.resolution=1000",
                "--set",
                "surface.highlight=phong",
                "--set",
                "prt.bands=10",
            ],
        ),
        &["a.toml: prt.bands: the passes need", "over 8 GiB"],
    );
    assert!(!place.path("never").exists());
    for poses in ["3..3", "4..1", "a..b", "-1..2", "0..99999999999", "1"] {
        let output = place.bake("never", &[&format!("--poses={poses}")]);
        assert_eq!(output.status.code(), Some(2), "{poses}: {}", stderr(&output));
    }
    let many = place.bake("never", &["--poses", "0..4294967295"]);
    assert_refused(&many, &["4294967295 poses", "bake them in parts"]);
    assert_refused(&place.bake("a.toml", &[]), &["a.toml: cannot be made", "in the way"]);
    assert_refused(&place.check("never"), &["never: is no store"]);
    assert_refused(&place.check("a.toml"), &["a.toml"]);
    let far = done(&place.bake("far", &["--poses", "4294967294..4294967295"]));
    assert!(far.contains("pose 4294967294: "), "{far}");
}

impl Place {
    /// Renders into a folder; the digests of the passes that ran, by their names.
    fn render(&self, out: &str, more: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_bitlight"));
        command.arg("render").arg(self.path("a.toml")).arg("-o").arg(self.path(out)).args(more);
        command.env_remove("BITLIGHT_ASSETS").stdin(Stdio::null()).arg("--threads=2").output().unwrap()
    }

    fn digests(&self, file: &str) -> BTreeMap<String, String> {
        let report = std::fs::read_to_string(self.path(file)).unwrap();
        let report: serde_json::Value = serde_json::from_str(&report).unwrap();
        let text = |value: &serde_json::Value| value.as_str().unwrap().to_owned();
        let passes = report["passes"].as_array().unwrap().iter();
        passes.map(|pass| (text(&pass["name"]), text(&pass["digest"]))).collect()
    }
}

/// Surfaces of each kind: what is stored of each is another set of passes.
const KINDS: [&[&str]; 4] = [
    &[],
    &["--set=surface.highlight=phong", "--set=prt.bounces=0"],
    &["--set=surface.highlight=phong", "--set=prt.bands=3"],
    &["--set=prt.subsurface=dipole", "--set=surface.albedo=[0,0,0]", "--set=prt.bounces=0"],
];

#[test]
fn a_frame_from_a_store_has_the_digests_of_one_without() {
    for (number, kind) in KINDS.iter().enumerate() {
        let (place, store) = (Place::new(), format!("store{number}"));
        done(&place.bake(&store, &[kind, &["--poses", "2..4"][..]].concat()));
        let from = place.path(&store).to_string_lossy().into_owned();
        // Light and camera are no part of a store.
        let other = ["--set=camera.position=[1,2,5]", "--set=light[0].radiance=[3,2,1]", "--frames=2..4"];
        for passes in ["--passes=all", "--passes=final", "--passes=shading,matrices"] {
            let with = [kind, &other[..], &[passes]].concat();
            done(&place.render("afresh", &with));
            done(&place.render("stored", &[&with[..], &["--store", &from]].concat()));
            for frame in ["a.0002.json", "a.0003.json"] {
                let [afresh, stored] =
                    ["afresh", "stored"].map(|out| place.digests(&format!("{out}/{frame}")));
                assert!(!stored.is_empty(), "{kind:?}");
                for (name, digest) in &stored {
                    assert_eq!(afresh.get(name), Some(digest), "{name} of {kind:?}, {passes}");
                }
                if passes == "--passes=all" {
                    assert_eq!(afresh, stored, "{kind:?}");
                }
                // Directions are not looked along again.
                let traced = stored.contains_key("prt.visibility");
                assert!(passes != "--passes=final" || !traced, "{kind:?}: {:?}", stored.keys());
            }
        }
        std::fs::remove_dir_all(place.path("stored")).unwrap();
        let refused = |more: &[&str], parts: &[&str]| {
            let more = [kind, more, &["--store", &from]].concat();
            assert_refused(&place.render("stored", &more), parts);
        };
        refused(&[], &["manifest.json", "has no pose.0000", "bitlight bake --poses"]);
        refused(&["--set=time=0.3"], &["time", "is 0.3", "--frames"]);
        refused(
            &["--set=solid.resolution=7", "--frames=2..3"],
            &["baked with solid.resolution = 6", "has 7"],
        );
        refused(&["--set=prt.directions=65", "--frames=2..3"], &["baked with prt.directions = 64", "has 65"]);
        assert!(files(&place.path("stored")).is_empty(), "a refused frame leaves nothing");
        done(&place.render("stored", &[kind, &["--set=time=0.25", "--store", &from][..]].concat())); // pose 2
        // A store whose digests are right and whose arrays are another scene's.
        std::fs::write(place.path(&store).join("pose.0002.visibility.npy"), "no array").unwrap();
        refused(&["--frames=2..3"], &["pose.0002.visibility.npy", "damaged"]);
    }
}

#[test]
fn a_bake_loads_no_light() {
    let place = Place::new();
    let probe = "light = [{ kind = \"environment\", file = \"nowhere.hdr\" }]";
    std::fs::write(
        place.path("a.toml"),
        SCENE.replace("light = [{ kind = \"environment\", radiance = [1, 1, 1] }]", probe),
    )
    .unwrap();
    done(&place.bake("store", &["--poses", "0..1"]));
    assert_refused(&place.render("out", &[]), &["nowhere.hdr"]);
}

#[test]
fn a_technique_that_bakes_nothing_is_refused() {
    let place = Place::new();
    let other = ["--set=technique=translucency", "--store=nowhere"];
    assert_refused(&place.render("out", &other), &["is translucency, which bakes nothing", "set it to prt"]);
}

/// Digests tell that a store's bytes are whole, and nothing of what they mean: somebody else may have written
/// them.
#[test]
fn chunks_of_another_shape_or_type_are_refused() {
    use bitlight::pass::{Buffer, Kept};
    use bitlight::run::bake;
    use bitlight::scene::{Assets, Scene};
    use bitlight::store::Store;
    let scene = Scene::parse(SCENE, Path::new("a.toml"), &[]).unwrap();
    let wanted = ["prt.final"];
    let loaded = bake::load(&scene, &Assets::None, &wanted).unwrap();
    let render = |chunks: &[(&str, &Buffer)]| {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(folder.path(), bake::made_of(&scene, &loaded)).unwrap();
        store.put("pose.0000", chunks).unwrap();
        let refused = bake::render(&scene, &loaded, folder.path(), &wanted, &mut Kept::default());
        refused.map_err(|error| error.to_string())
    };
    let vertices = loaded.stage(&scene).unwrap().solid.positions.len();
    let visibility = Buffer::u32(&[vertices, 2], vec![0; vertices * 2]);
    let vectors = Buffer::f32(&[vertices, 25, 3], vec![0.5; vertices * 75]);
    assert_eq!(render(&[("visibility", &visibility), ("vectors", &vectors)]), Ok(()));
    let real = Buffer::f32(&[vertices, 2], vec![0.0; vertices * 2]);
    let turned = Buffer::f32(&[25, vertices, 3], vec![0.5; vertices * 75]);
    let regrouped = Buffer::f32(&[vertices, 3, 25], vec![0.5; vertices * 75]);
    let whole = Buffer::u32(&[vertices, 25, 3], vec![1; vertices * 75]);
    let mut odd = vectors.as_f32().to_vec();
    odd[77] = f32::NAN;
    let odd = Buffer::f32(&[vertices, 25, 3], odd);
    let short = Buffer::f32(&[vertices - 1, 25, 3], vec![0.5; (vertices - 1) * 75]);
    for (chunks, part) in [
        ([("visibility", &real), ("vectors", &vectors)], "its visibility have the shape"),
        ([("visibility", &visibility), ("vectors", &turned)], "its vectors have the shape"),
        ([("visibility", &visibility), ("vectors", &regrouped)], "its vectors have the shape"),
        ([("visibility", &visibility), ("vectors", &whole)], "its vectors have the shape"),
        ([("visibility", &visibility), ("vectors", &odd)], "its vectors are not finite at [1, 0, 2]"),
        ([("visibility", &visibility), ("vectors", &short)], "its vectors have the shape"),
        ([("visibility", &visibility), ("other", &vectors)], "has no vectors of pose.0000"),
    ] {
        let refused = render(&chunks).unwrap_err();
        assert!(refused.contains(part) && refused.contains("; bake "), "{refused}");
    }
}
