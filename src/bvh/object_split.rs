//! Splits that give each reference to one side, by the surface area heuristic: over bins along each axis (Wald, On fast
//! construction of SAH-based bounding volume hierarchies, RT 2007), or over every place between few sorted references.

use super::references::{cells_per_unit, in_chunks, Box4, Reference};
use glam::{Mat4, Vec4};

/// Most bins along an axis; fewer where there are few references.
const BINS: usize = 32;
/// A node with so few bins needs room for no more.
const FEW_BINS: usize = 8;
/// Up to this many references every place is tried.
const SWEEP: usize = 12;

/// A split and what it costs.
#[derive(Clone, Copy, Debug)]
pub(super) struct ObjectSplit {
    /// Σ half area · references, of both sides.
    pub cost: f32,
    /// Half area of what both sides cover.
    pub overlap: f32,
    place: Place,
}

#[derive(Clone, Copy, Debug)]
enum Place {
    /// In this order so many go left.
    Sorted { order: [u8; SWEEP], left: usize },
    /// Bins up to `last_left` go left.
    Binned { binning: Binning, axis: usize, last_left: usize },
}

fn bin_count(references: usize) -> usize {
    (4 + references / 16).min(BINS)
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
        let bins = bin_count(count);
        // The outer bins are half as wide as the others.
        let scale = cells_per_unit(bins - 1, centers.hi - centers.lo);
        Self { origin: centers.lo, scale, bins }
    }

    /// The bin along each axis, `FIRST_BIN` added.
    fn place(&self, reference: &Reference) -> Vec4 {
        (reference.doubled_center() - self.origin) * self.scale + Vec4::splat(FIRST_BIN)
    }
}

/// Adding 2²³ rounds to a whole number and leaves it in the mantissa: cheaper than a checked conversion.
const FIRST_BIN: f32 = 8_388_608.0;

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
    } else if bin_count(references.len()) <= FEW_BINS {
        binned::<FEW_BINS>(references, centers)
    } else {
        binned::<BINS>(references, centers)
    }
}

