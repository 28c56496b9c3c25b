//! Accessors: typed elements in buffers, with every component type, normalisation, stride and sparse replacement.

use super::Document;
use crate::error::Result;
use ::gltf::json::accessor::{ComponentType, Type};
use ::gltf::json::{buffer, validation::Checked, Index};
use glam::{DMat4, Mat4};
use rayon::prelude::*;

/// Most elements of an accessor that no buffer view backs: there the count alone decides what is allocated.
const MOST_UNBACKED: u64 = 1 << 20;
/// Elements that one thread reads at once.
const AT_ONCE: usize = 1 << 14;
/// Most numbers that all meshes and textures of a document are made of, unless something else is asked for: 2 GiB. Many primitives may name the same
/// bytes.
pub(super) const MOST_NUMBERS: u64 = 1 << 29;

/// Values of an accessor, `components` to an element.
#[derive(Clone)]
pub(super) struct Elements<T> {
    pub components: usize,
    pub values: Vec<T>,
}

/// What is needed to find elements: bytes of the view from the first element on, and the distances.
struct Layout<'a> {
    bytes: &'a [u8],
    stride: usize,
}

/// Components of `count` elements, each converted.
fn converted<T: Component>(
    layout: &Layout,
    kind: ComponentType,
    count: usize,
    components: usize,
    convert: &(impl Fn(ComponentType, &[u8]) -> T + Sync),
) -> Vec<T> {
    let element = kind.size() * components;
    let mut values = vec![T::zeroed(); count * components];
    values.par_chunks_mut(AT_ONCE * components).enumerate().for_each(|(chunk, values)| {
        for (i, values) in values.chunks_exact_mut(components).enumerate() {
            let bytes = &layout.bytes[(chunk * AT_ONCE + i) * layout.stride..][..element];
            for (value, component) in values.iter_mut().zip(bytes.chunks_exact(kind.size())) {
                *value = convert(kind, component);
            }
        }
    });
    values
}

/// What components are read as.
trait Component: bytemuck::Pod + Send + Sync {
    /// The type that is stored in the same way.
    const KIND: ComponentType;
}

impl Component for f32 {
    const KIND: ComponentType = ComponentType::F32;
}

impl Component for u32 {
    const KIND: ComponentType = ComponentType::U32;
}

/// Reads one component as a number; integers are divided by their largest value if normalised (glTF 2.0, 3.11).
fn number(kind: ComponentType, normalized: bool, bytes: &[u8]) -> f32 {
    let scaled = |value: f32, largest: f32| if normalized { (value / largest).max(-1.0) } else { value };
    match kind {
        ComponentType::I8 => scaled(f32::from(bytes[0] as i8), 127.0),
        ComponentType::U8 => scaled(f32::from(bytes[0]), 255.0),
        ComponentType::I16 => scaled(f32::from(i16::from_le_bytes([bytes[0], bytes[1]])), 32767.0),
        ComponentType::U16 => scaled(f32::from(u16::from_le_bytes([bytes[0], bytes[1]])), 65535.0),
        ComponentType::U32 => integer(kind, bytes) as f32,
        ComponentType::F32 => f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
    }
}

/// Reads one component as an unsigned integer; signed and float ones are no indices.
fn integer(kind: ComponentType, bytes: &[u8]) -> u32 {
    match kind {
        ComponentType::U8 => bytes[0].into(),
        ComponentType::U16 => u16::from_le_bytes([bytes[0], bytes[1]]).into(),
        ComponentType::U32 => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
        _ => u32::MAX,
    }
}

