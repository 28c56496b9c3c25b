//! sRGB's transfer function (IEC 61966-2-1), both ways.

/// Light, 0 to 1, of a code, 0 to 1.
pub(super) fn decode(code: f64) -> f64 {
    if code <= 0.04045 {
        code / 12.92
    } else {
        ((code + 0.055) / 1.055).powf(2.4)
    }
}

/// Undoes [`decode`].
pub(super) fn encode(light: f64) -> f64 {
    if light <= 0.003_130_8 {
        12.92 * light
    } else {
        1.055 * light.powf(1.0 / 2.4) - 0.055
    }
}
