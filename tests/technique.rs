//! A technique is a row: a toy of two passes, with a key and an axis of its own, goes through the functions
//! that all techniques go through, and through nothing else. And each row that there is keeps what rows
//! promise.

use bitlight::Error;
use bitlight::compare::{Golden, Verdict};
use bitlight::keys::{Bears, Key, Kind, Only, PICTURE, Value, Values, names};
use bitlight::numeric::order::min;
use bitlight::pass::{
    Axis, Buffer, Digests, Given, Info, Inputs, Kept, Pass, Preview, RGB, Recorder, Twin, execute, infos,
};
use bitlight::run::{self, Loaded};
use bitlight::scene::{Assets, Scene, keys};
use bitlight::techniques::{ALL, Bake, Technique};
use bitlight::truth::Transport;
use bitlight::world::Stage;
use std::path::Path;

/// Stripes: their number, and whether they lie or stand.
struct Frame {
    stage: Stage,
    stripes: usize,
    lying: bool,
}

const WAYS: [(&str, bool); 2] = [("lying", true), ("standing", false)];
const WAY_NAMES: [&str; 2] = names(&WAYS);

const KEYS: &[Key] = &[
    Key::new("stripes", "count", Kind::Whole(1.0, 64.0), PICTURE, "Stripes of the picture.").or("4"),
    Key::new("stripes", "way", Kind::Choice(&WAY_NAMES), PICTURE, "How they run.").or("\"lying\""),
];

const PASSES: [Pass<Frame>; 2] = [
    Pass {
        info: Info {
            name: "stripes.brightness",
            about: "of each stripe",
            axes: &[Axis::Of("stripe")],
            knob: "stripes.count",
            ..Info::BLANK
        },
        run: brightness,
    },
    Pass {
        info: Info {
            name: "stripes.final",
            about: "the picture",
            inputs: &["stripes.brightness"],
            axes: &[Axis::Row, Axis::Column, RGB],
            preview: &[Preview::Picture],
            ..Info::BLANK
        },
        run: picture,
    },
];

const INFOS: [Info; 2] = infos(&PASSES);

fn brightness(frame: &Frame, _: &Inputs<'_>) -> Buffer {
    let values = (0..frame.stripes).map(|stripe| stripe as f32 / frame.stripes as f32);
    Buffer::f32(&[frame.stripes], values.collect())
}

fn picture(frame: &Frame, inputs: &Inputs<'_>) -> Buffer {
    let (brightness, [width, height]) = (inputs.get("stripes.brightness").as_f32(), frame.stage.size);
    let pixels = (0..width * height).flat_map(|pixel| {
        let along = if frame.lying {
            pixel / width * frame.stripes / height
        } else {
            pixel % width * frame.stripes / width
        };
        [brightness[along] + frame.stage.background.x; 3]
    });
    Buffer::f32(&[height, width, 3], pixels.collect())
}

static STRIPES: Technique = Technique {
    name: "stripes",
    about: "a toy",
    scene: "",
    keys: KEYS,
    tables: &[],
    lights: &["directional"],
    other_light: "make it directional",
    passes: &INFOS,
    bands: |_| 1,
    length: |outline, _, axis| (axis == Axis::Of("stripe")).then(|| outline.values.whole("stripes", "count")),
    scratch: |_, _| None,
    enters: |_| false,
    bake: Some(Bake {
        passes: &["stripes.brightness"],
        stored: |_| vec!["stripes.brightness"],
        poses: |_| 1,
    }),
    transport: |_, _| Ok(Transport::Surface),
    render,
    export: None,
};

fn render(
    stage: Stage,
    values: &Values,
    wanted: &[&str],
    given: Given,
    recorder: &mut dyn Recorder,
) -> Result<(), Error> {
    let stripes = values.whole("stripes", "count");
    let frame = Frame { stage, stripes, lying: values.word("stripes", "way", &WAYS) };
    execute(&PASSES, &frame, wanted, given, recorder)
}

const SCENE: &str = "technique = \"stripes\"\nimage = { width = 6, height = 8 }\ncamera = { position = [0, 0, 4] }\n\
    solid = { shape = \"cuboid\", resolution = 2 }\n\
    light = [{ kind = \"directional\", direction = [0, -1, 0], irradiance = [1, 1, 1] }]\n";

