//! `bitlight join`

use super::sheet::{Picture, Sheet, each, side_by_side};
use super::{print, sheet};
use crate::Error;
use crate::pass::{Channel, Data, Layer, png};
use crate::store::file;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Images of the same layer share one scale, at which all but the brightest hundredth of their \
    values fit, so their brightness can be compared.\n\n\
    Example:\n  bitlight join pixel/coarse.exr:radiosity vertex/coarse.exr:radiosity --difference 10 -o figure.png"
)]
pub(super) struct Arguments {
    /// EXR files, of colours or of one channel; a colon and the name of a layer or pass picks another than
    /// the first
    #[arg(required = true, value_name = "FILE[:LAYER]")]
    images: Vec<String>,
    /// The picture to write
    #[arg(short, long, value_name = "PNG")]
    out: PathBuf,
    /// Add the absolute difference of two images, times this
    #[arg(long, value_name = "GAIN")]
    difference: Option<f32>,
    /// What to write below an image, in their order, the difference last; else the layer's name
    #[arg(long, value_name = "TEXT")]
    label: Vec<String>,
}

/// An image in linear values: red, green and blue, or one channel.
struct Image {
    layer: String,
    width: usize,
    height: usize,
    channels: Vec<Channel>,
}

impl Arguments {
    pub(super) fn run(self) -> Result<ExitCode, Error> {
        let mut images = self.images.iter().map(|name| read(name)).collect::<Result<Vec<_>, _>>()?;
        let mut labels: Vec<String> = images.iter().map(|image| short(&image.layer).into()).collect();
        if let Some(gain) = self.difference {
            images.push(difference(&images, gain)?);
            labels.push(format!("difference x {gain}"));
        }
        if self.label.len() > labels.len() {
            return Err(Error::new(format!("{} labels for {} images", self.label.len(), labels.len()))
                .remedy("give a --label for each image, in their order, or fewer"));
        }
        labels.iter_mut().zip(&self.label).for_each(|(label, given)| label.clone_from(given));
        let mut all = BTreeMap::<_, Vec<&Channel>>::new();
        for image in images.iter().take(self.images.len()) {
            all.entry(image.layer.clone()).or_default().extend(&image.channels);
        }
        let whites: BTreeMap<_, f32> =
            all.into_iter().map(|(layer, channels)| (layer, sheet::white(channels))).collect();
        let picture = |(image, name): (&Image, String)| {
            let white = whites.get(&image.layer).copied().unwrap_or(1.0);
            let rgb = each(&image.channels, |value| f32::from(png::srgb8(value / white)) / 255.0);
            Picture { name, width: image.width, height: image.height, rgb }
        };
        let pictures: Vec<Picture> = images.iter().zip(labels).map(picture).collect();
        let sheet: Sheet = side_by_side(&pictures)?;
        sheet.write(&self.out)?;
        print(&format!("{}\n", self.out.display()))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// A layer's name without the technique.
fn short(layer: &str) -> &str {
    layer.split_once('.').map_or(layer, |(_, short)| short)
}

fn read(name: &str) -> Result<Image, Error> {
    let (file, wanted) = match name.rsplit_once(':') {
        Some((file, layer)) if !Path::new(name).exists() => (file, Some(layer)),
        _ => (name, None),
    };
    let layers = file::read_exr(Path::new(file)).map_err(|error| error.remedy("name an EXR file"))?;
    let names = layers.iter().map(|layer| layer.name.as_str()).collect::<Vec<_>>().join(", ");
    // The layer, or the first of the pass: of the first light where it has one for each.
    let is = |layer: &Layer| match wanted {
        Some(wanted) => [layer.name.as_str(), short(&layer.name)].iter().any(|name| {
            name.strip_prefix(wanted).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        }),
        None => true,
    };
    let Some(Layer { name: layer, width, height, mut channels }) = layers.into_iter().find(is) else {
        let error = Error::new(format!("has no layer {}", wanted.unwrap_or_default())).file(file);
        return Err(error.remedy(format!("it has {names}")));
    };
    // A file has its channels in alphabetical order.
    channels.sort_by_key(|channel| "RGB".find(&channel.name));
    let named: Vec<_> = channels.iter().map(|channel| channel.name.as_str()).collect();
    let real = channels.iter().all(|channel| matches!(channel.data, Data::F32(_)));
    if !real || (named != ["R", "G", "B"] && named.len() != 1) {
        let what = format!("the layer {layer} has {}, which is no picture", named.join(", "));
        let remedy = "name a layer of real colours R, G, B or of one channel; --passes final is one";
        return Err(Error::new(what).file(file).remedy(remedy));
    }
    Ok(Image { layer, width, height, channels })
}

fn difference(images: &[Image], gain: f32) -> Result<Image, Error> {
    let refused = |what: &str| Err(Error::new(what).remedy("give two images of one size to --difference"));
    if !(gain > 0.0 && gain.is_finite()) {
        return Err(
            Error::new(format!("--difference {gain} is no gain")).remedy("give a number above 0, such as 10")
        );
    }
    let [a, b] = images else {
        return refused("--difference is of two images");
    };
    if [a.width, a.height, a.channels.len()] != [b.width, b.height, b.channels.len()] {
        return refused("the two images differ in size or channels");
    }
    let channels = a.channels.iter().zip(&b.channels).map(|(a, b)| {
        let apart = sheet::values(a).iter().zip(sheet::values(b)).map(|(a, b)| (a - b).abs() * gain);
        Channel { name: a.name.clone(), data: Data::F32(apart.collect()) }
    });
    Ok(Image { layer: a.layer.clone(), width: a.width, height: a.height, channels: channels.collect() })
}
