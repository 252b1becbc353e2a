//! `bitlight truth`

use super::progress::Progress;
use super::{AssetFolder, print};
use crate::numeric::order::{max, min};
use crate::numeric::parallel;
use crate::pass::{Files, Recorder};
use crate::run::{TRUTH, Truth, truth::chunk};
use crate::scene::Scene;
use crate::{Error, pass::file::Batch};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// How often the state is written while samples are taken, and when first.
const OFTEN: Duration = Duration::from_secs(60);
const EARLY: Duration = Duration::from_secs(10);

#[derive(Debug, clap::Args)]
#[command(after_help = "Writes, NAME being the scene file's name without its ending:\n  \
    NAME.truth.png     the picture, for eyes\n  \
    NAME.truth.exr     truth.mean, and truth.variance: the variance of that mean (of the samples, over their number)\n  \
    NAME.truth.json    settings, samples, shapes, digests\n  \
    NAME.truth.state   the sums, from which the next run of the same scene goes on\n\n\
    A sample depends on its pixel and number alone: 16 samples and then 64 give the pictures and the state of 64 at \
    once, on any number of threads.\n\n\
    truth.model says what is traced: reflection between surfaces (prt), the dipole of Jensen et al. 2001 \
    (translucency, and prt of a solid that reflects nothing), or a medium. The dipole has no mirrored highlight \
    (material.gloss).\n\n\
    Examples:\n  bitlight truth scenes/translucency/knot.toml --spp 256\n  \
    bitlight truth scenes/translucency/knot.toml --seconds 60 --set image.width=128 --set image.height=128")]
#[command(group = clap::ArgGroup::new("until").required(true).multiple(true).args(["spp", "seconds"]))]
pub(super) struct Arguments {
    /// The scene, a TOML file
    scene: PathBuf,
    /// Samples of every pixel; those of an earlier run count
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(2..=1 << 40))]
    spp: Option<u64>,
    /// Stop after this time, when every pixel has as many samples as the others, two at least
    #[arg(long, value_name = "S", value_parser = seconds)]
    seconds: Option<f64>,
    /// Folder to write into; made if it is not there
    #[arg(short, long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    /// Threads to use; 0 for one a core. The bits do not depend on it
    #[arg(long, value_name = "N", default_value_t = 0)]
    threads: usize,
    #[command(flatten)]
    folder: AssetFolder,
    /// Override a key of the scene, such as truth.bounces=1; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

impl Arguments {
    pub(super) fn run(self) -> Result<ExitCode, Error> {
        let scene = Scene::read(&self.scene, &self.set)?;
        let name = format!("{}.truth", scene.name());
        let state = self.out.join(format!("{name}.state"));
        let mut files = Files::new(&self.out, &name)?;
        let mut progress = Progress::estimate();
        progress.say("loading");
        let mut truth = parallel::with_threads(self.threads, || Truth::new(&scene, &self.folder.assets()))??;
        if let Some(sums) = truth.identity.read(&state, truth.sums.values.len())? {
            truth.sums = sums;
        }
        let (found, begun) = (truth.sums.samples, (Instant::now(), processor_seconds()));
        parallel::with_threads(self.threads, || self.sample(&mut truth, &state, &mut progress))??;
        progress.say("writing");
        let (taken, wall) = (truth.sums.samples - found, begun.0.elapsed().as_secs_f64());
        let processor = processor_seconds().zip(begun.1).map(|(now, then)| now - then);
        for (info, buffer) in TRUTH.iter().zip(truth.buffers()) {
            files.begin(info);
            files.record(info, true, &buffer)?;
        }
        let mut settings = truth.identity.settings.clone();
        settings.insert("truth.samples".into(), truth.sums.samples.into());
        let mut batch: Batch = files.write(&self.scene, &settings, scene.exposure)?;
        batch.write(format!("{name}.state"), |path| truth.identity.write(path, &truth.sums))?;
        let written = batch.commit()?;
        drop(progress);
        written.iter().try_for_each(|path| print(&format!("{}\n", path.display())))?;
        print(&report(&truth, taken, wall, processor))?;
        Ok(ExitCode::SUCCESS)
    }

    /// Takes samples, whole passes over the image, until there are enough or the time is over.
    fn sample(&self, truth: &mut Truth, state: &Path, progress: &mut Progress) -> Result<(), Error> {
        let target = self.spp.unwrap_or(u64::MAX);
        let begun = Instant::now();
        let (mut saved, mut wait, mut next) = (begun, EARLY, 1);
        let mut tell = |samples: f64, begins: bool| {
            let passed = begun.elapsed().as_secs_f64();
            let of_samples = self.spp.map_or(0.0, |spp| samples / spp as f64);
            let of_time = self.seconds.map_or(0.0, |seconds| min(passed / seconds, 1.0));
            let all = self.spp.map_or_else(String::new, |spp| format!("/{spp}"));
            progress.at(max(of_samples, of_time), &format!("{samples:.1}{all} samples"), begins);
        };
        tell(truth.sums.samples as f64, true);
        while truth.sums.samples < target {
            let elapsed = begun.elapsed().as_secs_f64();
            // At least two samples: one has no variance.
            if self.seconds.is_some_and(|seconds| elapsed >= seconds) && truth.sums.samples > 1 {
                break;
            }
            let pass = Instant::now();
            let (there, pixels) = (truth.sums.samples, truth.sums.values.len() as f64);
            let step = u64::min(next, target - there);
            truth.advance(there + step, &mut |done| {
                tell(there as f64 + step as f64 * (done as f64 / pixels), false);
            });
            let left = self.seconds.map_or(1.0, |seconds| seconds - begun.elapsed().as_secs_f64());
            let rate = chunk(step, pass.elapsed().as_secs_f64());
            next = u64::min(rate, u64::max((rate as f64 * left) as u64, 1));
            // What took long is not lost, were it the first sample.
            if saved.elapsed() > wait {
                truth.identity.write(state, &truth.sums)?;
                (saved, wait) = (Instant::now(), OFTEN);
            }
        }
        Ok(())
    }
}

/// What was done, for a person.
fn report(truth: &Truth, taken: u64, wall: f64, processor: Option<f64>) -> String {
    let samples = truth.sums.samples;
    if taken == 0 {
        return format!("{samples} samples a pixel were there already\n");
    }
    let paths = taken as f64 * truth.sums.values.len() as f64;
    let rate = match processor {
        Some(seconds) if seconds > 0.05 => {
            format!("; {:.0} thousand paths a second of processor time", paths / seconds * 1e-3)
        }
        _ => String::new(),
    };
    format!("{samples} samples a pixel, {taken} of them now in {wall:.1} s{rate}\n")
}

/// The processor time that this process has used, of all threads, where the system tells: Linux counts it in hundredths.
fn processor_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name, in parentheses, may hold spaces; user and system time are the 14th and 15th field.
    let mut fields = text.rsplit_once(')')?.1.split_whitespace().skip(11);
    let mut ticks = || fields.next()?.parse::<f64>().ok();
    Some((ticks()? + ticks()?) / 100.0)
}

/// Reads a time in seconds.
fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds > 0.0 && seconds <= 1e9 => Ok(seconds),
        _ => Err("a number of seconds above 0".into()),
    }
}