fn parse(text: &str, set: &[&str]) -> Result<Scene, Error> {
    let set: Vec<_> = set.iter().map(|set| (*set).to_owned()).collect();
    Scene::parse_as(&[&STRIPES], text, "toy.toml".as_ref(), &set)
}

fn refusal(text: &str, set: &[&str]) -> String {
    parse(text, set).expect_err("it must be refused").to_string()
}

#[test]
fn a_toy_is_parsed_completed_and_refused_by_its_nearest_key() {
    let scene = parse(SCENE, &[]).unwrap();
    assert_eq!((scene.technique, &scene.settings()["stripes.count"]), (&STRIPES, &4.into()));
    assert_eq!(scene.settings()["stripes.way"], "lying");
    assert!(!scene.settings().keys().any(|key| key.starts_with("material") || key.starts_with("surface")));
    let wrong = format!("{SCENE}[stripes]\ncuont = 3\n");
    assert_eq!(refusal(&wrong, &[]), "toy.toml:7: stripes.cuont: there is no such key; did you mean count?");
    assert!(refusal(SCENE, &["stripes.count=65"]).contains("is 65, and takes a whole number from 1 to 64"));
    assert!(refusal(SCENE, &["stripes.way=slanted"]).contains("one of \"lying\", \"standing\""));
    let spot =
        SCENE.replace("\"directional\", direction", "\"point\", position").replace("irradiance", "intensity");
    assert!(refusal(&spot, &[]).contains("is point, and stripes takes directional; make it directional"));
    assert!(refusal(&SCENE.replace("\"stripes\"", "\"strips\""), &[]).contains("did you mean \"stripes\"?"));
    // Nobody else knows it.
    let unknown = Scene::parse(SCENE, "toy.toml".as_ref(), &[]).unwrap_err().to_string();
    assert!(unknown.contains("there is no technique \"stripes\""), "{unknown}");

    let schema = keys::schema(&[&STRIPES]);
    assert_eq!(schema["properties"]["technique"]["enum"], serde_json::json!(["stripes"]));
    assert_eq!(schema["properties"]["stripes"]["properties"]["count"]["default"], 4);
    let template = keys::template(&STRIPES);
    assert_eq!(parse(&template, &[]).unwrap().settings()["stripes.count"], 4);
}

#[test]
fn a_toy_is_rendered_digested_and_verified() {
    let (scene, assets) =
        (parse(SCENE, &["stripes.count=2", "image.background=[1, 0, 0]"]).unwrap(), Assets::None);
    let wanted = scene.technique.wanted("all").unwrap();
    let (mut kept, mut digests) = (Kept::default(), Digests::default());
    run::render(&scene, &assets, &wanted, &mut vec![&mut kept as &mut dyn Recorder, &mut digests]).unwrap();
    assert_eq!(kept.get("stripes.brightness").unwrap().as_f32(), [0.0, 0.5]);
    let picture = kept.get("stripes.final").unwrap();
    assert_eq!((picture.as_f32()[0], picture.as_f32()[6 * 8 * 3 - 1]), (1.0, 1.5));

    let golden = Golden {
        file: "toy.json".into(),
        set: Vec::new(),
        settings: scene.settings(),
        passes: digests.0,
        pixels: false,
    };
    assert_eq!(golden.check(&scene, &assets), Ok(Verdict::Same(2)));
    let other = parse(SCENE, &["stripes.count=3", "image.background=[1, 0, 0]"]).unwrap();
    let Verdict::Settings(key, ..) = golden.check(&other, &assets).unwrap() else {
        panic!("it has other settings")
    };
    assert_eq!(key, "stripes.count");
    let same_settings = Golden { settings: other.settings(), ..golden };
    let Verdict::Differs(pass, _) = same_settings.check(&other, &assets).unwrap() else {
        panic!("it has other bits")
    };
    assert_eq!(pass, "stripes.brightness");
}

