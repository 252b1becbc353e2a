//! Distant light: latitude-longitude maps of radiance, read from Radiance HDR files, looked up and projected
//! on spherical harmonics.
//!
//! A map's column u = φ / 2π and row v = θ / π (θ from +y, row 0 at the top) stand for the direction
//! (sin θ cos φ, cos θ, sin θ sin φ). Radiance is linear RGB with the primaries of Rec. 709.

use super::sh;
use crate::Error;
use crate::numeric::double::{cos, sin};
use crate::numeric::{order, parallel, single, sum};
use glam::Vec3;
use image::ImageDecoder;
use image::codecs::hdr::HdrDecoder;
use std::f64::consts::PI;
use std::io::Read;

/// The most texels of a map: 8192 × 4096, 403 MB of radiance.
pub const MAX_TEXELS: usize = 8192 * 4096;

/// The most bytes of an HDR file: [`MAX_TEXELS`] texels of four bytes, with room for a header and run
/// lengths.
pub const MAX_BYTES: u64 = 5 * MAX_TEXELS as u64;

/// Rows whose texels one task adds up from left to right before the tasks' sums meet in [`sum::sum`].
const ROWS: usize = 8;

/// Radiance from every direction as a latitude-longitude map.
#[derive(Debug, Clone, PartialEq)]
pub struct LatLong {
    width: usize,
    height: usize,
    radiance: Vec<Vec3>,
}

impl LatLong {
    /// The map of `width` × `height` texels whose `radiance` is given row by row from +y down.
    ///
    /// A texel covers Δφ = 2π / width by Δθ = π / height, whatever the ratio: 2 : 1 gives square ones.
    ///
    /// # Errors
    /// Where `radiance` has not width × height texels or none, more than [`MAX_TEXELS`], or one that is
    /// negative or not finite.
    pub fn new(width: usize, height: usize, radiance: Vec<Vec3>) -> Result<Self, Error> {
        check_size(width, height)?;
        if radiance.len() != width * height {
            return Err(Error::new(format!("{} texels in a map of {width} × {height}", radiance.len()))
                .remedy("give one for each column of each row"));
        }
        for (i, rgb) in radiance.iter().enumerate() {
            if !rgb.to_array().iter().all(|c| c.is_finite() && *c >= 0.0) {
                let (column, row) = (i % width, i / width);
                return Err(Error::new(format!("radiance {rgb} at column {column}, row {row}"))
                    .remedy("replace what is negative or not finite"));
            }
        }
        Ok(Self { width, height, radiance })
    }

