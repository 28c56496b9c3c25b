//! Splits that give each reference to one side, by the surface area heuristic: over bins along each axis (Wald, On fast
//! construction of SAH-based bounding volume hierarchies, RT 2007), or over every place between few sorted references.

use super::references::{cells_per_unit, in_chunks, Box4, Reference};
use glam::Vec4;

/// Most bins along an axis; fewer where there are few references.
const BINS: usize = 32;
/// Up to this many references every place is tried.
const SWEEP: usize = 12;

/// A split and what it costs.
#[derive(Clone, Copy, Debug)]
pub(super) struct ObjectSplit {
    /// Σ half area · references, of both sides.
    pub cost: f32,
    /// Half area of what both sides cover.
    pub overlap: f32,
    axis: usize,
    place: Place,
}

#[derive(Clone, Copy, Debug)]
enum Place {
    /// Those whose key is below this one go left.
    Sorted(u64),
    /// Bins up to `last_left` go left.
    Binned { binning: Binning, last_left: usize },
}

/// Bin of a reference along each axis: (doubled centre − origin) · scale.
#[derive(Clone, Copy, Debug)]
struct Binning {
    origin: Vec4,
    scale: Vec4,
    bins: usize,
}

impl Binning {
    fn over(centers: &Box4, count: usize) -> Self {
        let bins = (4 + count / 16).min(BINS);
        // The outer bins are half as wide as the others.
        let scale = cells_per_unit(bins - 1, centers.hi - centers.lo);
        Self { origin: centers.lo, scale, bins }
    }

    fn bins_of(&self, reference: &Reference) -> [usize; 3] {
        // Adding 2²³ rounds to a whole number and leaves it in the mantissa: cheaper than a checked conversion.
        let place = (reference.doubled_center() - self.origin) * self.scale + Vec4::splat(8_388_608.0);
        [place.x, place.y, place.z].map(|bin| ((bin.to_bits() & 0xff) as usize).min(self.bins - 1))
    }
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Box4,
    count: usize,
}

impl Bin {
    const EMPTY: Self = Self { bounds: Box4::EMPTY, count: 0 };

    fn union(&self, other: &Self) -> Self {
        Self { bounds: self.bounds.union(&other.bounds), count: self.count + other.count }
    }

    fn cost(&self) -> f32 {
        self.bounds.half_area() * self.count as f32
    }
}

/// The cheapest split of at least two references, `None` when their centres coincide.
pub(super) fn cheapest(references: &[Reference], centers: &Box4) -> Option<ObjectSplit> {
    if references.len() <= SWEEP {
        sweep(references)
    } else {
        binned(references, centers)
    }
}

impl ObjectSplit {
    /// Moves what goes left to the front and returns how much that is; the order is a function of the references alone.
    pub fn partition(&self, references: &mut [Reference]) -> usize {
        match self.place {
            Place::Sorted(first_right) => partition(references, |one| key(one, self.axis) < first_right),
            Place::Binned { binning, last_left } => {
                partition(references, |one| binning.bins_of(one)[self.axis] <= last_left)
            }
        }
    }
}

/// Of so many references each half is partitioned by itself, in parallel.
const PARALLEL: usize = 1 << 17;

/// Moves what goes left to the front and returns how much that is. Without a branch, which no processor could predict: each is
/// swapped to the border, which it then moves or not.
fn partition(references: &mut [Reference], is_left: impl Fn(&Reference) -> bool + Copy + Sync) -> usize {
    if references.len() >= PARALLEL {
        let middle = references.len() / 2;
        let (front, back) = references.split_at_mut(middle);
        let (front_left, back_left) = rayon::join(|| partition(front, is_left), || partition(back, is_left));
        // What goes right in the front changes places with what goes left in the back.
        let moved = (middle - front_left).min(back_left);
        front[front_left..front_left + moved].swap_with_slice(&mut back[back_left - moved..back_left]);
        return front_left + back_left;
    }
    let mut left = 0;
    for index in 0..references.len() {
        let moves = is_left(&references[index]);
        references.swap(left, index);
        left += usize::from(moves);
    }
    left
}

/// What a reference is sorted by: its centre, then its primitive, as one number.
fn key(reference: &Reference, axis: usize) -> u64 {
    let bits = reference.doubled_center()[axis].to_bits();
    // Floats in order as unsigned integers: negative ones turned round, below the others.
    let ordered = if bits >> 31 == 0 { bits | 1 << 31 } else { !bits };
    u64::from(ordered) << 32 | u64::from(reference.primitive())
}

