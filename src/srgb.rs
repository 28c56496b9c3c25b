//! sRGB's transfer function (IEC 61966-2-1), both ways, and its 8-bit codes without a power for each: of pictures that are read, of those that are
//! written, and of mipmaps between.

use std::sync::LazyLock;

/// Light below this has code 0.
const LEAST: f32 = 1.0 / 8192.0;
/// Low bits of a float that differ within a slot. The exponent and seven bits of the fraction are the same: short enough for one border at most.
const SLOT_SHIFT: u32 = 16;

/// A short range of light: where in it the code goes up by one, if it does.
#[derive(Clone, Copy)]
struct Slot {
    /// Least light with the higher code; infinite where there is none.
    border: f32,
    /// Code below the border.
    below: u8,
}

/// Slots from [`LEAST`] to 1.
static SLOTS: LazyLock<Vec<Slot>> = LazyLock::new(|| {
    let borders: Vec<f32> = (1..=255).map(border).collect();
    (0..=slot_of(1.0))
        .map(|slot| {
            let start = |slot: usize| f32::from_bits(LEAST.to_bits() + ((slot as u32) << SLOT_SHIFT));
            let below = borders.partition_point(|border| *border <= start(slot));
            let next = borders.get(below).filter(|border| **border < start(slot + 1));
            Slot { border: *next.unwrap_or(&f32::INFINITY), below: below as u8 }
        })
        .collect()
});

/// The 8-bit code of light, rounded to the nearest; out of range is clamped, NaN becomes 0.
pub fn code(light: f32) -> u8 {
    // NaN is not more than anything.
    let light = if light > LEAST { light.min(1.0) } else { LEAST };
    let slot = SLOTS[slot_of(light)];
    slot.below + u8::from(light >= slot.border)
}

/// The slot of light between [`LEAST`] and 1.
fn slot_of(light: f32) -> usize {
    ((light.to_bits() - LEAST.to_bits()) >> SLOT_SHIFT) as usize
}

/// The least light whose code is `code`, at least 1.
fn border(code: u8) -> f32 {
    let border = decode((f64::from(code) - 0.5) / 255.0);
    let nearest = border as f32;
    if f64::from(nearest) < border {
        nearest.next_up()
    } else {
        nearest
    }
}

/// Linear to sRGB, both 0 to 1; out of range is clamped, NaN becomes 0.
pub fn encode(light: f64) -> f64 {
    let light = if light > 0.0 { light.min(1.0) } else { 0.0 };
    if light <= 0.003_130_8 {
        12.92 * light
    } else {
        1.055 * light.powf(1.0 / 2.4) - 0.055
    }
}

/// sRGB to linear, both 0 to 1.
pub fn decode(srgb: f64) -> f64 {
    if srgb <= 0.04045 {
        srgb / 12.92
    } else {
        ((srgb + 0.055) / 1.055).powf(2.4)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By the formula; `border` goes the other way.
    fn exact(light: f32) -> u8 {
        (255.0 * encode(light.into()) + 0.5) as u8
    }

    #[test]
    fn codes_are_those_of_the_formula() {
        // Every 97th float up to 1: some ten million.
        for bits in (0..=1.0_f32.to_bits()).step_by(97) {
            let light = f32::from_bits(bits);
            assert_eq!(code(light), exact(light), "{light}");
        }
    }

    #[test]
    fn codes_change_at_their_borders() {
        for higher in 1..=255 {
            let border = border(higher);
            assert_eq!((code(border.next_down()), code(border)), (higher - 1, higher));
        }
    }

    #[test]
    fn no_slot_has_two_borders() {
        for higher in 1..255 {
            assert_ne!(slot_of(border(higher)), slot_of(border(higher + 1)));
        }
    }

    #[test]
    fn not_a_number_and_out_of_range_are_tamed() {
        assert_eq!([f32::NAN, -1.0, 0.0, f32::INFINITY, 2.0].map(code), [0, 0, 0, 255, 255]);
        assert_eq!(
            [f64::NAN, -1.0, 0.0, f64::INFINITY, 2.0].map(|light| encode(light) as f32),
            [0.0, 0.0, 0.0, 1.0, 1.0]
        );
    }
}
