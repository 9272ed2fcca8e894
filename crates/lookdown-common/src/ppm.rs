//! The length of a binary PPM file, an image without compression (Netpbm, `ppm(5)`).

/// The first bytes of a file as `ffmpeg` writes it.
pub const PPM_START: &[u8] = b"P6\n";
/// Most bytes of its header.
pub const MAX_PPM_HEADER_BYTES: usize = 32;

/// Returns the length of a PPM file with samples of 8 bits and without comments; `None` if the
/// header is another one or not whole.
pub fn ppm_length(bytes: &[u8]) -> Option<usize> {
    let head = bytes.get(..MAX_PPM_HEADER_BYTES).unwrap_or(bytes);
    let lines: Vec<&[u8]> = head.split(|byte| *byte == b'\n').collect();
    let [b"P6", size, b"255", _, ..] = lines[..] else {
        return None;
    };
    let (width, height) = str::from_utf8(size).ok()?.split_once(' ')?;
    let [width, height]: [usize; 2] = [width.parse().ok()?, height.parse().ok()?];
    let header = b"P6\n\n255\n".len() + size.len();
    width
        .checked_mul(height)?
        .checked_mul(3)?
        .checked_add(header)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_length_follows_from_the_whole_header() {
        let header = b"P6\n960 540\n255\n";
        assert_eq!(ppm_length(header), Some(header.len() + 960 * 540 * 3));
        let pixels = [&header[..], b"\n\n\n"].concat();
        assert_eq!(ppm_length(&pixels), ppm_length(header));
        assert_eq!(ppm_length(&header[..header.len() - 1]), None);
        for other in [
            b"P6\n9 5\n65535\n".as_slice(),
            b"P6\n9 -5\n255\n",
            b"P5\n9 5\n255\n",
            b"P6\n4294967296 4294967296\n255\n",
        ] {
            assert_eq!(ppm_length(other), None, "{other:?}");
        }
    }
}
