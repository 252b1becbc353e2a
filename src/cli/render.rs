//! `bitlight render`

use super::progress::Progress;
use super::{Common, clock, example, print, sheet};
use crate::pass::Recorder;
use crate::run::{Loaded, bake};
use crate::scene::Scene;
use crate::store::Files;
use crate::{Error, techniques};
use std::ops::Range;
use std::path::PathBuf;
use std::process::ExitCode;

fn help() -> String {
    let scene = example();
    let bakes = techniques::ALL.iter().find(|technique| technique.bake.is_some());
    let bakes = bakes.map_or(scene, |technique| technique.scene);
    format!(
        "Writes, NAME being the scene file's name without its ending:\n  \
         NAME.png                   the picture, for eyes\n  \
         NAME.passes.png            every requested image on one sheet, for eyes (with several passes)\n  \
         NAME.exr                   the images, linear, one part a pass (and light)\n  \
         NAME.technique.pass.npy    a buffer that is no image\n  \
         NAME.json                  settings, and every pass that ran: shape, type, digest, seconds\n\n\
         With --frames the files of frame K are those of NAME.000K. With --store nothing is baked: frame K is lit \
         with pose K of a store that `bitlight bake` made of the same solid and transfer; camera and lights may \
         differ. The bits are those of a frame without a store.\n\n\
         Examples:\n  bitlight render {scene} --passes all --set image.width=256\n  \
         bitlight render {scene} --set wave.amplitude=2 --set wave.length=20 --frames 0..24\n  \
         bitlight render {bakes} --store store --frames 0..8"
    )
}

#[derive(Debug, clap::Args)]
#[command(after_help = help())]
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
    /// Read baked poses from this store, and bake nothing
    #[arg(long, value_name = "STORE")]
    store: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
}

impl Arguments {
    pub(super) fn run(self) -> Result<ExitCode, Error> {
        let seconds = self.common.run(|| self.render())?;
        print(&format!("{seconds:.3} s in passes\n"))?;
        Ok(ExitCode::SUCCESS)
    }

    /// Renders the frames that are asked for, and returns the seconds in passes.
    fn render(&self) -> Result<f64, Error> {
        let scene = self.common.scene(&self.scene)?;
        let wanted = scene.technique.wanted(&self.passes)?;
        let steps = scene.technique.passes.len();
        let mut progress = Progress::new(steps * self.frames.as_ref().map_or(1, ExactSizeIterator::len));
        progress.say("loading");
        let load = if self.store.is_some() { bake::load } else { Loaded::new };
        let loaded = load(&scene, &self.common.assets(), &wanted)?;
        let Some(frames) = self.frames.clone() else {
            return self.frame(&scene.name(), &scene, &loaded, &wanted, &mut progress);
        };
        let mut seconds = 0.0;
        for (index, number) in frames.enumerate() {
            progress.frame(number, index * steps);
            let name = format!("{}.{number:04}", scene.name());
            let scene = scene.at(f64::from(number) / scene.frame_rate);
            let frame = self.frame(&name, &scene, &loaded, &wanted, &mut progress);
            seconds +=
                frame.map_err(|error| Error { what: format!("frame {number}: {}", error.what), ..error })?;
        }
        Ok(seconds)
    }

    /// Renders one frame, writes and announces its files, and returns the seconds in passes.
    fn frame(
        &self,
        name: &str,
        scene: &Scene,
        loaded: &Loaded,
        wanted: &[&str],
        progress: &mut Progress,
    ) -> Result<f64, Error> {
        let mut files = Files::new(&self.out, name, clock)?;
        let sinks = &mut vec![&mut files as &mut dyn Recorder, progress];
        match &self.store {
            Some(store) => bake::render(scene, loaded, store, wanted, sinks)?,
            None => loaded.render(scene, wanted, sinks)?,
        }
        progress.say("writing");
        let (sheet, seconds) = (sheet::draw(files.kept())?, files.seconds());
        let mut batch = files.write(&self.scene, &scene.settings(), scene.exposure)?;
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
