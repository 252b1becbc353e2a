//! `bitlight render`

use super::progress::Progress;
use super::{AssetFolder, print, sheet};
use crate::numeric::parallel;
use crate::pass::{Files, Recorder};
use crate::scene::Scene;
use crate::{Error, run};
use std::ops::Range;
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(after_help = "Writes, NAME being the scene file's name without its ending:\n  \
    NAME.png                   the picture, for eyes\n  \
    NAME.passes.png            every requested image on one sheet, for eyes (with several passes)\n  \
    NAME.exr                   the images, linear, one part a pass (and light)\n  \
    NAME.technique.pass.npy    what is no image\n  \
    NAME.json                  settings, and every pass that ran: shape, type, digest, seconds\n\n\
    With --frames the files of frame K are those of NAME.000K.\n\n\
    Examples:\n  bitlight render scenes/translucency/knot.toml --passes all --set translucency.cubemap=32\n  \
    bitlight render scenes/translucency/knot.toml --set wave.amplitude=2 --set wave.length=20 --frames 0..24")]
pub(super) struct Arguments {
    /// The scene, a TOML file (`bitlight init` writes one)
    scene: PathBuf,
    /// Folder to write into; made if it is not there
    #[arg(short, long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    /// `final`, `all`, or names separated by commas, as `bitlight passes` lists them
    #[arg(long, default_value = "final")]
    passes: String,
    /// Render a sequence: frames A up to B, B left out, frame K at time K / `frame_rate` of the scene
    #[arg(long, value_name = "A..B", value_parser = frames)]
    frames: Option<Range<u32>>,
    /// Threads to use; 0 for one a core. The bits do not depend on it
    #[arg(long, value_name = "N", default_value_t = 0)]
    threads: usize,
    #[command(flatten)]
    folder: AssetFolder,
    /// Override a key of the scene, such as translucency.cubemap=32; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

impl Arguments {
    pub(super) fn run(self) -> Result<ExitCode, Error> {
        let scene = Scene::read(&self.scene, &self.set)?;
        let wanted = run::wanted(scene.technique, &self.passes)?;
        let steps = run::passes_of(scene.technique).count();
        let mut progress = Progress::new(steps * self.frames.as_ref().map_or(1, ExactSizeIterator::len));
        progress.say("loading");
        let loaded = parallel::with_threads(self.threads, || {
            run::Loaded::new(&scene, &self.folder.assets(), &wanted)
        })??;
        let mut seconds = 0.0;
        match self.frames.clone() {
            None => seconds += self.frame(&scene.name(), &scene, &loaded, &wanted, &mut progress)?,
            Some(frames) => {
                for (index, number) in frames.enumerate() {
                    progress.frame(number, index * steps);
                    let name = format!("{}.{number:04}", scene.name());
                    let scene = scene.at(f64::from(number) / scene.frame_rate);
                    let frame = self.frame(&name, &scene, &loaded, &wanted, &mut progress);
                    seconds += frame.map_err(|error| Error {
                        what: format!("frame {number}: {}", error.what),
                        ..error
                    })?;
                }
            }
        }
        drop(progress);
        print(&format!("{seconds:.3} s in passes\n"))?;
        Ok(ExitCode::SUCCESS)
    }

    /// Renders one frame, writes and announces its files, and returns the seconds in passes.
    fn frame(
        &self,
        name: &str,
        scene: &Scene,
        loaded: &run::Loaded,
        wanted: &[&str],
        progress: &mut Progress,
    ) -> Result<f64, Error> {
        let mut files = Files::new(&self.out, name)?;
        parallel::with_threads(self.threads, || {
            let mut sinks: Vec<&mut dyn Recorder> = vec![&mut files, progress];
            loaded.render(scene, wanted, &mut sinks)
        })??;
        progress.say("writing");
        let (sheet, seconds) = (sheet::draw(files.kept())?, files.seconds());
        let mut batch = files.write(&self.scene, &scene.settings, scene.exposure)?;
        if let Some(sheet) = sheet {
            batch.write(format!("{name}.passes.png"), |path| sheet.write(path))?;
        }
        let written = batch.commit()?;
        progress.aside(|| written.iter().try_for_each(|path| print(&format!("{}\n", path.display()))))?;
        Ok(seconds)
    }
}

/// Reads `A..B`, at least one frame.
pub(super) fn frames(text: &str) -> Result<Range<u32>, String> {
    let ends =
        text.split_once("..").and_then(|(a, b)| Some((a.trim().parse().ok()?, b.trim().parse().ok()?)));
    match ends {
        Some((first, end)) if first < end => Ok(first..end),
        Some(_) => Err("there is no frame from A up to B, B itself left out; write for example 0..3".into()),
        None => Err("two whole numbers with two dots between; write for example 0..3".into()),
    }
}
