//! NumPy's `.npy` files, version 1.0: `<f4` and `<u4` in C order.

use super::{Buffer, Data};
use crate::Error;
use std::io::{self, Write};

/// The largest file that is read, in bytes.
pub const MAX_BYTES: u64 = 4 << 30;

const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";

/// Writes `buffer`.
///
/// # Errors
/// What the writer refuses.
pub fn write(out: &mut impl Write, buffer: &Buffer) -> io::Result<()> {
    out.write_all(&header(buffer))?;
    out.write_all(&buffer.data.to_le_bytes())
}

/// What stands before the values of `buffer` in its file.
pub fn header(buffer: &Buffer) -> Vec<u8> {
    let kind = match buffer.data {
        Data::F32(_) => "<f4",
        Data::U32(_) => "<u4",
    };
    let lengths: String = buffer.shape.iter().map(|length| format!("{length}, ")).collect();
    let mut header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({lengths}), }}");
    // The values begin at a multiple of 64 bytes, behind a newline.
    let unpadded = MAGIC.len() + 2 + header.len() + 1;
    header.extend(std::iter::repeat_n(' ', unpadded.next_multiple_of(64) - unpadded));
    header.push('\n');
    [MAGIC, &(header.len() as u16).to_le_bytes(), header.as_bytes()].concat()
}

/// The buffer that [`write()`] wrote, or NumPy did in the same two types and C order.
///
/// # Errors
/// Bytes that are anything else.
pub fn parse(bytes: &[u8]) -> Result<Buffer, Error> {
    parsed(bytes).map_err(|what| {
        Error::new(format!("is no .npy file that can be read: {what}"))
            .remedy("save it as float32 or uint32 in C order")
    })
}

fn parsed(bytes: &[u8]) -> Result<Buffer, &'static str> {
    let rest = bytes.strip_prefix(MAGIC).ok_or("its first bytes are not those of version 1.0")?;
    let (length, rest) = rest.split_at_checked(2).ok_or("it ends in its header")?;
    let length = usize::from(u16::from_le_bytes([length[0], length[1]]));
    let (header, values) = rest.split_at_checked(length).ok_or("it ends in its header")?;
    let header = std::str::from_utf8(header).map_err(|_| "its header is no text")?;
    if !header.contains("'fortran_order': False") {
        return Err("its order is not C");
    }
    let shape = header.split_once("'shape': (").and_then(|(_, rest)| rest.split_once(')'));
    let shape: Vec<usize> = shape
        .ok_or("it has no shape")?
        .0
        .split(',')
        .map(str::trim)
        .filter(|length| !length.is_empty())
        .map(|length| length.parse().map_err(|_| "its shape is no list of whole numbers"))
        .collect::<Result<_, _>>()?;
    let count = shape.iter().try_fold(4_usize, |total, length| total.checked_mul(*length));
    if count != Some(values.len()) {
        return Err("it has more or fewer values than its shape says");
    }
    let words = values.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]));
    if header.contains("'<f4'") {
        Ok(Buffer::f32(&shape, words.map(f32::from_bits).collect()))
    } else if header.contains("'<u4'") {
        Ok(Buffer::u32(&shape, words.collect()))
    } else {
        Err("its type is neither <f4 nor <u4")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_again() {
        for buffer in [
            Buffer::f32(&[2, 3], vec![1.0, -2.5, 3.0e-40, 4.0, 5.0, 6.0]),
            Buffer::u32(&[3], vec![0, 7, u32::MAX]),
            Buffer::f32(&[0, 9], vec![]),
        ] {
            let mut bytes = Vec::new();
            write(&mut bytes, &buffer).unwrap();
            assert_eq!(parse(&bytes).unwrap(), buffer);
            assert_eq!((bytes.len() - buffer.data.len() * 4) % 64, 0);
        }
    }

    #[test]
    fn garbage_is_refused_by_name() {
        for bytes in [&b""[..], MAGIC, b"\x93NUMPY\x01\x00\x02\x00{}", b"P6 no"] {
            assert!(parse(bytes).is_err());
        }
    }
}