    /// The map of a Radiance HDR file (RGBE, run-length encoded or not, rows from the top and from the left).
    ///
    /// A texel is mantissa × 2^(exponent − 136) exactly. EXPOSURE and COLORCORR are not applied, as usual in
    /// real-time engines: the texels as stored are the radiance.
    ///
    /// # Errors
    /// Bytes that are no such file or end early, and more than [`MAX_TEXELS`] (found before anything is
    /// allocated for them).
    pub fn from_hdr(bytes: &[u8]) -> Result<Self, Error> {
        let refused = |error: image::ImageError| {
            Error::new(format!("no Radiance HDR image: {error}"))
                .remedy("give a file that starts with #?RADIANCE, FORMAT=32-bit_rle_rgbe, orientation -Y +X")
        };
        let decoder = HdrDecoder::new(RunGuard { bytes, runs: 0 }).map_err(refused)?;
        let (width, height) = decoder.dimensions();
        check_size(width as usize, height as usize)?;
        let texels = image::DynamicImage::from_decoder(decoder).map_err(refused)?.into_rgb32f().into_raw();
        let radiance = texels.chunks_exact(3).map(Vec3::from_slice).collect();
        Self::new(width as usize, height as usize, radiance)
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The radiance of every texel, row by row from +y down.
    pub fn texels(&self) -> &[Vec3] {
        &self.radiance
    }

    /// The unit vector through the centre of a texel.
    pub fn direction(&self, column: usize, row: usize) -> [f64; 3] {
        let theta = PI * (row as f64 + 0.5) / self.height as f64;
        let phi = 2.0 * PI * (column as f64 + 0.5) / self.width as f64;
        [sin(theta) * cos(phi), cos(theta), sin(theta) * sin(phi)]
    }

    /// The exact solid angle of each texel of a row, Δφ (cos θ₀ − cos θ₁), in steradians.
    pub fn solid_angle(&self, row: usize) -> f64 {
        // cos θ₀ − cos θ₁ = 2 sin((θ₀ + θ₁) / 2) sin((θ₁ − θ₀) / 2) without its cancellation at the poles
        let step = PI / self.height as f64;
        let centre = step * (row as f64 + 0.5);
        2.0 * PI / self.width as f64 * (2.0 * sin(centre) * sin(0.5 * step))
    }

    /// The radiance from `direction`, of any length but 0: bilinear between the four nearest texel centres,
    /// wrapping round in u and constant beyond the outermost rows' centres.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let Vec3 { x, y, z } = direction;
        // acos y, but accurate at the poles and for any length
        let theta = single::atan2((x * x + z * z).sqrt(), y);
        let column = single::atan2(z, x) / std::f32::consts::TAU * self.width as f32 - 0.5;
        let row = theta / std::f32::consts::PI * self.height as f32 - 0.5;
        let row = order::clamp(row, 0.0, (self.height - 1) as f32);
        let (left, top) = (column.floor(), row.floor());
        let (s, t) = (column - left, row - top);
        let wrap = |column: isize| column.rem_euclid(self.width as isize) as usize;
        let columns = [wrap(left as isize), wrap(left as isize + 1)];
        let upper = top as usize;
        let lower = order::min(upper + 1, self.height - 1);
        let across = |row: usize| {
            let [a, b] = columns.map(|column| self.radiance[row * self.width + column]);
            a * (1.0 - s) + b * s
        };
        across(upper) * (1.0 - t) + across(lower) * t
    }

    /// The radiance coefficients of `bands` bands, RGB in the order l² + l + m: Banterle and Chalmers, Eq. 6,
    /// with radiance where the paper says irradiance.
    ///
    /// Each texel counts as its radiance times its exact solid angle times Y_lm at its *centre*, where the
    /// map as piecewise constant would take Y_lm's mean over the texel. The difference is of second order.
    /// Measured on the Grace probe (256 × 128, a hard case for its small bright lights), it is below l(l + 1)
    /// Δ² / 8 of c_00 in band l, with Δ = π / height: 1e-4 of band 1 and 1e-3 of band 5.
    ///
    /// Sums are in `f64`: a task's eight rows from left to right, then the tasks in [`sum::sum`]'s order.
    ///
    /// # Panics
    /// Where `bands` exceeds [`sh::MAX_BANDS`].
    pub fn project(&self, bands: usize) -> Vec<[f32; 3]> {
        let count = bands * bands;
        let step = 2.0 * PI / self.width as f64;
        let circle: Vec<[f64; 2]> =
            (0..self.width).map(|i| step * (i as f64 + 0.5)).map(|phi| [cos(phi), sin(phi)]).collect();
        let partial = parallel::map(self.height.div_ceil(ROWS), |task| {
            let mut basis = vec![0.0; count];
            let mut sums = vec![[0.0; 3]; count];
            for row in task * ROWS..usize::min((task + 1) * ROWS, self.height) {
                let theta = PI * (row as f64 + 0.5) / self.height as f64;
                let (y, radius) = (cos(theta), sin(theta));
                let solid_angle = self.solid_angle(row);
                for (column, [c, s]) in circle.iter().enumerate() {
                    sh::evaluate(bands, [radius * c, y, radius * s], &mut basis);
                    let rgb = self.radiance[row * self.width + column].to_array();
                    let weighted = rgb.map(|c| f64::from(c) * solid_angle);
                    for (sum, value) in sums.iter_mut().zip(&basis) {
                        for channel in 0..3 {
                            sum[channel] += weighted[channel] * value;
                        }
                    }
                }
            }
            sums
        });
        let mut column = vec![0.0; partial.len()];
        let mut total = |function: usize, channel: usize| {
            for (value, sums) in column.iter_mut().zip(&partial) {
                *value = sums[function][channel];
            }
            sum::sum(&column) as f32
        };
        (0..count).map(|function| [0, 1, 2].map(|channel| total(function, channel))).collect()
    }
}

