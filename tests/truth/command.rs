//! `bitlight truth` as a person meets it.

use bitlight::store::file;
use std::path::Path;
use std::process::{Command, Output};

const KNOT: &str = "scenes/translucency/knot.toml";

fn truth(scene: &str, out: &Path, more: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bitlight"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).env_remove("BITLIGHT_ASSETS");
    command.args(["truth", scene, "--set", "image.width=24", "--set", "image.height=16"]);
    command.args(["--set", "solid.resolution=12", "-o"]).arg(out).args(more);
    command.output().unwrap()
}

#[track_caller]
fn done(output: &Output) -> String {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[track_caller]
fn refused(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(2));
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// What must not depend on how a frame came to be.
fn bytes(folder: &Path) -> Vec<Vec<u8>> {
    ["exr", "png", "state"]
        .map(|ending| std::fs::read(folder.join(format!("knot.truth.{ending}"))).unwrap())
        .to_vec()
}

#[test]
fn a_run_goes_on_where_one_stopped_with_the_bytes_of_one_run() {
    let folder = tempfile::tempdir().unwrap();
    let [whole, parts] = ["whole", "parts"].map(|name| folder.path().join(name));
    done(&truth(KNOT, &whole, &["--spp", "24", "--threads", "1"]));
    done(&truth(KNOT, &parts, &["--spp", "6", "--threads", "2"]));
    assert_ne!(bytes(&whole), bytes(&parts));
    let said = done(&truth(KNOT, &parts, &["--spp", "24", "--threads", "3"]));
    assert!(said.contains("24 samples a pixel, 18 of them now"), "{said}");
    assert_eq!(bytes(&whole), bytes(&parts));
    let said = done(&truth(KNOT, &parts, &["--spp", "10"]));
    assert!(said.contains("24 samples a pixel were there already"), "{said}");
    assert_eq!(bytes(&whole), bytes(&parts));
    // What the techniques' own knobs say does not matter, nor how bright the preview is.
    done(&truth(
        KNOT,
        &parts,
        &["--spp", "26", "--set", "translucency.cubemap=8", "--set", "image.exposure=1"],
    ));
    let layers = file::read_exr(&parts.join("knot.truth.exr")).unwrap();
    let names: Vec<_> = layers.iter().map(|layer| layer.name.as_str()).collect();
    assert_eq!(names, ["truth.mean", "truth.variance"]);
    assert_eq!((layers[0].width, layers[0].height), (24, 16));
}

#[test]
fn time_ends_a_run_after_whole_samples() {
    let folder = tempfile::tempdir().unwrap();
    let said = done(&truth(KNOT, folder.path(), &["--seconds", "0.2"]));
    let samples: u64 = said.lines().last().unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!(samples >= 2, "{said}");
    // The same samples by number.
    let again = tempfile::tempdir().unwrap();
    done(&truth(KNOT, again.path(), &["--spp", &samples.to_string()]));
    assert_eq!(bytes(folder.path()), bytes(again.path()));
}

#[test]
fn another_scenes_state_is_refused_and_stays() {
    let folder = tempfile::tempdir().unwrap();
    let state = folder.path().join("knot.truth.state");
    done(&truth(KNOT, folder.path(), &["--spp", "2"]));
    let kept = std::fs::read(&state).unwrap();
    for (set, expected) in [
        ("camera.fov=20", "camera.fov is 30 there and 20 here"),
        ("truth.filter=box", "truth.filter is \"point\" there and \"box\" here"),
        ("material.eta=1.4", "material.eta is absent there and 1.4 here"),
        ("truth.model=surface", "surface.albedo is absent there and [0.5,0.5,0.5] here"),
        ("truth.anisotropy=0.7", "truth.anisotropy is 0 there and 0.7 here"),
    ] {
        let said = refused(&truth(KNOT, folder.path(), &["--spp", "4", "--set", set]));
        assert!(said.contains("is a state of other settings"), "{said}");
        assert!(said.contains(expected), "{said}");
        assert!(said.contains("delete it to begin anew"), "{said}");
    }
    assert_eq!(std::fs::read(&state).unwrap(), kept);
    let mut damaged = kept.clone();
    *damaged.last_mut().unwrap() ^= 1;
    let count = kept.windows(11).position(|bytes| bytes == b"\"samples\":2").unwrap();
    let mut recounted = kept.clone();
    recounted[count + 10] = b'1';
    for (bytes, expected) in [
        (damaged, "damaged"),
        (recounted, "damaged"),
        (kept[..kept.len() - 8].to_vec(), "damaged"),
        (b"no state".to_vec(), "is no state"),
    ] {
        std::fs::write(&state, bytes).unwrap();
        let said = refused(&truth(KNOT, folder.path(), &["--spp", "4"]));
        assert!(said.contains(expected) && said.contains("knot.truth.state"), "{said}");
    }
}

/// A scene's settings are those that its technique reads; a state's those that its model reads.
#[test]
fn a_state_is_of_the_surface_that_reflects() {
    let folder = tempfile::tempdir().unwrap();
    let run = |spp: &str, set: &str| {
        let more = ["--spp", spp, "--set", "truth.model=surface", "--set", set];
        truth(KNOT, folder.path(), &more)
    };
    done(&run("2", "surface.exponent=9"));
    let said = refused(&run("4", "surface.albedo=[0.5,0.25,0.1]"));
    assert!(said.contains("surface.albedo is [0.5,0.5,0.5] there and [0.5,0.25,0.1] here"), "{said}");
    let said = refused(&run("4", "surface.highlight=phong"));
    assert!(said.contains("surface.highlight is \"none\" there and \"phong\" here"), "{said}");
    // What the model does not read does not matter, nor what no highlight reads.
    done(&run("2", "surface.exponent=3"));
    done(&run("4", "material.eta=1.4"));
    let report = std::fs::read_to_string(folder.path().join("knot.truth.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    assert_eq!(report["settings"]["truth.samples"], 4);
}

#[test]
fn the_model_follows_what_the_technique_approximates() {
    let folder = tempfile::tempdir().unwrap();
    let skin = "scenes/prt/skin.toml";
    let picture = |set: &[&str]| {
        let folder = tempfile::tempdir().unwrap();
        done(&truth(skin, folder.path(), &[&["--spp", "2"], set].concat()));
        std::fs::read(folder.path().join("skin.truth.exr")).unwrap()
    };
    assert_eq!(picture(&[]), picture(&["--set", "truth.model=dipole"]));
    assert_ne!(picture(&[]), picture(&["--set", "truth.model=surface"]));
    let said = refused(&truth(skin, folder.path(), &["--spp", "2", "--set", "surface.albedo=[0,0,0.1]"]));
    assert!(said.contains("truth.model: is absent, and the solid both reflects"), "{said}");
}

#[test]
fn a_camera_in_a_medium_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let run = |camera: &str| {
        let set = ["truth.model=medium", "solid.shape=sphere", "material.eta=1", camera];
        let set: Vec<_> =
            ["--spp", "2"].into_iter().chain(set.iter().flat_map(|set| ["--set", set])).collect();
        truth(KNOT, folder.path(), &set)
    };
    let said = refused(&run("camera.position=[0,0,1]"));
    assert!(said.contains("camera.position: is inside the solid"), "{said}");
    done(&run("camera.position=[0,0,1000]"));
}

#[test]
fn a_state_is_of_the_files_that_the_scene_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let scene =
        std::fs::read_to_string(KNOT).unwrap().replace("probe = \"eucalyptus\"", "file = \"sky.hdr\"");
    std::fs::write(path("mine.toml"), scene).unwrap();
    let sky = |red: u8| {
        let texels = [[red, 128, 128, 128]; 2];
        let bytes = [b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n", texels.as_flattened()].concat();
        std::fs::write(path("sky.hdr"), bytes).unwrap();
    };
    let mine = path("mine.toml");
    let assets = folder.path().to_string_lossy().into_owned();
    let run = |spp: &str| truth(&mine.to_string_lossy(), folder.path(), &["--assets", &assets, "--spp", spp]);
    sky(128);
    done(&run("2"));
    done(&run("3"));
    sky(129);
    let said = refused(&run("4"));
    assert!(said.contains("a model or an environment was another then"), "{said}");
    // The same texels, one above the other.
    let stood = std::fs::read(path("sky.hdr")).unwrap();
    sky(128);
    done(&run("4"));
    let stands = String::from_utf8_lossy(&stood[..stood.len() - 8]).replace("-Y 1 +X 2", "-Y 2 +X 1");
    let texels = [[128, 128, 128, 128]; 2];
    std::fs::write(path("sky.hdr"), [stands.as_bytes(), texels.as_flattened()].concat()).unwrap();
    let said = refused(&run("5"));
    assert!(said.contains("a model or an environment was another then"), "{said}");
}

#[test]
fn a_light_that_a_medium_cannot_have_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let medium = ["--spp", "2", "--set", "truth.model=medium"];
    let said = refused(&truth(KNOT, folder.path(), &medium));
    assert!(said.contains("light[0].kind") && said.contains("truth.model = \"dipole\""), "{said}");
    let said = refused(&truth(KNOT, folder.path(), &["--spp", "2", "--set", "truth.bounces=3"]));
    assert!(said.contains("truth.bounces: counts reflections"), "{said}");
    // Where nothing refracts the walk is joined to the light.
    done(&truth(KNOT, folder.path(), &[&medium[..], &["--set", "material.eta=1"]].concat()));
    let neither = refused(&truth(KNOT, folder.path(), &[]));
    assert!(neither.contains("--spp") && neither.contains("--seconds"), "{neither}");
}
