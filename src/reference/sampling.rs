//! Sample positions in a pixel: independent, stratified (correlated multi-jittered sampling; Kensler, Pixar TM 13-01, 2013) and Sobol's
//! sequence with Owen's scrambling. The integers are those of `shaders/shared/random.glsl`, so that both renderers look through the same points.

use crate::scene::{Filter, Sampler, View};

/// PCG hash (Jarzynski and Olano, JCGT 9(3) 2020).
fn pcg(value: u32) -> u32 {
    let state = value.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = (state >> ((state >> 28) + 4) ^ state).wrapping_mul(277_803_737);
    word >> 22 ^ word
}

/// [0, 1) with 24 bits.
fn unit(bits: u32) -> f64 {
    f64::from(bits >> 8) / f64::from(1 << 24)
}

/// The permutation of `0..count` that `seed` selects, at `index`.
fn permute(mut index: u32, count: u32, seed: u32) -> u32 {
    let mask = u32::MAX.checked_shr((count - 1).leading_zeros()).unwrap_or(0);
    loop {
        index = index.wrapping_add(seed) & mask;
        index = index.wrapping_mul(seed | 1) & mask;
        index ^= index >> 3;
        index = index.wrapping_mul(0x9e37_79b1) & mask;
        index ^= index >> 5;
        index = index.wrapping_mul(pcg(seed) | 1) & mask;
        index ^= index >> 2;
        if index < count {
            return index;
        }
    }
}

/// A filter made ready.
pub(super) struct Spread {
    steps: Vec<[f32; 2]>,
    zero: f64,
    /// The mean of a sample's weight.
    pub mean_weight: f64,
}

impl Spread {
    pub(super) fn new(view: &View) -> Self {
        let filter = if view.samples == 1 { Filter::Box } else { view.filter };
        Self { steps: filter.steps(), zero: filter.zero(), mean_weight: filter.mean_weight() }
    }
}

/// Position of sample `index` relative to its pixel's corner, and its weight.
pub(super) fn position(view: &View, filter: &Spread, pixel: u32, index: u32) -> (f64, f64, f64) {
    let seed = pcg(pixel.wrapping_add(pcg(view.seed)));
    let (x, y) = match view.sampler {
        Sampler::Independent => {
            let random = |salt: u32| unit(pcg(seed.wrapping_add(pcg(index.wrapping_mul(2).wrapping_add(salt)))));
            (random(0), random(1))
        }
        Sampler::Sobol => sobol(seed, index),
        Sampler::Stratified => stratified(view, seed, index),
    };
    if view.filter == Filter::Box {
        return (x, y, 1.0);
    }
    let spread = |position: f64| {
        let place = position * filter.steps.len() as f64;
        let [start, end] = filter.steps[place as usize].map(f64::from);
        start + (end - start) * place.fract()
    };
    let (x, y) = (spread(x), spread(y));
    let is_negative = |x: f64| x.abs() > filter.zero;
    (0.5 + x, 0.5 + y, if is_negative(x) == is_negative(y) { 1.0 } else { -1.0 })
}

/// Owen's scrambling of bits whose lowest is the most significant (Laine and Karras 2011; constants of Vegdahl 2021).
fn scramble(mut bits: u32, seed: u32) -> u32 {
    bits ^= bits.wrapping_mul(0x3d20_adea);
    bits = bits.wrapping_add(seed).wrapping_mul(seed >> 16 | 1);
    bits ^= bits.wrapping_mul(0x0552_6c56);
    bits ^ bits.wrapping_mul(0x53a2_2864)
}

/// Two dimensions of Sobol's sequence, scrambled (Burley, JCGT 9(4) 2020). The second dimension by its direction numbers, each the one before
/// exclusive-ored with itself shifted.
fn sobol(seed: u32, index: u32) -> (f64, f64) {
    let mut direction = 1_u32 << 31;
    let mut second = 0;
    for bit in 0..32 {
        if index >> bit & 1 == 1 {
            second ^= direction;
        }
        direction ^= direction >> 1;
    }
    let place = |bits: u32, salt: u32| unit(scramble(bits, pcg(seed.wrapping_add(salt))).reverse_bits());
    (place(index, 1), place(second.reverse_bits(), 2))
}

/// A set of stratified positions.
fn stratified(view: &View, seed: u32, index: u32) -> (f64, f64) {
    let (columns, rows) = view.strata();
    let place = permute(index, view.samples, seed);
    let (column, row) = (place % columns, place / columns);
    let sub_column = permute(row, rows, pcg(seed.wrapping_add(1)));
    let sub_row = permute(column, columns, pcg(seed.wrapping_add(2)));
    let jitter = |salt: u32| unit(pcg(seed ^ pcg(index.wrapping_mul(4).wrapping_add(salt))));
    let along = |cell: u32, sub: u32, salt: u32, cells: u32, subs: u32| {
        (f64::from(cell) + (f64::from(sub) + jitter(salt)) / f64::from(subs)) / f64::from(cells)
    };
    (along(column, sub_column, 3, columns, rows), along(row, sub_row, 5, rows, columns))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{built_in, CameraChoice, Soup, View};

    #[test]
    fn permutations_permute() {
        for count in 1..200 {
            let mut seen = vec![false; count as usize];
            (0..count).for_each(|index| seen[permute(index, count, 0x1234 + count) as usize] = true);
            assert!(seen.iter().all(|seen| *seen), "{count}");
        }
    }

    #[test]
    fn each_cell_column_and_row_holds_one_sample() {
        let scene = built_in("table").unwrap();
        let camera = scene.camera(&Soup::default(), &CameraChoice::Auto, glam::DVec3::Y, None, 1.0).unwrap();
        for samples in [2, 3, 4, 7, 12, 16, 64, 100] {
            let view = View::new(&scene, camera, (8, 8), samples, 0).unwrap();
            let (columns, rows) = view.strata();
            let points: Vec<_> = (0..samples).map(|index| stratified(&view, 17, index)).collect();
            let distinct = |key: &dyn Fn(&(f64, f64)) -> u64| {
                points.iter().map(key).collect::<std::collections::HashSet<_>>().len()
            };
            let n = f64::from(samples);
            let cell = |p: &(f64, f64)| (p.0 * f64::from(columns)) as u64 + 1000 * (p.1 * f64::from(rows)) as u64;
            assert_eq!(distinct(&cell), points.len(), "cells of {samples}");
            assert_eq!(distinct(&|p| (p.0 * n) as u64), points.len(), "columns of {samples}");
            assert_eq!(distinct(&|p| (p.1 * n) as u64), points.len(), "rows of {samples}");
        }
    }

    /// Every 2^m successive samples from a multiple of 2^m on: one in each box of area 2^-m, whatever the box's shape.
    #[test]
    fn sobol_s_sequence_is_a_net_in_all_its_blocks() {
        for seed in [0, 1, 0xdead_beef] {
            for m in 0..9 {
                for block in [0, 1, 5] {
                    let points: Vec<_> = (block << m..(block + 1) << m).map(|index| sobol(seed, index)).collect();
                    for across in 0..=m {
                        let (columns, rows) = (f64::from(1 << across), f64::from(1 << (m - across)));
                        let cells = points.iter().map(|(x, y)| ((x * columns) as u64, (y * rows) as u64));
                        let distinct = cells.collect::<std::collections::HashSet<_>>().len();
                        assert_eq!(distinct, 1 << m, "{seed} {m} {block} {across}");
                    }
                }
            }
        }
    }
}
