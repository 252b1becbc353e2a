//! `bitlight bake`

use super::progress::Progress;
use super::render::frames;
use super::{AssetFolder, print};
use crate::bake::store::{self, Manifest, Store};
use crate::numeric::parallel;
use crate::pass::{Buffer, Info, Recorder};
use crate::scene::Scene;
use crate::{Error, run};
use std::ops::Range;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// The most poses of one call, as of `prt.poses`: each is looked for in the store first.
const MAX_POSES: usize = 100_000;

#[derive(Debug, clap::Args)]
#[command(after_help = "Writes, for each pose K, pose K being frame K of the scene:\n  \
    STORE/pose.000K.visibility.npy  [vertices, words] u32: a bit a direction, the lowest first\n  \
    STORE/pose.000K.vectors.npy     [vertices, n2, 3]: transfer vectors of a diffuse surface\n  \
    STORE/pose.000K.matrices.npy    [vertices, n2, n2]: transfer matrices of one with a highlight\n  \
    STORE/pose.000K.bounced.npy     [vertices, n2, n2, 3]: in their place, where light bounces\n  \
    STORE/pose.000K.scattered.npy   [vertices, n2, 3]: what was scattered in the solid, with prt.subsurface\n  \
    STORE/manifest.json             what was baked, and every file's shape, type and digest\n\n\
    A bake that was stopped, however, goes on behind the last finished pose. Several processes may bake poses of one \
    store, also at the same time; the bytes do not depend on it.\n\n\
    Examples:\n  bitlight bake scenes/prt/bend.toml -o store\n  \
    bitlight bake scenes/prt/bend.toml -o store --poses 8..16\n  bitlight bake --check store")]
pub(super) struct Arguments {
    /// The scene, of the technique prt
    #[arg(required_unless_present = "check")]
    scene: Option<PathBuf>,
    /// Folder of the store; made if it is not there
    #[arg(short, long, value_name = "STORE", required_unless_present = "check")]
    out: Option<PathBuf>,
    /// Poses A up to B, B left out [default: all, which is 0..N of the scene's prt.poses = N]
    #[arg(long, value_name = "A..B", value_parser = frames)]
    poses: Option<Range<u32>>,
    /// Bake poses again whose files are missing or damaged
    #[arg(long)]
    repair: bool,
    /// Verify every file of a store instead
    #[arg(long, value_name = "STORE", conflicts_with_all = ["scene", "out", "poses", "repair", "set"])]
    check: Option<PathBuf>,
    /// Threads to use; 0 for one a core. The bits do not depend on it
    #[arg(long, value_name = "N", default_value_t = 0)]
    threads: usize,
    #[command(flatten)]
    folder: AssetFolder,
    /// Override a key of the scene, such as prt.bands=6; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

impl Arguments {
    pub(super) fn run(self) -> Result<ExitCode, Error> {
        match (&self.check, &self.scene, &self.out) {
            (Some(folder), ..) => {
                let manifest = store::check(folder)?;
                print(&format!("{}: ok, {}\n", folder.display(), summary(&manifest)))?;
            }
            (None, Some(scene), Some(out)) => self.bake(&Scene::read(scene, &self.set)?, out)?,
            _ => return Err(Error::new("no scene and store are named").remedy("see `bitlight bake --help`")),
        }
        Ok(ExitCode::SUCCESS)
    }

    fn bake(&self, scene: &Scene, out: &PathBuf) -> Result<(), Error> {
        let wanted = run::stored(scene)?;
        let poses = self.poses.clone().unwrap_or(0..scene.prt.poses as u32);
        if poses.len() > MAX_POSES {
            return Err(Error::new(format!("--poses asks for {} poses, over {MAX_POSES}", poses.len()))
                .remedy("bake them in parts"));
        }
        let mut progress = Progress::new(poses.len());
        progress.say("loading");
        let loaded = parallel::with_threads(self.threads, || {
            run::Loaded::new(scene, &self.folder.assets(), &wanted)
        })??;
        let store = Store::open(out, run::baked_from(scene, &loaded))?;
        progress.say("verifying what is there");
        let missing = store.missing(poses.clone(), self.repair)?;
        for _ in missing.len()..poses.len() {
            progress.step();
        }
        let begun = Instant::now();
        for (done, pose) in missing.iter().enumerate() {
            let passed = begun.elapsed().as_secs_f64();
            let left = match done {
                0 => String::new(),
                _ => format!(" {:.0} s left,", passed / done as f64 * (missing.len() - done) as f64),
            };
            let mut passes = Passes { progress: &mut progress, pose: *pose, left };
            let chunks =
                parallel::with_threads(self.threads, || run::bake(scene, &loaded, *pose, &mut passes))?
                    .map_err(|error| Error { what: format!("pose {pose}: {}", error.what), ..error })?;
            let short = |name: &'static str| name.split_once('.').map_or(name, |(_, short)| short);
            let named: Vec<_> = chunks.iter().map(|(name, buffer)| (short(name), buffer)).collect();
            store.put(*pose, &named)?;
            let seconds = begun.elapsed().as_secs_f64() - passed;
            progress.aside(|| print(&format!("pose {pose}: {seconds:.2} s\n")))?;
            progress.step();
        }
        drop(progress);
        let there = poses.len() - missing.len();
        let already = if there > 0 { format!(", {there} were there") } else { String::new() };
        let manifest = Manifest::read(out)?
            .ok_or_else(|| Error::new("has lost its manifest").file(out).remedy("bake it again"))?;
        print(&format!("{}: {} baked{already}; {}\n", out.display(), missing.len(), summary(&manifest)))
    }
}

/// Says which pass of a pose is being computed.
struct Passes<'a> {
    progress: &'a mut Progress,
    pose: u32,
    left: String,
}

impl Recorder for Passes<'_> {
    fn begin(&mut self, pass: &Info) {
        self.progress.say(&format!("pose {},{} {}", self.pose, self.left, pass.name));
    }

    fn record(&mut self, _: &Info, _: bool, _: &Buffer) -> Result<(), Error> {
        Ok(())
    }
}

/// How much a store has, and the digest of it all.
fn summary(manifest: &Manifest) -> String {
    let chunks: Vec<_> = manifest.poses.values().flatten().collect();
    let bytes: usize = chunks.iter().map(|chunk| 4 * chunk.shape.iter().product::<usize>()).sum();
    let (poses, mib) = (manifest.poses.len(), bytes as f64 / f64::from(1 << 20));
    format!("{poses} poses, {} files, {mib:.1} MiB, digest {}", chunks.len(), manifest.digest())
}