#[test]
fn a_toy_is_baked_and_lit_from_its_store() {
    let (folder, assets) = (tempfile::tempdir().unwrap(), Assets::None);
    let scene = parse(SCENE, &[]).unwrap();
    let baked = run::bake::bake(&scene, &assets, folder.path(), None, false, &mut |_| Ok(())).unwrap();
    assert_eq!((baked.baked, baked.there), (1, 0));
    assert!(folder.path().join("pose.0000.brightness.npy").is_file());
    let mut kept = Kept::default();
    let loaded = run::bake::load(&scene, &assets, &["stripes.final"]).unwrap();
    run::bake::render(&scene, &loaded, folder.path(), &["stripes.final"], &mut kept).unwrap();
    let mut afresh = Kept::default();
    Loaded::new(&scene, &assets, &[]).unwrap().render(&scene, &["stripes.final"], &mut afresh).unwrap();
    assert_eq!(kept.get("stripes.final"), afresh.get("stripes.final"));
}

/// Another value that a key takes than the one that holds.
fn another(key: &Key) -> Option<String> {
    let now = key.default.or((!key.example.is_empty()).then_some(key.example))?;
    let candidates = match key.kind {
        Kind::Text | Kind::Technique => return None,
        Kind::Choice(words) => words.iter().map(|word| format!("\"{word}\"")).collect(),
        Kind::Flag => vec!["true".into(), "false".into()],
        Kind::Whole(low, high) => vec![min(high, low + 7.0).to_string(), low.to_string()],
        Kind::Number(low, high) => vec![format!("{}", low + (min(high, 1e3) - low) * 0.37), low.to_string()],
        Kind::Triple(low, high) => {
            let x = if low < 0.0 { 0.25 } else { low + (min(high, 10.0) - low) * 0.37 };
            vec![format!("[{x}, {x}, {}]", x * 0.5)]
        }
    };
    candidates.into_iter().find(|candidate| Value::parse(candidate) != Value::parse(now))
}

/// A key that nobody reads, or a word that means what another means, does nothing: each must change what it
/// sets.
#[test]
fn every_key_of_a_technique_changes_its_settings() {
    use bitlight::techniques::{prt, translucency};
    type Read = fn(&Values) -> String;
    let read: [(&Technique, Read); 2] = [
        (&translucency::TECHNIQUE, |values| format!("{:?}", translucency::Settings::read(values))),
        (&prt::TECHNIQUE, |values| format!("{:?}", prt::Settings::read(values))),
    ];
    assert_eq!(
        read.map(|(technique, _)| technique.name).as_slice(),
        ALL.iter().map(|row| row.name).collect::<Vec<_>>()
    );
    for (technique, settings) in read {
        let text = keys::template(ALL.iter().find(|row| row.name == technique.name).unwrap());
        let of = |set: &[String]| settings(&Scene::parse(&text, "a.toml".as_ref(), set).unwrap().values);
        for key in technique.keys {
            assert_eq!(key.table, technique.name, "{}", key.name);
            let words = match key.kind {
                Kind::Choice(words) => words.iter().map(|word| format!("\"{word}\"")).collect(),
                _ => vec![another(key).unwrap()],
            };
            let mut seen = vec![];
            for word in &words {
                seen.push(of(&[format!("{}.{}={word}", key.table, key.name)]));
            }
            if words.len() == 1 {
                seen.push(of(&[]));
            }
            let count = seen.len();
            seen.sort();
            seen.dedup();
            assert_eq!(seen.len(), count, "{}.{} has values that do the same", key.table, key.name);
        }
    }
}

/// The same of the shared keys, by what the whole scene comes to beside its values.
#[test]
fn every_shared_key_changes_the_scene() {
    let of = |technique: &str, set: &[String]| {
        let text = keys::template(ALL.iter().find(|row| row.name == technique).unwrap());
        let scene =
            Scene::parse(&text, "a.toml".as_ref(), set).unwrap_or_else(|error| panic!("{set:?}: {error}"));
        let Scene { technique, time, frame_rate, size, background, exposure, camera, solid, wave, .. } =
            &scene;
        let Scene { bend, medium, gloss, surface, lights, truth, .. } = &scene;
        format!(
            "{technique:?} {time} {frame_rate} {size:?} {background:?} {exposure} {camera:?} {solid:?} {wave:?}"
        ) + &format!("{bend:?} {medium:?} {gloss} {surface:?} {lights:?} {truth:?}")
    };
    let mut tried = 0;
    for key in keys::all(ALL).into_iter().filter(|key| ALL.iter().all(|row| row.name != key.table)) {
        let Some(value) = another(key) else { continue };
        let technique = ALL.iter().find(|row| key.light().is_none_or(|kind| row.lights[0] == kind));
        let Some(technique) = technique.filter(|_| key.name != "kind") else { continue };
        let table = if key.base() == "light" { "light[0]" } else { key.table };
        let path = format!("{table}.{}", key.name);
        let mut base = vec![];
        match path.as_str() {
            "solid.extents" => base.push("solid.shape=cuboid".to_owned()),
            "surface.exponent" => base.push("surface.highlight=phong".into()),
            "surface.roughness" => base.push("surface.highlight=cook-torrance".into()),
            "material.scattering" | "material.absorption" => {
                // The scene to start from has a material by its name; these stand in its place below.
                continue;
            }
            "light[0].radiance" => continue, // beside a probe; `tests/robust` has it
            _ => {}
        }
        let set = [base.clone(), vec![format!("{}={value}", path.trim_start_matches('.'))]].concat();
        assert_ne!(of(technique.name, &base), of(technique.name, &set), "{path} = {value} does nothing");
        tried += 1;
    }
    assert!(tried > 30, "{tried} keys");
}

