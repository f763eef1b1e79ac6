//! One image of the bead: grey pixels that are owned, and when they were
//! captured.

mod channel;

pub use channel::{Channel, Sample, SampleLayout, UnknownChannel};

use super::geometry::Size;
use super::time::Stamp;

/// Grey values, row by row, without padding.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Pixels {
    /// 8 bits a pixel, 0 to 255.
    Grey8(Vec<u8>),
    /// 16 bits a pixel, 0 to 65535.
    Grey16(Vec<u16>),
}

impl Pixels {
    /// Number of pixels held.
    pub fn len(&self) -> usize {
        match self {
            Self::Grey8(values) => values.len(),
            Self::Grey16(values) => values.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A grey image and its capture time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// Counts the frames of a source from 0.
    pub seq: u64,
    /// When the light fell on the sensor, as far as the source knows.
    pub captured_at: Stamp,
    size: Size,
    pixels: Pixels,
}

/// A number of grey values that does not match the size of the image.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("an image of {width}x{height} px needs {} values, found {found}", width * height)]
pub struct WrongSize {
    /// Stated width \[px\].
    pub width: usize,
    /// Stated height \[px\].
    pub height: usize,
    /// Number of grey values.
    pub found: usize,
}

impl Frame {
    /// Takes `width * height` grey values, row by row. Fails for any other number, and for an image
    /// without pixels.
    pub fn new(
        seq: u64,
        captured_at: Stamp,
        size: Size,
        pixels: Pixels,
    ) -> Result<Self, WrongSize> {
        let Size { width, height } = size;
        if width.checked_mul(height) != Some(pixels.len()) || pixels.is_empty() {
            return Err(WrongSize { width, height, found: pixels.len() });
        }
        Ok(Self { seq, captured_at, size, pixels })
    }

    /// Number of columns \[px\].
    pub fn width(&self) -> usize {
        self.size.width
    }

    /// Number of rows \[px\].
    pub fn height(&self) -> usize {
        self.size.height
    }

    /// Columns and rows \[px\].
    pub fn size(&self) -> Size {
        self.size
    }

    /// The grey values.
    pub fn pixels(&self) -> &Pixels {
        &self.pixels
    }

    /// The grey values on a scale of 8 bits, for display and for methods that need it. 16-bit
    /// values lose their lower byte.
    pub fn to_grey8(&self) -> std::borrow::Cow<'_, [u8]> {
        match &self.pixels {
            Pixels::Grey8(values) => values.into(),
            Pixels::Grey16(values) => values.iter().map(|&v| v.to_be_bytes()[0]).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_holds_exactly_its_pixels() {
        let wrong =
            Frame::new(0, Stamp::START, Size::new(3, 2), Pixels::Grey8(vec![0; 5])).unwrap_err();
        assert_eq!(wrong.to_string(), "an image of 3x2 px needs 6 values, found 5");
        assert!(Frame::new(0, Stamp::START, Size::new(0, 0), Pixels::Grey8(vec![])).is_err());
        assert!(Frame::new(0, Stamp::START, Size::new(3, 2), Pixels::Grey16(vec![0; 6])).is_ok());
    }

    #[test]
    fn sixteen_bits_show_as_eight() {
        let frame =
            Frame::new(0, Stamp::START, Size::new(2, 1), Pixels::Grey16(vec![65535, 256])).unwrap();
        assert_eq!(frame.to_grey8().as_ref(), &[255, 1]);
    }
}
