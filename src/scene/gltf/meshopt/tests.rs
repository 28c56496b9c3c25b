#![allow(clippy::unwrap_used)]

use super::*;
use crate::scene::gltf::tests::{bytes_of, hurt};
use std::borrow::Cow;

/// The positions (0 0 0), (1 0 0), (0 1 0), and twenty elements of a float, 0.5 a step, and two 16 bit integers, 300 and 301 a
/// step; in version 1 these are an XOR of floats and differences of 16 bits.
const TRIANGLE: [&str; 2] = [
    "a00000013c000000ffff013c0000007e7d0000010c000000ff010c0000007e000000000000000000000000000000000000000000000000\
     000000000000000000000000",
    "a1eaeaaa007f7f00007f000000000000000000000000000000000000000000120100",
];
const RAMPS: [&str; 2] = [
    "a00000070000ff80804040404020202020202020ff0000002010101005308000007e800000000700585858585858585858585858585858\
     ff00000058585858052aaeaaea0404ae0000000407005a5a5a5a5a5a5a5a5a5a5a5a5a5a5aff0000005a5a5a5a052aaeaaea0404ae0000\
     00040000000000000000000000000000000000000000000000000000000000000000",
    "a16877011200070f020ff8f4c4f262e262e010f81c0f003e0103010058585858585858585858585858585858585858052aaaaaaaaa0000\
     00005a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a5a052aaaaaaaaa000000000000000000000000000000000000000000000000005201",
];
const TRIANGLES: &str = "e1f01000ffff120101007687566778a9866589689801690000";
/// Ten triangles in which every kind of code occurs, and their corners.
const EVERY_CODE: &str = "e1fe204e1e0f05fffbfe0dff120d003f0014f304007687566778a9866589689801690000";
const CORNERS: [u16; 30] =
    [0, 9, 2, 9, 0, 1, 9, 0, 3, 3, 0, 4, 3, 4, 4, 3, 4, 9, 4, 3, 14, 2, 0, 9, 3, 16, 4, 3, 4, 15];
const INDICES: &str = "d100040400020802040414020200000000";

fn ramps() -> Vec<u8> {
    let element =
        |i: u16| [(f32::from(i) * 0.5).to_le_bytes(), (u32::from(i) * (300 | 301 << 16)).to_le_bytes()].concat();
    (0..20).flat_map(element).collect()
}

fn words(bytes: &[u8]) -> Vec<u16> {
    bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect()
}

#[test]
fn attributes_of_both_versions() {
    let triangle: Vec<u8> =
        [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    for version in 0..2 {
        assert_eq!(attributes::decode(&bytes_of(TRIANGLE[version]), 3, 12).unwrap(), triangle, "{version}");
        assert_eq!(attributes::decode(&bytes_of(RAMPS[version]), 20, 8).unwrap(), ramps(), "{version}");
    }
}

#[test]
fn triangles_and_indices_of_both_sizes() {
    let triangles = bytes_of(TRIANGLES);
    // The compressor may turn a triangle, not over.
    let expected = [0, 1, 2, 2, 1, 3, 2, 3, 4, 9, 8, 7];
    assert_eq!(words(&indices::decode_triangles(&triangles, 12, 2).unwrap()), expected);
    let wide = indices::decode_triangles(&triangles, 12, 4).unwrap();
    assert_eq!(wide.len(), 48);
    assert_eq!(words(&wide).into_iter().step_by(2).collect::<Vec<u16>>(), expected);
    assert_eq!(words(&indices::decode_triangles(&bytes_of(EVERY_CODE), 30, 2).unwrap()), CORNERS);
    let indices = bytes_of(INDICES);
    assert_eq!(words(&indices::decode_indices(&indices, 12, 2).unwrap()), expected);
}

#[test]
fn hurt_data_are_answered() {
    let (triangles, indices) = (bytes_of(TRIANGLES), bytes_of(INDICES));
    for version in 0..2 {
        for (text, count, stride) in [(TRIANGLE[version], 3, 12), (RAMPS[version], 20, 8)] {
            let bytes = bytes_of(text);
            (0..bytes.len())
                .for_each(|end| assert!(attributes::decode(&bytes[..end], count, stride).is_err(), "{end}"));
            hurt(&bytes, 500, |bytes| drop(attributes::decode(bytes, count, stride)));
        }
    }
    (0..triangles.len()).for_each(|end| assert!(indices::decode_triangles(&triangles[..end], 12, 2).is_err(), "{end}"));
    hurt(&triangles, 500, |bytes| drop(indices::decode_triangles(bytes, 12, 2)));
    hurt(&bytes_of(EVERY_CODE), 500, |bytes| drop(indices::decode_triangles(bytes, 30, 4)));
    (0..indices.len()).for_each(|end| assert!(indices::decode_indices(&indices[..end], 12, 2).is_err(), "{end}"));
    hurt(&indices, 500, |bytes| drop(indices::decode_indices(bytes, 12, 2)));
    // Counts that the bytes are not for.
    assert!(attributes::decode(&bytes_of(TRIANGLE[0]), 300, 12).is_err());
    assert!(indices::decode_triangles(&triangles, 9, 2).is_err() && indices::decode_indices(&indices, 11, 2).is_err());
}

#[test]
fn sizes_are_checked_before_decoding() {
    let buffers = [Ok(Cow::from(bytes_of(TRIANGLE[1])))];
    let mut view =
        serde_json::json!({"buffer": 0, "byteLength": 34, "byteStride": 12, "count": 3, "mode": "ATTRIBUTES"});
    let decompress = |view: &Value, left: u64| decompress_one(view, &buffers, &mut { left });
    assert_eq!(decompress(&view, 36).map(|bytes| bytes.len()), Ok(36));
    assert!(decompress(&view, 35).unwrap_err().contains("more memory than is left"));
    for (name, value, fault) in [
        ("count", serde_json::json!(3000), "cannot come from 34 bytes"),
        ("count", serde_json::json!(u64::MAX), "cannot come from 34 bytes"),
        ("byteStride", serde_json::json!(0), "do not fit its mode"),
        ("byteStride", serde_json::json!(260), "do not fit its mode"),
        ("filter", serde_json::json!("QUATERNION"), "do not fit its mode"),
        ("filter", serde_json::json!("NEW"), "unknown variant"),
        ("mode", serde_json::json!("TRIANGLES"), "do not fit its mode"),
        ("mode", serde_json::json!(7), "expected string"),
        ("buffer", serde_json::json!(1), "there is no buffers[1]"),
        ("byteLength", serde_json::json!(35), "do not fit into buffers[0]"),
        ("byteOffset", serde_json::json!(u64::MAX), "do not fit into buffers[0]"),
    ] {
        let right = view[name].take();
        view[name] = value;
        let message = decompress(&view, 1 << 20).unwrap_err();
        assert!(message.contains(fault), "{message}");
        match right {
            Value::Null => drop(view.as_object_mut().unwrap().remove(name)),
            right => view[name] = right,
        }
    }
}
