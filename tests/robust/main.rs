//! Bad input, extreme input and a refusing system: a clear error or a stated behaviour each; no panic, no
//! hang, no NaN, no half-written file.
#![cfg(feature = "cli")]

extern crate exr as exr_files;

mod extremes;
mod files;
mod fuzz;
mod scenes;
mod writes;

use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// A scene that renders in a blink; cases change it by [`scene`] or `--set`.
const SCENE: &str = r#"technique = "translucency"
[image]
width = 24
height = 16
[camera]
position = [0, 0, 4]
[solid]
shape = "cuboid"
resolution = 3
[[light]]
kind = "point"
position = [0, 3, 3]
intensity = [9, 9, 9]
[translucency]
cubemap = 4
shadow = 16
"#;

/// What a refusal or a tiny frame may take on a busy machine in a debug build: less than a hang.
const PATIENCE: Duration = Duration::from_secs(60);

fn command() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bitlight"));
    command.env_remove("BITLIGHT_ASSETS").env("RAYON_NUM_THREADS", "2").stdin(Stdio::null());
    command
}

fn bitlight(arguments: &[&str]) -> Output {
    let begun = Instant::now();
    let output = command().args(arguments).output().unwrap();
    assert!(begun.elapsed() < PATIENCE, "{arguments:?} took {:?}", begun.elapsed());
    output
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Exit status 2, and one line that says the `parts` and what to do.
fn assert_refused(output: &Output, parts: &[&str], what: &str) {
    let text = stderr(output);
    assert_eq!(output.status.code(), Some(2), "{what}: {text}");
    assert!(text.starts_with("error: ") && text.lines().count() == 1, "{what}: {text}");
    assert!(text.len() < 1000 && text.contains("; "), "{what} names no remedy: {text}");
    for part in parts {
        assert!(text.contains(part), "{what} does not say {part:?}: {text}");
    }
}

/// Says so past the test harness, which would keep the output of a passing test to itself.
fn skip(what: &str, why: &str) {
    let mut screen = std::io::stderr();
    writeln!(screen, "skipped the test of {what}: {why}").unwrap();
}

/// The names in a folder, sorted; none where it is not there.
fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten();
    let mut names: Vec<_> =
        entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// A folder with the scene `a.toml`, and a folder `out` that is not there yet.
struct Place(tempfile::TempDir);

impl Place {
    fn new(scene: &str) -> Self {
        let place = Self(tempfile::tempdir().unwrap());
        place.write("a.toml", scene);
        place
    }

    fn path(&self, name: &str) -> String {
        self.0.path().join(name).to_string_lossy().into_owned()
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> String {
        std::fs::write(self.0.path().join(name), bytes).unwrap();
        self.path(name)
    }

    fn render(&self, more: &[&str]) -> Output {
        let (scene, out, assets) = (self.path("a.toml"), self.path("out"), self.path(""));
        bitlight(&[&["render", &scene, "-o", &out, "--assets", &assets], more].concat())
    }

    fn out(&self) -> Vec<String> {
        names(&self.0.path().join("out"))
    }
}
