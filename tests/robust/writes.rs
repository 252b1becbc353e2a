//! Folders that refuse: old files stay whole, nothing half-written appears, and the message says what to do.

use super::{Place, SCENE, assert_refused, command, names, stderr};
use bitlight::run;
use bitlight::scene::{Assets, Scene};
use bitlight::store::Files;
use bitlight::store::file;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Every file of a folder with its bytes.
fn contents(folder: &Path) -> Vec<(String, Vec<u8>)> {
    names(folder).into_iter().map(|name| (name.clone(), std::fs::read(folder.join(name)).unwrap())).collect()
}

/// A place whose folder `out` has every file of a first frame.
fn rendered() -> (Place, Vec<(String, Vec<u8>)>) {
    let place = Place::new(SCENE);
    let output = place.render(&["--passes", "all"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let old = contents(&place.0.path().join("out"));
    assert_eq!(old.len(), 6, "{:?}", place.out());
    (place, old)
}

#[test]
fn a_folder_that_cannot_be_is_refused_before_the_first_pass() {
    let place = Place::new(SCENE);
    place.write("out", "a file in the way");
    assert_refused(&place.render(&[]), &["out: cannot be made", "-o"], "a file");
    let below = place.path("out/below");
    let output = place.render(&["-o", &below]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    let call = |folder: &str| super::bitlight(&["render", &place.path("a.toml"), "-o", folder]);
    assert_refused(&call(&below), &["out/below: cannot be made", "-o"], "below a file");
    assert_refused(&call("/proc/none"), &["/proc/none: cannot be made", "-o"], "/proc");
    assert_refused(&call("/proc"), &["/proc: cannot be written into", "-o"], "/proc itself");
    assert_refused(&call(&"x".repeat(300)), &["cannot be made"], "a name too long");
    assert_eq!(call("").status.code(), Some(2), "no name");
    assert_eq!(std::fs::read_to_string(place.path("out")).unwrap(), "a file in the way");
}

#[test]
fn a_folder_in_the_place_of_a_file_changes_nothing() {
    for name in ["a.png", "a.exr", "a.json", "a.passes.png"] {
        let (place, _) = rendered();
        let out = place.0.path().join("out");
        std::fs::remove_file(out.join(name)).unwrap();
        let old = contents(&out);
        std::fs::create_dir(out.join(name)).unwrap();
        let output = place.render(&["--passes", "all", "--set", "camera.fov=50"]);
        assert_refused(&output, &[name, "a folder has its name"], name);
        std::fs::remove_dir(out.join(name)).unwrap();
        assert_eq!(contents(&out), old);
    }
}

#[test]
fn a_refused_frame_leaves_the_old_files_whole() {
    let (place, old) = rendered();
    for set in ["light[0].position=[0,0,0]", "camera.fov=0", "image.width=9000", "solid.center=[1e9,0,0]"] {
        assert_refused(&place.render(&["--passes", "all", "--set", set]), &[], set);
        assert_eq!(contents(&place.0.path().join("out")), old, "{set}");
    }
}

#[test]
fn a_file_that_may_not_be_written_is_replaced_whole_where_its_folder_may() {
    // As with any program that writes beside and renames: the folder's permission counts, not the file's.
    let (place, _) = rendered();
    let file = place.0.path().join("out/a.png");
    let mut permissions = std::fs::metadata(&file).unwrap().permissions();
    permissions.set_readonly(true);
    std::fs::set_permissions(&file, permissions).unwrap();
    let old = std::fs::read(&file).unwrap();
    assert!(place.render(&["--set", "camera.fov=50"]).status.success());
    assert_ne!(std::fs::read(&file).unwrap(), old);
}

/// Runs the second frame, larger than the first, and holds the folder against what it was.
fn assert_unchanged(output: &Output, parts: &[&str], out: &Path, old: &[(String, Vec<u8>)]) {
    assert_refused(output, parts, "a full disk");
    assert!(contents(out) == old, "a file changed, came or went: {:?}", names(out));
}

/// A limit on the size of files makes every longer write fail half-way, like a full disk does.
#[test]
fn a_write_that_fails_half_way_leaves_the_old_files_whole() {
    let (place, old) = rendered();
    let out = place.0.path().join("out");
    // The limit counts blocks of 512 bytes or of 1024; the first file that is longer is the EXR or the sheet.
    for blocks in [0, 1, 8, 64] {
        let large = ["--passes", "all", "--set", "image.width=200", "--set", "image.height=200"];
        let output = limited(blocks, &place, "render", &large);
        assert_unchanged(&output, &["cannot be written", "make room"], &out, &old);
    }
}

#[test]
fn an_export_that_fails_half_way_leaves_the_old_files_whole() {
    let place = Place::new(SCENE);
    let export = super::bitlight(&["export", &place.path("a.toml"), "-o", &place.path("out")]);
    assert!(export.status.success(), "{}", stderr(&export));
    let out = place.0.path().join("out");
    let old = contents(&out);
    assert_eq!(old.len(), 11);
    for blocks in [0, 8, 40] {
        let output = limited(blocks, &place, "export", &["--set", "solid.resolution=40"]);
        assert_unchanged(&output, &["cannot be written", "make room"], &out, &old);
    }
}

/// Runs a command under which no file may grow beyond so many blocks.
fn limited(blocks: usize, place: &Place, action: &str, more: &[&str]) -> Output {
    let mut shell = Command::new("sh");
    shell.args(["-c", &format!("trap '' XFSZ; ulimit -f {blocks} && exec \"$0\" \"$@\"")]);
    shell.args([env!("CARGO_BIN_EXE_bitlight"), action, &place.path("a.toml"), "-o", &place.path("out")]);
    shell.args(more).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).output().unwrap()
}

/// A real full disk: a small file system in memory, where this process may mount one.
#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_leaves_the_old_files_whole() {
    let place = Place::new(SCENE);
    let out = place.0.path().join("out");
    std::fs::create_dir(&out).unwrap();
    let mount = |arguments: &[&str]| Command::new("mount").args(arguments).arg(&out).output();
    match mount(&["-t", "tmpfs", "-o", "size=256k", "none"]) {
        Ok(done) if done.status.success() => {}
        refused => {
            let why = refused.map_or_else(|error| error.to_string(), |done| stderr(&done));
            super::skip("a full disk", &format!("no file system can be mounted here: {}", why.trim()));
            return;
        }
    }
    let outcome = std::panic::catch_unwind(|| {
        assert!(place.render(&["--passes", "all"]).status.success());
        let old = contents(&out);
        let large = ["--passes", "all", "--set", "image.width=400", "--set", "image.height=400"];
        assert_unchanged(&place.render(&large), &["No space left", "make room"], &out, &old);
        // Not a block is left.
        while std::fs::write(out.join(format!("fill{}", names(&out).len())), [7; 4096]).is_ok() {}
        let old = contents(&out);
        assert_unchanged(&place.render(&["--passes", "all"]), &["No space left", "make room"], &out, &old);
    });
    let unmounted = Command::new("umount").arg(&out).status().unwrap();
    assert!(unmounted.success());
    outcome.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
}

#[test]
fn a_folder_that_vanishes_is_an_error_that_names_it() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let scene = Scene::parse(SCENE, "a.toml".as_ref(), &[]).unwrap();
    let mut files = Files::new(&out, "a", || 0.0).unwrap();
    run::render(&scene, &Assets::default(), &scene.technique.wanted("all").unwrap(), &mut files).unwrap();
    std::fs::remove_dir_all(&out).unwrap();
    let error = files.write(Path::new("a.toml"), &scene.settings(), 0.0).unwrap_err();
    assert!(error.file.as_ref().is_some_and(|file| file.starts_with(&out)), "{error}");
    assert!(error.to_string().contains("cannot be written") && error.remedy.is_some(), "{error}");
    assert!(!out.exists());

    let mut files = Files::new(&out, "a", || 0.0).unwrap();
    run::render(&scene, &Assets::default(), &scene.technique.wanted("all").unwrap(), &mut files).unwrap();
    let batch = files.write(Path::new("a.toml"), &scene.settings(), 0.0).unwrap();
    std::fs::remove_dir_all(&out).unwrap();
    let error = batch.commit().unwrap_err();
    assert!(error.to_string().contains("cannot be written"), "{error}");
}

