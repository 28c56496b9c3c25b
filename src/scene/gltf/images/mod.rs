//! glTF images → [`Image`]: where their bytes lie, and their formats.

mod header;
mod ktx2;
mod source;

pub(super) use header::Header;
pub(super) use source::other_type;

use crate::scene::{Image, Pixels};
use ::image::{ColorType, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::io::Cursor;

/// Memory that a decoder may take beside its picture.
const DECODER_BYTES: u64 = 1 << 28;

/// Decodes a picture of at most `most_pixels`, checked before anything is decoded. Its format is what its first bytes say; the
/// second part of the answer is a warning when that is not its `media_type`. Its name is left empty.
pub(super) fn decode(
    bytes: &[u8],
    media_type: Option<&str>,
    most_pixels: u64,
) -> Result<(Image, Option<String>), String> {
    let ordinary = |format: ImageFormat, name: &str| decode_ordinary(bytes, format, name, most_pixels);
    let own_type = header::media_type(bytes)?;
    let image = guarded(|| match own_type {
        "image/png" => ordinary(ImageFormat::Png, "PNG"),
        "image/jpeg" => ordinary(ImageFormat::Jpeg, "JPEG"),
        "image/webp" => ordinary(ImageFormat::WebP, "WebP"),
        _ => ktx2::decode(bytes, most_pixels),
    })?;
    Ok((image, media_type.and_then(|declared| other_type(declared, own_type))))
}

/// Runs a decoder. Another's code at work on what anybody may have written: should it panic, that is one more fault of the
/// file and no end of the program.
fn guarded(decode: impl FnOnce() -> Result<Image, String> + std::panic::UnwindSafe) -> Result<Image, String> {
    std::panic::catch_unwind(decode).unwrap_or_else(|_| Err("the decoder cannot read it".into()))
}

/// `Err` for a picture of no or of too many pixels.
fn check_size(width: u32, height: u32, most_pixels: u64) -> Result<(), String> {
    match u64::from(width) * u64::from(height) {
        0 => Err(format!("{width} × {height} is no size")),
        pixels if pixels > most_pixels => Err(format!("{width} × {height} is more than {most_pixels} pixels")),
        _ => Ok(()),
    }
}

/// What the `image` crate decodes. It expands palettes, bits and transparent colours, and applies neither gamma nor profiles.
fn decode_ordinary(bytes: &[u8], format: ImageFormat, name: &str, most_pixels: u64) -> Result<Image, String> {
    let broken = |error: ::image::ImageError| format!("{name}: {error}");
    let mut limits = Limits::default();
    limits.max_alloc = Some(most_pixels.saturating_mul(8).saturating_add(DECODER_BYTES));
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(broken)?;
    let (width, height) = decoder.dimensions();
    check_size(width, height, most_pixels)?;
    let kind = decoder.color_type();
    let size = usize::try_from(decoder.total_bytes()).map_err(|error| error.to_string())?;
    let mut raw = vec![0; size];
    decoder.read_image(&mut raw).map_err(broken)?;
    let pixels = match kind {
        ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8 => {
            Pixels::Rgba8(spread(&raw, kind.channel_count(), u8::MAX))
        }
        ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => {
            let words: Vec<u16> = raw.chunks_exact(2).map(|pair| u16::from_ne_bytes([pair[0], pair[1]])).collect();
            Pixels::Rgba16(spread(&words, kind.channel_count(), u16::MAX))
        }
        other => return Err(format!("{name}: pixels of type {other:?} are not known")),
    };
    Ok(Image { name: String::new(), format: name.into(), width, height, pixels, bytes: bytes.len() })
}

/// Pixels of one to four components: grey for all colours, `opaque` for an alpha that is not there.
fn spread<T: Copy>(values: &[T], components: u8, opaque: T) -> Vec<[T; 4]> {
    let pixel = |values: &[T]| match *values {
        [grey] => [grey, grey, grey, opaque],
        [grey, alpha] => [grey, grey, grey, alpha],
        [red, green, blue] => [red, green, blue, opaque],
        [red, green, blue, alpha] => [red, green, blue, alpha],
        _ => [opaque; 4],
    };
    values.chunks_exact(components.into()).map(pixel).collect()
}

#[cfg(test)]
mod tests;
