//! Mode ATTRIBUTES: blocks of elements, each byte of the element in a plane of its own, as differences to the element before.

use super::input::Input;

/// Elements whose differences share a bit width.
const GROUP: usize = 16;
/// Bit widths that a group's two header bits choose from: version 0, then version 1's control modes 0 and 1.
const WIDTHS: [[u32; 4]; 3] = [[0, 2, 4, 8], [0, 1, 2, 4], [1, 2, 4, 8]];

/// Decodes `count` elements of `stride` bytes; `stride` is a multiple of 4 up to 256.
pub(super) fn decode(bytes: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, String> {
    let (version, rest) = match bytes {
        [0xa0, rest @ ..] => (0, rest),
        [0xa1, rest @ ..] => (1, rest),
        _ => return Err("the compressed data do not begin as attributes do".into()),
    };
    let channels = if version == 0 { 0 } else { stride / 4 };
    let padded = (stride + channels).max(if version == 0 { 32 } else { 24 });
    let split = rest.len().checked_sub(padded).ok_or("the compressed data end before their tail")?;
    let (data, tail) = rest.split_at(split);
    let (baseline, modes) = tail[padded - stride - channels..].split_at(stride);
    let mut last = baseline.to_vec();
    let mut input = Input(data);
    let most = ((8192 / stride) & !(GROUP - 1)).min(256);
    let mut planes = vec![0; 4 * most];
    let mut decoded = vec![0; count * stride];
    for block in decoded.chunks_mut(most * stride) {
        let controls = input.take(channels)?;
        let elements = block.len() / stride;
        for channel in 0..stride / 4 {
            for (byte, plane) in planes.chunks_exact_mut(most).enumerate() {
                let control = controls.get(channel).map(|control| control >> (2 * byte) & 3);
                read_plane(&mut input, control, &mut plane[..elements.next_multiple_of(GROUP)], elements)?;
            }
            let mode = modes.get(channel).copied().unwrap_or(0);
            add_up(&planes, mode, block, stride, 4 * channel, &mut last)?;
        }
    }
    input.finish()?;
    Ok(decoded)
}

/// Reads the differences of one byte position; `control` is version 1's, `None` in version 0.
fn read_plane(input: &mut Input, control: Option<u8>, plane: &mut [u8], elements: usize) -> Result<(), String> {
    let widths = match control {
        None => WIDTHS[0],
        Some(0) => WIDTHS[1],
        Some(1) => WIDTHS[2],
        Some(2) => {
            plane.fill(0);
            return Ok(());
        }
        Some(_) => {
            plane[..elements].copy_from_slice(input.take(elements)?);
            return Ok(());
        }
    };
    let headers = input.take((plane.len() / GROUP).div_ceil(4))?;
    for (index, group) in plane.chunks_exact_mut(GROUP).enumerate() {
        let width = widths[usize::from(headers[index / 4] >> (2 * (index % 4)) & 3)];
        read_group(input, width, group)?;
    }
    Ok(())
}

/// Sixteen differences of `width` bits; one with all bits set stands for a whole byte behind them.
fn read_group(input: &mut Input, width: u32, group: &mut [u8]) -> Result<(), String> {
    if width == 0 {
        group.fill(0);
        return Ok(());
    }
    let packed = input.take(2 * width as usize)?;
    if width == 8 {
        group.copy_from_slice(packed);
        return Ok(());
    }
    let (per_byte, sentinel) = (8 / width as usize, (1_u8 << width) - 1);
    for (index, value) in group.iter_mut().enumerate() {
        // Single bits come from the lowest on, wider ones from the highest.
        let place = if width == 1 { index % 8 } else { (per_byte - 1 - index % per_byte) * width as usize };
        let bits = packed[index / per_byte] >> place & sentinel;
        *value = if bits == sentinel { input.byte()? } else { bits };
    }
    Ok(())
}

/// Turns four planes of differences into bytes `at..at + 4` of a block's elements.
fn add_up(planes: &[u8], mode: u8, block: &mut [u8], stride: usize, at: usize, last: &mut [u8]) -> Result<(), String> {
    let quarter = planes.len() / 4;
    let mut value: [u8; 4] = [last[at], last[at + 1], last[at + 2], last[at + 3]];
    for (index, element) in block.chunks_exact_mut(stride).enumerate() {
        let delta: [u8; 4] = std::array::from_fn(|byte| planes[byte * quarter + index]);
        value = match (mode & 15, mode >> 4) {
            (0, 0) => std::array::from_fn(|i| value[i].wrapping_add(unzigzag8(delta[i]))),
            (1, 0) => {
                let half = |i: usize| {
                    let delta = u16::from_le_bytes([delta[i], delta[i + 1]]);
                    u16::from_le_bytes([value[i], value[i + 1]]).wrapping_add(unzigzag16(delta)).to_le_bytes()
                };
                let (low, high) = (half(0), half(2));
                [low[0], low[1], high[0], high[1]]
            }
            (2, turn) => {
                let delta = u32::from_le_bytes(delta).rotate_right(turn.into());
                (u32::from_le_bytes(value) ^ delta).to_le_bytes()
            }
            _ => return Err(format!("channel mode {mode} is unknown")),
        };
        element[at..at + 4].copy_from_slice(&value);
    }
    last[at..at + 4].copy_from_slice(&value);
    Ok(())
}

fn unzigzag8(value: u8) -> u8 {
    (value >> 1) ^ (value & 1).wrapping_neg()
}

fn unzigzag16(value: u16) -> u16 {
    (value >> 1) ^ (value & 1).wrapping_neg()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_specifications_example() {
        let bytes = [0x17, 0x5f, 0xf0, 0xbc, 0x77, 0xa9, 0x21, 0x00, 0x34, 0xb5];
        let mut group = [0; GROUP];
        let mut input = Input(&bytes);
        assert_eq!(read_group(&mut input, 4, &mut group), Ok(()));
        let deltas = group.map(|value| unzigzag8(value) as i8);
        assert_eq!(deltas, [-1, -4, -3, 26, -91, 0, -6, 6, -4, -4, 5, -5, 1, -1, 0, 0]);
        assert_eq!(input.finish(), Ok(()));
    }
}
