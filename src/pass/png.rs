//! Eight-bit previews for eyes: sRGB-encoded PNG files. Nothing is measured or digested from them.

use crate::numeric::{order::clamp, single::pow};
use std::io::{self, Write};

/// The sRGB code value of a linear one (IEC 61966-2-1), held to [0, 255].
pub fn srgb8(linear: f32) -> u8 {
    let x = clamp(linear, 0.0, 1.0);
    let encoded = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * pow(x, 1.0 / 2.4) - 0.055 };
    (encoded * 255.0 + 0.5) as u8
}

/// Writes `width × height` RGB bytes, the top row first.
///
/// # Errors
/// What the writer refuses.
pub fn write(out: &mut impl Write, width: usize, height: usize, rgb: &[u8]) -> io::Result<()> {
    use image::ImageEncoder;
    image::codecs::png::PngEncoder::new(out)
        .write_image(rgb, width as u32, height as u32, image::ExtendedColorType::Rgb8)
        .map_err(|error| match error {
            image::ImageError::IoError(error) => error,
            error => io::Error::other(error),
        })
}
