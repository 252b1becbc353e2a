//! Scenes that say what cannot be: every refusal names file, line, key and remedy.

use super::{Place, SCENE, assert_refused};
use bitlight::run;
use bitlight::scene::Scene;
use std::fmt::Write;
use std::path::Path;
use std::time::Instant;

fn refusal(text: &str, set: &[&str]) -> String {
    let set: Vec<_> = set.iter().map(|set| (*set).to_owned()).collect();
    match Scene::parse(text, Path::new("a.toml"), &set) {
        Ok(_) => panic!("accepted: {text} {set:?}"),
        Err(error) => {
            assert!(error.remedy.is_some() && error.file.is_some(), "{error}");
            let text = error.to_string();
            assert!(text.len() < 1000 && text.lines().count() == 1, "{text}");
            text
        }
    }
}

/// The scene with a line in the place of the one that starts as it does, or at the end of its table.
fn with(line: &str) -> String {
    let key = line.split('=').next().unwrap();
    let old = SCENE.lines().find(|old| old.split('=').next() == Some(key)).unwrap();
    SCENE.replace(old, line)
}

#[test]
fn numbers_out_of_range_are_refused_by_line_and_key() {
    let cases: [(&str, &str); 21] = [
        ("width = 0", "a.toml:3: image.width: is 0, and takes a whole number from 1 to 8192"),
        ("width = -1", "a.toml:3: image.width: is -1"),
        ("width = 8193", "a.toml:3: image.width"),
        ("width = 1.5", "a.toml:3: image.width: is 1.5"),
        ("width = 9223372036854775808", "a.toml:3: image.width: is 9223372036854776000"),
        ("width = 99999999999999999999999", "a.toml:3: image.width"),
        ("width = 0xffffffffffffffffff", "a.toml:3: image.width: is a number out of range"),
        ("width = 1e999", "a.toml:3: image.width: is inf"),
        ("width = nan", "a.toml:3: image.width: is NaN"),
        ("width = -inf", "a.toml:3: image.width: is -inf"),
        ("width = true", "a.toml:3: image.width: is true, and takes a whole number"),
        ("width = 1979-05-27", "a.toml:3: image.width: is a date or a time"),
        ("width = \"64\"", "a.toml:3: image.width: is \"64\""),
        ("width = [64]", "a.toml:3: image.width: is [64]"),
        ("width = {}", "a.toml:3: image.width: is a table"),
        ("width = [\"a\"]", "a.toml:3: image.width: is a list of other things than numbers"),
        ("position = [0, 0]", "a.toml:6: camera.position: is [0, 0], and takes three numbers"),
        ("position = [0, 1e13, 0]", "a.toml:6: camera.position"),
        ("position = [0, 0, 0]", "a.toml:6: camera.position: is the target"),
        ("position = [0, 0, 1e-30]", "a.toml:6: camera.position: is the target"),
        (
            "intensity = [9, -1, 9]",
            "a.toml:13: light[0].intensity: is [9, -1, 9], and takes three numbers from 0 to 1e12",
        ),
    ];
    for (line, expected) in cases {
        let text = refusal(&with(line), &[]);
        assert!(text.starts_with(expected), "{line}: {text}");
    }
}

#[test]
fn what_no_material_or_light_can_be_is_refused() {
    let zero = "[material]\nscattering = [1, 0, 1]\nabsorption = [1, 0, 1]\n";
    let cases: [(String, &str); 14] = [
        (zero.into(), "a.toml:18: material.scattering: and absorption are both zero"),
        (zero.replace("[1, 0, 1]", "[1, -1, 1]"), "a.toml:19: material.absorption: is [1, -1, 1]"),
        (zero.replace("[1, 0, 1]", "[1, nan, 1]"), "is [1, NaN, 1]"),
        (zero.replace("absorption", "#"), "material.absorption: is missing; write for example absorption"),
        (
            "[material]\neta = 0.9\n".into(),
            "a.toml:18: material.eta: is 0.9, and takes a number from 1 to 3.5",
        ),
        ("[material]\nname = \"Marbel\"\n".into(), "did you mean \"Marble\"?"),
        ("[material]\nname = \"Marble\"\nscattering = [1, 1, 1]\n".into(), "stands beside"),
        ("[[light]]\nkind = \"spot\"\n".into(), "a.toml:18: light[1].kind: is \"spot\", and takes one of"),
        ("[[light]]\n".into(), "a.toml:17: light[1]: has no key; write for example kind"),
        ("[[light]]\nkind = \"point\"\nposition = [1, 2, 3]\n".into(), "light[1].intensity: is missing"),
        (
            "[[light]]\nkind = \"point\"\nradiance = [1, 2, 3]\n".into(),
            "a.toml:19: light[1].radiance: there is no such key",
        ),
        (
            "[[light]]\nkind = \"directional\"\ndirection = [0, 0, 0]\nirradiance = [1, 1, 1]\n".into(),
            "a.toml:19: light[1].direction: is zero",
        ),
        ("[[light]]\nkind = \"environment\"\n".into(), "takes one of file, probe and radiance"),
        ("[[light]]\nkind = \"environment\"\nprobe = \"grase\"\n".into(), "did you mean \"grace\"?"),
    ];
    for (tail, expected) in cases {
        let text = refusal(&format!("{SCENE}{tail}"), &[]);
        assert!(text.contains(expected), "{tail}: {text}");
    }
}

