//! A sheet of every requested image with its name: what a frame is made of, at one look.
//!
//! Colours are scaled so that all but the brightest hundredth of their values fit; other channels run from
//! their least to their greatest value other than 0, from dark to light; indices are told apart by colour.

use super::font;
use crate::Error;
use crate::numeric::order::{clamp, max};
use crate::numeric::random;
use crate::pass::{Buffer, Channel, Data, Info, Layer, Preview, layers, png};
use crate::store::file;
use std::path::Path;
use tiny_skia::{Color, Pixmap};

/// Width and height of an image on the sheet, in pixels.
const CELL: usize = 256;

/// Room between images, and for a line of text below them.
const GAP: usize = 12;
const TEXT: usize = 20;

/// Images side by side.
const COLUMNS: usize = 5;

/// The most pictures on a sheet: more than that nobody takes in at one look.
const MOST: usize = 500;

/// An image of the sheet: a name, and RGB in sRGB code values.
pub(super) struct Picture {
    pub(super) name: String,
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) rgb: Vec<[u8; 3]>,
}

/// A drawn sheet.
pub(super) struct Sheet(Pixmap);

/// Draws the sheet; `None` where fewer than two images were asked for. Of more than [`MOST`] pictures it
/// shows the first.
///
/// # Errors
/// A sheet that is too large to draw.
pub(super) fn draw(kept: &[(Info, Buffer)]) -> Result<Option<Sheet>, Error> {
    let images = kept.iter().filter(|(info, _)| info.is_image());
    let layers =
        images.flat_map(|(info, buffer)| layers(info, buffer).into_iter().map(|layer| (layer, info.preview)));
    let pictures: Vec<Picture> =
        layers.flat_map(|(layer, previews)| pictures(&layer, previews)).take(MOST).collect();
    if pictures.len() < 2 {
        return Ok(None);
    }
    drawn(&pictures, COLUMNS, [CELL; 2]).map(Some)
}

/// Draws pictures in one row, none of them made smaller.
///
/// # Errors
/// A sheet that is too large to draw.
pub(super) fn side_by_side(pictures: &[Picture]) -> Result<Sheet, Error> {
    let width = pictures.iter().map(|picture| picture.width).max().unwrap_or(1);
    let height = pictures.iter().map(|picture| picture.height).max().unwrap_or(1);
    drawn(pictures, pictures.len(), [width, height])
}

/// Draws pictures into cells of a width and a height, row by row.
fn drawn(pictures: &[Picture], columns: usize, cell: [usize; 2]) -> Result<Sheet, Error> {
    let columns = columns.min(pictures.len());
    let pitch = [cell[0] + GAP, cell[1] + TEXT + GAP];
    let (width, height) = (GAP + columns * pitch[0], GAP + pictures.len().div_ceil(columns) * pitch[1]);
    let too_large = || Error::new("the sheet is too large").remedy("ask for fewer or smaller images");
    let mut sheet = Pixmap::new(width as u32, height as u32).ok_or_else(too_large)?;
    sheet.fill(Color::from_rgba8(24, 24, 28, 255));
    for (index, picture) in pictures.iter().enumerate() {
        let (left, top) = (GAP + index % columns * pitch[0], GAP + index / columns * pitch[1]);
        place(&mut sheet, picture, cell, left, top);
        font::draw(&mut sheet, &picture.name, left as f32, (top + cell[1] + 5) as f32);
    }
    Ok(Sheet(sheet))
}

impl Sheet {
    /// Writes the sheet to `path`.
    ///
    /// # Errors
    /// What the system refuses, naming the file.
    pub(super) fn write(&self, path: &Path) -> Result<(), Error> {
        let rgb = self.0.pixels().iter().flat_map(|pixel| [pixel.red(), pixel.green(), pixel.blue()]);
        file::write_png(path, self.0.width() as usize, self.0.height() as usize, &rgb.collect::<Vec<u8>>())
    }
}

/// Draws a picture into its cell, as large as fits: whole texels where it grows, the nearest where it
/// shrinks.
fn place(sheet: &mut Pixmap, picture: &Picture, cell: [usize; 2], left: usize, top: usize) {
    let pitch = sheet.width() as usize;
    let wide = picture.width * cell[1] > picture.height * cell[0];
    let (whole, cut) = if wide { (picture.width, cell[0]) } else { (picture.height, cell[1]) };
    let (width, height) = (picture.width * cut / whole, picture.height * cut / whole);
    for y in 0..height {
        for x in 0..width {
            let [r, g, b] = picture.rgb[y * whole / cut * picture.width + x * whole / cut];
            let at = (top + (cell[1] - height) / 2 + y) * pitch + left + (cell[0] - width) / 2 + x;
            sheet.pixels_mut()[at] = tiny_skia::ColorU8::from_rgba(r, g, b, 255).premultiply();
        }
    }
}

