//! Decoded pictures.

/// A decoded picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Name, for messages.
    pub name: String,
    /// What it was decoded from: "PNG", "JPEG", "WebP", "KTX2 (UASTC)" …
    pub format: String,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Row by row from the top.
    pub pixels: Pixels,
    /// Bytes of what it was decoded from.
    pub bytes: usize,
}

/// Pixels: red, green, blue, alpha. Grey is spread, alpha that is missing is the largest value.
#[derive(Clone, Debug, PartialEq)]
pub enum Pixels {
    /// 8 bits a channel.
    Rgba8(Vec<[u8; 4]>),
    /// 16 bits a channel.
    Rgba16(Vec<[u16; 4]>),
}
