//! `bitlight sh`

use super::{AssetFolder, print};
use crate::Error;
use crate::numeric::double::{cos, sin};
use crate::sphere::convention::{Convention, convert};
use crate::sphere::rotation::Rotation;
use crate::sphere::{probes, sh};
use crate::store::file;
use serde_json::{Value as Json, json};
use std::io::Read;
use std::path::Path;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Coefficients are JSON: {\"bands\", \"convention\", \"coefficients\": [[r, g, b], ...]} in \
    order l*l + l + m.\nConventions:\n  \
    bitlight         orthonormal, no phase: Y_1 = 0.4886 (y, z, x)\n  \
    condon-shortley  orthonormal, times (-1)^m: Green 2003, Sloan 2008, DirectXMath, Unreal\n  \
    4pi              geodesy: mean square 1\n  n3d, sn3d        ambisonics\n\n\
    Example:\n  bitlight sh project grace --bands 3 | bitlight sh rotate - --axis 0,1,0 --degrees 90"
)]
pub(super) struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, clap::Subcommand)]
enum Action {
    /// Project an environment: coefficients of its radiance
    Project {
        /// A lat-long .hdr file (also by its name below the assets), or a published probe such as grace
        environment: String,
        /// Bands l = 0 ... N-1; a published probe has 3
        #[arg(long, value_name = "N", default_value_t = 3)]
        bands: usize,
        /// Convention of the output
        #[arg(long, value_name = "NAME", default_value = "bitlight")]
        to: String,
        #[command(flatten)]
        folder: AssetFolder,
    },
    /// Evaluate coefficients in a direction, or the basis functions themselves
    Eval {
        /// Coefficients, or - for standard input; the basis functions where it is left out
        file: Option<String>,
        /// Direction; normalised
        #[arg(long, value_name = "X,Y,Z", value_parser = triple, allow_hyphen_values = true)]
        direction: Triple,
        /// Bands of the basis functions
        #[arg(long, value_name = "N", default_value_t = 3, conflicts_with = "file")]
        bands: usize,
    },
    /// Rotate coefficients, and convert them to another convention
    Rotate {
        /// Coefficients, or - for standard input
        file: String,
        /// Axis of the rotation
        #[arg(long, value_name = "X,Y,Z", value_parser = triple, default_value = "0,1,0", allow_hyphen_values = true)]
        axis: Triple,
        /// Angle, counter-clockwise seen against the axis
        #[arg(long, value_name = "ANGLE", default_value_t = 0.0, allow_negative_numbers = true)]
        degrees: f64,
        /// Convention of the output; the input's where it is left out
        #[arg(long, value_name = "NAME")]
        to: Option<String>,
    },
}

/// A vector on the command line; clap would take a plain array for several values.
#[derive(Debug, Clone, Copy)]
struct Triple([f64; 3]);

fn triple(text: &str) -> Result<Triple, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse::<f64>()).collect();
    match numbers.as_deref() {
        Ok([x, y, z]) if [x, y, z].iter().all(|c| c.is_finite()) && x * x + y * y + z * z > 1e-300 => {
            let length = (x * x + y * y + z * z).sqrt();
            Ok(Triple([x / length, y / length, z / length]))
        }
        _ => Err("takes three numbers, not all zero, such as 0,1,0".into()),
    }
}

