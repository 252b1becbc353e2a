//! `bitlight export`

use super::progress::Progress;
use super::{AssetFolder, print};
use crate::numeric::parallel;
use crate::pass::file::{self, Batch};
use crate::pass::{Axis, Digests, Recorder, npy};
use crate::scene::Scene;
use crate::world::write;
use crate::{Error, run};
use serde_json::{Value as Json, json};
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

/// The endings of the files behind the scene's name, and what they hold.
const FILES: [(&str, &str); 11] = [
    ("export.json", "conventions, camera, lights, views, material, formulas, every pass with its digest"),
    ("obj", "the solid where the scene puts it, in the scene's unit"),
    ("glb", "the same; its node scales it to metres"),
    ("camera.npy", "[4, 4] clip_from_world, row-major"),
    ("shadow.npy", "[casting lights, 4, 4] the same of the shadow maps"),
    ("cubemap.npy", "[6, 4, 4] the same of the cubemap's faces"),
    ("sh.npy", "[lights, 9, 3] the projection, RGB; of several accumulation points [lights, points, 9, 3]"),
    (
        "matrices.npy",
        "[lights, 3, 4, 4] the matrices of radiosity; of several points [lights, points, 3, 4, 4]",
    ),
    ("positions.npy", "[vertices, 3] of the solid"),
    ("normals.npy", "[vertices, 3] of the solid"),
    ("triangles.npy", "[triangles, 3] of the solid, u32"),
];

fn help() -> String {
    let line = |(ending, about): &(&str, &str)| format!("  NAME.{ending:<15} {about}\n");
    format!(
        "Writes, NAME being the scene file's name without its ending:\n{}\n\
         The passes themselves are what `bitlight render SCENE --passes all` writes.\n\n\
         Example:\n  bitlight export scenes/translucency/knot.toml -o out",
        FILES.iter().map(line).collect::<String>()
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
    folder: AssetFolder,
    /// Override a key of the scene, such as translucency.cubemap=32; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

impl Arguments {
    pub(super) fn run(self) -> Result<ExitCode, Error> {
        let scene = Scene::read(&self.scene, &self.set)?;
        let mut batch = Batch::new(&self.out, &scene.name())?;
        let (mut digests, mut progress) =
            (Digests::default(), Progress::new(run::passes_of(scene.technique).count()));
        let export = parallel::with_threads(0, || {
            let mut sinks: Vec<&mut dyn Recorder> = vec![&mut digests, &mut progress];
            run::export(&scene, &self.folder.assets(), &mut sinks)
        })??;
        drop(progress);
        let name = |ending: &str| format!("{}.{ending}", scene.name());
        let mut report = json!({
            "scene": self.scene.to_string_lossy(),
            "made_by": concat!("bitlight ", env!("CARGO_PKG_VERSION")),
            "command_of_the_passes": self.command(&scene),
        });
        for (ending, about) in FILES {
            report["files"][format!("{}.{ending}", scene.name())] = json!(about);
        }
        for (key, fact) in export.facts.as_object().into_iter().flatten() {
            report[key] = fact.clone();
        }
        report["settings"] = json!(scene.settings);
        report["passes"] = passes(&digests);
        let text = format!("{report:#}\n");
        batch.write(name("export.json"), |path| file::write(path, |out| out.write_all(text.as_bytes())))?;
        batch.write(name("obj"), |path| write::obj(path, &export.solid))?;
        batch.write(name("glb"), |path| write::glb(path, &export.solid, export.metres))?;
        for (array, buffer) in &export.arrays {
            batch.write(name(&format!("{array}.npy")), |path| npy::write(path, buffer))?;
        }
        let written = batch.commit()?;
        for path in &written {
            print(&format!("{}\n", path.display()))?;
        }
        print(&format!("the passes: {}\n", self.command(&scene)))?;
        Ok(ExitCode::SUCCESS)
    }

    /// The command that writes the passes of the same frame.
    fn command(&self, scene: &Scene) -> String {
        let mut words =
            vec!["bitlight".to_owned(), "render".into(), self.scene.to_string_lossy().into_owned()];
        words.extend(self.set.iter().flat_map(|set| ["--set".to_owned(), set.clone()]));
        if let (Some(folder), false) = (self.folder.assets().0, scene.assets().is_empty()) {
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
fn passes(digests: &Digests) -> Json {
    let row = |record: &crate::pass::Record| {
        let mut row = record.to_json();
        for info in run::passes().filter(|info| info.name == record.name) {
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
