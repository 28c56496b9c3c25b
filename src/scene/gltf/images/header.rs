//! What the first bytes of a picture say: its format and size.

/// Most segments of a JPEG before its size: many images may name the same bytes.
const MOST_SEGMENTS: usize = 10_000;

/// What a picture claims to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::scene::gltf) struct Header {
    pub media_type: &'static str,
    pub width: u32,
    pub height: u32,
    /// A component has 16 bits.
    pub is_wide: bool,
}

impl Header {
    /// Reads the header of a picture; of a large one its beginning is enough.
    pub fn of(bytes: &[u8]) -> Result<Self, String> {
        let media_type = media_type(bytes)?;
        let size = match media_type {
            "image/png" => png(bytes),
            "image/jpeg" => jpeg(bytes),
            "image/webp" => webp(bytes),
            _ => le(bytes, 20, 4).zip(le(bytes, 24, 4)),
        };
        let (width, height) = size.ok_or("it is cut off or broken before its size")?;
        let is_wide = media_type == "image/png" && bytes.get(24) == Some(&16);
        Ok(Self { media_type, width, height, is_wide })
    }

    /// Numbers of four bytes that its pixels take.
    pub fn numbers(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height) * if self.is_wide { 2 } else { 1 }
    }

    /// The same after it was halved until neither side is greater than `most`.
    pub fn limited(mut self, most: u32) -> Self {
        while self.width.max(self.height) > most.max(1) {
            (self.width, self.height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        }
        self
    }
}

/// The format that the first bytes stand for.
pub(super) fn media_type(bytes: &[u8]) -> Result<&'static str, String> {
    match bytes {
        [0x89, b'P', b'N', b'G', ..] => Ok("image/png"),
        [0xff, 0xd8, 0xff, ..] => Ok("image/jpeg"),
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => Ok("image/webp"),
        [0xab, b'K', b'T', b'X', b' ', b'2', b'0', 0xbb, ..] => Ok("image/ktx2"),
        _ => Err("it is none of PNG, JPEG, WebP and KTX2".into()),
    }
}

/// A little-endian number of `length` bytes.
fn le(bytes: &[u8], at: usize, length: usize) -> Option<u32> {
    Some(bytes.get(at..at + length)?.iter().rev().fold(0, |number, byte| number << 8 | u32::from(*byte)))
}

/// A big-endian number of `length` bytes.
fn be(bytes: &[u8], at: usize, length: usize) -> Option<u32> {
    Some(bytes.get(at..at + length)?.iter().fold(0, |number, byte| number << 8 | u32::from(*byte)))
}

/// Signature, then the chunk IHDR (PNG, 11.2.1).
fn png(bytes: &[u8]) -> Option<(u32, u32)> {
    let is_first = bytes.get(12..16) == Some(b"IHDR");
    be(bytes, 16, 4).zip(be(bytes, 20, 4)).filter(|_| is_first)
}

/// Segments up to a frame's header (ITU-T T.81, B.2.2).
fn jpeg(bytes: &[u8]) -> Option<(u32, u32)> {
    let mut at = 2;
    for _ in 0..MOST_SEGMENTS {
        let [0xff, marker] = *bytes.get(at..at + 2)? else { return None };
        match marker {
            // Markers may be filled up, and some stand alone.
            0xff => at += 1,
            0x01 | 0xd0..=0xd7 => at += 2,
            0xc0..=0xcf if ![0xc4, 0xc8, 0xcc].contains(&marker) => {
                return be(bytes, at + 7, 2).zip(be(bytes, at + 5, 2));
            }
            _ => at += 2 + be(bytes, at + 2, 2).filter(|length| *length >= 2)? as usize,
        }
    }
    None
}

/// The first chunk: extended, lossless or lossy (RFC 9649, 2.5 to 2.7).
fn webp(bytes: &[u8]) -> Option<(u32, u32)> {
    match bytes.get(12..16)? {
        b"VP8X" => Some((le(bytes, 24, 3)? + 1, le(bytes, 27, 3)? + 1)),
        b"VP8L" => le(bytes, 21, 4).map(|bits| ((bits & 0x3fff) + 1, (bits >> 14 & 0x3fff) + 1)),
        b"VP8 " => Some((le(bytes, 26, 2)? & 0x3fff, le(bytes, 28, 2)? & 0x3fff)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::image::{DynamicImage, ImageFormat};

    #[test]
    fn headers_say_what_the_encoders_wrote() {
        for (format, media_type) in
            [(ImageFormat::Png, "image/png"), (ImageFormat::Jpeg, "image/jpeg"), (ImageFormat::WebP, "image/webp")]
        {
            let mut bytes = std::io::Cursor::new(Vec::new());
            DynamicImage::new_rgb8(37, 300).write_to(&mut bytes, format).unwrap_or_else(|error| panic!("{error}"));
            let header = Header { media_type, width: 37, height: 300, is_wide: false };
            assert_eq!(Header::of(bytes.get_ref()), Ok(header), "{format:?}");
            for end in 0..16 {
                assert!(Header::of(&bytes.get_ref()[..end]).is_err(), "{format:?} of {end} bytes");
            }
        }
        assert_eq!(webp(b"RIFF----WEBPVP8X----\0\0\0\0\x07\0\0\x02\x01\0"), Some((8, 259)));
        assert_eq!(webp(b"RIFF----WEBPVP8 ----\0\0\0\x9d\x01\x2a\x10\x40\x03\0"), Some((16, 3)));
    }

    #[test]
    fn wide_pixels_count_twice() {
        let header = Header { media_type: "image/png", width: 9, height: 4, is_wide: true };
        assert_eq!((header.numbers(), header.limited(4).numbers()), (72, 16));
    }
}