impl Arguments {
    pub(super) fn run(self) -> Result<ExitCode, Error> {
        let json = match self.action {
            Action::Project { environment, bands, to, folder } => project(&environment, bands, &to, &folder)?,
            Action::Eval { file: None, direction, bands } => basis(bands, direction.0)?,
            Action::Eval { file: Some(file), direction, .. } => {
                evaluate(&Coefficients::read(&file)?, direction.0)?
            }
            Action::Rotate { file, axis, degrees, to } => {
                rotate(Coefficients::read(&file)?, axis.0, degrees, to)?
            }
        };
        if has_null(&json) {
            return Err(
                Error::new("the result is beyond the range of numbers").remedy("scale the input down")
            );
        }
        print(&format!("{json:#}\n"))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Whether a number was not finite, which JSON cannot hold.
fn has_null(json: &Json) -> bool {
    match json {
        Json::Array(items) => items.iter().any(has_null),
        Json::Object(items) => items.values().any(has_null),
        other => other.is_null(),
    }
}

/// The most bytes of coefficients: a thousand for each number of the most bands.
const MAX_BYTES: u64 = 1000 * 3 * (sh::MAX_BANDS * sh::MAX_BANDS) as u64;

/// What coefficients look like.
const REMEDY: &str = "write {\"bands\": 2, \"convention\": \"bitlight\", \"coefficients\": [[r, g, b], ...]}, as \
                      `bitlight sh project` does";

/// Coefficients of three channels.
struct Coefficients {
    bands: usize,
    convention: Convention,
    channels: [Vec<f64>; 3],
}

impl Coefficients {
    fn read(file: &str) -> Result<Self, Error> {
        let refused = |error: std::io::Error| {
            Error::new(format!("cannot be read: {error}"))
                .file(file)
                .remedy("name a file that `bitlight sh project` wrote, or - for standard input")
        };
        let mut bytes = Vec::new();
        let length = if file == "-" {
            std::io::stdin().lock().take(MAX_BYTES + 1).read_to_end(&mut bytes)
        } else {
            std::fs::File::open(file).and_then(|file| file.take(MAX_BYTES + 1).read_to_end(&mut bytes))
        };
        if length.map_err(refused)? as u64 > MAX_BYTES {
            return Err(Error::new(format!("is longer than {MAX_BYTES} bytes")).file(file).remedy(REMEDY));
        }
        Self::parse(&bytes).map_err(|error| error.file(file))
    }

    /// The coefficients in the bytes of a JSON file.
    fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let wrong = |what: String| Error::new(what).remedy(REMEDY);
        let json: Json = serde_json::from_slice(bytes)
            .map_err(|error| wrong(format!("is no JSON: {error}")).line(error.line()))?;
        let rows =
            json["coefficients"].as_array().ok_or_else(|| wrong("has no array \"coefficients\"".into()))?;
        let bands = json["bands"].as_u64().ok_or_else(|| wrong("has no whole number \"bands\"".into()))?;
        check_bands(usize::try_from(bands).unwrap_or(usize::MAX))?;
        if rows.len() as u64 != bands * bands {
            return Err(wrong(format!(
                "has {} coefficients; {bands} bands have {}",
                rows.len(),
                bands * bands
            )));
        }
        let name = json["convention"].as_str().ok_or_else(|| wrong("names no \"convention\"".into()))?;
        let convention = Convention::from_name(name).map_err(|error| error.key("convention"))?;
        let mut channels: [Vec<f64>; 3] = Default::default();
        for (index, row) in rows.iter().enumerate() {
            let rgb = row.as_array().filter(|rgb| rgb.len() == 3);
            for (channel, value) in channels.iter_mut().enumerate() {
                let number = rgb.and_then(|rgb| rgb[channel].as_f64());
                value.push(number.ok_or_else(|| wrong(format!("coefficients[{index}] is no [r, g, b]")))?);
            }
        }
        Ok(Self { bands: bands as usize, convention, channels })
    }

    fn converted(mut self, to: Convention) -> Result<Self, Error> {
        for channel in &mut self.channels {
            convert(self.convention, to, channel)?;
        }
        Ok(Self { convention: to, ..self })
    }

    fn to_json(&self) -> Json {
        let rows =
            (0..self.bands * self.bands).map(|index| self.channels.each_ref().map(|channel| channel[index]));
        json!({"bands": self.bands, "convention": self.convention.name(), "coefficients": rows.collect::<Vec<_>>()})
    }
}

fn check_bands(bands: usize) -> Result<(), Error> {
    if (1..=sh::MAX_BANDS).contains(&bands) {
        return Ok(());
    }
    Err(Error::new(format!("{bands} bands")).key("bands").remedy(format!("give 1 to {}", sh::MAX_BANDS)))
}

fn project(environment: &str, bands: usize, to: &str, folder: &AssetFolder) -> Result<Json, Error> {
    check_bands(bands)?;
    let to = Convention::from_name(to).map_err(|error| error.key("--to"))?;
    let projected = if environment.ends_with(".hdr") || Path::new(environment).exists() {
        let path = Path::new(environment);
        let path = if path.exists() { path.into() } else { folder.assets().find(environment)? };
        file::read_hdr(&path)?.project(bands)
    } else {
        let published = probes::probe(environment)?;
        if bands > 3 {
            let error = Error::new(format!("the published probe {environment} has 3 bands"));
            return Err(error.remedy("give --bands 3, or an .hdr file"));
        }
        published[..bands * bands].to_vec()
    };
    let channels = [0, 1, 2].map(|channel| projected.iter().map(|rgb| f64::from(rgb[channel])).collect());
    Ok(Coefficients { bands, convention: Convention::Bitlight, channels }.converted(to)?.to_json())
}

fn basis(bands: usize, direction: [f64; 3]) -> Result<Json, Error> {
    check_bands(bands)?;
    let mut values = vec![0.0; bands * bands];
    sh::evaluate(bands, direction, &mut values);
    Ok(
        json!({"bands": bands, "convention": Convention::Bitlight.name(), "direction": direction, "basis": values}),
    )
}

fn evaluate(coefficients: &Coefficients, direction: [f64; 3]) -> Result<Json, Error> {
    let (bands, name) = (coefficients.bands, coefficients.convention.name());
    let mut values = vec![0.0; bands * bands];
    sh::evaluate(bands, direction, &mut values);
    let radiance = coefficients.channels.each_ref().map(|channel| {
        let mut ours = channel.clone();
        convert(coefficients.convention, Convention::Bitlight, &mut ours)
            .map(|()| ours.iter().zip(&values).fold(0.0, |sum, (a, b)| sum + a * b))
    });
    let [red, green, blue] = radiance;
    Ok(json!({"bands": bands, "convention": name, "direction": direction, "radiance": [red?, green?, blue?]}))
}

fn rotate(
    coefficients: Coefficients,
    axis: [f64; 3],
    degrees: f64,
    to: Option<String>,
) -> Result<Json, Error> {
    let to = match to {
        Some(name) => Convention::from_name(&name).map_err(|error| error.key("--to"))?,
        None => coefficients.convention,
    };
    let rotation = Rotation::new(coefficients.bands, about(axis, degrees * (std::f64::consts::PI / 180.0)))?;
    let mut ours = coefficients.converted(Convention::Bitlight)?;
    ours.channels = ours.channels.map(|channel| rotation.rotate(&channel));
    Ok(ours.converted(to)?.to_json())
}

/// The matrix of a rotation about a unit axis (Rodrigues 1840).
fn about([x, y, z]: [f64; 3], angle: f64) -> [[f64; 3]; 3] {
    let (s, c) = (sin(angle), cos(angle));
    let t = 1.0 - c;
    [
        [t * x * x + c, t * x * y - s * z, t * x * z + s * y],
        [t * x * y + s * z, t * y * y + c, t * y * z - s * x],
        [t * x * z - s * y, t * y * z + s * x, t * z * z + c],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const GOOD: &str = r#"{"bands": 2, "convention": "n3d", "coefficients":
        [[1, 2.5, -3e-2], [0, 0, 0], [1e300, 1, 1], [1, 1, 1]]}"#;

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn garbage_is_refused_with_a_remedy(
            noise in prop::collection::vec(any::<u8>(), 0..100),
            at in 0..GOOD.len(),
            byte in prop::sample::select(b"[]{},:\"-+.0123e \xff\x00".as_slice()),
            cut: bool,
        ) {
            let mut bytes = GOOD.as_bytes().to_vec();
            bytes[at] = byte;
            if cut {
                bytes.truncate(at);
            }
            for bytes in [&noise, &bytes] {
                match Coefficients::parse(bytes) {
                    Ok(found) => {
                        let count = found.bands * found.bands;
                        prop_assert!(found.channels.iter().all(|channel| channel.len() == count));
                        prop_assert!(found.channels.iter().flatten().all(|value| value.is_finite()));
                    }
                    Err(error) => prop_assert!(error.remedy.is_some(), "{error}"),
                }
            }
        }
    }

    #[test]
    fn the_unharmed_coefficients_are_read() {
        assert_eq!(Coefficients::parse(GOOD.as_bytes()).unwrap().bands, 2);
    }
}