impl Document<'_> {
    /// Elements as floats.
    pub fn floats(&self, index: usize) -> Result<Elements<f32>> {
        self.spend(index)?;
        let accessor = &self.root.accessors[index];
        let normalized = accessor.normalized;
        self.read(index, |kind, bytes| number(kind, normalized, bytes))
    }

    /// Elements of a scalar accessor of unsigned integers.
    pub fn indices(&self, index: usize) -> Result<Vec<u32>> {
        let refuse = |message: &str| Err(self.refuse(format!("accessors[{index}]: {message}")));
        self.spend(index)?;
        let elements = self.read(index, integer)?;
        let restart = match &self.root.accessors[index].component_type {
            Checked::Valid(kind) if kind.0 == ComponentType::U8 => u32::from(u8::MAX),
            Checked::Valid(kind) if kind.0 == ComponentType::U16 => u32::from(u16::MAX),
            Checked::Valid(kind) if kind.0 == ComponentType::U32 => u32::MAX,
            _ => return refuse("indices must be unsigned integers"),
        };
        if elements.components != 1 {
            return refuse("indices must be scalars");
        }
        if elements.values.contains(&restart) {
            return refuse(&format!("an index is {restart}, which is reserved for primitive restart"));
        }
        Ok(elements.values)
    }

    /// Elements of an accessor of four-component unsigned integers: the joints of each vertex.
    pub fn joints(&self, index: usize) -> Result<Vec<u32>> {
        self.spend(index)?;
        let elements = self.read(index, integer)?;
        let kind = &self.root.accessors[index].component_type;
        let fits = matches!(kind, Checked::Valid(kind) if matches!(kind.0, ComponentType::U8 | ComponentType::U16));
        if elements.components != 4 || !fits {
            return Err(
                self.refuse(format!("accessors[{index}]: joints must be four unsigned integers of 8 or 16 bits"))
            );
        }
        Ok(elements.values)
    }

    /// Elements of an accessor of 4 × 4 float matrices, column-major.
    pub fn matrices(&self, index: usize) -> Result<Vec<DMat4>> {
        let kind = &self.root.accessors[index].component_type;
        let is_float = matches!(kind, Checked::Valid(kind) if kind.0 == ComponentType::F32);
        let Elements { components, values } = self.floats(index)?;
        if components != 16 || !is_float {
            return Err(self.refuse(format!("accessors[{index}]: matrices must be MAT4 of floats")));
        }
        Ok(values.chunks_exact(16).map(|columns| Mat4::from_cols_slice(columns).as_dmat4()).collect())
    }

    /// Takes an accessor's numbers from what the document may still allocate.
    fn spend(&self, index: usize) -> Result<()> {
        self.spend_numbers(self.numbers(index))
    }

    /// Numbers that the document may still allocate.
    pub fn numbers_left(&self) -> u64 {
        self.most_numbers.saturating_sub(self.spent.get())
    }

    pub fn spend_numbers(&self, numbers: u64) -> Result<()> {
        let spent = self.spent.get().saturating_add(numbers);
        self.spent.set(spent);
        if spent > self.most_numbers {
            let bytes = 4 * self.most_numbers;
            return Err(self.refuse(format!("its meshes and textures take more than {bytes} bytes (see --max-memory)")));
        }
        Ok(())
    }

    /// Numbers in an accessor, as it claims.
    pub fn numbers(&self, index: usize) -> u64 {
        let accessor = &self.root.accessors[index];
        let components = match &accessor.type_ {
            Checked::Valid(shape) => shape.multiplicity() as u64,
            Checked::Invalid => 1,
        };
        accessor.count.0.saturating_mul(components)
    }

    /// Elements as floats that are looked at and not kept.
    pub fn glance(&self, index: usize, normalized: bool) -> Option<Elements<f32>> {
        self.read(index, |kind, bytes| number(kind, normalized, bytes)).ok()
    }

    fn read<T: Component>(
        &self,
        index: usize,
        convert: impl Fn(ComponentType, &[u8]) -> T + Sync,
    ) -> Result<Elements<T>> {
        let accessor = &self.root.accessors[index];
        let refuse = |message: &str| self.refuse(format!("accessors[{index}]: {message}"));
        let (Checked::Valid(kind), Checked::Valid(shape)) = (&accessor.component_type, &accessor.type_) else {
            return Err(refuse("its type or component type is unknown"));
        };
        let (kind, components) = (kind.0, shape.multiplicity());
        // Their columns may be padded to 4 bytes; those of MAT4 never are.
        if matches!(shape, Type::Mat2 | Type::Mat3) {
            return Err(refuse("matrices of 2 or 3 columns are not read"));
        }
        let element = kind.size() * components;
        let values = match accessor.buffer_view {
            Some(view) => {
                let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
                let layout = self.layout(index, view, offset, accessor.count.0, element)?;
                let count = accessor.count.0 as usize;
                let is_as_in_memory = kind == T::KIND && layout.stride == element && cfg!(target_endian = "little");
                if is_as_in_memory {
                    bytemuck::pod_collect_to_vec(&layout.bytes[..count * element])
                } else {
                    converted(&layout, kind, count, components, &convert)
                }
            }
            None if accessor.count.0 > MOST_UNBACKED => return Err(refuse("it has no data for so many elements")),
            None => vec![T::zeroed(); accessor.count.0 as usize * components],
        };
        let mut elements = Elements { components, values };
        self.replace_sparse(index, kind, &mut elements, convert)?;
        Ok(elements)
    }

    /// The bytes of `count` elements of `element` bytes from `offset` in a view, all of them there.
    fn layout(
        &self,
        accessor: usize,
        view: Index<buffer::View>,
        offset: u64,
        count: u64,
        element: usize,
    ) -> Result<Layout<'_>> {
        let refuse = |message: String| self.refuse(format!("accessors[{accessor}]: {message}"));
        let view_index = view.value();
        let view = &self.root.buffer_views[view_index];
        let stride = view.byte_stride.map_or(element, |stride| stride.0);
        if stride < element {
            return Err(refuse(format!(
                "bufferViews[{view_index}].byteStride {stride} is less than an element's {element} bytes"
            )));
        }
        let view_bytes = self.view_bytes(view_index).map_err(refuse)?;
        let needed = count
            .checked_sub(1)
            .and_then(|steps| steps.checked_mul(stride as u64)?.checked_add(element as u64)?.checked_add(offset));
        match needed {
            Some(needed) if needed <= view_bytes.len() as u64 => {
                Ok(Layout { bytes: &view_bytes[offset as usize..], stride })
            }
            _ => Err(refuse(format!(
                "{count} elements do not fit into the {} bytes of bufferViews[{view_index}]",
                view_bytes.len()
            ))),
        }
    }

    fn replace_sparse<T: Copy>(
        &self,
        index: usize,
        kind: ComponentType,
        elements: &mut Elements<T>,
        convert: impl Fn(ComponentType, &[u8]) -> T,
    ) -> Result<()> {
        let Some(sparse) = &self.root.accessors[index].sparse else { return Ok(()) };
        let refuse = |message: &str| self.refuse(format!("accessors[{index}].sparse: {message}"));
        let Checked::Valid(index_kind) = &sparse.indices.component_type else {
            return Err(refuse("its indices are of an unknown type"));
        };
        let index_kind = index_kind.0;
        let (count, components) = (sparse.count.0, elements.components);
        if count > self.root.accessors[index].count.0 {
            return Err(refuse("it replaces more elements than there are"));
        }
        let element = kind.size() * components;
        let places =
            self.layout(index, sparse.indices.buffer_view, sparse.indices.byte_offset.0, count, index_kind.size())?;
        let values = self.layout(index, sparse.values.buffer_view, sparse.values.byte_offset.0, count, element)?;
        for i in 0..count as usize {
            let place = integer(index_kind, &places.bytes[i * places.stride..]) as usize;
            let target = elements
                .values
                .get_mut(place.saturating_mul(components)..(place.saturating_add(1)).saturating_mul(components));
            let target = target.ok_or_else(|| refuse("an index lies beyond the accessor's end"))?;
            let bytes = &values.bytes[i * values.stride..][..element];
            for (value, component) in target.iter_mut().zip(bytes.chunks_exact(kind.size())) {
                *value = convert(kind, component);
            }
        }
        Ok(())
    }
}
