//! Film → file: PNG, OpenEXR, Radiance HDR; written beside the target, then renamed.

use super::Film;
use crate::error::{Error, Result};
use exr::prelude::{Image, Layer, LayerAttributes, SpecificChannels, Text, WritableImage};
use image::codecs::hdr::HdrEncoder;
use image::Rgb;
use rayon::prelude::*;
use sha2::{Digest, Sha256};
use std::io::{BufWriter, Cursor, Write};
use std::path::{Path, PathBuf};

/// How a picture is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// PNG, 8 bits a channel, sRGB.
    Png8,
    /// PNG, 16 bits a channel, sRGB.
    Png16,
    /// OpenEXR, 32-bit float, linear, alpha multiplied in.
    Exr,
    /// Radiance HDR, shared exponent, linear, no alpha.
    Hdr,
}

/// What was stored.
#[derive(Clone, Debug)]
pub struct Saved {
    /// SHA-256 of the pixels as handed to the encoder, hexadecimal.
    pub sha256: String,
}

impl Format {
    /// The format that a file's extension means; PNG gets `bits` a channel.
    ///
    /// # Errors
    /// `Usage` for an unknown extension, or 16 bits for a format that is no PNG.
    pub fn of(path: &Path, bits: u8) -> Result<Self> {
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
        match (extension.as_deref(), bits) {
            (Some("png"), 8) => Ok(Format::Png8),
            (Some("png"), _) => Ok(Format::Png16),
            (Some("exr"), 8) => Ok(Format::Exr),
            (Some("hdr"), 8) => Ok(Format::Hdr),
            (Some("exr" | "hdr"), _) => Err(Error::Usage("--bits 16 is for PNG; EXR and HDR are always float".into())),
            _ => {
                Err(Error::Usage(format!("cannot tell the format of {}: end it in .png, .exr or .hdr", path.display())))
            }
        }
    }
}

/// A temporary file beside the target, removed again unless it is renamed, and the target: behind a symbolic link it is what that names, not the
/// link.
fn temporary(path: &Path) -> Result<(tempfile::NamedTempFile, PathBuf)> {
    if path.is_dir() {
        return Err(Error::write(path, "it is a folder"));
    }
    let target = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    builder.prefix(".glimt-");
    // Temporary files are private by default; a picture is as public as any new file (the umask still applies).
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let file = builder.tempfile_in(folder).map_err(|error| Error::write(path, error.to_string()))?;
    Ok((file, target))
}

/// Finds out, before any work is done, whether a picture could be written there.
///
/// # Errors
/// `Write` when not.
pub fn check_writable(path: &Path) -> Result<()> {
    temporary(path).map(drop)
}

/// Writes a file as a whole or not at all: to a temporary file beside it, which is renamed.
///
/// # Errors
/// `Write` when that fails.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let (mut file, target) = temporary(path)?;
    file.write_all(bytes).map_err(|error| Error::write(path, error))?;
    file.persist(target).map_err(|error| Error::write(path, error.error))?;
    Ok(())
}

impl Film {
    /// Writes the picture to a temporary file in the target's folder and renames it, so that the target is never half
    /// written; calls `may_finish` just before the rename.
    ///
    /// # Errors
    /// `Write` when that fails; `Usage` when the format cannot hold the picture; whatever `may_finish` answers.
    pub fn save(&self, path: &Path, format: Format, may_finish: impl FnOnce() -> Result<()>) -> Result<Saved> {
        self.save_with_notes(path, format, &[], may_finish)
    }

    /// As [`Film::save`], with notes (keyword and text) in the file: PNG text chunks, the EXR layer's comments, HDR comment lines.
    ///
    /// # Errors
    /// As [`Film::save`].
    pub fn save_with_notes(
        &self,
        path: &Path,
        format: Format,
        notes: &[(&str, String)],
        may_finish: impl FnOnce() -> Result<()>,
    ) -> Result<Saved> {
        let (mut file, target) = temporary(path)?;
        let mut writer = BufWriter::new(file.as_file_mut());
        let saved = self.encode(&mut writer, format, notes, path)?;
        writer.flush().map_err(|error| Error::write(path, error))?;
        drop(writer);
        may_finish()?;
        file.persist(target).map_err(|error| Error::write(path, error.error))?;
        Ok(saved)
    }

    /// Writes the picture to a stream.
    ///
    /// # Errors
    /// As [`Film::save`]; `name` stands for the stream in messages.
    pub fn encode(
        &self,
        writer: &mut impl Write,
        format: Format,
        notes: &[(&str, String)],
        name: &Path,
    ) -> Result<Saved> {
        let sha256 = match format {
            Format::Png8 | Format::Png16 => self.encode_png(writer, format == Format::Png16, notes, name)?,
            Format::Exr => self.encode_exr(writer, notes, name)?,
            Format::Hdr => self.encode_hdr(writer, notes, name)?,
        };
        Ok(Saved { sha256 })
    }