#[test]
fn frames_that_are_written_at_once_into_one_folder_are_whole() {
    let place = Place::new(SCENE);
    let start = |fov: &str| {
        let mut command = command();
        command.args([
            "render",
            &place.path("a.toml"),
            "-o",
            &place.path("out"),
            "--passes",
            "all",
            "--set",
            fov,
        ]);
        command.stdout(Stdio::null()).spawn().unwrap()
    };
    let all: Vec<_> = (0..6).map(|number| start(&format!("camera.fov={}", 30 + number))).collect();
    for mut process in all {
        assert!(process.wait().unwrap().success());
    }
    let out = place.0.path().join("out");
    assert_eq!(
        names(&out),
        [
            "a.exr",
            "a.json",
            "a.passes.png",
            "a.png",
            "a.translucency.matrices.npy",
            "a.translucency.projection.npy"
        ]
    );
    file::read_exr(&out.join("a.exr")).unwrap();
    file::read_npy(&out.join("a.translucency.matrices.npy")).unwrap();
    serde_json::from_slice::<serde_json::Value>(&std::fs::read(out.join("a.json")).unwrap()).unwrap();
    for name in ["a.png", "a.passes.png"] {
        image::load_from_memory(&std::fs::read(out.join(name)).unwrap()).unwrap();
    }
}