impl ObjectSplit {
    /// Moves what goes left to the front and returns how much that is; the order is a function of the references alone.
    pub fn partition(&self, references: &mut [Reference]) -> usize {
        match self.place {
            Place::Sorted { order, left } => {
                let mut before = [Reference::NONE; SWEEP];
                before[..references.len()].copy_from_slice(references);
                for (reference, from) in references.iter_mut().zip(order) {
                    *reference = before[usize::from(from)];
                }
                left
            }
            Place::Binned { binning, axis, last_left } => {
                let last = Vec4::splat(FIRST_BIN + last_left as f32);
                partition(references, |one| binning.place(one).cmple(last).test(axis))
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

/// Every place along every axis, the axes side by side: lane k of a vector is what lies along axis k.
fn sweep(references: &[Reference]) -> Option<ObjectSplit> {
    let count = references.len();
    let order = orders(references);
    let mut boxes = [Boxes3::EMPTY; SWEEP];
    for (place, of_axes) in boxes[..count].iter_mut().enumerate() {
        *of_axes = Boxes3::of(order.map(|order| &references[usize::from(order[place])]));
    }
    let mut right_costs = [Vec4::ZERO; SWEEP];
    let mut right = Boxes3::EMPTY;
    for place in (1..count).rev() {
        right = right.union(&boxes[place]);
        right_costs[place] = right.half_areas() * (count - place) as f32;
    }
    let mut left = Boxes3::EMPTY;
    let (mut costs, mut places) = (Vec4::INFINITY, Vec4::ZERO);
    for place in 1..count {
        left = left.union(&boxes[place - 1]);
        let cost = left.half_areas() * place as f32 + right_costs[place];
        places = Vec4::select(cost.cmplt(costs), Vec4::splat(place as f32), places);
        costs = costs.min(cost);
    }
    let axis = costs.truncate().min_position();
    let place = places[axis] as usize;
    let side = |order: &[u8]| {
        order.iter().fold(Box4::EMPTY, |all, index| all.union(&references[usize::from(*index)].bounds()))
    };
    let (left, right) = order[axis][..count].split_at(place);
    let overlap = side(left).intersection(&side(right)).half_area();
    let place = Place::Sorted { order: order[axis], left: place };
    (count > 1).then_some(ObjectSplit { cost: costs[axis], overlap, place })
}

/// Three boxes, lane k the one along axis k.
#[derive(Clone, Copy)]
struct Boxes3 {
    lo: [Vec4; 3],
    hi: [Vec4; 3],
}

impl Boxes3 {
    const EMPTY: Self = Self { lo: [Vec4::INFINITY; 3], hi: [Vec4::NEG_INFINITY; 3] };

    fn of(references: [&Reference; 3]) -> Self {
        let [a, b, c] = references.map(Reference::bounds);
        let lanes = |a: Vec4, b: Vec4, c: Vec4| {
            let turned = Mat4::from_cols(a, b, c, Vec4::ZERO).transpose();
            [turned.x_axis, turned.y_axis, turned.z_axis]
        };
        Self { lo: lanes(a.lo, b.lo, c.lo), hi: lanes(a.hi, b.hi, c.hi) }
    }

    fn union(&self, other: &Self) -> Self {
        let mut both = *self;
        for axis in 0..3 {
            both.lo[axis] = both.lo[axis].min(other.lo[axis]);
            both.hi[axis] = both.hi[axis].max(other.hi[axis]);
        }
        both
    }

    fn half_areas(&self) -> Vec4 {
        let [x, y, z] = [0, 1, 2].map(|axis| self.hi[axis] - self.lo[axis]);
        x * y + y * z + z * x
    }
}

/// Places of at most SWEEP references in the order of their centres along each axis. Each is put where as many are before it as have smaller ones:
/// more comparisons than sorting takes, but none that a processor would have to predict.
fn orders(references: &[Reference]) -> [[u8; SWEEP]; 3] {
    let mut keys = [Vec4::ZERO; SWEEP];
    let mut ranks = [Vec4::ZERO; SWEEP];
    for (index, reference) in references.iter().enumerate() {
        keys[index] = reference.doubled_center();
        let mut rank = Vec4::ZERO;
        for before in 0..index {
            let is_after = Vec4::select(keys[before].cmple(keys[index]), Vec4::ONE, Vec4::ZERO);
            rank += is_after;
            ranks[before] += Vec4::ONE - is_after;
        }
        ranks[index] = rank;
    }
    let mut orders = [[0; SWEEP]; 3];
    for (index, rank) in ranks[..references.len()].iter().enumerate() {
        for (axis, order) in orders.iter_mut().enumerate() {
            order[rank[axis] as usize] = index as u8;
        }
    }
    orders
}

/// With at most N bins along each axis.
fn binned<const N: usize>(references: &[Reference], centers: &Box4) -> Option<ObjectSplit> {
    let binning = Binning::over(centers, references.len());
    let fill = |references: &[Reference]| {
        let mut bins = [[Bin::EMPTY; N]; 3];
        for reference in references {
            let one = Bin { bounds: reference.bounds(), count: 1 };
            let place = binning.place(reference);
            for (bins, place) in bins.iter_mut().zip([place.x, place.y, place.z]) {
                // It is below N anyway; so that nothing has to check.
                let bin = &mut bins[place.to_bits() as usize % N];
                *bin = bin.union(&one);
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
        let mut right = [Bin::EMPTY; N];
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
                best = Some(ObjectSplit { cost, overlap, place: Place::Binned { binning, axis, last_left: index } });
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
    fn few_references_are_put_in_order_along_each_axis() {
        let center = |i: u32, axis: u32| ((i * 7 + axis * 5) % 11) as f32 - 5.0;
        for count in 1..=SWEEP as u32 {
            let at = |i: u32| Vec3::new(center(i, 0), center(i, 1), center(i, 2));
            let references: Vec<Reference> = (0..count).map(|i| Reference::new(at(i), at(i), i)).collect();
            for (axis, order) in orders(&references).into_iter().enumerate() {
                let mut expected: Vec<u8> = (0..count as u8).collect();
                // Stable: equal ones stay as they were.
                expected.sort_by(|a, b| {
                    let [a, b] = [a, b].map(|place| references[usize::from(*place)].doubled_center()[axis]);
                    a.total_cmp(&b)
                });
                assert_eq!(order[..count as usize], expected);
            }
        }
    }

    /// Of few references: the split that trying all of them one by one finds, and what goes left goes left.
    #[test]
    fn few_references_are_split_where_it_is_cheapest() {
        let hash = |i: u32| (i.wrapping_mul(2_654_435_761) >> 12) as f32 / 1_048_576.0;
        for count in 2..=SWEEP {
            let reference = |i: u32| {
                let at = |salt: u32| Vec3::new(hash(9 * i + salt), hash(9 * i + salt + 1), hash(9 * i + salt + 2));
                let lo = at(count as u32);
                Reference::new(lo, lo + at(3) * 0.2, i)
            };
            let mut references: Vec<Reference> = (0..count as u32).map(reference).collect();
            let side = |side: &[Reference]| {
                let bounds = side.iter().fold(Box4::EMPTY, |all, one| all.union(&one.bounds()));
                bounds.half_area() * side.len() as f32
            };
            let mut least = f32::INFINITY;
            for axis in 0..3 {
                let mut sorted = references.clone();
                sorted.sort_by(|a, b| a.doubled_center()[axis].total_cmp(&b.doubled_center()[axis]));
                least = (1..count).map(|left| side(&sorted[..left]) + side(&sorted[left..])).fold(least, f32::min);
            }
            let split = sweep(&references).unwrap();
            let left = split.partition(&mut references);
            let cost = side(&references[..left]) + side(&references[left..]);
            assert!(
                (cost / least - 1.0).abs() < 1e-5 && (split.cost / least - 1.0).abs() < 1e-5,
                "{count}: {cost} {least}"
            );
        }
    }
}