fn sweep(references: &[Reference]) -> Option<ObjectSplit> {
    let count = references.len();
    let mut best: Option<ObjectSplit> = None;
    for axis in 0..3 {
        let order = sorted(references, axis);
        let bounds = |index: usize| references[order[index].1].bounds();
        let mut right = [Box4::EMPTY; SWEEP];
        let mut side = Box4::EMPTY;
        for index in (1..count).rev() {
            side = side.union(&bounds(index));
            right[index] = side;
        }
        let mut left = Box4::EMPTY;
        for (index, right) in right[..count].iter().enumerate().skip(1) {
            left = left.union(&bounds(index - 1));
            let cost = left.half_area() * index as f32 + right.half_area() * (count - index) as f32;
            if best.is_none_or(|best| cost < best.cost) {
                let overlap = left.intersection(right).half_area();
                best = Some(ObjectSplit { cost, overlap, axis, place: Place::Sorted(order[index].0) });
            }
        }
    }
    best
}

/// Keys and places of at most SWEEP references, in the order of their keys. Each is put where as many are before it as have smaller keys:
/// more comparisons than sorting takes, but none that a processor would have to predict.
fn sorted(references: &[Reference], axis: usize) -> [(u64, usize); SWEEP] {
    let mut keys = [0; SWEEP];
    let mut ranks = [0; SWEEP];
    for (index, reference) in references.iter().enumerate() {
        keys[index] = key(reference, axis);
        for before in 0..index {
            let is_after = usize::from(keys[before] <= keys[index]);
            ranks[index] += is_after;
            ranks[before] += 1 - is_after;
        }
    }
    let mut order = [(0, 0); SWEEP];
    for index in 0..references.len() {
        order[ranks[index]] = (keys[index], index);
    }
    order
}

fn binned(references: &[Reference], centers: &Box4) -> Option<ObjectSplit> {
    let binning = Binning::over(centers, references.len());
    let fill = |references: &[Reference]| {
        let mut bins = [[Bin::EMPTY; BINS]; 3];
        for reference in references {
            let one = Bin { bounds: reference.bounds(), count: 1 };
            for (axis, bin) in binning.bins_of(reference).into_iter().enumerate() {
                bins[axis][bin] = bins[axis][bin].union(&one);
            }
        }
        bins
    };
    let bins = in_chunks(references, fill, |mut all, part| {
        for (all, part) in all.iter_mut().flatten().zip(part.iter().flatten()) {
            *all = all.union(part);
        }
        all
    });
    let mut best: Option<ObjectSplit> = None;
    for (axis, bins) in bins.iter().enumerate().filter(|(axis, _)| binning.scale[*axis] > 0.0) {
        let mut right = [Bin::EMPTY; BINS];
        for index in (1..binning.bins).rev() {
            right[index - 1] = right[index].union(&bins[index]);
        }
        let mut left = Bin::EMPTY;
        for index in 0..binning.bins - 1 {
            left = left.union(&bins[index]);
            let cost = left.cost() + right[index].cost();
            let separates = left.count > 0 && right[index].count > 0;
            if separates && best.is_none_or(|best| cost < best.cost) {
                let overlap = left.bounds.intersection(&right[index].bounds).half_area();
                best = Some(ObjectSplit { cost, overlap, axis, place: Place::Binned { binning, last_left: index } });
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    /// Points along a line, in no order.
    fn points(count: u32) -> Vec<Reference> {
        let place = |primitive: u32| Vec3::splat((primitive.wrapping_mul(2_654_435_761) >> 12) as f32);
        (0..count).map(|primitive| Reference::new(place(primitive), place(primitive), primitive)).collect()
    }

    #[test]
    fn large_and_small_nodes_are_partitioned_without_loss() {
        for count in [1, 2, 1000, PARALLEL as u32, 5 * PARALLEL as u32 + 7] {
            let mut references = points(count);
            // As many on either side, far more on one, all on one.
            for share in [0.5, 0.9, 0.1, 0.0, 1.1] {
                let is_left = |one: &Reference| one.doubled_center().x < share * 2_097_152.0;
                let expected = references.iter().filter(|one| is_left(one)).count();
                let left = partition(&mut references, is_left);
                assert_eq!(left, expected);
                assert!(references[..left].iter().all(is_left) && !references[left..].iter().any(is_left));
            }
            let mut primitives: Vec<u32> = references.iter().map(Reference::primitive).collect();
            primitives.sort_unstable();
            assert_eq!(primitives, (0..count).collect::<Vec<_>>());
        }
    }

    #[test]
    fn few_references_are_put_in_order() {
        for count in 1..=SWEEP {
            let references = points(count as u32);
            let mut expected: Vec<(u64, usize)> = (0..count).map(|index| (key(&references[index], 2), index)).collect();
            expected.sort_unstable();
            assert_eq!(sorted(&references, 2)[..count], expected);
        }
    }

    #[test]
    fn keys_are_in_the_order_of_centres_then_of_primitives() {
        let centers = [f32::MIN, -2.0, -1e-40, 0.0, 1e-40, 2.0, 3.0e38];
        let keys: Vec<u64> = centers
            .iter()
            .flat_map(|center| [3, 8].map(|primitive| (Vec3::splat(center / 2.0), primitive)))
            .map(|(center, primitive)| key(&Reference::new(center, center, primitive), 1))
            .collect();
        assert!(keys.is_sorted() && keys.windows(2).all(|two| two[0] != two[1]), "{keys:x?}");
    }
}
