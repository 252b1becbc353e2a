//! `bitlight export`

use super::progress::Progress;
use super::{Common, print};
use crate::pass::{Axis, Digests, Recorder};
use crate::scene::{Assets, Scene};
use crate::store::file::{self, Batch};
use crate::techniques::{ALL, Technique};
use crate::world::write;
use crate::{Error, run};
use serde_json::{Value as Json, json};
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

/// The endings of the files behind the scene's name, and what they hold, beside a technique's own arrays.
const FILES: [(&str, &str); 3] = [
    ("export.json", "conventions, camera, lights, views, material, formulas, every pass with its digest"),
    ("obj", "the solid where the scene puts it, in the scene's unit"),
    ("glb", "the same; its node scales it to metres"),
];

/// All files of a technique.
fn files(technique: &Technique) -> Vec<(String, &'static str)> {
    let own = technique.export.iter().flat_map(|export| export.arrays);
    let own = own.map(|(name, about)| (format!("{name}.npy"), *about));
    FILES.iter().map(|(ending, about)| ((*ending).to_owned(), *about)).chain(own).collect()
}

fn help() -> String {
    let mut text = String::from("Writes, NAME being the scene file's name without its ending:\n");
    let exported = ALL.iter().filter(|technique| technique.export.is_some());
    for technique in exported.clone() {
        text += &format!("{}:\n", technique.name);
        for (ending, about) in files(technique) {
            text += &format!("  NAME.{ending:<15} {about}\n");
        }
    }
    let scene = exported.map(|technique| technique.scene).next().unwrap_or_default();
    text + &format!(
        "\nThe passes themselves are what `bitlight render SCENE --passes all` writes.\n\n\
         Example:\n  bitlight export {scene} -o out"
    )
}

#[derive(Debug, clap::Args)]
#[command(after_help = help())]
pub(super) struct Arguments {
    /// The scene, a TOML file
    scene: PathBuf,
    /// Folder to write into; made if it is not there
    #[arg(short, long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    #[command(flatten)]
    common: Common,
}

impl Arguments {
    pub(super) fn run(self) -> Result<ExitCode, Error> {
        self.common.run(|| self.export())?;
        Ok(ExitCode::SUCCESS)
    }

    fn export(&self) -> Result<(), Error> {
        let scene = self.common.scene(&self.scene)?;
        let mut batch = Batch::new(&self.out, &scene.name())?;
        let (mut digests, mut progress) = (Digests::default(), Progress::new(scene.technique.passes.len()));
        let sinks = &mut vec![&mut digests as &mut dyn Recorder, &mut progress];
        let export = run::export(&scene, &self.common.assets(), sinks)?;
        drop(progress);
        let name = |ending: &str| format!("{}.{ending}", scene.name());
        let mut report = json!({
            "scene": self.scene.to_string_lossy(),
            "made_by": concat!("bitlight ", env!("CARGO_PKG_VERSION")),
            "command_of_the_passes": self.command(&scene),
        });
        for (ending, about) in files(scene.technique) {
            report["files"][name(&ending)] = json!(about);
        }
        for (key, fact) in export.facts.as_object().into_iter().flatten() {
            report[key] = fact.clone();
        }
        report["settings"] = json!(scene.settings());
        report["passes"] = passes(scene.technique, &digests);
        let text = format!("{report:#}\n");
        let (solid, metres) = (&export.stage.solid, export.stage.medium.millimetres / 1000.0);
        batch.write(name("export.json"), |path| file::write(path, |out| out.write_all(text.as_bytes())))?;
        batch.write(name("obj"), |path| file::write(path, |out| write::obj(out, solid)))?;
        batch.write(name("glb"), |path| file::write(path, |out| write::glb(out, solid, metres)))?;
        for (array, buffer) in &export.arrays {
            batch.write(name(&format!("{array}.npy")), |path| file::write_npy(path, buffer))?;
        }
        let written = batch.commit()?;
        for path in &written {
            print(&format!("{}\n", path.display()))?;
        }
        print(&format!("the passes: {}\n", self.command(&scene)))
    }

    /// The command that writes the passes of the same frame.
    fn command(&self, scene: &Scene) -> String {
        let mut words =
            vec!["bitlight".to_owned(), "render".into(), self.scene.to_string_lossy().into_owned()];
        words.extend(self.common.set.iter().flat_map(|set| ["--set".to_owned(), set.clone()]));
        if let (Assets::Folder(folder), false) = (self.common.assets(), scene.assets().is_empty()) {
            words.extend(["--assets".to_owned(), folder.to_string_lossy().into_owned()]);
        }
        words.extend(["--passes", "all", "-o"].map(str::to_owned));
        words.push(self.out.to_string_lossy().into_owned());
        words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
    }
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    let plain = |letter: char| letter.is_ascii_alphanumeric() || "._-/=".contains(letter);
    if word.chars().all(plain) { word.to_owned() } else { format!("'{}'", word.replace('\'', "'\\''")) }
}

/// Every pass that ran: what it computes, and the record of its values.
fn passes(technique: &Technique, digests: &Digests) -> Json {
    let row = |record: &crate::pass::Record| {
        let mut row = record.to_json();
        for info in technique.passes.iter().filter(|info| info.name == record.name) {
            let axes = info.axes_of(record.shape.len()).zip(&record.shape).map(|(axis, length)| match axis {
                Axis::Channel(names) => json!({"name": "channel", "length": length, "channels": names}),
                axis => json!({"name": axis.label(), "length": length}),
            });
            row["axes"] = axes.collect();
            row["equation"] = json!(info.equation);
            row["about"] = json!(info.about);
            row["inputs"] = json!(info.inputs);
            row["unit"] = json!(info.unit);
        }
        row
    };
    digests.0.iter().map(row).collect()
}
