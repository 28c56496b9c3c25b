#![allow(clippy::unwrap_used)]

use super::*;
use crate::scene::gltf::tests::{corpus, documents, hurt, with_document};
use ::image::codecs::{jpeg::JpegEncoder, webp::WebPEncoder};
use ::image::ExtendedColorType;

const MOST: u64 = 1 << 20;

fn png(kind: png::ColorType, depth: png::BitDepth, size: (u32, u32), data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size.0, size.1);
    encoder.set_color(kind);
    encoder.set_depth(depth);
    if kind == png::ColorType::Indexed {
        encoder.set_palette(vec![10, 20, 30, 40, 50, 60]);
        encoder.set_trns(vec![255, 7]);
    }
    // Neither may have an influence.
    encoder.set_source_gamma(png::ScaledFloat::new(1.0));
    encoder.write_header().unwrap().write_image_data(data).unwrap();
    bytes
}

fn pixels(bytes: &[u8]) -> Pixels {
    decode(bytes, None, MOST).unwrap().0.pixels
}

#[test]
fn png_of_every_kind() {
    use png::{BitDepth::*, ColorType::*};
    let eight = |kind, data: &[u8]| pixels(&png(kind, Eight, (1, 1), data));
    assert_eq!(eight(Grayscale, &[9]), Pixels::Rgba8(vec![[9, 9, 9, 255]]));
    assert_eq!(eight(GrayscaleAlpha, &[9, 8]), Pixels::Rgba8(vec![[9, 9, 9, 8]]));
    assert_eq!(eight(Rgb, &[1, 2, 3]), Pixels::Rgba8(vec![[1, 2, 3, 255]]));
    assert_eq!(eight(Rgba, &[1, 2, 3, 4]), Pixels::Rgba8(vec![[1, 2, 3, 4]]));
    let palette = pixels(&png(Indexed, One, (2, 1), &[0b0100_0000]));
    assert_eq!(palette, Pixels::Rgba8(vec![[10, 20, 30, 255], [40, 50, 60, 7]]));
    let bits = pixels(&png(Grayscale, Two, (4, 1), &[0b0001_1011]));
    assert_eq!(bits, Pixels::Rgba8([0, 85, 170, 255].map(|grey| [grey, grey, grey, 255]).to_vec()));
    let sixteen = |kind, data: &[u8]| pixels(&png(kind, Sixteen, (1, 1), data));
    assert_eq!(sixteen(Grayscale, &[1, 2]), Pixels::Rgba16(vec![[258, 258, 258, 65535]]));
    assert_eq!(sixteen(Rgba, &[0, 1, 0, 2, 1, 0, 2, 0]), Pixels::Rgba16(vec![[1, 2, 256, 512]]));
}

fn crc(bytes: &[u8]) -> u32 {
    let bit = |crc: u32, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 };
    !bytes.iter().fold(!0, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), bit))
}

/// A 2 × 1 picture, its two pixels written in the first and in the sixth pass of Adam7.
#[test]
fn png_interlaced() {
    let chunk = |kind: &[u8; 4], data: &[u8]| {
        let mut bytes = (data.len() as u32).to_be_bytes().to_vec();
        bytes.extend(kind);
        bytes.extend(data);
        bytes.extend(crc(&bytes[4..]).to_be_bytes());
        bytes
    };
    // Stored as they are, and their Adler-32.
    let deflated = [0x78, 1, 1, 4, 0, 0xfb, 0xff, 0, 11, 0, 22, 0, 59, 0, 34];
    let mut bytes = b"\x89PNG\r\n\x1a\n".to_vec();
    bytes.extend(chunk(b"IHDR", &[0, 0, 0, 2, 0, 0, 0, 1, 8, 0, 0, 0, 1]));
    bytes.extend(chunk(b"IDAT", &deflated));
    bytes.extend(chunk(b"IEND", &[]));
    assert_eq!(pixels(&bytes), Pixels::Rgba8(vec![[11, 11, 11, 255], [22, 22, 22, 255]]));
}

fn jpeg() -> Vec<u8> {
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, 95).encode(&[200; 64 * 3], 8, 8, ExtendedColorType::Rgb8).unwrap();
    bytes
}

