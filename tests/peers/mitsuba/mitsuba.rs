//! Compares the truth with Mitsuba 3, pixel by pixel: `tests/peers/mitsuba/run.sh` starts this with the
//! folder of Mitsuba's environment, and of scenes if not all are wanted. Then both render in turns, on one
//! thread each, and the measure is CPU time.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program talks to its terminal")]
#![allow(clippy::disallowed_methods, reason = "statistics of results, not results")]

#[path = "../peer.rs"]
mod peer;
mod scenes;

use peer::{Peer, measure, medians};
use rayon::ThreadPoolBuilder;
use scenes::{Estimate, Outcome, Table, mean};
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const SCENES: [&str; 9] = [
    "diffuse-sky",
    "diffuse-lamp",
    "phong-sky",
    "phong-sun",
    "cook-torrance-sky",
    "cook-torrance-lamp",
    "translucent-constant",
    "translucent-sky",
    "translucent-forward",
];

/// Passes of Mitsuba and samples a pixel of each.
const PASSES: [usize; 2] = [128, 64];

/// Our samples a pixel.
const SAMPLES: u64 = 4096;

/// Turns that each takes, and samples a pixel of a turn.
const TURNS: usize = 3;
const TURN: u64 = 128;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = PathBuf::from(arguments.next().ok_or("name the peer's folder: see run.sh")?);
    let wanted: Vec<_> = arguments.collect();
    let here = Path::new("tests/peers/mitsuba");
    // Kept, since the time of threads that have ended is not counted.
    let pool = ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut command = Command::new(folder.join("venv/bin/python"));
    let mut peer = Peer::start(command.arg(here.join("peer.py")).arg(&folder), "Mitsuba")?;
    println!(
        "Peer: {}, {} passes of {} samples a pixel; bitlight: {SAMPLES}.\n",
        peer.name, PASSES[0], PASSES[1]
    );
    println!(
        "| scene | tests | pass | largest \\|t\\| | allowed | mean t² | mean of all pixels, bitlight less Mitsuba, in \
         thousandths | M samples/s, bitlight | Mitsuba | ratio of CPU time |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for name in
        SCENES.into_iter().filter(|name| wanted.is_empty() || wanted.iter().any(|wanted| wanted == name))
    {
        // A table that is there is kept.
        if !folder.join(name).exists() {
            peer.ask(&format!("table {name} {} {}", PASSES[0], PASSES[1]))?;
        }
        let table = Table::read(&here.join(name).with_extension("json"))?;
        let theirs = estimates(&fs::read(folder.join(name))?);
        let sums = table.render(SAMPLES);
        let ours: Vec<_> = (0..theirs.len()).map(|pixel| [sums.mean(pixel), sums.variance(pixel)]).collect();
        fs::write(folder.join(format!("{name}-bitlight")), bytes(&ours))?;
        let outcome = Outcome::new(&ours, &theirs, table.passes);
        let [ours, theirs] = [mean(&ours), mean(&theirs)];
        let difference = [0, 1, 2].map(|channel| {
            let error = (ours[1][channel] + theirs[1][channel]).sqrt();
            format!("{:.3} ± {:.3}", (ours[0][channel] - theirs[0][channel]) * 1e3, error * 1e3)
        });

        let mut turns = [vec![], vec![]];
        for turn in 0..=TURNS {
            turns[1].push(peer.measure(&format!("render {name} {TURN} {turn}"))?);
            turns[0].push(measure(std::process::id(), || {
                pool.install(|| drop(std::hint::black_box(table.render(TURN))));
                Ok(())
            })?);
        }
        let samples = (table.view.size[0] * table.view.size[1]) as f64 * TURN as f64;
        // Of all turns but the first.
        let [ours, theirs] = turns.map(|turns| medians(&turns[1..])[0]);
        println!(
            "| {name} | {} | {:.2} % | {:.2} | {:.2} | {:.3} | {} | {:.2} | {:.2} | {:.2} |",
            outcome.tests,
            outcome.passed as f64 / outcome.tests as f64 * 100.0,
            outcome.most[0],
            outcome.most[1],
            outcome.spread,
            difference.join(", "),
            samples / ours / 1e6,
            samples / theirs / 1e6,
            ours / theirs
        );
        eprintln!("{name}: done");
    }
    Ok(())
}

/// Means and their variances, as peer.py writes them.
fn estimates(bytes: &[u8]) -> Vec<Estimate> {
    let values: Vec<f64> = bytes.as_chunks().0.iter().map(|value| f64::from_ne_bytes(*value)).collect();
    let (means, variances) = values.split_at(values.len() / 2);
    means
        .as_chunks()
        .0
        .iter()
        .zip(variances.as_chunks().0)
        .map(|(mean, variance)| [*mean, *variance])
        .collect()
}

/// As peer.py writes means and variances.
fn bytes(estimates: &[Estimate]) -> Vec<u8> {
    let values =
        [0, 1].into_iter().flat_map(|which| estimates.iter().flat_map(move |estimate| estimate[which]));
    values.flat_map(f64::to_ne_bytes).collect()
}