    fn encode_png(&self, writer: &mut impl Write, deep: bool, notes: &[(&str, String)], name: &Path) -> Result<String> {
        let failed = |error: png::EncodingError| Error::write(name, error);
        let pixels = 0..self.pixels.len();
        let channels = if self.has_alpha { 4 } else { 3 };
        let mut bytes: Vec<u8> = if deep {
            let sample = |value: f32| ((value * 65535.0 + 0.5) as u16).to_le_bytes();
            pixels.into_par_iter().flat_map_iter(|i| self.srgb(i).into_iter().take(channels).flat_map(sample)).collect()
        } else {
            pixels.into_par_iter().flat_map_iter(|i| self.srgb8(i).into_iter().take(channels)).collect()
        };
        let sha256 = digest(&bytes);
        if deep {
            // PNG has the high byte first.
            bytes.par_chunks_exact_mut(2).for_each(<[u8]>::reverse);
        }
        let mut encoder = png::Encoder::new(writer, self.width, self.height);
        encoder.set_color(if self.has_alpha { png::ColorType::Rgba } else { png::ColorType::Rgb });
        encoder.set_depth(if deep { png::BitDepth::Sixteen } else { png::BitDepth::Eight });
        encoder.set_compression(png::Compression::Fast);
        encoder.set_filter(png::Filter::Adaptive);
        for (keyword, text) in notes {
            encoder.add_text_chunk((*keyword).into(), text.clone()).map_err(failed)?;
        }
        let mut png = encoder.write_header().map_err(failed)?;
        png.write_image_data(&bytes).map_err(failed)?;
        png.finish().map_err(failed)?;
        Ok(sha256)
    }

    fn encode_exr(&self, writer: &mut impl Write, notes: &[(&str, String)], name: &Path) -> Result<String> {
        let channels = if self.has_alpha { 4 } else { 3 };
        let samples: Vec<f32> = self.pixels.iter().flat_map(|pixel| pixel.iter().copied().take(channels)).collect();
        let sha256 = digest(bytemuck::cast_slice(&samples));
        let size = (self.width as usize, self.height as usize);
        let pixel = |place: exr::prelude::Vec2<usize>| self.pixels[place.y() * size.0 + place.x()];
        let mut attributes = LayerAttributes::default();
        if !notes.is_empty() {
            let lines: Vec<String> = notes.iter().map(|(keyword, text)| format!("{keyword}: {text}")).collect();
            attributes.comments = Text::new_or_none(lines.join("; "));
        }
        let encoding = exr::prelude::Encoding::FAST_LOSSLESS;
        // The encoder seeks, a pipe cannot.
        let mut file = Cursor::new(Vec::new());
        let written = if self.has_alpha {
            let rgba = SpecificChannels::rgba(|place| {
                let [r, g, b, a] = pixel(place);
                (r, g, b, a)
            });
            Image::from_layer(Layer::new(size, attributes, encoding, rgba)).write().to_buffered(&mut file)
        } else {
            let rgb = SpecificChannels::rgb(|place| {
                let [r, g, b, _] = pixel(place);
                (r, g, b)
            });
            Image::from_layer(Layer::new(size, attributes, encoding, rgb)).write().to_buffered(&mut file)
        };
        written.map_err(|error| Error::write(name, error))?;
        writer.write_all(file.get_ref()).map_err(|error| Error::write(name, error))?;
        Ok(sha256)
    }

    fn encode_hdr(&self, writer: &mut impl Write, notes: &[(&str, String)], name: &Path) -> Result<String> {
        if self.has_alpha {
            return Err(Error::Usage("Radiance HDR has no alpha: write a transparent picture as .png or .exr".into()));
        }
        let rgb: Vec<Rgb<f32>> = self.pixels.iter().map(|[r, g, b, _]| Rgb([*r, *g, *b])).collect();
        let samples: Vec<f32> = rgb.iter().flat_map(|pixel| pixel.0).collect();
        let sha256 = digest(bytemuck::cast_slice(&samples));
        let mut file = Vec::new();
        let (width, height) = (self.width as usize, self.height as usize);
        HdrEncoder::new(&mut file).encode(&rgb, width, height).map_err(|error| Error::write(name, error))?;
        // Comments follow the first line.
        let first_line = file.iter().position(|byte| *byte == b'\n').map_or(0, |end| end + 1);
        let comments: String = notes.iter().map(|(keyword, text)| format!("# {keyword}: {text}\n")).collect();
        file.splice(first_line..first_line, comments.bytes());
        writer.write_all(&file).map_err(|error| Error::write(name, error))?;
        Ok(sha256)
    }
}

/// Lower-case hexadecimal SHA-256.
fn digest(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}
