//! What is done to attributes after they were decompressed.

use serde::Deserialize;

/// A filter by its name in the file.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum Filter {
    #[default]
    None,
    Octahedral,
    Quaternion,
    Exponential,
    Color,
}

impl Filter {
    /// Whether elements of `stride` bytes can have it; `stride` is a multiple of 4.
    pub fn fits(self, stride: usize) -> bool {
        match self {
            Filter::None | Filter::Exponential => true,
            Filter::Octahedral | Filter::Color => stride == 4 || stride == 8,
            Filter::Quaternion => stride == 8,
        }
    }

    /// Undoes it in place, elements of `stride` bytes that it fits.
    pub fn undo(self, bytes: &mut [u8], stride: usize) {
        let elements = bytes.chunks_exact_mut(stride);
        match self {
            Filter::None => {}
            Filter::Exponential => bytes.chunks_exact_mut(4).for_each(exponential),
            Filter::Octahedral if stride == 4 => elements.for_each(|element| {
                let decoded = octahedral([0, 1, 2].map(|i| f32::from(element[i] as i8)), 127.0);
                (0..3).for_each(|i| element[i] = decoded[i] as i8 as u8);
            }),
            Filter::Octahedral => elements.for_each(|element| {
                let decoded = octahedral([0, 1, 2].map(|i| f32::from(word(element, i) as i16)), 32767.0);
                (0..3).for_each(|i| set_word(element, i, decoded[i] as i16 as u16));
            }),
            Filter::Quaternion => elements.for_each(quaternion),
            Filter::Color if stride == 4 => elements.for_each(|element| {
                let [y, co, cg, a] = [0, 1, 2, 3].map(|i| element[i]);
                let decoded = color([y.into(), (co as i8).into(), (cg as i8).into(), a.into()], 255.0);
                (0..4).for_each(|i| element[i] = decoded[i] as u8);
            }),
            Filter::Color => elements.for_each(|element| {
                let [y, co, cg, a] = [0, 1, 2, 3].map(|i| word(element, i));
                let decoded = color([y.into(), (co as i16).into(), (cg as i16).into(), a.into()], 65535.0);
                (0..4).for_each(|i| set_word(element, i, decoded[i] as u16));
            }),
        }
    }
}

fn word(element: &[u8], index: usize) -> u16 {
    u16::from_le_bytes([element[2 * index], element[2 * index + 1]])
}

fn set_word(element: &mut [u8], index: usize, value: u16) {
    element[2 * index..2 * index + 2].copy_from_slice(&value.to_le_bytes());
}

/// A unit vector, times `largest`, from two octahedral coordinates and what stands for 1.
fn octahedral([x, y, one]: [f32; 3], largest: f32) -> [f32; 3] {
    let (x, y) = (x / one, y / one);
    let z = 1.0 - x.abs() - y.abs();
    let fold = z.min(0.0);
    let (x, y) = (x - fold.copysign(x), y - fold.copysign(y));
    let length = (x * x + y * y + z * z).sqrt();
    [x, y, z].map(|value| (value / length * largest).round())
}

/// Three components and, in the last two bits, the place of the largest, which is left out.
fn quaternion(element: &mut [u8]) {
    let stored = [0, 1, 2, 3].map(|i| word(element, i) as i16);
    let one = f32::from(stored[3] | 3);
    let [x, y, z] = [0, 1, 2].map(|i| f32::from(stored[i]) / one * std::f32::consts::FRAC_1_SQRT_2);
    let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
    let largest = (stored[3] & 3) as usize;
    for (step, value) in [w, x, y, z].into_iter().enumerate() {
        set_word(element, (largest + step) % 4, (value * 32767.0).round() as i16 as u16);
    }
}

/// Eight bits of exponent over 24 of mantissa, both signed. In f64, so that every float comes out exactly.
fn exponential(value: &mut [u8]) {
    let stored = i32::from_le_bytes([value[0], value[1], value[2], value[3]]);
    let decoded = f64::from(stored << 8 >> 8) * 2.0_f64.powi(stored >> 24);
    value.copy_from_slice(&(decoded as f32).to_le_bytes());
}

/// RGBA, times `largest`, from Y, Co, Cg and an alpha whose highest bit tells the scale.
fn color([y, co, cg, alpha]: [i32; 4], largest: f32) -> [f32; 4] {
    let scale = (1_i32 << (32 - alpha.leading_zeros())) - 1;
    let low = alpha & (scale >> 1);
    let rgba = [y + co - cg, y + cg, y - co - cg, low << 1 | low & 1];
    rgba.map(|value| (value as f32 * (largest / scale as f32)).round())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn undo<const N: usize>(filter: Filter, mut bytes: [u8; N]) -> [u8; N] {
        assert!(filter.fits(N));
        filter.undo(&mut bytes, N);
        bytes
    }

    #[test]
    fn values_worked_out_by_hand() {
        assert_eq!(undo(Filter::None, [1, 2, 3, 4]), [1, 2, 3, 4]);
        // X, Z and, with 1 stored in four bits, the middle between X and -Y. The fourth byte passes.
        assert_eq!(undo(Filter::Octahedral, [127, 0, 127, 5]), [127, 0, 0, 5]);
        assert_eq!(undo(Filter::Octahedral, [0, 0, 127, 5]), [0, 0, 127, 5]);
        assert_eq!(undo(Filter::Octahedral, [8, (-8_i8) as u8, 16, 0]), [90, (-90_i8) as u8, 0, 0]);
        let halves = |values: [i16; 4]| -> [u8; 8] {
            let mut bytes = [0; 8];
            (0..4).for_each(|i| set_word(&mut bytes, i, values[i] as u16));
            bytes
        };
        // Beyond the equator both coordinates are folded.
        assert_eq!(undo(Filter::Octahedral, halves([32767, 32767, 32767, -9])), halves([0, 0, -32767, -9]));
        assert_eq!(undo(Filter::Quaternion, halves([0, 0, 0, 32767])), halves([0, 0, 0, 32767]));
        assert_eq!(undo(Filter::Quaternion, halves([32767, 0, 0, 32764])), halves([23170, 23170, 0, 0]));
        assert_eq!(undo(Filter::Exponential, (-1 << 24 | 3_i32).to_le_bytes()), 1.5_f32.to_le_bytes());
        assert_eq!(
            undo(Filter::Exponential, (100 << 24 | 0xff_ffff_i32).to_le_bytes()),
            (-2_f32.powi(100)).to_le_bytes()
        );
        assert_eq!(undo(Filter::Color, [100, 10, 20, 0xff]), [90, 120, 70, 255]);
        // Four bits of colour, three of alpha.
        assert_eq!(undo(Filter::Color, [15, 0, 0, 0b1000]), [255, 255, 255, 0]);
        assert!(!Filter::Quaternion.fits(4) && !Filter::Color.fits(12) && Filter::Exponential.fits(12));
    }

    /// Values that no compressor writes.
    #[test]
    fn zeros_and_ones_are_answered() {
        for filter in [Filter::Octahedral, Filter::Quaternion, Filter::Exponential, Filter::Color] {
            for byte in [0, 0x7f, 0x80, 0xff] {
                undo(filter, [byte; 8]);
                if filter.fits(4) {
                    undo(filter, [byte; 4]);
                }
            }
        }
    }
}
