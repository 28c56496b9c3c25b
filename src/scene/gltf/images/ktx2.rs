//! KTX2 as KHR_texture_basisu allows it: ETC1S with BasisLZ, UASTC with or without Zstandard.

use super::check_size;
use crate::scene::{Image, Pixels};
use basisu::{DecodeFlags, SourceFormat, TargetFormat, Transcoder};

/// What the decoder would otherwise believe, read from the header and the first level's entry (KTX 2.0, 3).
struct Header {
    vk_format: u32,
    width: u32,
    height: u32,
    faces: u32,
    layers: u32,
    supercompression: u32,
    uncompressed: u64,
}

const ZSTANDARD: u32 = 2;

impl Header {
    fn read(bytes: &[u8]) -> Option<Self> {
        let word = |at: usize| Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
        Some(Self {
            vk_format: word(12)?,
            width: word(20)?,
            height: word(24)?,
            layers: word(32)?,
            faces: word(36)?,
            supercompression: word(44)?,
            uncompressed: u64::from(word(96)?) | u64::from(word(100)?) << 32,
        })
    }

    fn check(&self, most_pixels: u64) -> Result<(), String> {
        check_size(self.width, self.height, most_pixels)?;
        if self.vk_format != 0 || self.faces != 1 || self.layers > 1 {
            return Err("KTX2: only flat pictures in Basis Universal are known".into());
        }
        // The decoder allocates what is declared here: 16 bytes for a block of 4 × 4 pixels.
        let blocks = u64::from(self.width.div_ceil(4)) * u64::from(self.height.div_ceil(4));
        if self.supercompression == ZSTANDARD && self.uncompressed != 16 * blocks {
            return Err(format!("KTX2: {} bytes are declared for {blocks} blocks of 16", self.uncompressed));
        }
        Ok(())
    }
}

/// Decodes the first level.
pub(super) fn decode(bytes: &[u8], most_pixels: u64) -> Result<Image, String> {
    let header = Header::read(bytes).ok_or("KTX2: the file ends inside its header")?;
    header.check(most_pixels)?;
    let broken = |error: basisu::Error| format!("KTX2: {error:?}");
    let transcoder = Transcoder::new(bytes).map_err(broken)?;
    let format = match transcoder.source_format() {
        SourceFormat::Etc1s => "KTX2 (ETC1S)",
        SourceFormat::UastcLdr => "KTX2 (UASTC)",
        other => return Err(format!("KTX2: {other:?} is not one of ETC1S and UASTC")),
    };
    let raw = transcoder.transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE).map_err(broken)?;
    let pixels: Vec<[u8; 4]> = raw.chunks_exact(4).map(|p| [p[0], p[1], p[2], p[3]]).collect();
    let Header { width, height, .. } = header;
    if pixels.len() as u64 != u64::from(width) * u64::from(height) {
        return Err(format!("KTX2: {} pixels were decoded of {width} × {height}", pixels.len()));
    }
    let pixels = Pixels::Rgba8(pixels);
    Ok(Image { name: String::new(), format: format.into(), width, height, pixels, bytes: bytes.len() })
}
