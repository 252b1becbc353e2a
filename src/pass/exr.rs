//! OpenEXR files: one part a layer, channels by name, lossless ZIP, `f32` and `u32` alone.

use super::{Channel, Data, Layer};
use crate::Error;
use exr::meta::MetaData;
use exr::prelude::{
    AnyChannel, AnyChannels, Compression, Encoding, FlatSamples, Image, ReadChannels, ReadLayers, Vec2,
    WritableImage,
};
use std::collections::BTreeSet;
use std::io::{self, Cursor, Seek, Write};

/// The largest file that is read, and the most pixels of all its layers, both in bytes.
pub const MAX_BYTES: u64 = 4 << 30;

/// How many times smaller than its pixels a file may be: more than lossless compression reaches.
const MAX_RATIO: u64 = 1 << 14;

/// Writes `layers` in their order.
///
/// # Errors
/// What the writer refuses; no layers at all.
pub fn write(out: &mut (impl Write + Seek), layers: &[Layer]) -> io::Result<()> {
    if layers.is_empty() {
        return Err(io::Error::other("there is no image to write"));
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
    image.write().to_buffered(out).map_err(|error| match error {
        exr::error::Error::Io(error) => error,
        error => io::Error::other(error),
    })
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

/// Every layer of an EXR file. Half floats become `f32`; the channels come in the file's order, which EXR
/// sorts by name.
///
/// # Errors
/// Bytes that are no EXR file or a damaged one, and what is not read: deep data, subsampled channels, B44 and
/// DWA (they change the pixels), more than [`MAX_BYTES`] of pixels (found in the header, before they are
/// allocated).
pub fn parse(bytes: &[u8]) -> Result<Vec<Layer>, Error> {
    let refused = |error: exr::error::Error| {
        Error::new(format!("cannot be read as EXR: {error}")).remedy("see whether the file is whole")
    };
    check(&MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(refused)?, bytes.len() as u64)?;
    check_chunks(bytes).map_err(refused)?;
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(refused)?;
    Ok(image.layer_data.into_iter().map(layer).collect())
}

/// Refuses a header that would make the reader allocate more than the file can hold, and files of kinds that
/// are not read.
fn check(meta: &MetaData, length: u64) -> Result<(), Error> {
    let mut total = 0_u64;
    for header in &meta.headers {
        if header.deep || header.channels.list.iter().any(|channel| channel.sampling != Vec2(1, 1)) {
            return Err(
                Error::new("has deep or subsampled pixels").remedy("save it flat, at full resolution")
            );
        }
        // The decoder of B44 does sums that overflow on damaged data.
        if matches!(
            header.compression,
            Compression::B44 | Compression::B44A | Compression::DWAA(_) | Compression::DWAB(_)
        ) {
            return Err(Error::new("is compressed in a way that changes pixels")
                .remedy("save it with ZIP or another lossless compression"));
        }
        let sizes = header.channels.list.iter().map(|channel| channel.sample_type.bytes_per_sample() as u64);
        let Vec2(width, height) = header.layer_size;
        let pixels = (width as u64).saturating_mul(height as u64);
        total = total.saturating_add(pixels.saturating_mul(sizes.sum()));
    }
    let most = u64::min(MAX_BYTES, length.saturating_mul(MAX_RATIO));
    if total > most {
        return Err(Error::new(format!("its header promises {total} bytes of pixels in {length} bytes"))
            .remedy("see whether the file is whole; save large layers in several files"));
    }
    Ok(())
}

/// Refuses a file whose table leads twice to one block of pixels (another is then missing), or to a block of
/// another resolution. The reader does not look for the former, and an assertion fails at the latter.
fn check_chunks(bytes: &[u8]) -> exr::error::Result<()> {
    let damaged = || exr::error::Error::Invalid("table of blocks".into());
    let reader = exr::block::read(Cursor::new(bytes), false)?;
    let headers = reader.headers().to_vec();
    let mut seen = BTreeSet::new();
    for chunk in reader.filter_chunks(false, |_, tile, _| tile.level_index == Vec2(0, 0))? {
        let chunk = chunk?;
        let header = headers.get(chunk.layer_index).ok_or_else(damaged)?;
        let tile = header.get_block_data_indices(&chunk.compressed_block)?;
        if tile.level_index != Vec2(0, 0)
            || !seen.insert((chunk.layer_index, tile.tile_index.0, tile.tile_index.1))
        {
            return Err(damaged());
        }
    }
    Ok(())
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
        let mut file = Cursor::new(Vec::new());
        write(&mut file, &layers).unwrap();
        assert_eq!(parse(file.get_ref()).unwrap(), layers);
    }
}
