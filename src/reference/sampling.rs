//! Stratified positions in a pixel: correlated multi-jittered sampling (Kensler, Pixar TM 13-01, 2013). The integers are
//! those of `shaders/shared/random.glsl`, so that both renderers look through the same points.

use crate::scene::View;

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

/// Position of sample `index` in a pixel, each coordinate in [0, 1).
pub(super) fn position(view: &View, pixel: u32, index: u32) -> (f64, f64) {
    let (columns, rows) = view.strata();
    let seed = pcg(pixel);
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
            let points: Vec<_> = (0..samples).map(|index| position(&view, 17, index)).collect();
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
}