/// The radiance coefficients of a constant environment: √(4π) `radiance` at (0, 0) and zeros, exactly what a
/// projection of it must give. `bands`² items, RGB.
pub fn constant(bands: usize, radiance: Vec3) -> Vec<[f32; 3]> {
    let mut coefficients = vec![[0.0; 3]; bands * bands];
    if let Some(first) = coefficients.first_mut() {
        *first = radiance.to_array().map(|c| ((4.0 * PI).sqrt() * f64::from(c)) as f32);
    }
    coefficients
}

/// Distant light from all around, in one of the forms that a scene gives it, times a factor.
#[derive(Debug, Clone, PartialEq)]
pub struct Environment {
    /// The form.
    pub form: Form,
    /// Factor on its radiance, at least 0.
    pub scale: f32,
}

/// A form of distant light.
#[derive(Debug, Clone, PartialEq)]
pub enum Form {
    /// A lat-long map of radiance.
    Map(LatLong),
    /// The same radiance from everywhere, RGB.
    Constant(Vec3),
    /// Nine published coefficients: those of higher bands are 0.
    Probe([[f32; 3]; 9]),
}

impl Environment {
    /// The radiance coefficients of `bands` bands, RGB in the order l² + l + m.
    ///
    /// # Panics
    /// Where `bands` exceeds [`sh::MAX_BANDS`].
    pub fn coefficients(&self, bands: usize) -> Vec<[f32; 3]> {
        let mut coefficients = match &self.form {
            Form::Map(map) => map.project(bands),
            Form::Constant(colour) => constant(bands, *colour),
            Form::Probe(nine) => nine.to_vec(),
        };
        coefficients.resize(bands * bands, [0.0; 3]);
        coefficients.iter_mut().for_each(|rgb| *rgb = rgb.map(|value| value * self.scale));
        coefficients
    }

    /// The radiance from a unit `direction`, RGB; that of a probe is the sum of its nine functions, which
    /// rings below zero opposite a bright side.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let radiance = match &self.form {
            Form::Map(map) => map.radiance(direction),
            Form::Constant(colour) => *colour,
            Form::Probe(nine) => {
                let mut basis = [0.0; 9];
                sh::evaluate_fast(3, direction, &mut basis);
                nine.iter()
                    .zip(basis)
                    .fold(Vec3::ZERO, |sum, (rgb, value)| sum + Vec3::from_array(*rgb) * value)
            }
        };
        radiance * self.scale
    }
}

pub(crate) const SMALLER: &str = "scale it down to 8192 × 4096 texels or fewer";

fn check_size(width: usize, height: usize) -> Result<(), Error> {
    match width.checked_mul(height) {
        Some(1..=MAX_TEXELS) => Ok(()),
        Some(0) => Err(Error::new(format!("a map of {width} × {height} has no texel"))
            .remedy("give one of at least 1 × 1, usually twice as wide as high")),
        _ => {
            Err(Error::new(format!("a map of {width} × {height} is over {MAX_TEXELS} texels"))
                .remedy(SMALLER))
        }
    }
}

/// The bytes of an HDR file, with a guard against a chain of old-style run markers.
///
/// `image`'s decoder multiplies the length of each consecutive marker (1, 1, 1, n) by 256 once more, and
/// overflows at the eighth: a panic in builds that check. It fetches texels of the old encoding, and no other
/// data of consequence, in reads of four bytes without another read between them. Two markers span 65,535
/// texels, more than any row here has, so the guard refuses a third.
struct RunGuard<'a> {
    bytes: &'a [u8],
    runs: usize,
}

