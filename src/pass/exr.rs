//! OpenEXR files: one part a layer, channels by name, lossless ZIP, `f32` and `u32` alone.

use super::{Channel, Data, Layer, file};
use crate::Error;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, ReadChannels, ReadLayers, Vec2, WritableImage,
};
use std::io;
use std::path::Path;

/// Writes `layers` to `path`, in their order.
///
/// # Errors
/// What the system refuses, naming the file; no layers at all.
pub fn write(path: &Path, layers: &[Layer]) -> Result<(), Error> {
    if layers.is_empty() {
        return Err(Error::new("there is no image to write").file(path));
    }
    let parts: Vec<_> = layers.iter().map(part).collect();
    let mut image = Image::from_layers(
        exr::meta::header::ImageAttributes::new(exr::meta::attribute::IntegerBounds::from_dimensions(Vec2(
            layers[0].width,
            layers[0].height,
        ))),
        parts,
    );
    image.attributes.pixel_aspect = 1.0;
    file::write(path, |out| image.write().to_buffered(out).map_err(io::Error::other))
}

fn part(layer: &Layer) -> exr::image::Layer<AnyChannels<FlatSamples>> {
    let channels = layer.channels.iter().map(|channel| {
        let samples = match &channel.data {
            Data::F32(values) => FlatSamples::F32(values.clone()),
            Data::U32(values) => FlatSamples::U32(values.clone()),
        };
        AnyChannel::new(channel.name.as_str(), samples)
    });
    exr::image::Layer::new(
        (layer.width, layer.height),
        exr::meta::header::LayerAttributes::named(layer.name.as_str()),
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(channels.collect()),
    )
}

/// Reads every layer of `path`. Half floats become `f32`; the channels come in the file's order, which EXR sorts
/// by name.
///
/// # Errors
/// A missing file, and one that is no EXR file or is damaged, naming the file.
pub fn read(path: &Path) -> Result<Vec<Layer>, Error> {
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_file(path)
        .map_err(|error| Error::new(format!("cannot be read as EXR: {error}")).file(path))?;
    Ok(image.layer_data.into_iter().map(layer).collect())
}

fn layer(part: exr::image::Layer<AnyChannels<FlatSamples>>) -> Layer {
    let channels = part.channel_data.list.into_iter().map(|channel| Channel {
        name: channel.name.to_string(),
        data: match channel.sample_data {
            FlatSamples::F32(values) => Data::F32(values),
            FlatSamples::U32(values) => Data::U32(values),
            FlatSamples::F16(values) => Data::F32(values.iter().map(|value| value.to_f32()).collect()),
        },
    });
    Layer {
        name: part.attributes.layer_name.map(|name| name.to_string()).unwrap_or_default(),
        width: part.size.0,
        height: part.size.1,
        channels: channels.collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_of_several_sizes_and_types_are_read_as_they_were_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let one = |name: &str, width, height, data| Layer {
            name: name.into(),
            width,
            height,
            channels: vec![Channel { name: "Y".into(), data }],
        };
        let layers = [
            one("t.a", 2, 2, Data::F32(vec![1.0, -0.5, 1e-42, f32::MAX])),
            one("t.b.light1", 3, 1, Data::U32(vec![0, 5, u32::MAX])),
        ];
        write(&path, &layers).unwrap();
        assert_eq!(read(&path).unwrap(), layers);
    }

    #[test]
    fn garbage_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        std::fs::write(&path, b"v/1\x01 not an EXR").unwrap();
        assert!(read(&path).unwrap_err().to_string().contains("a.exr"));
    }
}
