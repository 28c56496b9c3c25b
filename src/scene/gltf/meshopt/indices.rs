//! Modes TRIANGLES and INDICES.

use super::input::Input;

/// The last sixteen entries of something, the newest first. Entries never written read as the largest index, which no mesh has.
struct Recent<T> {
    entries: [T; 16],
    next: usize,
}

impl<T: Copy> Recent<T> {
    fn new(empty: T) -> Self {
        Self { entries: [empty; 16], next: 0 }
    }

    fn push(&mut self, entry: T) {
        self.entries[self.next % 16] = entry;
        self.next = (self.next + 1) % 16;
    }

    /// Entry `age`, less than 16, where 0 is the newest.
    fn get(&self, age: u8) -> T {
        self.entries[(self.next + 15 - usize::from(age)) % 16]
    }
}

/// State of the decoder of triangles.
struct Triangles<'a> {
    data: Input<'a>,
    edges: Recent<[u32; 2]>,
    vertices: Recent<u32>,
    /// The vertex that was not named yet.
    next: u32,
    /// The last that was named by its difference.
    last: u32,
}

impl Triangles<'_> {
    fn fresh(&mut self) -> u32 {
        let vertex = self.next;
        self.next = self.next.wrapping_add(1);
        vertex
    }

    fn explicit(&mut self) -> Result<u32, String> {
        let delta = self.data.varint()?;
        self.last = self.last.wrapping_add((delta >> 1) ^ (delta & 1).wrapping_neg());
        Ok(self.last)
    }

    /// A vertex by four bits: 0 is fresh, 15 explicit, any other a recent one. Also whether it is to be remembered.
    fn vertex(&mut self, code: u8) -> Result<(u32, bool), String> {
        match code {
            0 => Ok((self.fresh(), true)),
            15 => Ok((self.explicit()?, true)),
            recent => Ok((self.vertices.get(recent - 1), false)),
        }
    }

    fn triangle(&mut self, code: u8, table: &[u8]) -> Result<[u32; 3], String> {
        let (high, low) = (code >> 4, code & 15);
        if high < 15 {
            self.on_an_edge(high, low)
        } else if low < 14 {
            self.apart(0, table[usize::from(low)])
        } else {
            let pair = self.data.byte()?;
            if pair == 0 {
                self.next = 0;
            }
            self.apart(if low == 14 { 0 } else { 15 }, pair)
        }
    }

    fn on_an_edge(&mut self, edge: u8, third: u8) -> Result<[u32; 3], String> {
        let [a, b] = self.edges.get(edge);
        let (c, is_new) = match third {
            0 => (self.fresh(), true),
            13 | 14 => {
                self.last = if third == 13 { self.last.wrapping_sub(1) } else { self.last.wrapping_add(1) };
                (self.last, true)
            }
            15 => (self.explicit()?, true),
            recent => (self.vertices.get(recent), false),
        };
        self.edges.push([c, b]);
        self.edges.push([a, c]);
        if is_new {
            self.vertices.push(c);
        }
        Ok([a, b, c])
    }

    fn apart(&mut self, first: u8, pair: u8) -> Result<[u32; 3], String> {
        let (a, _) = self.vertex(first)?;
        let (b, b_is_new) = self.vertex(pair >> 4)?;
        let (c, c_is_new) = self.vertex(pair & 15)?;
        for edge in [[b, a], [c, b], [a, c]] {
            self.edges.push(edge);
        }
        for (vertex, is_new) in [(a, true), (b, b_is_new), (c, c_is_new)] {
            if is_new {
                self.vertices.push(vertex);
            }
        }
        Ok([a, b, c])
    }
}

/// Decodes `count` corners of triangles into indices of `stride` bytes, 2 or 4.
pub(super) fn decode_triangles(bytes: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, String> {
    let [0xe1, rest @ ..] = bytes else { return Err("the compressed data do not begin as triangles do".into()) };
    let mut input = Input(rest);
    let codes = input.take(count / 3)?;
    let split = input.0.len().checked_sub(16).ok_or("the compressed data end before their tail")?;
    let (data, table) = input.0.split_at(split);
    let is_known = |pair: &u8| pair >> 4 != 15 && pair & 15 != 15;
    if !table.iter().all(is_known) {
        return Err("the table of the compressed triangles is not valid".into());
    }
    let mut triangles = Triangles {
        data: Input(data),
        edges: Recent::new([u32::MAX; 2]),
        vertices: Recent::new(u32::MAX),
        next: 0,
        last: 0,
    };
    let mut indices = Vec::with_capacity(count * stride);
    for code in codes {
        for corner in triangles.triangle(*code, table)? {
            indices.extend_from_slice(&corner.to_le_bytes()[..stride]);
        }
    }
    triangles.data.finish()?;
    Ok(indices)
}

/// Decodes `count` indices of `stride` bytes, 2 or 4, each a difference to one of two before it.
pub(super) fn decode_indices(bytes: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, String> {
    let [0xd1, rest @ ..] = bytes else { return Err("the compressed data do not begin as indices do".into()) };
    let split = rest.len().checked_sub(4).ok_or("the compressed data end before their tail")?;
    let mut input = Input(&rest[..split]);
    if count > split {
        return Err("the compressed data end too early".into());
    }
    let mut last = [0_u32; 2];
    let mut indices = Vec::with_capacity(count * stride);
    for _ in 0..count {
        let code = input.varint()?;
        let baseline = &mut last[(code & 1) as usize];
        *baseline = baseline.wrapping_add((code >> 2) ^ (code >> 1 & 1).wrapping_neg());
        indices.extend_from_slice(&baseline.to_le_bytes()[..stride]);
    }
    input.finish()?;
    Ok(indices)
}
