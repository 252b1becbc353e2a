//! How much the nine coefficients E_lm depend on the size of the cubemap's faces: §4 of the translucency paper chose
//! 64 texels, as with 128 and 256 they "did not significantly change". Prints a table in Markdown for the real models:
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

const SIZES: [usize; 4] = [32, 64, 128, 256];

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
    println!(
        "The change of E_lm against faces of 256², in % of the length of the nine, green, of the point light.\n"
    );
    println!("| model | faces | all nine | E00 | E1-1 | E10 | E11 | E2-2 | E2-1 | E20 | E21 | E22 |");
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    for model in ["bunny", "buddha", "armadillo"] {
        let coefficients = SIZES.map(|size| coefficients(model, size));
        let [_, _, _, finest] = &coefficients;
        let finest = finest.clone()?;
        let length = |of: &[f64; 9]| of.iter().map(|value| value * value).sum::<f64>().sqrt();
        for (size, coefficients) in SIZES.iter().zip(coefficients).take(3) {
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
