//! The proof that this build, on this processor, gives the goldens' bits: every scene below `scenes` that has
//! a manifest below `golden` and needs no asset is rendered, and every pass compared.
//!
//! `BITLIGHT_THREADS` is the number of threads (0, or nothing: one for each core). The last line has one
//! digest of all that was rendered; `tools/proofs.sh` holds it against other builds and other processors.
//!
//! Exit status 0 if every pass of every scene is the golden's, 1 if one differs or there is none, 2 for bad
//! input.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program talks to its terminal")]

use bitlight::compare::{Golden, Verdict};
use bitlight::pass::Digests;
use bitlight::scene::{Assets, Scene};
use bitlight::store::file;
use bitlight::{Error, run};
use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    match threads().and_then(|threads| on(threads, prove)) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

fn threads() -> Result<usize, Error> {
    let Some(text) = std::env::var_os("BITLIGHT_THREADS") else { return Ok(0) };
    let number = text.to_str().and_then(|text| text.parse().ok());
    number
        .ok_or_else(|| Error::new("BITLIGHT_THREADS is no number of threads").remedy("set it to 0, 1, 2..."))
}

#[cfg(feature = "threads")]
fn on(threads: usize, work: fn() -> Result<bool, Error>) -> Result<bool, Error> {
    bitlight::numeric::parallel::with_threads(threads, work)?
}

#[cfg(not(feature = "threads"))]
fn on(threads: usize, work: fn() -> Result<bool, Error>) -> Result<bool, Error> {
    if threads > 1 {
        return Err(Error::new("BITLIGHT_THREADS: this build has no threads").remedy("unset it"));
    }
    work()
}

fn prove() -> Result<bool, Error> {
    let (golden, assets) = (Path::new("golden"), Assets::default());
    let (mut scenes, mut passes, mut same) = (0, 0, true);
    let mut digest = blake3::Hasher::new();
    for file in file::below(Path::new("scenes"), "toml")? {
        let Some(manifest) = Golden::read(golden, &file)? else { continue };
        let scene = Scene::read(&file, &manifest.set)?;
        if !scene.assets().is_empty() {
            continue;
        }
        // The verdict is the comparator's; the digest is of a rendering of our own, so it owes the comparator
        // nothing and tells two builds apart even where both differ from the golden.
        let verdict = Golden::verify(golden, &file, &assets)?;
        let line = match &verdict {
            Verdict::Same(passes) => format!("{passes} passes"),
            Verdict::Differs(pass, _) => format!("FAILED: {pass} differs first"),
            Verdict::Passes(pass) => format!("FAILED: golden and technique differ in the pass {pass}"),
            Verdict::Settings(key, golden, now) => {
                format!("FAILED: the golden was made with {key} = {golden}, the scene has {now}")
            }
            Verdict::Missing(path) => format!("FAILED: there is no golden {}", path.display()),
            Verdict::Skipped(error) => format!("FAILED: {error}"),
        };
        println!("{}: {line}", file.display());
        same &= matches!(verdict, Verdict::Same(_));

        let mut rendered = Digests::default();
        run::render(&scene, &assets, &scene.technique.wanted("all")?, &mut rendered)?;
        for pass in &rendered.0 {
            digest.update(pass.digest.as_bytes());
        }
        scenes += 1;
        passes += rendered.0.len();
    }
    if passes == 0 {
        println!("FAILED: no scene below scenes has a manifest below golden, so nothing is proved");
        return Ok(false);
    }
    println!("{} of {passes} passes, {scenes} scene(s)", digest.finalize().to_hex());
    Ok(same)
}