/// The pictures of a layer, one for each group of channels that the pass names. A cube's faces come stacked;
/// they are laid side by side, two rows of three.
fn pictures(layer: &Layer, previews: &[Preview]) -> Vec<Picture> {
    let mut pictures = Vec::new();
    let mut rest = layer.channels.as_slice();
    for preview in previews {
        let (channels, others) = rest.split_at(preview.channels());
        rest = others;
        let rgb = match preview {
            Preview::Picture | Preview::Colour => colours(channels),
            Preview::Direction => each(channels, |value| value * 0.5 + 0.5),
            Preview::Place | Preview::Value => ranged(channels),
            Preview::Index => indices(&channels[0]).iter().map(|index| index_colour(*index)).collect(),
        };
        let all = matches!(preview, Preview::Picture | Preview::Colour) || channels[0].name == "Y";
        let label = if all { String::new() } else { format!(" {}", names(channels)) };
        let short = layer.name.split_once('.').map_or(layer.name.as_str(), |(_, short)| short);
        pictures.push(unstacked(Picture {
            name: format!("{short}{label}"),
            width: layer.width,
            height: layer.height,
            rgb,
        }));
    }
    pictures
}

fn names(channels: &[Channel]) -> String {
    channels.iter().map(|channel| channel.name.as_str()).collect::<Vec<_>>().join(" ")
}

fn unstacked(picture: Picture) -> Picture {
    let size = picture.width;
    if picture.height != 6 * size {
        return picture;
    }
    let texel = |index: usize| {
        let (x, y) = (index % (3 * size), index / (3 * size));
        picture.rgb[((y / size * 3 + x / size) * size + y % size) * size + x % size]
    };
    let rgb = (0..6 * size * size).map(texel).collect();
    Picture { width: 3 * size, height: 2 * size, rgb, ..picture }
}

/// The values of a channel of real numbers.
pub(super) fn values(channel: &Channel) -> &[f32] {
    match &channel.data {
        Data::F32(values) => values,
        Data::U32(_) => &[],
    }
}

/// The values of a channel of indices.
fn indices(channel: &Channel) -> &[u32] {
    match &channel.data {
        Data::U32(values) => values,
        Data::F32(_) => &[],
    }
}

/// The pixels of three channels, whose values `code` maps to [0, 1]; a single channel gives grey.
pub(super) fn each(channels: &[Channel], code: impl Fn(f32) -> f32) -> Vec<[u8; 3]> {
    let byte = |channel: usize, index: usize| {
        (clamp(code(values(&channels[channel.min(channels.len() - 1)])[index]), 0.0, 1.0) * 255.0 + 0.5) as u8
    };
    (0..values(&channels[0]).len()).map(|index| [0, 1, 2].map(|channel| byte(channel, index))).collect()
}

fn colours(channels: &[Channel]) -> Vec<[u8; 3]> {
    let white = white(channels);
    each(channels, |value| f32::from(png::srgb8(value / white)) / 255.0)
}

/// A value below which lie all but the brightest hundredth of the values above 0.
pub(super) fn white<'a>(channels: impl IntoIterator<Item = &'a Channel>) -> f32 {
    let mut all: Vec<f32> = channels
        .into_iter()
        .flat_map(values)
        .copied()
        .filter(|value| *value > 0.0 && value.is_finite())
        .collect();
    all.sort_by(f32::total_cmp);
    all.get(all.len() * 99 / 100).copied().unwrap_or(1.0)
}

fn ranged(channels: &[Channel]) -> Vec<[u8; 3]> {
    let all = || channels.iter().flat_map(values).copied().filter(|value| *value != 0.0);
    let (low, high) = all().fold((f32::MAX, f32::MIN), |(low, high), value| {
        (if value < low { value } else { low }, max(high, value))
    });
    let span = if high > low { high - low } else { 1.0 };
    // 0 stands for "nothing" in every such channel and stays black.
    each(channels, |value| if value == 0.0 { 0.0 } else { 0.15 + 0.85 * (value - low) / span })
}

fn index_colour(index: u32) -> [u8; 3] {
    if index == u32::MAX {
        return [0; 3];
    }
    [0, 1, 2].map(|channel| 64 + (random::bits(0, u64::from(index), 0, channel) >> 56) as u8 / 4 * 3)
}