#[test]
fn tables_and_keys_that_are_none_are_refused() {
    let long = "x".repeat(200_000);
    let cases: [(String, &str); 18] = [
        (format!("{SCENE}[fur]\nlength = 1\n"), "a.toml:18: fur.length: there is no table fur"),
        (format!("{SCENE}colour = 1\n"), "a.toml:17: translucency.colour: there is no such key"),
        (format!("{SCENE}blur = 1\nblur = 2\n"), "a.toml:18: is no TOML: duplicate key"),
        (format!("{SCENE}[camera]\n"), "is no TOML: duplicate key"),
        (SCENE.replace("[[light]]", "[light]"), "with two brackets"),
        (SCENE.replace("[camera]", "[[camera]]"), "did you mean [camera]?"),
        (SCENE.replace("[[light]]", "[\"light[0]\"]"), "a.toml:10: light[0]: there is no such table"),
        (format!("{SCENE}[\"light[7]\"]\nkind = \"point\"\n"), "light[7]: there is no such table"),
        (format!("{SCENE}[camera.x]\n"), "camera.x: is a table"),
        (format!("light = 5\n{}", SCENE.split("[[light]]").next().unwrap()), "light: "),
        (format!("light = []\n{}", SCENE.split("[[light]]").next().unwrap()), "light: "),
        (SCENE.split("[[light]]").next().unwrap().into(), "light: the scene has no light"),
        (SCENE.replace("shape", "#"), "solid.shape: is missing, and so is file"),
        (SCENE.replace("resolution = 3", "file = \"a.obj\""), "solid.file: stands beside shape"),
        (
            SCENE.replace("resolution = 3", "extents = [1, 0, 1]"),
            "a.toml:9: solid.extents: have a side of under a hundred-thousandth",
        ),
        (
            SCENE.replace("resolution = 3", "extents = [1, 1e-60, 1]"),
            "solid.extents: have a side of under a hundred-thousandth",
        ),
        (format!("{SCENE}{long} = 1\n"), "there is no such key"),
        (format!("{SCENE}blur = \"{long}\"\n"), "translucency.blur: is \"xxx"),
    ];
    for (text, expected) in cases {
        let refused = refusal(&text, &[]);
        assert!(refused.contains(expected), "{expected}: {refused}");
    }
    assert!(refusal(SCENE, &["camera.up=[0,0,0]"]).contains("camera.up: is zero; give the direction"));
}