#[test]
fn every_condition_names_a_key_and_words_that_it_has() {
    for key in keys::all(ALL) {
        let Only::With(path, words) = key.only else { continue };
        let (table, name) = path.split_once('.').unwrap_or(("", path));
        let other = keys::all(ALL).into_iter().find(|key| key.table == table && key.name == name);
        let Some(Kind::Choice(all)) = other.map(|key| key.kind) else {
            panic!("{}: {path} is no key of words", key.name)
        };
        assert!(words.iter().all(|word| all.contains(word)), "{}: {words:?} of {all:?}", key.name);
        assert!(key.bears != [Bears::Picture], "{}: a picture's settings have it in any case", key.name);
    }
}

#[test]
fn every_pass_has_a_twin_or_a_reason_a_knob_and_a_preview() {
    for technique in ALL {
        let all: Vec<_> =
            keys::all(&[technique]).iter().map(|key| format!("{}.{}", key.table, key.name)).collect();
        assert!(technique.passes.iter().filter(|info| info.is_picture()).count() == 1, "{}", technique.name);
        for info in technique.passes {
            assert!(info.name.starts_with(&format!("{}.", technique.name)), "{}", info.name);
            match info.twin {
                Twin::Wgsl(file) => {
                    let path = Path::new("src/techniques").join(technique.name).join(file);
                    assert!(path.is_file(), "{}: there is no {}", info.name, path.display());
                }
                Twin::Absent(reason) => {
                    assert!(reason.len() > 9, "{}: has neither twin nor reason", info.name)
                }
            }
            assert!(all.iter().any(|key| key == info.knob), "{}: {} is no key", info.name, info.knob);
            let shown: usize = info.preview.iter().map(|preview| preview.channels()).sum();
            let channels = match (info.is_image(), info.axes.last()) {
                (false, _) => 0,
                (true, Some(Axis::Channel(names))) => names.len(),
                (true, _) => 1,
            };
            assert_eq!(shown, channels, "{}: the preview shows others than its channels", info.name);
        }
        if let Some(bake) = technique.bake {
            let known = |pass: &&&str| technique.passes.iter().any(|info| info.name == **pass);
            assert_eq!(bake.passes.iter().filter(known).count(), bake.passes.len(), "{}", technique.name);
        }
    }
}

#[test]
fn the_scene_of_each_technique_is_there() {
    for technique in ALL {
        let scene = Scene::read(technique.scene.as_ref(), &[]).unwrap();
        assert_eq!(scene.technique.name, technique.name);
        assert!(scene.assets().is_empty(), "{} needs an asset", technique.scene);
    }
}

