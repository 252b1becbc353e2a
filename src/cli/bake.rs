//! `bitlight bake`

use super::progress::Progress;
use super::render::frames;
use super::{Common, clock, print};
use crate::Error;
use crate::run::bake::{self, Step};
use crate::store::{self, Manifest};
use crate::techniques::ALL;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

fn help() -> String {
    let bakes = ALL.iter().filter_map(|technique| Some((technique, technique.bake?)));
    let mut files = String::new();
    for (technique, bake) in bakes.clone() {
        for info in technique.passes.iter().filter(|info| bake.passes.contains(&info.name)) {
            let axes = info.axes.iter().map(|axis| axis.label()).collect::<Vec<_>>().join(", ");
            files += &format!("  STORE/pose.000K.{:<18} [{axes}]\n", format!("{}.npy", info.short()));
        }
    }
    let scene = bakes.map(|(technique, _)| technique.scene).next().unwrap_or_default();
    format!(
        "Writes these files for each pose K, which is frame K of the scene, as far as the scene's surface and settings \
         need them:\n{files}  STORE/manifest.json                what was baked, and every file's shape, type and digest\n\n\
         A bake may be stopped in any way; the next one goes on behind the last finished pose. Several processes may \
         bake poses of one store, also at the same time: give each its own --poses. The bytes are the same. A bake loads no lights.\n\n\
         Examples:\n  bitlight bake {scene} -o store\n  bitlight bake {scene} -o store --poses 8..16\n  \
         bitlight bake --check store"
    )
}

#[derive(Debug, clap::Args)]
#[command(after_help = help())]
pub(super) struct Arguments {
    /// The scene, of a technique that bakes
    #[arg(required_unless_present = "check")]
    scene: Option<PathBuf>,
    /// Folder of the store; made if it is not there
    #[arg(short, long, value_name = "STORE", required_unless_present = "check")]
    out: Option<PathBuf>,
    /// Poses A up to B, B left out [default: all that the scene has]
    #[arg(long, value_name = "A..B", value_parser = frames)]
    poses: Option<Range<u32>>,
    /// Bake again the poses whose files are missing or damaged
    #[arg(long)]
    repair: bool,
    /// Verify every file of a store instead
    #[arg(long, value_name = "STORE", conflicts_with_all = ["scene", "out", "poses", "repair", "set"])]
    check: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
}

impl Arguments {
    pub(super) fn run(self) -> Result<ExitCode, Error> {
        match (&self.check, &self.scene, &self.out) {
            (Some(folder), ..) => {
                let manifest = store::check(folder)?;
                print(&format!("{}: ok, {}\n", folder.display(), summary(&manifest)))?;
            }
            (None, Some(scene), Some(out)) => self.common.run(|| self.bake(scene, out))?,
            _ => return Err(Error::new("no scene and store are named").remedy("see `bitlight bake --help`")),
        }
        Ok(ExitCode::SUCCESS)
    }

    fn bake(&self, scene: &Path, out: &Path) -> Result<(), Error> {
        let scene = self.common.scene(scene)?;
        let mut progress = Progress::new(0);
        let (mut begun, mut last, mut done, mut all) = (clock(), clock(), 0, 0);
        let mut told = |step: Step<'_>| {
            match step {
                Step::Loading => progress.say("loading"),
                Step::Verifying => progress.say("verifying what is there"),
                Step::Found(there, missing) => {
                    progress.count(there + missing, there);
                    (begun, all) = (clock(), missing);
                    last = begun;
                }
                Step::Pass(pose, info) => {
                    let left = match done {
                        0 => String::new(),
                        _ => format!(" {:.0} s left,", (last - begun) / done as f64 * (all - done) as f64),
                    };
                    progress.say(&format!("pose {pose},{left} {}", info.name));
                }
                Step::Stored(pose) => {
                    let seconds = clock() - last;
                    (last, done) = (last + seconds, done + 1);
                    progress.aside(|| print(&format!("pose {pose}: {seconds:.2} s\n")))?;
                    progress.step();
                }
            }
            Ok(())
        };
        let baked =
            bake::bake(&scene, &self.common.assets(), out, self.poses.clone(), self.repair, &mut told)?;
        drop(progress);
        let there = if baked.there > 0 { format!(", {} were there", baked.there) } else { String::new() };
        print(&format!("{}: {} baked{there}; {}\n", out.display(), baked.baked, summary(&baked.manifest)))
    }
}

/// How much a store has, and the digest of it all.
fn summary(manifest: &Manifest) -> String {
    let chunks: Vec<_> = manifest.entries.values().flatten().collect();
    let bytes: usize = chunks.iter().map(|chunk| 4 * chunk.shape.iter().product::<usize>()).sum();
    let (entries, mib) = (manifest.entries.len(), bytes as f64 / f64::from(1 << 20));
    format!("{entries} poses, {} files, {mib:.1} MiB, digest {}", chunks.len(), manifest.digest())
}