impl Read for RunGuard<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.bytes.read(buffer)?;
        self.runs = if buffer.len() == 4 && buffer.starts_with(&[1, 1, 1]) { self.runs + 1 } else { 0 };
        if self.runs > 2 { Err(std::io::Error::other("three run markers in a row")) } else { Ok(count) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A file of `width` columns of uncompressed texels.
    fn file(width: usize, texels: &[[u8; 4]]) -> Vec<u8> {
        let header =
            format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {} +X {width}\n", texels.len() / width);
        [header.as_bytes(), texels.as_flattened()].concat()
    }

    /// A smooth positive map.
    fn map(width: usize, height: usize) -> LatLong {
        let blank = LatLong { width, height, radiance: Vec::new() };
        let texels = (0..width * height).map(|i| {
            let [x, y, z] = blank.direction(i % width, i / width);
            Vec3::new((1.0 + x * y) as f32, (2.0 + z) as f32, (1.5 + y * y - x) as f32)
        });
        LatLong::new(width, height, texels.collect()).unwrap()
    }

    #[test]
    fn every_exponent_decodes_to_an_exact_power_of_two() {
        let texels: Vec<[u8; 4]> = (0..=255).map(|exponent| [128, 1, 255, exponent]).collect();
        let map = LatLong::from_hdr(&file(16, &texels)).unwrap();
        for (exponent, rgb) in map.texels().iter().enumerate() {
            // 2^(exponent − 136) as f64, by its bits; exponent 0 means black.
            let unit = if exponent == 0 { 0.0 } else { f64::from_bits((exponent as u64 + 1023 - 136) << 52) };
            let exact = [128.0, 1.0, 255.0].map(|mantissa| mantissa * unit);
            assert_eq!(rgb.to_array().map(f64::from), exact, "exponent {exponent}");
        }
    }

    #[test]
    fn refusals_name_a_remedy() {
        let good = file(2, &[[9, 9, 9, 128]; 4]);
        let cases: [(&str, Vec<u8>); 5] = [
            ("no Radiance HDR image", b"\x89PNG\r\n\x1a\n and more than ten bytes".to_vec()),
            ("no Radiance HDR image", good[..good.len() - 1].to_vec()),
            ("is over", b"#?RADIANCE\n\n-Y 100000 +X 200000\n".to_vec()),
            ("has no texel", b"#?RADIANCE\n\n-Y 0 +X 8\n".to_vec()),
            ("three run markers", file(12, &[[[5, 5, 5, 128]; 2].as_slice(), &[[1, 1, 1, 0]; 10]].concat())),
        ];
        for (expected, bytes) in cases {
            let error = LatLong::from_hdr(&bytes).unwrap_err();
            assert!(error.to_string().contains(expected), "{error}");
            assert!(error.remedy.is_some());
        }
        for bad in [-1.0, f32::NAN, f32::INFINITY] {
            assert!(LatLong::new(1, 1, vec![Vec3::new(0.0, bad, 0.0)]).is_err());
        }
        assert!(LatLong::new(2, 1, vec![Vec3::ZERO]).is_err());
    }

    #[test]
    fn old_runs_of_up_to_two_markers_are_read() {
        let texels = [[7, 7, 7, 129], [1, 1, 1, 3], [1, 1, 1, 1], [8, 8, 8, 129]];
        let header = b"#?RADIANCE\n\n-Y 1 +X 261\n".to_vec();
        let map = LatLong::from_hdr(&[header, texels.as_flattened().to_vec()].concat()).unwrap();
        assert_eq!(map.texels().iter().filter(|rgb| rgb.x == 7.0 / 128.0).count(), 260);
    }

    #[test]
    fn solid_angles_tile_the_sphere() {
        for (width, height) in [(1, 1), (2, 1), (256, 128), (7, 1000)] {
            let map = LatLong { width, height, radiance: Vec::new() };
            let total = (0..height).fold(0.0, |sum, row| sum + width as f64 * map.solid_angle(row));
            assert!((total - 4.0 * PI).abs() < 1e-12);
            let (from, to) = (0.0, PI / height as f64);
            let polar = 2.0 * PI / width as f64 * (cos(from) - cos(to));
            assert!((map.solid_angle(0) / polar - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn lookup_hits_texel_centres_wraps_and_stops_at_the_poles() {
        let map = map(16, 8);
        for row in 0..8 {
            for column in 0..16 {
                let d = map.direction(column, row).map(|c| 3.0 * c as f32);
                let difference = map.radiance(Vec3::from_array(d)) - map.texels()[row * 16 + column];
                assert!(difference.abs().max_element() < 4e-6, "{column}, {row}: {difference}");
            }
        }
        // u = 0 lies midway between the last column and the first.
        let theta = PI * 3.5 / 8.0;
        let seam = map.radiance(Vec3::new(sin(theta) as f32, cos(theta) as f32, 0.0));
        let midway = (map.texels()[3 * 16] + map.texels()[3 * 16 + 15]) * 0.5;
        assert!((seam - midway).abs().max_element() < 1e-6, "{seam} against {midway}");
        // At a pole, the row's own values.
        let pole = map.radiance(Vec3::Y);
        let first = (map.texels()[0] + map.texels()[15]) * 0.5;
        assert!((pole - first).abs().max_element() < 1e-6, "{pole} against {first}");
    }

    /// The map holds 1 + xy, 2 + z and 1.5 + y² − x, whose coefficients are known. What is left is the error
    /// of evaluating at texel centres, of second order in their size.
    #[test]
    fn projection_converges_on_the_coefficients_of_known_polynomials() {
        let k1 = (3.0 / (4.0 * PI)).sqrt();
        let k22 = (15.0 / (4.0 * PI)).sqrt();
        let root = (4.0 * PI).sqrt();
        let mut exact = [[0.0; 3]; 9];
        exact[0] = [root, 2.0 * root, (1.5 + 1.0 / 3.0) * root];
        exact[4][0] = 1.0 / k22;
        exact[2][1] = 1.0 / k1;
        exact[3][2] = -1.0 / k1;
        // y² − 1/3 = −(3z² − 1) / 6 − (x² − y²) / 2
        exact[6][2] = -(16.0 * PI / 5.0).sqrt() / 6.0;
        exact[8][2] = -(4.0 * PI / 15.0_f64).sqrt();
        let worst = [64, 256].map(|height| {
            let found = map(2 * height, height).project(3);
            let pairs = found.as_flattened().iter().zip(exact.as_flattened());
            pairs.map(|(a, b)| (f64::from(*a) - b).abs()).fold(0.0, order::max)
        });
        assert!(worst[0] < 1.7e-3, "{worst:?}");
        assert!((worst[0] / worst[1] - 16.0).abs() < 0.5, "{worst:?}");
    }

    #[test]
    fn constant_is_what_projection_gives() {
        let rgb = Vec3::new(1.0, 0.5, 4.0);
        let map = LatLong::new(256, 128, vec![rgb; 256 * 128]).unwrap();
        let (projected, exact) = (map.project(4), constant(4, rgb));
        assert_eq!(projected[0], exact[0]);
        assert!((f64::from(exact[0][0]) - (4.0 * PI).sqrt()).abs() < 1e-6);
        for (a, b) in projected.iter().zip(&exact) {
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-3), "{a:?} against {b:?}");
        }
        assert!(constant(0, rgb).is_empty());
    }

    /// Starts of files, from nothing to the middle of a scanline.
    const HEADS: &[&[u8]] =
        &[b"", b"#?RADIANCE\n", b"#?RADIANCE\n\n-Y 3 +X 9\n", b"#?RADIANCE\n\n-Y 2 +X 8\n\x02\x02\0\x08"];

    /// Bytes that mean something to the format.
    const BYTES: &[u8] = b"\0\x01\x02\n +-=XY\x7f\x80\x81\x88\xff";

    proptest! {
        #[test]
        fn garbage_is_refused_without_a_panic(
            head in prop::sample::select(HEADS),
            tail in prop::collection::vec(prop::sample::select(BYTES), 0..160),
        ) {
            let _ = LatLong::from_hdr(&[head, &tail].concat());
        }

        #[test]
        fn a_flipped_byte_never_panics(position in 0_usize..180, value: u8) {
            let mut bytes = file(8, &[[1, 1, 1, 1]; 32].map(|t| t.map(|c| c * 3)));
            if let Some(byte) = bytes.get_mut(position) {
                *byte = value;
            }
            let _ = LatLong::from_hdr(&bytes);
        }
    }
}
