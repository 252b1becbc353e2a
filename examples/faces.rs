//! How much the nine coefficients E_lm depend on the size of the cubemap's faces: §4 of the translucency
//! paper chose 64 texels, since 128 and 256 made no significant difference. Prints the table in
//! docs/measurements.md, from the real models:
//!
//! ```sh
//! BITLIGHT_ASSETS=… cargo run --release --example faces
//! ```

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program talks to its terminal")]

use bitlight::Error;
use bitlight::pass::Kept;
use bitlight::run;
use bitlight::scene::{Assets, Scene};
use std::path::PathBuf;
use std::process::ExitCode;

/// Texels along a side; the last is what the others are held against.
const SIZES: [usize; 5] = [32, 64, 128, 256, 512];

fn main() -> ExitCode {
    match table() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

fn table() -> Result<(), Error> {
    println!("| model | faces | all nine | E00 | E1-1 | E10 | E11 | E2-2 | E2-1 | E20 | E21 | E22 |");
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    for model in ["bunny", "buddha", "armadillo"] {
        let coefficients = SIZES.map(|size| coefficients(model, size));
        let [.., finest] = &coefficients;
        let finest = finest.clone()?;
        let length = |of: &[f64; 9]| of.iter().map(|value| value * value).sum::<f64>().sqrt();
        for (size, coefficients) in SIZES.iter().zip(coefficients).take(SIZES.len() - 1) {
            let coefficients = coefficients?;
            let change: [f64; 9] =
                std::array::from_fn(|i| 100.0 * (coefficients[i] - finest[i]) / length(&finest));
            let each: Vec<String> = change.iter().map(|change| format!("{change:+.3}")).collect();
            println!("| {model} | {size}² | {:.3} | {} |", length(&change), each.join(" | "));
        }
    }
    Ok(())
}

/// The nine of the first light, which is a point, in green.
fn coefficients(model: &str, size: usize) -> Result<[f64; 9], Error> {
    let file = PathBuf::from(format!("scenes/assets/translucency/{model}.toml"));
    let scene = Scene::read(&file, &[format!("translucency.cubemap={size}")])?;
    let mut kept = Kept::default();
    run::render(&scene, &Assets::from_environment(), &["translucency.projection"], &mut kept)?;
    let buffer = kept.get("translucency.projection").map(|buffer| buffer.as_f32()).unwrap_or_default();
    Ok(std::array::from_fn(|i| f64::from(buffer[i * 3 + 1])))
}
