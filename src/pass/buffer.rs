//! Typed buffers and their digests.

use crate::numeric::{lanes::wide, parallel};
use std::fmt;

/// Values that are tested together for being finite.
const FINITE: usize = 1 << 16;

/// The values of a buffer, the last axis fastest.
#[derive(Debug, Clone, PartialEq)]
pub enum Data {
    /// Real numbers.
    F32(Vec<f32>),
    /// Indices.
    U32(Vec<u32>),
}

impl Data {
    /// How many values there are.
    pub fn len(&self) -> usize {
        match self {
            Self::F32(values) => values.len(),
            Self::U32(values) => values.len(),
        }
    }

    /// Whether there is no value.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// `"f32"` or `"u32"`.
    pub fn type_name(&self) -> &'static str {
        match self {
            Self::F32(_) => "f32",
            Self::U32(_) => "u32",
        }
    }

    /// The values as little-endian bytes, −0 written as +0.
    pub fn to_le_bytes(&self) -> Vec<u8> {
        match self {
            // x + 0 is x but for −0, which it makes +0.
            Self::F32(values) => values.iter().flat_map(|value| (value + 0.0).to_le_bytes()).collect(),
            Self::U32(values) => values.iter().flat_map(|value| value.to_le_bytes()).collect(),
        }
    }
}

/// What a pass makes: an array of any rank, the last axis fastest.
#[derive(Debug, Clone, PartialEq)]
pub struct Buffer {
    /// The length of each axis, the slowest first.
    pub shape: Vec<usize>,
    /// As many values as the product of `shape`.
    pub data: Data,
}

impl Buffer {
    /// A buffer of real numbers.
    ///
    /// # Panics
    /// Where `values` are not as many as `shape` says.
    pub fn f32(shape: &[usize], values: Vec<f32>) -> Self {
        assert_eq!(shape.iter().product::<usize>(), values.len(), "a buffer of shape {shape:?}");
        Self { shape: shape.to_vec(), data: Data::F32(values) }
    }

    /// A buffer of indices.
    ///
    /// # Panics
    /// Where `values` are not as many as `shape` says.
    pub fn u32(shape: &[usize], values: Vec<u32>) -> Self {
        assert_eq!(shape.iter().product::<usize>(), values.len(), "a buffer of shape {shape:?}");
        Self { shape: shape.to_vec(), data: Data::U32(values) }
    }

    /// The real numbers.
    ///
    /// # Panics
    /// Where the buffer holds indices: a mistake in a pass.
    pub fn as_f32(&self) -> &[f32] {
        match &self.data {
            Data::F32(values) => values,
            Data::U32(_) => panic!("a buffer of u32 was read as f32"),
        }
    }

    /// The indices.
    ///
    /// # Panics
    /// Where the buffer holds real numbers: a mistake in a pass.
    pub fn as_u32(&self) -> &[u32] {
        match &self.data {
            Data::U32(values) => values,
            Data::F32(_) => panic!("a buffer of f32 was read as u32"),
        }
    }

    /// The real numbers of the `index`-th slice of the slowest axis: one light's images.
    #[inline]
    pub fn slice(&self, index: usize) -> &[f32] {
        let values = self.as_f32();
        let length = values.len() / self.shape[0];
        &values[index * length..][..length]
    }

    /// BLAKE3 over rank, shape, type and values (contract 10).
    pub fn digest(&self) -> Digest {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&(self.shape.len() as u64).to_le_bytes());
        for length in &self.shape {
            hasher.update(&(*length as u64).to_le_bytes());
        }
        hasher.update(self.data.type_name().as_bytes());
        hasher.update(&self.data.to_le_bytes());
        Digest(*hasher.finalize().as_bytes())
    }

    /// The index of the first NaN or infinity.
    pub fn first_not_finite(&self) -> Option<usize> {
        match &self.data {
            Data::F32(values) => {
                let runs: Vec<_> = values.chunks(FINITE).collect();
                let odd = parallel::map(runs.len(), |run| odd(runs[run]));
                let run = odd.iter().position(|odd| *odd)? * FINITE;
                (run..values.len()).find(|index| !values[*index].is_finite())
            }
            Data::U32(_) => None,
        }
    }

    /// The position along each axis of the value at `index`.
    pub fn place(&self, mut index: usize) -> Vec<usize> {
        let mut place = vec![0; self.shape.len()];
        for (position, length) in place.iter_mut().zip(&self.shape).rev() {
            *position = index % length;
            index /= length;
        }
        place
    }
}

wide! {
    /// Whether any value is not finite. The loop has no early end, so that many values are tested at a time.
    fn odd(values: &[f32]) -> bool {
        values.iter().fold(false, |odd, value| odd | !value.is_finite())
    }
}

/// The BLAKE3 digest of a buffer, written as 64 hexadecimal digits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Digest([u8; 32]);

impl fmt::Display for Digest {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(out, "{byte:02x}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_digest_sees_shape_type_and_bits_but_not_the_sign_of_zero() {
        let digest = |shape: &[usize], values: &[f32]| Buffer::f32(shape, values.to_vec()).digest();
        let one = digest(&[2, 2], &[1.0, 0.0, 0.0, 2.0]);
        assert_eq!(one, digest(&[2, 2], &[1.0, -0.0, 0.0, 2.0]));
        assert_ne!(one, digest(&[4, 1], &[1.0, 0.0, 0.0, 2.0]));
        assert_ne!(one, digest(&[2, 2], &[1.0, 0.0, 0.0, 2.0_f32.next_up()]));
        let bits: Vec<u32> = [1.0_f32, 0.0, 0.0, 2.0].iter().map(|value| value.to_bits()).collect();
        assert_ne!(one, Buffer::u32(&[2, 2], bits).digest());
        assert_eq!(one.to_string().len(), 64);
    }

    #[test]
    fn a_place_counts_the_last_axis_fastest() {
        assert_eq!(Buffer::u32(&[2, 3, 4], vec![0; 24]).place(17), [1, 1, 1]);
    }
}