fn webp() -> Vec<u8> {
    let mut bytes = Vec::new();
    let data: Vec<u8> = (0..8 * 8 * 4).map(|i| i as u8).collect();
    WebPEncoder::new_lossless(&mut bytes).encode(&data, 8, 8, ExtendedColorType::Rgba8).unwrap();
    bytes
}

/// UASTC blocks of one colour each: mode 8, five bits 10111, then the colour.
fn uastc(width: u32, colours: &[[u8; 4]], zstandard: bool) -> Vec<u8> {
    let blocks: Vec<u8> =
        colours.iter().flat_map(|colour| (u128::from(u32::from_le_bytes(*colour)) << 5 | 0x17).to_le_bytes()).collect();
    // One frame of one block that is not compressed.
    let mut level = vec![0x28, 0xb5, 0x2f, 0xfd, 0x20, blocks.len() as u8, (blocks.len() << 3) as u8 | 1];
    level.extend([(blocks.len() >> 5) as u8, 0]);
    level.extend(&blocks);
    let level = if zstandard { &level } else { &blocks };
    let dfd: [u32; 11] =
        [44, 0, 2 | 40 << 16, 166 | 1 << 8 | 1 << 16, 3 | 3 << 8, 16, 0, 127 << 16 | 3 << 24, 0, 0, !0];
    let start = 104 + 44 + 4;
    let words = [0, 1, width, 4, 0, 0, 1, 1, if zstandard { 2 } else { 0 }, 104, 44, 0, 0, 0, 0, 0, 0, start, 0];
    let mut bytes = b"\xabKTX 20\xbb\r\n\x1a\n".to_vec();
    bytes.extend(words.iter().flat_map(|word: &u32| word.to_le_bytes()));
    bytes.extend((level.len() as u64).to_le_bytes());
    bytes.extend((blocks.len() as u64).to_le_bytes());
    bytes.extend(dfd.iter().flat_map(|word| word.to_le_bytes()));
    bytes.extend([0; 4]);
    bytes.extend(level);
    bytes
}

#[test]
fn jpeg_webp_and_ktx2() {
    let (image, warning) = decode(&jpeg(), Some("image/jpeg"), MOST).unwrap();
    assert_eq!((image.format.as_str(), image.width, image.height, warning), ("JPEG", 8, 8, None));
    let Pixels::Rgba8(all) = image.pixels else { panic!("JPEG has eight bits") };
    assert!(all.iter().all(|p| p[..3].iter().all(|value| value.abs_diff(200) <= 1) && p[3] == 255), "{all:?}");
    let expected = (0..64_u8).map(|i| [0, 1, 2, 3].map(|c| i.wrapping_mul(4).wrapping_add(c))).collect();
    assert_eq!(pixels(&webp()), Pixels::Rgba8(expected));
    for zstandard in [false, true] {
        let bytes = uastc(7, &[[10, 20, 30, 40], [50, 60, 70, 255]], zstandard);
        let (image, _) = decode(&bytes, Some("image/ktx2"), MOST).unwrap();
        assert_eq!((image.format.as_str(), image.width, image.height), ("KTX2 (UASTC)", 7, 4));
        let row = [[10, 20, 30, 40]; 4].into_iter().chain([[50, 60, 70, 255]; 3]);
        assert_eq!(image.pixels, Pixels::Rgba8(row.cycle().take(28).collect()), "{zstandard}");
    }
}

#[test]
fn the_first_bytes_tell_the_format() {
    let (image, warning) = decode(&jpeg(), Some("image/png"), MOST).unwrap();
    assert_eq!(image.format, "JPEG");
    assert_eq!(warning.as_deref(), Some("it is image/jpeg, but declared as image/png"));
    assert!(decode(b"GIF89a", Some("image/png"), MOST).is_err() && decode(b"", None, MOST).is_err());
}

