//! `bitlight render`

use super::progress::Progress;
use super::{AssetFolder, print, sheet};
use crate::numeric::parallel;
use crate::pass::{Files, Recorder};
use crate::scene::Scene;
use crate::{Error, run};
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(after_help = "Writes, NAME being the scene file's name without its ending:\n  \
    NAME.png                   the picture, for eyes\n  \
    NAME.passes.png            every requested image on one sheet, for eyes (with several passes)\n  \
    NAME.exr                   the images, linear, one part a pass (and light)\n  \
    NAME.technique.pass.npy    what is no image\n  \
    NAME.json                  settings, and every pass that ran: shape, type, digest, seconds\n\n\
    Example:\n  bitlight render scenes/translucency/knot.toml --passes all --set translucency.cubemap=32")]
pub(super) struct Arguments {
    /// The scene, a TOML file (`bitlight init` writes one)
    scene: PathBuf,
    /// Folder to write into; made if it is not there
    #[arg(short, long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    /// `final`, `all`, or names separated by commas, as `bitlight passes` lists them
    #[arg(long, default_value = "final")]
    passes: String,
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
        let wanted = run::wanted(&self.passes)?;
        let mut files = Files::new(&self.out, &scene.name())?;
        let mut progress = Progress::new(run::passes().count());
        progress.say("loading");
        parallel::with_threads(self.threads, || {
            let mut sinks: Vec<&mut dyn Recorder> = vec![&mut files, &mut progress];
            run::render(&scene, &self.folder.assets(), &wanted, &mut sinks)
        })??;
        progress.say("writing");
        let (sheet, seconds) = (sheet::draw(files.kept())?, files.seconds());
        let mut batch = files.write(&self.scene, &scene.settings, scene.exposure)?;
        if let Some(sheet) = sheet {
            batch.write(format!("{}.passes.png", scene.name()), |path| sheet.write(path))?;
        }
        let written = batch.commit()?;
        drop(progress);
        for path in &written {
            print(&format!("{}\n", path.display()))?;
        }
        print(&format!("{seconds:.3} s in passes\n"))?;
        Ok(ExitCode::SUCCESS)
    }
}