/// A program without files, such as a page in a browser, has assets in memory: the bits are the same.
#[test]
fn assets_in_memory_are_those_of_a_folder() {
    let text = "technique = \"prt\"\nimage = { width = 8, height = 8 }\ncamera = { position = [0, 1, 4] }\n\
        solid = { file = \"a.obj\" }\nlight = [{ kind = \"environment\", file = \"sky.hdr\" }]\n\
        prt = { bands = 3, directions = 32 }\n";
    let mesh = b"v -1 0 0\nv 1 0 0\nv 0 0 1\nv 0 1 0\nf 1 2 3\nf 1 4 2\nf 2 4 3\nf 3 4 1\n".to_vec();
    let texels: Vec<u8> = (0..8).flat_map(|texel| [100 + texel, 90, 20 * texel, 129]).collect();
    let map = [b"#?RADIANCE\n\n-Y 2 +X 4\n".to_vec(), texels].concat();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.obj"), &mesh).unwrap();
    std::fs::write(folder.path().join("sky.hdr"), &map).unwrap();
    let memory = Assets::Memory([("a.obj".into(), mesh), ("sky.hdr".into(), map)].into());
    let scene = Scene::parse(text, "a.toml".as_ref(), &[]).unwrap();
    let render = |assets: &Assets| {
        let mut digests = Digests::default();
        run::render(&scene, assets, &scene.technique.wanted("all").unwrap(), &mut digests).map(|()| digests.0)
    };
    assert_eq!(render(&memory).unwrap(), render(&Assets::Folder(folder.path().into())).unwrap());

    // What is wrong in memory is named as the scene names it.
    let Assets::Memory(mut files) = memory else { unreachable!() };
    files.insert("a.obj".into(), b"v 0 0 0\nv 1 0 0\nf 1 2\n".to_vec());
    let broken = render(&Assets::Memory(files.clone())).unwrap_err().to_string();
    assert!(broken.starts_with("a.obj:3: "), "{broken}");
    files.remove("sky.hdr");
    let missing = render(&Assets::Memory(files)).unwrap_err();
    assert!(missing.file.as_deref() == Some(Path::new("sky.hdr")) && missing.remedy.is_some(), "{missing}");
}

/// What bears on a bake and on the ground truth, told once more by hand: a row that loses a column, or gains
/// one, shows.
#[test]
fn bakes_and_truths_depend_on_these_keys() {
    let text = "technique = \"prt\"\nimage = { width = 8, height = 8 }\ncamera = { position = [0, 1, 4] }\n\
        solid = { shape = \"cuboid\", resolution = 2 }\nsurface = { highlight = \"phong\" }\nbend = { angle = 1 }\n\
        light = [{ kind = \"environment\", radiance = [1, 1, 1] }]\nprt = { subsurface = \"dipole\" }\n\
        truth = { model = \"surface\", bounces = 2 }\nmaterial = { name = \"Marble\" }\n";
    let scene = |set: &[&str]| {
        let set: Vec<_> = set.iter().map(|set| (*set).to_owned()).collect();
        Scene::parse(text, "a.toml".as_ref(), &set).unwrap()
    };
    let baked = |set: &[&str]| {
        let scene = scene(set);
        let loaded = Loaded::new(&scene, &Assets::None, &[]).unwrap();
        run::bake::made_of(&scene, &loaded).keys().cloned().collect::<Vec<_>>().join(" ")
    };
    let solid = "technique unit frame_rate solid.shape solid.resolution solid.extents solid.triangles solid.turn \
        solid.center wave.amplitude wave.length wave.period bend.angle bend.length bend.root bend.period \
        material.name surface.albedo surface.highlight surface.specular surface.exponent prt.bands prt.directions \
        prt.method prt.reading prt.bounces prt.subsurface vertices triangles mesh";
    assert_eq!(baked(&[]), solid);
    let opaque = solid.replace("unit ", "").replace("material.name ", "");
    assert_eq!(baked(&["prt.subsurface=none"]), opaque);
    let dull = opaque.replace("surface.specular surface.exponent ", "");
    assert_eq!(baked(&["prt.subsurface=none", "surface.highlight=none"]), dull);

    let traced = |set: &[&str]| {
        let truth = run::Truth::new(&scene(set), &Assets::None).unwrap();
        truth.identity.settings.keys().cloned().collect::<Vec<_>>().join(" ")
    };
    let stage = "unit time image.width image.height image.background camera.position camera.target camera.up camera.fov \
        solid.shape solid.resolution solid.extents solid.triangles solid.turn solid.center \
        wave.amplitude wave.length wave.period bend.angle bend.length bend.root bend.period ";
    let rest =
        "truth.bands truth.bounces truth.anisotropy truth.filter light[0].kind light[0].radiance truth.model";
    let surface = "surface.albedo surface.highlight surface.specular surface.exponent ";
    assert_eq!(traced(&[]), [stage, surface, rest].concat());
    let sun = ["truth.model=dipole", "truth.bounces=0"];
    assert!(run::Truth::new(&scene(&sun), &Assets::None).is_err(), "a dipole has no bounces");
}
