//! Pictures that materials refer to, decoded.

/// A decoded picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Name, for messages.
    pub name: String,
    /// The format it was stored in: `PNG`, `JPEG`, `WebP`, `KTX2 (ETC1S)` or `KTX2 (UASTC)`.
    pub format: String,
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Its pixels.
    pub pixels: Pixels,
    /// Bytes that it was decoded from.
    pub bytes: usize,
}

/// Pixels as red, green, blue and alpha, row by row from the top. Grey is spread over the colours; alpha that was not stored is
/// the largest value. Neither gamma nor a colour profile was applied.
#[derive(Clone, Debug, PartialEq)]
pub enum Pixels {
    /// Eight bits a component.
    Rgba8(Vec<[u8; 4]>),
    /// Sixteen bits a component.
    Rgba16(Vec<[u16; 4]>),
}

impl Image {
    /// Halves it until neither side is greater than `most` (at least 1). Each pixel becomes the mean of those that it covers,
    /// as they are stored: of gamma-encoded colours, that of their codes and not of their light, which is a little darker.
    #[must_use]
    pub fn limited(mut self, most: u32) -> Self {
        while self.width.max(self.height) > most.max(1) {
            let size = (self.width as usize, self.height as usize);
            self.pixels = match &self.pixels {
                Pixels::Rgba8(pixels) => Pixels::Rgba8(halve(pixels, size, |mean| mean as u8)),
                Pixels::Rgba16(pixels) => Pixels::Rgba16(halve(pixels, size, |mean| mean as u16)),
            };
            (self.width, self.height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        }
        self
    }
}

/// Half as many pixels each way, at least one. Of an odd number, the pixels between two new ones count for both.
fn halve<T: Copy + Into<u32>>(
    pixels: &[[T; 4]],
    (width, height): (usize, usize),
    convert: impl Fn(u32) -> T,
) -> Vec<[T; 4]> {
    let (new_width, new_height) = ((width / 2).max(1), (height / 2).max(1));
    let covered = |new: usize, of: usize, old: usize| (new * old / of)..((new + 1) * old).div_ceil(of);
    let mut halved = Vec::with_capacity(new_width * new_height);
    for y in 0..new_height {
        for x in 0..new_width {
            let (mut sums, mut count) = ([0_u32; 4], 0);
            for row in covered(y, new_height, height) {
                for pixel in &pixels[row * width..][covered(x, new_width, width)] {
                    sums.iter_mut().zip(pixel).for_each(|(sum, value)| *sum += (*value).into());
                    count += 1;
                }
            }
            halved.push(sums.map(|sum| convert((sum + count / 2) / count)));
        }
    }
    halved
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, height: u32, pixels: Pixels) -> Image {
        Image { name: String::new(), format: "PNG".into(), width, height, pixels, bytes: 0 }
    }

    #[test]
    fn halving_takes_means() {
        let pixels = [[0, 10, 65535, 0], [2, 10, 65535, 0], [4, 10, 65535, 0], [6, 10, 65535, 65535]];
        let halved = image(2, 2, Pixels::Rgba16(pixels.to_vec())).limited(1);
        assert_eq!(halved, image(1, 1, Pixels::Rgba16(vec![[3, 10, 65535, 16384]])));
    }

    #[test]
    fn any_size_ends_within_the_limit() {
        for (width, height) in [(1, 1), (5, 3), (1, 9), (7, 1), (16, 2)] {
            let one_colour = Pixels::Rgba8(vec![[1, 2, 3, 255]; (width * height) as usize]);
            for most in [0, 1, 2, 4, 20] {
                let limited = image(width, height, one_colour.clone()).limited(most);
                assert!(limited.width.max(limited.height) <= most.max(1));
                let expected = vec![[1, 2, 3, 255]; (limited.width * limited.height) as usize];
                assert_eq!(limited.pixels, Pixels::Rgba8(expected));
            }
        }
        let row = Pixels::Rgba8(vec![[0; 4], [30; 4], [60; 4]]);
        assert_eq!(image(3, 1, row).limited(2).pixels, Pixels::Rgba8(vec![[30; 4]]));
    }
}
