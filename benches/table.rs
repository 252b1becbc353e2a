//! Makes the tables of speed in docs/measurements.md: prints them, or puts them between the marks of that
//! file.
//!
//! ```sh
//! BITLIGHT_ASSETS=… cargo bench --bench table -- docs/measurements.md
//! ```
//!
//! Every figure is a median over frames of which each has another camera, light and shape. One thread and two
//! take turns, frame by frame, and so do the solids, twelve frames each, so that a clock that drifts shows in
//! none.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program talks to its terminal")]

mod workload;

use bitlight::Error;
use bitlight::pass::{Info, Timings};
use bitlight::run::keep_memory;
use bitlight::scene::Assets;
use bitlight::techniques::translucency::PASSES;
use rayon::ThreadPool;
use std::fmt::Write;
use std::process::{Command, ExitCode};
use std::time::{Duration, Instant};
use workload::{BUNNY, FINAL, GBUFFER, KNOT, MODELS, Workload};

/// Frames of a round and of a median.
const FRAMES: usize = 60;

/// Turns in which the solids render them.
const TURNS: usize = 5;

/// The same where something grows.
const GROWTH_FRAMES: usize = 12;

/// After so long a median is one of fewer frames, of five at least.
const LONGEST: Duration = Duration::from_secs(10);

/// What stands around the tables in a file.
const MARKS: [&str; 2] = ["<!-- speed -->\n", "<!-- /speed -->\n"];