#[test]
fn what_prt_the_bend_and_the_truth_cannot_take_is_refused() {
    let prt = SCENE
        .replace("\"translucency\"", "\"prt\"")
        .replace("\"point\"", "\"directional\"")
        .replace("position = [0, 3, 3]", "direction = [0, -1, 0]")
        .replace("intensity", "irradiance");
    let cases = [
        ("prt.bands=0", "prt.bands: is 0, and takes a whole number from 1 to 10"),
        ("prt.bands=11", "prt.bands: is 11"),
        ("prt.bands=2.5", "prt.bands: is 2.5"),
        ("prt.directions=0", "prt.directions: is 0"),
        ("prt.directions=65537", "prt.directions: is 65537"),
        ("prt.bounces=65", "prt.bounces: is 65"),
        ("prt.poses=0", "prt.poses: is 0"),
        (
            "prt.method=montecarlo",
            "prt.method: is \"montecarlo\", and takes one of \"control\", \"quadrature\"",
        ),
        ("prt.subsurface=single", "prt.subsurface: is \"single\""),
        ("prt.band=3", "did you mean bands?"),
        ("surface.albedo=[1,1.5,1]", "surface.albedo: is [1, 1.5, 1], and takes three numbers from 0 to 1"),
        ("surface.albedo=[1,nan,1]", "surface.albedo: is [1, NaN, 1]"),
        ("surface.specular=0.5", "surface.specular: is 0.5"),
        ("surface.highlight=shiny", "surface.highlight: is \"shiny\""),
        ("surface.exponent=-1", "surface.exponent: is -1"),
        ("surface.roughness=0", "surface.roughness: is 0"),
        ("bend.length=0", "bend.length: is 0"),
        ("bend.period=-1", "bend.period: is -1"),
        ("bend.angle=inf", "bend.angle: is inf"),
        ("truth.model=volume", "truth.model: is \"volume\""),
        ("truth.bands=33", "truth.bands: is 33"),
        ("truth.bounces=10001", "truth.bounces: is 10001"),
        ("truth.anisotropy=1", "truth.anisotropy: is 1"),
        ("technique=truth", "technique: there is no technique \"truth\""),
    ];
    assert!(Scene::parse(&prt, Path::new("a.toml"), &[]).is_ok());
    for (set, expected) in cases {
        let text = refusal(&prt, &[set]);
        assert!(text.contains(expected), "{set}: {text}");
    }
    let point = refusal(SCENE, &["technique=prt"]);
    assert!(
        point.starts_with("a.toml:11: light[0].kind: is point, and prt takes environment or directional; it takes light from far away"),
        "{point}"
    );
}

#[test]
fn prt_at_the_ends_of_its_keys_is_a_picture_or_an_error() {
    let head = SCENE.split("[[light]]").next().unwrap().replace("\"translucency\"", "\"prt\"");
    let prt = head + "[[light]]\nkind = \"environment\"\nradiance = [1, 1, 1]\n";
    let cases: [&[&str]; 12] = [
        &["prt.bands=1"],
        &["prt.bands=10", "prt.directions=9"],
        &["prt.bands=10", "surface.highlight=phong", "solid.resolution=2"],
        &["prt.directions=1", "prt.bounces=64"],
        &["prt.directions=1", "prt.bounces=2", "surface.highlight=cook-torrance", "surface.roughness=0.01"],
        &["prt.bounces=64", "surface.albedo=[1,1,1]"],
        &["surface.highlight=phong", "surface.exponent=1e4", "surface.specular=[1,1,1]"],
        &["prt.subsurface=dipole", "unit=m"],
        &["prt.subsurface=dipole", "unit=mm", "solid.size=1e6"],
        &["solid.extents=[1,1e-5,1]", "prt.subsurface=dipole"],
        &["solid.size=1e-9", "unit=mm", "prt.subsurface=dipole", "camera.position=[0,0,4e-9]"],
        &["bend.angle=36e3", "bend.length=1e12", "time=0.25"],
    ];
    for set in cases {
        let place = Place::new(&prt);
        let sets: Vec<_> = set.iter().flat_map(|set| ["--set", set]).collect();
        let output = place.render(&[&["--passes", "all"], &sets[..]].concat());
        assert!(output.status.success(), "{set:?}: {}", super::stderr(&output));
    }
    let large =
        ["--set", "solid.shape=sphere", "--set", "solid.resolution=500", "--set", "surface.highlight=phong"];
    let place = Place::new(&prt);
    assert_refused(
        &place.render(&large),
        &["a.toml: prt.bands: the passes need", "solid.resolution"],
        "matrices",
    );
    assert_eq!(place.out(), [""; 0]);
}

#[test]
fn nesting_and_size_cannot_exhaust_the_reader() {
    let begun = Instant::now();
    let deep = 200_000;
    let mut cases = vec![
        format!("a = {}", "[".repeat(deep)),
        format!("a = {}{}", "[".repeat(deep), "]".repeat(deep)),
        format!("a = {}", "{a=".repeat(deep)),
        format!("{}1 = 1", "a.".repeat(deep)),
        format!("[{}a]", "a.".repeat(deep)),
        format!("a = \"{}", "\\".repeat(deep)),
        "'".repeat(deep),
        "[".repeat(deep),
        "a=1\n".repeat(deep),
        "[[light]]\n".repeat(100_000),
    ];
    // Many keys on many lines: each needs its line number.
    let many = (0..60_000).fold(String::new(), |mut text, i| {
        writeln!(text, "k{i} = {i}").unwrap();
        text
    });
    cases.push(format!("[image]\n{many}"));
    cases.push(many);
    for case in &cases {
        refusal(case, &[]);
    }
    let nested = format!("camera.position={}", "[".repeat(100_000));
    assert!(refusal(SCENE, &[&nested]).contains("camera.position"));
    assert!(begun.elapsed() < super::PATIENCE, "{:?}", begun.elapsed());
}

