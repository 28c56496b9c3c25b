//! Reading bytes from the front, never beyond their end.

/// What is left of the bytes.
pub(super) struct Input<'a>(pub &'a [u8]);

impl<'a> Input<'a> {
    pub fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let (taken, rest) = self.0.split_at_checked(count).ok_or("the compressed data end too early")?;
        self.0 = rest;
        Ok(taken)
    }

    pub fn byte(&mut self) -> Result<u8, String> {
        Ok(self.take(1)?[0])
    }

    /// An unsigned LEB128 of five bytes at most; bits beyond the 32nd are dropped.
    pub fn varint(&mut self) -> Result<u32, String> {
        let mut value = 0;
        for group in 0..5 {
            let byte = self.byte()?;
            value |= u32::from(byte & 0x7f) << (7 * group);
            if byte < 0x80 {
                return Ok(value);
            }
        }
        Err("a number is longer than five bytes".into())
    }

    /// All must have been read.
    pub fn finish(self) -> Result<(), String> {
        match self.0.len() {
            0 => Ok(()),
            left => Err(format!("{left} bytes of the compressed data are left over")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_specifications_numbers() {
        for (bytes, value) in [(&[0x7f][..], 0x7f), (&[0x81, 0x04], 0x201), (&[0xff, 0xa0, 0x05], 0x1507f)] {
            assert_eq!(Input(bytes).varint(), Ok(value), "{bytes:x?}");
        }
        assert!(Input(&[0x80; 5]).varint().is_err() && Input(&[0x80]).varint().is_err());
    }
}