fn main() -> ExitCode {
    keep_memory();
    let file = std::env::args().skip(1).find(|argument| !argument.starts_with('-'));
    let done = tables().and_then(|text| match file {
        Some(file) => put(&file, &text),
        None => {
            print!("{text}");
            Ok(())
        }
    });
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

/// Puts a text between the marks of a file.
fn put(file: &str, text: &str) -> Result<(), Error> {
    let refused = |error: std::io::Error| Error::new(error.to_string()).file(file);
    let old = std::fs::read_to_string(file).map_err(refused)?;
    let parts =
        old.split_once(MARKS[0]).and_then(|(before, rest)| Some((before, rest.split_once(MARKS[1])?)));
    let Some((before, (_, after))) = parts else {
        return Err(Error::new("has no place for the tables").file(file).remedy(format!(
            "put the lines {} and {} there",
            MARKS[0].trim(),
            MARKS[1].trim()
        )));
    };
    std::fs::write(file, [before, MARKS[0], text, MARKS[1], after].concat()).map_err(refused)
}

/// A median in each pool, in milliseconds.
type Medians = [f64; 2];

/// Times of a round of frames.
struct Round {
    whole: Medians,
    /// From the solid at rest to the frame's views.
    prepare: Medians,
    /// In the order of running.
    passes: Vec<(&'static str, Medians)>,
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2] * 1e3
}

/// The times of every frame so far in each pool: its parts by name, as [`Round`] orders them.
#[derive(Default)]
struct Times([Vec<Vec<(&'static str, f64)>>; 2]);

impl Times {
    /// Renders frames, each in one pool and in the other, after one that does not count.
    fn add(&mut self, pools: &[ThreadPool; 2], work: &Workload, frames: usize, wanted: &str) {
        let (begun, first) = (Instant::now(), self.0[0].len());
        for number in (0..=frames).take_while(|number| *number <= 5 || begun.elapsed() < LONGEST) {
            for (pool, times) in pools.iter().zip(&mut self.0) {
                let frame = pool.install(|| {
                    let mut timings = Timings::new(workload::clock);
                    let begun = Instant::now();
                    let prepared = work.render(first + number, wanted, &mut timings);
                    let all = [("whole", begun.elapsed().as_secs_f64()), ("prepare", prepared)];
                    all.into_iter().chain(timings.passes).collect()
                });
                if number > 0 {
                    times.push(frame);
                }
            }
        }
    }

    /// Milliseconds that a tenth of the frames need at most in the last pool.
    fn undisturbed(&self) -> f64 {
        let mut times: Vec<_> = self.0[1].iter().map(|frame| frame[0].1).collect();
        times.sort_by(f64::total_cmp);
        times[times.len() / 10] * 1e3
    }

    fn medians(&self) -> Round {
        let column = |row: usize| {
            let of = |times: &Vec<Vec<(_, f64)>>| median(times.iter().map(|frame| frame[row].1).collect());
            (self.0[0][0][row].0, self.0.each_ref().map(of))
        };
        let passes = (2..self.0[0][0].len()).map(column).collect();
        Round { whole: column(0).1, prepare: column(1).1, passes }
    }
}

/// One turn of frames.
fn round(pools: &[ThreadPool; 2], work: &Workload, frames: usize, wanted: &str) -> Round {
    let mut times = Times::default();
    times.add(pools, work, frames, wanted);
    times.medians()
}

fn tables() -> Result<String, Error> {
    let (pools, assets, begun) = (workload::pools(), Assets::from_environment(), Instant::now());
    let load = |what: &str, model, frames, set: &[String]| {
        eprintln!("{:4} s  {what}", begun.elapsed().as_secs());
        // Its preparation has the cores to itself.
        pools[1].install(|| Workload::new(model, frames, set, &assets))
    };
    let mut text = format!(
        "Measured on {}, on {},\nby `BITLIGHT_ASSETS=… cargo bench --bench table -- docs/measurements.md`.\n\n",
        today()?,
        machine()?
    );
    let mut solids = Vec::new();
    for model in &MODELS {
        let work = load(&format!("{} {}", model.name, model.triangles), model, FRAMES, &[])?;
        solids.push((model, work, Times::default()));
    }
    for turn in 0..TURNS {
        eprintln!("{:4} s  turn {} of {TURNS}", begun.elapsed().as_secs(), turn + 1);
        solids.iter_mut().for_each(|(_, work, times)| times.add(&pools, work, FRAMES / TURNS, FINAL));
    }
    let mut rows = Vec::new();
    for (model, work, times) in &solids {
        let whole = times.medians().whole;
        rows.push(format!(
            "{} | {} | {:.0} % | {} | {:.1} | {:.1} | {} | {:.0} | {:.0}",
            model.name,
            thousands(work.triangles),
            100.0 * work.covered / work.pixels as f64,
            pair(whole),
            1e3 / whole[1],
            1e3 / times.undisturbed(),
            model.paper.map_or("".into(), |paper| paper.to_string()),
            whole[0] * 1e6 / work.triangles as f64,
            whole[0] * 1e6 / work.covered
        ));
    }
    table(
        &mut text,
        "solid | triangles | covered | ms, 1 thread | ms, 2 threads | speed-up | frames/s, 2 threads | undisturbed | \
         paper's GPU | ns a triangle | ns a covered pixel",
        &rows,
    );
    text += "\nUndisturbed is the rate that the fastest tenth of the frames reaches. Other work on the machine slows down the \
             rest.\n";
    let (_, work, times) = &solids[0];
    text += "\nThe bunny pass by pass:\n\n";
    let head = "pass | ms, 1 thread | ms, 2 threads | speed-up | share | 1 thread";
    table(&mut text, head, &passes(work, &times.medians()));
    text += "\nHow a knot's frames grow with its triangles and with the image:\n\n";
    let mut rows = Vec::new();
    for (name, settings) in workload::growth() {
        for set in settings {
            let work = load(&format!("{name} {}", set[0]), &KNOT, GROWTH_FRAMES, &set)?;
            let times = round(&pools, &work, GROWTH_FRAMES, FINAL);
            let side = (work.pixels as f64).sqrt();
            rows.push(format!(
                "{} | {side}² | {} | {} | {}",
                thousands(work.triangles),
                pair(times.whole),
                thousands((times.whole[0] * 1e6 / work.triangles as f64) as usize),
                thousands((times.whole[0] * 1e6 / work.covered) as usize)
            ));
        }
    }
    let head =
        "triangles | pixels | ms, 1 thread | ms, 2 threads | speed-up | ns a triangle | ns a covered pixel";
    table(&mut text, head, &rows);
    let work = load("the G-buffer", &BUNNY, FRAMES, &workload::side(1024))?;
    let times = round(&pools, &work, FRAMES, GBUFFER);
    let total = [0, 1].map(|pool| times.passes.iter().map(|pass| pass.1[pool]).sum::<f64>());
    writeln!(
        text,
        "\nThe bunny's G-buffer alone (depth, normal, position) at 1024²: {:.1} ms on one thread, {:.1} ms on two.\n\
         [tests/peers](../tests/peers/README.md) compares it with Mesa llvmpipe.",
        total[0], total[1]
    )
    .map_err(|error| Error::new(error.to_string()))?;
    eprintln!("{:4} s  done", begun.elapsed().as_secs());
    Ok(text)
}

/// A row for each pass, in the order of running.
fn passes(work: &Workload, times: &Round) -> Vec<String> {
    let [shadow, faces] = [512.0 * 512.0, 6.0 * 64.0 * 64.0];
    let per = |info: &Info| match info.name {
        "translucency.cubemap" | "translucency.shadow" | "translucency.vbuffer" => {
            Some((work.triangles as f64, "a triangle"))
        }
        "translucency.transmit" | "translucency.projection" => Some((faces, "a texel")),
        "translucency.peel" | "translucency.blur" => Some((shadow, "a texel")),
        _ if info.is_image() => Some((work.covered, "a covered pixel")),
        _ => None,
    };
    let row = |name: &str, medians: Medians, per: Option<(f64, &str)>| {
        let unit = per.map(|(count, unit)| format!("{:.1} ns {unit}", medians[0] * 1e6 / count));
        let share = 100.0 * medians[0] / times.whole[0];
        format!("{name} | {} | {share:.1} % | {}", pair(medians), unit.unwrap_or_default())
    };
    let mut rows =
        vec![row("(deform, box, views)", times.prepare, Some((work.triangles as f64, "a triangle")))];
    for (name, medians) in &times.passes {
        let info = PASSES.iter().find(|pass| pass.info.name == *name).map(|pass| &pass.info);
        let short = name.split_once('.').map_or(*name, |(_, short)| short);
        rows.push(row(short, *medians, info.and_then(per)));
    }
    rows
}

/// Milliseconds on one thread and on two, and two threads over one: how many times as fast.
fn pair([one, two]: Medians) -> String {
    format!("{one:.2} | {two:.2} | {:.2}", one / two)
}

fn table(text: &mut String, head: &str, rows: &[String]) {
    let columns = head.split(" | ").count();
    *text += &format!("| {head} |\n|{}\n", "---|".repeat(columns));
    for row in rows {
        *text += &format!("| {row} |\n");
    }
}

fn thousands(number: usize) -> String {
    match number / 1000 {
        0 => number.to_string(),
        above => format!("{},{:03}", thousands(above), number % 1000),
    }
}

/// The date in UTC as year-month-day.
fn today() -> Result<String, Error> {
    let date = Command::new("date").args(["-u", "+%F"]).output();
    let date = date.map_err(|error| Error::new(format!("cannot ask for the date: {error}")))?;
    Ok(String::from_utf8_lossy(&date.stdout).trim().into())
}

/// The processor and its cores.
fn machine() -> Result<String, Error> {
    let file = "/proc/cpuinfo";
    let info = std::fs::read_to_string(file).map_err(|error| Error::new(error.to_string()).file(file))?;
    let value = |key: &str| {
        let line = info.lines().find(|line| line.split(':').next().is_some_and(|name| name.trim() == key));
        line.and_then(|line| line.split(':').nth(1)).unwrap_or("?").trim().to_owned()
    };
    let cores = info.lines().filter(|line| line.starts_with("processor")).count();
    let [name, family, model] = ["model name", "cpu family", "model"].map(value);
    Ok(format!("{name} (family {family}, model {model}) with {cores} cores"))
}