#[test]
fn too_many_lights_are_refused_and_the_most_are_not() {
    let light = "[[light]]\nkind = \"point\"\nposition = [0, 3, 3]\nintensity = [9, 9, 9]\n";
    let tiny = SCENE.split("[[light]]").next().unwrap().to_owned();
    let text = refusal(&(tiny.clone() + &light.repeat(10_000)), &[]);
    assert!(text.contains("light: there are 10000 of them; keep 1000"), "{text}");
    let begun = Instant::now();
    let scene = Scene::parse(&(tiny + &light.repeat(1000)), Path::new("a.toml"), &[]).unwrap();
    assert_eq!(scene.lights.len(), 1000);
    assert!(begun.elapsed() < super::PATIENCE);
    // At the default sizes the buffers of so many are refused before anything is loaded.
    let error = run::render(
        &scene,
        &Default::default(),
        &["translucency.final"],
        &mut bitlight::pass::Kept::default(),
    );
    let error = error.unwrap_err().to_string();
    assert!(error.contains("GiB of memory") && error.contains("use fewer lights"), "{error}");
}

#[test]
fn an_enormous_request_is_refused_before_it_is_allocated() {
    let place = Place::new(SCENE);
    let set = |sets: &[&str]| {
        let sets: Vec<_> = sets.iter().flat_map(|set| ["--set", set]).collect();
        place.render(&[&["--passes", "all"], &sets[..]].concat())
    };
    let image = set(&["image.width=8192", "image.height=8192"]);
    assert_refused(
        &image,
        &["a.toml: image.width: the passes need", "over 8 GiB", "image.height"],
        "an image",
    );
    let two = "light=1";
    assert_refused(&set(&[two]), &["light"], "no such key");
    let cubemap = set(&["translucency.cubemap=2048", "image.width=8192", "image.height=4096"]);
    assert_refused(&cubemap, &["GiB of memory"], "a cubemap");
    assert_refused(
        &set(&["solid.shape=sphere", "solid.resolution=2048"]),
        &["a.toml: solid.resolution", "1024"],
        "a sphere",
    );
    assert_refused(
        &set(&["solid.shape=torus-knot", "solid.resolution=2048"]),
        &["solid.resolution"],
        "a knot",
    );
    assert_refused(&set(&["solid.shape=genus-3", "solid.resolution=2048"]), &["solid.resolution"], "genus 3");
    assert_eq!(place.out(), [""; 0]);
}

#[test]
fn assignments_that_are_none_are_refused() {
    let cases = [
        ("camera.fov", "there is no ="),
        ("", "there is no ="),
        ("=", "there is no such key"),
        ("fov=3", "fov: there is no such key"),
        ("camera.fov=", "camera.fov: is \"\", and takes a number"),
        ("camera.fov=1e999", "camera.fov: is inf"),
        ("camera.fov=nan", "camera.fov: is NaN"),
        (
            "image.width=99999999999999999999",
            "image.width: is 100000000000000000000, and takes a whole number",
        ),
        ("light.position=[1,2,3]", "write [[light]]"),
        ("light=3", "light: is a table of keys; write [[light]], once for each light"),
        ("image=3", "image: is a table of keys; write it in brackets"),
        ("light[0].kind=x", "light[0].kind: is \"x\", and takes one of \"point\""),
        ("light[1].position=[1,2,3]", "the scene has no such light"),
        ("light[-1].position=[1,2,3]", "the scene has no such light"),
        ("light[.position=[1,2,3]", "the scene has no such light"),
        ("camera[0].fov=40", "did you mean [camera]?"),
        ("a.b.c.fov=40", "there is no table a.b.c"),
    ];
    for (set, expected) in cases {
        let text = refusal(SCENE, &[set]);
        assert!(text.contains(expected), "{set}: {text}");
    }
}