#[test]
fn sizes_are_checked_before_decoding() {
    let pixels_of = |bytes: &[u8], most| decode(bytes, None, most).map(|_| ()).unwrap_err();
    for bytes in [jpeg(), webp()] {
        assert!(decode(&bytes, None, 64).is_ok());
        assert!(pixels_of(&bytes, 63).contains("8 × 8 is more than 63 pixels"), "{}", pixels_of(&bytes, 63));
    }
    let mut bomb = png(png::ColorType::Rgba, png::BitDepth::Eight, (1, 1), &[0; 4]);
    bomb[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
    let crc = crc(&bomb[12..29]);
    bomb[29..33].copy_from_slice(&crc.to_be_bytes());
    pixels_of(&bomb, MOST);
    let mut bomb = uastc(4, &[[1; 4]], true);
    bomb[96..104].copy_from_slice(&(1_u64 << 40).to_le_bytes());
    assert!(pixels_of(&bomb, MOST).contains("bytes are declared for 1 blocks"));
    bomb[20..28].copy_from_slice(&[0xff; 8]);
    assert!(pixels_of(&bomb, MOST).contains("more than"));
}

/// Either answer is right for a changed picture; what counts is that there is one, and of the size that it says.
#[test]
fn hurt_pictures_are_answered() {
    let sixteen = png(png::ColorType::Rgba, png::BitDepth::Sixteen, (2, 2), &[77; 32]);
    let colours = [[1, 2, 3, 4], [5, 6, 7, 8]];
    for bytes in [jpeg(), webp(), sixteen, uastc(8, &colours, false), uastc(8, &colours, true)] {
        hurt(&bytes, 300, |bytes| {
            if let Ok((image, _)) = decode(bytes, None, MOST) {
                let count = match &image.pixels {
                    Pixels::Rgba8(pixels) => pixels.len(),
                    Pixels::Rgba16(pixels) => pixels.len(),
                };
                assert_eq!(count as u64, u64::from(image.width) * u64::from(image.height));
            }
        });
    }
    for (bytes, header) in [(webp(), 40), (uastc(8, &colours, false), 151), (uastc(8, &colours, true), 151)] {
        for end in 0..bytes.len().min(header) {
            assert!(decode(&bytes[..end], None, MOST).is_err(), "cut at {end} of {}", bytes.len());
        }
    }
}

/// Every image that a document of the corpus names.
#[test]
fn every_image_decodes() {
    let Some(corpus) = corpus() else { return };
    let mut formats = std::collections::BTreeMap::<String, (usize, usize)>::new();
    let mut warnings = Vec::new();
    let show = std::env::var_os("GLIMT_SHOW_IMAGES");
    documents(&corpus, |path, document| {
        for index in 0..document.raw["images"].as_array().map_or(0, Vec::len) {
            let bytes = document.image_bytes(index).unwrap_or_else(|fault| panic!("{path}: {fault}"));
            let decoded = decode(&bytes, document.image_media_type(index), 1 << 28);
            let (image, warning) = decoded.unwrap_or_else(|fault| panic!("{path}: images[{index}]: {fault}"));
            warnings.extend(warning.map(|warning| format!("{path}: images[{index}]: {warning}")));
            let entry = formats.entry(image.format.clone()).or_default();
            *entry = (entry.0 + 1, entry.1 + bytes.len());
            let small = image.clone().limited(512);
            if let (Some(folder), Pixels::Rgba8(pixels), true) = (&show, &small.pixels, image.format.contains("KTX2")) {
                let name = format!("{}-{index}.png", path.replace('/', "-"));
                let file = std::path::Path::new(folder).join(name);
                ::image::save_buffer(file, pixels.as_flattened(), small.width, small.height, ExtendedColorType::Rgba8)
                    .unwrap();
            }
        }
    });
    println!("images and their bytes by format: {formats:?}\nwarnings: {warnings:#?}");
    assert!(formats.keys().any(|format| format.contains("ETC1S")) && formats.contains_key("WebP"), "{formats:?}");
}

/// The smallest picture of the corpus in ETC1S, which no test can write.
#[test]
fn a_hurt_etc1s_picture_is_answered() {
    let Some(corpus) = corpus() else { return };
    with_document(&corpus.join("models/CesiumBalloonKTX2/CesiumBalloonKTX2.glb"), |document| {
        let all = (0..document.raw["images"].as_array().map_or(0, Vec::len))
            .map(|index| document.image_bytes(index).unwrap());
        let smallest = all.min_by_key(|bytes| bytes.len()).unwrap();
        assert_eq!(decode(&smallest, None, MOST).unwrap().0.format, "KTX2 (ETC1S)");
        hurt(&smallest, 300, |bytes| drop(decode(bytes, None, MOST)));
    });
}
